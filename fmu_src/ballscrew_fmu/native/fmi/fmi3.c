/* FMI 3.0 for co-simulation and model exchange: translates to instance.h. No clocks, no event mode in co-simulation, no
   intermediate update, no structural parameters, no scheduled execution. */
#ifdef __clang__
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wstrict-prototypes" /* two callbacks of the standard's header have none */
#endif
#include "fmi3Functions.h"
#ifdef __clang__
#pragma clang diagnostic pop
#endif

#include <stdlib.h>

#include "instance.h"

/* States in which each call is legal: sections 2.3, 3.2 and 4.2 of FMI 3.0.2. Conditions on the variable are in
   settable_in of values.c. Differs: setTime in Event Mode is accepted, as importers call it there. */
#define RUNNING (STEP_MODE | EVENT_MODE | CONTINUOUS_TIME_MODE)
#define EVALUATED (INITIALIZATION_MODE | RUNNING | TERMINATED | FAILED)
#define SETTABLE (INSTANTIATED | INITIALIZATION_MODE | STEP_MODE | EVENT_MODE)
#define AT_EVENTS (INITIALIZATION_MODE | EVENT_MODE)
#define CALLS(X)                                                                \
    X(SetDebugLogging, BOTH_KINDS, ANY_STATE)                                   \
    X(EnterInitializationMode, BOTH_KINDS, INSTANTIATED)                        \
    X(ExitInitializationMode, BOTH_KINDS, INITIALIZATION_MODE)                  \
    X(EnterEventMode, MODEL_EXCHANGE, CONTINUOUS_TIME_MODE)                     \
    X(Terminate, BOTH_KINDS, RUNNING)                                           \
    X(Reset, BOTH_KINDS, ANY_STATE)                                             \
    X(GetFloat32, BOTH_KINDS, EVALUATED)                                        \
    X(GetFloat64, BOTH_KINDS, EVALUATED)                                        \
    X(GetInt8, BOTH_KINDS, EVALUATED)                                           \
    X(GetUInt8, BOTH_KINDS, EVALUATED)                                          \
    X(GetInt16, BOTH_KINDS, EVALUATED)                                          \
    X(GetUInt16, BOTH_KINDS, EVALUATED)                                         \
    X(GetInt32, BOTH_KINDS, EVALUATED)                                          \
    X(GetUInt32, BOTH_KINDS, EVALUATED)                                         \
    X(GetInt64, BOTH_KINDS, EVALUATED)                                          \
    X(GetUInt64, BOTH_KINDS, EVALUATED)                                         \
    X(GetBoolean, BOTH_KINDS, EVALUATED)                                        \
    X(GetString, BOTH_KINDS, EVALUATED)                                         \
    X(GetBinary, BOTH_KINDS, EVALUATED)                                         \
    X(GetClock, BOTH_KINDS, AT_EVENTS)                                          \
    X(SetFloat32, BOTH_KINDS, SETTABLE | CONTINUOUS_TIME_MODE)                  \
    X(SetFloat64, BOTH_KINDS, SETTABLE | CONTINUOUS_TIME_MODE)                  \
    X(SetInt8, BOTH_KINDS, SETTABLE)                                            \
    X(SetUInt8, BOTH_KINDS, SETTABLE)                                           \
    X(SetInt16, BOTH_KINDS, SETTABLE)                                           \
    X(SetUInt16, BOTH_KINDS, SETTABLE)                                          \
    X(SetInt32, BOTH_KINDS, SETTABLE)                                           \
    X(SetUInt32, BOTH_KINDS, SETTABLE)                                          \
    X(SetInt64, BOTH_KINDS, SETTABLE)                                           \
    X(SetUInt64, BOTH_KINDS, SETTABLE)                                          \
    X(SetBoolean, BOTH_KINDS, SETTABLE)                                         \
    X(SetString, BOTH_KINDS, SETTABLE)                                          \
    X(SetBinary, BOTH_KINDS, SETTABLE)                                          \
    X(SetClock, BOTH_KINDS, AT_EVENTS)                                          \
    X(GetNumberOfVariableDependencies, BOTH_KINDS, ANY_STATE)                   \
    X(GetVariableDependencies, BOTH_KINDS, ANY_STATE)                           \
    X(GetFMUState, BOTH_KINDS, ANY_STATE)                                       \
    X(SetFMUState, BOTH_KINDS, ANY_STATE)                                       \
    X(FreeFMUState, BOTH_KINDS, ANY_STATE)                                      \
    X(SerializedFMUStateSize, BOTH_KINDS, ANY_STATE)                            \
    X(SerializeFMUState, BOTH_KINDS, ANY_STATE)                                 \
    X(DeserializeFMUState, BOTH_KINDS, ANY_STATE)                               \
    X(GetDirectionalDerivative, BOTH_KINDS, EVALUATED)                          \
    X(GetAdjointDerivative, BOTH_KINDS, EVALUATED)                              \
    X(EnterConfigurationMode, BOTH_KINDS, INSTANTIATED | STEP_MODE | EVENT_MODE) \
    X(ExitConfigurationMode, BOTH_KINDS, 0U) /* is never entered */             \
    X(GetIntervalDecimal, BOTH_KINDS, AT_EVENTS)                                \
    X(GetIntervalFraction, BOTH_KINDS, AT_EVENTS)                               \
    X(GetShiftDecimal, BOTH_KINDS, AT_EVENTS)                                   \
    X(GetShiftFraction, BOTH_KINDS, AT_EVENTS)                                  \
    X(SetIntervalDecimal, BOTH_KINDS, AT_EVENTS)                                \
    X(SetIntervalFraction, BOTH_KINDS, AT_EVENTS)                               \
    X(SetShiftDecimal, BOTH_KINDS, AT_EVENTS)                                   \
    X(SetShiftFraction, BOTH_KINDS, AT_EVENTS)                                  \
    X(EvaluateDiscreteStates, BOTH_KINDS, AT_EVENTS)                            \
    X(UpdateDiscreteStates, MODEL_EXCHANGE, EVENT_MODE)                         \
    X(EnterContinuousTimeMode, MODEL_EXCHANGE, EVENT_MODE)                      \
    X(CompletedIntegratorStep, MODEL_EXCHANGE, CONTINUOUS_TIME_MODE)            \
    X(SetTime, MODEL_EXCHANGE, EVENT_MODE | CONTINUOUS_TIME_MODE)               \
    X(SetContinuousStates, MODEL_EXCHANGE, CONTINUOUS_TIME_MODE)                \
    X(GetContinuousStateDerivatives, MODEL_EXCHANGE, EVALUATED)                 \
    X(GetEventIndicators, MODEL_EXCHANGE, EVALUATED)                            \
    X(GetContinuousStates, MODEL_EXCHANGE, EVALUATED)                           \
    X(GetNominalsOfContinuousStates, MODEL_EXCHANGE, EVALUATED)                 \
    X(GetNumberOfEventIndicators, MODEL_EXCHANGE, ANY_STATE)                    \
    X(GetNumberOfContinuousStates, MODEL_EXCHANGE, ANY_STATE)                   \
    X(EnterStepMode, CO_SIMULATION, EVENT_MODE) /* has none */                  \
    X(GetOutputDerivatives, CO_SIMULATION, STEP_MODE | TERMINATED | FAILED)     \
    X(DoStep, CO_SIMULATION, STEP_MODE)                                         \
    X(ActivateModelPartition, BOTH_KINDS, 0U)

