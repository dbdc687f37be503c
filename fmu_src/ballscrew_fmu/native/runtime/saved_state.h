/* Saved states: a ring of them in the memory of the importer, and their bytes, which every platform reads. */
#ifndef BALLSCREW_SAVED_STATE_H
#define BALLSCREW_SAVED_STATE_H

#include "importer.h"
#include "model.h"

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

typedef struct Saved Saved;
struct Saved {
    Saved *next, *previous; /* ring, with a head that holds no state */
    Situation situation;
};

/* New in the ring of this head; NULL: no memory. */
Saved *saved_new(Saved *head, const Importer *importer);
void saved_release(Saved *saved, const Importer *importer);

/* Bytes: their number; written to room for so many; read. False: they are refused, for this reason. */
size_t situation_size(const Situation *situation);
void situation_write(const Situation *situation, unsigned char *bytes);
bool situation_read(Situation *situation, const unsigned char *bytes, size_t size, char *reason, size_t reason_size);

#endif
