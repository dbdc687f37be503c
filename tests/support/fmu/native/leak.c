/* Makes an instance and does not free it: LeakSanitizer must report it. */
#include "host.h"

static void lose(const char *resources)
{
    volatile Fmu fmu = started(2, resources, 0.0, NULL);
    fmu.instance = NULL;
    (void)fmu;
}

int main(int argc, char **argv)
{
    if (argc == 2) {
        lose(argv[1]);
    }
    return 0;
}
