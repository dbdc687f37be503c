/* Preload from torque, with the law of the nut in dual numbers along the preload. */
#define DUAL_NUMBERS
#include "search.h"

#include "presliding_law.h"
#include "nut_law.h"

/* Data that do not depend on the preload. */
typedef struct {
    const Map *map;
    const double *at;
    Conditions conditions;
    Columns columns[2];
    Friction friction;
    double sign; /* factor of the Coulomb parts at this speed */
} Search;

static Number variable_of(const double at[], const double direction[], int reference)
{
    return number(at[reference], direction[reference]);
}

/* Of the balls: that of the seals is apart. */
static Friction friction_along(const double at[], const double direction[])
{
    const Friction out = {variable_of(at, direction, APPARENT_VISCOSITY_RATIO),
                          variable_of(at, direction, NET_SLIDING_COEFFICIENT),
                          variable_of(at, direction, ROUGHNESS_HEIGHT), variable_of(at, direction, BREAKAWAY_FACTOR),
                          constant(0.0)};
    return out;
}

static void begin_search(Search *search, const Map *map, const double at[], double speed, Estimate *out)
{
    static const double constants[VARIABLE_COUNT] = {0.0};

    search->map = map;
    search->at = at;
    search->columns[0].cell = search->columns[1].cell = -1;
    search->friction = friction_along(at, constants);
    search->sign = value_of(regularised_sign(constant(speed), constant(at[REGULARIZATION_SPEED])));
    nut_conditions(map, constant(speed), constant(at[TEMPERATURE]), &search->conditions);
    out->speed_clamped = search->conditions.speed_clamped;
    out->temperature_clamped = search->conditions.temperature_clamped;
}

static void try_preload(Search *search, double preload, Estimate *out)
{
    const Number difference = constant(search->at[TEMPERATURE_DIFFERENCE]);
    const Number actual = actual_preload(search->map, number(preload, 1.0), difference);
    Loads loads;
    Parts parts;
    Number torque;

    nut_loads(search->map, actual, constant(search->at[AXIAL_LOAD]), &loads);
    nut_parts(search->map, &loads, &search->conditions, search->columns, &search->friction, &parts);
    torque = add(parts.viscous, times(search->sign, coulomb_magnitude(&parts)));
    out->preload = preload;
    out->torque = value_of(torque);
    out->slope = slope_of(torque);
    out->axial_load_clamped = loads.axial_load_clamped;
}

void torque_of_preload(const Map *map, const double at[VARIABLE_COUNT], double speed, double preload, Estimate *out)
{
    Search search;

    begin_search(&search, map, at, speed, out);
    try_preload(&search, preload, out);
    out->converged = true;
}

/* Preload at or below which the axial load separates the nuts [N]. 0 without axial load, at most the end of the map. */
static double separation_preload(const Map *map, double axial_load)
{
    const double load = fabs(axial_load);
    const double *separation = map->separation + (axial_load > 0.0 ? 0 : axis_coefficients(&map->preload));
    double preload = load;

    for (int i = 0; load > 0.0 && i < SEPARATION_STEPS; ++i) {
        Number weights[4], ratio;
        int cell;
        double step;
        /* derivative with respect to ln preload */
        spline_weights(axis_position(&map->preload, number(preload, preload), &cell), weights);
        ratio = weighted(weights, separation + cell, 1);
        step = (log(load / preload) - value_of(ratio)) / (1.0 + slope_of(ratio));
        step = step > -LONGEST_STEP ? step : -LONGEST_STEP;
        preload *= exp(step < LONGEST_STEP ? step : LONGEST_STEP);
    }
    return preload < map->force.hi ? preload : map->force.hi;
}

