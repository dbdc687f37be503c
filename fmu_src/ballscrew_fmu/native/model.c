#include "model.h"

#include <math.h>
#include <string.h>

#include "law.h"

/* --- map to nuts: twin of NutMap.evaluate_point --- */

static double least(double a, double b)
{
    return a < b ? a : b;
}

static double most(double a, double b)
{
    return a > b ? a : b;
}

static double with_sign_of(double magnitude, double signed_value)
{
    return signed_value < 0.0 ? -magnitude : magnitude;
}

/* Forces of the nuts and what follows from them alone. */
static void compute_loads(Model *model)
{
    const Map *map = model->map;
    Loads *loads = &model->loads;
    const double axial_load = model->latched[AXIAL_LOAD];
    double preload = model->latched[PRELOAD];

    if (loads->known && loads->preload == preload && loads->axial_load == axial_load) {
        return;
    }
    loads->known = true;
    loads->preload = preload;
    loads->axial_load = axial_load;
    loads->clamped = 0;
    if (preload < map->force.lo || preload > map->force.hi) {
        loads->clamped |= 1U;
        preload = least(most(preload, 0.0), map->force.hi);
    }
    loads->nuts = 1;
    loads->force[0] = loads->force[1] = preload;
    if (axial_load != 0.0) {
        loads->nuts = 2;
        map_forces(map, preload, axial_load, loads->force);
        if (loads->force[1] > map->force.hi) {
            loads->clamped |= 8U;
            loads->force[1] = map->force.hi;
        }
    }
    loads->hysteresis = loads->sliding_load = 0.0;
    for (int n = 0; n < loads->nuts; ++n) {
        const double force = loads->force[n], f = force < map->force.lo ? force / map->force.lo : 1.0;
        const Place place = axis_place(&map->force, force);
        const double *curves = map->curves + (ptrdiff_t)place.cell * CURVE_COLUMNS;
        double sum[2] = {0.0, 0.0}, *w = loads->weight[n];
        cubic_weights(place.t, w);
        for (int a = 0; a < 4; ++a) {
            sum[0] += w[a] * curves[a * CURVE_COLUMNS + HYSTERESIS_CURVE];
            sum[1] += w[a] * curves[a * CURVE_COLUMNS + SLIDING_CURVE];
        }
        loads->place[n] = place;
        loads->force_share[n] = f;
        loads->third[n] = f < 1.0 ? pow(f, 1.0 / 3.0) : 1.0;
        loads->hysteresis += exp(sum[0]) * f * loads->third[n];
        loads->sliding_load += exp(sum[1]) * f;
    }
    if (loads->nuts == 1) {
        loads->hysteresis *= 2.0;
        loads->sliding_load *= 2.0;
    }
}

/* sixteen weights of the neighbours over speed and temperature */
static void plane_weights(const double w_j[4], const double w_k[4], double plane[16])
{
    for (int b = 0; b < 4; ++b) {
        for (int c = 0; c < 4; ++c) {
            plane[4 * b + c] = w_j[b] * w_k[c];
        }
    }
}

static void compute_conditions(Model *model)
{
    const Map *map = model->map;
    Conditions *now = &model->conditions;
    const double speed = fabs(model->latched[SPEED]), temperature = model->latched[TEMPERATURE];
    double w_j[4], w_k[4];

    now->clamped = speed > map->speed.hi ? 2U : 0U;
    if (!(temperature >= map->temperature.lo && temperature <= map->temperature.hi)) {
        now->clamped |= 4U;
    }
    now->share = speed < map->speed.lo ? speed / map->speed.lo : 1.0;
    now->speed = axis_place(&map->speed, speed);
    now->temperature = axis_place(&map->temperature, temperature);
    cubic_weights(now->speed.t, w_j);
    cubic_weights(now->temperature.t, w_k);
    plane_weights(w_j, w_k, now->plane);
    model->conditions_known = true;
}

