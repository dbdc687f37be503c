/* Cost of a step of BallScrewTransmission through FMI 2, linked with its sources:
   usage transmission_costs RESOURCES REPETITIONS CALLS
   Sets 6 inputs, steps, gets 2 outputs or all; prints "case median least" [s]. */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "fmi2Functions.h"
#include "variables.h"

#define MOST 2001

static void silent(fmi2ComponentEnvironment e, fmi2String i, fmi2Status s, fmi2String c, fmi2String m, ...)
{
    (void)e, (void)i, (void)s, (void)c, (void)m;
}

static double now(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* a drive cycle of the screw under a load that swings */
static void inputs_at(double time, double values[6])
{
    const double w = 15.0, ratio = 8e-3 / 6.283185307179586;
    values[0] = 4.0 * (1.0 - cos(w * time));
    values[1] = 4.0 * w * sin(w * time);
    values[2] = ratio * values[0] - 3e-6 * sin(2.7 * w * time);
    values[3] = ratio * values[1] - 3e-6 * 2.7 * w * cos(2.7 * w * time);
    values[4] = 303.15 + sin(time);
    values[5] = 2000.0;
}

int main(int count, char *arguments[])
{
    static const fmi2ValueReference in[6] = {
        FIRST_REFERENCE + ANGLE,    FIRST_REFERENCE + SPEED,       FIRST_REFERENCE + POSITION,
        FIRST_REFERENCE + VELOCITY, FIRST_REFERENCE + TEMPERATURE, FIRST_REFERENCE + PRELOAD};
    static const fmi2ValueReference two[2] = {FIRST_REFERENCE + SCREW_TORQUE, FIRST_REFERENCE + NUT_FORCE};
    const fmi2CallbackFunctions callbacks = {silent, calloc, free, NULL, NULL};
    fmi2ValueReference all[VARIABLE_COUNT];
    double spent[MOST], sum = 0.0, points[1024][6], step = 1e-4, time = 0.0;
    const int repetitions = count > 3 ? atoi(arguments[2]) : 0, calls = count > 3 ? atoi(arguments[3]) : 0;
    size_t outputs = 0;
    fmi2Component fmu;

    if (repetitions < 1 || repetitions > MOST || calls < 1) {
        return 2;
    }
    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        if (model_variables[i].causality == CAUSALITY_OUTPUT && !model_variables[i].boolean) {
            all[outputs++] = FIRST_REFERENCE + (fmi2ValueReference)i;
        }
    }
    for (int i = 0; i < 1024; ++i) {
        inputs_at(i * step, points[i]);
    }
    fmu = fmi2Instantiate("costs", fmi2CoSimulation, MODEL_TOKEN, arguments[1], &callbacks, fmi2False, fmi2False);
    if (fmu == NULL || fmi2SetupExperiment(fmu, fmi2False, 0.0, 0.0, fmi2False, 0.0) != fmi2OK
        || fmi2EnterInitializationMode(fmu) != fmi2OK || fmi2ExitInitializationMode(fmu) != fmi2OK) {
        return 1;
    }
    for (int kind = 0; kind < 2; ++kind) {
        for (int r = 0; r < repetitions; ++r) {
            const double begin = now();
            for (int i = 0; i < calls; ++i) {
                double values[VARIABLE_COUNT];
                fmi2Status status = fmi2SetReal(fmu, in, 6, points[i & 1023]);
                status |= fmi2DoStep(fmu, time, step, fmi2True);
                status |= fmi2GetReal(fmu, kind == 0 ? two : all, kind == 0 ? 2 : outputs, values);
                if (status != fmi2OK) {
                    return 1;
                }
                time += step;
                sum += values[0];
            }
            spent[r] = (now() - begin) / calls;
        }
        qsort(spent, (size_t)repetitions, sizeof spent[0], ascending);
        (void)printf("%s %.9g %.9g\n", kind == 0 ? "two" : "all", spent[repetitions / 2], spent[0]);
    }
    fmi2FreeInstance(fmu);
    return isfinite(sum) ? 0 : 1;
}
