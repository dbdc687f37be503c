/* Costs of a step of the FMI 2 co-simulation FMU of the friction from a C host, all cases in turn in each repetition:
   usage step_costs REPETITIONS CALLS LIBRARY TOKEN RESOURCES_URI. Prints "case median least" in seconds, one line each. */
#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "fmi2Functions.h"

enum { PRELOAD, SPEED, TEMPERATURE, AXIAL_LOAD };
#define OUTPUTS 12 /* real ones, from reference 5 on */
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

static double point[POINTS][4]; /* a drive cycle */
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
static void run(Fmu *fmu, size_t inputs, size_t outputs, long calls)
{
    static const fmi2ValueReference known[] = {1, 2, 3, 4};
    static const fmi2ValueReference references[] = {5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
    double values[OUTPUTS];
    fmi2Status worst = fmi2OK, status;
    for (long n = 0; n < calls; ++n) {
        status = fmu->set(fmu->instance, known, inputs, point[n & (POINTS - 1)]);
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
    size_t inputs, outputs;
} Case;

static const Case cases[] = {
    {"torque", 3, 1},
    {"torque_axial", 4, 1},
    {"all", 3, OUTPUTS},
    {"all_axial", 4, OUTPUTS},
};
#define CASES (sizeof cases / sizeof cases[0])

static void reset_load(Fmu *fmu)
{
    const fmi2ValueReference reference = 4;
    const double none = 0.0;
    (void)fmu->set(fmu->instance, &reference, 1, &none);
}

static void make_points(void)
{
    for (int n = 0; n < POINTS; ++n) {
        const double phase = 6.283185307179586 * n / POINTS;
        double *drive = point[n];
        drive[PRELOAD] = 2000.0 + 300.0 * sin(phase);
        drive[SPEED] = 150.0 * sin(4.0 * phase + 0.3);
        drive[TEMPERATURE] = 303.15 + 10.0 * sin(phase);
        drive[AXIAL_LOAD] = 900.0 * sin(7.0 * phase + 0.1);
    }
}

int main(int argc, char **argv)
{
    static double spent[CASES + 1][MOST];
    const long repetitions = argc == 6 ? strtol(argv[1], NULL, 10) : 0, calls = argc == 6 ? strtol(argv[2], NULL, 10) : 0;
    Fmu fmu;

    if (repetitions < 1 || repetitions > MOST || calls < 1) {
        return 2;
    }
    make_points();
    load(&fmu, argv[3], argv[4], argv[5]);
    for (long r = 0; r < repetitions; ++r) {
        double begin;
        for (size_t i = 0; i < CASES; ++i) {
            reset_load(&fmu);
            run(&fmu, cases[i].inputs, cases[i].outputs, POINTS / 4);
            begin = now();
            run(&fmu, cases[i].inputs, cases[i].outputs, calls);
            spent[i][r] = (now() - begin) / (double)calls;
        }
        unload(&fmu);
        begin = now();
        load(&fmu, argv[3], argv[4], argv[5]);
        spent[CASES][r] = now() - begin;
    }
    for (size_t i = 0; i <= CASES; ++i) {
        qsort(spent[i], (size_t)repetitions, sizeof spent[i][0], ascending);
        (void)printf("%s %.4e %.4e\n", i < CASES ? cases[i].name : "load", spent[i][repetitions / 2], spent[i][0]);
    }
    unload(&fmu);
    return sink == sink ? 0 : 1;
}
