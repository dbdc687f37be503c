/* Outputs and rate of the friction FMU with their derivatives along one direction. */
#ifndef BALLSCREW_TANGENT_H
#define BALLSCREW_TANGENT_H

#include "map.h"
#include "variables.h"

/* at: inputs, parameters and the bristle at the start of the step; step, continuous, slip: as in Model */
void outputs_along(const Map *map, const double at[VARIABLE_COUNT], const double direction[VARIABLE_COUNT], double step,
                   bool continuous, int slip, double values[VARIABLE_COUNT], double slopes[VARIABLE_COUNT]);

#endif
