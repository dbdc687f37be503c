/* FMI 2.0 for co-simulation and model exchange: translates to instance.h. */
#include "fmi2Functions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "instance.h"

/* States in which each call is legal: tables of sections 3.2.3 and 4.2.4 of FMI 2.0.5. Conditions on the variable are
   in settable_in of values.c. Differs: the table has setTime in Event Mode for discrete-time FMUs only, but
   importers call it there for others too. */
#define RUNNING (STEP_MODE | EVENT_MODE | CONTINUOUS_TIME_MODE)
#define EVALUATED (INITIALIZATION_MODE | RUNNING | TERMINATED | FAILED)
#define SETTABLE (INSTANTIATED | INITIALIZATION_MODE | STEP_MODE | EVENT_MODE)
#define STATUS_STATES (STEP_MODE | TERMINATED)
#define CALLS(X)                                                                                                   \
    X(SetDebugLogging, BOTH_KINDS, ANY_STATE)                                                                      \
    X(SetupExperiment, BOTH_KINDS, INSTANTIATED)                                                                   \
    X(EnterInitializationMode, BOTH_KINDS, INSTANTIATED)                                                           \
    X(ExitInitializationMode, BOTH_KINDS, INITIALIZATION_MODE)                                                     \
    X(Terminate, BOTH_KINDS, RUNNING)                                                                              \
    X(Reset, BOTH_KINDS, ANY_STATE)                                                                                \
    X(GetReal, BOTH_KINDS, EVALUATED)                                                                              \
    X(GetInteger, BOTH_KINDS, EVALUATED)                                                                           \
    X(GetBoolean, BOTH_KINDS, EVALUATED)                                                                           \
    X(GetString, BOTH_KINDS, EVALUATED)                                                                            \
    X(SetReal, BOTH_KINDS, SETTABLE | CONTINUOUS_TIME_MODE)                                                        \
    X(SetInteger, BOTH_KINDS, SETTABLE)                                                                            \
    X(SetBoolean, BOTH_KINDS, SETTABLE)                                                                            \
    X(SetString, BOTH_KINDS, SETTABLE)                                                                             \
    X(GetFMUstate, BOTH_KINDS, ANY_STATE)                                                                          \
    X(SetFMUstate, BOTH_KINDS, ANY_STATE)                                                                          \
    X(FreeFMUstate, BOTH_KINDS, ANY_STATE)                                                                         \
    X(SerializedFMUstateSize, BOTH_KINDS, ANY_STATE)                                                               \
    X(SerializeFMUstate, BOTH_KINDS, ANY_STATE)                                                                    \
    X(DeSerializeFMUstate, BOTH_KINDS, ANY_STATE)                                                                  \
    X(GetDirectionalDerivative, BOTH_KINDS, EVALUATED)                                                             \
    X(EnterEventMode, MODEL_EXCHANGE, EVENT_MODE | CONTINUOUS_TIME_MODE)                                           \
    X(NewDiscreteStates, MODEL_EXCHANGE, EVENT_MODE)                                                               \
    X(EnterContinuousTimeMode, MODEL_EXCHANGE, EVENT_MODE)                                                         \
    X(CompletedIntegratorStep, MODEL_EXCHANGE, CONTINUOUS_TIME_MODE)                                               \
    X(SetTime, MODEL_EXCHANGE, EVENT_MODE | CONTINUOUS_TIME_MODE)                                                  \
    X(SetContinuousStates, MODEL_EXCHANGE, CONTINUOUS_TIME_MODE)                                                   \
    X(GetDerivatives, MODEL_EXCHANGE, EVALUATED)                                                                   \
    X(GetEventIndicators, MODEL_EXCHANGE, EVALUATED)                                                               \
    X(GetContinuousStates, MODEL_EXCHANGE, EVALUATED)                                                              \
    X(GetNominalsOfContinuousStates, MODEL_EXCHANGE, INSTANTIATED | EVALUATED)                                     \
    X(SetRealInputDerivatives, CO_SIMULATION, INSTANTIATED | INITIALIZATION_MODE | STEP_MODE)                      \
    X(GetRealOutputDerivatives, CO_SIMULATION, STEP_MODE | TERMINATED | FAILED)                                    \
    X(DoStep, CO_SIMULATION, STEP_MODE)                                                                            \
    X(CancelStep, CO_SIMULATION, 0U) /* steps never run in the background */                                       \
    X(GetStatus, CO_SIMULATION, STATUS_STATES)                                                                     \
    X(GetRealStatus, CO_SIMULATION, STATUS_STATES)                                                                 \
    X(GetIntegerStatus, CO_SIMULATION, STATUS_STATES)                                                              \
    X(GetBooleanStatus, CO_SIMULATION, STATUS_STATES)                                                              \
    X(GetStringStatus, CO_SIMULATION, STATUS_STATES)