#define AS_NUMBER(name, kinds, states) CALL_##name,
#define AS_ENTRY(name, kinds, states) {"fmi3" #name, kinds, states},
enum { CALLS(AS_NUMBER) CALL_COUNT };
static const Call calls[CALL_COUNT] = {CALLS(AS_ENTRY)};

#define BEGIN(name)                                                           \
    Instance *const self = instance_begin(instance, &calls[CALL_##name]); \
    if (self == NULL) {                                                       \
        return fmi3Error;                                                     \
    }
#define RETURN(status) return (fmi3Status)(status)

/* --- importer ---------------------------------------------------------------------------------------------------- */

static void log_fmi3(const Importer *importer, const char *instance_name, Status status, const char *category,
                 const char *message)
{
    const fmi3LogMessageCallback log_message = (fmi3LogMessageCallback)importer->logger;

    (void)instance_name; /* FMI 3 tells instances apart by their environment */
    log_message(importer->environment, (fmi3Status)status, category, message);
}

static Importer importer_of(fmi3InstanceEnvironment environment, fmi3LogMessageCallback log_message)
{
    Importer importer = {log_fmi3, NULL, NULL, calloc, free};

    importer.logger = (void (*)(void))log_message;
    importer.environment = environment;
    return importer;
}

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

static fmi3Instance create(const Importer *importer, unsigned kind, fmi3String name, fmi3String token,
                           fmi3String resources, bool logging)
{
    Instance *self = instance_create(importer, kind, name, token, resources, false, logging);

    if (self != NULL) {
        self->time_variable = true;
    }
    return self;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage)
{
    const Importer importer = importer_of(instanceEnvironment, logMessage);

    (void)visible;
    return create(&importer, MODEL_EXCHANGE, instanceName, instantiationToken, resourcePath, loggingOn);
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

    (void)visible;
    (void)earlyReturnAllowed;
    (void)requiredIntermediateVariables;
    (void)intermediateUpdate;
    if (eventModeUsed) {
        importer_refuse(&importer, instanceName, "event mode asked for; there is none in co-simulation");
        return NULL;
    }
    if (nRequiredIntermediateVariables > 0) {
        importer_refuse(&importer, instanceName, "intermediate variables asked for; there are none");
        return NULL;
    }
    return create(&importer, CO_SIMULATION, instanceName, instantiationToken, resourcePath, loggingOn);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
                                               fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption)
{
    const Importer importer = importer_of(instanceEnvironment, logMessage);

    (void)instantiationToken;
    (void)resourcePath;
    (void)visible;
    (void)loggingOn;
    (void)clockUpdate;
    (void)lockPreemption;
    (void)unlockPreemption;
    importer_refuse(&importer, instanceName, "no scheduled execution; use co-simulation or model exchange");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    instance_free(instance);
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[])
{
    BEGIN(SetDebugLogging)
    RETURN(instance_set_logging(self, loggingOn, nCategories, categories));
}

/* --- life -------------------------------------------------------------------------------------------------------- */

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    Status status;

    BEGIN(EnterInitializationMode)
    (void)toleranceDefined;
    (void)tolerance;
    status = instance_setup(self, startTime, stopTimeDefined, stopTime);
    RETURN(status == STATUS_OK ? instance_enter(self, INITIALIZATION_MODE) : status);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    BEGIN(ExitInitializationMode)
    RETURN(instance_exit_initialization(self));
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    BEGIN(Terminate)
    RETURN(instance_enter(self, TERMINATED));
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    BEGIN(Reset)
    RETURN(instance_reset(self));
}

static fmi3Status no_structure(Instance *self)
{
    RETURN(instance_fail(self, "no structural parameters, hence no configuration mode"));
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance)
{
    BEGIN(EnterConfigurationMode)
    return no_structure(self);
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance)
{
    BEGIN(ExitConfigurationMode)
    return no_structure(self);
}

/* --- values ------------------------------------------------------------------------------------------------------ */

/* All variables are scalars: one value for each reference. */
static Status check_counts(Instance *self, size_t references, size_t values)
{
    return references == values ? STATUS_OK
                                : instance_fail(self, "%lu values for %lu scalar variables", (unsigned long)values,
                                                (unsigned long)references);
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues)
{
    Status status;

    BEGIN(GetFloat64)
    status = check_counts(self, nValueReferences, nValues);
    RETURN(status == STATUS_OK ? instance_get_reals(self, valueReferences, nValueReferences, values) : status);
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues)
{
    Status status;

    BEGIN(SetFloat64)
    status = check_counts(self, nValueReferences, nValues);
    RETURN(status == STATUS_OK ? instance_set_reals(self, valueReferences, nValueReferences, values) : status);
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Boolean values[], size_t nValues)
{
    Status status;

    BEGIN(GetBoolean)
    status = check_counts(self, nValueReferences, nValues);
    if (status == STATUS_OK && nValues > 0 && (valueReferences == NULL || values == NULL)) {
        status = instance_missing_array(self);
    }
    for (size_t i = 0; status == STATUS_OK && i < nValues; ++i) {
        status = instance_get_boolean(self, valueReferences[i], &values[i]);
    }
    RETURN(status);
}

/* Types of which there are no variables, or none to set. */
#define NO_GET(type)                                                                                               \
    fmi3Status fmi3Get##type(fmi3Instance instance, const fmi3ValueReference valueReferences[],                    \
                             size_t nValueReferences, fmi3##type values[], size_t nValues)                         \
    {                                                                                                              \
        BEGIN(Get##type)                                                                                           \
        (void)values;                                                                                              \
        (void)nValues;                                                                                             \
        RETURN(instance_no_variables(self, #type, valueReferences, nValueReferences));                             \
    }
#define NO_SET(type, named)                                                                                        \
    fmi3Status fmi3Set##type(fmi3Instance instance, const fmi3ValueReference valueReferences[],                    \
                             size_t nValueReferences, const fmi3##type values[], size_t nValues)                   \
    {                                                                                                              \
        BEGIN(Set##type)                                                                                           \
        (void)values;                                                                                              \
        (void)nValues;                                                                                             \
        RETURN(instance_no_variables(self, named, valueReferences, nValueReferences));                             \
    }

NO_GET(Float32)
NO_GET(Int8)
NO_GET(UInt8)
NO_GET(Int16)
NO_GET(UInt16)
NO_GET(Int32)
NO_GET(UInt32)
NO_GET(Int64)
NO_GET(UInt64)
NO_GET(String)
NO_SET(Float32, "Float32")
NO_SET(Int8, "Int8")
NO_SET(UInt8, "UInt8")
NO_SET(Int16, "Int16")
NO_SET(UInt16, "UInt16")
NO_SET(Int32, "Int32")
NO_SET(UInt32, "UInt32")
NO_SET(Int64, "Int64")
NO_SET(UInt64, "UInt64")
NO_SET(Boolean, "settable Boolean")
NO_SET(String, "String")

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         size_t valueSizes[], fmi3Binary values[], size_t nValues)
{
    BEGIN(GetBinary)
    (void)valueSizes;
    (void)values;
    (void)nValues;
    RETURN(instance_no_variables(self, "Binary", valueReferences, nValueReferences));
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const size_t valueSizes[], const fmi3Binary values[], size_t nValues)
{
    BEGIN(SetBinary)
    (void)valueSizes;
    (void)values;
    (void)nValues;
    RETURN(instance_no_variables(self, "Binary", valueReferences, nValueReferences));
}

/* --- clocks: there are none -------------------------------------------------------------------------------------- */

#define NO_CLOCK(name, values)                                                                                     \
    fmi3Status fmi3##name(fmi3Instance instance, const fmi3ValueReference valueReferences[],                       \
                          size_t nValueReferences, values)                                                         \
    {                                                                                                              \
        BEGIN(name)                                                                                                \
        (void)first;                                                                                               \
        RETURN(instance_no_variables(self, "Clock", valueReferences, nValueReferences));                           \
    }
#define NO_CLOCK_2(name, values, more)                                                                             \
    fmi3Status fmi3##name(fmi3Instance instance, const fmi3ValueReference valueReferences[],                       \
                          size_t nValueReferences, values, more)                                                   \
    {                                                                                                              \
        BEGIN(name)                                                                                                \
        (void)first;                                                                                               \
        (void)second;                                                                                              \
        RETURN(instance_no_variables(self, "Clock", valueReferences, nValueReferences));                           \
    }

NO_CLOCK(GetClock, fmi3Clock first[])
NO_CLOCK(SetClock, const fmi3Clock first[])
NO_CLOCK_2(GetIntervalDecimal, fmi3Float64 first[], fmi3IntervalQualifier second[])
NO_CLOCK(GetShiftDecimal, fmi3Float64 first[])
NO_CLOCK_2(GetShiftFraction, fmi3UInt64 first[], fmi3UInt64 second[])
NO_CLOCK(SetIntervalDecimal, const fmi3Float64 first[])
NO_CLOCK_2(SetIntervalFraction, const fmi3UInt64 first[], const fmi3UInt64 second[])
NO_CLOCK(SetShiftDecimal, const fmi3Float64 first[])
NO_CLOCK_2(SetShiftFraction, const fmi3UInt64 first[], const fmi3UInt64 second[])

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                   fmi3IntervalQualifier qualifiers[])
{
    BEGIN(GetIntervalFraction)
    (void)counters;
    (void)resolutions;
    (void)qualifiers;
    RETURN(instance_no_variables(self, "Clock", valueReferences, nValueReferences));
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference,
                                      fmi3Float64 activationTime)
{
    BEGIN(ActivateModelPartition)
    (void)activationTime;
    RETURN(instance_no_variables(self, "Clock", &clockReference, 1));
}

/* --- structure and derivatives ----------------------------------------------------------------------------------- */

static fmi3Status no_elements(Instance *self)
{
    RETURN(instance_fail(self, "providesPerElementDependencies is false; all variables are scalars, see the model "
                               "description"));
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference valueReference,
                                               size_t *nDependencies)
{
    BEGIN(GetNumberOfVariableDependencies)
    (void)valueReference;
    (void)nDependencies;
    return no_elements(self);
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
                                       size_t elementIndicesOfDependent[], fmi3ValueReference independents[],
                                       size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[],
                                       size_t nDependencies)
{
    BEGIN(GetVariableDependencies)
    (void)dependent;
    (void)elementIndicesOfDependent;
    (void)independents;
    (void)elementIndicesOfIndependents;
    (void)dependencyKinds;
    (void)nDependencies;
    return no_elements(self);
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
    Status status;

    BEGIN(GetDirectionalDerivative)
    status = check_counts(self, nKnowns, nSeed);
    if (status == STATUS_OK) {
        status = check_counts(self, nUnknowns, nSensitivity);
    }
    RETURN(status == STATUS_OK
               ? instance_derivative(self, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity, false)
               : status);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
    Status status;

    BEGIN(GetAdjointDerivative)
    status = check_counts(self, nUnknowns, nSeed);
    if (status == STATUS_OK) {
        status = check_counts(self, nKnowns, nSensitivity);
    }
    RETURN(status == STATUS_OK
               ? instance_derivative(self, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity, true)
               : status);
}

/* --- saved states ------------------------------------------------------------------------------------------------ */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    BEGIN(GetFMUState)
    RETURN(instance_save(self, FMUState));
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
    BEGIN(SetFMUState)
    RETURN(instance_restore(self, FMUState));
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    BEGIN(FreeFMUState)
    RETURN(instance_forget(self, FMUState));
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
    BEGIN(SerializedFMUStateSize)
    RETURN(instance_serialized_size(self, FMUState, size));
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size)
{
    BEGIN(SerializeFMUState)
    RETURN(instance_serialize(self, FMUState, serializedState, size));
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState)
{
    BEGIN(DeserializeFMUState)
    RETURN(instance_deserialize(self, serializedState, size, FMUState));
}

