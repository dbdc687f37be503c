/* The model behind both FMI versions: its interface to the FMI layer. Knows no FMI. friction/model.c is the ball
   screw as friction, monitor/model.c the monitor of its preload; each FMU has one of them.

   All state lives in Model, which is plain data: copying it saves it. Nothing is allocated, nothing is global but
   constant tables. Variables are addressed by the references of variables.h, made from the table of variables of the
   model. Every Model has map, value, latched, continuous. */
#ifndef BALLSCREW_MODEL_H
#define BALLSCREW_MODEL_H

#include <stdbool.h>

#include "map.h"
#include "variables.h"

typedef struct Model Model;

#include "model_state.h"

/* Start values. continuous: for model exchange. */
void model_reset(Model *model, const Map *map, bool continuous);

/* Whether a value may be stored in an input, a parameter or the state: finite, below TOO_LARGE, not below its bound. */
inline bool model_accepts(int reference, double value)
{
    return value >= model_variables[reference].lowest && value < TOO_LARGE;
}

/* Value as set for inputs and parameters, as computed for everything else (booleans 0 or 1). */
double model_get(Model *model, int reference);

/* Store a value that model_accepts; inputs, parameters and continuous states only. */
inline void model_set(Model *model, int reference, double value)
{
    model->value[reference] = value;
}

/* Outputs belong from now on to the inputs as they are set, at an instant. */
void model_latch(Model *model);

/* Co-simulation: advance by step > 0 with the inputs held; outputs belong to the end of the step. step = 0: nothing
   but a latch. */
void model_step(Model *model, double step);

/* Bit per input, in their order, that the latched point clamps. */
unsigned model_clamped(Model *model);

/* Whether the fields that a saved state holds beside value and latched can be those of a model. */
bool model_possible(const Model *model);

/* Drop the map and everything that is computed again from the rest. */
void model_forget(Model *model);

/* Model exchange, at the latched point: mode at the start; the change of mode at an event, which returns whether a
   continuous state was changed; indicators are left in their places of value. */
void model_initial_event(Model *model);
bool model_event(Model *model);
void model_indicators(Model *model);

/* Directional derivative of outputs and rates at the latched point and step: sensitivity[i] of unknowns[i] along
   seed[k] of knowns[k], which are inputs, parameters or continuous states. What does not change smoothly has 0. Not in
   every model. */
void model_directional_derivative(Model *model, const int unknowns[], size_t unknown_count, const int knowns[],
                                  size_t known_count, const double seed[], double sensitivity[]);

/* Outputs as the derivative computes them, for tests: equal to model_get. */
void model_values_with_derivatives(const Model *model, double values[VARIABLE_COUNT]);

#endif
