/* FMI 2.0 for co-simulation and model exchange: translates the calls to the runtime. */
#include "fmi2Functions.h"

#include "fmi_common.h"

/* copies of the header without FMI2_FUNCTION_PREFIX are in use */
#if defined(FMI2_FUNCTION_PREFIX) && !defined(FMI2_OVERRIDE_FUNCTION_PREFIX)
#undef fmi2FullName
#define fmi2FullName(name) BALLSCREW_NAMED(FMI2_FUNCTION_PREFIX, name)
#endif

/* Start of a call that is legal in these kinds and states; a body of one statement. */
#define FMI2_BEGIN(kinds, states) BEGIN(fmi2Error, kinds, states)
#define FMI2_CALL(kinds, states, call) \
    FMI2_BEGIN(kinds, states) \
    return (fmi2Status)instance_end(self, call)

/* --- importer ---------------------------------------------------------------------------------------------------- */

static void log_fmi2(const Importer *importer, const char *instance_name, Status status, const char *category,
                     const char *message)
{
    const fmi2CallbackLogger logger = (fmi2CallbackLogger)importer->logger;
    char format[1024];

    format_of(message, format, sizeof format);
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

fmi2Status fmi2SetDebugLogging(fmi2Component instance, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[])
{
    FMI2_CALL(BOTH_KINDS, ANY_STATE,
              instance_set_logging(self, loggingOn != fmi2False, nCategories, categories));
}

/* --- life cycle -------------------------------------------------------------------------------------------------- */

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    Importer importer = {log_fmi2, NULL, NULL, false};

    if (functions != NULL) {
        importer.logger = (void (*)(void))functions->logger;
        importer.environment = functions->componentEnvironment;
    }
    if (fmuType != fmi2CoSimulation && fmuType != fmi2ModelExchange) {
        importer_error(&importer, instanceName, "FMU type = %d; needs co-simulation or model exchange", (int)fmuType);
        return NULL;
    }
    return instance_create(&importer, fmuType == fmi2CoSimulation ? KIND_CS : KIND_ME, instanceName,
                           fmuGUID, fmuResourceLocation, loggingOn != fmi2False);
}

void fmi2FreeInstance(fmi2Component instance)
{
    instance_free(instance);
}

fmi2Status fmi2SetupExperiment(fmi2Component instance, fmi2Boolean toleranceDefined, fmi2Real tolerance,
                               fmi2Real startTime, fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    FMI2_CALL(BOTH_KINDS, INSTANTIATED,
              instance_setup(self, startTime, stopTimeDefined != fmi2False, stopTime));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component instance)
{
    FMI2_CALL(BOTH_KINDS, INSTANTIATED, instance_enter(self, INITIALIZATION_MODE));
}

fmi2Status fmi2ExitInitializationMode(fmi2Component instance)
{
    FMI2_CALL(BOTH_KINDS, INITIALIZATION_MODE, instance_exit_initialization(self));
}

fmi2Status fmi2Terminate(fmi2Component instance)
{
    FMI2_CALL(BOTH_KINDS, RUNNING, instance_enter(self, TERMINATED));
}

fmi2Status fmi2Reset(fmi2Component instance)
{
    FMI2_CALL(BOTH_KINDS, ANY_STATE, instance_reset(self));
}

/* --- values ------------------------------------------------------------------------------------------------------ */

fmi2Status fmi2GetReal(fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    FMI2_CALL(BOTH_KINDS, EVALUATED, instance_get_reals(self, vr, nvr, value));
}

fmi2Status fmi2SetReal(fmi2Component instance, const fmi2ValueReference vr[], size_t nvr,
                       const fmi2Real value[])
{
    FMI2_CALL(BOTH_KINDS, SETTABLE | CONTINUOUS_TIME_MODE, instance_set(self, vr, nvr, value, false));
}

fmi2Status fmi2GetBoolean(fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[])
{
    Status status = STATUS_OK;

    FMI2_BEGIN(BOTH_KINDS, EVALUATED)
    if (nvr > 0 && (vr == NULL || value == NULL)) {
        status = instance_missing_array(self);
    }
    for (size_t i = 0; status == STATUS_OK && i < nvr; ++i) {
        bool result = false;
        status = instance_get_booleans(self, &vr[i], 1, &result);
        if (status == STATUS_OK) {
            value[i] = result ? fmi2True : fmi2False;
        }
    }
    return (fmi2Status)instance_end(self, status);
}

