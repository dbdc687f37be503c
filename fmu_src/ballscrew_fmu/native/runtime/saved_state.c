/* Saved states of an instance, in memory, and as bytes that are the same on every platform: a file of
   file.c with token and map of the FMU, then the fields in the order of pass_situation, each as a double. */
#include <math.h>
#include <stdlib.h>

#include "instance.h"

#define STATE_MAGIC "BSFSTA05" /* ends with the version of the layout */
#define OWNER_SIZE (2 * HASH_SIZE)
#define FIELDS_FROM (FILE_HEAD_SIZE + OWNER_SIZE)

/* --- in memory --------------------------------------------------------------------------------------------------- */

static Status missing(Instance *instance)
{
    return instance_fail(instance, "FMU state or an argument is a NULL pointer");
}

/* Stores in an existing state of the importer or in a new one. */
static Status store(Instance *instance, const Situation *situation, void **state)
{
    Saved *saved = *state;

    if (saved == NULL) {
        saved = calloc(1, sizeof *saved);
        if (saved == NULL) {
            return instance_fail(instance, "not enough memory for an FMU state");
        }
        saved->next = &instance->saved;
        saved->previous = instance->saved.previous;
        saved->previous->next = saved->next->previous = saved;
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
    if (saved->situation.model.continuous != (instance->kind == KIND_ME)) {
        return instance_fail(instance, "FMU state is of the other kind, %s: not restored",
                             saved->situation.model.continuous ? "model exchange" : "co-simulation");
    }
    if (saved->situation.model.map != instance->map) { /* equal maps are one in a process */
        return instance_fail(instance, "FMU state is of another map: not restored");
    }
    instance->now = saved->situation;
    return STATUS_OK;
}

INTERNAL Status instance_free_state(void **state)
{
    if (state != NULL && *state != NULL) {
        Saved *saved = *state;

        saved->previous->next = saved->next;
        saved->next->previous = saved->previous;
        free(saved);
        *state = NULL;
    }
    return STATUS_OK;
}

/* --- as bytes ---------------------------------------------------------------------------------------------------- */

/* The same functions measure, write and read, so that the three cannot differ. */
typedef struct {
    const unsigned char *from; /* NULL: it writes */
    unsigned char *to;         /* NULL, and no from: it measures */
    size_t at;
    bool good; /* what has been read is valid so far */
} Walk;

static void pass_numbers(Walk *walk, double numbers[], size_t count)
{
    for (size_t i = 0; i < count; ++i, walk->at += 8) {
        uint64_t bits;

        if (walk->from != NULL) {
            bits = little_endian(walk->from + walk->at);
            memcpy(&numbers[i], &bits, sizeof bits);
        } else if (walk->to != NULL) {
            memcpy(&bits, &numbers[i], sizeof bits);
            put_little_endian(bits, walk->to + walk->at);
        }
    }
}

/* A whole number from 0 to most. */
static unsigned pass_whole(Walk *walk, unsigned value, unsigned most)
{
    double number = value;

    pass_numbers(walk, &number, 1);
    walk->good = walk->good && number >= 0.0 && number <= most && floor(number) == number;
    return walk->good ? (unsigned)number : 0U;
}

/* All fields of the model except the map, which belongs to the instance, and those computed from the latched point. */
static void pass_model(Walk *walk, Model *model)
{
    pass_numbers(walk, model->value, VARIABLE_COUNT);
    pass_numbers(walk, model->latched, VARIABLE_COUNT);
#define PASS_NUMBERS(field) pass_numbers(walk, (double *)&model->field, sizeof model->field / sizeof(double));
#define PASS_FLAG(field) model->field = pass_whole(walk, model->field, 1U) != 0U;
#define PASS_MASK(field, bits) model->field = pass_whole(walk, model->field, (1U << (bits)) - 1U);
#define PASS_SIGN(field) model->field = (int)pass_whole(walk, (unsigned)(model->field + 1), 2U) - 1;
    MODEL_NUMBERS(PASS_NUMBERS)
    MODEL_FLAGS(PASS_FLAG)
    MODEL_MASKS(PASS_MASK)
    MODEL_SIGNS(PASS_SIGN)
}

/* from and to: as in Walk. Number of bytes; 0: what has been read is not valid. */
static size_t pass_situation(Situation *situation, const unsigned char *from, unsigned char *to)
{
    Walk walk = {from, to, FIELDS_FROM, true};

    pass_numbers(&walk, &situation->time, 1);
    pass_numbers(&walk, &situation->stop, 1);
    situation->state = pass_whole(&walk, situation->state, FAILED);
    situation->warned = pass_whole(&walk, situation->warned, 2U * WARNED_STEP - 1U);
    situation->stale = pass_whole(&walk, situation->stale, 1U) != 0U;
    situation->unchecked = pass_whole(&walk, situation->unchecked, 1U) != 0U;
    situation->postponed = pass_whole(&walk, situation->postponed, 1U) != 0U;
    pass_model(&walk, &situation->model);
    return walk.good ? walk.at : 0;
}

/* What a state must belong to: token and map. */
static void owner_of(const Instance *instance, unsigned char owner[OWNER_SIZE])
{
    memset(owner, 0, OWNER_SIZE);
    memcpy(owner, instance->screw.token, strlen(instance->screw.token));
    memcpy(owner + HASH_SIZE, instance->map->identity.content_hash, strlen(instance->map->identity.content_hash));
}

INTERNAL Status instance_serialized_size(Instance *instance, const void *state, size_t *size)
{
    Situation copy;

    if (state == NULL || size == NULL) {
        return missing(instance);
    }
    copy = ((const Saved *)state)->situation;
    *size = pass_situation(&copy, NULL, NULL);
    return STATUS_OK;
}

INTERNAL Status instance_serialize(Instance *instance, const void *state, unsigned char *bytes, size_t size)
{
    Situation copy;
    size_t needed;

    if (state == NULL || bytes == NULL) {
        return missing(instance);
    }
    copy = ((const Saved *)state)->situation;
    needed = pass_situation(&copy, NULL, NULL);
    if (size != needed) {
        return instance_fail(instance, "room for %lu bytes; an FMU state has %lu", (unsigned long)size,
                             (unsigned long)needed);
    }
    owner_of(instance, bytes + FILE_HEAD_SIZE);
    (void)pass_situation(&copy, NULL, bytes);
    file_seal(bytes, size, STATE_MAGIC);
    return STATUS_OK;
}

/* Whether an instance can be in this situation. */
static bool possible(const Situation *situation)
{
    const unsigned state = situation->state;
    const bool unchecked = situation->unchecked && !situation->model.continuous;

    if (state == 0U || (state & (state - 1U)) != 0U || !(fabs(situation->time) < TOO_LARGE)
        || !(situation->stop > -TOO_LARGE) || !model_possible(&situation->model)) {
        return false;
    }
    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        if (model_is_set(&model_variables[i])
            && !((unchecked || model_accepts(i, situation->model.value[i]))
                 && model_accepts(i, situation->model.latched[i]))) {
            return false;
        }
    }
    return true;
}

INTERNAL Status instance_deserialize(Instance *instance, const unsigned char *bytes, size_t size, void **state)
{
    unsigned char owner[OWNER_SIZE];
    char reason[MESSAGE_SIZE / 2];
    void *fresh = NULL;
    Situation situation;

    if (bytes == NULL || state == NULL) {
        return missing(instance);
    }
    memset(&situation, 0, sizeof situation);
    owner_of(instance, owner);
    if (file_fails(bytes, size, STATE_MAGIC, "serialized FMU state", "state", reason, sizeof reason)) {
        return instance_fail(instance, "%s", reason);
    }
    if (size != pass_situation(&situation, NULL, NULL) || memcmp(bytes + FILE_HEAD_SIZE, owner, OWNER_SIZE) != 0
        || pass_situation(&situation, bytes, NULL) != size || !possible(&situation)) {
        return instance_fail(instance, "serialized FMU state is of another version or map; this FMU has %s and map %.12s",
                             instance->screw.token, instance->map->identity.content_hash);
    }
    situation.model.map = instance->map;
    if (store(instance, &situation, &fresh) != STATUS_OK) {
        return STATUS_ERROR;
    }
    *state = fresh;
    return STATUS_OK;
}
