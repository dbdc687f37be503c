/* Derivatives of outputs and rates of a screw along one direction, by dual numbers. */
#ifndef BALLSCREW_DUAL_LAWS_H
#define BALLSCREW_DUAL_LAWS_H

#include "map.h"
#include "variables.h"

struct StepContext; /* of the model's law */

/* at: inputs, parameters and states; of a step the elements at its start */
#define slopes_along BALLSCREW_NAMED(BALLSCREW_PREFIX, slopes_along)
void slopes_along(const Map *map, const double at[START_COUNT], const double direction[VARIABLE_COUNT],
                  const struct StepContext *context, double slopes[VARIABLE_COUNT]);

#endif