#define AS_NUMBER(name, kinds, states) CALL_##name,
#define AS_ENTRY(name, kinds, states) {"fmi2" #name, kinds, states},
enum { CALLS(AS_NUMBER) CALL_COUNT };
static const Call calls[CALL_COUNT] = {CALLS(AS_ENTRY)};

#define BEGIN(name)                                                  \
    Instance *const instance = instance_begin(c, &calls[CALL_##name]); \
    if (instance == NULL) {                                          \
        return fmi2Error;                                            \
    }
#define RETURN(status) return (fmi2Status)(status)

/* --- importer ---------------------------------------------------------------------------------------------------- */

/* The logger takes a printf format, in which # marks a value reference. Nothing but the message is passed: many
   importers print the format as it is. */
static void log_fmi2(const Importer *importer, const char *instance_name, Status status, const char *category,
                 const char *message)
{
    const fmi2CallbackLogger logger = (fmi2CallbackLogger)importer->logger;
    char format[1024];
    size_t used = 0;

    for (; *message != '\0' && used < sizeof format - 2; ++message) {
        if (*message == '%' || *message == '#') {
            format[used++] = *message;
        }
        format[used++] = *message;
    }
    format[used] = '\0';
    logger(importer->environment, instance_name, (fmi2Status)status, category, format);
}

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    Importer importer = {log_fmi2, NULL, NULL, calloc, free};

    (void)visible;
    if (functions != NULL) {
        importer.logger = (void (*)(void))functions->logger;
        importer.environment = functions->componentEnvironment;
        if (functions->allocateMemory != NULL && functions->freeMemory != NULL) {
            importer.allocate = functions->allocateMemory;
            importer.release = functions->freeMemory;
        }
    }
    if (fmuType != fmi2CoSimulation && fmuType != fmi2ModelExchange) {
        importer_refuse(&importer, instanceName, "type %d of FMU; needs co-simulation or model exchange", (int)fmuType);
        return NULL;
    }
    return instance_create(&importer, fmuType == fmi2CoSimulation ? CO_SIMULATION : MODEL_EXCHANGE, instanceName,
                           fmuGUID, fmuResourceLocation, true, loggingOn != fmi2False);
}

void fmi2FreeInstance(fmi2Component c)
{
    instance_free(c);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[])
{
    BEGIN(SetDebugLogging)
    RETURN(instance_set_logging(instance, loggingOn != fmi2False, nCategories, categories));
}

/* --- life -------------------------------------------------------------------------------------------------------- */

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    BEGIN(SetupExperiment)
    (void)toleranceDefined;
    (void)tolerance;
    RETURN(instance_setup(instance, startTime, stopTimeDefined != fmi2False, stopTime));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    BEGIN(EnterInitializationMode)
    RETURN(instance_enter(instance, INITIALIZATION_MODE));
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    BEGIN(ExitInitializationMode)
    RETURN(instance_exit_initialization(instance));
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    BEGIN(Terminate)
    RETURN(instance_enter(instance, TERMINATED));
}

fmi2Status fmi2Reset(fmi2Component c)
{
    BEGIN(Reset)
    RETURN(instance_reset(instance));
}

/* --- values ------------------------------------------------------------------------------------------------------ */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    BEGIN(GetReal)
    RETURN(instance_get_reals(instance, vr, nvr, value));
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    BEGIN(SetReal)
    RETURN(instance_set_reals(instance, vr, nvr, value));
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[])
{
    BEGIN(GetBoolean)
    if (nvr > 0 && (vr == NULL || value == NULL)) {
        RETURN(instance_missing_array(instance));
    }
    for (size_t i = 0; i < nvr; ++i) {
        bool found;
        const Status status = instance_get_boolean(instance, vr[i], &found);
        if (status != STATUS_OK) {
            RETURN(status);
        }
        value[i] = found ? fmi2True : fmi2False;
    }
    return fmi2OK;
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[])
{
    BEGIN(SetBoolean)
    (void)value;
    RETURN(instance_no_variables(instance, "settable Boolean", vr, nvr));
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[])
{
    BEGIN(GetInteger)
    (void)value;
    RETURN(instance_no_variables(instance, "Integer", vr, nvr));
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[])
{
    BEGIN(SetInteger)
    (void)value;
    RETURN(instance_no_variables(instance, "Integer", vr, nvr));
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[])
{
    BEGIN(GetString)
    (void)value;
    RETURN(instance_no_variables(instance, "String", vr, nvr));
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[])
{
    BEGIN(SetString)
    (void)value;
    RETURN(instance_no_variables(instance, "String", vr, nvr));
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown,
                                        const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    BEGIN(GetDirectionalDerivative)
    RETURN(instance_derivative(instance, vUnknown_ref, nUnknown, vKnown_ref, nKnown, dvKnown, dvUnknown, false));
}