fmi2Status fmi2SetBoolean(fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[])
{
    Status status = STATUS_OK;

    FMI2_BEGIN(BOTH_KINDS, SETTABLE)
    if (nvr > 0 && (vr == NULL || value == NULL)) {
        status = instance_missing_array(self);
    }
    for (size_t i = 0; status == STATUS_OK && i < nvr; ++i) {
        status = instance_set(self, &vr[i], 1, &(bool){value[i] != fmi2False}, true);
    }
    return (fmi2Status)instance_end(self, status);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component instance, const fmi2ValueReference vUnknown_ref[],
                                        size_t nUnknown, const fmi2ValueReference vKnown_ref[], size_t nKnown,
                                        const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    FMI2_CALL(BOTH_KINDS, EVALUATED,
              instance_derivative(self, vUnknown_ref, nUnknown, vKnown_ref, nKnown, dvKnown, dvUnknown,
                                  false));
}

/* --- saved states ------------------------------------------------------------------------------------------------ */

fmi2Status fmi2GetFMUstate(fmi2Component instance, fmi2FMUstate *FMUstate)
{
    FMI2_CALL(BOTH_KINDS, ANY_STATE, instance_save(self, FMUstate));
}

fmi2Status fmi2SetFMUstate(fmi2Component instance, fmi2FMUstate FMUstate)
{
    FMI2_CALL(BOTH_KINDS, ANY_STATE, instance_restore(self, FMUstate));
}

fmi2Status fmi2FreeFMUstate(fmi2Component instance, fmi2FMUstate *FMUstate)
{
    FMI2_CALL(BOTH_KINDS, ANY_STATE, instance_free_state(FMUstate));
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component instance, fmi2FMUstate FMUstate, size_t *size)
{
    FMI2_CALL(BOTH_KINDS, ANY_STATE, instance_serialized_size(self, FMUstate, size));
}

fmi2Status fmi2SerializeFMUstate(fmi2Component instance, fmi2FMUstate FMUstate, fmi2Byte serializedState[],
                                 size_t size)
{
    FMI2_CALL(BOTH_KINDS, ANY_STATE,
              instance_serialize(self, FMUstate, (unsigned char *)serializedState, size));
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component instance, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate)
{
    FMI2_CALL(BOTH_KINDS, ANY_STATE,
              instance_deserialize(self, (const unsigned char *)serializedState, size, FMUstate));
}

/* --- model exchange ---------------------------------------------------------------------------------------------- */

fmi2Status fmi2EnterEventMode(fmi2Component instance)
{
    FMI2_CALL(KIND_ME, EVENT_MODE | CONTINUOUS_TIME_MODE, instance_enter(self, EVENT_MODE));
}

fmi2Status fmi2NewDiscreteStates(fmi2Component instance, fmi2EventInfo *eventInfo)
{
    bool changed = false;
    Status status;

    FMI2_BEGIN(KIND_ME, EVENT_MODE)
    if (eventInfo == NULL) {
        return (fmi2Status)instance_end(self, instance_fail(self, "event info is a NULL pointer"));
    }
    status = instance_event(self, &changed);
    eventInfo->newDiscreteStatesNeeded = fmi2False;
    eventInfo->terminateSimulation = fmi2False;
    eventInfo->nominalsOfContinuousStatesChanged = fmi2False;
    eventInfo->valuesOfContinuousStatesChanged = changed ? fmi2True : fmi2False;
    eventInfo->nextEventTimeDefined = fmi2False;
    eventInfo->nextEventTime = 0.0;
    return (fmi2Status)instance_end(self, status);
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component instance)
{
    FMI2_CALL(KIND_ME, EVENT_MODE, instance_enter(self, CONTINUOUS_TIME_MODE));
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component instance, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation)
{
    FMI2_BEGIN(KIND_ME, CONTINUOUS_TIME_MODE)
    PUT(enterEventMode, fmi2False);
    PUT(terminateSimulation, fmi2False);
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component instance, fmi2Real time)
{
    FMI2_CALL(KIND_ME, EVENT_MODE | CONTINUOUS_TIME_MODE, instance_set_time(self, time));
}

fmi2Status fmi2SetContinuousStates(fmi2Component instance, const fmi2Real x[], size_t nx)
{
    FMI2_CALL(KIND_ME, CONTINUOUS_TIME_MODE, instance_set_states(self, x, nx));
}

