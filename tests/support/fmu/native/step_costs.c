/* Costs of a step of the FMI 2 co-simulation FMU of the friction from a C host, all cases in turn in each repetition:
   usage step_costs REPETITIONS CALLS RESOURCES. Prints the seconds of all cases, a line each time. */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "fmi2Functions.h"
#include "variables.h"

#define OUTPUTS 12 /* real ones, from reference 5 on */
#define POINTS 8192

static fmi2Component fmu;
static double reached, sink, point[POINTS][INPUT_COUNT]; /* a drive cycle */

static double now(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void require(int good)
{
    if (!good) {
        (void)fprintf(stderr, "a call fails\n");
        exit(2);
    }
}

static void begin(const char *resources)
{
    reached = 0.0;
    require((fmu = fmi2Instantiate("bench", fmi2CoSimulation, TOKEN, resources, NULL, 0, 0)) != NULL);
    require(fmi2SetupExperiment(fmu, 0, 0.0, 0.0, 0, 0.0) == fmi2OK && fmi2EnterInitializationMode(fmu) == fmi2OK
            && fmi2ExitInitializationMode(fmu) == fmi2OK);
}

/* Seconds of a call as a master does it: inputs, a step, outputs. */
static double run(size_t inputs, size_t outputs, long calls)
{
    static const fmi2ValueReference known[] = {1, 2, 3, 4};
    static const fmi2ValueReference references[] = {5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
    const double first = now();
    double values[OUTPUTS];
    int bad = 0;

    for (long n = 0; n < calls; ++n) {
        bad |= fmi2SetReal(fmu, known, inputs, point[n & (POINTS - 1)]) > fmi2Warning;
        bad |= fmi2DoStep(fmu, reached, 1e-4, fmi2True) > fmi2Warning;
        bad |= fmi2GetReal(fmu, references, outputs, values) > fmi2Warning;
        reached += 1e-4;
        sink += values[0];
    }
    require(!bad);
    return (now() - first) / (double)calls;
}

int main(int argc, char **argv)
{
    static const size_t inputs[] = {3, 4, 3, 4}, outputs[] = {1, 1, OUTPUTS, OUTPUTS};
    static const fmi2ValueReference axial_load = FIRST_REFERENCE + AXIAL_LOAD;
    static const double none = 0.0;

    require(argc == 4);
    for (int n = 0; n < POINTS; ++n) {
        const double phase = 6.283185307179586 * n / POINTS;
        point[n][PRELOAD] = 2000.0 + 300.0 * sin(phase);
        point[n][SPEED] = 150.0 * sin(4.0 * phase + 0.3);
        point[n][TEMPERATURE] = 303.15 + 10.0 * sin(phase);
        point[n][AXIAL_LOAD] = 900.0 * sin(7.0 * phase + 0.1);
    }
    begin(argv[3]);
    for (long repetitions = strtol(argv[1], NULL, 10); repetitions > 0; --repetitions) {
        double first;
        for (int i = 0; i < 4; ++i) {
            (void)fmi2SetReal(fmu, &axial_load, 1, &none);
            (void)run(inputs[i], outputs[i], POINTS / 4);
            (void)printf("%.4e ", run(inputs[i], outputs[i], strtol(argv[2], NULL, 10)));
        }
        fmi2FreeInstance(fmu);
        first = now();
        begin(argv[3]);
        (void)printf("%.4e\n", now() - first);
    }
    fmi2FreeInstance(fmu);
    return sink == sink ? 0 : 1;
}
