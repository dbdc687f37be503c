#ifndef BALLSCREW_AXIS_PART_H
#define BALLSCREW_AXIS_PART_H

#include "state.h"

/* Constant in a communication step. */
typedef struct {
    const Map *map;
    const double *at;
    Mechanics mechanics;
    int freedoms;
    double inverse[FREEDOMS]; /* 1/sqrt(mass) */
    double force, way;        /* [N], [m] scales of force and deflection */
} Plant;

INTERNAL double deflection_of(const Mechanics *mechanics, const Motion *motion);
INTERNAL void level_at(const Plant *plant, double deflection, double speed, Level *level);
INTERNAL bool make_part(const Plant *plant, double length, Advance *state);

/* axis_step.c: integration over a step > 0 of co-simulation. at: inputs, constant, and parameters. False: the step needed
   too many parts, or ended where numbers become too large */
INTERNAL bool axis_advance(const Map *map, const double at[START_COUNT], double step, Advance *state);

#endif
