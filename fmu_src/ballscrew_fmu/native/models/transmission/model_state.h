/* State of the transmission: contacts, friction parts and bristle of both nuts. The bristle is a continuous state. */
#ifndef BALLSCREW_MODEL_STATE_H
#define BALLSCREW_MODEL_STATE_H

#include <stdbool.h>

#include "contacts.h"
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
    bool continuous;                /* model exchange: the bristle is a state of the importer */
    bool in_range;                  /* model exchange: at the last event */
    bool events_began;              /* model exchange: the initial event is done */
    int slip;                       /* model exchange: 0 the bristle follows, +1 or -1 direction of slip */
    bool conditions_known, parts_known, torque_known, films_known;
    bool approach_known;                        /* valid while the numbers that it belongs to do not change: */
    double approach_of[4], stiffness, approach; /* preload, nut stiffness, its preload, play; k [N/m^1.5], [m] */
    Contacts contacts;                          /* of the latched point, as the following: */
    Loads loads[2];                             /* of two nuts with the force of nut A, of nut B */
    Conditions conditions;
    Parts parts[2], both; /* of nut A and nut B; their sum */
};

/* Fields of a saved state other than value and latched: numbers, flags, signs. */
#define MODEL_NUMBERS(X) X(step) X(deflection_before) X(bristle_torque) X(bristle_power)
#define MODEL_FLAGS(X) X(continuous) X(in_range) X(events_began)
#define MODEL_SIGNS(X) X(slip)

#endif