fmi2Status fmi2GetContinuousStates(fmi2Component instance, fmi2Real x[], size_t nx)
{
    FMI2_CALL(KIND_ME, EVALUATED, instance_get_all(self, CAUSALITY_STATE, false, x, nx));
}

fmi2Status fmi2GetDerivatives(fmi2Component instance, fmi2Real derivatives[], size_t nx)
{
    FMI2_CALL(KIND_ME, EVALUATED, instance_get_all(self, CAUSALITY_RATE, false, derivatives, nx));
}

fmi2Status fmi2GetEventIndicators(fmi2Component instance, fmi2Real eventIndicators[], size_t ni)
{
    FMI2_CALL(KIND_ME, EVALUATED, instance_get_all(self, CAUSALITY_INDICATOR, false, eventIndicators, ni));
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component instance, fmi2Real x_nominal[], size_t nx)
{
    FMI2_CALL(KIND_ME, INSTANTIATED | EVALUATED, instance_get_nominals(self, x_nominal, nx));
}

/* --- co-simulation ----------------------------------------------------------------------------------------------- */

/* the standard requires step sizes > 0, but importers use 0 to detect feedthrough */
fmi2Status fmi2DoStep(fmi2Component instance, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    FMI2_BEGIN(KIND_CS, STEP_MODE)
    return (fmi2Status)instance_step(self, currentCommunicationPoint, communicationStepSize, true, false);
}

#define STATUS_STATES (STEP_MODE | TERMINATED)

/* Other status kinds are for asynchronous steps; fmi2Terminated may be asked after a discarded step, but fmpy takes the
   answer "false" for a step to repeat. */
static Status no_status(Instance *self, fmi2StatusKind kind)
{
    return instance_discard(self, "status %d of a step is not available", (int)kind);
}

fmi2Status fmi2GetRealStatus(fmi2Component instance, const fmi2StatusKind s, fmi2Real *value)
{
    FMI2_BEGIN(KIND_CS, STATUS_STATES)
    if (s != fmi2LastSuccessfulTime || value == NULL) {
        return (fmi2Status)instance_end(self, no_status(self, s));
    }
    *value = self->now.time;
    return fmi2OK;
}

/* --- what this FMU has not --------------------------------------------------------------------------------------- */

/* Types without variables. */
#define FMI2_NO_VARIABLES(name, type, states, ...) \
    fmi2Status name(fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, __VA_ARGS__) \
    { \
        FMI2_CALL(BOTH_KINDS, states, instance_no_variables(self, type, vr, nvr)); \
    }
FMI2_NO_VARIABLES(fmi2GetInteger, "Integer", EVALUATED, fmi2Integer value[])
FMI2_NO_VARIABLES(fmi2SetInteger, "Integer", SETTABLE, const fmi2Integer value[])
FMI2_NO_VARIABLES(fmi2GetString, "String", EVALUATED, fmi2String value[])
FMI2_NO_VARIABLES(fmi2SetString, "String", SETTABLE, const fmi2String value[])

/* Functions without use. Steps never run in the background. */
#define FMI2_REFUSED(name, states, refused, ...) \
    fmi2Status name(__VA_ARGS__) \
    { \
        FMI2_CALL(KIND_CS, states, refused); \
    }
FMI2_REFUSED(fmi2CancelStep, 0U, STATUS_ERROR, fmi2Component instance)
FMI2_REFUSED(fmi2SetRealInputDerivatives, INSTANTIATED | INITIALIZATION_MODE | STEP_MODE,
             instance_fail(self, "no derivatives of inputs: inputs are constant over a step"),
             fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
             const fmi2Real value[])
FMI2_REFUSED(fmi2GetRealOutputDerivatives, STEP_MODE | TERMINATED | FAILED,
             instance_fail(self, "no derivatives of outputs over time"),
             fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
             fmi2Real value[])
FMI2_REFUSED(fmi2GetStatus, STATUS_STATES, no_status(self, s), fmi2Component instance, const fmi2StatusKind s,
             fmi2Status *value)
FMI2_REFUSED(fmi2GetIntegerStatus, STATUS_STATES, no_status(self, s), fmi2Component instance,
             const fmi2StatusKind s, fmi2Integer *value)
FMI2_REFUSED(fmi2GetBooleanStatus, STATUS_STATES, no_status(self, s), fmi2Component instance,
             const fmi2StatusKind s, fmi2Boolean *value)
FMI2_REFUSED(fmi2GetStringStatus, STATUS_STATES, no_status(self, s), fmi2Component instance,
             const fmi2StatusKind s, fmi2String *value)
