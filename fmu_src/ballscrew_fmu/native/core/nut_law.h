/* The laws of a nut: torque and films of the double nut from the map, independent of variables and FMI. Twin of
   runtime/nut_law.py. Numbers: number.h; a file with dual numbers has its own copies. */
#ifndef BALLSCREW_NUT_LAW_H
#define BALLSCREW_NUT_LAW_H

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
    Number seal;                                               /* [N.m] drag of the seals */
} Friction;

/* Magnitudes of the friction parts at motion, sums over both nuts [N.m]. */
typedef struct {
    Number viscous, hysteresis, sliding;
    Number seal;                               /* not in those below */
    Number relieved_viscous, relieved_coulomb; /* of the relieved nut; a half if both have the same force */
} Parts;

/* Extremes over both nuts. */
typedef struct {
    Number minimum, central_screw, central_nut; /* [m] least film */
    Number rise, pressure, ball_load;           /* highest: [K], [Pa], [N] */
} Films;

static inline Number coulomb_magnitude(const Parts *parts)
{
    return add(add(parts->hysteresis, parts->sliding), parts->seal);
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

/* Weighted sum of the sixteen rows of neighbours. columns: a constant at each call, few enough for registers */
static inline void add_rows(const double *block, ptrdiff_t by_speed, ptrdiff_t by_temperature, const double plane[16],
                            double sums[], int columns)
{
    double run[16] = {0.0};

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

/* --- from inputs to positions in the map ------------------------------------------------------------------------- */

/* Force of the relieved and the loaded nut [N] at a preload of 0 or more and an axial load that is not 0. */
static inline void nut_forces(const Map *map, Number preload, Number axial_load, Number force[2])
{
    const Number load = absolute(axial_load);
    const int side = value_of(axial_load) >= 0.0 ? 0 : 1;
    const ptrdiff_t n_p = axis_coefficients(&map->preload), n_q = axis_coefficients(&map->share);
    Number share, y, w_p[4], w_q[4], rows[4];
    int p, q;

    force[0] = constant(0.0);
    force[1] = load;
    if (!(value_of(preload) > 0.0)) {
        return;
    }
    spline_weights(axis_position(&map->preload, clamped(preload, map->preload.lo, map->preload.hi), &p), w_p);
    share = divide(load, multiply(preload, exponential(weighted(w_p, map->separation + side * n_p + p, 1))));
    if (value_of(share) >= 1.0) {
        return; /* the nuts are separated: the relieved one is unloaded */
    }
    spline_weights(axis_position(&map->share, share, &q), w_q);
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
        nut->share = below ? over(force[n], map->force.lo) : constant(1.0);
        nut->third = below ? power(nut->share, 1.0 / 3.0) : constant(1.0);
        curves = map->curves + (ptrdiff_t)nut->cell * CURVE_COLUMNS;
        nut->log_hysteresis = weighted(nut->weight, curves + HYSTERESIS_TORQUE_CURVE, CURVE_COLUMNS);
        nut->log_sliding = weighted(nut->weight, curves + SLIDING_TORQUE_CURVE, CURVE_COLUMNS);
        nut->log_free = weighted(nut->weight, curves + FREE_SHEAR_SHARE_CURVE, CURVE_COLUMNS);
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
    int nuts = 1;
    Number force[2];

    loads->preload_clamped = value_of(preload) < map->preload.lo || value_of(preload) > map->force.hi;
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
        nut->hysteresis = multiply(multiply(exponential(nut->log_hysteresis), nut->share), nut->third);
        loads->hysteresis = add(loads->hysteresis, nut->hysteresis);
        nut->sliding_load = multiply(exponential(nut->log_sliding), nut->share);
        loads->sliding_load = add(loads->sliding_load, nut->sliding_load);
        if (value_of(nut->force) > 0.0) {
            const Number narrow = divide(exponential(negative(nut->log_width)), times(map->presliding_angle, nut->third));
            loads->stiffness_hysteresis = add(loads->stiffness_hysteresis, multiply(nut->hysteresis, narrow));
            loads->stiffness_sliding = add(loads->stiffness_sliding, multiply(nut->sliding_load, narrow));
        }
        nut->free = exponential(nut->log_free);
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
    now->share = value_of(speed) < map->speed.lo ? over(speed, map->speed.lo) : constant(1.0);
    now->at_speed = axis_position(&map->speed, speed, &now->speed_cell);
    now->at_temperature = axis_position(&map->temperature, temperature, &now->temperature_cell);
    spline_weights(now->at_speed, w_j);
    spline_weights(now->at_temperature, w_k);
    plane_weights(w_j, w_k, &now->plane);
}

/* --- torque and films at a point --------------------------------------------------------------------------------- */

/* Torque below the lowest speed of the map, divided by that at the lowest speed. slope: of its logarithm there, with
   respect to the position in the cell. */
static inline Number slow_share(const Map *map, Number s, Number slope)
{
    const Number one = constant(1.0), exponent = times(map->speed.scale, slope);
    const Number c = times(0.5, subtract(clamped(exponent, 0.0, SPEED_EXPONENT_MAX), one));

    return multiply(s, add(subtract(one, c), multiply(multiply(c, s), s)));
}

/* Coulomb part below the lowest speed of the map, divided by that at the lowest speed. factor: Coulomb part there
   divided by that in a full film; slope: of its logarithm, as above. */
static inline Number coulomb_rise(const Map *map, Number s, Number factor, Number slope, Number breakaway)
{
    const Number one = constant(1.0);
    const Number rise = greater(subtract(divide(greater(breakaway, one), factor), one), constant(0.0));
    const Number steepness =
        divide(times(-map->speed.scale, slope), greater(rise, constant(LEAST_RISE)));
    const Number q = clamped(steepness, 0.0, BREAKAWAY_EXPONENT_MAX);
    /* speed, with slope 0 at rest; half: where half of the rise is left */
    const Number t = divide(times(1.0 + REST, multiply(s, s)), add(s, constant(REST)));
    const Number half =
        greater(divide(q, subtract(constant((1.0 + 2.0 * REST) / (1.0 + REST)), q)), constant(LEAST_HALF));

    return add(one, multiply(rise, subtract(one, divide(multiply(add(one, half), t), add(t, half)))));
}

/* Surfaces needed for a torque, and below the speed axis their derivatives. slope_plane: weights of the derivatives with
   respect to speed. columns: cache for these conditions, updated here; NULL: no cache. */
static inline void surfaces_of_nut(const Map *map, const LoadedNut *nut, const Conditions *now, const Row *slope_plane,
                                   Columns *columns, Number values[TORQUE_COLUMNS], Number slopes[TORQUE_COLUMNS])
{
    const bool slow = value_of(now->share) < 1.0;
    Row here[2], *sums = columns != NULL ? &columns->sums : &here[0];
    Row *slope_sums = columns != NULL ? &columns->slope_sums : &here[1];

    if (columns == NULL || columns->cell != nut->cell) {
        contract(map, map->torque, TORQUE_COLUMNS, now, nut->cell, &now->plane, 4 * TORQUE_COLUMNS, sums);
        if (slow) {
            contract(map, map->torque, TORQUE_COLUMNS, now, nut->cell, slope_plane, 4 * TORQUE_COLUMNS, slope_sums);
        }
    }
    if (columns != NULL) {
        columns->cell = nut->cell;
    }
    over_force(nut->weight, sums, TORQUE_COLUMNS, values);
    if (slow) {
        over_force(nut->weight, slope_sums, TORQUE_COLUMNS, slopes);
    }
}

/* Viscous torque of a nut at apparent viscosity ratio 1, film_shear law. The exponent of speed at the end of the axis
   follows from the slopes of torque and film. */
static inline Number viscous_torque_of_nut(const Map *map, const LoadedNut *nut, const Conditions *now,
                                           const Number values[], const Number slopes[], Number roughness)
{
    const Number one = constant(1.0);
    Number viscous = constant(0.0);

    for (int raceway = 0; raceway < 2; ++raceway) {
        const int t = VISCOUS_TORQUE_SCREW + raceway, h = EFFECTIVE_FILM_SCREW + raceway;
        const Number ratio = multiply(roughness, exponential(negative(values[h]))), x = multiply(ratio, ratio);
        Number torque = divide(exponential(values[t]), add(one, x));
        if (value_of(now->share) < 1.0) {
            const Number rough = divide(times(2.0, x), add(one, x));
            torque = multiply(torque, slow_share(map, now->share, add(slopes[t], multiply(rough, slopes[h]))));
        }
        viscous = add(viscous, torque);
    }
    return multiply(viscous, multiply(nut->third, nut->third));
}

/* Rolling torque of a nut at viscosity ratio 1, mechanistic law. */
static inline Number rolling_torque_of_nut(const Map *map, const LoadedNut *nut, const Conditions *now,
                                           const Number values[], const Number slopes[])
{
    Number screw = exponential(values[ROLLING_TORQUE_SCREW]), other = exponential(values[ROLLING_TORQUE_NUT]);

    if (value_of(now->share) < 1.0) {
        screw = multiply(screw, slow_share(map, now->share, slopes[ROLLING_TORQUE_SCREW]));
        other = multiply(other, slow_share(map, now->share, slopes[ROLLING_TORQUE_NUT]));
    }
    return multiply(add(screw, other), multiply(nut->third, nut->third));
}

/* What the shear of oversize balls between two sets of flanks follows from, of one set [N.m]. */
typedef struct {
    Number shear, push; /* of balls held by four flanks alike; friction on balls that slide on it, at coefficient 1 */
} Spin;

/* Sliding torque of a nut, mechanistic law: shear of the raceway contacts and friction of balls on each other. */
static inline Number sliding_torque_of_nut(const Map *map, const LoadedNut *nut, const Conditions *now,
                                           const Number values[], const Number slopes[], const Friction *friction,
                                           Spin *spin)
{
    const Number factor = exponential(values[THRUST_FACTOR]);
    const Number on_balls = multiply(multiply(friction->net_sliding, nut->sliding_load), factor);

    spin->shear = multiply(nut->share, exponential(values[SHEAR_TORQUE]));
    spin->push = nut->sliding_load;
    if (value_of(now->share) < 1.0) {
        const Number rise = coulomb_rise(map, now->share, factor, slopes[THRUST_FACTOR], friction->breakaway);
        const Number sliding = multiply(add(spin->shear, on_balls), rise);
        spin->shear = multiply(spin->shear, rise);
        spin->push = multiply(spin->push, rise);
        return sliding;
    }
    return add(spin->shear, on_balls);
}

/* Sliding torque by which oversize balls lose less than two sets of flanks alone: freed_shear of nut_law.py. */
static inline Number freed_shear(const Spin *relieved, const Spin *loaded, Number share)
{
    const Number one = constant(1.0), held = add(relieved->shear, loaded->shear);
    const Number free = add(multiply(share, loaded->shear), times(FREE_PUSH, relieved->push));
    const Number low = lesser(held, free), high = greater(greater(held, free), constant(SMOOTH));
    const Number near = power(divide(low, high), FREE_SHARPNESS);

    return subtract(multiply(low, power(add(one, near), -1.0 / FREE_SHARPNESS)), held);
}

/* Share of the relieved set of flanks in that, a convention. */
static inline Number relieved_share(const Spin *relieved, const Spin *loaded)
{
    return divide(relieved->shear, greater(add(relieved->shear, loaded->shear), constant(SMOOTH)));
}

/* Friction by the law of the map. loads: as from nut_loads, with sums added here; columns: cache of each nut for these
   conditions, or NULL */
static inline void nut_parts(const Map *map, Loads *loads, const Conditions *now, Columns columns[2],
                             const Friction *friction, Parts *out)
{
    const bool slow = value_of(now->share) < 1.0;
    Number viscous = constant(0.0), sliding = constant(0.0);
    Row slope_plane;
    Number relieved_viscous = viscous, relieved_sliding = sliding;
    Spin spin[2];

    if (slow) {
        Number w_j[4], w_k[4];
        spline_slopes(now->at_speed, w_j);
        spline_weights(now->at_temperature, w_k);
        plane_weights(w_j, w_k, &slope_plane);
    }
    for (int n = 0; n < loads->nuts; ++n) {
        const LoadedNut *nut = &loads->nut[n];
        Number values[TORQUE_COLUMNS], slopes[TORQUE_COLUMNS];
        surfaces_of_nut(map, nut, now, &slope_plane, columns != NULL ? &columns[n] : NULL, values, slopes);
        if (map->law == MECHANISTIC_LAW) {
            viscous = add(viscous, rolling_torque_of_nut(map, nut, now, values, slopes));
            nut_sums(map, loads);
            sliding = add(sliding, sliding_torque_of_nut(map, nut, now, values, slopes, friction, &spin[n]));
        } else {
            viscous = add(viscous, viscous_torque_of_nut(map, nut, now, values, slopes, friction->roughness));
        }
        if (n == 0) {
            relieved_viscous = viscous;
            relieved_sliding = sliding;
        }
    }
    nut_sums(map, loads);
    viscous = multiply(friction->viscosity_ratio, viscous);
    out->relieved_viscous = multiply(friction->viscosity_ratio, relieved_viscous);
    out->viscous = loads->nuts == 1 ? times(2.0, viscous) : viscous;
    out->hysteresis = loads->hysteresis;
    out->seal = friction->seal;
    if (map->law == MECHANISTIC_LAW) {
        const LoadedNut *loaded = &loads->nut[loads->nuts - 1];
        out->sliding = loads->nuts == 1 ? times(2.0, sliding) : sliding;
        if (value_of(loaded->free) < 1.0) {
            const Number freed = freed_shear(&spin[0], &spin[loads->nuts - 1], loaded->free);
            out->sliding = add(out->sliding, freed);
            relieved_sliding =
                add(relieved_sliding, multiply(freed, relieved_share(&spin[0], &spin[loads->nuts - 1])));
        }
    } else {
        Number coefficient = friction->net_sliding;
        if (slow) {
            coefficient = multiply(
                coefficient, coulomb_rise(map, now->share, constant(1.0), constant(0.0), friction->breakaway));
        }
        out->sliding = multiply(coefficient, loads->sliding_load);
        relieved_sliding = multiply(coefficient, loads->nut[0].sliding_load);
    }
    out->relieved_coulomb = add(loads->nut[0].hysteresis, relieved_sliding);
}

static inline Films films_of_nut(const Map *map, const LoadedNut *nut, const Conditions *now)
{
    const double *curves = map->curves + (ptrdiff_t)nut->cell * CURVE_COLUMNS;
    const Number s = now->share;
    const Number film_share = value_of(s) < 1.0 ? power(s, FILM_SPEED_EXPONENT) : constant(1.0);
    Number values[FILM_COLUMNS], least;
    Row sums;
    Films out;

    contract(map, map->films, FILM_COLUMNS, now, nut->cell, &now->plane, 2 * FILM_COLUMNS, &sums);
    over_force(nut->weight, &sums, FILM_COLUMNS, values);
    /* splines of nearly equal films may cross each other */
    least = lesser(lesser(values[MINIMUM_FILM_SCREW], values[MINIMUM_FILM_NUT]),
                   lesser(values[CENTRAL_FILM_SCREW], values[CENTRAL_FILM_NUT]));
    out.minimum = multiply(film_share, exponential(least));
    out.central_screw = multiply(film_share, exponential(values[CENTRAL_FILM_SCREW]));
    out.central_nut = multiply(film_share, exponential(values[CENTRAL_FILM_NUT]));
    out.rise = multiply(multiply(s, nut->third),
                        exponential(greater(values[TEMPERATURE_RISE_SCREW], values[TEMPERATURE_RISE_NUT])));
    out.pressure =
        multiply(nut->third, exponential(weighted(nut->weight, curves + CONTACT_PRESSURE_MAX_CURVE, CURVE_COLUMNS)));
    out.ball_load =
        multiply(nut->share, exponential(weighted(nut->weight, curves + BALL_LOAD_MAX_CURVE, CURVE_COLUMNS)));
    return out;
}

static inline void nut_films(const Map *map, const Loads *loads, const Conditions *now, Films *out)
{
    *out = films_of_nut(map, &loads->nut[0], now);
    if (loads->nuts == 2) {
        const Films loaded = films_of_nut(map, &loads->nut[1], now);
        out->minimum = lesser(out->minimum, loaded.minimum);
        out->central_screw = lesser(out->central_screw, loaded.central_screw);
        out->central_nut = lesser(out->central_nut, loaded.central_nut);
        out->rise = greater(out->rise, loaded.rise);
        out->pressure = greater(out->pressure, loaded.pressure);
        out->ball_load = greater(out->ball_load, loaded.ball_load);
    }
}

/* Presliding stiffness: Coulomb torque at standstill over presliding_angle [N.m/rad], sum over both nuts; of the seals over
   that at the highest force, so that it does not depend on the loads. */
static inline Number nut_stiffness(const Map *map, Loads *loads, const Friction *friction)
{
    nut_sums(map, loads);
    return add(add(loads->stiffness_hysteresis,
                   multiply(multiply(friction->net_sliding, greater(friction->breakaway, constant(1.0))),
                            loads->stiffness_sliding)),
               over(friction->seal, map->seal_angle));
}

#endif
