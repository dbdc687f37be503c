/* Life cycle, bristle, events and derivatives of a screw with friction: of BallScrewFriction and BallScrewTransmission.
   What they compute at a point is in friction_point.h and transmission_point.h. */
#include "model.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "slip_event.h"
#include "tangent.h"

/* --- from the latched point to outputs --- */

static bool presliding(const Model *model)
{
    return model->latched[PRESLIDING] != 0.0;
}

/* Loads and conditions of the latched point. */
static inline const Point *locate(Model *model)
{
    if (!model->located) {
        point_locate(model->map, model->latched, model->step, &model->point);
        model->located = true;
    }
    return &model->point;
}

/* Magnitudes of the friction parts at the latched point. */
static inline const Parts *friction_parts(Model *model)
{
    if (!model->parts_known) {
        const Friction friction = friction_of(model->latched);
        (void)locate(model);
        nut_parts(model->map, &model->point.loads, &model->point.conditions, NULL, &friction, &model->parts);
        model->parts_known = true;
    }
    return &model->parts;
}

static inline double present_stiffness(Model *model)
{
    const Friction friction = friction_of(model->latched);

    (void)locate(model);
    return stiffness_at(model->latched, model->map, &model->point.loads, &friction);
}

static inline void compute_films(Model *model)
{
    const Point *point = locate(model);
    Films films;

    nut_films(model->map, &point->loads, &point->conditions, &films);
    film_outputs(&films, model->latched, model->value);
    model->films_known = true;
}

static inline double range_margin(Model *model)
{
    return point_margin(model->map, locate(model), model->latched);
}

static Moment moment_of(const Model *model)
{
    const Moment moment = {model->step, model->continuous, model->slip, model->stiffness_before,
                           model->began ? RUNNING : model->from_side ? FROM_SIDE : GIVEN,
                           model->continuous ? model->event_heat : model->heat};

    return moment;
}

static void store_bristle(Model *model, Bristle bristle)
{
    model->value[PRESLIDING_DEFLECTION] = model->latched[PRESLIDING_DEFLECTION] = bristle.deflection;
    model->value[PRESLIDING_DEFLECTION_RATE] = bristle.rate;
    model->bristle_torque = bristle.torque;
    model->bristle_power = bristle.power;
    model->bristle_supply = bristle.supply;
}

/* The bristle at the latched point. Its deflection, torque and power are stored in the model. */
static void compute_bristle(Model *model)
{
    const Moment moment = moment_of(model);
    const double coulomb = coulomb_magnitude(friction_parts(model)), stiffness = present_stiffness(model);
    const Bristle bristle = bristle_at(model->latched, coulomb, stiffness, &moment);

    if (!(model->continuous && model->began)) {
        model->stiffness = stiffness;
    }
    model->initial_deflection = moment.start == FROM_SIDE ? bristle.deflection : model->initial_deflection;
    store_bristle(model, bristle);
}

static void compute_torque(Model *model)
{
    const Moment moment = moment_of(model);
    Bristle bristle;

    if (model->continuous) {
        model->value[PRESLIDING_DEFLECTION_RATE] = 0.0;
        if (presliding(model)) {
            compute_bristle(model);
        }
    }
    bristle.deflection = model->latched[PRESLIDING_DEFLECTION];
    bristle.rate = model->value[PRESLIDING_DEFLECTION_RATE];
    bristle.torque = model->bristle_torque;
    bristle.power = model->bristle_power;
    bristle.supply = model->bristle_supply;
    point_outputs(&model->point, friction_parts(model), &bristle, model->stiffness, model->latched, model->step,
                  model->value);
    heat_output(&moment, model->value);
    model->value[POWER_LOSS] += model->power_of_parts;
    model->torque_known = true;
}

/* --- interface --- */

void model_reset(Model *model, const Map *map, bool continuous)
{
    memset(model, 0, sizeof *model);
    model->map = map;
    model->continuous = model->events = continuous;
    model->in_range = true;
    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        model->value[i] = model_variables[i].start;
    }
    model_latch(model);
}

extern bool model_accepts(int reference, double value);
extern void model_set(Model *model, int reference, double value);

