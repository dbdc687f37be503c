/* From preload, axial load, speed and temperature to positions and weights in the map of a double nut. Twin of
   runtime/nut_law.py. Numbers: number.h; a file with dual numbers has its own copies. */
#ifndef BALLSCREW_NUT_LOADS_H
#define BALLSCREW_NUT_LOADS_H

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
    Number fraction, third; /* force divided by the lowest of the axis, at most 1; its cube root */
    Number log_width;    /* logarithm of the contact width divided by that at the lowest force, at least 0 */
    Number log_hysteresis, log_sliding, log_free, log_turn, log_boundary, log_gaps, log_limit; /* of the curves */
    Number hysteresis, sliding_load; /* [N.m] as in Loads */
    Number limit;                    /* [N.m] what the contacts transmit of the drag between balls */
    Number turn;         /* the same of the speed at which neighbours slide on each other */
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
    Number fraction;                    /* speed divided by the lowest of the axis, at most 1 */
    bool speed_clamped, temperature_clamped;
} Conditions;

/* Surfaces contracted over speed and temperature, for the cell of a nut: valid for all forces in the cell. */
typedef struct {
    int cell; /* -1: none yet */
    Row sums, slope_sums;
} Columns;

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

/* --- splines ----------------------------------------------------------------------------------------------------- */

/* Position of a value in its cell, clamped to the axis. */
static inline Number axis_position(const Axis *axis, Number value, int *cell)
{
    const double x = value_of(value);
    const Place place = axis_place(axis, x);
    const bool inside = x >= axis->lo && x <= axis->hi;

    *cell = place.cell;
    return function(value, place.t, inside ? axis->scale / (axis->logarithmic ? x : 1.0) : 0.0);
}

static inline void spline_weights(Number t, Number weights[4])
{
    double values[4], slopes[4];

    cubic_weights(value_of(t), values);
    cubic_slopes(value_of(t), slopes);
    for (int a = 0; a < 4; ++a) {
        weights[a] = function(t, values[a], slopes[a]);
    }
}

static inline void spline_slopes(Number t, Number weights[4])
{
    double slopes[4], bends[4];

    cubic_slopes(value_of(t), slopes);
    cubic_bends(value_of(t), bends);
    for (int a = 0; a < 4; ++a) {
        weights[a] = function(t, slopes[a], bends[a]);
    }
}

static inline Number weighted(const Number w[4], const double *values, int stride)
{
    return add(add(add(times(values[0], w[0]), times(values[stride], w[1])), times(values[2 * stride], w[2])),
               times(values[3 * stride], w[3]));
}

enum { SUMS = 16 }; /* at once, in registers */

/* Fails to compile if the sums of nut_law.h, or the weights of a plane in a Row, do not fit. */
typedef char sums_fit[4 * TORQUE_COLUMNS <= SUMS && 2 * FILM_COLUMNS <= SUMS ? 1 : -1];
typedef char plane_fits[4 * FILM_COLUMNS >= 16 && FILM_COLUMNS >= TORQUE_COLUMNS ? 1 : -1];

/* Weighted sum of the sixteen rows of neighbours. columns: a constant at each call, at most SUMS */
static inline void add_rows(const double *block, ptrdiff_t by_speed, ptrdiff_t by_temperature, const double plane[16],
                            double sums[], int columns)
{
    double run[SUMS] = {0.0};

    for (int b = 0; b < 4; ++b) {
        for (int c = 0; c < 4; ++c) {
            const double *row = block + b * by_speed + c * by_temperature;
            const double w = plane[4 * b + c];
            for (int i = 0; i < columns; ++i) {
                run[i] += w * row[i];
            }
        }
    }
    for (int i = 0; i < columns; ++i) {
        sums[i] = run[i];
    }
}

