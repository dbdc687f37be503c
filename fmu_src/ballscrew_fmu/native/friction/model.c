#include "model.h"

#include <math.h>
#include <string.h>

#include "law.h"

static double with_sign_of(double magnitude, double signed_value)
{
    return signed_value < 0.0 ? -magnitude : magnitude;
}

/* --- from the latched point into the map --- */

static void compute_loads(Model *model)
{
    nut_loads(model->map, model->latched[PRELOAD], model->latched[AXIAL_LOAD], &model->loads);
}

/* Everything that the outputs of the latched point start from. */
static void locate(Model *model)
{
    if (!model->conditions_known) {
        compute_loads(model);
        nut_conditions(model->map, model->latched[SPEED], model->latched[TEMPERATURE], &model->conditions);
        model->conditions_known = true;
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
    magnitude = nut_viscous_torque(model->map, &model->loads, &model->conditions, at[APPARENT_VISCOSITY_RATIO],
                                   at[ROUGHNESS_HEIGHT]);
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
    Films films;
    double *out = model->value;

    locate(model);
    nut_films(model->map, &model->loads, &model->conditions, &films);
    memcpy(out + FILM_THICKNESS_MIN, films.film, sizeof films.film);
    memcpy(out + FILM_TEMPERATURE_RISE, films.extreme, sizeof films.extreme);
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
    return (model->loads.preload_clamped ? 1U << (PRELOAD - INPUT_FIRST) : 0U)
           | (model->conditions.speed_clamped ? 1U << (SPEED - INPUT_FIRST) : 0U)
           | (model->conditions.temperature_clamped ? 1U << (TEMPERATURE - INPUT_FIRST) : 0U)
           | (model->loads.axial_load_clamped ? 1U << (AXIAL_LOAD - INPUT_FIRST) : 0U);
}

bool model_possible(const Model *model)
{
    return model->step >= 0.0;
}

void model_forget(Model *model)
{
    model->map = NULL;
    memset(&model->loads, 0, sizeof model->loads);
    memset(&model->conditions, 0, sizeof model->conditions);
    model->conditions_known = model->torque_known = model->films_known = false;
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

    return least(least(margin_within(at[PRELOAD], map->preload.lo, map->force.hi),
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
