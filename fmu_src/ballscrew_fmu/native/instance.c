#include "instance.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define MESSAGE_SIZE 640

static const char *const state_names[] = {"Instantiated", "Initialization Mode", "Event Mode", "Continuous-Time Mode",
                                          "Step Mode",    "Terminated",          "Error"};
#define STATE_NAMES (sizeof state_names / sizeof state_names[0])

/* --- messages ---------------------------------------------------------------------------------------------------- */

static const char *const categories[] = {"logAll", "logStatusWarning", "logStatusDiscard", "logStatusError",
                                         "logStatusFatal"}; /* by status */
#define CATEGORIES (sizeof categories / sizeof categories[0])
#define ALL_CATEGORIES ((1U << CATEGORIES) - 1U)

static bool logs(const Instance *instance, Status status)
{
    return instance->logging && instance->importer.logger != NULL && (instance->categories >> status & 1U) != 0U;
}

static void say(const Instance *instance, Status status, const char *format, va_list arguments)
{
    char message[MESSAGE_SIZE];
    int used;

    if (!logs(instance, status)) {
        return;
    }
    used = vsnprintf(message, sizeof message, format, arguments);
    if (status > STATUS_WARNING && used >= 0 && (size_t)used < sizeof message) {
        (void)snprintf(message + used, sizeof message - (size_t)used, " (%s)", instance->call);
    }
    instance->importer.emit(&instance->importer, instance->name, status, categories[status], message);
}

Status instance_fail(Instance *instance, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    say(instance, STATUS_ERROR, format, arguments);
    va_end(arguments);
    instance->now.state = FAILED;
    return STATUS_ERROR;
}

Status instance_discard(Instance *instance, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    say(instance, STATUS_DISCARD, format, arguments);
    va_end(arguments);
    return STATUS_DISCARD;
}

static void warn(const Instance *instance, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    say(instance, STATUS_WARNING, format, arguments);
    va_end(arguments);
}

void importer_refuse(const Importer *importer, const char *name, const char *format, ...)
{
    char message[MESSAGE_SIZE];
    va_list arguments;

    if (importer->logger != NULL) {
        va_start(arguments, format);
        (void)vsnprintf(message, sizeof message, format, arguments);
        va_end(arguments);
        importer->emit(importer, name != NULL ? name : "", STATUS_ERROR, categories[STATUS_ERROR], message);
    }
}

Status instance_set_logging(Instance *instance, bool on, size_t count, const char *const wanted[])
{
    unsigned mask = count == 0 ? ALL_CATEGORIES : 0U;

    if (count > 0 && wanted == NULL) {
        return instance_fail(instance, "%lu log categories, but no array of them", (unsigned long)count);
    }
    for (size_t i = 0; i < count; ++i) {
        size_t known = 0;
        while (known < CATEGORIES && (wanted[i] == NULL || strcmp(wanted[i], categories[known]) != 0)) {
            ++known;
        }
        if (known == CATEGORIES) {
            return instance_fail(instance, "log category %.80s is not known; known are %s, %s, %s, %s, %s",
                                 wanted[i] != NULL ? wanted[i] : "NULL", categories[0], categories[1], categories[2],
                                 categories[3], categories[4]);
        }
        mask |= known == 0 ? ALL_CATEGORIES : 1U << known;
    }
    instance->logging = on;
    instance->categories = mask;
    return STATUS_OK;
}

/* text of a number, the same on every platform */
static const char *number_text(double value, char text[32])
{
    if (value != value) {
        return "nan";
    }
    (void)snprintf(text, 32, "%.10g", value);
    return text;
}

/* --- making and freeing ------------------------------------------------------------------------------------------ */

Instance *instance_create(const Importer *importer, unsigned kind, const char *name, const char *token,
                          const char *resources, bool is_uri, bool logging)
{
    Instance *instance;
    Map *map;

    if (name == NULL || name[strspn(name, " \t\r\n\f\v")] == '\0') {
        importer_refuse(importer, name, "instance name is empty; needs a name");
        return NULL;
    }
    if (token == NULL || strcmp(token, MODEL_TOKEN) != 0) {
        importer_refuse(importer, name,
                        "GUID or instantiation token is %.100s, this binary has %s: model description and binary "
                        "belong to different FMUs",
                        token != NULL ? token : "NULL", MODEL_TOKEN);
        return NULL;
    }
    map = importer_map(importer, name, resources, is_uri);
    if (map == NULL) {
        return NULL;
    }
    instance = importer->allocate(1, sizeof *instance + strlen(name));
    if (instance == NULL) {
        importer_refuse(importer, name, "not enough memory");
        map_free(map);
        return NULL;
    }
    strcpy(instance->name, name);
    instance->importer = *importer;
    instance->kind = kind;
    instance->map = map;
    instance->call = "";
    instance->logging = logging;
    instance->categories = ALL_CATEGORIES;
    instance->saved.next = instance->saved.previous = &instance->saved;
    (void)instance_reset(instance);
    return instance;
}

