/* Torque and films of the double nut from the map, independent of variables and FMI. Numbers: number.h. all.c has
   the functions in doubles, a file with dual numbers its own copies. */
#ifndef BALLSCREW_NUT_H
#define BALLSCREW_NUT_H

#include <stdbool.h>

#include "map.h"
#include "number.h"

/* Weights of the sixteen neighbours in speed and temperature (speed first), or the weighted sums of the columns at four
   neighbours in force. Values and derivatives are separate arrays, so that the same loops serve both. */
typedef struct {
    double v[4 * FILM_COLUMNS];
#ifdef DUAL_NUMBERS
    double d[4 * FILM_COLUMNS];
    bool still; /* all derivatives are 0: d is not set */
#endif
} Row;

/* One nut at its force. */
typedef struct {
    int cell;            /* of the force */
    Number weight[4];    /* of the neighbours in force */
    Number force;        /* [N] */
    Number share, third; /* force divided by the lowest of the axis, at most 1; its cube root */
    Number log_width;    /* logarithm of the contact width divided by that at the lowest force, at least 0 */
    Number log_hysteresis, log_sliding, log_free; /* logarithms of the curves at this force */
    Number hysteresis, sliding_load; /* [N.m] as in Loads */
    Number free;         /* shear of balls on two flanks divided by that on four alike; 1: no oversize balls */
} LoadedNut;

/* Results of preload and axial load alone. */
typedef struct {
    LoadedNut nut[2];    /* relieved first */
    int nuts;            /* 1: both have the same force */
    double highest;      /* [N] force of the loaded nut under an axial load, clamped; else 0 */
    bool summed;         /* the following are set; nut_loads leaves this to nut_parts */
    Number hysteresis;   /* [N.m] magnitude, sum over both nuts */
    Number sliding_load; /* [N.m] of balls on each other at coefficient and thrust factor 1, sum over both nuts */
    Number stiffness_hysteresis, stiffness_sliding; /* [N.m/rad] of presliding by both parts, as above */
    bool preload_clamped, axial_load_clamped;
} Loads;

/* Position of a speed and a temperature in the map. */
typedef struct {
    int speed_cell, temperature_cell;
    Number at_speed, at_temperature; /* positions in the cells */
    Row plane;                       /* weights of the neighbours */
    Number share;                    /* speed divided by the lowest of the axis, at most 1 */
    bool speed_clamped, temperature_clamped;
} Conditions;

/* Surfaces contracted over speed and temperature, for the cell of a nut: valid for all forces in the cell. */
typedef struct {
    int cell; /* -1: none yet */
    Row sums, slope_sums;
} Columns;

/* Parameters of the friction laws. */
typedef struct {
    Number viscosity_ratio, net_sliding, roughness, breakaway; /* 1, 1, [m], 1 */
} Friction;

/* Magnitudes of the friction parts at motion, sums over both nuts [N.m]. */
typedef struct {
    Number viscous, hysteresis, sliding;
    Number relieved_viscous, relieved_coulomb; /* of the relieved nut; a half if both have the same force */
} Parts;

/* Extremes over both nuts. */
typedef struct {
    Number minimum, central_screw, central_nut; /* [m] least film */
    Number rise, pressure, ball_load;           /* highest: [K], [Pa], [N] */
} Films;

#ifdef DUAL_NUMBERS
#define NUT_FUNCTION static inline
#else
#define NUT_FUNCTION INTERNAL
#endif

NUT_FUNCTION void nut_loads(const Map *map, Number preload, Number axial_load, Loads *loads);

/* Loads of two nuts with given forces [N], the lower one first. */
NUT_FUNCTION void nut_loads_of_forces(const Map *map, Number relieved, Number loaded, Loads *loads);

/* Sums of both nuts in loads. nut_parts and nut_stiffness do it. */
NUT_FUNCTION void nut_sums(const Map *map, Loads *loads);

NUT_FUNCTION void nut_conditions(const Map *map, Number speed, Number temperature, Conditions *now);

/* Force of the relieved and the loaded nut [N] at a preload of 0 or more and an axial load that is not 0. */
NUT_FUNCTION void nut_forces(const Map *map, Number preload, Number axial_load, Number force[2]);

/* Friction by the law of the map. loads: as from nut_loads, with sums added here; columns: cache of each nut for these
   conditions, or NULL */
NUT_FUNCTION void nut_parts(const Map *map, Loads *loads, const Conditions *now, Columns columns[2],
                            const Friction *friction, Parts *out);

static inline Number coulomb_magnitude(const Parts *parts) { return add(parts->hysteresis, parts->sliding); }

/* Presliding stiffness: Coulomb torque at standstill over presliding_angle [N.m/rad], sum over both nuts. */
static inline Number nut_stiffness(const Map *map, Loads *loads, const Friction *friction)
{
    nut_sums(map, loads);
    return add(loads->stiffness_hysteresis,
               multiply(multiply(friction->net_sliding, greater(friction->breakaway, constant(1.0))),
                        loads->stiffness_sliding));
}

/* Distance from the ends of an axis divided by its length, negative outside. */
static inline Number margin_within(Number value, double lo, double hi)
{
    return over(lesser(subtract(value, constant(lo)), subtract(constant(hi), value)), hi - lo);
}

/* Least distance from the limits of preload, speed and temperature, each as a share of the length of its axis. */
static inline Number nut_margin(const Map *map, Number preload, Number speed, Number temperature)
{
    const Number loads = margin_within(preload, map->preload.lo, map->force.hi);
    const Number heat = margin_within(temperature, map->temperature.lo, map->temperature.hi);

    return lesser(lesser(loads, heat), over(subtract(constant(map->speed.hi), absolute(speed)), map->speed.hi));
}

NUT_FUNCTION void nut_films(const Map *map, const Loads *loads, const Conditions *now, Films *out);

static inline Number lambda_ratio(Number minimum_film, Number roughness)
{
    return lesser(divide(minimum_film, greater(roughness, constant(SMOOTH))), constant(LAMBDA_RATIO_MAX));
}

/* Share of the power that arrives in steady motion. friction: magnitude at motion */
static inline Number efficiency_of(Number ideal_torque, Number friction, Number speed)
{
    const Number ideal = absolute(ideal_torque);

    if (!(value_of(ideal) > 0.0)) {
        return constant(0.0);
    }
    if (value_of(ideal_torque) * value_of(speed) >= 0.0) {
        return divide(ideal, add(ideal, friction));
    }
    return divide(greater(subtract(ideal, friction), constant(0.0)), ideal);
}

#endif
