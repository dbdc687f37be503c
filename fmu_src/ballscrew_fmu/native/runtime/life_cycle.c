/* Life of an instance in the order of the standards: creation, initialization, steps, events. */
#include "life_cycle.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "map_file.h"
#include "messages.h"
#include "resources.h"
#include "saved_state.h"
#include "values.h"

/* --- create and free --------------------------------------------------------------------------------------------- */

/* Which map the results are from, that in the resources can be replaced; and of which screw its friction numbers are. */
static void report_map(Instance *instance)
{
    const char *result = instance->map->identity.content_hash, *described = instance->screw.map;

    (void)instance_log(instance, STATUS_OK, "map %s, %s friction law", result,
                       map_law_name(instance->map->law));
    if (strcmp(result, described) != 0) {
        instance_warn(instance, "map %.12s replaces map %.12s, which the start values of the model description belong to",
             result, described);
    }
    if (instance->screw.origin[0] != '\0') {
        instance_warn(instance, "%s", instance->screw.origin);
    }
}

INTERNAL Status instance_reset(Instance *instance)
{
    InstanceState *now = &instance->now;

    memset(now, 0, sizeof *now);
    model_reset(&now->model, instance->map, instance->screw.start, instance->kind == KIND_ME);
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

    if (is_blank(name)) {
        importer_error(importer, name, "instance name is empty; needs a name");
        return NULL;
    }
    map = importer_resources(importer, name, token, resources, &screw);
    if (map == NULL) {
        return NULL;
    }
    instance = calloc(1, sizeof *instance + strlen(name));
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
    instance->categories = logging ? ALL_CATEGORIES : PROBLEMS;
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
            void *state = instance->saved.next;
            (void)instance_free_state(&state);
        }
        map_free(instance->map);
        free(instance);
    }
}

/* --- order of calls ---------------------------------------------------------------------------------------------- */

static const char *kind_name(unsigned kind)
{
    return kind == KIND_CS ? "co-simulation" : "model exchange";
}

/* Start of every FMI call. NULL: the call is illegal, which is logged, and the instance has failed. */
INTERNAL Instance *instance_begin(void *handle, const char *call, unsigned kinds, unsigned states)
{
    Instance *instance = handle;
    char here[32], legal[192];

    if (instance == NULL) {
        return NULL;
    }
    instance->call = call;
    if ((instance->now.state & states) != 0U && (instance->kind & kinds) != 0U) {
        return instance;
    }
    instance_list_states(instance->now.state, here, sizeof here);
    instance_list_states(states, legal, sizeof legal);
    if ((instance->kind & kinds) == 0U) {
        (void)instance_fail(instance, "called in %s; legal in %s only", kind_name(instance->kind),
                            kind_name(kinds));
    } else {
        (void)instance_fail(instance, "called in %s; legal in %s", here,
                            legal[0] != '\0' ? legal : "no state of this FMU");
    }
    (void)instance_end(instance, STATUS_ERROR);
    return NULL;
}

/* --- warnings ----------------------------------------------------------------------------------------------------- */

/* Whether a warning that is logged once has not been logged. */
static bool may_warn(const Instance *instance, unsigned warning)
{
    return (instance->now.warned & warning) == 0U && instance_logs(instance, STATUS_WARNING);
}

/* One warning for each variable that is clamped; without debug logging for a temperature of 0 K alone, that of tools
   which set an input that is not connected to 0. */
static void warn_of_clamping(Instance *instance)
{
    const unsigned temperature = 1U << (TEMPERATURE - INPUT_FIRST);
    const bool absent = instance->now.model.value[TEMPERATURE] == 0.0, logs = instance_logs(instance, STATUS_WARNING);
    unsigned beyond;
    char text[32];

    if (!logs && (!absent || (instance->now.warned & temperature) != 0U)) {
        return;
    }
    beyond = model_clamped(&instance->now.model) & ~instance->now.warned & (logs ? ~0U : temperature);
    instance->now.warned |= beyond;
    for (int reference = (int)INPUT_FIRST; beyond != 0U; ++reference, beyond >>= 1) {
        if ((beyond & 1U) != 0U && reference == TEMPERATURE && absent) {
            instance_tell(instance, "temperature = 0 is outside the map and is clamped; is the input connected? (logged once)");
        } else if ((beyond & 1U) != 0U) {
            instance_warn(instance, "%s = %s is outside the map and is clamped (logged once)", model_variables[reference].name,
                 number_text(model_get(&instance->now.model, reference), text));
        }
    }
}

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
    InstanceState *now = &instance->now;

    update_outputs(instance);
    now->postponed = now->unchecked; /* a value is not valid: the elements begin with the good one in its place */
    now->state = STEP_MODE;
    if (instance->kind == KIND_ME) {
        model_initial_event(&now->model);
        now->state = EVENT_MODE;
    }
    warn_of_clamping(instance);
    return STATUS_OK;
}

/* --- co-simulation ----------------------------------------------------------------------------------------------- */

#define TIME_FRACTION 1e-3 /* of a step: allowed difference of communication points, besides rounding */

/* Before a step: arguments and values are checked. */
static Status begin_step(Instance *instance, double time, double step, bool zero_allowed, bool check_time)
{
    InstanceState *now = &instance->now;
    const double tolerance = TIME_FRACTION * step + 4.0 * DBL_EPSILON * fabs(time);
    char text[32], other[32];

    if (!(is_time(time) && step >= 0.0 && step < TOO_LARGE && (step > 0.0 || zero_allowed))) {
        (void)instance_fail(instance,
                            "communication point = %s s, step size = %s s; needs finite numbers, step size %s 0",
                            number_text(time, text), number_text(step, other), zero_allowed ? ">=" : ">");
        return instance_end(instance, STATUS_ERROR);
    }
    if (time + step > now->stop + tolerance) { /* the standards require an error; the instance is as before */
        return instance_fail(instance, "step ends at %s s, beyond the stop time %s s: not done",
                             number_text(time + step, text), number_text(now->stop, other));
    }
    if (!instance_is_valid(instance)) {
        return STATUS_DISCARD;
    }
    if (now->postponed) {
        now->postponed = false;
        model_latch(&now->model);
    }
    /* a warning is enough: the model depends on the length of a step only */
    if (check_time && fabs(time - now->time) > tolerance && may_warn(instance, WARNED_TIME)) {
        now->warned |= WARNED_TIME;
        instance_warn(instance, "communication point = %s s, end of the last step = %s s; the new time is used (logged once)",
             number_text(time, text), number_text(now->time, other));
    }
    return STATUS_OK;
}

/* A step; its status is that of the call. */
INTERNAL Status instance_step(Instance *instance, double time, double step, bool zero_allowed, bool check_time)
{
    const Status status = begin_step(instance, time, step, zero_allowed, check_time);
    InstanceState *now = &instance->now;
    char text[MESSAGE_SIZE / 2];

    if (status != STATUS_OK) {
        return status;
    }
    model_step(&now->model, step);
    now->stale = false;
    now->time = time + step;
    warn_of_clamping(instance);
    if (may_warn(instance, WARNED_STEP) && model_warns_of_step(&now->model, text, sizeof text)) {
        now->warned |= WARNED_STEP;
        instance_warn(instance, "%s", text);
    }
    return STATUS_OK;
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

INTERNAL Status instance_event(Instance *instance, bool *state_changed)
{
    update_outputs(instance);
    *state_changed = model_event(&instance->now.model);
    warn_of_clamping(instance);
    return STATUS_OK;
}
