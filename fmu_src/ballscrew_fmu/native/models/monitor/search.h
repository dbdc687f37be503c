/* Torque over preload at one speed, temperature and axial load, and the preload that gives a torque. Twin of
   preload.py. */
#ifndef BALLSCREW_SEARCH_H
#define BALLSCREW_SEARCH_H

#include <stdbool.h>

#include "map.h"
#include "variables.h"

typedef struct {
    double preload, torque; /* [N], [N.m] */
    double slope;           /* [N.m/N] of the torque over the preload */
    bool found;             /* the torque is the one wanted */
    bool speed_clamped, temperature_clamped, axial_load_clamped;
} Estimate;

/* Torque at a preload up to the end of the map. at: inputs and parameters; speed: in place of that in at. */
void torque_of_preload(const Map *map, const double at[VARIABLE_COUNT], double speed, double preload, Estimate *out);

/* Preload at which the map has this torque. If there is none: the end of the map, or 0, or the preload at which the
   nuts part. */
void preload_of_torque(const Map *map, const double at[VARIABLE_COUNT], double speed, double torque, Estimate *out);

#endif