void instance_free(Instance *instance)
{
    if (instance != NULL) {
        instance_forget_all(instance);
        map_free(instance->map);
        instance->importer.release(instance);
    }
}

/* --- order of calls ---------------------------------------------------------------------------------------------- */

static const char *kind_name(unsigned kind)
{
    return kind == CO_SIMULATION ? "co-simulation" : "model exchange";
}

/* "Event Mode, Terminated" */
static void list_states(unsigned states, char *text, size_t size)
{
    size_t used = 0;

    text[0] = '\0';
    for (size_t i = 0; i < STATE_NAMES; ++i) {
        if ((states >> i & 1U) != 0U && used < size) {
            const int more = snprintf(text + used, size - used, "%s%s", used > 0 ? ", " : "", state_names[i]);
            used += more > 0 ? (size_t)more : 0;
        }
    }
}

Instance *instance_begin(void *handle, const Call *call)
{
    Instance *instance = handle;
    char here[32], legal[160];

    if (instance == NULL) {
        return NULL;
    }
    instance->call = call->name;
    if ((instance->now.state & call->states) != 0U && (instance->kind & call->kinds) != 0U) {
        return instance;
    }
    list_states(instance->now.state, here, sizeof here);
    list_states(call->states, legal, sizeof legal);
    if ((instance->kind & call->kinds) == 0U) {
        (void)instance_fail(instance, "called in %s; legal in %s only", kind_name(instance->kind),
                            kind_name(call->kinds));
    } else {
        (void)instance_fail(instance, "called in %s; legal in %s", here,
                            legal[0] != '\0' ? legal : "no state of this FMU");
    }
    return NULL;
}

/* --- following what was set -------------------------------------------------------------------------------------- */

void instance_follow(Instance *instance)
{
    if (instance->now.stale
        && (instance->kind == MODEL_EXCHANGE || instance->now.state == INITIALIZATION_MODE)) {
        model_latch(&instance->now.model);
        instance->now.stale = false;
    }
}

/* Once for each input that is clamped. */
static void warn_of_clamping(Instance *instance)
{
    unsigned beyond;
    char text[32];

    if (!logs(instance, STATUS_WARNING)) {
        return;
    }
    beyond = model_clamped(&instance->now.model) & ~instance->now.warned;
    instance->now.warned |= beyond;
    for (int input = 0; beyond != 0U; ++input, beyond >>= 1) {
        if ((beyond & 1U) != 0U) {
            const int reference = (int)INPUT_FIRST + input;
            warn(instance, "%s = %s lies beyond the map and is clamped (said once)", model_variables[reference].name,
                 number_text(model_get(&instance->now.model, reference), text));
        }
    }
}

/* --- life -------------------------------------------------------------------------------------------------------- */

static bool is_time(double value)
{
    return fabs(value) < MODEL_TOO_LARGE;
}

Status instance_setup(Instance *instance, double start, bool stop_defined, double stop)
{
    char text[32], other[32];

    if (!is_time(start) || (stop_defined && !(is_time(stop) && stop >= start))) {
        return instance_fail(instance, "start time = %s s, stop time = %s s; needs finite numbers, stop >= start",
                             number_text(start, text), stop_defined ? number_text(stop, other) : "none");
    }
    instance->now.time = start;
    instance->now.stop = stop_defined ? stop : HUGE_VAL;
    return STATUS_OK;
}

Status instance_enter(Instance *instance, unsigned state)
{
    instance->now.state = state;
    return STATUS_OK;
}

Status instance_exit_initialization(Instance *instance)
{
    instance_follow(instance);
    if (instance->kind == MODEL_EXCHANGE) {
        model_initial_event(&instance->now.model);
        instance->now.state = EVENT_MODE;
    } else {
        instance->now.state = STEP_MODE;
    }
    warn_of_clamping(instance);
    return STATUS_OK;
}

Status instance_reset(Instance *instance)
{
    Situation *now = &instance->now;

    memset(now, 0, sizeof *now);
    model_reset(&now->model, instance->map, instance->kind == MODEL_EXCHANGE);
    now->stop = HUGE_VAL;
    now->state = INSTANTIATED;
    now->stale = true;
    return STATUS_OK;
}

