/* Costs of a step of the FMI 2 co-simulation FMU of the friction from a C host, all cases in turn in each repetition:
   usage step_costs REPETITIONS CALLS LIBRARY TOKEN RESOURCES_URI. Prints the seconds of all cases, a line each time. */
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
#define FUNCTIONS(X)                                                               \
    X(Instantiate) X(FreeInstance) X(SetupExperiment) X(EnterInitializationMode)   \
    X(ExitInitializationMode) X(SetReal) X(GetReal) X(DoStep)
#define DECLARE(name) static fmi2##name##TYPE *name;
#define BIND(name) check((*(void **)&name = dlsym(library, "fmi2" #name)) != NULL, #name);

FUNCTIONS(DECLARE)
static void *library;
static fmi2Component instance;
static double reached, sink, point[POINTS][4]; /* a drive cycle */

static double now(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void check(int good, const char *what)
{
    if (!good) {
        (void)fprintf(stderr, "%s fails\n", what);
        exit(2);
    }
}

static void load(char **argv)
{
    static const fmi2CallbackFunctions callbacks = {NULL, calloc, free, NULL, NULL};

    check((library = dlopen(argv[3], RTLD_NOW | RTLD_LOCAL)) != NULL, argv[3]);
    FUNCTIONS(BIND)
    reached = 0.0;
    check((instance = Instantiate("bench", fmi2CoSimulation, argv[4], argv[5], &callbacks, 0, 0)) != NULL, "an instance");
    check(SetupExperiment(instance, 0, 0.0, 0.0, 0, 0.0) == fmi2OK && EnterInitializationMode(instance) == fmi2OK
          && ExitInitializationMode(instance) == fmi2OK, "initialization");
}

static void unload(void)
{
    FreeInstance(instance);
    (void)dlclose(library);
}

/* Seconds of a call as a master does it: inputs, a step, outputs. */
static double run(size_t inputs, size_t outputs, long calls)
{
    static const fmi2ValueReference known[] = {1, 2, 3, 4};
    static const fmi2ValueReference references[] = {5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
    const double begin = now();
    double values[OUTPUTS];
    int bad = 0;

    for (long n = 0; n < calls; ++n) {
        bad |= SetReal(instance, known, inputs, point[n & (POINTS - 1)]) > fmi2Warning;
        bad |= DoStep(instance, reached, 1e-4, fmi2True) > fmi2Warning;
        bad |= GetReal(instance, references, outputs, values) > fmi2Warning;
        reached += 1e-4;
        sink += values[0];
    }
    check(!bad, "a call");
    return (now() - begin) / (double)calls;
}

int main(int argc, char **argv)
{
    static const size_t inputs[] = {3, 4, 3, 4}, outputs[] = {1, 1, OUTPUTS, OUTPUTS};
    static const fmi2ValueReference axial_load = 4;
    static const double none = 0.0;

    check(argc == 6, "usage");
    for (int n = 0; n < POINTS; ++n) {
        const double phase = 6.283185307179586 * n / POINTS;
        point[n][PRELOAD] = 2000.0 + 300.0 * sin(phase);
        point[n][SPEED] = 150.0 * sin(4.0 * phase + 0.3);
        point[n][TEMPERATURE] = 303.15 + 10.0 * sin(phase);
        point[n][AXIAL_LOAD] = 900.0 * sin(7.0 * phase + 0.1);
    }
    load(argv);
    for (long repetitions = strtol(argv[1], NULL, 10); repetitions > 0; --repetitions) {
        double begin;
        for (int i = 0; i < 4; ++i) {
            (void)SetReal(instance, &axial_load, 1, &none);
            (void)run(inputs[i], outputs[i], POINTS / 4);
            (void)printf("%.4e ", run(inputs[i], outputs[i], strtol(argv[2], NULL, 10)));
        }
        unload();
        begin = now();
        load(argv);
        (void)printf("%.4e\n", now() - begin);
    }
    unload();
    return sink == sink ? 0 : 1;
}
