/* Integration of the axis over a communication step of co-simulation with constant inputs. */
#ifndef BALLSCREW_AXIS_STEP_H
#define BALLSCREW_AXIS_STEP_H

#include "axis_law.h"

typedef struct {
    double place[FREEDOMS], speed[FREEDOMS];
    double element[ELEMENTS]; /* of the screw, as in presliding_law.h */
    double guide;             /* of the guide, the same */
} Motion;

/* Friction of the screw that a part of a step is made with. */
typedef struct {
    PreslidingLevel elements;
    double viscous; /* [N.m.s/rad] torque over speed */
} Level;

typedef struct {
    Motion motion;
    Level level;     /* of the last part */
    double proposal; /* [s] length of the next part; 0: none yet */
    unsigned slips;  /* at the end, as in a Moment */
    int slip, guide_slip;
    double heat;     /* [J] of the step */
    double supplied; /* [J] of the step, by motor torque and external force */
    bool cut;        /* the step needed too many parts, or ended where numbers become too large */
} Advance;

/* at: inputs and parameters; step > 0. */
INTERNAL void axis_advance(const Map *map, const double at[VARIABLE_COUNT], double step, Advance *state);

#endif
