/* State of a screw with friction, of BallScrewFriction and BallScrewTransmission. The elasto-slip elements are continuous
   states. */
#ifndef BALLSCREW_STATE_H
#define BALLSCREW_STATE_H

#include "point.h"

typedef struct {
    const Map *map;
    double value[VARIABLE_COUNT];   /* inputs, parameters and elements as set; outputs when computed */
    double latched[VARIABLE_COUNT]; /* inputs and parameters that the outputs belong to */
    double step;                    /* [s] that the outputs belong to; 0: an instant */
    double before[ELEMENTS];        /* elements at the start of that step */
    double initial[ELEMENTS];       /* as found at the start; others have been set */
    double stiffness;               /* [N.m/rad] of the elements after the last step */
    double stiffness_here;          /* [N.m/rad] of the latched point */
    Presliding elements;            /* of the latched point */
    double event_heat;              /* [J] model exchange: lost by the elements at events */
    double heat;                    /* [J] co-simulation: dissipated before the step */
    bool continuous;                /* model exchange: the elements are states of the importer, modes change at events */
    bool in_range;                  /* model exchange: at the last event */
    bool from_side;                 /* before: the elements have not been set and follow from presliding_side */
    bool began;                     /* the first step or, in model exchange, the initial event is done */
    bool moved;                     /* model exchange: the initial event has set the elements */
    bool free;                      /* the elements hold no load, or all slide */
    bool follows;                   /* the stiffness is that of the loads */
    unsigned slips;                 /* model exchange: bit per element that slides */
    int slip;                       /* +1 or -1 direction in which they slide, 0: none does */
    bool films_known, located, parts_known, outputs_known;
    Point point; /* the latched one */
    Parts parts;
} Model;

#endif
