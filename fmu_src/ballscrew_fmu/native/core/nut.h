/* Torque and films of the double nut from the map. Knows neither variables nor FMI. Numbers: number.h. A file with dual
   numbers includes nut_law.h too and has functions of its own; those for doubles are in nut.c. */
#ifndef BALLSCREW_NUT_H
#define BALLSCREW_NUT_H

#include <stdbool.h>

#include "map.h"
#include "number.h"

/* Weights of the neighbours over speed and temperature (sixteen, speed first), or what they add up to in the columns at
   four neighbours over force. Derivatives apart from the values, so that both run through the same loops. */
typedef struct {
    double v[4 * FILM_COLUMNS];
#ifdef DUAL_NUMBERS
    double d[4 * FILM_COLUMNS];
    bool still; /* no derivative: d is not filled */
#endif
} Row;

/* One nut at its force. */
typedef struct {
    int cell;            /* of the force */
    Number weight[4];    /* of the neighbours over force */
    Number share, third; /* force over the lowest of the axis, at most 1; its cube root */
} LoadedNut;

/* What follows from preload and axial load alone. */
typedef struct {
    LoadedNut nut[2];    /* relieved first */
    int nuts;            /* 1: both carry the same */
    double highest;      /* [N] force of the loaded nut under an axial load, clamped; else 0 */
    Number hysteresis;   /* [N.m] magnitude, sum over both nuts */
    Number sliding_load; /* [N.m] sliding part over its coefficient, sum over both nuts */
    bool preload_clamped, axial_load_clamped;
} Loads;

/* Where a speed and a temperature lie in the map. */
typedef struct {
    int speed_cell, temperature_cell;
    Number at_speed, at_temperature; /* in the cell */
    Row plane;                       /* weights of the neighbours */
    Number share;                    /* speed over the lowest of the axis, at most 1 */
    bool speed_clamped, temperature_clamped;
} Conditions;

/* Surfaces contracted over speed and temperature: kept for the cell of a nut, they serve all preloads of the cell. */
typedef struct {
    int cell; /* -1: none yet */
    Row sums, slope_sums;
} Columns;

/* Extremes over both nuts. */
typedef struct {
    Number minimum, central_screw, central_nut; /* [m] least film */
    Number rise, pressure, ball_load;           /* highest: [K], [Pa], [N] */
} Films;

#ifdef DUAL_NUMBERS
#define NUT_FUNCTION static inline
#else
#define NUT_FUNCTION
#endif

NUT_FUNCTION void nut_loads(const Map *map, Number preload, Number axial_load, Loads *loads);

NUT_FUNCTION void nut_conditions(const Map *map, Number speed, Number temperature, Conditions *now);

/* Force of the relieved and the loaded nut [N] at a preload of 0 or more and an axial load that is not 0. */
NUT_FUNCTION void nut_forces(const Map *map, Number preload, Number axial_load, Number force[2]);

/* Viscous torque of both nuts [N.m]. ratio: of the apparent viscosity; roughness [m]; columns: of each nut, or NULL */
NUT_FUNCTION Number nut_viscous_torque(const Map *map, const Loads *loads, const Conditions *now, Columns columns[2],
                                       Number ratio, Number roughness);

NUT_FUNCTION void nut_films(const Map *map, const Loads *loads, const Conditions *now, Films *out);

static inline Number lambda_ratio(Number minimum_film, Number roughness)
{
    return lesser(divide(minimum_film, greater(roughness, constant(SMOOTH))), constant(LAMBDA_RATIO_MAX));
}

#endif
