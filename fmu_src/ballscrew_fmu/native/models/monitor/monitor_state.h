/* State of the preload monitor: the last preload that was in range. No continuous state. */
#ifndef BALLSCREW_MONITOR_STATE_H
#define BALLSCREW_MONITOR_STATE_H

#include <stdbool.h>

#include "map.h"
#include "variables.h"

struct Model {
    const Map *map;
    double value[VARIABLE_COUNT];   /* inputs and parameters as set; outputs when computed */
    double latched[VARIABLE_COUNT]; /* inputs and parameters that the outputs belong to */
    double held;                    /* [N] preload of the last step or, in model exchange, event that was in range */
    bool holds;                     /* held is defined */
    bool continuous;                /* model exchange */
    bool events;                    /* modes change at events only: model exchange, co-simulation with event mode */
    bool in_range;                  /* with events: at the last event, without the condition on speed */
    bool rests;                     /* with events: at the last event, speed below speed_min */
    bool events_began;              /* with events: the initial event is done */
    bool solved, films_known;       /* outputs of the latched point are computed */
    unsigned clamped;               /* bit per input, of the latched point */
    double estimate;                /* [N] preload from the torque of the latched point */
    double elasticity;              /* relative change of torque divided by that of preload */
};

/* Fields of a saved state other than value and latched: as in screw_state.h. */
#define MODEL_NUMBERS(X) X(held)
#define MODEL_ARRAYS(X)
#define MODEL_FLAGS(X) X(holds) X(continuous) X(events) X(in_range) X(rests) X(events_began)
#define MODEL_MASKS(X)
#define MODEL_SIGNS(X)

#endif
