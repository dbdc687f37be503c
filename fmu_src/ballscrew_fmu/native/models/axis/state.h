/* State of BallScrewAxis, and of the integration over a step. */
#ifndef BALLSCREW_STATE_H
#define BALLSCREW_STATE_H

#include "axis_law.h"

typedef struct {
    double place[FREEDOMS], speed[FREEDOMS];
    double element[ELEMENTS]; /* of the screw, as in presliding_law.h */
    double slider[SLIDERS];   /* of shaft and guide, the same */
} Motion;

/* Friction of the screw that a part of a step is made with. */
typedef struct {
    PreslidingLevel elements;
    Sliding sliding;
    double viscous; /* [N.m.s/rad] torque over speed */
    double wipers;  /* their fraction of the torque of the elements */
} Level;

/* What a step starts from and ends with. Model exchange: modes, and friction of the elements, at the last event.
   Without padding, as it is copied: equal states have equal bytes. */
typedef struct {
    Motion motion;
    Level level;     /* of the last part */
    double proposal; /* [s] length of the next part; 0: none yet */
    double heat[PLACES]; /* [J] of the step */
    double supplied; /* [J] of the step, by motor torque and external force */
    unsigned slips;  /* bit per element that slides */
    int slip;        /* direction of those */
    int slider_slip[SLIDERS]; /* 0 it follows, +1 or -1 direction of slip */
} Advance;

typedef struct {
    const Map *map;
    double value[START_COUNT];   /* inputs, parameters and states; outputs when computed; table of the bearings */
    double latched[START_COUNT]; /* inputs, parameters and states that the outputs belong to */
    double step;                    /* [s] that the outputs belong to; 0: an instant */
    double heat, supplied;          /* [J] of all steps; model exchange: heat of events */
    Advance last;                   /* step */
    bool continuous;                /* model exchange: the states are those of the importer, modes change at events */
    bool in_range;                  /* model exchange: at the last event */
    bool cut;                       /* the step needed too many parts, or ended where numbers become too large */
    bool began;                     /* the first step or, in model exchange, the initial event is done */
    bool films_known, located, outputs_known;
    Point point; /* the latched one */
} Model;

#endif
