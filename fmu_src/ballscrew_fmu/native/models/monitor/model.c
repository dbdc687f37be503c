/* Preload monitor: the preload at which the map gives the measured torque. */
#include "model.h"

#include <math.h>
#include <string.h>

#include "nut_law.h"
#include "presliding_law.h"
#include "search.h"

/* --- outputs of the latched point -------------------------------------------------------------------------------- */

static bool at_rest(const Model *model)
{
    const double speed = fabs(model->latched[SPEED]);

    if (model->began) {
        return model->rests;
    }
    return !(speed >= model->latched[SPEED_MIN] && speed > 0.0);
}

static unsigned bit_of(int reference)
{
    return 1U << (reference - (int)INPUT_FIRST);
}

/* Speed at which the preload is evaluated: at least speed_min. */
static double motion(const Model *model)
{
    return greater(fabs(model->latched[SPEED]), model->latched[SPEED_MIN]);
}

/* Torque of the balls: the measured one without that of the seals. */
static double torque_along_motion(const Model *model)
{
    const double *at = model->latched;

    return with_sign_of(at[TORQUE], at[SPEED])
           - at[SEAL_TORQUE] * regularised_sign(motion(model), at[REGULARIZATION_SPEED]);
}

static unsigned clamped_inputs(const Estimate *result)
{
    return (result->speed_clamped ? bit_of(SPEED) : 0U)
           | (result->temperature_clamped ? bit_of(TEMPERATURE) : 0U)
           | (result->axial_load_clamped ? bit_of(AXIAL_LOAD) : 0U);
}

/* Of a temperature difference beyond the map. */
static unsigned clamped_difference(const Model *model)
{
    return fabs(model->latched[TEMPERATURE_DIFFERENCE]) > MOST_DIFFERENCE ? bit_of(TEMPERATURE_DIFFERENCE) : 0U;
}

/* True force of the estimate, over which the map is. */
static double true_estimate(const Model *model)
{
    return actual_preload(model->map, model->estimate, model->latched[TEMPERATURE_DIFFERENCE]);
}

static void estimate(Model *model, Estimate *result)
{
    preload_of_torque(model->map, model->latched, motion(model), torque_along_motion(model), result);
    model->estimate = result->preload;
    model->elasticity = result->torque > 0.0 ? result->slope * result->preload / result->torque : 0.0;
    model->clamped = clamped_inputs(result) | clamped_difference(model);
    if (!result->converged || true_estimate(model) < model->map->preload.lo
        || !(model->elasticity >= LEAST_ELASTICITY)) {
        model->clamped |= bit_of(TORQUE);
    }
}

/* Half-width of the interval of the torque [N.m], of the measured one and of the law */
static double uncertainty(const Model *model)
{
    const double *at = model->latched;

    return hypot(at[TORQUE_UNCERTAINTY], at[LAW_UNCERTAINTY] * torque_along_motion(model));
}

/* All outputs except those of the films. */
static void compute(Model *model)
{
    const bool rests = at_rest(model);
    const double *at = model->latched;
    double *out = model->value, slope, wide;
    Estimate result;

    if (model->solved) {
        return;
    }
    if (!rests || model->continuous) { /* event indicators depend on the torque at rest too */
        estimate(model, &result);
    }
    out[PRELOAD] = model->estimate;
    if (rests) {
        out[PRELOAD] = model->has_stored ? model->stored : at[INITIAL_PRELOAD];
        torque_of_preload(model->map, at, motion(model), lesser(out[PRELOAD], model->map->force.hi), &result);
        if (!model->continuous) {
            model->clamped = clamped_inputs(&result) | clamped_difference(model);
        }
    }
    slope = greater(result.slope, 0.0);
    out[TORQUE_SENSITIVITY] = slope;
    wide = uncertainty(model);
    out[PRELOAD_HALF_WIDTH] = wide < slope * model->map->force.hi ? wide / slope : model->map->force.hi;
    out[PRELOAD_LOW] = greater(out[PRELOAD] - out[PRELOAD_HALF_WIDTH], 0.0);
    out[PRELOAD_HIGH] = lesser(out[PRELOAD] + out[PRELOAD_HALF_WIDTH], model->map->force.hi);
    model->solved = true;
}

static void compute_lambda_ratio(Model *model)
{
    static const double constants[VARIABLE_COUNT] = {0.0};
    Dual preload = {0.0, 0.0};

    compute(model);
    preload.value = model->value[PRELOAD];
    model->value[LAMBDA_RATIO] = lambda_ratio_along(model->map, model->latched, constants, preload).value;
    model->films_known = true;
}

