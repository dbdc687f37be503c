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

/* distance to the ends of an axis over its length, negative beyond */
static double margin_within(double value, double lo, double hi)
{
    return least(value - lo, hi - value) / (hi - lo);
}

static void compute_loads(Model *model)
{
    const Map *map = model->map;
    const double *at = model->latched;
    Loads *loads = &model->loads;
    double preload = at[PRELOAD], speed = fabs(at[SPEED]), temperature = at[TEMPERATURE], w[4];

    loads->clamped = 0;
    model->margin = margin_within(preload, map->force.lo, map->force.hi);
    if (model->margin < 0.0) {
        loads->clamped |= 1U;
        preload = least(most(preload, 0.0), map->force.hi);
    }
    if (speed > map->speed.hi) {
        loads->clamped |= 2U;
    }
    model->margin = least(model->margin, (map->speed.hi - speed) / map->speed.hi);
    if (!(temperature >= map->temperature.lo && temperature <= map->temperature.hi)) {
        loads->clamped |= 4U;
    }
    model->margin = least(model->margin, margin_within(temperature, map->temperature.lo, map->temperature.hi));
    loads->speed = axis_place(&map->speed, speed);
    loads->temperature = axis_place(&map->temperature, temperature);
    loads->nuts = 1;
    loads->force[0] = loads->force[1] = preload;
    if (at[AXIAL_LOAD] != 0.0) {
        loads->nuts = 2;
        map_forces(map, preload, at[AXIAL_LOAD], loads->force);
        model->margin = least(model->margin, (map->force.hi - loads->force[1]) / map->force.hi);
        if (loads->force[1] > map->force.hi) {
            loads->clamped |= 8U;
            loads->force[1] = map->force.hi;
        }
    }
    loads->hysteresis = loads->sliding = 0.0;
    for (int n = 0; n < loads->nuts; ++n) {
        Place place = axis_place(&map->force, loads->force[n]);
        const double *curves = map->curves + (ptrdiff_t)place.cell * CURVE_COLUMNS;
        double sum[2] = {0.0, 0.0}, f = least(loads->force[n] / map->force.lo, 1.0);
        cubic_weights(place.t, w);
        for (int a = 0; a < 4; ++a) {
            sum[0] += w[a] * curves[a * CURVE_COLUMNS + HYSTERESIS_CURVE];
            sum[1] += w[a] * curves[a * CURVE_COLUMNS + SLIDING_CURVE];
        }
        loads->place[n] = place;
        loads->force_share[n] = f;
        loads->third[n] = f < 1.0 ? pow(f, 1.0 / 3.0) : 1.0;
        loads->hysteresis += exp(sum[0]) * f * loads->third[n];
        loads->sliding += at[NET_SLIDING_COEFFICIENT] * exp(sum[1]) * f;
    }
    if (loads->nuts == 1) {
        loads->hysteresis *= 2.0;
        loads->sliding *= 2.0;
    }
    model->loads_known = true;
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

/* surfaces at a place: contracted over speed and temperature, then over force */
static void contract_torque(const Map *map, const Loads *loads, int nut, const double plane[16], const double w_i[4],
                            double values[TORQUE_COLUMNS])
{
    const double *block =
        map_block(map, map->torque, TORQUE_COLUMNS, loads->speed, loads->temperature, loads->place[nut]);
    const ptrdiff_t by_speed = map_speed_stride(map, TORQUE_COLUMNS);
    const ptrdiff_t by_temperature = map_temperature_stride(map, TORQUE_COLUMNS);
    double run[4 * TORQUE_COLUMNS] = {0.0};

    for (int b = 0; b < 4; ++b) {
        for (int c = 0; c < 4; ++c) {
            const double *row = block + b * by_speed + c * by_temperature;
            const double w = plane[4 * b + c];
            for (int i = 0; i < 4 * TORQUE_COLUMNS; ++i) {
                run[i] += w * row[i];
            }
        }
    }
    for (int i = 0; i < TORQUE_COLUMNS; ++i) {
        values[i] = w_i[0] * run[i] + w_i[1] * run[TORQUE_COLUMNS + i] + w_i[2] * run[2 * TORQUE_COLUMNS + i]
                    + w_i[3] * run[3 * TORQUE_COLUMNS + i];
    }
}

static void contract_films(const Map *map, const Loads *loads, int nut, const double plane[16], const double w_i[4],
                           double values[FILM_COLUMNS])
{
    const double *block =
        map_block(map, map->films, FILM_COLUMNS, loads->speed, loads->temperature, loads->place[nut]);
    const ptrdiff_t by_speed = map_speed_stride(map, FILM_COLUMNS);
    const ptrdiff_t by_temperature = map_temperature_stride(map, FILM_COLUMNS);
    double run[4 * FILM_COLUMNS] = {0.0};

    for (int b = 0; b < 4; ++b) {
        for (int c = 0; c < 4; ++c) {
            const double *row = block + b * by_speed + c * by_temperature;
            const double w = plane[4 * b + c];
            for (int i = 0; i < 4 * FILM_COLUMNS; ++i) {
                run[i] += w * row[i];
            }
        }
    }
    for (int i = 0; i < FILM_COLUMNS; ++i) {
        values[i] = w_i[0] * run[i] + w_i[1] * run[FILM_COLUMNS + i] + w_i[2] * run[2 * FILM_COLUMNS + i]
                    + w_i[3] * run[3 * FILM_COLUMNS + i];
    }
}

static double speed_share(const Model *model)
{
    return least(fabs(model->latched[SPEED]) / model->map->speed.lo, 1.0);
}

static double viscous_torque(const Model *model)
{
    const Map *map = model->map;
    const Loads *loads = &model->loads;
    const double *at = model->latched;
    const double s = speed_share(model), roughness = at[ROUGHNESS_HEIGHT];
    double w_j[4], w_k[4], w_i[4], plane[16], slope_plane[16], total = 0.0;

    cubic_weights(loads->speed.t, w_j);
    cubic_weights(loads->temperature.t, w_k);
    plane_weights(w_j, w_k, plane);
    if (s < 1.0) {
        cubic_slopes(loads->speed.t, w_j);
        plane_weights(w_j, w_k, slope_plane);
    }
    for (int n = 0; n < loads->nuts; ++n) {
        double values[TORQUE_COLUMNS], slopes[TORQUE_COLUMNS], viscous = 0.0;
        cubic_weights(loads->place[n].t, w_i);
        contract_torque(map, loads, n, plane, w_i, values);
        if (s < 1.0) {
            contract_torque(map, loads, n, slope_plane, w_i, slopes);
        }
        for (int raceway = 0; raceway < 2; ++raceway) {
            const double film = exp(values[EFFECTIVE_FILM_SCREW + raceway]);
            const double x = (roughness / film) * (roughness / film), share = 1.0 / (1.0 + x);
            double torque = exp(values[VISCOUS_SCREW + raceway]) * share;
            if (s < 1.0) {
                /* exponent of speed of the viscous torque at the end of the axis; below 3 the law is monotone */
                const double exponent = (slopes[VISCOUS_SCREW + raceway]
                                         + 2.0 * x * share * slopes[EFFECTIVE_FILM_SCREW + raceway])
                                        * map->speed.scale;
                const double c = 0.5 * (least(most(exponent, 0.0), 3.0) - 1.0);
                torque *= s * (1.0 - c + c * s * s);
            }
            viscous += torque;
        }
        total += at[APPARENT_VISCOSITY_RATIO] * viscous * loads->third[n] * loads->third[n];
    }
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

    if (!model->loads_known) {
        compute_loads(model);
    }
    magnitude = viscous_torque(model);
    viscous = with_sign_of(magnitude, speed);
    power = magnitude * fabs(speed);
    coulomb = model->loads.hysteresis + model->loads.sliding;
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
    sliding = sign * model->loads.sliding;
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
    const double s = speed_share(model), film_share = s < 1.0 ? pow(s, FILM_SPEED_EXPONENT) : 1.0;
    double *out = model->value, w_j[4], w_k[4], w_i[4], plane[16];
    const Loads *loads = &model->loads;

    if (!model->loads_known) {
        compute_loads(model);
    }
    cubic_weights(loads->speed.t, w_j);
    cubic_weights(loads->temperature.t, w_k);
    plane_weights(w_j, w_k, plane);
    for (int n = 0; n < loads->nuts; ++n) {
        const double *curves = map->curves + (ptrdiff_t)loads->place[n].cell * CURVE_COLUMNS;
        double values[FILM_COLUMNS], pressure = 0.0, load = 0.0, film[3], extreme[3];
        cubic_weights(loads->place[n].t, w_i);
        contract_films(map, loads, n, plane, w_i, values);
        for (int a = 0; a < 4; ++a) {
            pressure += w_i[a] * curves[a * CURVE_COLUMNS + PRESSURE_CURVE];
            load += w_i[a] * curves[a * CURVE_COLUMNS + BALL_LOAD_CURVE];
        }
        film[0] = film_share * exp(least(values[MINIMUM_FILM_SCREW], values[MINIMUM_FILM_NUT]));
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

bool model_accepts(int reference, double value)
{
    return value >= model_variables[reference].lowest && value < MODEL_TOO_LARGE;
}

void model_set(Model *model, int reference, double value)
{
    model->value[reference] = value;
}

void model_latch(Model *model)
{
    memcpy(model->latched, model->value, sizeof model->latched);
    model->step = 0.0;
    model->deflection_before = model->value[PRESLIDING_DEFLECTION];
    model->loads_known = model->torque_known = model->films_known = false;
    if (model->value[PRESLIDING_STIFFNESS] > 0.0 && !model->continuous) {
        compute_loads(model);
        bristle(model, model->loads.hysteresis + model->loads.sliding);
    }
}

void model_step(Model *model, double step)
{
    memcpy(model->latched, model->value, sizeof model->latched);
    model->step = step;
    model->deflection_before = model->value[PRESLIDING_DEFLECTION];
    model->loads_known = model->torque_known = model->films_known = false;
    compute_loads(model);
    if (model->latched[PRESLIDING_STIFFNESS] > 0.0) {
        bristle(model, model->loads.hysteresis + model->loads.sliding);
    } else if (step > 0.0) {
        /* a bristle that is switched off is unwound */
        model->value[PRESLIDING_DEFLECTION] = model->latched[PRESLIDING_DEFLECTION] = 0.0;
        model->value[PRESLIDING_DEFLECTION_RATE] = 0.0;
    }
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
        return model->continuous ? model->in_range : model_clamped(model) == 0U;
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
    if (!model->loads_known) {
        compute_loads(model);
    }
    return model->loads.clamped;
}

/* --- model exchange --- */

#define RANGE_HYSTERESIS 1e-6 /* of an axis: in_range does not storm on the edge of the map */
#define SPEED_HYSTERESIS 1e-6 /* [rad/s] */
#define SLIP_FROM 0.999       /* of the sliding deflection, which the bristle reaches in infinite travel only */

void model_indicators(Model *model, double indicators[MODEL_INDICATORS])
{
    const double *at = model->latched;
    const double stiffness = at[PRESLIDING_STIFFNESS];

    if (!model->loads_known) {
        compute_loads(model);
    }
    indicators[0] = model->margin + (model->in_range ? RANGE_HYSTERESIS : -RANGE_HYSTERESIS);
    if (!(stiffness > 0.0)) {
        indicators[1] = 1.0;
    } else if (model->slip != 0) {
        indicators[1] = model->slip * at[SPEED] + SPEED_HYSTERESIS;
    } else {
        const double sliding = (model->loads.hysteresis + model->loads.sliding) / stiffness;
        indicators[1] = SLIP_FROM * sliding - with_sign_of(at[PRESLIDING_DEFLECTION], at[SPEED]);
    }
}

void model_initial_event(Model *model)
{
    model->slip = 0;
    model->in_range = model_clamped(model) == 0U;
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
        const double sliding = (model->loads.hysteresis + model->loads.sliding) / at[PRESLIDING_STIFFNESS];
        model->value[PRESLIDING_DEFLECTION] = model->slip * sliding;
        model->slip = 0;
        changed = true;
    }
    model_latch(model);
    return changed;
}
