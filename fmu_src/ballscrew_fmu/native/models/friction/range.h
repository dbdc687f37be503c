/* Distance of the inputs from the limits of the map. Twin of runtime/evaluate.py. Numbers: number.h. */
#ifndef BALLSCREW_RANGE_H
#define BALLSCREW_RANGE_H

#include "nut.h"
#include "variables.h"

/* Distance from the ends of an axis divided by its length, negative outside. */
static inline Number margin_within(Number value, double lo, double hi)
{
    return over(lesser(subtract(value, constant(lo)), subtract(constant(hi), value)), hi - lo);
}

/* Least distance from the limits of preload, speed, temperature and force of the loaded nut, each as a share of the
   length of its axis. */
static inline Number margin_of_inputs(const Map *map, const Number at[])
{
    Number found = margin_within(at[PRELOAD], map->preload.lo, map->force.hi), force[2];

    found = lesser(found, margin_within(at[TEMPERATURE], map->temperature.lo, map->temperature.hi));
    found = lesser(found, over(subtract(constant(map->speed.hi), absolute(at[SPEED])), map->speed.hi));
    if (value_of(at[AXIAL_LOAD]) != 0.0) {
        nut_forces(map, clamped(at[PRELOAD], 0.0, map->force.hi), at[AXIAL_LOAD], force);
        found = lesser(found, over(subtract(constant(map->force.hi), force[1]), map->force.hi));
    }
    return found;
}

#endif
