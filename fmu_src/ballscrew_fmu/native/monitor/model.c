/* Monitor of the preload: the preload at which the map shows the measured torque. Twin of nut_map/preload.py and of
   monitor_slave.py. */
#include "model.h"

#include <math.h>
#include <string.h>

#include "law.h"

#define LEAST_ELASTICITY 0.01 /* least elasticity at which the torque tells the preload */
#define ACCURACY 1e-11        /* relative, of the last step in preload */
#define JUMP 1e-9             /* relative; torques so near that of parted nuts do not tell it, and may jump there */
#define MOST_ITERATIONS 200   /* each halves the error in torque or the bracket: it takes 3 to 10, and cannot take all */

/* --- torque over preload ----------------------------------------------------------------------------------------- */

/* One inversion: what stays while the preload changes, and the torque at the preload that was tried last. */
typedef struct {
    const Model *model;
    Conditions conditions;
    Columns columns;
    double sign; /* share of the Coulomb parts at this speed */
    double preload, torque, slope;
} Search;

static double motion(const Model *model)
{
    return most(fabs(model->latched[SPEED]), model->latched[SPEED_MIN]);
}

static void try_preload(Search *search, double preload, Loads *loads)
{
    const double *at = search->model->latched;
    TorqueOverPreload parts;

    nut_torque_over_preload(search->model->map, preload, at[AXIAL_LOAD], &search->conditions,
                            at[APPARENT_VISCOSITY_RATIO], at[ROUGHNESS_HEIGHT], loads, &search->columns, &parts);
    search->preload = preload;
    search->torque = parts.viscous + search->sign * (parts.hysteresis + at[NET_SLIDING_COEFFICIENT] * parts.sliding_load);
    search->slope = parts.viscous_slope
                    + search->sign * (parts.hysteresis_slope + at[NET_SLIDING_COEFFICIENT] * parts.sliding_slope);
}

/* At the speed that tells the preload, speed_min at least. */
static void begin_search(Search *search, const Model *model)
{
    const double speed = motion(model);

    search->model = model;
    search->columns.cell[0] = search->columns.cell[1] = -1;
    search->sign = regularised_sign(speed, model->latched[REGULARIZATION_SPEED]);
    nut_conditions(model->map, speed, model->latched[TEMPERATURE], &search->conditions);
}

/* Newton's method for ln torque over ln preload, safeguarded by bisection. Returns whether the torque at
   search->preload is the one wanted; if not, it is the end of the map, or 0, or the preload at which the nuts part. */
static bool solve(Search *search, double wanted, Loads *loads)
{
    const double highest = search->model->map->force.hi;
    double low = map_separation_preload(search->model->map, search->model->latched[AXIAL_LOAD]), high = highest;
    double before = HUGE_VAL, preload;
    bool high_known = false;

    if (low > 0.0 || !(wanted > 0.0)) { /* without preload there is no torque */
        try_preload(search, low, loads);
        if (!(wanted > (1.0 + JUMP) * search->torque)) {
            search->slope = 0.0;
            return false;
        }
    }
    preload = low > 0.0 ? 0.5 * (low + highest) : 0.25 * highest;
    for (int i = 0; i < MOST_ITERATIONS; ++i) {
        double error, elastic, step, new;
        try_preload(search, preload, loads);
        if (preload >= highest && search->torque <= wanted) {
            return search->torque == wanted;
        }
        if (search->torque > wanted) {
            high = preload;
            high_known = true;
        } else {
            low = preload;
        }
        error = search->torque > 0.0 ? log(wanted / search->torque) : HUGE_VAL;
        elastic = search->slope * preload;
        step = elastic > LEAST_ELASTICITY * search->torque && search->torque > 0.0 ? error * search->torque / elastic
                                                                                  : HUGE_VAL;
        new = step > -50.0 ? preload * exp(least(step, 50.0)) : 0.0;
        if (fabs(step) <= ACCURACY) {
            search->preload = least(new, highest);
            return true;
        }
        if (high_known && high - low <= 4e-16 * high) {
            return fabs(error) <= JUMP;
        }
        if (!high_known && new >= high) {
            new = high; /* whether the map gives so much torque is not known yet */
        } else if (!(low < new && new < high && fabs(error) <= 0.5 * before)) {
            new = low > 0.0 ? sqrt(low * high) : 0.5 * high;
        }
        before = fabs(error);
        preload = new;
    }
    return false;
}

