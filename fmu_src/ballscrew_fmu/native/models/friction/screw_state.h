/* State of a screw with friction, at a Point of the file that includes this: friction parts, standstill law. The bristle
   is a continuous state. */
#ifndef BALLSCREW_SCREW_STATE_H
#define BALLSCREW_SCREW_STATE_H

#include <stdbool.h>

#include "nut.h"
#include "variables.h"

struct Model {
    const Map *map;
    double value[VARIABLE_COUNT];   /* inputs, parameters and bristle as set; outputs when computed */
    double latched[VARIABLE_COUNT]; /* inputs and parameters that the outputs belong to */
    double step;                    /* [s] that the outputs belong to; 0: an instant */
    double deflection_before;       /* [rad] of the bristle at the start of that step */
    double stiffness_before;        /* [N.m/rad] that it belongs to */
    double stiffness;               /* [N.m/rad] that the present deflection belongs to */
    double initial_deflection;      /* [rad] as found at the start; another value has been set */
    double bristle_torque;          /* [N.m] of the latched point */
    double bristle_power;           /* [W] */
    double power_of_parts;          /* [W] of a step in parts: its mean power minus that of its last part */
    double bristle_supply;          /* [W] of the motion */
    double event_heat;              /* [J] lost by the bristle at events; co-simulation: part of the power of the next step */
    double heat;                    /* [J] co-simulation: dissipated before the step */
    bool continuous;                /* model exchange: the bristle is a state of the importer */
    bool events;                    /* modes change at events only: model exchange, co-simulation with event mode */
    bool in_range;                  /* with events: at the last event */
    bool from_side;                 /* before: the deflection has not been set and follows from presliding_side */
    bool began;                     /* the first step is done; with events: the initial event */
    bool moved;                     /* with events: the initial event has set the deflection */
    int slip;                       /* with events: 0 the bristle follows, +1 or -1 direction of slip */
    bool located, parts_known, torque_known, films_known;
    Point point; /* the latched one */
    Parts parts;
};

/* Fields of a saved state other than value and latched: numbers, flags, signs. */
#define MODEL_NUMBERS(X) X(step) X(deflection_before) X(stiffness_before) X(stiffness) X(initial_deflection) \
    X(bristle_torque) X(bristle_power) X(power_of_parts) X(bristle_supply) X(event_heat) X(heat)
#define MODEL_FLAGS(X) X(continuous) X(events) X(in_range) X(from_side) X(began) X(moved)
#define MODEL_SIGNS(X) X(slip)

/* Whether a step that has been made is too long for the bristle, with its stiffness [N.m/rad] and damping
   [N.m.s/rad]. */
#define MODEL_WARNS_OF_STEPS
bool model_step_too_long(const struct Model *model, double step, double *stiffness, double *damping);

#endif
