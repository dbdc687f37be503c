/* Many steps of both FMI versions: usage soak RESOURCES STEPS [allocate]. Linked with -Wl,--wrap=malloc and so on, it
   counts what is allocated while values are set, steps are made and outputs are read: nothing. Instances made
   and freed give all memory back. Exit code 1 with a line if a check fails, as it must with `allocate`, which allocates
   in every step. */
#define _GNU_SOURCE
#include <malloc.h>
#include <math.h>

#include "host.h"

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

static void soak_random(int version, const char *resources, long steps)
{
    const Fmu fmu = started(version, resources, 0.0, &functions);
    uint64_t seed = 88172645463325252u + (uint64_t)version;
    double time = 0.0;
    long before, given;
    size_t used;

    run_random(&fmu, &seed, 10000, &time);
    given = callbacks_given;
    used = mallinfo2().uordblks;
    before = allocations;
    run_random(&fmu, &seed, steps, &time);
    REQUIRE(allocations == before);
    REQUIRE(callbacks_given == given);
    REQUIRE(mallinfo2().uordblks == used);
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
        REQUIRE(fmi2Instantiate("host", fmi2CoSimulation, "other", resources, &functions, 0, 0) == NULL);
        REQUIRE(fmi2Instantiate("host", fmi2CoSimulation, MODEL_TOKEN, "/none", &functions, 0, 0) == NULL);
        if (n == 10) {
            used = mallinfo2().uordblks;
        }
        REQUIRE(n <= 10 || mallinfo2().uordblks == used);
        REQUIRE(callbacks_given == callbacks_taken);
    }
}

int main(int argc, char **argv)
{
    const long steps = argc > 2 ? strtol(argv[2], NULL, 10) : 0;

    allocate_too = argc > 3;
    for (int version = 2; version <= 3; ++version) {
        soak_random(version, argv[1], steps);
        soak_lives(version, argv[1]);
    }
#if MODEL_PARTS
    soak_events(argv[1], steps);
#endif
    REQUIRE(callbacks_given > 0 && callbacks_given == callbacks_taken);
    (void)printf("all as it should be\n");
    return 0;
}