/* --- values ------------------------------------------------------------------------------------------------------ */

/* States in which a variable may be set; what is not listed may never. */
static unsigned settable_in(enum Causality causality)
{
    switch (causality) {
    case CAUSALITY_INPUT:
        return INSTANTIATED | INITIALIZATION_MODE | STEP_MODE | EVENT_MODE | CONTINUOUS_TIME_MODE;
    case CAUSALITY_PARAMETER:
        return INSTANTIATED | INITIALIZATION_MODE | STEP_MODE | EVENT_MODE;
    case CAUSALITY_STATE:
        return INSTANTIATED | INITIALIZATION_MODE | CONTINUOUS_TIME_MODE;
    default:
        return 0U;
    }
}

bool instance_is_real(unsigned reference)
{
    return reference < (unsigned)VARIABLE_COUNT && !model_variables[reference].boolean;
}

Status instance_missing_array(Instance *instance)
{
    return instance_fail(instance, "an array is a NULL pointer");
}

static Status unknown(Instance *instance, const char *type, unsigned reference)
{
    return instance_fail(instance, "no %s variable has value reference %u", type, reference);
}

static Status unusable(Instance *instance, unsigned reference, double value)
{
    const Variable *variable = &model_variables[reference];
    char text[32], lowest[32], highest[32];
    Status (*const refuse)(Instance *, const char *, ...) =
        instance->kind == CO_SIMULATION ? instance_fail : instance_discard;

    return refuse(instance, "%s = %s; needs a finite number >= %s and < %s: not set", variable->name,
                  number_text(value, text), number_text(variable->lowest, lowest),
                  number_text(MODEL_TOO_LARGE, highest));
}

Status instance_get_reals(Instance *instance, const unsigned references[], size_t count, double values[])
{
    if (count > 0 && (references == NULL || values == NULL)) {
        return instance_missing_array(instance);
    }
    instance_follow(instance);
    for (size_t i = 0; i < count; ++i) {
        if (instance_is_real(references[i])) {
            values[i] = model_get(&instance->now.model, (int)references[i]);
        } else if (instance->time_variable && references[i] == (unsigned)TIME_REFERENCE) {
            values[i] = instance->now.time;
        } else {
            return unknown(instance, "Real", references[i]);
        }
    }
    return STATUS_OK;
}

Status instance_set_reals(Instance *instance, const unsigned references[], size_t count, const double values[])
{
    if (count > 0 && (references == NULL || values == NULL)) {
        return instance_missing_array(instance);
    }
    for (size_t i = 0; i < count; ++i) {
        if (!instance_is_real(references[i])) {
            return unknown(instance, "settable Real", references[i]);
        }
        if ((settable_in(model_variables[references[i]].causality) & instance->now.state) == 0U) {
            char here[32];
            list_states(instance->now.state, here, sizeof here);
            return instance_fail(instance, "%s cannot be set in %s", model_variables[references[i]].name, here);
        }
    }
    for (size_t i = 0; i < count; ++i) {
        if (!model_accepts((int)references[i], values[i])) {
            return unusable(instance, references[i], values[i]);
        }
    }
    for (size_t i = 0; i < count; ++i) {
        model_set(&instance->now.model, (int)references[i], values[i]);
    }
    instance->now.stale = true;
    return STATUS_OK;
}

Status instance_get_boolean(Instance *instance, unsigned reference, bool *value)
{
    if (reference >= (unsigned)VARIABLE_COUNT || !model_variables[reference].boolean) {
        return unknown(instance, "Boolean", reference);
    }
    instance_follow(instance);
    *value = model_get(&instance->now.model, (int)reference) != 0.0;
    return STATUS_OK;
}

Status instance_set_boolean(Instance *instance, unsigned reference)
{
    return unknown(instance, "settable Boolean", reference);
}

Status instance_no_variables(Instance *instance, const char *type, const unsigned references[], size_t count)
{
    if (count == 0) {
        return STATUS_OK;
    }
    return references == NULL ? instance_missing_array(instance) : unknown(instance, type, references[0]);
}

/* --- co-simulation ----------------------------------------------------------------------------------------------- */

#define TIME_SHARE 1e-3 /* of a step: communication points may differ by that and by rounding */