static void latch(Model *model, double step)
{
    if (!model->continuous && model->step > 0.0) {
        model->heat = model_get(model, HEAT);
    }
    memcpy(model->latched, model->value, sizeof model->latched);
    model->step = step;
    model->power_of_parts = 0.0;
    model->deflection_before = model->value[PRESLIDING_DEFLECTION];
    model->stiffness_before = model->stiffness;
    model->from_side = model->deflection_before == model->initial_deflection;
    model->located = model->parts_known = model->torque_known = model->films_known = false;
    if (!presliding(model)) {
        model->bristle_torque = model->bristle_power = model->bristle_supply = 0.0;
    }
}

/* Whether the bristle has no stiffness at the latched loads and still that of the last ones. */
static bool is_held(Model *model)
{
    return model->began && !model->continuous && !(present_stiffness(model) > 0.0);
}

void model_latch(Model *model)
{
    latch(model, 0.0);
    if (!presliding(model) || model->continuous) {
        return;
    }
    if (is_held(model)) {
        /* the next step makes heat of what it stored */
        model->bristle_torque = model->bristle_power = model->bristle_supply = 0.0;
    } else {
        compute_bristle(model);
    }
}

void model_step(Model *model, double step)
{
    latch(model, step);
    model->began = true;
    if (presliding(model)) {
        compute_bristle(model);
    } else if (step > 0.0) {
        const Moment moment = moment_of(model);
        store_bristle(model, bristle_unwound(model->deflection_before, &moment));
        model->stiffness = model->initial_deflection = 0.0; /* nothing is left of it */
    }
    if (step > 0.0) {
        model->bristle_power += model->event_heat / step;
        model->event_heat = 0.0;
    }
}

bool model_step_too_long(const Model *model, double step, double *stiffness, double *damping)
{
    const double *at = model->latched;

    *stiffness = model->stiffness;
    *damping = damping_at(at, model->stiffness);
    return presliding(model) && at[SPEED] != 0.0 && step * *stiffness >= *damping
           && fabs(model->bristle_torque) < SLIDING_FROM * coulomb_magnitude(&model->parts);
}

/* with events it changes, after the initial one, at events only */
static bool in_range(Model *model)
{
    return model->events && model->began ? model->in_range : model_clamped(model) == 0U;
}

double model_get(Model *model, int reference)
{
    const Variable *variable = &model_variables[reference];

    if (reference == IN_RANGE) {
        return in_range(model);
    }
    if (reference == RANGE_MARGIN) {
        model->value[RANGE_MARGIN] = range_margin(model);
    } else if (variable->causality == CAUSALITY_INDICATOR) {
        model_indicators(model);
    } else if (variable->causality == CAUSALITY_OUTPUT && variable->needs == NEEDS_FILMS) {
        if (!model->films_known) {
            compute_films(model);
        }
    } else if (variable->causality == CAUSALITY_OUTPUT
               || (variable->causality == CAUSALITY_RATE && model->continuous)) {
        if (!model->torque_known) {
            compute_torque(model);
        }
    }
    return model->value[reference];
}

unsigned model_clamped(Model *model)
{
    return point_clamped(model->map, locate(model), model->latched);
}

bool model_possible(const Model *model)
{
    /* comparisons that NaN and infinity fail */
    return model->step >= 0.0 && model->stiffness >= 0.0 && model->stiffness_before >= 0.0
           && (model->continuous || model->event_heat >= 0.0) && model->heat >= 0.0
           && model->stiffness + model->stiffness_before < HUGE_VAL
           && fabs(model->deflection_before) + fabs(model->initial_deflection) + fabs(model->bristle_torque)
                      + fabs(model->bristle_power) + fabs(model->bristle_supply) + fabs(model->power_of_parts)
                      + fabs(model->event_heat) + model->heat
                  < HUGE_VAL;
}

void model_clear_computed(Model *model)
{
    model->map = NULL;
    memset(&model->point, 0, sizeof model->point);
    memset(&model->parts, 0, sizeof model->parts);
    model->located = model->parts_known = model->torque_known = model->films_known = false;
}

