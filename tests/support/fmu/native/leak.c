/* Makes an instance and does not free it: LeakSanitizer must report it. */
#include "host.h"

static void lose(const char *resources)
{
    volatile Fmu fmu = started(2, resources, 0.0, NULL);
    fmu.instance = NULL;
    (void)fmu;
}

/* Far down the stack: what is left there is below all frames at exit, where an address would count as in use. */
static void lose_below(int frames, const char *resources)
{
    volatile char room[4096];

    room[0] = 0;
    if (frames > 0) {
        lose_below(frames - 1, resources);
    } else {
        lose(resources);
    }
    room[1] = room[0];
}

int main(int argc, char **argv)
{
    if (argc == 2) {
        lose_below(64, argv[1]);
    }
    return 0;
}