/* Everything that the outputs of the latched point start from. */
static void locate(Model *model)
{
    if (!model->conditions_known) {
        compute_loads(model);
        compute_conditions(model);
    }
}

static double sliding_magnitude(const Model *model)
{
    return model->latched[NET_SLIDING_COEFFICIENT] * model->loads.sliding_load;
}

static double coulomb_magnitude(const Model *model)
{
    return model->loads.hysteresis + sliding_magnitude(model);
}

/* Sum of the sixteen rows of neighbours; sums: as many columns at once as stay in registers. */
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

static inline void over_force(const double w[4], const double sums[], int columns, double values[])
{
    for (int i = 0; i < columns; ++i) {
        values[i] = w[0] * sums[i] + w[1] * sums[columns + i] + w[2] * sums[2 * columns + i]
                    + w[3] * sums[3 * columns + i];
    }
}

/* surfaces at the force of a nut: contracted over speed and temperature, then over force */
static void contract_torque(const Model *model, int nut, const double plane[16], double values[TORQUE_COLUMNS])
{
    const Map *map = model->map;
    const double *block = map_block(map, map->torque, TORQUE_COLUMNS, model->conditions.speed,
                                    model->conditions.temperature, model->loads.place[nut]);
    double sums[4 * TORQUE_COLUMNS];

    add_rows(block, map_speed_stride(map, TORQUE_COLUMNS), map_temperature_stride(map, TORQUE_COLUMNS), plane, sums,
             4 * TORQUE_COLUMNS);
    over_force(model->loads.weight[nut], sums, TORQUE_COLUMNS, values);
}

static void contract_films(const Model *model, int nut, double values[FILM_COLUMNS])
{
    const Map *map = model->map;
    const double *block = map_block(map, map->films, FILM_COLUMNS, model->conditions.speed,
                                    model->conditions.temperature, model->loads.place[nut]);
    const ptrdiff_t by_speed = map_speed_stride(map, FILM_COLUMNS);
    const ptrdiff_t by_temperature = map_temperature_stride(map, FILM_COLUMNS);
    double sums[4 * FILM_COLUMNS];

    for (int half = 0; half < 4 * FILM_COLUMNS; half += 2 * FILM_COLUMNS) {
        add_rows(block + half, by_speed, by_temperature, model->conditions.plane, sums + half, 2 * FILM_COLUMNS);
    }
    over_force(model->loads.weight[nut], sums, FILM_COLUMNS, values);
}

/* Share of the viscous torque that is left below the lowest speed of the map. The exponent of speed at the end of the
   axis follows from the slopes of torque and film; x: roughness over film, squared. Below 3 the law is monotone. */
static double slow_share(const Model *model, int raceway, const double slopes[TORQUE_COLUMNS], double x)
{
    const double s = model->conditions.share;
    const double exponent =
        (slopes[VISCOUS_SCREW + raceway] + 2.0 * x / (1.0 + x) * slopes[EFFECTIVE_FILM_SCREW + raceway])
        * model->map->speed.scale;
    const double c = 0.5 * (least(most(exponent, 0.0), 3.0) - 1.0);

    return s * (1.0 - c + c * s * s);
}

static double viscous_torque(const Model *model)
{
    const Conditions *now = &model->conditions;
    const Loads *loads = &model->loads;
    const double roughness = model->latched[ROUGHNESS_HEIGHT];
    double slope_plane[16], total = 0.0;

    if (now->share < 1.0) {
        double w_j[4], w_k[4];
        cubic_slopes(now->speed.t, w_j);
        cubic_weights(now->temperature.t, w_k);
        plane_weights(w_j, w_k, slope_plane);
    }
    for (int n = 0; n < loads->nuts; ++n) {
        double values[TORQUE_COLUMNS], slopes[TORQUE_COLUMNS], viscous = 0.0;
        contract_torque(model, n, now->plane, values);
        if (now->share < 1.0) {
            contract_torque(model, n, slope_plane, slopes);
        }
        for (int raceway = 0; raceway < 2; ++raceway) {
            const double ratio = roughness * exp(-values[EFFECTIVE_FILM_SCREW + raceway]), x = ratio * ratio;
            const double torque = exp(values[VISCOUS_SCREW + raceway]) / (1.0 + x);
            viscous += now->share < 1.0 ? torque * slow_share(model, raceway, slopes, x) : torque;
        }
        total += viscous * loads->third[n] * loads->third[n];
    }
    total *= model->latched[APPARENT_VISCOSITY_RATIO];
    return loads->nuts == 1 ? 2.0 * total : total;
}

