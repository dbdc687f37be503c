/* State of the preload monitor: the last preload that a torque determined. No continuous state. */
#ifndef BALLSCREW_MODEL_STATE_H
#define BALLSCREW_MODEL_STATE_H

#include <stdbool.h>

#include "map.h"
#include "variables.h"

struct Model {
    const Map *map;
    double value[VARIABLE_COUNT];   /* inputs and parameters as they are set; outputs when computed */
    double latched[VARIABLE_COUNT]; /* inputs and parameters that the outputs belong to */
    double held;                    /* [N] preload of the last step or, in model exchange, event that was in range */
    bool holds;                     /* there was one */
    bool continuous;                /* model exchange */
    bool in_range;                  /* model exchange: as of the last event, motion aside */
    bool rests;                     /* model exchange: as of the last event */
    bool events_began;              /* model exchange: the initial event has been */
    bool solved, films_known;       /* outputs of the latched point */
    unsigned clamped;               /* bit per input, of the latched point */
    double estimate;                /* [N] preload by the torque of the latched point */
    double elasticity;              /* relative change of torque over that of preload, there */
};

/* What a saved state holds beside value and latched: numbers, flags, signs. */
#define MODEL_NUMBERS(X) X(held)
#define MODEL_FLAGS(X) X(holds) X(continuous) X(in_range) X(rests) X(events_began)
#define MODEL_SIGNS(X)

#endif
