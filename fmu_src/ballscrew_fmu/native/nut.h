/* Torque and films of the double nut from the map. Knows neither variables nor FMI. Twin of NutMap.evaluate_point, and of
   nut_map/preload.py where torque is followed over the preload. */
#ifndef BALLSCREW_NUT_H
#define BALLSCREW_NUT_H

#include <stdbool.h>

#include "map.h"

#define LAMBDA_RATIO_MAX 1000.0 /* reported for a smooth surface */
#define SMOOTH 1e-30            /* [m] roughness that counts as none */

static inline double least(double a, double b)
{
    return a < b ? a : b;
}

static inline double most(double a, double b)
{
    return a > b ? a : b;
}

/* What follows from preload and axial load alone. */
typedef struct {
    double force[2];                 /* [N] of the nuts, relieved first */
    Place place[2];                  /* of the forces */
    double weight[2][4];             /* of the neighbours over force */
    double force_share[2], third[2]; /* force over the lowest of the axis, at most 1; its cube root */
    double hysteresis;               /* [N.m] magnitude, sum over both nuts */
    double sliding_load;             /* [N.m] sliding part over its coefficient, sum over both nuts */
    int nuts;                        /* 1: both carry the same */
    bool preload_clamped, axial_load_clamped;
    double preload, axial_load; /* [N] that they belong to */
    bool known;
} Loads;

/* Where a speed and a temperature lie in the map. */
typedef struct {
    Place speed, temperature;
    double plane[16]; /* weights of the neighbours, speed first */
    double share;     /* speed over the lowest of the axis, at most 1 */
    bool speed_clamped, temperature_clamped;
} Conditions;

/* Extremes over both nuts. */
typedef struct {
    double film[3];    /* [m] least: of all contacts, central on the screw, central on the nut */
    double extreme[3]; /* highest: temperature rise [K], Hertz pressure [Pa], ball load [N] */
} Films;

/* Torque of the double nut [N.m] as a function of the preload, and its derivative [N.m/N]. */
typedef struct {
    double viscous, hysteresis, sliding_load;
    double viscous_slope, hysteresis_slope, sliding_slope;
} TorqueOverPreload;

/* What is contracted over speed and temperature is kept for the cell of each nut: it serves all preloads of a cell. */
typedef struct {
    int cell[2]; /* -1: none yet */
    double sums[2][4 * TORQUE_COLUMNS], slope_sums[2][4 * TORQUE_COLUMNS];
} Columns;

/* Kept as they are while neither preload nor axial load changes. */
void nut_loads(const Map *map, double preload, double axial_load, Loads *loads);

void nut_conditions(const Map *map, double speed, double temperature, Conditions *conditions);

/* Viscous torque of both nuts [N.m]. ratio: of the apparent viscosity; roughness [m]. */
double nut_viscous_torque(const Map *map, const Loads *loads, const Conditions *conditions, double ratio,
                          double roughness);

void nut_films(const Map *map, const Loads *loads, const Conditions *conditions, Films *films);

/* Torque over preload at a preload that nut_loads clamps; loads is left at it. The parts are those of the functions
   above but for rounding. columns: of these conditions, filled on the way. */
void nut_torque_over_preload(const Map *map, double preload, double axial_load, const Conditions *conditions, double ratio,
                             double roughness, Loads *loads, Columns *columns, TorqueOverPreload *torque);

#endif
