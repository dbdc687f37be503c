/* Memory of many instances: usage instances RESOURCES COUNT. Prints for each FMI version the resident memory of one
   instance and what COUNT - 1 more add to it [kB]; all are stepped, and freed at the end. */
#define _GNU_SOURCE
#include <malloc.h>
#include <unistd.h>

#include "host.h"

#define MOST 1000

static long resident_kilobytes(void)
{
    long all = 0, resident = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    REQUIRE(file != NULL && fscanf(file, "%ld %ld", &all, &resident) == 2);
    (void)fclose(file);
    return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

static void make(Fmu *fmu, int version, const char *resources)
{
    static const double input[INPUTS] = {2000.0, 30.0, 310.0, 0.0};
    double output[OUTPUTS];

    *fmu = started(version, resources, 0.0, NULL);
    REQUIRE(set_inputs(fmu, input) == 0);
    REQUIRE(do_step(fmu, 0.0, 1e-3) == 0);
    REQUIRE(get_outputs(fmu, output) == 0);
    REQUIRE(output[0] > 0.0);
}

int main(int argc, char **argv)
{
    static Fmu fmu[MOST];
    const int count = argc == 3 ? (int)strtol(argv[2], NULL, 10) : 0;

    if (count < 2 || count > MOST) {
        return 2;
    }
    /* a map that is freed returns to the system: the next version does not find its memory */
    REQUIRE(mallopt(M_MMAP_THRESHOLD, 65536) == 1);
    for (int version = 2; version <= 3; ++version) {
        long before, one;
        (void)malloc_trim(0); /* what the other version has freed would not be seen again */
        before = resident_kilobytes();
        make(&fmu[0], version, argv[1]);
        one = resident_kilobytes();
        for (int n = 1; n < count; ++n) {
            make(&fmu[n], version, argv[1]);
        }
        (void)printf("%ld %ld\n", one - before, resident_kilobytes() - one);
        for (int n = 0; n < count; ++n) {
            ended(&fmu[n]);
        }
    }
    return 0;
}