/* --- interface --------------------------------------------------------------------------------------------------- */

void model_reset(Model *model, const Map *map, const double start[START_COUNT], bool continuous)
{
    model_start(model, map, start, continuous);
    model_latch(model);
}

void model_set(Model *model, int reference, double value)
{
    model->value[reference] = value;
}

void model_latch(Model *model)
{
    memcpy(model->latched, model->value, sizeof model->latched);
    model->solved = model->films_known = false;
}

static bool determined(Model *model)
{
    compute(model);
    return model->clamped == 0U && !at_rest(model);
}

void model_step(Model *model, double step)
{
    model_latch(model);
    if (step > 0.0 && determined(model)) {
        model->stored = model->estimate;
        model->has_stored = true;
    }
}

double model_get(Model *model, int reference)
{
    const Variable *variable = &model_variables[reference];

    if (reference == IN_RANGE) {
        return model->began ? model->in_range && !model->rests : determined(model);
    }
    if (variable->causality == CAUSALITY_INDICATOR) {
        model_indicators(model);
    } else if (variable->causality == CAUSALITY_OUTPUT && variable->films) {
        if (!model->films_known) {
            compute_lambda_ratio(model);
        }
    } else if (variable->causality == CAUSALITY_OUTPUT) {
        compute(model);
    }
    return model->value[reference];
}

unsigned model_clamped(Model *model)
{
    compute(model);
    return model->clamped;
}

bool model_warns_of_step(Model *model, char *text, size_t size)
{
    (void)model, (void)text, (void)size;
    return false;
}

/* --- events ------------------------------------------------------------------------------------------------------ */

#define RANGE_HYSTERESIS 1e-6 /* relative: avoids repeated events at the limit of in_range */
#define SPEED_HYSTERESIS 1e-6 /* [rad/s] */

/* smallest distance of the latched point from the limits of in_range, negative outside; without that of the speed */
static double margin_of_estimate(const Model *model)
{
    const Map *map = model->map;
    const double *at = model->latched;
    const double temperature = at[TEMPERATURE];
    double margin;
    Estimate end;

    torque_of_preload(map, at, motion(model), map->force.hi, &end);
    margin = lesser((end.torque - torque_along_motion(model)) / greater(end.torque, SMOOTH),
                   (true_estimate(model) - map->preload.lo) / map->force.hi);
    margin = lesser(margin, model->elasticity - LEAST_ELASTICITY); /* 0 where the nuts separate */
    margin = lesser(margin, lesser(temperature - map->temperature.lo, map->temperature.hi - temperature)
                             / (map->temperature.hi - map->temperature.lo));
    margin = lesser(margin, (map->speed.hi - motion(model)) / map->speed.hi);
    margin = lesser(margin, 1.0 - fabs(at[TEMPERATURE_DIFFERENCE]) / MOST_DIFFERENCE);
    if (at[AXIAL_LOAD] != 0.0) {
        double force[2];
        nut_forces(map, true_estimate(model), at[AXIAL_LOAD], force);
        margin = lesser(margin, (map->force.hi - force[1]) / map->force.hi);
    }
    return margin;
}

void model_indicators(Model *model)
{
    const bool rests = at_rest(model);
    double *out = model->value;
    bool within;

    compute(model);
    within = model->began ? model->in_range : model->clamped == 0U;
    out[IN_RANGE_INDICATOR] =
        model->continuous ? margin_of_estimate(model) + (within ? RANGE_HYSTERESIS : -RANGE_HYSTERESIS) : 0.0;
    out[MOTION_INDICATOR] =
        fabs(model->latched[SPEED]) - model->latched[SPEED_MIN] + (rests ? -SPEED_HYSTERESIS : SPEED_HYSTERESIS);
}

void model_initial_event(Model *model)
{
    const bool rests = at_rest(model);

    compute(model);
    model->in_range = model->clamped == 0U;
    model->rests = rests;
    model->began = true;
    (void)model_event(model);
}

bool model_event(Model *model)
{
    const bool was_determined = model->in_range && !model->rests;
    const double *out = model->value;

    model_indicators(model);
    model->in_range = model->in_range ? !(out[IN_RANGE_INDICATOR] < 0.0) : out[IN_RANGE_INDICATOR] > 0.0;
    model->rests = model->rests ? !(out[MOTION_INDICATOR] > 0.0) : out[MOTION_INDICATOR] < 0.0;
    if (was_determined && (model->rests || !model->in_range)) { /* last instant at which the torque determined it */
        model->stored = model->estimate;
        model->has_stored = true;
    }
    model_latch(model);
    return false;
}

