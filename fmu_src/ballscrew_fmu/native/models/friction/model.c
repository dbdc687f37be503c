/* Life cycle, elasto-slip elements, events and derivatives of a screw with friction: of BallScrewFriction and
   BallScrewTransmission. What each computes at a point is in its point.h. */
#include "dual_laws.h"
#include "screw_model.h"
#include "text.h"

/* --- from the latched point to outputs --- */

static bool presliding(const Model *model)
{
    return model->latched[PRESLIDING] != 0.0;
}

INTERNAL const Point *locate(Model *model)
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

static StepContext context_of(const Model *model)
{
    const StepContext context = {model->step, model->continuous,
                           model->continuous && model->began ? model->stiffness
                           : model->follows                  ? 0.0
                                                             : model->stiffness_here,
                           !model->began && model->from_side, model->slips, model->slip,
                           model->continuous ? model->event_heat : model->heat};

    return context;
}

/* The elements become those of the latched point. */
static void store_elements(Model *model)
{
    const Presliding *now = &model->elements;

    memcpy(&model->value[PRESLIDING_ELEMENT_1], now->element, sizeof now->element);
    memcpy(&model->latched[PRESLIDING_ELEMENT_1], now->element, sizeof now->element);
    memcpy(&model->value[PRESLIDING_ELEMENT_1_RATE], now->rate, sizeof now->rate);
}

/* The elements at the latched point. */
static void compute_presliding(Model *model)
{
    const double coulomb = coulomb_magnitude(friction_parts(model)), present = present_stiffness(model);
    StepContext context;

    /* in model exchange it changes at events */
    model->follows = !model->began || (!model->continuous && stiffness_follows(model->free, model->stiffness, present));
    model->stiffness_here = model->follows ? present : model->stiffness;
    context = context_of(model);
    presliding_at(model->latched, coulomb, model->stiffness_here, &context, &model->elements);
    if (context.from_side) {
        memcpy(model->initial, model->elements.element, sizeof model->initial);
    }
    store_elements(model);
    if (!model->began || model->step > 0.0) {
        model->stiffness = model->stiffness_here;
        model->free = elements_free(model->elements.element, presliding_level(coulomb, model->stiffness, 0.0).unit);
    }
}

INTERNAL void compute_outputs(Model *model)
{
    const StepContext context = context_of(model);

    if (model->continuous) {
        if (presliding(model)) {
            compute_presliding(model);
        } else {
            memset(&model->value[PRESLIDING_ELEMENT_1_RATE], 0, ELEMENTS * sizeof *model->value);
        }
    }
    point_outputs(&model->point, friction_parts(model), &model->elements, model->latched, model->step, model->value);
    heat_output(&context, model->value);
    model->outputs_known = true;
}

/* --- interface --- */

static void latch(Model *model, double step)
{
    if (!model->continuous && model->step > 0.0) {
        if (!model->outputs_known) {
            compute_outputs(model);
        }
        model->heat = model->value[HEAT];
    }
    memcpy(model->latched, model->value, sizeof model->latched);
    model->step = step;
    memcpy(model->before, &model->value[PRESLIDING_ELEMENT_1], sizeof model->before);
    memcpy(model->elements.element, model->before, sizeof model->before);
    model->from_side = !model->began && memcmp(model->before, model->initial, sizeof model->before) == 0;
    model->located = model->parts_known = model->outputs_known = model->films_known = false;
    if (!presliding(model)) {
        model->elements.torque = model->elements.power = model->elements.supply = 0.0;
    }
}

void model_latch(Model *model)
{
    latch(model, 0.0);
    if (presliding(model) && !model->continuous) {
        compute_presliding(model);
    }
}

void model_step(Model *model, double step)
{
    latch(model, step);
    model->began = true;
    if (presliding(model)) {
        compute_presliding(model);
    } else if (step > 0.0) {
        presliding_off(model->latched, step, &model->elements);
        store_elements(model);
        model->free = true;
    }
}

#define ROUNDING_FRACTION 1e-9 /* of the Coulomb torque */

bool model_warns_of_step(Model *model, char *text, size_t size)
{
    const double *at = model->latched, stiffness = model->stiffness_here, damping = damping_at(at, stiffness);
    char numbers[4][32];

    if (!presliding(model) || at[SPEED] == 0.0 || !(model->step * stiffness >= damping)
        || !(fabs(model->elements.torque)
             < (1.0 - ROUNDING_FRACTION) * coulomb_magnitude(friction_parts(model)))) {
        return false;
    }
    (void)snprintf(text, size,
                   "step = %s s; an inertia coupled with the values of the last step comes to rest for steps below "
                   "damping over presliding stiffness only, %s N.m.s/rad over %s N.m/rad = %s s (logged once)",
                   number_text(model->step, numbers[0]), number_text(damping, numbers[1]),
                   number_text(stiffness, numbers[2]), number_text(damping / stiffness, numbers[3]));
    return true;
}