/* Columns of a surface at four neighbours in force, contracted over speed and temperature. at_once: columns per sum */
static inline void contract(const Map *map, const double *surfaces, int columns, const Conditions *now, int force_cell,
                            const Row *plane, int at_once, Row *sums)
{
    const ptrdiff_t by_temperature = axis_coefficients(&map->force) * columns;
    const ptrdiff_t by_speed = axis_coefficients(&map->temperature) * by_temperature;
    const double *block = surfaces + now->speed_cell * by_speed + now->temperature_cell * by_temperature
                          + (ptrdiff_t)force_cell * columns;

    for (int first = 0; first < 4 * columns; first += at_once) {
        add_rows(block + first, by_speed, by_temperature, plane->v, sums->v + first, at_once);
    }
#ifdef DUAL_NUMBERS
    sums->still = plane->still;
    for (int first = 0; first < 4 * columns && !plane->still; first += at_once) {
        add_rows(block + first, by_speed, by_temperature, plane->d, sums->d + first, at_once);
    }
#endif
}

static inline void plane_weights(const Number w_j[4], const Number w_k[4], Row *plane)
{
    for (int i = 0; i < 16; ++i) {
        plane->v[i] = value_of(w_j[i / 4]) * value_of(w_k[i % 4]);
    }
#ifdef DUAL_NUMBERS
    plane->still = true;
    for (int i = 0; i < 4; ++i) {
        plane->still = plane->still && w_j[i].d == 0.0 && w_k[i].d == 0.0;
    }
    for (int i = 0; i < 16 && !plane->still; ++i) {
        plane->d[i] = multiply(w_j[i / 4], w_k[i % 4]).d;
    }
#endif
}

static inline double over_four(const double w[4], const double sums[], int columns)
{
    return w[0] * sums[0] + w[1] * sums[columns] + w[2] * sums[2 * columns] + w[3] * sums[3 * columns];
}

static inline void over_force(const Number w[4], const Row *sums, int columns, Number values[])
{
    const double v[4] = {value_of(w[0]), value_of(w[1]), value_of(w[2]), value_of(w[3])};

#ifdef DUAL_NUMBERS
    const double d[4] = {slope_of(w[0]), slope_of(w[1]), slope_of(w[2]), slope_of(w[3])};
    for (int i = 0; i < columns; ++i) {
        values[i] = number(over_four(v, sums->v + i, columns), over_four(d, sums->v + i, columns));
    }
    for (int i = 0; i < columns && !sums->still; ++i) {
        values[i].d += over_four(v, sums->d + i, columns);
    }
#else
    for (int i = 0; i < columns; ++i) {
        values[i] = over_four(v, sums->v + i, columns);
    }
#endif
}

/* What the relieved flanks of oversize balls have more than HELD of the force of the loaded ones [N]: see evaluate.py. */
static inline Number held_force(Number relieved, Number loaded)
{
    return subtract(relieved, times(HELD, loaded));
}

/* --- from inputs to positions in the map ------------------------------------------------------------------------- */

/* (Actual divided by true preload)^(2/3) at a temperature difference [K], below 0: lost, by as much. */
static inline Number preload_left(const Map *map, Number preload, Number difference)
{
    const double steep = 0.5 * (exp(STRETCH) - exp(-STRETCH)) / MOST_DIFFERENCE, x = steep * value_of(difference);
    const double root_of = sqrt(1.0 + x * x), unit = MOST_DIFFERENCE / STRETCH;
    const ptrdiff_t n_q = axis_coefficients(&map->difference);
    Number w_p[4], w_q[4], shift = constant(0.0), third;
    int p, q;

    if (!(value_of(preload) > 0.0) || (x == 0.0 && slope_of(difference) == 0.0)) {
        return constant(1.0);
    }
    spline_weights(axis_position(&map->preload, clamped(preload, map->preload.lo, map->preload.hi), &p), w_p);
    spline_weights(axis_position(&map->difference,
                                 function(difference, unit * copysign(log(fabs(x) + root_of), x), unit * steep / root_of),
                                 &q), /* asinh */
                   w_q);
    for (int a = 0; a < 4; ++a) {
        shift = add(shift, multiply(w_p[a], weighted(w_q, map->shift + (p + a) * n_q + q, 1)));
    }
    third = power(preload, 1.0 / 3.0);
    return add(constant(1.0), divide(shift, multiply(third, third)));
}

/* True preload [N] at a temperature difference of screw and nut [K]; 0: lost. */
static inline Number actual_preload(const Map *map, Number preload, Number difference)
{
    const Number force = times(map->preload_factor, preload), left = preload_left(map, force, difference);

    return value_of(left) > 0.0 ? multiply(force, multiply(left, root(left))) : constant(0.0);
}

