/* Derivatives of outputs and rates of the axis along one direction. */
#ifndef BALLSCREW_AXIS_TANGENT_H
#define BALLSCREW_AXIS_TANGENT_H

#include "map.h"
#include "variables.h"

/* What the axis needs in addition to the variables. */
typedef struct {
    unsigned slips;  /* bit per element that slides, */
    int slip;        /* in direction +1 or -1 */
    double stiffness; /* [N.m/rad] of the elements */
    int guide_slip;  /* direction of the guide that slides, 0: it follows */
    double heat;     /* [J] of all steps; model exchange: of events */
    double supplied; /* [J] of all steps */
} Moment;

#define slopes_along BALLSCREW_NAMED(BALLSCREW_PREFIX, slopes_along)

/* at: inputs, parameters and states, at an instant */
void slopes_along(const Map *map, const double at[VARIABLE_COUNT], const double direction[VARIABLE_COUNT],
                  const Moment *moment, double slopes[VARIABLE_COUNT]);

#endif
