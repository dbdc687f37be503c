/* The ball screw behind both FMI versions: nuts, friction parts, standstill law. Knows no FMI.

   All state lives in Model, which is plain data: copying it saves it. Nothing is allocated, nothing is global but
   constant tables. Variables are addressed by the references of variables.h, made from the one table of variables. */
#ifndef BALLSCREW_MODEL_H
#define BALLSCREW_MODEL_H

#include <stdbool.h>

#include "variables.h"

#define MODEL_INDICATORS 2

typedef struct {
    double force[2];           /* [N] of the relieved and the loaded nut; equal without axial load */
    unsigned clamped;          /* bit per input that lies beyond the map, in the order of the inputs */
    double hysteresis[2];      /* [N.m] magnitudes of each nut */
    double sliding[2];
    double coulomb;            /* [N.m] sum over both nuts */
} Loads;

typedef struct {
    double value[VARIABLE_COUNT];    /* inputs, parameters and the bristle as they are set; outputs when computed */
    double latched[VARIABLE_COUNT];  /* inputs and parameters that the outputs belong to */
    double step;                     /* [s] of the step that the outputs belong to; 0: an instant */
    double deflection_before;        /* [rad] of the bristle at the start of that step */
    bool continuous;                 /* model exchange: the bristle is a state of the importer */
    int slip;                        /* model exchange: 0 the bristle follows, +1 or -1 it slips that way */
    bool in_range;                   /* model exchange: as of the last event */
    bool torque_known, all_known, loads_known; /* which outputs are computed */
    Loads loads;
} Model;

/* Start values. continuous: for model exchange. */
void model_reset(Model *model, bool continuous);

/* Whether a value may be stored in an input, a parameter or the state: finite, below 1e30, not below its bound. */
bool model_accepts(int reference, double value);

/* Value as set for inputs and parameters, as computed for everything else (booleans 0 or 1). */
double model_get(Model *model, int reference);

/* Store a value that model_accepts; inputs, parameters and the deflection only. */
void model_set(Model *model, int reference, double value);

/* Outputs belong from now on to the inputs as they are set, at an instant. */
void model_latch(Model *model);

/* Co-simulation: advance by step > 0 with the inputs held; outputs belong to the end of the step. step = 0: nothing
   but a latch. */
void model_step(Model *model, double step);

/* Bit per input (0 preload, 1 speed, 2 temperature, 3 axial_load) that the latched point clamps. */
unsigned model_clamped(Model *model);

/* Model exchange. Modes change in model_event only; it returns whether the deflection was changed. */
void model_initial_event(Model *model);
bool model_event(Model *model);
void model_indicators(Model *model, double indicators[MODEL_INDICATORS]);

/* Directional derivative of outputs and of the rate of the deflection along the seeds of inputs, parameters and of the
   deflection, at the latched point and step: sensitivity[i] of unknowns[i]. Variables that do not change smoothly have 0. */
void model_directional_derivative(Model *model, const int unknowns[], int unknown_count, const int knowns[],
                                  int known_count, const double seed[], double sensitivity[]);

#endif