/* --- standstill: twin of standstill.py --- */

/* Outputs of the bristle at the latched point; what advances is left in the model. */
static void bristle(Model *model, double coulomb)
{
    const double *at = model->latched;
    const double stiffness = at[PRESLIDING_STIFFNESS], damping = at[PRESLIDING_DAMPING], speed = at[SPEED];
    const double deflection = at[PRESLIDING_DEFLECTION];

    if (model->continuous) {
        const double rate = bristle_rate(deflection, speed, coulomb, stiffness, model->slip);
        const double wound = bristle_within(deflection, coulomb, stiffness);
        if (model->slip != 0) {
            model->bristle_torque = model->slip * coulomb;
            model->bristle_power = coulomb * fabs(speed);
        } else {
            model->bristle_torque = stiffness * wound + damping * rate;
            model->bristle_power = most(stiffness * wound * (speed - rate) + damping * rate * speed, 0.0);
        }
        model->value[PRESLIDING_DEFLECTION_RATE] = rate;
        return;
    }
    if (model->step > 0.0) {
        const BristleStep step =
            bristle_step(model->deflection_before, speed, model->step, coulomb, stiffness, damping);
        model->value[PRESLIDING_DEFLECTION_RATE] = (step.deflection - model->deflection_before) / model->step;
        model->value[PRESLIDING_DEFLECTION] = model->latched[PRESLIDING_DEFLECTION] = step.deflection;
        model->bristle_torque = step.torque;
        model->bristle_power = step.heat / model->step;
    } else {
        model->bristle_torque = coulomb > 0.0 ? stiffness * bristle_within(deflection, coulomb, stiffness) : 0.0;
        model->bristle_power = bristle_power(deflection, speed, coulomb, stiffness);
        model->value[PRESLIDING_DEFLECTION_RATE] = bristle_rate(deflection, speed, coulomb, stiffness, 0);
    }
}

static void compute_torque(Model *model)
{
    const double *at = model->latched;
    const double speed = at[SPEED];
    double magnitude, viscous, hysteresis, sliding, coulomb, sign, power;

    locate(model);
    magnitude = viscous_torque(model);
    viscous = with_sign_of(magnitude, speed);
    power = magnitude * fabs(speed);
    coulomb = coulomb_magnitude(model);
    if (at[PRESLIDING_STIFFNESS] > 0.0) {
        if (model->continuous) {
            bristle(model, coulomb);
        }
        sign = coulomb > 0.0 ? model->bristle_torque / coulomb : 0.0;
        power += model->bristle_power;
    } else {
        sign = regularised_sign(speed, at[REGULARIZATION_SPEED]);
        power += coulomb * sign * speed;
    }
    hysteresis = sign * model->loads.hysteresis;
    sliding = sign * sliding_magnitude(model);
    model->value[FRICTION_TORQUE] = viscous + hysteresis + sliding;
    model->value[VISCOUS_TORQUE] = viscous;
    model->value[HYSTERESIS_TORQUE] = hysteresis;
    model->value[SLIDING_TORQUE] = sliding;
    model->value[POWER_LOSS] = power;
    model->torque_known = true;
}

