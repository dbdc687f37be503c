/* Torque as a function of preload at one speed, temperature and axial load, and its inverse. */
#ifndef BALLSCREW_SEARCH_H
#define BALLSCREW_SEARCH_H

#include <stdbool.h>

#include "map.h"
#include "variables.h"

#define torque_of_preload BALLSCREW_NAMED(BALLSCREW_PREFIX, torque_of_preload)
#define preload_of_torque BALLSCREW_NAMED(BALLSCREW_PREFIX, preload_of_torque)
#define torque_along BALLSCREW_NAMED(BALLSCREW_PREFIX, torque_along)
#define seal_along BALLSCREW_NAMED(BALLSCREW_PREFIX, seal_along)
#define lambda_ratio_along BALLSCREW_NAMED(BALLSCREW_PREFIX, lambda_ratio_along)

typedef struct {
    double preload, torque; /* [N], [N.m] */
    double slope;           /* [N.m/N] derivative of torque with respect to preload */
    bool converged;         /* the torque is the target */
    bool speed_clamped, temperature_clamped, axial_load_clamped;
} Estimate;

/* Torque of the balls at a preload up to the end of the map. at: inputs and parameters; speed: replaces that of at. */
void torque_of_preload(const Map *map, const double at[VARIABLE_COUNT], double speed, double preload, Estimate *out);

/* Preload at which the map gives this torque, of the balls. If there is none: the end of the map, 0, or the preload at which the nuts
   separate. */
void preload_of_torque(const Map *map, const double at[VARIABLE_COUNT], double speed, double torque, Estimate *out);

/* Derivatives along a direction of inputs and parameters, with a preload and a speed that change along it too. */
typedef struct {
    double value, slope;
} Dual;

/* Torque of the seals, in the direction of the motion. */
Dual seal_along(const double at[VARIABLE_COUNT], const double direction[VARIABLE_COUNT], Dual speed);
Dual torque_along(const Map *map, const double at[VARIABLE_COUNT], const double direction[VARIABLE_COUNT],
                  Dual speed,
                   Dual preload);
Dual lambda_ratio_along(const Map *map, const double at[VARIABLE_COUNT],
                        const double direction[VARIABLE_COUNT],
                         Dual preload);

#endif
