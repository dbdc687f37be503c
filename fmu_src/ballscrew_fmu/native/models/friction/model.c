/* Life cycle, bristle, events and derivatives of a screw with friction: of BallScrewFriction and BallScrewTransmission.
   What they compute at a point is in point.h. */
#include "model.h"

#include <math.h>
#include <string.h>

#include "point.h"
#include "tangent.h"

/* --- from the latched point to outputs --- */

/* The bristle at the latched point. Its deflection, torque and power are stored in the model. */
static void compute_bristle(Model *model)
{
    const Bristle bristle = bristle_at(model->latched, coulomb_magnitude(friction_parts(model)), model->step,
                                       model->continuous, model->slip);

    model->value[PRESLIDING_DEFLECTION] = model->latched[PRESLIDING_DEFLECTION] = bristle.deflection;
    model->value[PRESLIDING_DEFLECTION_RATE] = bristle.rate;
    model->bristle_torque = bristle.torque;
    model->bristle_power = bristle.power;
}

static void compute_torque(Model *model)
{
    const double *at = model->latched;
    Bristle bristle;

    if (model->continuous) {
        model->value[PRESLIDING_DEFLECTION_RATE] = 0.0;
        if (at[PRESLIDING_STIFFNESS] > 0.0) {
            compute_bristle(model);
        }
    }
    bristle.deflection = model->latched[PRESLIDING_DEFLECTION];
    bristle.rate = model->value[PRESLIDING_DEFLECTION_RATE];
    bristle.torque = model->bristle_torque;
    bristle.power = model->bristle_power;
    torques_at_point(model, &bristle);
    model->torque_known = true;
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
    model->conditions_known = model->parts_known = model->torque_known = model->films_known = false;
    if (model->value[PRESLIDING_STIFFNESS] > 0.0 && !model->continuous) {
        compute_bristle(model);
    }
}

void model_step(Model *model, double step)
{
    memcpy(model->latched, model->value, sizeof model->latched);
    model->step = step;
    model->deflection_before = model->value[PRESLIDING_DEFLECTION];
    model->conditions_known = model->parts_known = model->torque_known = model->films_known = false;
    if (model->latched[PRESLIDING_STIFFNESS] > 0.0) {
        compute_bristle(model);
    } else if (step > 0.0) {
        /* a bristle that is switched off has no deflection */
        model->value[PRESLIDING_DEFLECTION] = model->latched[PRESLIDING_DEFLECTION] = 0.0;
        model->value[PRESLIDING_DEFLECTION_RATE] = 0.0;
        model->bristle_torque = model->bristle_power = 0.0;
    }
}

/* after the initial event of model exchange it changes at events only */
static bool in_range(Model *model)
{
    return model->continuous && model->events_began ? model->in_range : model_clamped(model) == 0U;
}

double model_get(Model *model, int reference)
{
    const Variable *variable = &model_variables[reference];

    if (reference == IN_RANGE) {
        return in_range(model);
    }
    if (variable->causality == CAUSALITY_INDICATOR) {
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
    return clamped_at_point(model);
}

bool model_possible(const Model *model)
{
    return model->step >= 0.0;
}

void model_clear_computed(Model *model)
{
    model->map = NULL;
    forget_point(model);
    model->conditions_known = model->parts_known = model->torque_known = model->films_known = false;
}

/* --- model exchange --- */

#define RANGE_HYSTERESIS 1e-6 /* of an axis: avoids repeated events at the limit of the map */
#define SPEED_HYSTERESIS 1e-6 /* [rad/s] */
#define SLIP_FROM 0.999       /* of the sliding deflection, which the bristle reaches after infinite travel only */

void model_indicators(Model *model)
{
    const double *at = model->latched;
    const double stiffness = at[PRESLIDING_STIFFNESS];
    double *out = model->value;

    locate(model);
    out[IN_RANGE_INDICATOR] = margin(model) + (in_range(model) ? RANGE_HYSTERESIS : -RANGE_HYSTERESIS);
    if (!(stiffness > 0.0)) {
        out[SLIP_INDICATOR] = 1.0;
    } else if (model->slip != 0) {
        out[SLIP_INDICATOR] = model->slip * at[SPEED] + SPEED_HYSTERESIS;
    } else {
        const double sliding = lesser(coulomb_magnitude(friction_parts(model)) / stiffness, TOO_LARGE);
        out[SLIP_INDICATOR] = SLIP_FROM * sliding - with_sign_of(at[PRESLIDING_DEFLECTION], at[SPEED]);
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
    const double *out = model->value;
    bool changed = false;

    model_indicators(model);
    if (model->in_range ? out[IN_RANGE_INDICATOR] < 0.0 : out[IN_RANGE_INDICATOR] > 0.0) {
        model->in_range = !model->in_range;
    }
    if (!(at[PRESLIDING_STIFFNESS] > 0.0)) {
        model->slip = 0;
    } else if (model->slip == 0) {
        if (out[SLIP_INDICATOR] <= 0.0 && at[SPEED] != 0.0) {
            model->slip = at[SPEED] > 0.0 ? 1 : -1;
        }
    } else if (out[SLIP_INDICATOR] < 0.0) {
        /* Never more than the bristle had when it began to slip: a Coulomb torque that has risen since then would give
           it energy that no motion has put in. */
        const double sliding = coulomb_magnitude(friction_parts(model)) / at[PRESLIDING_STIFFNESS];
        const double wound = fabs(at[PRESLIDING_DEFLECTION]);
        model->value[PRESLIDING_DEFLECTION] = model->slip * (wound < SLIP_FROM * sliding ? wound / SLIP_FROM : sliding);
        model->slip = 0;
        changed = true;
    }
    model_latch(model);
    return changed;
}

/* --- derivatives --- */

/* A step is a function of the deflection at its start. */
static void derive(const Model *model, const double direction[VARIABLE_COUNT], double values[VARIABLE_COUNT],
                   double slopes[VARIABLE_COUNT])
{
    double at[VARIABLE_COUNT];

    memcpy(at, model->latched, sizeof at);
    at[PRESLIDING_DEFLECTION] = model->deflection_before;
    outputs_along(model->map, at, direction, model->step, model->continuous, model->slip, values, slopes);
}

void model_directional_derivative(Model *model, const int unknowns[], size_t unknown_count, const int knowns[],
                                  size_t known_count, const double seed[], double sensitivity[])
{
    double direction[VARIABLE_COUNT] = {0.0}, values[VARIABLE_COUNT], slopes[VARIABLE_COUNT];

    for (size_t k = 0; k < known_count; ++k) {
        direction[knowns[k]] += seed[k];
    }
    derive(model, direction, values, slopes);
    for (size_t i = 0; i < unknown_count; ++i) {
        sensitivity[i] = slopes[unknowns[i]];
    }
}

void model_values_with_derivatives(const Model *model, double values[VARIABLE_COUNT])
{
    const double direction[VARIABLE_COUNT] = {0.0};
    double slopes[VARIABLE_COUNT];

    derive(model, direction, values, slopes);
}
