/* FMI 3.0 for co-simulation and model exchange: translates the calls to the runtime. No clocks, no structural
   parameters, no scheduled execution. */
#ifdef __clang__
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wstrict-prototypes" /* two callbacks of the standard's header have none */
#endif
#include "fmi3Functions.h"
#ifdef __clang__
#pragma clang diagnostic pop
#endif

#include "fmi_common.h"

#define AT_EVENTS (INITIALIZATION_MODE | EVENT_MODE)

/* Start of a call that is legal in these kinds and states; a body of one statement. */
#define FMI3_BEGIN(kinds, states) BEGIN(fmi3Error, kinds, states)
#define FMI3_CALL(kinds, states, call) \
    FMI3_BEGIN(kinds, states) \
    return (fmi3Status)instance_end(self, call)

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

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[])
{
    FMI3_CALL(BOTH_KINDS, ANY_STATE, instance_set_logging(self, loggingOn, nCategories, categories));
}

/* --- life cycle -------------------------------------------------------------------------------------------------- */

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

void fmi3FreeInstance(fmi3Instance instance)
{
    instance_free(instance);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    Status status;

    FMI3_BEGIN(BOTH_KINDS, INSTANTIATED)
    status = instance_setup(self, startTime, stopTimeDefined, stopTime);
    status = status == STATUS_OK ? instance_enter(self, INITIALIZATION_MODE) : status;
    return (fmi3Status)instance_end(self, status);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    FMI3_CALL(BOTH_KINDS, INITIALIZATION_MODE, instance_exit_initialization(self));
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    FMI3_CALL(BOTH_KINDS, RUNNING, instance_enter(self, TERMINATED));
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    FMI3_CALL(BOTH_KINDS, ANY_STATE, instance_reset(self));
}

/* --- values ------------------------------------------------------------------------------------------------------ */

/* All variables are scalars: one value for each reference. */
static bool equal_counts(Instance *self, size_t references, size_t values)
{
    if (references != values) {
        (void)instance_fail(self, "%lu values for %lu scalar variables", (unsigned long)values,
                            (unsigned long)references);
    }
    return references == values;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, fmi3Float64 values[], size_t nValues)
{
    FMI3_CALL(BOTH_KINDS, EVALUATED,
              equal_counts(self, nValueReferences, nValues)
                  ? instance_get_reals(self, valueReferences, nValueReferences, values)
                  : STATUS_ERROR);
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, const fmi3Float64 values[], size_t nValues)
{
    FMI3_CALL(BOTH_KINDS, SETTABLE | CONTINUOUS_TIME_MODE,
              equal_counts(self, nValueReferences, nValues)
                  ? instance_set(self, valueReferences, nValueReferences, values, false)
                  : STATUS_ERROR);
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, fmi3Boolean values[], size_t nValues)
{
    FMI3_CALL(BOTH_KINDS, EVALUATED,
              equal_counts(self, nValueReferences, nValues)
                  ? instance_get_booleans(self, valueReferences, nValueReferences, values)
                  : STATUS_ERROR);
}

fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, const fmi3Boolean values[], size_t nValues)
{
    FMI3_CALL(BOTH_KINDS, SETTABLE,
              equal_counts(self, nValueReferences, nValues)
                  ? instance_set(self, valueReferences, nValueReferences, values, true)
                  : STATUS_ERROR);
}

/* --- derivatives ------------------------------------------------------------------------------------------------- */

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                        size_t nUnknowns, const fmi3ValueReference knowns[], size_t nKnowns,
                                        const fmi3Float64 seed[], size_t nSeed, fmi3Float64 sensitivity[],
                                        size_t nSensitivity)
{
    FMI3_CALL(BOTH_KINDS, EVALUATED,
              equal_counts(self, nKnowns, nSeed) && equal_counts(self, nUnknowns, nSensitivity)
                  ? instance_derivative(self, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity, false)
                  : STATUS_ERROR);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                    size_t nUnknowns, const fmi3ValueReference knowns[], size_t nKnowns,
                                    const fmi3Float64 seed[], size_t nSeed, fmi3Float64 sensitivity[],
                                    size_t nSensitivity)
{
    FMI3_CALL(BOTH_KINDS, EVALUATED,
              equal_counts(self, nUnknowns, nSeed) && equal_counts(self, nKnowns, nSensitivity)
                  ? instance_derivative(self, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity, true)
                  : STATUS_ERROR);
}

