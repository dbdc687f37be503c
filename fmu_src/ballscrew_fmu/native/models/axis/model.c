/* Life cycle, outputs, events and derivatives of BallScrewAxis. */
#include "axis_part.h"
#include "dual_laws.h"
#include "screw_model.h"
#include "text.h"

/* --- from the latched point to outputs --- */

/* [N.m/rad] of the elements; 0 at the start: that of the loads */
static double fixed_stiffness(const Model *model)
{
    const double of_one = model->last.level.elements.root;

    return model->began ? ELEMENTS * of_one * of_one : 0.0;
}

INTERNAL const Point *locate(Model *model)
{
    if (!model->located) {
        point_locate(model->map, model->latched, fixed_stiffness(model), &model->point);
        model->located = true;
    }
    return &model->point;
}

static StepContext context_of(const Model *model)
{
    const Advance *last = &model->last;
    const StepContext context = {last->slips, last->slip, fixed_stiffness(model),
                           {last->slider_slip[SHAFT], last->slider_slip[TABLE]}, model->heat, model->supplied};

    return context;
}

static double heat_of_step(const Model *model)
{
    double sum = 0.0;

    for (int i = 0; i < PLACES; ++i) {
        sum += model->last.heat[i];
    }
    return sum;
}

INTERNAL void compute_outputs(Model *model)
{
    const StepContext context = context_of(model);

    axis_outputs(locate(model), model->latched, &context, model->value);
    if (model->step > 0.0) {
        model->value[POWER_LOSS] = heat_of_step(model) / model->step;
        for (int i = 0; i < PLACES; ++i) {
            model->value[POWER_NUT + i] = model->last.heat[i] / model->step;
        }
    }
    model->outputs_known = true;
}

/* --- interface --- */

/* States at the start: at rest at initial_position, without deflection, elements by presliding_side. */
static void initial_states(Model *model)
{
    double *at = model->value;
    const double ratio = screw_ratio(at), most = 0.01 * TOO_LARGE;

    at[ANGLE] = fabs(ratio) > 0.0 ? clamped(at[INITIAL_POSITION] / ratio, -most, most) : 0.0;
    at[POSITION] = fabs(at[ANGLE]) < most && fabs(ratio) > 0.0 ? ratio * at[ANGLE] : at[INITIAL_POSITION];
    at[SPEED] = at[VELOCITY] = at[SCREW_DISPLACEMENT] = at[SCREW_VELOCITY] = at[SHAFT_ELEMENT] = at[GUIDE_ELEMENT] = 0.0;
    for (int i = 0; i < ELEMENTS; ++i) {
        at[PRESLIDING_ELEMENT_1 + i] = 0.0;
    }
    point_locate(model->map, at, 0.0, &model->point);
    initial_elements(at[PRESLIDING_SIDE], 0.0, &model->point.level, &at[PRESLIDING_ELEMENT_1]);
}

static void latch(Model *model, double step)
{
    memcpy(model->latched, model->value, sizeof model->latched);
    model->step = step;
    model->located = model->outputs_known = model->films_known = false;
}

void model_latch(Model *model)
{
    if (!model->began) {
        initial_states(model);
    }
    latch(model, 0.0);
}

/* Where places and speeds of the motion are in the table. */
static const int places[FREEDOMS] = {ANGLE, POSITION, SCREW_DISPLACEMENT};
static const int speeds[FREEDOMS] = {SPEED, VELOCITY, SCREW_VELOCITY};
static const int slider_indicators[SLIDERS] = {SHAFT_SLIP_INDICATOR, GUIDE_SLIP_INDICATOR};

void model_step(Model *model, double step)
{
    Advance *last = &model->last;
    double *value = model->value;

    if (!model->began || !(step > 0.0)) { /* before the first one, inputs may have changed the friction */
        model_latch(model);
        model->began = true;
    }
    if (!(step > 0.0)) {
        return;
    }
    for (int i = 0; i < FREEDOMS; ++i) {
        last->motion.place[i] = value[places[i]];
        last->motion.speed[i] = value[speeds[i]];
    }
    memcpy(last->motion.element, &value[PRESLIDING_ELEMENT_1], sizeof last->motion.element);
    for (int i = 0; i < SLIDERS; ++i) {
        last->motion.slider[i] = value[slider_states[i]];
    }
    model->cut = !axis_advance(model->map, value, step, last);
    for (int i = 0; i < FREEDOMS; ++i) {
        value[places[i]] = last->motion.place[i];
        value[speeds[i]] = last->motion.speed[i];
    }
    memcpy(&value[PRESLIDING_ELEMENT_1], last->motion.element, sizeof last->motion.element);
    for (int i = 0; i < SLIDERS; ++i) {
        value[slider_states[i]] = last->motion.slider[i];
    }
    model->heat += heat_of_step(model);
    model->supplied += last->supplied;
    latch(model, step);
}

