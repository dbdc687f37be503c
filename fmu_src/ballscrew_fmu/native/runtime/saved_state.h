/* Saved states: a ring in the memory of the importer, and their bytes, the same on every platform. */
#ifndef BALLSCREW_SAVED_STATE_H
#define BALLSCREW_SAVED_STATE_H

#include "importer.h"
#include "model.h"

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
    ANY_STATE = 127,
    INTERMEDIATE_UPDATE_MODE = 128 /* within a step: is never saved, and only a few calls are allowed */
};

/* Content of a saved state. */
typedef struct {
    Model model;
    double time; /* [s] last communication point, or as set in model exchange */
    double stop; /* [s] infinity: not defined */
    unsigned state;
    unsigned warned; /* warnings already logged: bit per clamped variable, and these */
    bool stale;      /* a value was set after the outputs were computed */
    bool unchecked;  /* co-simulation: a value that was set may be invalid */
    bool postponed;  /* co-simulation: initialization ended with an invalid value; the first good step does it */
    bool reported;   /* event mode of co-simulation: the last step ended at an event, which is not handled yet */
} Situation;

/* beyond the bits of model_clamped */
#define WARNED_TIME (1U << 29)
#define WARNED_STEP (1U << 30)
#define WARNED_COUPLING (1U << 31)

typedef struct Saved Saved;
struct Saved {
    Saved *next, *previous; /* ring, with a head that has no state */
    Situation situation;
};

/* New state in the ring of this head. NULL: no memory. */
INTERNAL Saved *saved_new(Saved *head, const Importer *importer);
INTERNAL void saved_release(Saved *saved, const Importer *importer);

/* FMU and map of an instance; a state of another one is rejected. */
typedef struct {
    const char *token, *map;
} Owner;

/* Number of bytes; write that many bytes; read. False: the bytes are rejected, with the reason. */
INTERNAL size_t situation_size(const Situation *situation, Owner owner);
INTERNAL void situation_write(const Situation *situation, Owner owner, unsigned char *bytes);
INTERNAL bool situation_read(Situation *situation, Owner owner, const unsigned char *bytes, size_t size, char *reason,
                                      size_t reason_size);

#endif
