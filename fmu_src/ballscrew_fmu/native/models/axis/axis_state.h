/* State of BallScrewAxis. */
#ifndef BALLSCREW_AXIS_STATE_H
#define BALLSCREW_AXIS_STATE_H

#include "axis_step.h"

struct Model {
    const Map *map;
    double value[VARIABLE_COUNT];   /* inputs, parameters and states; outputs when computed */
    double latched[VARIABLE_COUNT]; /* inputs, parameters and states that the outputs belong to */
    double step;                    /* [s] that the outputs belong to; 0: an instant */
    double lost;                    /* [J] in that step */
    double heat, supplied;          /* [J] of all steps; model exchange: heat of events */
    double proposal;                /* [s] of the integration of the next step */
    Level level;                    /* friction that it begins with */
    bool continuous;                /* model exchange: the states are those of the importer */
    bool events;                    /* the same: modes change at events only */
    bool in_range;                  /* with events: at the last event */
    bool began;                     /* the first step is done; with events: the initial event */
    bool cut;                       /* the last step is not within the error bound */
    int slip;                       /* direction of the elements that slide */
    int guide_slip;                 /* 0 the guide follows, +1 or -1 direction of slip */
    unsigned slips;                 /* bit per element that slides */
    bool located, outputs_known, films_known;
    Point point; /* the latched one */
};

/* Fields of a saved state other than value and latched. */
#define MODEL_NUMBERS(X) X(step) X(lost) X(heat) X(supplied) X(proposal) X(level.elements.coulomb) \
    X(level.elements.root) X(level.elements.damping) X(level.elements.unit) X(level.viscous)
#define MODEL_ARRAYS(X)
#define MODEL_FLAGS(X) X(continuous) X(events) X(in_range) X(began) X(cut)
#define MODEL_SIGNS(X) X(slip) X(guide_slip)
#define MODEL_MASKS(X) X(slips, ELEMENTS)

/* Whether the last step is not within the error bound. */
#define MODEL_CUTS_STEPS
INTERNAL bool model_step_cut(const struct Model *model);

#endif
