/* The laws of a nut: torque and films of the double nut from the map, independent of variables and FMI. Twin of
   runtime/nut_law.py. Numbers: number.h. */
#ifndef BALLSCREW_NUT_LAW_H
#define BALLSCREW_NUT_LAW_H

#include "nut_loads.h"

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

/* Torque below the lowest speed of the map, divided by that at the lowest speed. slope: of its logarithm there, with
   respect to the position in the cell. */
static inline Number slow_fraction(const Map *map, Number s, Number slope)
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

/* Shear torque below the lowest speed of the map, divided by that at the lowest speed: shear_rise of nut_law.py. slope:
   as above */
static inline Number shear_rise(const Map *map, Number s, Number boundary, Number slope, Number breakaway)
{
    const Number one = constant(1.0), square = multiply(s, s);
    const Number most = value_of(breakaway) > 1.0 ? exponential(greater(boundary, constant(0.0))) : one;
    /* the slope of coulomb_rise at the lowest speed is at least this part of its rise */
    const double least = (1.0 + 2.0 * REST) / (1.0 + REST) * LEAST_HALF / (1.0 + LEAST_HALF);
    const Number falls =
        greater(add(times(map->speed.scale, slope), times(least, subtract(most, one))), constant(0.0));
    const Number dip = subtract(one, times(0.5, multiply(falls, multiply(square, subtract(one, square)))));

    return multiply(dip, coulomb_rise(map, s, one, slope, most));
}

/* Surfaces needed for a torque, and below the speed axis their derivatives. slope_plane: weights of the derivatives with
   respect to speed. columns: cache for these conditions, updated here; NULL: no cache. */