/* --- saved states ------------------------------------------------------------------------------------------------ */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    BEGIN(GetFMUstate)
    RETURN(instance_save(instance, FMUstate));
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate)
{
    BEGIN(SetFMUstate)
    RETURN(instance_restore(instance, FMUstate));
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    BEGIN(FreeFMUstate)
    RETURN(instance_forget(instance, FMUstate));
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size)
{
    BEGIN(SerializedFMUstateSize)
    RETURN(instance_serialized_size(instance, FMUstate, size));
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size)
{
    BEGIN(SerializeFMUstate)
    RETURN(instance_serialize(instance, FMUstate, (unsigned char *)serializedState, size));
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate)
{
    BEGIN(DeSerializeFMUstate)
    RETURN(instance_deserialize(instance, (const unsigned char *)serializedState, size, FMUstate));
}

/* --- model exchange ---------------------------------------------------------------------------------------------- */

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    BEGIN(EnterEventMode)
    RETURN(instance_enter(instance, EVENT_MODE));
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *eventInfo)
{
    bool changed = false;
    Status status;

    BEGIN(NewDiscreteStates)
    if (eventInfo == NULL) {
        RETURN(instance_fail(instance, "event info is a NULL pointer"));
    }
    status = instance_event(instance, &changed);
    eventInfo->newDiscreteStatesNeeded = fmi2False;
    eventInfo->terminateSimulation = fmi2False;
    eventInfo->nominalsOfContinuousStatesChanged = fmi2False;
    eventInfo->valuesOfContinuousStatesChanged = changed ? fmi2True : fmi2False;
    eventInfo->nextEventTimeDefined = fmi2False;
    eventInfo->nextEventTime = 0.0;
    RETURN(status);
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    BEGIN(EnterContinuousTimeMode)
    RETURN(instance_enter(instance, CONTINUOUS_TIME_MODE));
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation)
{
    BEGIN(CompletedIntegratorStep)
    (void)noSetFMUStatePriorToCurrentPoint;
    if (enterEventMode != NULL) {
        *enterEventMode = fmi2False;
    }
    if (terminateSimulation != NULL) {
        *terminateSimulation = fmi2False;
    }
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    BEGIN(SetTime)
    RETURN(instance_set_time(instance, time));
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx)
{
    BEGIN(SetContinuousStates)
    RETURN(instance_set_states(instance, x, nx));
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx)
{
    BEGIN(GetDerivatives)
    RETURN(instance_get_rates(instance, derivatives, nx));
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni)
{
    BEGIN(GetEventIndicators)
    RETURN(instance_get_indicators(instance, eventIndicators, ni));
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx)
{
    BEGIN(GetContinuousStates)
    RETURN(instance_get_states(instance, x, nx));
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx)
{
    BEGIN(GetNominalsOfContinuousStates)
    RETURN(instance_get_nominals(instance, x_nominal, nx));
}

/* --- co-simulation ----------------------------------------------------------------------------------------------- */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    BEGIN(DoStep)
    (void)noSetFMUStatePriorToCurrentPoint;
    /* the standard wants step sizes above 0, but importers probe for feedthrough with 0 */
    RETURN(instance_step(instance, currentCommunicationPoint, communicationStepSize, true, false));
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    BEGIN(CancelStep)
    return fmi2Error;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    BEGIN(SetRealInputDerivatives)
    (void)vr;
    (void)nvr;
    (void)order;
    (void)value;
    RETURN(instance_fail(instance, "inputs are held over a step: no derivatives of inputs"));
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[])
{
    BEGIN(GetRealOutputDerivatives)
    (void)vr;
    (void)nvr;
    (void)order;
    (void)value;
    RETURN(instance_fail(instance, "no derivatives of outputs over time"));
}

/* All but the last successful time is for steps in the background. */
static fmi2Status no_status(Instance *instance, fmi2StatusKind kind)
{
    RETURN(instance_discard(instance, "status %d of a step is not available", (int)kind));
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value)
{
    BEGIN(GetStatus)
    (void)value;
    return no_status(instance, s);
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value)
{
    BEGIN(GetRealStatus)
    if (s != fmi2LastSuccessfulTime || value == NULL) {
        return no_status(instance, s);
    }
    *value = instance->now.time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value)
{
    BEGIN(GetIntegerStatus)
    (void)value;
    return no_status(instance, s);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value)
{
    BEGIN(GetBooleanStatus)
    (void)value;
    return no_status(instance, s);
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value)
{
    BEGIN(GetStringStatus)
    (void)value;
    return no_status(instance, s);
}