/* --- events ------------------------------------------------------------------------------------------------------ */

/* Output arguments are optional. */
static void put_bool(fmi3Boolean *to, bool value)
{
    if (to != NULL) {
        *to = value;
    }
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    BEGIN(EnterEventMode)
    RETURN(instance_enter(self, EVENT_MODE));
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
    BEGIN(EvaluateDiscreteStates)
    RETURN(instance_fail(self, "providesEvaluateDiscreteStates is false"));
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime)
{
    bool changed = false;
    Status status;

    BEGIN(UpdateDiscreteStates)
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

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    BEGIN(EnterContinuousTimeMode)
    RETURN(instance_enter(self, CONTINUOUS_TIME_MODE));
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
{
    BEGIN(CompletedIntegratorStep)
    (void)noSetFMUStatePriorToCurrentPoint;
    put_bool(enterEventMode, false);
    put_bool(terminateSimulation, false);
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    BEGIN(SetTime)
    RETURN(instance_set_time(self, time));
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
                                   size_t nContinuousStates)
{
    BEGIN(SetContinuousStates)
    RETURN(instance_set_states(self, continuousStates, nContinuousStates));
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
                                             size_t nContinuousStates)
{
    BEGIN(GetContinuousStateDerivatives)
    RETURN(instance_get_rates(self, derivatives, nContinuousStates));
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators)
{
    BEGIN(GetEventIndicators)
    RETURN(instance_get_indicators(self, eventIndicators, nEventIndicators));
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates)
{
    BEGIN(GetContinuousStates)
    RETURN(instance_get_states(self, continuousStates, nContinuousStates));
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates)
{
    BEGIN(GetNominalsOfContinuousStates)
    RETURN(instance_get_nominals(self, nominals, nContinuousStates));
}

static fmi3Status put_number(Instance *self, size_t *to, size_t number)
{
    if (to == NULL) {
        RETURN(instance_fail(self, "argument is a NULL pointer"));
    }
    *to = number;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators)
{
    BEGIN(GetNumberOfEventIndicators)
    return put_number(self, nEventIndicators, instance_count(CAUSALITY_INDICATOR));
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates)
{
    BEGIN(GetNumberOfContinuousStates)
    return put_number(self, nContinuousStates, instance_count(CAUSALITY_STATE));
}

/* --- co-simulation ----------------------------------------------------------------------------------------------- */

fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    BEGIN(EnterStepMode)
    RETURN(instance_enter(self, STEP_MODE));
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, const fmi3Int32 orders[], fmi3Float64 values[],
                                    size_t nValues)
{
    BEGIN(GetOutputDerivatives)
    (void)valueReferences;
    (void)nValueReferences;
    (void)orders;
    (void)values;
    (void)nValues;
    RETURN(instance_fail(self, "no derivatives of outputs over time"));
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    Status status;

    BEGIN(DoStep)
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
