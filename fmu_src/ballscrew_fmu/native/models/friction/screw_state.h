/* State of a screw with friction, at a Point of the file that includes this: friction parts, standstill law. The elasto-slip
   elements are continuous states. */
#ifndef BALLSCREW_SCREW_STATE_H
#define BALLSCREW_SCREW_STATE_H

#include <stdbool.h>

#include "nut_law.h"
#include "variables.h"

struct Model {
    const Map *map;
    double value[VARIABLE_COUNT];   /* inputs, parameters and elements as set; outputs when computed */
    double latched[VARIABLE_COUNT]; /* inputs and parameters that the outputs belong to */
    double step;                    /* [s] that the outputs belong to; 0: an instant */
    double before[ELEMENTS];        /* elements at the start of that step */
    double initial[ELEMENTS];       /* as found at the start; others have been set */
    double stiffness;               /* [N.m/rad] of the elements after the last step */
    double stiffness_here;          /* [N.m/rad] of the latched point */
    double element_torque;          /* [N.m] of the latched point */
    double element_power;           /* [W] */
    double element_supply;          /* [W] of the motion */
    double power_of_parts;          /* [W] of a step in parts: its mean power minus that of its last part */
    double event_heat;              /* [J] model exchange: lost by the elements at events */
    double heat;                    /* [J] co-simulation: dissipated before the step */
    bool continuous;                /* model exchange: the elements are states of the importer */
    bool events;                    /* in_range changes at events only: model exchange, co-simulation with event mode */
    bool in_range;                  /* with events: at the last event */
    bool from_side;                 /* before: the elements have not been set and follow from presliding_side */
    bool began;                     /* the first step is done; with events: the initial event */
    bool moved;                     /* model exchange: the initial event has set the elements */
    bool free;                      /* the elements hold no load, or all slide */
    bool follows;                   /* it is that of the loads */
    unsigned slips;                 /* model exchange: bit per element that slides */
    int slip;                       /* +1 or -1 direction in which they slide, 0: none does */
#ifdef MODEL_COUPLING
    Coupling coupling; /* co-simulation: with the masses of the importer */
#endif
    bool located, parts_known, outputs_known, films_known;
    Point point; /* the latched one */
    Parts parts;
};

/* Fields of a saved state other than value and latched: numbers, arrays with their lengths, flags, masks with their
   numbers of bits, signs. */
#define MODEL_NUMBERS(X) X(step) X(stiffness) X(stiffness_here) X(element_torque) X(element_power) X(element_supply) X(power_of_parts) \
    X(event_heat) X(heat) MODEL_COUPLING_NUMBERS(X)
#define MODEL_ARRAYS(X) X(before, ELEMENTS) X(initial, ELEMENTS) MODEL_COUPLING_ARRAYS(X)
#define MODEL_FLAGS(X) X(continuous) X(events) X(in_range) X(from_side) X(began) X(moved) X(free) X(follows)
#define MODEL_MASKS(X) X(slips, ELEMENTS)
#define MODEL_SIGNS(X) X(slip)

/* Whether a step that has been made is too long for the elements, with their stiffness [N.m/rad] and damping
   [N.m.s/rad]. */
#define MODEL_WARNS_OF_STEPS
INTERNAL bool model_step_too_long(struct Model *model, double step, double *stiffness, double *damping);

#ifdef MODEL_COUPLING
/* Whether the exchange of motion and force in steps of this length [s] is unstable, and which is not. */
INTERNAL bool model_coupling_unstable(struct Model *model, double step, CouplingLimit *limit);
#endif

#endif
