/* Functions that both FMI versions have alike, included by each. FMI: fmi2 or fmi3; STATE, DESERIALIZE, DERIVATIVES: words
   that they spell differently; NOMINALS_IN: states in which nominal values may be read. */

void FMI_OF(FMI, FreeInstance)(void *instance)
{
    instance_free(instance);
}

FORWARD(SetDebugLogging, BOTH_KINDS, ANY_STATE,
        (void *instance, FMI_OF(FMI, Boolean) loggingOn, size_t nCategories,
         const FMI_OF(FMI, String) categories[]),
        instance_set_logging(self, loggingOn != 0, nCategories, categories))
FORWARD(ExitInitializationMode, BOTH_KINDS, INITIALIZATION_MODE, (void *instance), instance_exit_initialization(self))
FORWARD(Terminate, BOTH_KINDS, RUNNING, (void *instance), instance_enter(self, TERMINATED))
FORWARD(Reset, BOTH_KINDS, ANY_STATE, (void *instance), instance_reset(self))

/* --- saved states --- */

FORWARD(FMI_OF(Get, STATE), BOTH_KINDS, ANY_STATE, (void *instance, void **state), instance_save(self, state))
FORWARD(FMI_OF(Set, STATE), BOTH_KINDS, ANY_STATE, (void *instance, void *state), instance_restore(self, state))
FORWARD(FMI_OF(Free, STATE), BOTH_KINDS, ANY_STATE, (void *instance, void **state), instance_free_state(state))
FORWARD(FMI_OF(FMI_OF(Serialized, STATE), Size), BOTH_KINDS, ANY_STATE, (void *instance, void *state, size_t *size),
        instance_serialized_size(self, state, size))
FORWARD(FMI_OF(Serialize, STATE), BOTH_KINDS, ANY_STATE,
        (void *instance, void *state, FMI_OF(FMI, Byte) bytes[], size_t size),
        instance_serialize(self, state, (unsigned char *)bytes, size))
FORWARD(FMI_OF(DESERIALIZE, STATE), BOTH_KINDS, ANY_STATE,
        (void *instance, const FMI_OF(FMI, Byte) bytes[], size_t size, void **state),
        instance_deserialize(self, (const unsigned char *)bytes, size, state))

/* --- model exchange --- */

FORWARD(EnterContinuousTimeMode, KIND_ME, EVENT_MODE, (void *instance),
        instance_enter(self, CONTINUOUS_TIME_MODE))
FORWARD(SetTime, KIND_ME, EVENT_MODE | CONTINUOUS_TIME_MODE, (void *instance, double time),
        instance_set_time(self, time))
FORWARD(SetContinuousStates, KIND_ME, CONTINUOUS_TIME_MODE, (void *instance, const double states[], size_t count),
        instance_set_states(self, states, count))
FORWARD(GetContinuousStates, KIND_ME, EVALUATED, (void *instance, double states[], size_t count),
        instance_get_all(self, CAUSALITY_STATE, false, states, count))
FORWARD(DERIVATIVES, KIND_ME, EVALUATED, (void *instance, double derivatives[], size_t count),
        instance_get_all(self, CAUSALITY_RATE, false, derivatives, count))
FORWARD(GetEventIndicators, KIND_ME, EVALUATED, (void *instance, double indicators[], size_t count),
        instance_get_all(self, CAUSALITY_INDICATOR, false, indicators, count))
/* fmi4c asks without an array, and ends if it is refused */
FORWARD(GetNominalsOfContinuousStates, KIND_ME, NOMINALS_IN, (void *instance, double nominals[], size_t count),
        nominals == NULL ? STATUS_OK : instance_get_all(self, CAUSALITY_STATE, true, nominals, count))