Status instance_step(Instance *instance, double time, double step, bool zero_allowed, bool check_time)
{
    Situation *now = &instance->now;
    const double tolerance = TIME_SHARE * step + 4.0 * DBL_EPSILON * fabs(time);
    char text[32], other[32];

    if (!(is_time(time) && step >= 0.0 && step < MODEL_TOO_LARGE && (step > 0.0 || zero_allowed))) {
        return instance_fail(instance,
                             "communication point = %s s, step size = %s s; needs finite numbers, step size %s 0",
                             number_text(time, text), number_text(step, other), zero_allowed ? ">=" : ">");
    }
    if (time + step > now->stop + tolerance) {
        return instance_fail(instance, "step ends at %s s, beyond the stop time %s s", number_text(time + step, text),
                             number_text(now->stop, other));
    }
    /* no reason to refuse: only the length of a step enters the model */
    if (check_time && (now->warned & WARNED_TIME) == 0U && fabs(time - now->time) > tolerance
        && logs(instance, STATUS_WARNING)) {
        now->warned |= WARNED_TIME;
        warn(instance, "communication point = %s s, but the last step ended at %s s; the new time is taken (said once)",
             number_text(time, text), number_text(now->time, other));
    }
    model_step(&now->model, step);
    now->stale = false;
    now->time = time + step;
    warn_of_clamping(instance);
    return STATUS_OK;
}

/* --- model exchange ---------------------------------------------------------------------------------------------- */

Status instance_set_time(Instance *instance, double time)
{
    char text[32];

    /* the stop time is not checked: integrators look ahead of it */
    if (!is_time(time)) {
        return instance_discard(instance, "time = %s s; needs a finite number: not set", number_text(time, text));
    }
    instance->now.time = time;
    return STATUS_OK;
}

Status instance_event(Instance *instance, bool *state_changed)
{
    instance_follow(instance);
    *state_changed = model_event(&instance->now.model);
    warn_of_clamping(instance);
    return STATUS_OK;
}

/* Whether the importer's array is there and has the length that it should have. */
static Status check_length(Instance *instance, const double array[], size_t length, size_t expected)
{
    if (length != expected) {
        return instance_fail(instance, "array of %lu numbers; needs %lu", (unsigned long)length,
                             (unsigned long)expected);
    }
    return array == NULL && length > 0 ? instance_missing_array(instance) : STATUS_OK;
}

/* Values of the variables of a causality, in the order of the table. */
static Status get_all(Instance *instance, enum Causality causality, double values[], size_t length)
{
    const Status status = check_length(instance, values, length, instance_count(causality));

    for (int i = 0; status == STATUS_OK && i < VARIABLE_COUNT; ++i) {
        if (model_variables[i].causality == causality) {
            *values++ = model_get(&instance->now.model, i);
        }
    }
    return status;
}

size_t instance_count(enum Causality causality)
{
    size_t count = 0;

    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        count += model_variables[i].causality == causality;
    }
    return count;
}

Status instance_set_states(Instance *instance, const double states[], size_t length)
{
    Status status = check_length(instance, states, length, instance_count(CAUSALITY_STATE));
    const double *state = states;

    for (int i = 0; status == STATUS_OK && i < VARIABLE_COUNT; ++i) {
        if (model_variables[i].causality == CAUSALITY_STATE && !model_accepts(i, *state++)) {
            status = unusable(instance, (unsigned)i, state[-1]);
        }
    }
    for (int i = 0; status == STATUS_OK && i < VARIABLE_COUNT; ++i) {
        if (model_variables[i].causality == CAUSALITY_STATE) {
            model_set(&instance->now.model, i, *states++);
            instance->now.stale = true;
        }
    }
    return status;
}

Status instance_get_states(Instance *instance, double states[], size_t length)
{
    return get_all(instance, CAUSALITY_STATE, states, length);
}

Status instance_get_rates(Instance *instance, double rates[], size_t length)
{
    instance_follow(instance);
    return get_all(instance, CAUSALITY_RATE, rates, length);
}

Status instance_get_nominals(Instance *instance, double nominals[], size_t length)
{
    const Status status = check_length(instance, nominals, length, instance_count(CAUSALITY_STATE));

    for (int i = 0; status == STATUS_OK && i < VARIABLE_COUNT; ++i) {
        if (model_variables[i].causality == CAUSALITY_STATE) {
            *nominals++ = model_variables[i].nominal;
        }
    }
    return status;
}

Status instance_get_indicators(Instance *instance, double indicators[], size_t length)
{
    const Status status = check_length(instance, indicators, length, MODEL_INDICATORS);

    if (status == STATUS_OK) {
        instance_follow(instance);
        model_indicators(&instance->now.model, indicators);
    }
    return status;
}
