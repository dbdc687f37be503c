/* Life cycle, outputs, events and derivatives of BallScrewAxis. */
#include "screw_model.h"

#include <string.h>

/* --- from the latched point to outputs --- */

/* [N.m/rad] of the elements; 0 at the start: that of the loads */
static double held_stiffness(const Model *model)
{
    return model->began ? ELEMENTS * model->level.elements.root * model->level.elements.root : 0.0;
}

static inline const Point *locate(Model *model)
{
    if (!model->located) {
        point_locate(model->map, model->latched, held_stiffness(model), &model->point);
        model->located = true;
    }
    return &model->point;
}

static Moment moment_of(const Model *model)
{
    const Moment moment = {model->slips,      model->slip, held_stiffness(model),
                           model->guide_slip, model->heat, model->supplied};

    return moment;
}

static void compute_outputs(Model *model)
{
    const Moment moment = moment_of(model);

    axis_outputs(locate(model), model->latched, &moment, model->value);
    if (model->step > 0.0) {
        model->value[POWER_LOSS] = model->lost / model->step;
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
    at[SPEED] = at[VELOCITY] = at[SCREW_DISPLACEMENT] = at[SCREW_VELOCITY] = at[GUIDE_ELEMENT] = 0.0;
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

void model_step(Model *model, double step)
{
    Advance state;
    double *value = model->value;

    if (!(step > 0.0)) {
        model_latch(model);
        model->began = true;
        return;
    }
    if (!model->began) { /* inputs may have changed the friction */
        model_latch(model);
        model->began = true;
    }
    memcpy(state.motion.place, (double[]){value[ANGLE], value[POSITION], value[SCREW_DISPLACEMENT]},
           sizeof state.motion.place);
    memcpy(state.motion.speed, (double[]){value[SPEED], value[VELOCITY], value[SCREW_VELOCITY]},
           sizeof state.motion.speed);
    memcpy(state.motion.element, &value[PRESLIDING_ELEMENT_1], sizeof state.motion.element);
    state.motion.guide = value[GUIDE_ELEMENT];
    state.level = model->level;
    state.proposal = model->proposal;
    state.slips = 0U;
    state.slip = state.guide_slip = 0;
    state.cut = false;
    axis_advance(model->map, value, step, &state);
    value[ANGLE] = state.motion.place[SHAFT];
    value[POSITION] = state.motion.place[TABLE];
    value[SCREW_DISPLACEMENT] = state.motion.place[SCREW];
    value[SPEED] = state.motion.speed[SHAFT];
    value[VELOCITY] = state.motion.speed[TABLE];
    value[SCREW_VELOCITY] = state.motion.speed[SCREW];
    memcpy(&value[PRESLIDING_ELEMENT_1], state.motion.element, sizeof state.motion.element);
    value[GUIDE_ELEMENT] = state.motion.guide;
    model->level = state.level;
    model->proposal = state.proposal;
    model->slips = state.slips;
    model->slip = state.slip;
    model->guide_slip = state.guide_slip;
    model->cut = state.cut;
    model->lost = state.heat;
    model->heat += state.heat;
    model->supplied += state.supplied;
    latch(model, step);
}

bool model_step_cut(const Model *model) { return model->cut; }

unsigned model_clamped(Model *model)
{
    const Point *point = locate(model);

    return contacts_clamped(model->map, &point->contacts, &point->conditions, model->latched[PRELOAD]);
}

bool model_possible(const Model *model)
{
    const PreslidingLevel *level = &model->level.elements;

    /* comparisons that NaN and infinity fail */
    return model->step >= 0.0 && model->proposal >= 0.0 && level->coulomb >= 0.0 && level->root >= 0.0
           && level->damping >= 0.0 && model->level.viscous >= 0.0
           && model->step + model->proposal + level->coulomb + level->root + level->damping + model->level.viscous
                      + fabs(model->lost) + fabs(model->heat) + fabs(model->supplied)
                  < HUGE_VAL
           && model->slips < 1U << ELEMENTS && (model->slip != 0 || model->slips == 0U);
}

void model_clear_computed(Model *model)
{
    model->map = NULL;
    memset(&model->point, 0, sizeof model->point);
    model->located = model->outputs_known = model->films_known = false;
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
                                   ? distance_to_stiffness(held_stiffness(model), present_stiffness(model))
                                   : 1.0;
    for (int i = 0; i < ELEMENTS; ++i) {
        out[SLIP_INDICATOR_1 + i] =
            indicator_of(at[PRESLIDING_ELEMENT_1 + i], at[SPEED], limit_of(model, i), slip_of_element(model, i));
    }
    out[GUIDE_SLIP_INDICATOR] =
        indicator_of(at[GUIDE_ELEMENT], at[VELOCITY], model->point.mechanics.guide_limit, model->guide_slip);
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
    double stored, lost;
    unsigned slips = 0U;
    int slip = 0;
    bool changed;

    model_indicators(model);
    if (!model->continuous) {
        return false;
    }
    model->in_range = range_after_event(model);
    if (stiffness_follows(model->slips == (1U << ELEMENTS) - 1U
                              || elements_free(&value[PRESLIDING_ELEMENT_1], locate(model)->level.unit),
                          held_stiffness(model), present_stiffness(model))) {
        model->level.elements.root = root(present_stiffness(model) / ELEMENTS);
        model->located = false;
    }
    stored = energy_of_elements(&value[PRESLIDING_ELEMENT_1]) + 0.5 * value[GUIDE_ELEMENT] * value[GUIDE_ELEMENT];
    for (int i = 0; i < ELEMENTS; ++i) {
        const int one =
            slip_after_event(&value[PRESLIDING_ELEMENT_1 + i], at[SPEED], limit_of(model, i), slip_of_element(model, i));
        slips |= one != 0 ? 1U << i : 0U;
        slip = one != 0 ? one : slip;
    }
    model->guide_slip =
        slip_after_event(&value[GUIDE_ELEMENT], at[VELOCITY], model->point.mechanics.guide_limit, model->guide_slip);
    model->slips = slips;
    model->slip = slip;
    lost = stored - energy_of_elements(&value[PRESLIDING_ELEMENT_1])
           - 0.5 * value[GUIDE_ELEMENT] * value[GUIDE_ELEMENT];
    model->heat += lost;
    changed = lost != 0.0;
    latch(model, 0.0);
    return changed;
}

void model_initial_event(Model *model)
{
    model_latch(model);
    model->in_range = model_clamped(model) == 0U;
    model->level.elements = locate(model)->level;
    model->began = true;
    (void)model_event(model);
}

/* --- derivatives --- */

/* At an instant: those of a step of co-simulation are not provided. */
void model_derivatives(Model *model, const double direction[VARIABLE_COUNT], double slopes[VARIABLE_COUNT])
{
    const Moment moment = moment_of(model);

    slopes_along(model->map, model->latched, direction, &moment, slopes);
}