static inline void surfaces_of_nut(const Map *map, const LoadedNut *nut, const Conditions *now, const Row *slope_plane,
                                   Columns *columns, Number values[TORQUE_COLUMNS], Number slopes[TORQUE_COLUMNS])
{
    const bool slow = value_of(now->fraction) < 1.0;
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
        if (value_of(now->fraction) < 1.0) {
            const Number rough = divide(times(2.0, x), add(one, x));
            const Number slope = add(slopes[t], multiply(rough, slopes[h]));
            torque = multiply(torque, slow_fraction(map, now->fraction, slope));
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

    if (value_of(now->fraction) < 1.0) {
        screw = multiply(screw, slow_fraction(map, now->fraction, slopes[ROLLING_TORQUE_SCREW]));
        other = multiply(other, slow_fraction(map, now->fraction, slopes[ROLLING_TORQUE_NUT]));
    }
    return multiply(add(screw, other), multiply(nut->third, nut->third));
}

/* What the shear of oversize balls between two sets of flanks follows from, of one set [N.m]; and of every nut. */
typedef struct {
    Number shear, push; /* of balls held by four flanks alike; friction on balls that slide on it, at coefficient 1 */
    Number on_balls;    /* friction of balls on each other */
    Number drag, limit; /* of the oil between balls, and what their contacts transmit of it */
} Spin;

/* Sliding torque of a nut, mechanistic law: shear of the raceway contacts and friction of balls on each other. drag:
   logarithm of that of the oil in full gaps */
static inline Number sliding_torque_of_nut(const Map *map, const LoadedNut *nut, const Conditions *now,
                                           const Number values[], const Number slopes[], Number drag,
                                           const Friction *friction, Spin *spin)
{
    const Number factor = exponential(values[THRUST_FACTOR]);
    const Number on_balls = multiply(multiply(friction->net_sliding, nut->sliding_load), factor);
    Number slower;

    spin->shear = multiply(nut->fraction, exponential(values[SHEAR_TORQUE]));
    spin->push = nut->sliding_load;
    slower = lesser(factor, constant(1.0)); /* below 1: oversize balls that turn slower */
    spin->drag = multiply(multiply(slower, slower), multiply(now->fraction, exponential(add(drag, nut->log_gaps))));
    spin->limit = multiply(slower, nut->limit);
    if (value_of(now->fraction) < 1.0) {
        const Number rise = coulomb_rise(map, now->fraction, factor, slopes[THRUST_FACTOR],
                                         friction->breakaway);
        const Number boundary = subtract(nut->log_boundary, values[SHEAR_TORQUE]);
        spin->shear = multiply(spin->shear, shear_rise(map, now->fraction, boundary, slopes[SHEAR_TORQUE],
                                                       friction->breakaway));
        spin->push = multiply(spin->push, rise);
        spin->on_balls = multiply(on_balls, rise);
    } else {
        spin->on_balls = on_balls;
    }
    return add(spin->shear, spin->on_balls);
}

/* Lesser of two numbers that are 0 or more: smooth_lesser of nut_law.py. */
static inline Number smooth_lesser(Number one, Number other, double sharpness)
{
    const Number low = lesser(one, other), high = greater(greater(one, other), constant(SMOOTH));

    return multiply(low, power(add(constant(1.0), power(divide(low, high), sharpness)), -1.0 / sharpness));
}

/* Logarithm of the drag of the oil in full gaps between balls [N.m], at or above the lowest speed. */
static inline Number log_gap_drag(const Map *map, const Conditions *now)
{
    const ptrdiff_t by_speed = axis_coefficients(&map->temperature);
    const double *block = map->drag + now->speed_cell * by_speed + now->temperature_cell;
    double value = 0.0, slope = 0.0;

    for (int i = 0; i < 16; ++i) {
        value += now->plane.v[i] * block[(i / 4) * by_speed + i % 4];
    }
#ifdef DUAL_NUMBERS
    for (int i = 0; i < 16 && !now->plane.still; ++i) {
        slope += now->plane.d[i] * block[(i / 4) * by_speed + i % 4];
    }
    return number(value, slope);
#else
    (void)slope;
    return value;
#endif
}

/* Torques of the oil between balls, at most what the contacts transmit, of the relieved and of the loaded nut. turn: of
   freed */
static inline void neighbour_drags(const Spin *relieved, const Spin *loaded, Number free, Number turn,
                                   Number drags[2])
{
    const Number limit = add(relieved->limit, loaded->limit);
    Number both, fraction;

    if (!(value_of(free) < 1.0)) {
        drags[0] = smooth_lesser(relieved->drag, relieved->limit, DRAG_SHARPNESS);
        drags[1] = smooth_lesser(loaded->drag, loaded->limit, DRAG_SHARPNESS);
        return;
    }
    both = smooth_lesser(multiply(multiply(turn, turn), add(relieved->drag, loaded->drag)), multiply(turn, limit),
                         DRAG_SHARPNESS);
    fraction = divide(relieved->limit, greater(limit, constant(SMOOTH)));
    drags[0] = multiply(both, fraction);
    drags[1] = multiply(both, subtract(constant(1.0), fraction));
}

/* Sliding torque by which oversize balls lose less than two sets of flanks alone, and their turn: freed of
   nut_law.py. */
static inline Number freed(const Spin *relieved, const Spin *loaded, const LoadedNut *nut, Number *turn)
{
    const Number one = constant(1.0), held = add(relieved->shear, loaded->shear);
    const Number free = add(multiply(nut->free, loaded->shear), times(FREE_PUSH, relieved->push));
    const Number both = smooth_lesser(held, free, FREE_SHARPNESS);
    const Number rolls = power(divide(both, greater(free, constant(SMOOTH))), FREE_SHARPNESS);
    const Number slower = multiply(rolls, subtract(one, nut->turn));

    *turn = subtract(one, slower);
    return subtract(subtract(both, held), multiply(slower, add(relieved->on_balls, loaded->on_balls)));
}

/* Share of the relieved set of flanks in that, a convention. */
static inline Number relieved_fraction(const Spin *relieved, const Spin *loaded)
{
    return divide(relieved->shear, greater(add(relieved->shear, loaded->shear), constant(SMOOTH)));
}

/* Friction by the law of the map. loads: as from nut_loads, with sums added here; columns: cache of each nut for these
   conditions, or NULL */
static inline void nut_parts(const Map *map, Loads *loads, const Conditions *now, Columns columns[2],
                             const Friction *friction, Parts *out)
{
    const bool slow = value_of(now->fraction) < 1.0;
    Number viscous = constant(0.0), sliding = constant(0.0);
    Row slope_plane;
    Number drag = viscous, relieved_viscous = viscous, relieved_sliding = sliding;
    Spin spin[2];

    if (slow) {
        Number w_j[4], w_k[4];
        spline_slopes(now->at_speed, w_j);
        spline_weights(now->at_temperature, w_k);
        plane_weights(w_j, w_k, &slope_plane);
    }
    if (map->law == MECHANISTIC_LAW) {
        drag = log_gap_drag(map, now);
    }
    for (int n = 0; n < loads->nuts; ++n) {
        const LoadedNut *nut = &loads->nut[n];
        Number values[TORQUE_COLUMNS], slopes[TORQUE_COLUMNS];
        surfaces_of_nut(map, nut, now, &slope_plane, columns != NULL ? &columns[n] : NULL, values, slopes);
        if (map->law == MECHANISTIC_LAW) {
            viscous = add(viscous, rolling_torque_of_nut(map, nut, now, values, slopes));
            nut_sums(map, loads);
            sliding = add(sliding, sliding_torque_of_nut(map, nut, now, values, slopes, drag, friction, &spin[n]));
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
        Number drags[2], turn = constant(1.0);
        out->sliding = loads->nuts == 1 ? times(2.0, sliding) : sliding;
        if (value_of(loaded->free) < 1.0) {
            const Number less = freed(&spin[0], &spin[loads->nuts - 1], loaded, &turn);
            out->sliding = add(out->sliding, less);
            relieved_sliding =
                add(relieved_sliding, multiply(less, relieved_fraction(&spin[0], &spin[loads->nuts - 1])));
        }
        neighbour_drags(&spin[0], &spin[loads->nuts - 1], loaded->free, turn, drags);
        out->viscous = add(out->viscous, add(drags[0], drags[1]));
        out->relieved_viscous = add(out->relieved_viscous, drags[0]);
    } else {
        Number coefficient = friction->net_sliding;
        if (slow) {
            coefficient = multiply(
                coefficient,
                coulomb_rise(map, now->fraction, constant(1.0), constant(0.0), friction->breakaway));
        }
        out->sliding = multiply(coefficient, loads->sliding_load);
        relieved_sliding = multiply(coefficient, loads->nut[0].sliding_load);
    }
    out->relieved_coulomb = add(loads->nut[0].hysteresis, relieved_sliding);
}

static inline Films films_of_nut(const Map *map, const LoadedNut *nut, const Conditions *now)
{
    const double *curves = map->curves + (ptrdiff_t)nut->cell * CURVE_COLUMNS;
    const Number s = now->fraction;
    const Number film_fraction = value_of(s) < 1.0 ? power(s, FILM_SPEED_EXPONENT) : constant(1.0);
    Number values[FILM_COLUMNS], least;
    Row sums;
    Films out;

    contract(map, map->films, FILM_COLUMNS, now, nut->cell, &now->plane, 2 * FILM_COLUMNS, &sums);
    over_force(nut->weight, &sums, FILM_COLUMNS, values);
    /* splines of nearly equal films may cross each other */
    least = lesser(lesser(values[MINIMUM_FILM_SCREW], values[MINIMUM_FILM_NUT]),
                   lesser(values[CENTRAL_FILM_SCREW], values[CENTRAL_FILM_NUT]));
    out.minimum = multiply(film_fraction, exponential(least));
    out.central_screw = multiply(film_fraction, exponential(values[CENTRAL_FILM_SCREW]));
    out.central_nut = multiply(film_fraction, exponential(values[CENTRAL_FILM_NUT]));
    out.rise = multiply(multiply(s, nut->third),
                        exponential(greater(values[TEMPERATURE_RISE_SCREW], values[TEMPERATURE_RISE_NUT])));
    out.pressure =
        multiply(nut->third, exponential(weighted(nut->weight, curves + CONTACT_PRESSURE_MAX_CURVE, CURVE_COLUMNS)));
    out.ball_load =
        multiply(nut->fraction,
                 exponential(weighted(nut->weight, curves + BALL_LOAD_MAX_CURVE, CURVE_COLUMNS)));
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
