#include "instance.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* --- create and free --------------------------------------------------------------------------------------------- */

/* Which map the results are from, that in the resources can be replaced; and of which screw its friction numbers are. */
static void report_map(Instance *instance)
{
    const char *found = instance->map->identity.content_hash, *described = instance->screw.map;

    (void)instance_log(instance, STATUS_OK, "map %s, %s friction law", found, map_law_name(instance->map->law));
    if (strcmp(found, described) != 0) {
        instance_warn(instance, "map %.12s replaces map %.12s, which the start values of the model description belong to",
             found, described);
    }
    if (instance->screw.origin[0] != '\0') {
        instance_warn(instance, "%s", instance->screw.origin);
    }
}

INTERNAL Status instance_reset(Instance *instance)
{
    Situation *now = &instance->now;

    memset(now, 0, sizeof *now);
    model_reset(&now->model, instance->map, instance->screw.start, instance->kind == MODEL_EXCHANGE);
    now->model.events = instance->kind == MODEL_EXCHANGE || instance->event_mode;
    now->stop = HUGE_VAL;
    now->state = INSTANTIATED;
    now->stale = true;
    return STATUS_OK;
}

/* NULL, with a message, if the instance cannot be created. resources: folder of screw and map, as URI or as path. */
INTERNAL Instance *instance_create(const Importer *importer, unsigned kind, const char *name, const char *token,
                                   const char *resources, bool logging)
{
    Instance *instance;
    Screw screw;
    Map *map;

    if (name == NULL || name[strspn(name, " \t\r\n\f\v")] == '\0') {
        importer_error(importer, name, "instance name is empty; needs a name");
        return NULL;
    }
    map = importer_resources(importer, name, token, resources, &screw);
    if (map == NULL) {
        return NULL;
    }
    instance = importer->allocate(1, sizeof *instance + strlen(name));
    if (instance == NULL) {
        importer_error(importer, name, "not enough memory");
        map_free(map);
        return NULL;
    }
    strcpy(instance->name, name);
    instance->importer = *importer;
    instance->kind = kind;
    instance->map = map;
    instance->screw = screw;
    instance->call = "";
    instance->logging = logging;
    instance->categories = ALL_CATEGORIES;
    instance->saved.next = instance->saved.previous = &instance->saved;
    (void)instance_reset(instance);
    report_map(instance);
    return instance;
}

INTERNAL void instance_free(Instance *instance)
{
    if (instance != NULL) {
        /* the standards require that freeInstance frees all memory, including saved states */
        while (instance->saved.next != &instance->saved) {
            saved_release(instance->saved.next, &instance->importer);
        }
        map_free(instance->map);
        instance->importer.release(instance);
    }
}

/* --- order of calls ---------------------------------------------------------------------------------------------- */

static const char *kind_name(unsigned kind)
{
    return kind == CO_SIMULATION ? "co-simulation" : "model exchange";
}

/* Start of every FMI call. NULL: the call is illegal, which is logged, and the instance has failed. */
INTERNAL Instance *instance_begin(void *handle, const Call *call)
{
    Instance *instance = handle;
    char here[32], legal[192];

    if (instance == NULL) {
        return NULL;
    }
    instance->call = call->name;
    if ((instance->now.state & call->states) != 0U && (instance->kind & call->kinds) != 0U) {
        return instance;
    }
    instance_list_states(instance->now.state, here, sizeof here);
    instance_list_states(call->states, legal, sizeof legal);
    if ((instance->kind & call->kinds) == 0U) {
        (void)instance_fail(instance, "called in %s; legal in %s only", kind_name(instance->kind),
                            kind_name(call->kinds));
    } else {
        (void)instance_fail(instance, "called in %s; legal in %s", here,
                            legal[0] != '\0' ? legal : "no state of this FMU");
    }
    (void)instance_end(instance, STATUS_ERROR);
    return NULL;
}

/* --- after values were set ---------------------------------------------------------------------------------------- */