/* --- saved states ------------------------------------------------------------------------------------------------ */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    FMI3_CALL(BOTH_KINDS, ANY_STATE, instance_save(self, FMUState));
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
    FMI3_CALL(BOTH_KINDS, ANY_STATE, instance_restore(self, FMUState));
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    FMI3_CALL(BOTH_KINDS, ANY_STATE, instance_free_state(FMUState));
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
    FMI3_CALL(BOTH_KINDS, ANY_STATE, instance_serialized_size(self, FMUState, size));
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[],
                                 size_t size)
{
    FMI3_CALL(BOTH_KINDS, ANY_STATE, instance_serialize(self, FMUState, serializedState, size));
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState)
{
    FMI3_CALL(BOTH_KINDS, ANY_STATE, instance_deserialize(self, serializedState, size, FMUState));
}

/* --- events ------------------------------------------------------------------------------------------------------ */

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    FMI3_CALL(KIND_ME, CONTINUOUS_TIME_MODE, instance_enter(self, EVENT_MODE));
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime)
{
    bool changed = false;
    Status status;

    FMI3_BEGIN(KIND_ME, EVENT_MODE)
    status = instance_event(self, &changed);
    PUT(discreteStatesNeedUpdate, false);
    PUT(terminateSimulation, false);
    PUT(nominalsOfContinuousStatesChanged, false);
    PUT(valuesOfContinuousStatesChanged, changed);
    PUT(nextEventTimeDefined, false);
    PUT(nextEventTime, 0.0);
    return (fmi3Status)instance_end(self, status);
}

/* --- model exchange ---------------------------------------------------------------------------------------------- */

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    FMI3_CALL(KIND_ME, EVENT_MODE, instance_enter(self, CONTINUOUS_TIME_MODE));
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
{
    FMI3_BEGIN(KIND_ME, CONTINUOUS_TIME_MODE)
    PUT(enterEventMode, false);
    PUT(terminateSimulation, false);
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    FMI3_CALL(KIND_ME, EVENT_MODE | CONTINUOUS_TIME_MODE, instance_set_time(self, time));
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
                                   size_t nContinuousStates)
{
    FMI3_CALL(KIND_ME, CONTINUOUS_TIME_MODE, instance_set_states(self, continuousStates, nContinuousStates));
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[],
                                   size_t nContinuousStates)
{
    FMI3_CALL(KIND_ME, EVALUATED,
              instance_get_all(self, CAUSALITY_STATE, false, continuousStates, nContinuousStates));
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
                                             size_t nContinuousStates)
{
    FMI3_CALL(KIND_ME, EVALUATED,
              instance_get_all(self, CAUSALITY_RATE, false, derivatives, nContinuousStates));
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[],
                                  size_t nEventIndicators)
{
    FMI3_CALL(KIND_ME, EVALUATED,
              instance_get_all(self, CAUSALITY_INDICATOR, false, eventIndicators, nEventIndicators));
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[],
                                             size_t nContinuousStates)
{
    FMI3_CALL(KIND_ME, EVALUATED, instance_get_nominals(self, nominals, nContinuousStates));
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators)
{
    FMI3_CALL(KIND_ME, ANY_STATE, instance_put_count(self, CAUSALITY_INDICATOR, nEventIndicators));
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates)
{
    FMI3_CALL(KIND_ME, ANY_STATE, instance_put_count(self, CAUSALITY_STATE, nContinuousStates));
}

/* --- co-simulation ----------------------------------------------------------------------------------------------- */

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    Status status;

    FMI3_BEGIN(KIND_CS, STEP_MODE)
    status = instance_step(self, currentCommunicationPoint, communicationStepSize, false, true);
    PUT(eventHandlingNeeded, false);
    PUT(terminateSimulation, false);
    PUT(earlyReturn, false);
    PUT(lastSuccessfulTime, self->now.time);
    return (fmi3Status)status;
}

/* --- what this FMU has not --------------------------------------------------------------------------------------- */

/* Types without variables. */
#define FMI3_NO_VARIABLES(name, type, states, ...) \
    fmi3Status name(fmi3Instance instance, const fmi3ValueReference valueReferences[], \
                    size_t nValueReferences, __VA_ARGS__) \
    { \
        FMI3_CALL(BOTH_KINDS, states, instance_no_variables(self, type, valueReferences, nValueReferences)); \
    }
