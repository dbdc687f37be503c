/* Costs of a step of FMI 2 co-simulation FMUs from a C host, all cases in turn in each repetition:
   usage step_costs REPETITIONS CALLS  NATIVE_LIBRARY TOKEN RESOURCES_URI  TABLE_LIBRARY  [CASE, for a profiler]
   Compiled with MONITOR for BallScrewPreloadMonitor, whose first input and output are torque and preload.
   Prints "case median least" in seconds, one line each; single calls as "case p50 p99 p99.9 largest clock". */
#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi2Functions.h"

enum { PRELOAD, SPEED, TEMPERATURE, AXIAL_LOAD, TORQUE };
#ifdef MONITOR
#define OUTPUTS 4 /* real ones, from reference 5 on */
#else
#define OUTPUTS 12
#endif
#define POINTS 8192
#define MOST 1001

typedef struct {
    void *library;
    fmi2InstantiateTYPE *instantiate;
    fmi2FreeInstanceTYPE *release;
    fmi2SetupExperimentTYPE *setup;
    fmi2EnterInitializationModeTYPE *enter;
    fmi2ExitInitializationModeTYPE *leave;
    fmi2SetRealTYPE *set;
    fmi2GetRealTYPE *get;
    fmi2DoStepTYPE *step;
    fmi2Component instance;
    double time;
} Fmu;

enum { CYCLE, ANYWHERE, SPEED_ONLY, KINDS };

static double point[KINDS][POINTS][4]; /* a drive cycle; anywhere in the map; the cycle of speed alone */
static double sink;

