/* Many steps of both FMI versions: usage soak RESOURCES STEPS [allocate]. Linked with -Wl,--wrap=malloc and so on, it
   counts what is allocated while values are set, steps are made and outputs are read. Random inputs: nothing
   allocated, no growth, and a state equal to the bit to that of a new instance with the same last inputs. Periodic
   inputs: the same outputs to the bit in every period, bristle on or resting. Prints figures; exit code 1 with a line
   if a check fails, as it must with `allocate`, which allocates in every step. */
#define _GNU_SOURCE
#include <malloc.h>
#include <math.h>
#include <time.h>
#include <unistd.h>

#include "host.h"

#define PERIOD 1000
#define LIVES 300

/* --- counting: all that the program allocates, and what goes through the callbacks of FMI 2 --- */

static long allocations, callbacks_given, callbacks_taken;
static int allocate_too;

void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *memory, size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *memory, size_t size);

void *__wrap_malloc(size_t size)
{
    ++allocations;
    return __real_malloc(size);
}

void *__wrap_calloc(size_t count, size_t size)
{
    ++allocations;
    return __real_calloc(count, size);
}

void *__wrap_realloc(void *memory, size_t size)
{
    ++allocations;
    return __real_realloc(memory, size);
}

static void *give(size_t count, size_t size)
{
    ++callbacks_given;
    return calloc(count, size);
}

static void take(void *memory)
{
    callbacks_taken += memory != NULL;
    free(memory);
}

static const fmi2CallbackFunctions functions = {NULL, give, take, NULL, NULL};

