/* The ball screw behind both FMI versions: nuts, friction parts, standstill law. Knows no FMI.

   All state lives in Model, which is plain data: copying it saves it. Nothing is allocated, nothing is global but
   constant tables. Variables are addressed by the references of variables.h, made from the one table of variables. */
#ifndef BALLSCREW_MODEL_H
#define BALLSCREW_MODEL_H

#include <stdbool.h>

#include "map.h"
#include "variables.h"

#define MODEL_INDICATORS 2
#define MODEL_TOO_LARGE 1e30 /* refused like infinity, so that no product overflows */

typedef struct {
    double force[2];                 /* [N] of the nuts, relieved first */
    Place place[2];                  /* of the forces */
    double weight[2][4];             /* of the neighbours over force */
    double force_share[2], third[2]; /* force over the lowest of the axis, at most 1; its cube root */
    double hysteresis;               /* [N.m] magnitude, sum over both nuts */
    double sliding_load;             /* [N.m] sliding part over its coefficient, sum over both nuts */
    int nuts;                        /* 1: both carry the same */
    unsigned clamped;                /* bit per input beyond the map, in the order of the inputs */
    double preload, axial_load;      /* [N] that they belong to */
    bool known;
} Loads;

/* Where the latched point lies over speed and temperature. */
typedef struct {
    Place speed, temperature;
    double plane[16]; /* weights of the neighbours, speed first */
    double share;     /* speed over the lowest of the axis, at most 1 */
    unsigned clamped;
} Conditions;

typedef struct {
    const Map *map;
    double value[VARIABLE_COUNT];   /* inputs, parameters and the bristle as they are set; outputs when computed */
    double latched[VARIABLE_COUNT]; /* inputs and parameters that the outputs belong to */
    double step;                    /* [s] that the outputs belong to; 0: an instant */
    double deflection_before;       /* [rad] of the bristle at the start of that step */
    double bristle_torque;          /* [N.m] of the latched point */
    double bristle_power;           /* [W] */
    bool continuous;                /* model exchange: the bristle is a state of the importer */
    bool in_range;                  /* model exchange: as of the last event */
    bool events_began;              /* model exchange: the initial event has been */
    int slip;                       /* model exchange: 0 the bristle follows, +1 or -1 it slips that way */
    bool conditions_known, torque_known, films_known;
    Loads loads; /* kept while neither preload nor axial load changes */
    Conditions conditions;
} Model;

/* Start values. continuous: for model exchange. */
void model_reset(Model *model, const Map *map, bool continuous);

/* Whether a value may be stored in an input, a parameter or the state: finite, below 1e30, not below its bound. */
inline bool model_accepts(int reference, double value)
{
    return value >= model_variables[reference].lowest && value < MODEL_TOO_LARGE;
}

/* Value as set for inputs and parameters, as computed for everything else (booleans 0 or 1). */
double model_get(Model *model, int reference);

/* Store a value that model_accepts; inputs, parameters and the deflection only. */
inline void model_set(Model *model, int reference, double value)
{
    model->value[reference] = value;
}

/* Outputs belong from now on to the inputs as they are set, at an instant. */
void model_latch(Model *model);

/* Co-simulation: advance by step > 0 with the inputs held; outputs belong to the end of the step. step = 0: nothing
   but a latch. */
void model_step(Model *model, double step);

/* Bit per input (0 preload, 1 speed, 2 temperature, 3 axial_load) that the latched point clamps. */
unsigned model_clamped(Model *model);

/* Model exchange, at the latched point: mode at the start; the change of mode at an event, which returns whether the
   deflection was changed; indicators as IN_RANGE_INDICATOR, SLIP_INDICATOR. */
void model_initial_event(Model *model);
bool model_event(Model *model);
void model_indicators(Model *model, double indicators[MODEL_INDICATORS]);

/* Directional derivative of outputs and of the rate of the deflection at the latched point and step: sensitivity[i] of
   unknowns[i] along seed[k] of knowns[k], which are inputs, parameters or the deflection. What does not change smoothly
   has 0. */
void model_directional_derivative(Model *model, const int unknowns[], size_t unknown_count, const int knowns[],
                                  size_t known_count, const double seed[], double sensitivity[]);

/* Outputs as the derivative computes them, for tests: equal to model_get. */
void model_values_with_derivatives(const Model *model, double values[VARIABLE_COUNT]);

#endif
