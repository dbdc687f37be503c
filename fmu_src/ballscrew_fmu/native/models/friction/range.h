/* Distance of the inputs from the limits of the map. Twin of runtime/evaluate.py. Numbers: number.h. */
#ifndef BALLSCREW_RANGE_H
#define BALLSCREW_RANGE_H

#include "nut.h"
#include "variables.h"

/* Least distance from the limits of preload, speed, temperature and force of the loaded nut, each as a share of the
   length of its axis. */
static inline Number margin_of_inputs(const Map *map, const Number at[])
{
    Number found = nut_margin(map, at[PRELOAD], at[SPEED], at[TEMPERATURE]), force[2];

    if (value_of(at[AXIAL_LOAD]) != 0.0) {
        nut_forces(map, clamped(at[PRELOAD], 0.0, map->force.hi), at[AXIAL_LOAD], force);
        found = lesser(found, over(subtract(constant(map->force.hi), force[1]), map->force.hi));
    }
    return found;
}

#endif
