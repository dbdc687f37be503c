/* FMI 3.0 for co-simulation and model exchange: translates the calls to instance.h. No clocks, no structural
   parameters, no scheduled execution. */
#ifdef __clang__
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wstrict-prototypes" /* two callbacks of the standard's header have none */
#endif
#include "fmi3Functions.h"
#ifdef __clang__
#pragma clang diagnostic pop
#endif

#include "calls.h"

#undef FMI /* in one unit with fmi2.c */
#undef STATE
#undef DESERIALIZE
#undef DERIVATIVES
#undef NOMINALS_IN
#define FMI fmi3
#define STATE FMUState
#define DESERIALIZE Deserialize
#define DERIVATIVES GetContinuousStateDerivatives
#define NOMINALS_IN EVALUATED
#define AT_EVENTS (INITIALIZATION_MODE | EVENT_MODE)

/* Parameters of a call about variables, and of one about a type without variables. */
#define VARIABLES fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences
#define NONE_OF(type) instance_no_variables(self, type, valueReferences, nValueReferences)

/* --- importer ---------------------------------------------------------------------------------------------------- */

static void log_fmi3(const Importer *importer, const char *instance_name, Status status, const char *category,
                 const char *message)
{
    const fmi3LogMessageCallback log_message = (fmi3LogMessageCallback)importer->logger;

    (void)instance_name; /* FMI 3 identifies instances by their environment */
    log_message(importer->environment, (fmi3Status)status, category, message);
}

static Importer importer_of(fmi3InstanceEnvironment environment, fmi3LogMessageCallback log_message)
{
    Importer importer = {log_fmi3, NULL, NULL, true};

    importer.logger = (void (*)(void))log_message;
    importer.environment = environment;
    return importer;
}

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage)
{
    const Importer importer = importer_of(instanceEnvironment, logMessage);

    return instance_create(&importer, KIND_ME, instanceName, instantiationToken, resourcePath, loggingOn);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken,
                                         fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                         fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
                                         const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables,
                                         fmi3InstanceEnvironment instanceEnvironment,
                                         fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback intermediateUpdate)
{
    const Importer importer = importer_of(instanceEnvironment, logMessage);

    if (eventModeUsed) {
        importer_error(&importer, instanceName, "eventModeUsed: this FMU has no event mode in co-simulation");
        return NULL;
    }
    if (nRequiredIntermediateVariables > 0) {
        importer_error(&importer, instanceName, "requiredIntermediateVariables: this FMU has no intermediate updates");
        return NULL;
    }
    return instance_create(&importer, KIND_CS, instanceName, instantiationToken, resourcePath, loggingOn);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
                                               fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption)
{
    const Importer importer = importer_of(instanceEnvironment, logMessage);

    importer_error(&importer, instanceName, "no scheduled execution; needs co-simulation or model exchange");
    return NULL;
}

#include "both.h"

/* --- life cycle -------------------------------------------------------------------------------------------------- */

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    Status status;

    BEGIN(EnterInitializationMode, BOTH_KINDS, INSTANTIATED)
    status = instance_setup(self, startTime, stopTimeDefined, stopTime);
    RETURN(status == STATUS_OK ? instance_enter(self, INITIALIZATION_MODE) : status);
}

static Status no_structure(Instance *self)
{
    return instance_fail(self, "no configuration mode: there are no structural parameters");
}

FORWARD(EnterConfigurationMode, BOTH_KINDS, INSTANTIATED | STEP_MODE | EVENT_MODE, (fmi3Instance instance),
        no_structure(self))
FORWARD(ExitConfigurationMode, BOTH_KINDS, 0U, (fmi3Instance instance), no_structure(self))

/* --- values ------------------------------------------------------------------------------------------------------ */

/* All variables are scalars: one value for each reference. */
static Status check_counts(Instance *self, size_t references, size_t values)
{
    return references == values ? STATUS_OK
                                : instance_fail(self, "%lu values for %lu scalar variables", (unsigned long)values,
                                                (unsigned long)references);
}