unsigned model_clamped(Model *model)
{
    return point_clamped(model->map, locate(model), model->latched);
}

/* --- events --- */

static double present_limit(Model *model)
{
    return presliding_level(coulomb_magnitude(friction_parts(model)), model->stiffness, 0.0).unit;
}

void model_indicators(Model *model)
{
    const double *at = model->latched;
    const bool modes = presliding(model) && model->continuous;
    double *out = model->value, unit;

    out[IN_RANGE_INDICATOR] = range_indicator(model);
    if (modes && !model->began) {
        compute_presliding(model);
    }
    out[STIFFNESS_INDICATOR] = modes ? distance_to_stiffness(model->stiffness, present_stiffness(model)) : 1.0;
    unit = modes ? present_limit(model) : 0.0;
    for (int i = 0; i < ELEMENTS; ++i) {
        const double element = at[PRESLIDING_ELEMENT_1 + i];
        const int slip = slip_of_element(model->slips, model->slip, i);
        const bool decides = modes && (slip != 0 || unit > 0.0); /* without a limit, an element that is loaded slips */

        out[SLIP_INDICATOR_1 + i] = decides ? slip_indicator(element, at[SPEED], (2.0 * i + 1.0) * unit, slip)
                                    : modes && element != 0.0 ? -1.0
                                                              : 1.0;
    }
}

/* Elements of model exchange after an event at the latched point, whose indicators are known. True if one
   changes. */
static bool elements_after_event(Model *model)
{
    const double speed = model->latched[SPEED], unit = present_limit(model);
    const int direction = speed > 0.0 ? 1 : speed < 0.0 ? -1 : model->slip;
    unsigned slips = 0U;
    bool changed = false;

    for (int i = 0; i < ELEMENTS; ++i) {
        double *element = &model->value[PRESLIDING_ELEMENT_1 + i];
        const double limit = (2.0 * i + 1.0) * unit, indicator = model->value[SLIP_INDICATOR_1 + i];
        const bool slides = (model->slips >> i & 1U) != 0U && direction == model->slip;
        const bool begins = speed != 0.0 && direction * *element > 0.0 && indicator <= 0.0;

        if (slides ? !(indicator < 0.0) : begins) {
            slips |= 1U << i;
        } else if (fabs(*element) > limit) {
            *element = *element > 0.0 ? limit : -limit;
            changed = true;
        }
    }
    changed = changed || slips != model->slips;
    model->slips = slips;
    model->slip = slips != 0U ? direction : 0;
    return changed;
}

void model_initial_event(Model *model)
{
    model->in_range = model_clamped(model) == 0U;
    if (presliding(model)) {
        compute_presliding(model);
    }
    model->moved = model->initial[ELEMENTS - 1] != 0.0;
    model->began = true;
    model_latch(model);
    model->moved = model_event(model) || model->moved;
}

bool model_event(Model *model)
{
    double *elements = &model->value[PRESLIDING_ELEMENT_1];
    double stored;
    bool changed = model->moved;

    model_indicators(model);
    stored = energy_of_elements(elements);
    model->in_range = range_after_event(model);
    model->moved = false;
    if (presliding(model)) {
        const double present = present_stiffness(model);

        if (stiffness_follows(model->free || model->slips == (1U << ELEMENTS) - 1U, model->stiffness, present)) {
            model->stiffness = present;
        }
        changed = elements_after_event(model) || changed;
        model->free = elements_free(elements, present_limit(model));
    } else { /* those that are switched off are relaxed */
        changed = changed || stored > 0.0;
        memset(elements, 0, ELEMENTS * sizeof *elements);
        model->free = true;
        model->slips = 0U;
        model->slip = 0;
    }
    model->event_heat += stored - energy_of_elements(elements);
    model_latch(model);
    return changed;
}

/* --- derivatives --- */

/* A step is a function of the elements at its start. */
void model_derivatives(Model *model, const double direction[VARIABLE_COUNT], double slopes[VARIABLE_COUNT])
{
    const StepContext context = context_of(model);
    double at[VARIABLE_COUNT];

    memcpy(at, model->latched, sizeof at);
    memcpy(&at[PRESLIDING_ELEMENT_1], model->before, sizeof model->before);
    slopes_along(model->map, at, direction, &context, slopes);
}
