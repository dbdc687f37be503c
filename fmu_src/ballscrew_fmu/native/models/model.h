/* Interface of a model, independent of FMI. friction/model.c is the friction of the ball screw, monitor/model.c the
   monitor of its preload. Each FMU has one of them.

   All state is in Model, which is plain data and is saved by copying it. A model allocates no memory and has no global
   data except constant tables. The fields of Model from films_known on follow from the others. The latched values
   are those that the outputs belong to. A reference is the index of a variable in the table of variables.h, not
   its value reference in FMI. Every Model has map, value, latched, continuous, films_known. */
#ifndef BALLSCREW_MODEL_H
#define BALLSCREW_MODEL_H

#include <stdbool.h>
#include <string.h>

#include "state.h"

/* Set the start values. continuous: model exchange. */
INTERNAL void model_reset(Model *model, const Map *map, const double start[START_COUNT], bool continuous);

/* Whether an input, a parameter or the state may have this value: finite, >= lower bound, < TOO_LARGE. */
static inline bool model_accepts(int reference, double value)
{
    return value >= model_variables[reference].lowest && value < TOO_LARGE;
}

/* Whether its value is set and not computed. */
static inline bool model_is_set(const Variable *variable)
{
    return variable->causality == CAUSALITY_INPUT || variable->causality == CAUSALITY_PARAMETER
           || variable->causality == CAUSALITY_STATE;
}

/* Value of a variable: as set for inputs and parameters, computed for all others (booleans 0 or 1). */
INTERNAL double model_get(Model *model, int reference);

/* Store a value that model_accepts. Inputs, parameters and continuous states only. */
INTERNAL void model_set(Model *model, int reference, double value);

/* From now on the outputs are those of the current values, at an instant. */
INTERNAL void model_latch(Model *model);

/* Co-simulation: advance by step > 0 with constant inputs. Outputs are those at the end of the step. step = 0: latch
   only. */
INTERNAL void model_step(Model *model, double step);

/* What is beyond the map and clamped at the latched point, an input or an output that the friction depends on: one bit
   per variable of the table, from the first input. Less than 29 bits. */
INTERNAL unsigned model_clamped(Model *model);

/* Co-simulation: a warning about the step just made, in text. False: none. */
INTERNAL bool model_warns_of_step(Model *model, char *text, size_t size);

/* Events of model exchange, at the latched point: initial mode; change of mode at an event, true if a continuous state has
   changed; event indicators, which are stored in value. */
INTERNAL void model_initial_event(Model *model);
INTERNAL bool model_event(Model *model);
INTERNAL void model_indicators(Model *model);

/* Derivatives of outputs and rates at the latched point and step, along a direction of inputs, parameters and continuous
   states. 0 where an output does not change smoothly. */
INTERNAL void model_derivatives(Model *model, const double direction[VARIABLE_COUNT], double slopes[VARIABLE_COUNT]);

/* Of model_reset: all is 0 except what every Model has. */
static inline void model_start(Model *model, const Map *map, const double start[START_COUNT], bool continuous)
{
    memset(model, 0, sizeof *model);
    model->map = map;
    model->continuous = continuous;
    memcpy(model->value, start, sizeof model->value);
}

#endif