static void compute_films(Model *model)
{
    const Map *map = model->map;
    const Loads *loads = &model->loads;
    double *out = model->value, s, film_share;

    locate(model);
    s = model->conditions.share;
    film_share = s < 1.0 ? pow(s, FILM_SPEED_EXPONENT) : 1.0;
    for (int n = 0; n < loads->nuts; ++n) {
        const double *curves = map->curves + (ptrdiff_t)loads->place[n].cell * CURVE_COLUMNS, *w = loads->weight[n];
        double values[FILM_COLUMNS], pressure = 0.0, load = 0.0, film[3], extreme[3];
        contract_films(model, n, values);
        for (int a = 0; a < 4; ++a) {
            pressure += w[a] * curves[a * CURVE_COLUMNS + PRESSURE_CURVE];
            load += w[a] * curves[a * CURVE_COLUMNS + BALL_LOAD_CURVE];
        }
        /* a spline through nearly equal films may cross another */
        film[0] = film_share
                  * exp(least(least(values[MINIMUM_FILM_SCREW], values[MINIMUM_FILM_NUT]),
                              least(values[CENTRAL_FILM_SCREW], values[CENTRAL_FILM_NUT])));
        film[1] = film_share * exp(values[CENTRAL_FILM_SCREW]);
        film[2] = film_share * exp(values[CENTRAL_FILM_NUT]);
        extreme[0] = s * loads->third[n] * exp(most(values[RISE_SCREW], values[RISE_NUT]));
        extreme[1] = loads->third[n] * exp(pressure);
        extreme[2] = loads->force_share[n] * exp(load);
        for (int i = 0; i < 3; ++i) {
            out[FILM_THICKNESS_MIN + i] = n == 0 ? film[i] : least(out[FILM_THICKNESS_MIN + i], film[i]);
            out[FILM_TEMPERATURE_RISE + i] =
                n == 0 ? extreme[i] : most(out[FILM_TEMPERATURE_RISE + i], extreme[i]);
        }
    }
    out[LAMBDA_RATIO] =
        least(out[FILM_THICKNESS_MIN] / most(model->latched[ROUGHNESS_HEIGHT], SMOOTH), LAMBDA_RATIO_MAX);
    model->films_known = true;
}

/* --- interface --- */

void model_reset(Model *model, const Map *map, bool continuous)
{
    memset(model, 0, sizeof *model);
    model->map = map;
    model->continuous = continuous;
    model->in_range = true;
    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        model->value[i] = model_variables[i].start;
    }
    model_latch(model);
}

extern bool model_accepts(int reference, double value);
extern void model_set(Model *model, int reference, double value);

void model_latch(Model *model)
{
    memcpy(model->latched, model->value, sizeof model->latched);
    model->step = 0.0;
    model->deflection_before = model->value[PRESLIDING_DEFLECTION];
    model->conditions_known = model->torque_known = model->films_known = false;
    if (model->value[PRESLIDING_STIFFNESS] > 0.0 && !model->continuous) {
        compute_loads(model);
        bristle(model, coulomb_magnitude(model));
    }
}

void model_step(Model *model, double step)
{
    memcpy(model->latched, model->value, sizeof model->latched);
    model->step = step;
    model->deflection_before = model->value[PRESLIDING_DEFLECTION];
    model->conditions_known = model->torque_known = model->films_known = false;
    if (model->latched[PRESLIDING_STIFFNESS] > 0.0) {
        compute_loads(model);
        bristle(model, coulomb_magnitude(model));
    } else if (step > 0.0) {
        /* a bristle that is switched off is unwound */
        model->value[PRESLIDING_DEFLECTION] = model->latched[PRESLIDING_DEFLECTION] = 0.0;
        model->value[PRESLIDING_DEFLECTION_RATE] = 0.0;
        model->bristle_torque = model->bristle_power = 0.0;
    }
}

/* in model exchange it changes at events only, once they have begun */
static bool in_range(Model *model)
{
    return model->continuous && model->events_began ? model->in_range : model_clamped(model) == 0U;
}