/* --- events --- */

#define RANGE_HYSTERESIS 1e-6 /* of an axis: avoids repeated events at the limit of the map */
#define SPEED_HYSTERESIS 1e-6 /* [rad/s] */
#define STIFFNESS_CHANGE 0.5 /* of the stiffness: an event refers the state to the present one, at the same energy */

/* [N.m/rad] of the bristle at the latched point; that of the state of model exchange is model->stiffness */
static double stiffness_now(Model *model)
{
    return model->continuous ? present_stiffness(model) : model->stiffness;
}

/* [rad] of the bristle; 0 without a Coulomb torque */
static double sliding_deflection(Model *model)
{
    const double stiffness = stiffness_now(model);

    return stiffness > 0.0 ? lesser(coulomb_magnitude(friction_parts(model)) / stiffness, TOO_LARGE) : 0.0;
}

static double distance_to_slip(Model *model)
{
    const double *at = model->latched;
    const double sliding = sliding_deflection(model), stiffness = stiffness_now(model);

    if (!(model->stiffness > 0.0 && stiffness > 0.0) || (!model->continuous && !(sliding > 0.0)) || is_held(model)) {
        return 1.0;
    }
    return SLIDING_FROM * sliding
           - with_sign_of(bristle_at_stiffness(at[PRESLIDING_DEFLECTION], model->stiffness, stiffness), at[SPEED]);
}

/* [rad] scaled like the distance to slip. Model exchange: in co-simulation a step adapts the bristle. */
static double distance_to_new_stiffness(Model *model)
{
    const double now = present_stiffness(model), held = model->stiffness;
    const double allowed = STIFFNESS_CHANGE * greater(now, held) + LEAST_STIFFNESS;

    return (1.0 - fabs(now - held) / allowed) * (held > 0.0 && now > 0.0 ? sliding_deflection(model) : 1.0);
}

void model_indicators(Model *model)
{
    const double *at = model->latched;
    double *out = model->value;

    if (!model->began) {
        model->stiffness = present_stiffness(model);
    }
    out[IN_RANGE_INDICATOR] = range_margin(model) + (in_range(model) ? RANGE_HYSTERESIS : -RANGE_HYSTERESIS);
    if (!presliding(model)) {
        out[SLIP_INDICATOR] = 1.0;
    } else if (model->slip != 0) {
        out[SLIP_INDICATOR] = model->slip * at[SPEED] + SPEED_HYSTERESIS;
    } else {
        out[SLIP_INDICATOR] = distance_to_slip(model);
        if (model->continuous) {
            out[SLIP_INDICATOR] = lesser(out[SLIP_INDICATOR], distance_to_new_stiffness(model));
        }
    }
}

/* Modes that an event at the latched point leads to. */
static void modes_after_event(Model *model, bool *range, int *slip)
{
    const double *at = model->latched, *out = model->value;

    model_indicators(model);
    *range = model->in_range ? !(out[IN_RANGE_INDICATOR] < 0.0) : out[IN_RANGE_INDICATOR] > 0.0;
    *slip = model->slip;
    if (!presliding(model)) {
        *slip = 0;
    } else if (model->slip == 0) {
        if (out[SLIP_INDICATOR] <= 0.0 && at[SPEED] != 0.0) {
            *slip = at[SPEED] > 0.0 ? 1 : -1;
        }
    } else if (out[SLIP_INDICATOR] < 0.0) {
        *slip = 0;
    }
}

/* Adapts the bristle to the present stiffness. True if its deflection changes. */
static bool adapt_stiffness(Model *model)
{
    const double stiffness = present_stiffness(model), before = model->value[PRESLIDING_DEFLECTION];

    model->value[PRESLIDING_DEFLECTION] = bristle_at_stiffness(before, model->stiffness, stiffness);
    model->stiffness = stiffness;
    return model->value[PRESLIDING_DEFLECTION] != before;
}

void model_initial_event(Model *model)
{
    bool moved;

    model->slip = 0;
    model->in_range = model_clamped(model) == 0U;
    if (presliding(model)) {
        compute_bristle(model);
    }
    moved = model->initial_deflection != 0.0;
    model->began = true;
    model_latch(model);
    model->moved = model_event(model) || moved;
}