/* End of the initialization with valid values that was postponed. */
static void initialize_now(Instance *instance)
{
    Model *model = &instance->now.model;

    instance->now.postponed = false;
    model_latch(model);
    if (model->events) {
        model_initial_event(model);
    }
}

/* An event, in co-simulation with the last valid value in place of each that is not valid: steps are discarded for
   those. True: a continuous state has changed. */
static bool event(Instance *instance)
{
    Model *model = &instance->now.model;
    double set[VARIABLE_COUNT];
    bool invalid[VARIABLE_COUNT] = {false}, changed;

    memcpy(set, model->value, sizeof set);
    for (int i = 0; instance->now.unchecked && i < VARIABLE_COUNT; ++i) {
        invalid[i] = model_is_set(&model_variables[i]) && !model_accepts(i, set[i]);
        model->value[i] = invalid[i] ? model->latched[i] : set[i];
    }
    changed = model_event(model);
    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        model->value[i] = invalid[i] ? set[i] : model->value[i];
    }
    return changed;
}

/* Whether a warning that is logged once has not been logged. */
static bool may_warn(const Instance *instance, unsigned warning)
{
    return (instance->now.warned & warning) == 0U && instance_logs(instance, STATUS_WARNING);
}

/* One warning for each variable that is clamped. */
static void warn_of_clamping(Instance *instance)
{
    unsigned beyond;
    char text[32];

    if (!instance_logs(instance, STATUS_WARNING)) {
        return;
    }
    beyond = model_clamped(&instance->now.model) & ~instance->now.warned;
    instance->now.warned |= beyond;
    for (int reference = (int)INPUT_FIRST; beyond != 0U; ++reference, beyond >>= 1) {
        if ((beyond & 1U) != 0U) {
            instance_warn(instance, "%s = %s is outside the map and is clamped (logged once)", model_variables[reference].name,
                 number_text(model_get(&instance->now.model, reference), text));
        }
    }
}

#ifdef MODEL_WARNS_OF_STEPS
static void warn_of_step(Instance *instance, double step)
{
    double stiffness, damping;
    char texts[4][32];

    if (may_warn(instance, WARNED_STEP) && model_step_too_long(&instance->now.model, step, &stiffness, &damping)) {
        instance->now.warned |= WARNED_STEP;
        instance_warn(instance,
             "step = %s s; an inertia coupled with the values of the last step comes to rest for steps below damping "
             "over presliding stiffness only, %s N.m.s/rad over %s N.m/rad = %s s (logged once)",
             number_text(step, texts[0]), number_text(damping, texts[1]), number_text(stiffness, texts[2]),
             number_text(damping / stiffness, texts[3]));
    }
}
#endif

#ifdef MODEL_COUPLING
static void warn_of_coupling(Instance *instance, double step)
{
    CouplingLimit limit;
    char texts[3][32];

    if (may_warn(instance, WARNED_COUPLING) && model_coupling_unstable(&instance->now.model, step, &limit)) {
        instance->now.warned |= WARNED_COUPLING;
        instance_warn(instance,
             "step = %s s; the exchange of motion and force with the masses of table and shaft (together %s kg at the nut, "
             "%s, with values of %s) is stable for steps below %s s only; BallScrewAxis has the masses inside (logged once)",
             number_text(step, texts[0]), number_text(limit.mass, texts[1]),
             limit.trapezoidal ? "trapezoidal rule" : "semi-implicit", limit.parallel ? "the last step" : "this step",
             number_text(limit.step, texts[2]));
    }
}
#endif

#ifdef MODEL_CUTS_STEPS
static void warn_of_cut(Instance *instance, double step)
{
    char text[32];

    if (may_warn(instance, WARNED_STEP) && model_step_cut(&instance->now.model)) {
        instance->now.warned |= WARNED_STEP;
        instance_warn(instance,
             "step = %s s; its motion is too fast for error_bound, the error of the step is larger: take a shorter step, "
             "a larger bound or check inertias, masses and stiffness (logged once)",
             number_text(step, text));
    }
}
#endif

/* --- life cycle -------------------------------------------------------------------------------------------------- */

static bool is_time(double value)
{
    return fabs(value) < TOO_LARGE;
}