double model_get(Model *model, int reference)
{
    if (reference >= FRICTION_TORQUE && reference <= POWER_LOSS) {
        if (!model->torque_known) {
            compute_torque(model);
        }
    } else if (reference >= FILM_THICKNESS_MIN && reference <= LAMBDA_RATIO) {
        if (!model->films_known) {
            compute_films(model);
        }
    } else if (reference == IN_RANGE) {
        return in_range(model);
    } else if (reference == PRESLIDING_DEFLECTION_RATE && model->continuous) {
        if (!model->torque_known) {
            compute_torque(model);
        }
    } else if (reference == IN_RANGE_INDICATOR || reference == SLIP_INDICATOR) {
        double indicators[MODEL_INDICATORS];
        model_indicators(model, indicators);
        return indicators[reference - IN_RANGE_INDICATOR];
    }
    return model->value[reference];
}

unsigned model_clamped(Model *model)
{
    locate(model);
    return model->loads.clamped | model->conditions.clamped;
}

/* --- model exchange --- */

#define RANGE_HYSTERESIS 1e-6 /* of an axis: in_range does not storm on the edge of the map */
#define SPEED_HYSTERESIS 1e-6 /* [rad/s] */
#define SLIP_FROM 0.999       /* of the sliding deflection, which the bristle reaches in infinite travel only */

/* distance to the ends of an axis over its length, negative beyond */
static double margin_within(double value, double lo, double hi)
{
    return least(value - lo, hi - value) / (hi - lo);
}

/* least distance of the latched point to the ends of the map, negative beyond */
static double margin(const Model *model)
{
    const Map *map = model->map;
    const double *at = model->latched;
    const double highest = model->loads.nuts == 2 ? model->loads.force[1] : 0.0;

    return least(least(margin_within(at[PRELOAD], map->force.lo, map->force.hi),
                       margin_within(at[TEMPERATURE], map->temperature.lo, map->temperature.hi)),
                 least((map->speed.hi - fabs(at[SPEED])) / map->speed.hi, (map->force.hi - highest) / map->force.hi));
}

void model_indicators(Model *model, double indicators[MODEL_INDICATORS])
{
    const double *at = model->latched;
    const double stiffness = at[PRESLIDING_STIFFNESS];

    locate(model);
    indicators[0] = margin(model) + (in_range(model) ? RANGE_HYSTERESIS : -RANGE_HYSTERESIS);
    if (!(stiffness > 0.0)) {
        indicators[1] = 1.0;
    } else if (model->slip != 0) {
        indicators[1] = model->slip * at[SPEED] + SPEED_HYSTERESIS;
    } else {
        const double sliding = least(coulomb_magnitude(model) / stiffness, MODEL_TOO_LARGE);
        indicators[1] = SLIP_FROM * sliding - with_sign_of(at[PRESLIDING_DEFLECTION], at[SPEED]);
    }
}

void model_initial_event(Model *model)
{
    model->slip = 0;
    model->in_range = model_clamped(model) == 0U;
    model->events_began = true;
    (void)model_event(model);
}

bool model_event(Model *model)
{
    const double *at = model->latched;
    double indicators[MODEL_INDICATORS];
    bool changed = false;

    model_indicators(model, indicators);
    if (model->in_range ? indicators[0] < 0.0 : indicators[0] > 0.0) {
        model->in_range = !model->in_range;
    }
    if (!(at[PRESLIDING_STIFFNESS] > 0.0)) {
        model->slip = 0;
    } else if (model->slip == 0) {
        if (indicators[1] <= 0.0 && at[SPEED] != 0.0) {
            model->slip = at[SPEED] > 0.0 ? 1 : -1;
        }
    } else if (indicators[1] < 0.0) {
        const double sliding = coulomb_magnitude(model) / at[PRESLIDING_STIFFNESS];
        model->value[PRESLIDING_DEFLECTION] = model->slip * sliding;
        model->slip = 0;
        changed = true;
    }
    model_latch(model);
    return changed;
}