bool model_warns_of_step(Model *model, char *text, size_t size)
{
    char number[32];

    (void)snprintf(text, size,
                   "step = %s s; its motion is too fast for error_bound, the error of the step is larger: take a shorter "
                   "step, a larger bound or check inertias, masses and stiffness (logged once)",
                   number_text(model->step, number));
    return model->cut;
}

unsigned model_clamped(Model *model)
{
    const Point *point = locate(model);

    return contacts_clamped(model->map, &point->contacts, &point->conditions, point->mechanics.preload, model->latched);
}

/* --- events --- */

/* Without a limit, an element that sticks has no event. */
static double indicator_of(double element, double speed, double limit, int slip)
{
    return slip != 0 || limit > 0.0 ? slip_indicator(element, speed, limit, slip) : 1.0;
}

/* [N.m/rad] of the loads */
static double present_stiffness(Model *model)
{
    const Friction friction = friction_of(model->latched);
    const Parts none = {0};
    Loads loads = locate(model)->loads;
    const PreslidingLevel level = level_of(model->map, model->latched, 0.0, &loads, &friction, &none);

    return ELEMENTS * level.root * level.root;
}

static double limit_of(Model *model, int element)
{
    return (2.0 * element + 1.0) * locate(model)->level.unit;
}

void model_indicators(Model *model)
{
    const double *at = model->latched;
    double *out = model->value;

    out[IN_RANGE_INDICATOR] = range_indicator(model);
    out[STIFFNESS_INDICATOR] = model->began && model->continuous
                                   ? distance_to_stiffness(fixed_stiffness(model), present_stiffness(model))
                                   : 1.0;
    for (int i = 0; i < ELEMENTS; ++i) {
        out[SLIP_INDICATOR_1 + i] =
            indicator_of(at[PRESLIDING_ELEMENT_1 + i], at[SPEED], limit_of(model, i), slip_of_element(model->last.slips, model->last.slip, i));
    }
    for (int i = 0; i < SLIDERS; ++i) {
        out[slider_indicators[i]] = indicator_of(at[slider_states[i]], at[speeds[i]], model->point.sliding.limit[i],
                                                 model->last.slider_slip[i]);
    }
}

static double energy_of_friction(const double value[])
{
    double sum = 0.0;

    for (int i = 0; i < SLIDERS; ++i) {
        sum += 0.5 * value[slider_states[i]] * value[slider_states[i]];
    }
    return sum + energy_of_elements(&value[PRESLIDING_ELEMENT_1]);
}

/* Direction of slip of an element after an event, and its state. */
static int slip_after_event(double *element, double speed, double limit, int slip)
{
    const double indicator = indicator_of(*element, speed, limit, slip);

    if (slip != 0) {
        if (!(indicator < 0.0)) {
            return slip;
        }
        *element = slip * lesser(fabs(*element), limit); /* no more than it had: that would be energy from nowhere */
        return 0;
    }
    if (!(indicator <= 0.0)) {
        return 0;
    }
    if (*element * speed > 0.0) {
        return speed > 0.0 ? 1 : -1;
    }
    *element = element_within(*element, limit);
    return 0;
}

bool model_event(Model *model)
{
    double *value = model->value;
    const double *at = model->latched;
    Advance *last = &model->last;
    double present, stored, lost;
    unsigned slips = 0U;
    int slip = 0;

    model_indicators(model);
    model->in_range = range_after_event(model);
    present = present_stiffness(model);
    if (stiffness_follows(last->slips == (1U << ELEMENTS) - 1U
                              || elements_free(&value[PRESLIDING_ELEMENT_1], locate(model)->level.unit),
                          fixed_stiffness(model), present)) {
        last->level.elements.root = root(present / ELEMENTS);
        model->located = false;
    }
    stored = energy_of_friction(value);
    for (int i = 0; i < ELEMENTS; ++i) {
        const int one = slip_after_event(&value[PRESLIDING_ELEMENT_1 + i], at[SPEED], limit_of(model, i),
                                         slip_of_element(last->slips, last->slip, i));
        slips |= one != 0 ? 1U << i : 0U;
        slip = one != 0 ? one : slip;
    }
    for (int i = 0; i < SLIDERS; ++i) {
        last->slider_slip[i] = slip_after_event(&value[slider_states[i]], at[speeds[i]],
                                                model->point.sliding.limit[i], last->slider_slip[i]);
    }
    last->slips = slips;
    last->slip = slip;
    lost = stored - energy_of_friction(value);
    model->heat += lost;
    latch(model, 0.0);
    return lost != 0.0;
}

void model_initial_event(Model *model)
{
    model_latch(model);
    model->in_range = model_clamped(model) == 0U;
    model->last.level.elements = locate(model)->level;
    model->began = true;
    (void)model_event(model);
}

/* --- derivatives --- */

/* At an instant: those of a step of co-simulation are not provided. */
void model_derivatives(Model *model, const double direction[VARIABLE_COUNT], double slopes[VARIABLE_COUNT])
{
    const StepContext context = context_of(model);

    slopes_along(model->map, model->latched, direction, &context, slopes);
}
