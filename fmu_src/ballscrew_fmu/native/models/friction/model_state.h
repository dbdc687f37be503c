/* State of the friction model: nuts, friction parts, standstill law. The bristle is a continuous state. */
#ifndef BALLSCREW_MODEL_STATE_H
#define BALLSCREW_MODEL_STATE_H

#include <stdbool.h>

#include "nut.h"
#include "variables.h"

struct Model {
    const Map *map;
    double value[VARIABLE_COUNT];   /* inputs, parameters and bristle as set; outputs when computed */
    double latched[VARIABLE_COUNT]; /* inputs and parameters that the outputs belong to */
    double step;                    /* [s] that the outputs belong to; 0: an instant */
    double deflection_before;       /* [rad] of the bristle at the start of that step */
    double bristle_torque;          /* [N.m] of the latched point */
    double bristle_power;           /* [W] */
    double power_of_parts;          /* [W] of a step in parts: its mean power minus that of its last part */
    bool continuous;                /* model exchange: the bristle is a state of the importer */
    bool events;                    /* modes change at events only: model exchange, co-simulation with event mode */
    bool in_range;                  /* with events: at the last event */
    bool events_began;              /* with events: the initial event is done */
    int slip;                       /* with events: 0 the bristle follows, +1 or -1 direction of slip */
    bool conditions_known, parts_known, torque_known, films_known;
    bool loads_known;                       /* valid while preload and axial load do not change: */
    double loads_preload, loads_axial_load; /* [N] that loads belong to */
    Loads loads;
    Conditions conditions;
    Parts parts; /* of the latched point */
};

/* Fields of a saved state other than value and latched: numbers, flags, signs. */
#define MODEL_NUMBERS(X) X(step) X(deflection_before) X(bristle_torque) X(bristle_power) X(power_of_parts)
#define MODEL_FLAGS(X) X(continuous) X(events) X(in_range) X(events_began)
#define MODEL_SIGNS(X) X(slip)

#endif
