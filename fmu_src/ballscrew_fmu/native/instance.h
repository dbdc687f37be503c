/* One instance behind both FMI versions: which call is legal when, messages, time, values, saved states.
   Knows no FMI header; fmi2.c and fmi3.c translate. */
#ifndef BALLSCREW_INSTANCE_H
#define BALLSCREW_INSTANCE_H

#include <stdbool.h>
#include <stddef.h>

#include "model.h"

typedef enum { STATUS_OK, STATUS_WARNING, STATUS_DISCARD, STATUS_ERROR, STATUS_FATAL } Status; /* as FMI 2 and FMI 3 */

/* States of the standards' state machines; bits, so that a set of states is a number. FAILED is "error" of FMI 2; FMI 3
   says Terminated, which allows the same calls. */
enum {
    INSTANTIATED = 1,
    INITIALIZATION_MODE = 2,
    EVENT_MODE = 4,
    CONTINUOUS_TIME_MODE = 8,
    STEP_MODE = 16,
    TERMINATED = 32,
    FAILED = 64,
    ANY_STATE = 127
};

enum { CO_SIMULATION = 1, MODEL_EXCHANGE = 2, BOTH_KINDS = 3 };

typedef struct {
    const char *name;
    unsigned kinds, states; /* where the call is legal */
} Call;

/* What the importer hands over when it instantiates. */
typedef struct Importer Importer;
struct Importer {
    void (*emit)(const Importer *importer, const char *instance_name, Status status, const char *category,
                 const char *message); /* calls the logger as this FMI version wants it */
    void (*logger)(void);              /* of the importer, cast back by emit; NULL: none */
    void *environment;
    void *(*allocate)(size_t count, size_t size); /* zeroed, as calloc */
    void (*release)(void *memory);
};

/* All that a saved state holds. */
typedef struct {
    Model model;
    double time; /* [s] last communication point, or as set in model exchange */
    double stop; /* [s] infinity: not defined */
    unsigned state;
    unsigned warned; /* what was said once: bit per clamped input, then WARNED_TIME */
    bool stale;      /* something was set that the outputs do not follow yet */
} Situation;

#define WARNED_TIME (1U << INPUT_COUNT)

typedef struct Link Link;
struct Link {
    Link *next, *previous;
};

typedef struct {
    Situation now;
    unsigned kind;
    bool time_variable; /* FMI 3: time has a value reference */
    bool logging;
    unsigned categories; /* bit per status */
    const char *call;    /* under way, for messages */
    Map *map;
    Link saved; /* ring of the states that the importer holds */
    Importer importer;
    char name[1];
} Instance;

/* NULL, with a message, if the instance cannot be made. resources: folder of the map, as URI or as path. */
Instance *instance_create(const Importer *importer, unsigned kind, const char *name, const char *token,
                          const char *resources, bool is_uri, bool logging);
void instance_free(Instance *instance);

/* The map in the resources; NULL with a message. */
Map *importer_map(const Importer *importer, const char *name, const char *resources, bool is_uri);

/* Message about an instance that is not made; no setting of the log can hold it back. */
void importer_refuse(const Importer *importer, const char *name, const char *format, ...);

/* Every FMI call starts here. NULL: refused with a message, and the instance has failed. */
Instance *instance_begin(void *handle, const Call *call);

/* Log, and return STATUS_ERROR from an instance that has failed by it; or STATUS_DISCARD, nothing changed. */
Status instance_fail(Instance *instance, const char *format, ...);
Status instance_discard(Instance *instance, const char *format, ...);

Status instance_set_logging(Instance *instance, bool on, size_t count, const char *const categories[]);

/* Life. */
Status instance_setup(Instance *instance, double start, bool stop_defined, double stop);
Status instance_enter(Instance *instance, unsigned state);
Status instance_exit_initialization(Instance *instance);
Status instance_reset(Instance *instance);

/* Bring the outputs to what was set, where they follow it: in co-simulation only steps do, once it is initialized. */
void instance_follow(Instance *instance);

/* Values. A call that fails or is discarded stores nothing. */
bool instance_is_real(unsigned reference);
Status instance_missing_array(Instance *instance);
Status instance_get_reals(Instance *instance, const unsigned references[], size_t count, double values[]);
Status instance_set_reals(Instance *instance, const unsigned references[], size_t count, const double values[]);
Status instance_get_boolean(Instance *instance, unsigned reference, bool *value);
Status instance_set_boolean(Instance *instance, unsigned reference);
Status instance_no_variables(Instance *instance, const char *type, const unsigned references[], size_t count);

/* Derivatives of outputs and rates along inputs, continuous states and, while initializing, parameters; forward: sensitivity of each unknown along the seed of the knowns; adjoint: of each known along that of the
   unknowns. */
Status instance_derivative(Instance *instance, const unsigned unknowns[], size_t unknown_count,
                           const unsigned knowns[], size_t known_count, const double seed[], double sensitivity[],
                           bool adjoint);

/* Co-simulation. */
Status instance_step(Instance *instance, double time, double step, bool zero_allowed, bool check_time);

/* Number of variables of a causality. */
size_t instance_count(enum Causality causality);

/* Model exchange. The length is that of the importer's array. */
Status instance_set_time(Instance *instance, double time);
Status instance_event(Instance *instance, bool *state_changed);
Status instance_set_states(Instance *instance, const double states[], size_t length);
Status instance_get_states(Instance *instance, double states[], size_t length);
Status instance_get_rates(Instance *instance, double rates[], size_t length);
Status instance_get_nominals(Instance *instance, double nominals[], size_t length);
Status instance_get_indicators(Instance *instance, double indicators[], size_t length);

/* Saved states (saved_state.c). */
Status instance_save(Instance *instance, void **state);
Status instance_restore(Instance *instance, const void *state);
Status instance_forget(Instance *instance, void **state);
Status instance_serialized_size(Instance *instance, const void *state, size_t *size);
Status instance_serialize(Instance *instance, const void *state, unsigned char *bytes, size_t size);
Status instance_deserialize(Instance *instance, const unsigned char *bytes, size_t size, void **state);
void instance_forget_all(Instance *instance);

#endif