/* Distance from a temperature difference that is beyond the map or takes the preload away, 0 to 1; negative there. */
static inline Number difference_margin(const Map *map, Number preload, Number difference)
{
    return lesser(preload_left(map, times(map->preload_factor, preload), difference),
                  subtract(constant(1.0), over(absolute(difference), MOST_DIFFERENCE)));
}

/* Force of the relieved and the loaded nut [N] at a preload of 0 or more and an axial load that is not 0. */
static inline void nut_forces(const Map *map, Number preload, Number axial_load, Number force[2])
{
    const Number load = absolute(axial_load);
    const int side = value_of(axial_load) >= 0.0 ? 0 : 1;
    const ptrdiff_t n_p = axis_coefficients(&map->preload), n_q = axis_coefficients(&map->fraction);
    Number fraction, y, w_p[4], w_q[4], rows[4];
    int p, q;

    force[0] = constant(0.0);
    force[1] = load;
    if (!(value_of(preload) > 0.0)) {
        return;
    }
    spline_weights(axis_position(&map->preload, clamped(preload, map->preload.lo, map->preload.hi), &p), w_p);
    fraction = divide(load,
                      multiply(preload, exponential(weighted(w_p, map->separation + side * n_p + p, 1))));
    if (value_of(fraction) >= 1.0) {
        return; /* the nuts are separated: the relieved one is unloaded */
    }
    spline_weights(axis_position(&map->fraction, fraction, &q), w_q);
    for (int a = 0; a < 4; ++a) {
        rows[a] = multiply(w_p[a], weighted(w_q, map->sharing + (side * n_p + p + a) * n_q + q, 1));
    }
    y = greater(add(add(add(rows[0], rows[1]), rows[2]), rows[3]), constant(0.0));
    force[0] = multiply(preload, multiply(y, root(y)));
    force[1] = add(force[0], load);
}

/* Positions of the nuts in the map. force: of the relieved one first, within the axis or below it */
static inline void place_nuts(const Map *map, const Number force[], int nuts, Loads *loads)
{
    loads->nuts = nuts;
    loads->summed = false;
    for (int n = 0; n < nuts; ++n) {
        LoadedNut *nut = &loads->nut[n];
        const bool below = value_of(force[n]) < map->force.lo;
        const Number place = axis_position(&map->force, force[n], &nut->cell);
        const double *curves;
        spline_weights(place, nut->weight);
        nut->log_width = over(add(place, constant(nut->cell)), 3.0 * map->force.scale); /* it grows as force^(1/3) */
        nut->force = force[n];
        nut->fraction = below ? over(force[n], map->force.lo) : constant(1.0);
        nut->third = below ? power(nut->fraction, 1.0 / 3.0) : constant(1.0);
        curves = map->curves + (ptrdiff_t)nut->cell * CURVE_COLUMNS;
        nut->log_hysteresis = weighted(nut->weight, curves + HYSTERESIS_TORQUE_CURVE, CURVE_COLUMNS);
        nut->log_sliding = weighted(nut->weight, curves + SLIDING_TORQUE_CURVE, CURVE_COLUMNS);
        nut->log_free = weighted(nut->weight, curves + FREE_SHEAR_SHARE_CURVE, CURVE_COLUMNS);
        nut->log_turn = weighted(nut->weight, curves + FREE_SLIDING_SHARE_CURVE, CURVE_COLUMNS);
        nut->log_boundary = weighted(nut->weight, curves + BOUNDARY_SHEAR_CURVE, CURVE_COLUMNS);
        nut->log_gaps = weighted(nut->weight, curves + NEIGHBOUR_DRAG_CURVE, CURVE_COLUMNS);
        nut->log_limit = weighted(nut->weight, curves + NEIGHBOUR_LIMIT_CURVE, CURVE_COLUMNS);
    }
}

/* Loads of two nuts with given forces [N], the lower one first. */
static inline void nut_loads_of_forces(const Map *map, Number relieved, Number loaded, Loads *loads)
{
    const double highest = map->force.hi;
    const Number force[2] = {value_of(relieved) > highest ? constant(highest) : relieved,
                             value_of(loaded) > highest ? constant(highest) : loaded};

    loads->preload_clamped = loads->axial_load_clamped = false;
    loads->highest = value_of(force[1]);
    place_nuts(map, force, 2, loads);
}

