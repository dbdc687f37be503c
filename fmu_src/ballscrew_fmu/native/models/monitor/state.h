/* State of the preload monitor: the last preload that was in range. No continuous state. */
#ifndef BALLSCREW_STATE_H
#define BALLSCREW_STATE_H

#include <stdbool.h>

#include "map.h"
#include "variables.h"

typedef struct {
    const Map *map;
    double value[VARIABLE_COUNT];   /* inputs and parameters as set; outputs when computed */
    double latched[VARIABLE_COUNT]; /* inputs and parameters that the outputs belong to */
    double stored;                  /* [N] preload of the last step or event that was in range */
    bool has_stored;                /* stored is defined */
    bool continuous;                /* model exchange: modes change at events only */
    bool in_range;                  /* model exchange: at the last event, without the condition on speed */
    bool rests;                     /* model exchange: at the last event, speed below speed_min */
    bool began;                     /* model exchange: the initial event is done */
    bool films_known, solved;       /* outputs of the latched point are computed */
    unsigned clamped;               /* bit per input, of the latched point */
    double estimate;                /* [N] preload from the torque of the latched point */
    double elasticity;              /* relative change of torque divided by that of preload */
} Model;

#endif
