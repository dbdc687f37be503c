#ifndef BALLSCREW_AXIS_STEP_H
#define BALLSCREW_AXIS_STEP_H

#include "state.h"

/* Integration over a step > 0 of co-simulation with constant inputs. at: inputs and parameters */
INTERNAL void axis_advance(const Map *map, const double at[VARIABLE_COUNT], double step, Advance *state);

#endif