static double bristle_energy(const Model *model)
{
    const double deflection = model->value[PRESLIDING_DEFLECTION];

    return 0.5 * model->stiffness * deflection * deflection;
}

bool model_event(Model *model)
{
    const double stored = bristle_energy(model);
    bool changed = model->moved;
    double lost;
    int slip;

    model->moved = false;
    if (presliding(model) && model->continuous && adapt_stiffness(model)) {
        changed = true;
        model_latch(model);
    }
    modes_after_event(model, &model->in_range, &slip);
    if (!presliding(model) && model->continuous) {
        /* a bristle that is switched off is unwound; in co-simulation by the next step, which makes heat of it */
        changed = changed || model->value[PRESLIDING_DEFLECTION] != 0.0;
        model->value[PRESLIDING_DEFLECTION] = 0.0;
    } else if (presliding(model) && model->slip != 0 && slip == 0) {
        /* Never more than the bristle had when it began to slip: more would be energy that no motion has put in, and
           small motions to and fro would drive the shaft. */
        const double sliding = sliding_deflection(model), wound = fabs(model->latched[PRESLIDING_DEFLECTION]);
        model->value[PRESLIDING_DEFLECTION] = model->slip * lesser(wound, sliding);
        changed = true;
    } else if (model->slip == 0 && fabs(model->value[PRESLIDING_DEFLECTION]) > sliding_deflection(model) && slip != 0) {
        model->value[PRESLIDING_DEFLECTION] = slip * sliding_deflection(model); /* the Coulomb torque has decreased */
        changed = true;
    }
    lost = stored - bristle_energy(model);
    model->event_heat += model->continuous ? lost : greater(lost, 0.0);
    model->slip = slip;
    model_latch(model);
    return changed;
}

#define AT_END (4.0 * DBL_EPSILON) /* of a step: an event so close to its end is at its end */

/* [s] to the start of slip at the latched point, infinite: there is none; deflection there */
static double time_to_slip(Model *model, double *slips_at)
{
    const double *at = model->latched;
    double sliding;

    if (model->slip != 0 || !presliding(model) || at[SPEED] == 0.0 || is_held(model)) {
        return HUGE_VAL;
    }
    sliding = sliding_deflection(model);
    if (!(sliding > 0.0)) {
        return HUGE_VAL;
    }
    *slips_at = with_sign_of(SLIDING_FROM * sliding, at[SPEED]);
    return travel_to_slip(with_sign_of(at[PRESLIDING_DEFLECTION], at[SPEED]), sliding) / fabs(at[SPEED]);
}

double model_step_to_event(Model *model, double step, bool *due)
{
    double slips_at = 0.0, time;
    bool range;
    int slip;

    model_latch(model);
    modes_after_event(model, &range, &slip);
    *due = range != model->in_range || slip != model->slip;
    if (*due) {
        return 0.0;
    }
    time = time_to_slip(model, &slips_at);
    *due = time <= (1.0 + AT_END) * step;
    step = lesser(step, time);
    model_step(model, step);
    if (*due) { /* exactly there, so that rounding cannot put the event off */
        model->value[PRESLIDING_DEFLECTION] = model->latched[PRESLIDING_DEFLECTION] = slips_at;
    }
    return step;
}

double model_power(Model *model)
{
    return model_get(model, POWER_LOSS);
}

void model_set_mean_power(Model *model, double mean)
{
    model->power_of_parts += mean - model_get(model, POWER_LOSS);
    model->torque_known = false;
}

/* --- derivatives --- */

/* A step is a function of the deflection at its start. */
void model_derivatives(Model *model, const double direction[VARIABLE_COUNT], double slopes[VARIABLE_COUNT])
{
    const Moment moment = moment_of(model);
    double at[VARIABLE_COUNT];

    memcpy(at, model->latched, sizeof at);
    at[PRESLIDING_DEFLECTION] = model->deflection_before;
    slopes_along(model->map, at, direction, &moment, slopes);
}
