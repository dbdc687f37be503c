/* A rotor as co-simulation FMU of either FMI version, to couple the friction FMUs with: J dw/dt = motor_torque -
   friction_torque, integrated exactly with the torques held over the step. For tests: it checks nothing.

   Compile with FMI_VERSION 2 or 3; the table of variables is that of rotor_fmu.py, which adds all other functions of
   the standard as stubs that return an error: importers do not load a library without them. */
#include <stdlib.h>

enum { MOTOR_TORQUE, FRICTION_TORQUE, SPEED, ANGLE, INERTIA, START_SPEED, VARIABLE_COUNT };

typedef struct {
    double value[VARIABLE_COUNT]; /* by value reference */
} Rotor;

#define EXPORTED __attribute__((visibility("default")))

static void *rotor_new(void)
{
    Rotor *rotor = calloc(1, sizeof *rotor);
    if (rotor != NULL) {
        rotor->value[INERTIA] = 0.01;
    }
    return rotor;
}

static int rotor_get(const Rotor *rotor, const unsigned references[], size_t count, double values[])
{
    for (size_t i = 0; i < count; ++i) {
        if (references[i] >= VARIABLE_COUNT) {
            return 3;
        }
        values[i] = rotor->value[references[i]];
    }
    return 0;
}

static int rotor_set(Rotor *rotor, const unsigned references[], size_t count, const double values[])
{
    for (size_t i = 0; i < count; ++i) {
        if (references[i] >= VARIABLE_COUNT) {
            return 3;
        }
        rotor->value[references[i]] = values[i];
        if (references[i] == START_SPEED) {
            rotor->value[SPEED] = values[i];
        }
    }
    return 0;
}

static int rotor_step(Rotor *rotor, double step)
{
    double *v = rotor->value;
    const double gain = (v[MOTOR_TORQUE] - v[FRICTION_TORQUE]) / v[INERTIA] * step;

    if (!(step >= 0.0)) {
        return 3;
    }
    v[ANGLE] += (v[SPEED] + 0.5 * gain) * step;
    v[SPEED] += gain;
    return 0;
}

#if FMI_VERSION == 2

#define FMI2_Export EXPORTED
#include "fmi2Functions.h"

#define STATUS(call) return (fmi2Status)(call)
#define DONE(name, ...)                \
    fmi2Status name(__VA_ARGS__)       \
    {                                  \
        return fmi2OK;                 \
    }
#define COMPONENT fmi2Component c
#define WHICH COMPONENT, const fmi2ValueReference r[], size_t n

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    return rotor_new();
}

void fmi2FreeInstance(fmi2Component c)
{
    free(c);
}

DONE(fmi2SetDebugLogging, COMPONENT, fmi2Boolean on, size_t n, const fmi2String categories[])
DONE(fmi2SetupExperiment, COMPONENT, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
     fmi2Boolean has_stop, fmi2Real stop)
DONE(fmi2EnterInitializationMode, COMPONENT)
DONE(fmi2ExitInitializationMode, COMPONENT)
DONE(fmi2Terminate, COMPONENT)

fmi2Status fmi2GetReal(WHICH, fmi2Real values[])
{
    STATUS(rotor_get(c, r, n, values));
}

fmi2Status fmi2SetReal(WHICH, const fmi2Real values[])
{
    STATUS(rotor_set(c, r, n, values));
}

fmi2Status fmi2DoStep(COMPONENT, fmi2Real time, fmi2Real step, fmi2Boolean no_set_state)
{
    STATUS(rotor_step(c, step));
}

#else

#define FMI3_Export EXPORTED
#include "fmi3Functions.h"

#define STATUS(call) return (fmi3Status)(call)
#define DONE(name, ...)                \
    fmi3Status name(__VA_ARGS__)       \
    {                                  \
        return fmi3OK;                 \
    }

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference intermediate[], size_t intermediate_count,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update)
{
    return rotor_new();
}

void fmi3FreeInstance(fmi3Instance instance)
{
    free(instance);
}

DONE(fmi3SetDebugLogging, fmi3Instance instance, fmi3Boolean on, size_t n, const fmi3String categories[])
DONE(fmi3EnterInitializationMode, fmi3Instance instance, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
     fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop)
DONE(fmi3ExitInitializationMode, fmi3Instance instance)
DONE(fmi3Terminate, fmi3Instance instance)

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference r[], size_t n, fmi3Float64 values[],
                          size_t value_count)
{
    STATUS(rotor_get(instance, r, n, values));
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference r[], size_t n, const fmi3Float64 values[],
                          size_t value_count)
{
    STATUS(rotor_set(instance, r, n, values));
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_set_state,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    *event = *terminate = *early = fmi3False;
    *last = time + step;
    STATUS(rotor_step(instance, step));
}

#endif
