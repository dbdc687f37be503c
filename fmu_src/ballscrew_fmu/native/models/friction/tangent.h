/* Derivatives of outputs and rate of the friction FMU along one direction. */
#ifndef BALLSCREW_TANGENT_H
#define BALLSCREW_TANGENT_H

#include <stdbool.h>

#include "map.h"
#include "variables.h"

/* What the elasto-slip elements need in addition to the variables. */
typedef struct {
    double step;     /* [s] that the outputs belong to; 0: an instant */
    bool continuous; /* model exchange */
    double stiffness; /* [N.m/rad] of the elements; 0: that of the loads */
    bool from_side;  /* at the start: the elements follow from presliding_side */
    unsigned slips;  /* model exchange: bit per element that slides */
    int slip;        /* +1 or -1 direction in which they slide, 0: none does */
    double heat;     /* [J] dissipated before the step; model exchange: at events */
} Moment;

#define slopes_along BALLSCREW_NAMED(BALLSCREW_PREFIX, slopes_along)

/* at: inputs, parameters and the elements at the start of the step */
void slopes_along(const Map *map, const double at[VARIABLE_COUNT], const double direction[VARIABLE_COUNT],
                  const Moment *moment, double slopes[VARIABLE_COUNT]);

#endif
