/* One instance for both FMI versions: legal calls by state, messages, time, values, saved states. Independent of the
   FMI headers: fmi2.c and fmi3.c translate the calls. */
#ifndef BALLSCREW_INSTANCE_H
#define BALLSCREW_INSTANCE_H

#include <stdbool.h>
#include <stddef.h>

#include "importer.h"
#include "saved_state.h"

enum { CO_SIMULATION = 1, MODEL_EXCHANGE = 2, BOTH_KINDS = 3 };

typedef struct {
    const char *name;
    unsigned kinds, states; /* in which the call is legal */
} Call;

typedef struct Instance Instance;
struct Instance {
    Situation now;
    unsigned kind;
    bool time_variable; /* FMI 3: time has a value reference */
    bool event_mode;    /* co-simulation with event mode */
    bool early_return;  /* a step may end early */
    /* Intermediate update: calls the importer, NULL: none. True: it requests to return at *until [s]. */
    bool (*update)(const Instance *instance, double time, bool settable, bool may_return, double *until);
    void (*callback)(void); /* of the importer, cast back by update */
    bool logging;
    unsigned categories; /* bit per status */
    const char *call;    /* current call, for messages */
    Map *map;
    Screw screw;
    Saved saved; /* head of the ring of states saved by the importer */
    Importer importer;
    char name[1];
};

/* NULL, with a message, if the instance cannot be created. resources: folder of screw and map, as URI or as path. */
INTERNAL Instance *instance_create(const Importer *importer, unsigned kind, const char *name, const char *token,
                                   const char *resources, bool is_uri, bool logging);
INTERNAL void instance_free(Instance *instance);

/* Start of every FMI call. NULL: the call is illegal, which is logged, and the instance has failed. */
INTERNAL Instance *instance_begin(void *handle, const Call *call);

/* End of every FMI call: after an error only reset, restore and free are legal. */
static inline Status instance_end(Instance *instance, Status status)
{
    if (status == STATUS_ERROR) {
        instance->now.state = FAILED;
    }
    return status;
}

/* Messages (messages.c). Log and return the status: STATUS_ERROR; or STATUS_DISCARD, nothing has changed. */
INTERNAL Status instance_log(Instance *instance, Status status, const char *format, ...);
#define instance_fail(instance, ...) instance_log(instance, STATUS_ERROR, __VA_ARGS__)
#define instance_discard(instance, ...) instance_log(instance, STATUS_DISCARD, __VA_ARGS__)
#define instance_warn(instance, ...) (void)instance_log(instance, STATUS_WARNING, __VA_ARGS__)
INTERNAL bool instance_logs(const Instance *instance, Status status);
#define ALL_CATEGORIES ((1U << CATEGORIES) - 1U)
INTERNAL Status instance_set_logging(Instance *instance, bool on, size_t count, const char *const categories[]);

/* Names of a set of states, e.g. "Event Mode, Terminated". */
INTERNAL void instance_list_states(unsigned states, char *text, size_t size);

/* Life cycle. */
INTERNAL Status instance_setup(Instance *instance, double start, bool stop_defined, double stop);
INTERNAL Status instance_enter(Instance *instance, unsigned state);
INTERNAL Status instance_exit_initialization(Instance *instance);
INTERNAL Status instance_reset(Instance *instance);

/* Values (values.c), by value reference. A call that fails or is discarded stores nothing. In co-simulation a value
   that is not valid is stored, and steps are discarded until it is replaced, as in the FMU for Python hosts. */
INTERNAL unsigned instance_index(unsigned reference); /* in the table of variables; VARIABLE_COUNT: none */
INTERNAL bool instance_is_valid(Instance *instance);  /* all values that were set; if not, the first one is logged */
INTERNAL Status instance_missing_array(Instance *instance);
/* Update the outputs after valid values were set. In step mode of co-simulation only a step updates them. */
INTERNAL void instance_follow(Instance *instance);
INTERNAL Status instance_get_reals(Instance *instance, const unsigned references[], size_t count, double values[]);
INTERNAL Status instance_set_reals(Instance *instance, const unsigned references[], size_t count, const double values[]);
INTERNAL Status instance_get_boolean(Instance *instance, unsigned reference, bool *value);
INTERNAL Status instance_set_boolean(Instance *instance, unsigned reference, bool value);
INTERNAL Status instance_no_variables(Instance *instance, const char *type, const unsigned references[], size_t count);

/* Derivatives of outputs and rates with respect to inputs, continuous states and, in initialization mode, parameters
   (derivative.c). Forward: sensitivity of each unknown for the seed of the knowns. Adjoint: sensitivity of each known
   for the seed of the unknowns. */
INTERNAL Status instance_derivative(Instance *instance, const unsigned unknowns[], size_t unknown_count,
                           const unsigned knowns[], size_t known_count, const double seed[], double sensitivity[],
                                    bool adjoint);

/* Co-simulation. A step: arguments and values are checked, the model steps, the time is set. longest: [s] for which the
   inputs were constant. */
INTERNAL Status instance_begin_step(Instance *instance, double time, double step, bool zero_allowed, bool check_time);
INTERNAL void instance_end_step(Instance *instance, double time, double longest);
INTERNAL Status instance_step(Instance *instance, double time, double step, bool zero_allowed, bool check_time);

/* Co-simulation with event mode or intermediate updates (step_in_parts.c). */
typedef struct {
    bool event; /* due at the end */
    bool early; /* before the end of the communication step */
} StepEnd;
#if MODEL_PARTS
INTERNAL Status instance_step_in_parts(Instance *instance, double time, double step, StepEnd *end);
#endif

/* Co-simulation and model exchange. */
INTERNAL Status instance_enter_event_mode(Instance *instance);

/* Number of variables of a causality. */
INTERNAL size_t instance_count(enum Causality causality);

/* Model exchange. Vectors are in values.c; length is that of the array of the importer. */
INTERNAL Status instance_set_time(Instance *instance, double time);
INTERNAL Status instance_event(Instance *instance, bool *state_changed);
INTERNAL Status instance_set_states(Instance *instance, const double states[], size_t length);
INTERNAL Status instance_get_states(Instance *instance, double states[], size_t length);
INTERNAL Status instance_get_rates(Instance *instance, double rates[], size_t length);
INTERNAL Status instance_get_nominals(Instance *instance, double nominals[], size_t length);
INTERNAL Status instance_get_indicators(Instance *instance, double indicators[], size_t length);

/* Saved states. */
INTERNAL Status instance_save(Instance *instance, void **state);
INTERNAL Status instance_restore(Instance *instance, const void *state);
INTERNAL Status instance_free_state(Instance *instance, void **state);
INTERNAL Status instance_serialized_size(Instance *instance, const void *state, size_t *size);
INTERNAL Status instance_serialize(Instance *instance, const void *state, unsigned char *bytes, size_t size);
INTERNAL Status instance_deserialize(Instance *instance, const unsigned char *bytes, size_t size, void **state);

#endif
