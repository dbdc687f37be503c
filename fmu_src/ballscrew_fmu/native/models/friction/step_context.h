#ifndef BALLSCREW_STEP_CONTEXT_H
#define BALLSCREW_STEP_CONTEXT_H

#include <stdbool.h>

/* What the elasto-slip elements need in addition to the variables. */
typedef struct {
    double step;     /* [s] that the outputs belong to; 0: an instant */
    bool continuous; /* model exchange */
    double stiffness; /* [N.m/rad] of the elements; 0: that of the loads */
    bool from_side;  /* at the start: the elements follow from presliding_side */
    unsigned slips;  /* model exchange: bit per element that slides */
    int slip;        /* +1 or -1 direction in which they slide, 0: none does */
    double heat;     /* [J] dissipated before the step; model exchange: at events */
} StepContext;

#endif
