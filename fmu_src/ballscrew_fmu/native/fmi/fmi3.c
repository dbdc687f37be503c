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

#include <stdlib.h>

#include "calls.h"

#undef FMI /* in one unit with fmi2.c */
#define FMI fmi3
#define AT_EVENTS (INITIALIZATION_MODE | EVENT_MODE)

/* Parameters of a call about variables; the parameters named here are not used. */
#define VARIABLES fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences
#define NONE_OF(type, unused) (unused, instance_no_variables(self, type, valueReferences, nValueReferences))

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
    Importer importer = {log_fmi3, NULL, NULL, calloc, free, true};

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

    (void)visible;
    return instance_create(&importer, MODEL_EXCHANGE, instanceName, instantiationToken, resourcePath, loggingOn);
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

    (void)visible, (void)earlyReturnAllowed, (void)requiredIntermediateVariables, (void)intermediateUpdate;
    if (eventModeUsed) {
        importer_error(&importer, instanceName, "eventModeUsed: this FMU has no event mode in co-simulation");
        return NULL;
    }
    if (nRequiredIntermediateVariables > 0) {
        importer_error(&importer, instanceName, "requiredIntermediateVariables: this FMU has no intermediate updates");
        return NULL;
    }
    return instance_create(&importer, CO_SIMULATION, instanceName, instantiationToken, resourcePath, loggingOn);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
                                               fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption)
{
    const Importer importer = importer_of(instanceEnvironment, logMessage);

    (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    importer_error(&importer, instanceName, "no scheduled execution; needs co-simulation or model exchange");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    instance_free(instance);
}

FORWARD(SetDebugLogging, BOTH_KINDS, ANY_STATE,
        (fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories, const fmi3String categories[]),
        instance_set_logging(self, loggingOn, nCategories, categories))

/* --- life cycle -------------------------------------------------------------------------------------------------- */

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    Status status;

    BEGIN(EnterInitializationMode, BOTH_KINDS, INSTANTIATED)
    (void)toleranceDefined;
    (void)tolerance;
    status = instance_setup(self, startTime, stopTimeDefined, stopTime);
    RETURN(status == STATUS_OK ? instance_enter(self, INITIALIZATION_MODE) : status);
}

FORWARD(ExitInitializationMode, BOTH_KINDS, INITIALIZATION_MODE, (fmi3Instance instance),
        instance_exit_initialization(self))
FORWARD(Terminate, BOTH_KINDS, RUNNING, (fmi3Instance instance), instance_enter(self, TERMINATED))
FORWARD(Reset, BOTH_KINDS, ANY_STATE, (fmi3Instance instance), instance_reset(self))

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

FORWARD(GetFloat64, BOTH_KINDS, EVALUATED, (VARIABLES, fmi3Float64 values[], size_t nValues),
        check_counts(self, nValueReferences, nValues) == STATUS_OK
            ? instance_get_reals(self, valueReferences, nValueReferences, values)
            : STATUS_ERROR)
FORWARD(SetFloat64, BOTH_KINDS, SETTABLE | CONTINUOUS_TIME_MODE,
        (VARIABLES, const fmi3Float64 values[], size_t nValues),
        check_counts(self, nValueReferences, nValues) == STATUS_OK
            ? instance_set_reals(self, valueReferences, nValueReferences, values)
            : STATUS_ERROR)

FORWARD(GetBoolean, BOTH_KINDS, EVALUATED, (VARIABLES, fmi3Boolean values[], size_t nValues),
        check_counts(self, nValueReferences, nValues) == STATUS_OK
            ? instance_get_booleans(self, valueReferences, nValueReferences, values)
            : STATUS_ERROR)
FORWARD(SetBoolean, BOTH_KINDS, SETTABLE, (VARIABLES, const fmi3Boolean values[], size_t nValues),
        check_counts(self, nValueReferences, nValues) == STATUS_OK
            ? instance_set_booleans(self, valueReferences, nValueReferences, values)
            : STATUS_ERROR)