/* --- derivatives ------------------------------------------------------------------------------------------------- */

#define SLOPE_STEP 1e-4 /* relative change of the inputs in the difference of sensitivities */

static Dual motion_along(const Model *model, const double direction[VARIABLE_COUNT])
{
    const double speed = model->latched[SPEED];
    const bool moves = fabs(speed) > model->latched[SPEED_MIN];
    const Dual out = {motion(model), moves ? with_sign_of(direction[SPEED], speed) : direction[SPEED_MIN]};
    return out;
}

/* Preload of the outputs. By the torque it is the solution of torque(preload, inputs) = measured torque, so its
   derivative is that of an implicit function; held, at rest or where the torque does not determine it, it is constant.
   torque: derivative of that of the balls. */
static Dual preload_along(Model *model, const double direction[VARIABLE_COUNT], Dual speed, double torque)
{
    Dual out = {model->value[PRELOAD], 0.0};
    Estimate result;

    if (at_rest(model)) {
        out.slope = model->has_stored ? 0.0 : direction[INITIAL_PRELOAD];
        return out;
    }
    preload_of_torque(model->map, model->latched, speed.value, torque_along_motion(model), &result);
    if (result.converged && result.slope > 0.0) {
        out.slope = torque - torque_along(model->map, model->latched, direction, speed, out).slope;
        out.slope /= result.slope;
    }
    return out;
}

/* Derivative of the exact sensitivity, by a central difference along the direction. */
static double sensitivity_slope(const Model *model, const double direction[VARIABLE_COUNT], Dual speed,
                                Dual preload)
{
    double at[VARIABLE_COUNT], sensitivity[2], size = fabs(preload.slope) / greater(preload.value, 1.0), h;

    size += fabs(speed.slope) / greater(speed.value, 1e-3);
    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        if (i != TORQUE && i != SPEED && i != SPEED_MIN) {
            size += fabs(direction[i]) / greater(fabs(model->latched[i]), model_variables[i].nominal);
        }
    }
    if (!(size > 0.0)) {
        return 0.0;
    }
    h = SLOPE_STEP / size;
    for (int side = 0; side < 2; ++side) {
        const double step = side == 0 ? -h : h, highest = model->map->force.hi;
        Estimate end;
        for (int i = 0; i < VARIABLE_COUNT; ++i) {
            at[i] = model->latched[i] + step * direction[i];
        }
        torque_of_preload(model->map, at, speed.value + step * speed.slope,
                          lesser(preload.value + step * preload.slope, highest), &end);
        sensitivity[side] = greater(end.slope, 0.0);
    }
    return (sensitivity[1] - sensitivity[0]) / (2.0 * h);
}

void model_derivatives(Model *model, const double direction[VARIABLE_COUNT], double slopes[VARIABLE_COUNT])
{
    const double *at = model->latched;
    Dual speed, preload;
    double torque, steep, wide;

    memset(slopes, 0, VARIABLE_COUNT * sizeof *slopes);
    compute(model);
    speed = motion_along(model, direction);
    torque = with_sign_of(direction[TORQUE], at[SPEED]) - seal_along(at, direction, speed).slope;
    preload = preload_along(model, direction, speed, torque);
    steep = model->value[TORQUE_SENSITIVITY];
    slopes[PRELOAD] = preload.slope;
    slopes[TORQUE_SENSITIVITY] = steep > 0.0 ? sensitivity_slope(model, direction, speed, preload) : 0.0;
    wide = uncertainty(model);
    if (wide < steep * model->map->force.hi) {
        const double of_balls = torque_along_motion(model), law = at[LAW_UNCERTAINTY] * of_balls;
        const double change = at[TORQUE_UNCERTAINTY] * direction[TORQUE_UNCERTAINTY]
                              + law * (direction[LAW_UNCERTAINTY] * of_balls + at[LAW_UNCERTAINTY] * torque);
        slopes[PRELOAD_HALF_WIDTH] = (change / greater(wide, SMOOTH)
                                      - model->value[PRELOAD_HALF_WIDTH] * slopes[TORQUE_SENSITIVITY]) / steep;
    }
    if (model->value[PRELOAD_LOW] > 0.0) {
        slopes[PRELOAD_LOW] = slopes[PRELOAD] - slopes[PRELOAD_HALF_WIDTH];
    }
    if (model->value[PRELOAD_HIGH] < model->map->force.hi) {
        slopes[PRELOAD_HIGH] = slopes[PRELOAD] + slopes[PRELOAD_HALF_WIDTH];
    }
    slopes[LAMBDA_RATIO] = lambda_ratio_along(model->map, at, direction, preload).slope;
}