#define FMI3_NO_TYPE(get, set, type, settable) \
    FMI3_NO_VARIABLES(get, #type, EVALUATED, fmi3##type values[], size_t nValues) \
    FMI3_NO_VARIABLES(set, #type, settable, const fmi3##type values[], size_t nValues)
FMI3_NO_TYPE(fmi3GetFloat32, fmi3SetFloat32, Float32, SETTABLE | CONTINUOUS_TIME_MODE)
FMI3_NO_TYPE(fmi3GetInt8, fmi3SetInt8, Int8, SETTABLE)
FMI3_NO_TYPE(fmi3GetUInt8, fmi3SetUInt8, UInt8, SETTABLE)
FMI3_NO_TYPE(fmi3GetInt16, fmi3SetInt16, Int16, SETTABLE)
FMI3_NO_TYPE(fmi3GetUInt16, fmi3SetUInt16, UInt16, SETTABLE)
FMI3_NO_TYPE(fmi3GetInt32, fmi3SetInt32, Int32, SETTABLE)
FMI3_NO_TYPE(fmi3GetUInt32, fmi3SetUInt32, UInt32, SETTABLE)
FMI3_NO_TYPE(fmi3GetInt64, fmi3SetInt64, Int64, SETTABLE)
FMI3_NO_TYPE(fmi3GetUInt64, fmi3SetUInt64, UInt64, SETTABLE)
FMI3_NO_TYPE(fmi3GetString, fmi3SetString, String, SETTABLE)
FMI3_NO_VARIABLES(fmi3GetBinary, "Binary", EVALUATED, size_t valueSizes[], fmi3Binary values[],
                  size_t nValues)
FMI3_NO_VARIABLES(fmi3SetBinary, "Binary", SETTABLE, const size_t valueSizes[], const fmi3Binary values[],
                  size_t nValues)
FMI3_NO_VARIABLES(fmi3GetClock, "Clock", AT_EVENTS, fmi3Clock values[])
FMI3_NO_VARIABLES(fmi3SetClock, "Clock", AT_EVENTS, const fmi3Clock values[])
FMI3_NO_VARIABLES(fmi3GetIntervalDecimal, "Clock", AT_EVENTS, fmi3Float64 intervals[],
                  fmi3IntervalQualifier qualifiers[])
FMI3_NO_VARIABLES(fmi3GetIntervalFraction, "Clock", AT_EVENTS, fmi3UInt64 counters[],
                  fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
FMI3_NO_VARIABLES(fmi3GetShiftDecimal, "Clock", AT_EVENTS, fmi3Float64 shifts[])
FMI3_NO_VARIABLES(fmi3GetShiftFraction, "Clock", AT_EVENTS, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
FMI3_NO_VARIABLES(fmi3SetIntervalDecimal, "Clock", AT_EVENTS, const fmi3Float64 intervals[])
FMI3_NO_VARIABLES(fmi3SetIntervalFraction, "Clock", AT_EVENTS, const fmi3UInt64 counters[],
                  const fmi3UInt64 resolutions[])
FMI3_NO_VARIABLES(fmi3SetShiftDecimal, "Clock", AT_EVENTS, const fmi3Float64 shifts[])
FMI3_NO_VARIABLES(fmi3SetShiftFraction, "Clock", AT_EVENTS, const fmi3UInt64 counters[],
                  const fmi3UInt64 resolutions[])

/* Functions without use. A step has no event mode to leave. */
#define FMI3_REFUSED(name, kinds, states, reason, ...) \
    fmi3Status name(__VA_ARGS__) \
    { \
        FMI3_CALL(kinds, states, instance_fail(self, reason)); \
    }
#define NO_STRUCTURE "no configuration mode: there are no structural parameters"
#define NO_ELEMENTS "providesPerElementDependencies is false; all variables are scalars"
FMI3_REFUSED(fmi3EnterConfigurationMode, BOTH_KINDS, INSTANTIATED | STEP_MODE | EVENT_MODE, NO_STRUCTURE,
             fmi3Instance instance)
FMI3_REFUSED(fmi3ExitConfigurationMode, BOTH_KINDS, 0U, NO_STRUCTURE, fmi3Instance instance)
FMI3_REFUSED(fmi3GetNumberOfVariableDependencies, BOTH_KINDS, ANY_STATE, NO_ELEMENTS, fmi3Instance instance,
             fmi3ValueReference valueReference, size_t *nDependencies)
FMI3_REFUSED(fmi3GetVariableDependencies, BOTH_KINDS, ANY_STATE, NO_ELEMENTS, fmi3Instance instance,
             fmi3ValueReference dependent, size_t elementIndicesOfDependent[],
             fmi3ValueReference independents[], size_t elementIndicesOfIndependents[],
             fmi3DependencyKind dependencyKinds[], size_t nDependencies)
FMI3_REFUSED(fmi3EvaluateDiscreteStates, BOTH_KINDS, AT_EVENTS, "providesEvaluateDiscreteStates is false",
             fmi3Instance instance)
FMI3_REFUSED(fmi3ActivateModelPartition, BOTH_KINDS, 0U, "no clocks", fmi3Instance instance,
             fmi3ValueReference clockReference, fmi3Float64 activationTime)
FMI3_REFUSED(fmi3EnterStepMode, KIND_CS, 0U, "no event mode", fmi3Instance instance)
FMI3_REFUSED(fmi3GetOutputDerivatives, KIND_CS, STEP_MODE | TERMINATED | FAILED,
             "no derivatives of outputs over time", fmi3Instance instance,
             const fmi3ValueReference valueReferences[], size_t nValueReferences, const fmi3Int32 orders[],
             fmi3Float64 values[], size_t nValues)