INTERNAL Status instance_setup(Instance *instance, double start, bool stop_defined, double stop)
{
    char text[32], other[32];

    /* agentlib has infinity as the stop time of a run without end */
    if (!is_time(start) || (stop_defined && !(stop >= start))) {
        return instance_fail(instance, "start time = %s s, stop time = %s s; needs a finite start, stop >= start",
                             number_text(start, text), stop_defined ? number_text(stop, other) : "none");
    }
    instance->now.time = start;
    instance->now.stop = stop_defined ? stop : HUGE_VAL;
    return STATUS_OK;
}

INTERNAL Status instance_enter(Instance *instance, unsigned state)
{
    instance->now.state = state;
    return STATUS_OK;
}

INTERNAL Status instance_exit_initialization(Instance *instance)
{
    Situation *now = &instance->now;

    instance_follow(instance);
    now->postponed = now->unchecked; /* a value is not valid: the elements begin with the good one in its place */
    if (now->model.events && !now->postponed) {
        model_initial_event(&now->model);
    }
    now->state = now->model.events ? EVENT_MODE : STEP_MODE;
    warn_of_clamping(instance);
    return STATUS_OK;
}

/* --- co-simulation ----------------------------------------------------------------------------------------------- */

#define TIME_SHARE 1e-3 /* of a step: allowed difference of communication points, in addition to rounding */

/* Before a step: arguments and values are checked. */
INTERNAL Status instance_begin_step(Instance *instance, double time, double step, bool zero_allowed, bool check_time)
{
    Situation *now = &instance->now;
    const double tolerance = TIME_SHARE * step + 4.0 * DBL_EPSILON * fabs(time);
    char text[32], other[32];

    if (!(is_time(time) && step >= 0.0 && step < TOO_LARGE && (step > 0.0 || zero_allowed))) {
        return instance_fail(instance,
                             "communication point = %s s, step size = %s s; needs finite numbers, step size %s 0",
                             number_text(time, text), number_text(step, other), zero_allowed ? ">=" : ">");
    }
    if (time + step > now->stop + tolerance) {
        return instance_fail(instance, "step ends at %s s, beyond the stop time %s s", number_text(time + step, text),
                             number_text(now->stop, other));
    }
    if (!instance_is_valid(instance)) {
        return STATUS_DISCARD;
    }
    if (now->postponed) {
        initialize_now(instance);
    }
    /* a warning is enough: the model depends on the length of a step only */
    if (check_time && fabs(time - now->time) > tolerance && may_warn(instance, WARNED_TIME)) {
        now->warned |= WARNED_TIME;
        instance_warn(instance, "communication point = %s s, end of the last step = %s s; the new time is used (logged once)",
             number_text(time, text), number_text(now->time, other));
    }
    return STATUS_OK;
}

/* longest: [s] for which the inputs were constant */
INTERNAL void instance_end_step(Instance *instance, double time, double longest)
{
    instance->now.stale = false;
    instance->now.time = time;
    warn_of_clamping(instance);
#ifdef MODEL_WARNS_OF_STEPS
    warn_of_step(instance, longest);
#ifdef MODEL_COUPLING
    warn_of_coupling(instance, longest);
#endif
#elif defined MODEL_CUTS_STEPS
    warn_of_cut(instance, longest);
#else
    (void)longest;
#endif
}

INTERNAL Status instance_step(Instance *instance, double time, double step, bool zero_allowed, bool check_time)
{
    const Status status = instance_begin_step(instance, time, step, zero_allowed, check_time);

    if (status == STATUS_OK) {
        model_step(&instance->now.model, step);
        instance_end_step(instance, time + step, step);
    }
    return status;
}

/* --- events and model exchange ----------------------------------------------------------------------------------- */

INTERNAL Status instance_set_time(Instance *instance, double time)
{
    char text[32];

    /* the stop time is not checked: integrators evaluate beyond it */
    if (!is_time(time)) {
        return instance_discard(instance, "time = %s s; needs a finite number: not set", number_text(time, text));
    }
    instance->now.time = time;
    return STATUS_OK;
}