/* Preload [N] without temperature difference at or below which at most this one is left; at most the end of the map. */
static double preload_leaving(const Map *map, double actual, double difference)
{
    double low = 0.0, high = map->force.hi;

    if (difference == 0.0) {
        low = actual / map->preload_factor;
        return low < high ? low : high;
    }
    for (int i = 0; i < MOST_ITERATIONS && high - low > ROUNDING * high; ++i) {
        const double middle = 0.5 * (low + high);
        if (value_of(actual_preload(map, constant(middle), constant(difference))) <= actual) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

/* Newton's method for ln torque as a function of ln preload, safeguarded by bisection. True if the torque at
   out->preload is the target. */
static bool solve(Search *search, double target, Estimate *out)
{
    const double highest = search->map->force.hi;
    double low = preload_leaving(search->map, separation_preload(search->map, search->at[AXIAL_LOAD]),
                                 search->at[TEMPERATURE_DIFFERENCE]);
    double high = highest;
    double before = HUGE_VAL, preload;
    bool high_known = false;

    if (low > 0.0 || !(target > 0.0)) { /* preload 0 gives torque 0 */
        try_preload(search, low, out);
        if (!(target > (1.0 + JUMP) * out->torque)) {
            out->slope = 0.0;
            return false;
        }
    }
    preload = low > 0.0 ? 0.5 * (low + highest) : 0.25 * highest;
    for (int i = 0; i < MOST_ITERATIONS; ++i) {
        double error, elastic, step, next;
        try_preload(search, preload, out);
        if (preload >= highest && out->torque <= target) {
            return out->torque == target;
        }
        if (out->torque > target) {
            high = preload;
            high_known = true;
        } else {
            low = preload;
        }
        error = out->torque > 0.0 ? log(target / out->torque) : HUGE_VAL;
        elastic = out->slope * preload;
        step = elastic > LEAST_ELASTICITY * out->torque && out->torque > 0.0 ? error * out->torque / elastic : HUGE_VAL;
        next = step > -LONGEST_STEP ? preload * exp(step < LONGEST_STEP ? step : LONGEST_STEP) : 0.0;
        if (fabs(step) <= ACCURACY) {
            out->preload = next < highest ? next : highest;
            return true;
        }
        if (high_known && high - low <= ROUNDING * high) {
            return fabs(error) <= JUMP;
        }
        if (!high_known && next >= high) {
            next = high; /* the torque at the end of the map is not computed yet */
        } else if (!(low < next && next < high && fabs(error) <= 0.5 * before)) {
            next = low > 0.0 ? sqrt(low * high) : 0.5 * high;
        }
        before = fabs(error);
        preload = next;
    }
    return false;
}

void preload_of_torque(const Map *map, const double at[VARIABLE_COUNT], double speed, double torque, Estimate *out)
{
    Search search;

    begin_search(&search, map, at, speed, out);
    out->converged = solve(&search, torque, out);
}

/* --- derivatives along a direction ------------------------------------------------------------------------------- */

static Number number_of(Dual a) { return number(a.value, a.slope); }

static Dual dual_of(Number a)
{
    const Dual out = {value_of(a), slope_of(a)};
    return out;
}

/* Preload at the temperature difference of screw and nut. */
static Number actual_along(const Map *map, const double at[], const double direction[], Dual preload)
{
    return actual_preload(map, number_of(preload), variable_of(at, direction, TEMPERATURE_DIFFERENCE));
}

Dual torque_along(const Map *map, const double at[VARIABLE_COUNT], const double direction[VARIABLE_COUNT],
                  Dual speed,
                   Dual preload)
{
    const Friction friction = friction_along(at, direction);
    const Number sign = regularised_sign(number_of(speed), variable_of(at, direction, REGULARIZATION_SPEED));
    Conditions conditions;
    Loads loads;
    Parts parts;

    nut_conditions(map, number_of(speed), variable_of(at, direction, TEMPERATURE), &conditions);
    nut_loads(map, actual_along(map, at, direction, preload), variable_of(at, direction, AXIAL_LOAD), &loads);
    nut_parts(map, &loads, &conditions, NULL, &friction, &parts);
    return dual_of(add(parts.viscous, multiply(sign, coulomb_magnitude(&parts))));
}

Dual seal_along(const double at[VARIABLE_COUNT], const double direction[VARIABLE_COUNT], Dual speed)
{
    const Number sign = regularised_sign(number_of(speed), variable_of(at, direction, REGULARIZATION_SPEED));

    return dual_of(multiply(sign, variable_of(at, direction, SEAL_TORQUE)));
}

Dual lambda_ratio_along(const Map *map, const double at[VARIABLE_COUNT],
                        const double direction[VARIABLE_COUNT],
                         Dual preload)
{
    Conditions conditions;
    Loads loads;
    Films films;

    nut_conditions(map, variable_of(at, direction, SPEED), variable_of(at, direction, TEMPERATURE), &conditions);
    nut_loads(map, actual_along(map, at, direction, preload), variable_of(at, direction, AXIAL_LOAD), &loads);
    nut_films(map, &loads, &conditions, &films);
    return dual_of(lambda_ratio(films.minimum, variable_of(at, direction, ROUGHNESS_HEIGHT)));
}
