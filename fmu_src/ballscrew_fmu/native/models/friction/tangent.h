/* Derivatives of outputs and rate of the friction FMU along one direction. */
#ifndef BALLSCREW_TANGENT_H
#define BALLSCREW_TANGENT_H

#include "map.h"
#include "variables.h"

/* What the bristle needs in addition to the variables. */
typedef struct {
    double step;      /* [s] that the outputs belong to; 0: an instant */
    bool continuous;  /* model exchange */
    int slip;         /* with events: 0 the bristle follows, +1 or -1 direction of slip */
    double stiffness; /* [N.m/rad] that the deflection belongs to; model exchange: constant between events */
    enum {
        RUNNING,
        GIVEN,    /* at the start: the deflection is as set, at the present stiffness */
        FROM_SIDE /* at the start: it follows from presliding_side */
    } start;
    double heat; /* [J] dissipated before the step; model exchange: at events */
} Moment;

/* at: inputs, parameters and the bristle at the start of the step */
void slopes_along(const Map *map, const double at[VARIABLE_COUNT], const double direction[VARIABLE_COUNT],
                  const Moment *moment, double slopes[VARIABLE_COUNT]);

#endif
