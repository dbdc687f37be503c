/* One instance for both FMI versions: screw, importer, states of the standards, saved states. Independent of the FMI
   headers: fmi2.c and fmi3.c translate the calls. The other files of the runtime have the functions. */
#ifndef BALLSCREW_INSTANCE_H
#define BALLSCREW_INSTANCE_H

#include <stdbool.h>
#include <stddef.h>

#include "model.h"
#include "text.h"

/* What differs between the FMUs of a model, read from the resources. */
typedef struct {
    char token[HASH_SIZE + 1]; /* guid of FMI 2, instantiationToken of FMI 3 */
    char map[HASH_SIZE + 1];   /* content hash of the map that the model description is of */
    int law;                   /* of its friction: required of the map */
    double start[START_COUNT]; /* of inputs, parameters and the state, else 0; numbers of the model */
    char origin[ORIGIN_SIZE];  /* of friction numbers that were measured on another screw; "": none */
} Screw;

typedef enum { STATUS_OK, STATUS_WARNING, STATUS_DISCARD, STATUS_ERROR, STATUS_FATAL } Status; /* as FMI 2 and FMI 3 */

#define MESSAGE_SIZE 640

/* Arguments of the importer at instantiation. */
typedef struct Importer Importer;
struct Importer {
    void (*emit)(const Importer *importer, const char *instance_name, Status status, const char *category,
                 const char *message); /* calls the logger as in this FMI version */
    void (*logger)(void);              /* of the importer, cast back by emit; NULL: none */
    void *environment;
    bool time_variable; /* FMI 3: time has a value reference */
};

/* States of the state machines of the standards, as bits of a set. FAILED is "error" of FMI 2 and Terminated of FMI 3,
   where the same calls are allowed. */
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

/* Content of a saved state. */
typedef struct {
    double time; /* [s] last communication point, or as set in model exchange */
    double stop; /* [s] infinity: not defined */
    unsigned state;
    unsigned warned; /* warnings already logged: bit per clamped variable, and these */
    bool stale;      /* a value was set after the outputs were computed */
    bool unchecked;  /* co-simulation: a value that was set may be invalid */
    bool postponed;  /* co-simulation: initialization ended with an invalid value; the first good step does it */
    Model model;     /* last */
} InstanceState;

/* beyond the bits of model_clamped */
#define WARNED_TIME (1U << 29)
#define WARNED_STEP (1U << 30)

typedef struct Saved Saved;
struct Saved {
    Saved *next, *previous; /* ring, with a head that has no state */
    InstanceState state;
};

enum { KIND_CS = 1, KIND_ME = 2, BOTH_KINDS = 3 }; /* co-simulation, model exchange */

typedef struct Instance Instance;
struct Instance {
    InstanceState now;
    unsigned kind;
    unsigned categories; /* bit per status that is logged */
    const char *call;    /* current call, for messages */
    Map *map;
    Screw screw;
    Saved saved; /* head of the ring of states saved by the importer */
    Importer importer;
    char name[1];
};

/* End of every FMI call: after an error only reset, restore and free are legal. */
static inline Status instance_end(Instance *instance, Status status)
{
    if (status == STATUS_ERROR) {
        instance->now.state = FAILED;
    }
    return status;
}

#endif
