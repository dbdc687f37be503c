/* A minimal FMI 2 FMU with a table, the reference of the benchmark. Three inputs, bilinear torque over two of
   them; no state machine, no checks. Value references as those of the ball screw. */
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

#define NODES 32

typedef struct {
    double value[6]; /* by value reference: nothing, inputs, torque */
    double table[NODES][NODES];
} Table;

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    Table *table = calloc(1, sizeof *table);
    (void)name, (void)type, (void)guid, (void)resources, (void)functions, (void)visible, (void)logging;
    for (int i = 0; table != NULL && i < NODES * NODES; ++i) {
        table->table[i / NODES][i % NODES] = 0.1 * (i % NODES) + 0.01 * (double)(i / NODES);
    }
    return table;
}

void fmi2FreeInstance(fmi2Component c)
{
    free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean stop_defined, fmi2Real stop)
{
    (void)c, (void)tolerance_defined, (void)tolerance, (void)start, (void)stop_defined, (void)stop;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    Table *table = c;
    for (size_t i = 0; i < nvr; ++i) {
        if (vr[i] < 1 || vr[i] > 4) {
            return fmi2Error;
        }
        table->value[vr[i]] = value[i];
    }
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_set_state)
{
    Table *table = c;
    double x = table->value[1] / 12000.0 * (NODES - 1), y = table->value[2] / 320.0 * (NODES - 1);
    int i, j;
    (void)time, (void)step, (void)no_set_state;
    x = x > 0.0 ? x : 0.0;
    x = x < NODES - 1.0 ? x : NODES - 1.0;
    y = y > 0.0 ? y : 0.0;
    y = y < NODES - 1.0 ? y : NODES - 1.0;
    i = (int)x < NODES - 2 ? (int)x : NODES - 2;
    j = (int)y < NODES - 2 ? (int)y : NODES - 2;
    x -= i;
    y -= j;
    table->value[5] = (1.0 - x) * ((1.0 - y) * table->table[i][j] + y * table->table[i][j + 1])
                    + x * ((1.0 - y) * table->table[i + 1][j] + y * table->table[i + 1][j + 1]);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    const Table *table = c;
    for (size_t i = 0; i < nvr; ++i) {
        if (vr[i] < 1 || vr[i] > 5) {
            return fmi2Error;
        }
        value[i] = table->value[vr[i]];
    }
    return fmi2OK;
}