/* Types without variables. */
#define NO_TYPE(type, settable)                                                                     \
    FORWARD(Get##type, BOTH_KINDS, EVALUATED, (VARIABLES, fmi3##type values[], size_t nValues),       \
            NONE_OF(#type, ((void)values, (void)nValues)))                                          \
    FORWARD(Set##type, BOTH_KINDS, settable, (VARIABLES, const fmi3##type values[], size_t nValues),  \
            NONE_OF(#type, ((void)values, (void)nValues)))

NO_TYPE(Float32, SETTABLE | CONTINUOUS_TIME_MODE)
NO_TYPE(Int8, SETTABLE)
NO_TYPE(UInt8, SETTABLE)
NO_TYPE(Int16, SETTABLE)
NO_TYPE(UInt16, SETTABLE)
NO_TYPE(Int32, SETTABLE)
NO_TYPE(UInt32, SETTABLE)
NO_TYPE(Int64, SETTABLE)
NO_TYPE(UInt64, SETTABLE)
NO_TYPE(String, SETTABLE)

FORWARD(GetBinary, BOTH_KINDS, EVALUATED, (VARIABLES, size_t valueSizes[], fmi3Binary values[], size_t nValues),
        NONE_OF("Binary", ((void)valueSizes, (void)values, (void)nValues)))
FORWARD(SetBinary, BOTH_KINDS, SETTABLE,
        (VARIABLES, const size_t valueSizes[], const fmi3Binary values[], size_t nValues),
        NONE_OF("Binary", ((void)valueSizes, (void)values, (void)nValues)))

/* --- clocks (not supported) -------------------------------------------------------------------------------------- */

#define NO_CLOCK(name, values) \
    FORWARD(name, BOTH_KINDS, AT_EVENTS, (VARIABLES, values), NONE_OF("Clock", (void)first))
#define NO_CLOCK_2(name, values, more) \
    FORWARD(name, BOTH_KINDS, AT_EVENTS, (VARIABLES, values, more), NONE_OF("Clock", ((void)first, (void)second)))

NO_CLOCK(GetClock, fmi3Clock first[])
NO_CLOCK(SetClock, const fmi3Clock first[])
NO_CLOCK_2(GetIntervalDecimal, fmi3Float64 first[], fmi3IntervalQualifier second[])
NO_CLOCK(GetShiftDecimal, fmi3Float64 first[])
NO_CLOCK_2(GetShiftFraction, fmi3UInt64 first[], fmi3UInt64 second[])
NO_CLOCK(SetIntervalDecimal, const fmi3Float64 first[])
NO_CLOCK_2(SetIntervalFraction, const fmi3UInt64 first[], const fmi3UInt64 second[])
NO_CLOCK(SetShiftDecimal, const fmi3Float64 first[])
NO_CLOCK_2(SetShiftFraction, const fmi3UInt64 first[], const fmi3UInt64 second[])

FORWARD(GetIntervalFraction, BOTH_KINDS, AT_EVENTS,
        (VARIABLES, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]),
        NONE_OF("Clock", ((void)counters, (void)resolutions, (void)qualifiers)))
FORWARD(ActivateModelPartition, BOTH_KINDS, 0U,
        (fmi3Instance instance, fmi3ValueReference clockReference, fmi3Float64 activationTime),
        ((void)activationTime, instance_no_variables(self, "Clock", &clockReference, 1)))

/* --- structure and derivatives ----------------------------------------------------------------------------------- */

static Status no_elements(Instance *self)
{
    return instance_fail(self, "providesPerElementDependencies is false; all variables are scalars, see the model "
                               "description");
}

FORWARD(GetNumberOfVariableDependencies, BOTH_KINDS, ANY_STATE,
        (fmi3Instance instance, fmi3ValueReference valueReference, size_t *nDependencies),
        ((void)valueReference, (void)nDependencies, no_elements(self)))
FORWARD(GetVariableDependencies, BOTH_KINDS, ANY_STATE,
        (fmi3Instance instance, fmi3ValueReference dependent, size_t elementIndicesOfDependent[],
         fmi3ValueReference independents[], size_t elementIndicesOfIndependents[],
         fmi3DependencyKind dependencyKinds[], size_t nDependencies),
        ((void)dependent, (void)elementIndicesOfDependent, (void)independents, (void)elementIndicesOfIndependents,
         (void)dependencyKinds, (void)nDependencies, no_elements(self)))

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

/* --- saved states ------------------------------------------------------------------------------------------------ */

FORWARD(GetFMUState, BOTH_KINDS, ANY_STATE, (fmi3Instance instance, fmi3FMUState *FMUState),
        instance_save(self, FMUState))
FORWARD(SetFMUState, BOTH_KINDS, ANY_STATE, (fmi3Instance instance, fmi3FMUState FMUState),
        instance_restore(self, FMUState))
FORWARD(FreeFMUState, BOTH_KINDS, ANY_STATE, (fmi3Instance instance, fmi3FMUState *FMUState),
        instance_free_state(self, FMUState))
FORWARD(SerializedFMUStateSize, BOTH_KINDS, ANY_STATE, (fmi3Instance instance, fmi3FMUState FMUState, size_t *size),
        instance_serialized_size(self, FMUState, size))
FORWARD(SerializeFMUState, BOTH_KINDS, ANY_STATE,
        (fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size),
        instance_serialize(self, FMUState, serializedState, size))
FORWARD(DeserializeFMUState, BOTH_KINDS, ANY_STATE,
        (fmi3Instance instance, const fmi3Byte serializedState[], size_t size, fmi3FMUState *FMUState),
        instance_deserialize(self, serializedState, size, FMUState))

/* --- events ------------------------------------------------------------------------------------------------------ */

/* Output arguments are optional. */
static void put_bool(fmi3Boolean *to, bool value)
{
    if (to != NULL) {
        *to = value;
    }
}

FORWARD(EnterEventMode, MODEL_EXCHANGE, CONTINUOUS_TIME_MODE, (fmi3Instance instance),
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

    BEGIN(UpdateDiscreteStates, MODEL_EXCHANGE, EVENT_MODE)
    status = instance_event(self, &changed);
    put_bool(discreteStatesNeedUpdate, false);
    put_bool(terminateSimulation, false);
    put_bool(nominalsOfContinuousStatesChanged, false);
    put_bool(valuesOfContinuousStatesChanged, changed);
    put_bool(nextEventTimeDefined, false);
    if (nextEventTime != NULL) {
        *nextEventTime = 0.0;
    }
    RETURN(status);
}

/* --- model exchange ---------------------------------------------------------------------------------------------- */

FORWARD(EnterContinuousTimeMode, MODEL_EXCHANGE, EVENT_MODE, (fmi3Instance instance),
        instance_enter(self, CONTINUOUS_TIME_MODE))

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
{
    BEGIN(CompletedIntegratorStep, MODEL_EXCHANGE, CONTINUOUS_TIME_MODE)
    (void)noSetFMUStatePriorToCurrentPoint;
    put_bool(enterEventMode, false);
    put_bool(terminateSimulation, false);
    return fmi3OK;
}

FORWARD(SetTime, MODEL_EXCHANGE, EVENT_MODE | CONTINUOUS_TIME_MODE, (fmi3Instance instance, fmi3Float64 time),
        instance_set_time(self, time))
FORWARD(SetContinuousStates, MODEL_EXCHANGE, CONTINUOUS_TIME_MODE,
        (fmi3Instance instance, const fmi3Float64 continuousStates[], size_t nContinuousStates),
        instance_set_states(self, continuousStates, nContinuousStates))
FORWARD(GetContinuousStateDerivatives, MODEL_EXCHANGE, EVALUATED,
        (fmi3Instance instance, fmi3Float64 derivatives[], size_t nContinuousStates),
        instance_get_all(self, CAUSALITY_RATE, derivatives, nContinuousStates))
FORWARD(GetEventIndicators, MODEL_EXCHANGE, EVALUATED,
        (fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators),
        instance_get_all(self, CAUSALITY_INDICATOR, eventIndicators, nEventIndicators))
FORWARD(GetContinuousStates, MODEL_EXCHANGE, EVALUATED,
        (fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates),
        instance_get_all(self, CAUSALITY_STATE, continuousStates, nContinuousStates))
FORWARD(GetNominalsOfContinuousStates, MODEL_EXCHANGE, EVALUATED,
        (fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates),
        instance_get_nominals(self, nominals, nContinuousStates))

static Status put_number(Instance *self, size_t *to, size_t number)
{
    if (to == NULL) {
        return instance_fail(self, "argument is a NULL pointer");
    }
    *to = number;
    return STATUS_OK;
}

FORWARD(GetNumberOfEventIndicators, MODEL_EXCHANGE, ANY_STATE, (fmi3Instance instance, size_t *nEventIndicators),
        put_number(self, nEventIndicators, instance_count(CAUSALITY_INDICATOR)))
FORWARD(GetNumberOfContinuousStates, MODEL_EXCHANGE, ANY_STATE, (fmi3Instance instance, size_t *nContinuousStates),
        put_number(self, nContinuousStates, instance_count(CAUSALITY_STATE)))

/* --- co-simulation ----------------------------------------------------------------------------------------------- */

/* no event mode to leave */
FORWARD(EnterStepMode, CO_SIMULATION, 0U, (fmi3Instance instance), STATUS_ERROR)
FORWARD(GetOutputDerivatives, CO_SIMULATION, STEP_MODE | TERMINATED | FAILED,
        (VARIABLES, const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues),
        ((void)valueReferences, (void)nValueReferences, (void)orders, (void)values, (void)nValues,
         instance_fail(self, "no derivatives of outputs over time")))

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    Status status;

    BEGIN(DoStep, CO_SIMULATION, STEP_MODE)
    (void)noSetFMUStatePriorToCurrentPoint;
    status = instance_step(self, currentCommunicationPoint, communicationStepSize, false, true);
    put_bool(eventHandlingNeeded, false);
    put_bool(terminateSimulation, false);
    put_bool(earlyReturn, false);
    if (lastSuccessfulTime != NULL) {
        *lastSuccessfulTime = self->now.time;
    }
    RETURN(status);
}