static long resident_kilobytes(void)
{
    long all = 0, resident = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    REQUIRE(file != NULL && fscanf(file, "%ld %ld", &all, &resident) == 2);
    (void)fclose(file);
    return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

/* --- random inputs --- */

static void run_random(const Fmu *fmu, uint64_t *seed, long steps, double *time)
{
    double input[INPUTS], output[OUTPUTS];

    for (long n = 0; n < steps; ++n) {
        const double step = n % 3 ? 1e-4 : 1e-3;
        random_inputs(seed, input);
        if (n % 4096 == 0) { /* parameters too; bristle or rest on and off */
            REQUIRE(set_parameter(fmu, SWITCH, n % 8192 ? SWITCH_ON : SWITCH_OFF) == 0);
            REQUIRE(set_parameter(fmu, ROUGHNESS_HEIGHT, uniform(seed, 0.0, 5e-8)) == 0);
        }
        if (allocate_too) {
            void *volatile memory = malloc(sizeof input); /* volatile, or the compiler leaves it out */
            free(memory);
        }
        REQUIRE(set_inputs(fmu, input) == 0);
        REQUIRE(do_step(fmu, *time, step) == 0);
        REQUIRE(get_outputs(fmu, output) == 0);
        *time += step;
        for (int i = 0; i < OUTPUTS; ++i) {
            REQUIRE(isfinite(output[i]));
        }
    }
}

/* The last inputs, with all parameters as given, so that nothing of the past may be left. */
static uint64_t settled(const Fmu *fmu, double time)
{
#ifdef MONITOR
    const double input[INPUTS] = {1.5, 12.0, 310.0, 700.0};
#elif defined(TRANSMISSION)
    const double ratio = model_variables[LEAD].start / 6.283185307179586;
    const double input[INPUTS] = {3.0, 12.0, ratio * 3.0 - 2e-6, ratio * 12.0, 310.0, 2500.0};
#else
    const double input[INPUTS] = {2500.0, 12.0, 310.0, 700.0};
#endif
    double output[OUTPUTS];

    REQUIRE(set_parameter(fmu, SWITCH, SWITCH_OFF) == 0);
    REQUIRE(set_parameter(fmu, ROUGHNESS_HEIGHT, 2e-8) == 0);
    REQUIRE(set_inputs(fmu, input) == 0);
    for (int n = 0; n < 2; ++n) {
        REQUIRE(do_step(fmu, time + 0.5 * n, 0.5) == 0);
        REQUIRE(get_outputs(fmu, output) == 0);
    }
    return state_hash(fmu);
}

static void soak_random(int version, const char *resources, long steps)
{
    const Fmu fmu = started(version, resources, 0.0, &functions);
    uint64_t seed = 88172645463325252u + (uint64_t)version;
    double time = 0.0;
    long before, given, resident;
    size_t used;

    run_random(&fmu, &seed, 10000, &time);
    given = callbacks_given;
    resident = resident_kilobytes();
    used = mallinfo2().uordblks;
    before = allocations;
    run_random(&fmu, &seed, steps, &time);
    REQUIRE(allocations == before);
    REQUIRE(callbacks_given == given);
    REQUIRE(mallinfo2().uordblks == used);
    (void)printf("FMI %d, %ld random steps: %ld allocations, heap %+ld bytes, resident %+ld kB\n", version, steps,
                 allocations - before, (long)(mallinfo2().uordblks - used), resident_kilobytes() - resident);
    REQUIRE(resident_kilobytes() - resident <= 256);
    time = floor(time) + 1.0;
    {
        const Fmu fresh = started(version, resources, time, &functions);
        REQUIRE(settled(&fresh, time) == settled(&fmu, time));
        ended(&fresh);
    }
    ended(&fmu);
}

/* --- periodic inputs --- */

static void soak_periodic(int version, const char *resources, long steps)
{
    static double input[PERIOD][INPUTS];
    const Fmu fmu = started(version, resources, 0.0, &functions);
    uint64_t seed = 1234567u, first = 0, transient = 0;
    long periods = steps / PERIOD, before;
    double output[OUTPUTS], local[2];
    const unsigned locals[2] = {FIRST_REFERENCE + FIRST_LOCAL, FIRST_REFERENCE + FIRST_LOCAL + 1};

    for (int n = 0; n < PERIOD; ++n) {
        random_inputs(&seed, input[n]);
    }
    REQUIRE(set_parameter(&fmu, SWITCH, SWITCH_ON) == 0);
    before = allocations;
    for (long p = 0; p < periods; ++p) {
        uint64_t sum = 0;
        for (int n = 0; n < PERIOD; ++n) {
            REQUIRE(set_inputs(&fmu, input[n]) == 0);
            REQUIRE(do_step(&fmu, 1e-4 * (double)(p * PERIOD + n), 1e-4) == 0);
            REQUIRE(get_outputs(&fmu, output) == 0 && get_values(&fmu, locals, 2, local) == 0);
            sum = hashed(sum + 1, output, sizeof output);
            sum = hashed(sum, local, sizeof local);
        }
        if (p == 0) {
            transient = sum;
        } else if (p == 1) {
            first = sum;
        }
        REQUIRE(p == 0 || sum == first);
    }
    REQUIRE(allocations == before);
    REQUIRE(transient != 0);
    (void)printf("FMI %d, %ld periods of %d steps: equal to the bit from the second on\n", version, periods, PERIOD);
    ended(&fmu);
}

/* --- event mode, early return and intermediate updates of FMI 3 --- */

#if MODEL_PARTS
static long updates;

static void update(fmi3InstanceEnvironment environment, fmi3Float64 time, fmi3Boolean settable, fmi3Boolean gettable,
                   fmi3Boolean finished, fmi3Boolean may_return, fmi3Boolean *requested, fmi3Float64 *return_time)
{
    const Fmu *fmu = environment;
    double output[OUTPUTS];

    (void)gettable, (void)finished, (void)may_return;
    ++updates;
    REQUIRE(get_outputs(fmu, output) == 0);
    if (settable && updates % 5 == 0) {
        const double speed = output[0] - 1.0;
        const unsigned reference = FIRST_REFERENCE + SPEED;
        REQUIRE(set_values(fmu, &reference, 1, &speed) == 0);
    }
    *requested = updates % 7 == 0;
    *return_time = time + 1e-5;
}

static void soak_events(const char *resources, long steps)
{
    static Fmu fmu = {3, NULL};
    uint64_t seed = 88172645463325252u;
    double input[INPUTS], output[OUTPUTS], time = 0.0;
    fmi3Boolean event = false, terminate, early;
    long before, events = 0, early_returns = 0;
    size_t used;

    fmu.instance = fmi3InstantiateCoSimulation("host", MODEL_TOKEN, resources, false, false, true, true, NULL, 0, &fmu,
                                               NULL, update);
    REQUIRE(fmu.instance != NULL);
    REQUIRE(set_parameter(&fmu, SWITCH, SWITCH_ON) == 0);
    REQUIRE(fmi3EnterInitializationMode(fmu.instance, false, 0.0, 0.0, false, 0.0) == fmi3OK);
    REQUIRE(fmi3ExitInitializationMode(fmu.instance) == fmi3OK);
    before = allocations;
    used = mallinfo2().uordblks;
    for (long n = 0; n < steps; ++n) {
        if (event || n == 0) {
            REQUIRE(n == 0 || fmi3EnterEventMode(fmu.instance) == fmi3OK);
            REQUIRE(fmi3UpdateDiscreteStates(fmu.instance, NULL, NULL, NULL, NULL, NULL, NULL) == fmi3OK);
            REQUIRE(fmi3EnterStepMode(fmu.instance) == fmi3OK);
        }
        random_inputs(&seed, input);
        REQUIRE(n % 3 != 0 || set_inputs(&fmu, input) == 0);
        REQUIRE(fmi3DoStep(fmu.instance, time, 1e-3, true, &event, &terminate, &early, &time) == fmi3OK);
        REQUIRE(get_outputs(&fmu, output) == 0);
        for (int i = 0; i < OUTPUTS; ++i) {
            REQUIRE(isfinite(output[i]));
        }
        events += event;
        early_returns += early && !event;
    }
    REQUIRE(allocations == before && mallinfo2().uordblks == used);
    REQUIRE(events > steps / 100 && early_returns > steps / 100);
    (void)printf("FMI 3, %ld steps with %ld events, %ld updates, %ld early returns: 0 allocations\n", steps, events,
                 updates, early_returns);
    ended(&fmu);
}
#endif

/* --- instances --- */

static void soak_lives(int version, const char *resources)
{
    size_t used = 0;

    for (int n = 0; n < LIVES; ++n) {
        const Fmu fmu = started(version, resources, 0.0, &functions);
        (void)state_hash(&fmu);
        ended(&fmu);
        if (n == 10) {
            used = mallinfo2().uordblks;
        }
        REQUIRE(n <= 10 || mallinfo2().uordblks == used);
        REQUIRE(callbacks_given == callbacks_taken);
    }
    (void)printf("FMI %d, %d instances made and freed: heap %+ld bytes\n", version, LIVES,
                 (long)(mallinfo2().uordblks - used));
}

int main(int argc, char **argv)
{
    long steps;

    if (argc < 3 || (steps = strtol(argv[2], NULL, 10)) < 4 * PERIOD) {
        (void)fprintf(stderr, "usage: soak RESOURCES STEPS (%d or more) [allocate]\n", 4 * PERIOD);
        return 2;
    }
    allocate_too = argc > 3;
    (void)setvbuf(stdout, malloc(65536), _IOFBF, 65536); /* no allocation by printf on the way */
    for (int version = 2; version <= 3; ++version) {
        const clock_t begin = clock();
        soak_random(version, argv[1], steps / 4);
        soak_periodic(version, argv[1], steps / 4);
#if MODEL_PARTS
        if (version == 3) {
            soak_events(argv[1], steps / 4);
        }
#endif
        (void)printf("FMI %d: %.0f s of processor time\n", version, (double)(clock() - begin) / CLOCKS_PER_SEC);
        soak_lives(version, argv[1]);
    }
    REQUIRE(callbacks_given > 0 && callbacks_given == callbacks_taken);
    return 0;
}