/* --- outputs of the latched point -------------------------------------------------------------------------------- */

static bool at_rest(const Model *model)
{
    const double speed = fabs(model->latched[SPEED]);

    if (model->continuous && model->events_began) {
        return model->rests;
    }
    return !(speed >= model->latched[SPEED_MIN] && speed > 0.0);
}

static unsigned bit_of(int reference)
{
    return 1U << (reference - (int)INPUT_FIRST);
}

/* Preload by the torque, at speed_min if it is slower. */
static void estimate(Model *model, Search *search)
{
    const double *at = model->latched;
    const double torque = at[SPEED] < 0.0 ? -at[TORQUE] : at[TORQUE];
    const bool found = solve(search, torque, &model->loads);

    model->estimate = search->preload;
    model->torque = search->torque;
    model->elasticity = search->torque > 0.0 ? search->slope * search->preload / search->torque : 0.0;
    model->clamped = 0U;
    if (!found || search->preload < model->map->preload.lo || !(model->elasticity >= LEAST_ELASTICITY)) {
        model->clamped |= bit_of(TORQUE);
    }
    if (search->conditions.speed_clamped) {
        model->clamped |= bit_of(SPEED);
    }
    if (search->conditions.temperature_clamped) {
        model->clamped |= bit_of(TEMPERATURE);
    }
    if (model->loads.axial_load_clamped) {
        model->clamped |= bit_of(AXIAL_LOAD);
    }
}

/* All outputs but lambda_ratio. */
static void compute(Model *model)
{
    const bool rests = at_rest(model);
    double *out = model->value, slope;
    Search search;

    if (model->solved) {
        return;
    }
    begin_search(&search, model);
    if (!rests || model->continuous) { /* event indicators follow the torque at rest, too */
        estimate(model, &search);
    } else {
        model->clamped = search.conditions.temperature_clamped ? bit_of(TEMPERATURE) : 0U;
        model->clamped |= search.conditions.speed_clamped ? bit_of(SPEED) : 0U;
    }
    out[PRELOAD] = model->estimate;
    if (rests) {
        out[PRELOAD] = model->holds ? model->held : model->latched[INITIAL_PRELOAD];
        try_preload(&search, least(out[PRELOAD], model->map->force.hi), &model->loads);
        if (!model->continuous && model->loads.axial_load_clamped) {
            model->clamped |= bit_of(AXIAL_LOAD);
        }
    }
    slope = most(search.slope, 0.0);
    out[TORQUE_SENSITIVITY] = slope;
    out[PRELOAD_HALF_WIDTH] = model->latched[TORQUE_UNCERTAINTY] < slope * model->map->force.hi
                                  ? model->latched[TORQUE_UNCERTAINTY] / slope
                                  : model->map->force.hi;
    model->solved = true;
}

static void compute_film(Model *model)
{
    Conditions conditions;
    Films films;

    compute(model);
    nut_conditions(model->map, model->latched[SPEED], model->latched[TEMPERATURE], &conditions);
    nut_loads(model->map, model->value[PRELOAD], model->latched[AXIAL_LOAD], &model->loads);
    nut_films(model->map, &model->loads, &conditions, &films);
    model->value[LAMBDA_RATIO] =
        least(films.film[0] / most(model->latched[ROUGHNESS_HEIGHT], SMOOTH), LAMBDA_RATIO_MAX);
    model->film_known = true;
}

/* --- interface --------------------------------------------------------------------------------------------------- */

void model_reset(Model *model, const Map *map, bool continuous)
{
    memset(model, 0, sizeof *model);
    model->map = map;
    model->continuous = continuous;
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
    model->solved = model->film_known = false;
}

static bool told(Model *model)
{
    compute(model);
    return model->clamped == 0U && !at_rest(model);
}