/* The two functions of a type. */
#define TYPE(type, settable, get, set)                                                                   \
    FORWARD(Get##type, BOTH_KINDS, EVALUATED, (VARIABLES, fmi3##type values[], size_t nValues), get)      \
    FORWARD(Set##type, BOTH_KINDS, settable, (VARIABLES, const fmi3##type values[], size_t nValues), set)
#define COUNTED(call) (check_counts(self, nValueReferences, nValues) == STATUS_OK ? call : STATUS_ERROR)
#define NO_TYPE(type, settable) TYPE(type, settable, NONE_OF(#type), NONE_OF(#type))

TYPE(Float64, SETTABLE | CONTINUOUS_TIME_MODE,
     COUNTED(instance_get_reals(self, valueReferences, nValueReferences, values)),
     COUNTED(instance_set(self, valueReferences, nValueReferences, values, false)))
TYPE(Boolean, SETTABLE, COUNTED(instance_get_booleans(self, valueReferences, nValueReferences, values)),
     COUNTED(instance_set(self, valueReferences, nValueReferences, values, true)))
NO_TYPE(Float32, SETTABLE | CONTINUOUS_TIME_MODE)

#define NO_DISCRETE(X) X(Int8) X(UInt8) X(Int16) X(UInt16) X(Int32) X(UInt32) X(Int64) X(UInt64) X(String)
#define NO_DISCRETE_TYPE(type) NO_TYPE(type, SETTABLE)
NO_DISCRETE(NO_DISCRETE_TYPE)
FORWARD(GetBinary, BOTH_KINDS, EVALUATED, (VARIABLES, size_t valueSizes[], fmi3Binary values[], size_t nValues),
        NONE_OF("Binary"))
FORWARD(SetBinary, BOTH_KINDS, SETTABLE,
        (VARIABLES, const size_t valueSizes[], const fmi3Binary values[], size_t nValues), NONE_OF("Binary"))

/* --- clocks (not supported) -------------------------------------------------------------------------------------- */

#define NO_CLOCK(name, ...) FORWARD(name, BOTH_KINDS, AT_EVENTS, (VARIABLES, __VA_ARGS__), NONE_OF("Clock"))

NO_CLOCK(GetClock, fmi3Clock values[])
NO_CLOCK(SetClock, const fmi3Clock values[])
NO_CLOCK(GetIntervalDecimal, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
NO_CLOCK(GetIntervalFraction, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
NO_CLOCK(GetShiftDecimal, fmi3Float64 shifts[])
NO_CLOCK(GetShiftFraction, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
NO_CLOCK(SetIntervalDecimal, const fmi3Float64 intervals[])
NO_CLOCK(SetIntervalFraction, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
NO_CLOCK(SetShiftDecimal, const fmi3Float64 shifts[])
NO_CLOCK(SetShiftFraction, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
FORWARD(ActivateModelPartition, BOTH_KINDS, 0U,
        (fmi3Instance instance, fmi3ValueReference clockReference, fmi3Float64 activationTime),
        instance_no_variables(self, "Clock", &clockReference, 1))

/* --- structure and derivatives ----------------------------------------------------------------------------------- */

static Status no_elements(Instance *self)
{
    return instance_fail(self, "providesPerElementDependencies is false; all variables are scalars, see the model "
                               "description");
}

FORWARD(GetNumberOfVariableDependencies, BOTH_KINDS, ANY_STATE,
        (fmi3Instance instance, fmi3ValueReference valueReference, size_t *nDependencies), no_elements(self))
FORWARD(GetVariableDependencies, BOTH_KINDS, ANY_STATE,
        (fmi3Instance instance, fmi3ValueReference dependent, size_t elementIndicesOfDependent[],
         fmi3ValueReference independents[], size_t elementIndicesOfIndependents[],
         fmi3DependencyKind dependencyKinds[], size_t nDependencies),
        no_elements(self))

#define SENSITIVITIES                                                                                             \
    fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns, const fmi3ValueReference knowns[], \
        size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity

FORWARD(GetDirectionalDerivative, BOTH_KINDS, EVALUATED, (SENSITIVITIES),
        check_counts(self, nKnowns, nSeed) == STATUS_OK && check_counts(self, nUnknowns, nSensitivity) == STATUS_OK
            ? instance_derivative(self, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity, false)
            : STATUS_ERROR)
FORWARD(GetAdjointDerivative, BOTH_KINDS, EVALUATED, (SENSITIVITIES),
        check_counts(self, nUnknowns, nSeed) == STATUS_OK && check_counts(self, nKnowns, nSensitivity) == STATUS_OK
            ? instance_derivative(self, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity, true)
            : STATUS_ERROR)

/* --- events ------------------------------------------------------------------------------------------------------ */

FORWARD(EnterEventMode, KIND_ME, CONTINUOUS_TIME_MODE, (fmi3Instance instance),
        instance_enter(self, EVENT_MODE))
FORWARD(EvaluateDiscreteStates, BOTH_KINDS, AT_EVENTS, (fmi3Instance instance),
        instance_fail(self, "providesEvaluateDiscreteStates is false"))

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime)
{
    bool changed = false;
    Status status;

    BEGIN(UpdateDiscreteStates, KIND_ME, EVENT_MODE)
    status = instance_event(self, &changed);
    PUT(discreteStatesNeedUpdate, false);
    PUT(terminateSimulation, false);
    PUT(nominalsOfContinuousStatesChanged, false);
    PUT(valuesOfContinuousStatesChanged, changed);
    PUT(nextEventTimeDefined, false);
    PUT(nextEventTime, 0.0);
    RETURN(status);
}

/* --- model exchange ---------------------------------------------------------------------------------------------- */

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
{
    BEGIN(CompletedIntegratorStep, KIND_ME, CONTINUOUS_TIME_MODE)
    PUT(enterEventMode, false);
    PUT(terminateSimulation, false);
    return fmi3OK;
}

static Status put_number(Instance *self, size_t *to, size_t number)
{
    if (to == NULL) {
        return instance_fail(self, "argument is a NULL pointer");
    }
    *to = number;
    return STATUS_OK;
}

FORWARD(GetNumberOfEventIndicators, KIND_ME, ANY_STATE, (fmi3Instance instance, size_t *nEventIndicators),
        put_number(self, nEventIndicators, instance_count(CAUSALITY_INDICATOR)))
FORWARD(GetNumberOfContinuousStates, KIND_ME, ANY_STATE, (fmi3Instance instance, size_t *nContinuousStates),
        put_number(self, nContinuousStates, instance_count(CAUSALITY_STATE)))

/* --- co-simulation ----------------------------------------------------------------------------------------------- */

/* no event mode to leave */
FORWARD(EnterStepMode, KIND_CS, 0U, (fmi3Instance instance), STATUS_ERROR)
FORWARD(GetOutputDerivatives, KIND_CS, STEP_MODE | TERMINATED | FAILED,
        (VARIABLES, const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues),
        instance_fail(self, "no derivatives of outputs over time"))

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    Status status;

    BEGIN(DoStep, KIND_CS, STEP_MODE)
    status = instance_step(self, currentCommunicationPoint, communicationStepSize, false, true);
    PUT(eventHandlingNeeded, false);
    PUT(terminateSimulation, false);
    PUT(earlyReturn, false);
    PUT(lastSuccessfulTime, self->now.time);
    return (fmi3Status)status;
}