INTERNAL Status instance_enter_event_mode(Instance *instance)
{
    if (!instance->now.model.events) {
        return instance_fail(instance, "called in Step Mode without event mode; legal in instances with eventModeUsed = true");
    }
    instance->now.reported = false;
    return instance_enter(instance, EVENT_MODE);
}

INTERNAL Status instance_event(Instance *instance, bool *state_changed)
{
    instance_follow(instance);
    if (instance->now.postponed && !instance->now.unchecked) {
        initialize_now(instance);
    }
    *state_changed = !instance->now.postponed && event(instance);
    warn_of_clamping(instance);
    return STATUS_OK;
}

/* --- saved states ------------------------------------------------------------------------------------------------ */

static Status missing(Instance *instance)
{
    return instance_fail(instance, "FMU state or an argument is a NULL pointer");
}

/* Stores in an existing state of the importer or in a new one. */
static Status store(Instance *instance, const Situation *situation, void **state)
{
    Saved *saved = *state != NULL ? *state : saved_new(&instance->saved, &instance->importer);

    if (saved == NULL) {
        return instance_fail(instance, "not enough memory for an FMU state");
    }
    saved->situation = *situation;
    *state = saved;
    return STATUS_OK;
}

INTERNAL Status instance_save(Instance *instance, void **state)
{
    return state == NULL ? missing(instance) : store(instance, &instance->now, state);
}

INTERNAL Status instance_restore(Instance *instance, const void *state)
{
    const Saved *saved = state;

    if (saved == NULL) {
        return missing(instance);
    }
    if (saved->situation.model.continuous != (instance->kind == MODEL_EXCHANGE)) {
        return instance_fail(instance, "FMU state is of the other kind, %s: not restored",
                             saved->situation.model.continuous ? "model exchange" : "co-simulation");
    }
    if (saved->situation.model.events != instance->now.model.events) {
        return instance_fail(instance, "FMU state is of an instance %s event mode: not restored",
                             saved->situation.model.events ? "with" : "without");
    }
    instance->now = saved->situation;
    instance->now.model.map = instance->map;
    return STATUS_OK;
}

INTERNAL Status instance_free_state(Instance *instance, void **state)
{
    if (state != NULL && *state != NULL) {
        saved_release(*state, &instance->importer);
        *state = NULL;
    }
    return STATUS_OK;
}

/* What a saved state must belong to. */
static Owner owner_of(const Instance *instance)
{
    const Owner owner = {instance->screw.token, instance->map->identity.content_hash};
    return owner;
}

INTERNAL Status instance_serialized_size(Instance *instance, const void *state, size_t *size)
{
    if (state == NULL || size == NULL) {
        return missing(instance);
    }
    *size = situation_size(&((const Saved *)state)->situation, owner_of(instance));
    return STATUS_OK;
}

INTERNAL Status instance_serialize(Instance *instance, const void *state, unsigned char *bytes, size_t size)
{
    const Saved *saved = state;
    size_t needed;

    if (saved == NULL || bytes == NULL) {
        return missing(instance);
    }
    needed = situation_size(&saved->situation, owner_of(instance));
    if (size != needed) {
        return instance_fail(instance, "room for %lu bytes; an FMU state has %lu", (unsigned long)size,
                             (unsigned long)needed);
    }
    situation_write(&saved->situation, owner_of(instance), bytes);
    return STATUS_OK;
}

INTERNAL Status instance_deserialize(Instance *instance, const unsigned char *bytes, size_t size, void **state)
{
    Situation situation;
    char reason[MESSAGE_SIZE / 2];
    void *fresh = NULL;

    if (bytes == NULL || state == NULL) {
        return missing(instance);
    }
    if (!situation_read(&situation, owner_of(instance), bytes, size, reason, sizeof reason)) {
        return instance_fail(instance, "serialized FMU state %s", reason);
    }
    if (store(instance, &situation, &fresh) != STATUS_OK) {
        return STATUS_ERROR;
    }
    *state = fresh;
    return STATUS_OK;
}