static double now(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void *function(void *library, const char *name)
{
    void *found = dlsym(library, name);
    if (found == NULL) {
        (void)fprintf(stderr, "%s\n", dlerror());
        exit(2);
    }
    return found;
}

static const fmi2CallbackFunctions callbacks = {NULL, calloc, free, NULL, NULL};

#define BIND(member, name) *(void **)&fmu->member = function(fmu->library, name)

static void load(Fmu *fmu, const char *path, const char *token, const char *resources)
{
    fmu->library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (fmu->library == NULL) {
        (void)fprintf(stderr, "%s\n", dlerror());
        exit(2);
    }
    BIND(instantiate, "fmi2Instantiate");
    BIND(release, "fmi2FreeInstance");
    BIND(setup, "fmi2SetupExperiment");
    BIND(enter, "fmi2EnterInitializationMode");
    BIND(leave, "fmi2ExitInitializationMode");
    BIND(set, "fmi2SetReal");
    BIND(get, "fmi2GetReal");
    BIND(step, "fmi2DoStep");
    fmu->time = 0.0;
    fmu->instance = fmu->instantiate("bench", fmi2CoSimulation, token, resources, &callbacks, 0, 0);
    if (fmu->instance == NULL || fmu->setup(fmu->instance, 0, 0.0, 0.0, 0, 0.0) != fmi2OK
        || fmu->enter(fmu->instance) != fmi2OK || fmu->leave(fmu->instance) != fmi2OK) {
        (void)fprintf(stderr, "%s cannot be initialized\n", path);
        exit(2);
    }
}

static void unload(Fmu *fmu)
{
    fmu->release(fmu->instance);
    (void)dlclose(fmu->library);
}

/* As a master does: inputs in one call, a step, outputs in one call. */
static void run(Fmu *fmu, double (*points)[4], size_t inputs, size_t outputs, long calls)
{
    static const fmi2ValueReference known[] = {1, 2, 3, 4};
    static const fmi2ValueReference references[] = {5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
    double values[OUTPUTS];
    fmi2Status worst = fmi2OK, status;
    for (long n = 0; n < calls; ++n) {
        status = fmu->set(fmu->instance, known, inputs, points[n & (POINTS - 1)]);
        worst = status > worst ? status : worst;
        status = fmu->step(fmu->instance, fmu->time, 1e-4, fmi2True);
        worst = status > worst ? status : worst;
        status = fmu->get(fmu->instance, references, outputs, values);
        worst = status > worst ? status : worst;
        fmu->time += 1e-4;
        sink += values[0];
    }
    if (worst > fmi2Warning) {
        (void)fprintf(stderr, "a call fails\n");
        exit(2);
    }
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

typedef struct {
    const char *name;
    int fmu, points;
    size_t inputs, outputs;
} Case;

static const Case cases[] = {
    {"torque", 0, CYCLE, 3, 1},
    {"torque_axial", 0, CYCLE, 4, 1},
    {"all", 0, CYCLE, 3, OUTPUTS},
    {"all_axial", 0, CYCLE, 4, OUTPUTS},
    {"torque_speed", 0, SPEED_ONLY, 3, 1},
    {"torque_scattered", 0, ANYWHERE, 3, 1},
    {"torque_axial_scattered", 0, ANYWHERE, 4, 1},
    {"all_scattered", 0, ANYWHERE, 3, OUTPUTS},
    {"all_axial_scattered", 0, ANYWHERE, 4, OUTPUTS},
    {"table", 1, CYCLE, 3, 1},
};
#define CASES (sizeof cases / sizeof cases[0])

static void reset_load(Fmu *fmu)
{
    const fmi2ValueReference reference = 4;
    const double none = 0.0;
    (void)fmu->set(fmu->instance, &reference, 1, &none);
}

/* Quantiles of single calls; the median of two clock readings in a row is taken off. */
static void single_calls(Fmu *fmu, const Case *one, long calls)
{
    double *spent = malloc((size_t)calls * sizeof *spent), clock;
    if (spent == NULL) {
        exit(2);
    }
    for (long n = 0; n < calls; ++n) {
        const double begin = now();
        spent[n] = now() - begin;
    }
    qsort(spent, (size_t)calls, sizeof *spent, ascending);
    clock = spent[calls / 2];
    reset_load(fmu);
    run(fmu, point[one->points], one->inputs, one->outputs, 1000);
    for (long n = 0; n < calls; ++n) {
        const double begin = now();
        run(fmu, &point[one->points][n & (POINTS - 1)], one->inputs, one->outputs, 1);
        spent[n] = now() - begin - clock;
    }
    qsort(spent, (size_t)calls, sizeof *spent, ascending);
    (void)printf("single_%s %.4e %.4e %.4e %.4e %.4e\n", one->name, spent[calls / 2], spent[calls / 100 * 99],
                 spent[calls / 1000 * 999], spent[calls - 1], clock);
    free(spent);
}

static double scattered(void)
{
    return rand() / (RAND_MAX + 1.0);
}

static void make_points(void)
{
    for (int n = 0; n < POINTS; ++n) {
        const double phase = 6.283185307179586 * n / POINTS;
        double *drive = point[CYCLE][n], *any = point[ANYWHERE][n], *alone = point[SPEED_ONLY][n];
        drive[PRELOAD] = 2000.0 + 300.0 * sin(phase);
        drive[SPEED] = 150.0 * sin(4.0 * phase + 0.3);
        drive[TEMPERATURE] = 303.15 + 10.0 * sin(phase);
        drive[AXIAL_LOAD] = 900.0 * sin(7.0 * phase + 0.1);
        alone[PRELOAD] = 2000.0;
        alone[SPEED] = drive[SPEED];
        alone[TEMPERATURE] = 303.15;
        any[PRELOAD] = 100.0 + 8000.0 * scattered();
        any[SPEED] = 600.0 * scattered() - 300.0;
        any[TEMPERATURE] = 285.0 + 60.0 * scattered();
        any[AXIAL_LOAD] = 8000.0 * scattered() - 4000.0;
#ifdef MONITOR
        drive[0] = (0.9 + 0.15 * sin(phase)) * (drive[SPEED] < 0.0 ? -1.0 : 1.0);
        alone[0] = drive[SPEED] < 0.0 ? -0.9 : 0.9;
        any[0] = (0.1 + 4.0 * scattered()) * (any[SPEED] < 0.0 ? -1.0 : 1.0);
#endif
    }
}

int main(int argc, char **argv)
{
    static double spent[CASES + 1][MOST];
    Fmu fmu[2];
    long repetitions, calls;

    if (argc != 7 && argc != 8) {
        return 2;
    }
    repetitions = strtol(argv[1], NULL, 10);
    calls = strtol(argv[2], NULL, 10);
    if (repetitions < 1 || repetitions > MOST || calls < 1) {
        return 2;
    }
    make_points();
    load(&fmu[0], argv[3], argv[4], argv[5]);
    load(&fmu[1], argv[6], "", "");
    for (size_t i = 0; argc == 8 && i < CASES; ++i) { /* one case only, for a profiler */
        if (strcmp(argv[7], cases[i].name) == 0) {
            run(&fmu[cases[i].fmu], point[cases[i].points], cases[i].inputs, cases[i].outputs, calls);
        }
    }
    for (long r = 0; argc == 7 && r < repetitions; ++r) {
        for (size_t i = 0; i < CASES; ++i) {
            Fmu *const one = &fmu[cases[i].fmu];
            double begin;
            reset_load(one);
            run(one, point[cases[i].points], cases[i].inputs, cases[i].outputs, POINTS / 4);
            begin = now();
            run(one, point[cases[i].points], cases[i].inputs, cases[i].outputs, calls);
            spent[i][r] = (now() - begin) / (double)calls;
        }
        {
            Fmu fresh;
            double begin;
            unload(&fmu[0]);
            begin = now();
            load(&fresh, argv[3], argv[4], argv[5]);
            spent[CASES][r] = now() - begin;
            fmu[0] = fresh;
        }
    }
    for (size_t i = 0; argc == 7 && i <= CASES; ++i) {
        qsort(spent[i], (size_t)repetitions, sizeof spent[i][0], ascending);
        (void)printf("%s %.4e %.4e\n", i < CASES ? cases[i].name : "load", spent[i][repetitions / 2], spent[i][0]);
    }
    if (argc == 7) {
        single_calls(&fmu[0], &cases[0], 200000);
        single_calls(&fmu[0], &cases[1], 200000);
        single_calls(&fmu[0], &cases[3], 200000);
        single_calls(&fmu[1], &cases[CASES - 1], 200000);
    }
    unload(&fmu[0]);
    unload(&fmu[1]);
    return sink == sink ? 0 : 1;
}