void model_step(Model *model, double step)
{
    model_latch(model);
    if (step > 0.0 && told(model)) {
        model->held = model->estimate;
        model->holds = true;
    }
}

double model_get(Model *model, int reference)
{
    if (reference == LAMBDA_RATIO) {
        if (!model->film_known) {
            compute_film(model);
        }
    } else if (reference == IN_RANGE) {
        return model->continuous && model->events_began ? model->in_range && !model->rests : told(model);
    } else if (reference >= PRELOAD && reference <= TORQUE_SENSITIVITY) {
        compute(model);
    } else if (reference == IN_RANGE_INDICATOR || reference == MOTION_INDICATOR) {
        double indicators[MODEL_INDICATORS];
        model_indicators(model, indicators);
        return indicators[reference - IN_RANGE_INDICATOR];
    }
    return model->value[reference];
}

unsigned model_clamped(Model *model)
{
    compute(model);
    return model->clamped;
}

bool model_possible(const Model *model)
{
    return model->held >= 0.0 && model->held < MODEL_TOO_LARGE;
}

void model_forget(Model *model)
{
    model->map = NULL;
    model->solved = model->film_known = false;
    model->clamped = 0U;
    model->estimate = model->elasticity = model->torque = 0.0;
    memset(&model->loads, 0, sizeof model->loads);
}

/* --- model exchange ---------------------------------------------------------------------------------------------- */

#define RANGE_HYSTERESIS 1e-6 /* relative: in_range does not storm on the edge */
#define SPEED_HYSTERESIS 1e-6 /* [rad/s] */

/* least distance of the latched point to where in_range ends, negative beyond; motion aside */
static double margin(const Model *model)
{
    const Map *map = model->map;
    const double *at = model->latched;
    const double torque = at[SPEED] < 0.0 ? -at[TORQUE] : at[TORQUE], temperature = at[TEMPERATURE];
    double found;
    Search end;
    Loads loads;

    loads.known = false;
    begin_search(&end, model);
    try_preload(&end, map->force.hi, &loads);
    found = least((end.torque - torque) / most(end.torque, SMOOTH), (model->estimate - map->preload.lo) / map->force.hi);
    found = least(found, model->elasticity - LEAST_ELASTICITY); /* 0 where the nuts part */
    found = least(found, least(temperature - map->temperature.lo, map->temperature.hi - temperature)
                             / (map->temperature.hi - map->temperature.lo));
    found = least(found, (map->speed.hi - motion(model)) / map->speed.hi);
    if (at[AXIAL_LOAD] != 0.0) {
        double force[2];
        map_forces(map, model->estimate, at[AXIAL_LOAD], force);
        found = least(found, (map->force.hi - force[1]) / map->force.hi);
    }
    return found;
}

void model_indicators(Model *model, double indicators[MODEL_INDICATORS])
{
    const bool rests = at_rest(model);
    bool within;

    compute(model);
    within = model->continuous && model->events_began ? model->in_range : model->clamped == 0U;
    indicators[0] = model->continuous ? margin(model) + (within ? RANGE_HYSTERESIS : -RANGE_HYSTERESIS) : 0.0;
    indicators[1] =
        fabs(model->latched[SPEED]) - model->latched[SPEED_MIN] + (rests ? -SPEED_HYSTERESIS : SPEED_HYSTERESIS);
}

void model_initial_event(Model *model)
{
    const bool rests = at_rest(model);

    compute(model);
    model->in_range = model->clamped == 0U;
    model->rests = rests;
    model->events_began = true;
    (void)model_event(model);
}

bool model_event(Model *model)
{
    const bool was_told = model->in_range && !model->rests;
    double indicators[MODEL_INDICATORS];

    model_indicators(model, indicators);
    if (model->in_range ? indicators[0] < 0.0 : indicators[0] > 0.0) {
        model->in_range = !model->in_range;
    }
    if (model->rests ? indicators[1] > 0.0 : indicators[1] < 0.0) {
        model->rests = !model->rests;
    }
    if (was_told && (model->rests || !model->in_range)) { /* the last moment at which the torque told it */
        model->held = model->estimate;
        model->holds = true;
    }
    model_latch(model);
    return false;
}