static inline void nut_loads(const Map *map, Number preload, Number axial_load, Loads *loads)
{
    /* without preload one nut holds the axial load */
    const double holding = value_of(preload) == 0.0 ? fabs(value_of(axial_load)) : value_of(preload);
    int nuts = 1;
    Number force[2];

    loads->preload_clamped = holding < map->preload.lo || holding > map->force.hi;
    loads->axial_load_clamped = false;
    loads->highest = 0.0;
    /* derivatives: one-sided at the end of the map, 0 at preload 0, where that of the viscous part is infinite */
    force[0] = force[1] =
        value_of(preload) > map->force.hi ? constant(map->force.hi) : greater(preload, constant(0.0));
    if (value_of(axial_load) != 0.0 || slope_of(axial_load) != 0.0) {
        nuts = 2;
        nut_forces(map, force[0], axial_load, force);
        loads->axial_load_clamped = value_of(force[1]) > map->force.hi;
        force[1] = loads->axial_load_clamped ? constant(map->force.hi) : force[1];
        if (map->oversize && value_of(axial_load) != 0.0 && value_of(held_force(force[0], force[1])) < 0.0) {
            loads->axial_load_clamped = true;
        }
        loads->highest = value_of(force[1]);
    }
    place_nuts(map, force, nuts, loads);
}

/* Sums over both nuts. Apart from nut_loads, so that the processor computes these exponential functions while it waits
   for the surfaces: a step is an eighth faster. No effect if already done. */
static inline void nut_sums(const Map *map, Loads *loads)
{
    if (loads->summed) {
        return;
    }
    loads->hysteresis = loads->sliding_load = loads->stiffness_hysteresis = loads->stiffness_sliding = constant(0.0);
    for (int n = 0; n < loads->nuts; ++n) {
        LoadedNut *nut = &loads->nut[n];
        nut->hysteresis = multiply(multiply(exponential(nut->log_hysteresis), nut->fraction), nut->third);
        loads->hysteresis = add(loads->hysteresis, nut->hysteresis);
        nut->sliding_load = multiply(exponential(nut->log_sliding), nut->fraction);
        loads->sliding_load = add(loads->sliding_load, nut->sliding_load);
        if (value_of(nut->force) > 0.0) {
            const Number narrow = divide(exponential(negative(nut->log_width)), times(map->presliding_angle, nut->third));
            loads->stiffness_hysteresis = add(loads->stiffness_hysteresis, multiply(nut->hysteresis, narrow));
            loads->stiffness_sliding = add(loads->stiffness_sliding, multiply(nut->sliding_load, narrow));
        }
        nut->free = exponential(nut->log_free);
        nut->turn = exponential(nut->log_turn);
        nut->limit = multiply(exponential(nut->log_limit), nut->fraction);
    }
    if (loads->nuts == 1) {
        loads->hysteresis = times(2.0, loads->hysteresis);
        loads->sliding_load = times(2.0, loads->sliding_load);
        loads->stiffness_hysteresis = times(2.0, loads->stiffness_hysteresis);
        loads->stiffness_sliding = times(2.0, loads->stiffness_sliding);
    }
    loads->summed = true;
}

static inline void nut_conditions(const Map *map, Number speed, Number temperature, Conditions *now)
{
    Number w_j[4], w_k[4];

    speed = absolute(speed);
    now->speed_clamped = value_of(speed) > map->speed.hi;
    now->temperature_clamped =
        !(value_of(temperature) >= map->temperature.lo && value_of(temperature) <= map->temperature.hi);
    now->fraction = value_of(speed) < map->speed.lo ? over(speed, map->speed.lo) : constant(1.0);
    now->at_speed = axis_position(&map->speed, speed, &now->speed_cell);
    now->at_temperature = axis_position(&map->temperature, temperature, &now->temperature_cell);
    spline_weights(now->at_speed, w_j);
    spline_weights(now->at_temperature, w_k);
    plane_weights(w_j, w_k, &now->plane);
}

#endif
