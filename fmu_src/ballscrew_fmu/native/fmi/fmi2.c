/* FMI 2.0 for co-simulation and model exchange: translates the calls to instance.h. */
#include "fmi2Functions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calls.h"

/* copies of the header without FMI2_FUNCTION_PREFIX are in use */
#if defined(FMI2_FUNCTION_PREFIX) && !defined(FMI2_OVERRIDE_FUNCTION_PREFIX)
#undef fmi2FullName
#define fmi2FullName(name) BALLSCREW_NAMED(FMI2_FUNCTION_PREFIX, name)
#endif

#define FMI fmi2
#define STATE FMUstate
#define DESERIALIZE DeSerialize
#define DERIVATIVES GetDerivatives
#define NOMINALS_IN (INSTANTIATED | EVALUATED)
#define STATUS_STATES (STEP_MODE | TERMINATED)

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

#include "both.h"

/* --- life cycle -------------------------------------------------------------------------------------------------- */

FORWARD(SetupExperiment, BOTH_KINDS, INSTANTIATED,
        (fmi2Component instance, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
         fmi2Boolean stopTimeDefined, fmi2Real stopTime),
        instance_setup(self, startTime, stopTimeDefined != fmi2False, stopTime))
FORWARD(EnterInitializationMode, BOTH_KINDS, INSTANTIATED, (fmi2Component instance),
        instance_enter(self, INITIALIZATION_MODE))

/* --- values ------------------------------------------------------------------------------------------------------ */

FORWARD(GetReal, BOTH_KINDS, EVALUATED,
        (fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]),
        instance_get_reals(self, vr, nvr, value))
FORWARD(SetReal, BOTH_KINDS, SETTABLE | CONTINUOUS_TIME_MODE,
        (fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]),
        instance_set(self, vr, nvr, value, false))

fmi2Status fmi2GetBoolean(fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[])
{
    BEGIN(GetBoolean, BOTH_KINDS, EVALUATED)
    if (nvr > 0 && (vr == NULL || value == NULL)) {
        RETURN(instance_missing_array(self));
    }
    for (size_t i = 0; i < nvr; ++i) {
        bool found = false;
        const Status status = instance_get_booleans(self, &vr[i], 1, &found);
        if (status != STATUS_OK) {
            RETURN(status);
        }
        value[i] = found ? fmi2True : fmi2False;
    }
    return fmi2OK;
}

fmi2Status fmi2SetBoolean(fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[])
{
    Status status = STATUS_OK;

    BEGIN(SetBoolean, BOTH_KINDS, SETTABLE)
    if (nvr > 0 && (vr == NULL || value == NULL)) {
        RETURN(instance_missing_array(self));
    }
    for (size_t i = 0; status == STATUS_OK && i < nvr; ++i) {
        status = instance_set(self, &vr[i], 1, &(bool){value[i] != fmi2False}, true);
    }
    RETURN(status);
}

/* Types without variables. */
#define NO_VARIABLES(name, type, states, modifier)                                                             \
    FORWARD(name##type, BOTH_KINDS, states,                                                                \
            (fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, modifier fmi2##type value[]),      \
            instance_no_variables(self, #type, vr, nvr))
NO_VARIABLES(Get, Integer, EVALUATED, )
NO_VARIABLES(Set, Integer, SETTABLE, const)
NO_VARIABLES(Get, String, EVALUATED, )
NO_VARIABLES(Set, String, SETTABLE, const)
FORWARD(GetDirectionalDerivative, BOTH_KINDS, EVALUATED,
        (fmi2Component instance, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
         const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[], fmi2Real dvUnknown[]),
        instance_derivative(self, vUnknown_ref, nUnknown, vKnown_ref, nKnown, dvKnown, dvUnknown, false))

/* --- model exchange ---------------------------------------------------------------------------------------------- */

FORWARD(EnterEventMode, KIND_ME, EVENT_MODE | CONTINUOUS_TIME_MODE, (fmi2Component instance),
        instance_enter(self, EVENT_MODE))

fmi2Status fmi2NewDiscreteStates(fmi2Component instance, fmi2EventInfo *eventInfo)
{
    bool changed = false;
    Status status;

    BEGIN(NewDiscreteStates, KIND_ME, EVENT_MODE)
    if (eventInfo == NULL) {
        RETURN(instance_fail(self, "event info is a NULL pointer"));
    }
    status = instance_event(self, &changed);
    eventInfo->newDiscreteStatesNeeded = fmi2False;
    eventInfo->terminateSimulation = fmi2False;
    eventInfo->nominalsOfContinuousStatesChanged = fmi2False;
    eventInfo->valuesOfContinuousStatesChanged = changed ? fmi2True : fmi2False;
    eventInfo->nextEventTimeDefined = fmi2False;
    eventInfo->nextEventTime = 0.0;
    RETURN(status);
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component instance, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation)
{
    BEGIN(CompletedIntegratorStep, KIND_ME, CONTINUOUS_TIME_MODE)
    PUT(enterEventMode, fmi2False);
    PUT(terminateSimulation, fmi2False);
    return fmi2OK;
}

/* --- co-simulation ----------------------------------------------------------------------------------------------- */

/* the standard requires step sizes > 0, but importers use 0 to detect feedthrough */
fmi2Status fmi2DoStep(fmi2Component instance, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    BEGIN(DoStep, KIND_CS, STEP_MODE)
    return (fmi2Status)instance_step(self, currentCommunicationPoint, communicationStepSize, true, false);
}

/* steps never run in the background */
FORWARD(CancelStep, KIND_CS, 0U, (fmi2Component instance), STATUS_ERROR)
FORWARD(SetRealInputDerivatives, KIND_CS, INSTANTIATED | INITIALIZATION_MODE | STEP_MODE,
        (fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
         const fmi2Real value[]),
        instance_fail(self, "no derivatives of inputs: inputs are constant over a step"))
FORWARD(GetRealOutputDerivatives, KIND_CS, STEP_MODE | TERMINATED | FAILED,
        (fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
         fmi2Real value[]),
        instance_fail(self, "no derivatives of outputs over time"))

/* Other status kinds are for asynchronous steps; fmi2Terminated may be asked after a discarded step, but fmpy takes the
   answer "false" for a step to repeat. */
static Status no_status(Instance *self, fmi2StatusKind kind)
{
    return instance_discard(self, "status %d of a step is not available", (int)kind);
}

#define NO_STATUS(name, type)                                                                               \
    FORWARD(name, KIND_CS, STATUS_STATES, (fmi2Component instance, const fmi2StatusKind s, type *value),      \
            no_status(self, s))
NO_STATUS(GetStatus, fmi2Status)
NO_STATUS(GetIntegerStatus, fmi2Integer)
NO_STATUS(GetBooleanStatus, fmi2Boolean)
NO_STATUS(GetStringStatus, fmi2String)

fmi2Status fmi2GetRealStatus(fmi2Component instance, const fmi2StatusKind s, fmi2Real *value)
{
    BEGIN(GetRealStatus, KIND_CS, STATUS_STATES)
    if (s != fmi2LastSuccessfulTime || value == NULL) {
        RETURN(no_status(self, s));
    }
    *value = self->now.time;
    return fmi2OK;
}
