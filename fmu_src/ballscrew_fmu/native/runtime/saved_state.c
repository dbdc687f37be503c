/* Saved states of an instance, in memory and as bytes that are the same on every platform. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "instance.h"

/* Layout, little-endian: magic, checksum of all that follows, layout version, total size, then token and map of the
   FMU, each with its length, then the fields in the order of pass_situation. */
#define STATE_MAGIC "BSFSTATE"
#define STATE_MAGIC_SIZE 8
#define CHECKED_FROM (STATE_MAGIC_SIZE + 8)
#define LAYOUT_VERSION 4U

/* --- in memory --------------------------------------------------------------------------------------------------- */

/* New state in the ring of this head. NULL: no memory. */
INTERNAL Saved *saved_new(Saved *head, const Importer *importer)
{
    Saved *saved = importer->allocate(1, sizeof *saved);

    if (saved != NULL) {
        saved->next = head;
        saved->previous = head->previous;
        saved->previous->next = saved->next->previous = saved;
    }
    return saved;
}

INTERNAL void saved_release(Saved *saved, const Importer *importer)
{
    saved->previous->next = saved->next;
    saved->next->previous = saved->previous;
    importer->release(saved);
}

/* --- as bytes ---------------------------------------------------------------------------------------------------- */

/* One function per field type measures, writes and reads, so that the three cannot differ. */
typedef struct {
    const unsigned char *from; /* NULL: it writes */
    unsigned char *to;         /* NULL, and no from: it measures */
    Owner owner;
    size_t at;
    size_t size; /* of the bytes that are read */
    bool good;   /* what is read is complete and valid so far */
} Walk;

static void pass_bytes(Walk *walk, uint64_t *value, size_t count)
{
    if (walk->from != NULL) {
        *value = 0;
        walk->good = walk->good && count <= walk->size - walk->at;
        if (count > walk->size - walk->at) {
            return;
        }
        for (size_t i = count; i-- > 0;) {
            *value = *value << 8 | walk->from[walk->at + i];
        }
    } else if (walk->to != NULL) {
        for (size_t i = 0; i < count; ++i) {
            walk->to[walk->at + i] = (unsigned char)(*value >> (8 * i) & 0xFFU);
        }
    }
    walk->at += count;
}

static void pass_double(Walk *walk, double *value)
{
    uint64_t bits;

    memcpy(&bits, value, sizeof bits);
    pass_bytes(walk, &bits, 8);
    memcpy(value, &bits, sizeof bits);
}

static void pass_unsigned(Walk *walk, unsigned *value, unsigned most)
{
    uint64_t bits = *value;

    pass_bytes(walk, &bits, 4);
    walk->good = walk->good && bits <= most;
    *value = (unsigned)(bits & 0xFFFFFFFFU);
}

static void pass_bool(Walk *walk, bool *value)
{
    unsigned number = *value ? 1U : 0U;

    pass_unsigned(walk, &number, 1U);
    *value = number != 0U;
}

/* When read, the text must be equal to this one. */
static void pass_text(Walk *walk, const char *text)
{
    const size_t length = strlen(text);
    unsigned found = (unsigned)length;

    pass_unsigned(walk, &found, 0xFFFFFFFFU);
    walk->good = walk->good && found == length;
    for (size_t i = 0; i < length && walk->good; ++i) {
        uint64_t byte = (unsigned char)text[i];
        pass_bytes(walk, &byte, 1);
        walk->good = walk->good && byte == (unsigned char)text[i];
    }
}

#ifndef MODEL_ARRAYS
#define MODEL_ARRAYS(X)
#endif
#ifndef MODEL_MASKS
#define MODEL_MASKS(X)
#endif

/* All fields of the model except the map, which belongs to the instance, and those computed from the latched point. */
static void pass_model(Walk *walk, Model *model)
{
    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        pass_double(walk, &model->value[i]);
        pass_double(walk, &model->latched[i]);
    }
#define PASS_NUMBER(field) pass_double(walk, &model->field);
#define PASS_FLAG(field) pass_bool(walk, &model->field);
#define PASS_SIGN(field) /* -1, 0 or 1 */            \
    {                                                \
        unsigned number = (unsigned)(model->field + 1); \
        pass_unsigned(walk, &number, 2U);            \
        model->field = (int)number - 1;              \
    }
#define PASS_ARRAY(field, count)           \
    for (int i = 0; i < (count); ++i) {    \
        pass_double(walk, &model->field[i]); \
    }
#define PASS_MASK(field, bits) pass_unsigned(walk, &model->field, (1U << (bits)) - 1U);
    MODEL_NUMBERS(PASS_NUMBER)
    MODEL_ARRAYS(PASS_ARRAY)
    MODEL_FLAGS(PASS_FLAG)
    MODEL_MASKS(PASS_MASK)
    MODEL_SIGNS(PASS_SIGN)
    if (walk->from != NULL) {
        model_clear_computed(model);
    }
}

static void pass_situation(Walk *walk, Situation *situation)
{
    pass_double(walk, &situation->time);
    pass_double(walk, &situation->stop);
    pass_unsigned(walk, &situation->state, FAILED);
    pass_unsigned(walk, &situation->warned, 2U * WARNED_COUPLING - 1U);
    pass_bool(walk, &situation->stale);
    pass_bool(walk, &situation->unchecked);
    pass_bool(walk, &situation->reported);
    pass_bool(walk, &situation->postponed);
    pass_model(walk, &situation->model);
}

/* Head and fields. *sum and *size are not checked here. */
static void pass_all(Walk *walk, Situation *situation, uint64_t *sum, unsigned *version, unsigned *size)
{
    const char *const magic = STATE_MAGIC;

    for (size_t i = 0; i < STATE_MAGIC_SIZE; ++i) {
        uint64_t byte = (unsigned char)magic[i];
        pass_bytes(walk, &byte, 1);
        walk->good = walk->good && byte == (unsigned char)magic[i];
    }
    pass_bytes(walk, sum, 8);
    pass_unsigned(walk, version, 0xFFFFFFFFU);
    pass_unsigned(walk, size, 0xFFFFFFFFU);
    if (!walk->good || *version != LAYOUT_VERSION) {
        return;
    }
    pass_text(walk, walk->owner.token);
    pass_text(walk, walk->owner.map);
    if (walk->good) {
        pass_situation(walk, situation);
    }
}

/* 64-bit hash of Fowler, Noll and Vo, variant 1a. */
static uint64_t hash_of_bytes(const unsigned char *bytes, size_t size)
{
    uint64_t sum = UINT64_C(14695981039346656037);

    for (size_t i = 0; i < size; ++i) {
        sum = (sum ^ bytes[i]) * UINT64_C(1099511628211);
    }
    return sum;
}

/* Number of bytes; write that many bytes; read. False: the bytes are rejected, with the reason. */
INTERNAL size_t situation_size(const Situation *situation, Owner owner)
{
    Walk walk = {NULL, NULL, owner, 0, 0, true};
    Situation copy = *situation;
    unsigned version = LAYOUT_VERSION, size = 0;
    uint64_t sum = 0;

    pass_all(&walk, &copy, &sum, &version, &size);
    return walk.at;
}

INTERNAL void situation_write(const Situation *situation, Owner owner, unsigned char *bytes)
{
    Walk walk = {NULL, bytes, owner, 0, 0, true};
    Situation copy = *situation;
    unsigned version = LAYOUT_VERSION, size = (unsigned)situation_size(situation, owner);
    uint64_t sum = 0;

    pass_all(&walk, &copy, &sum, &version, &size);
    sum = hash_of_bytes(bytes + CHECKED_FROM, size - CHECKED_FROM);
    walk.at = STATE_MAGIC_SIZE;
    pass_bytes(&walk, &sum, 8);
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

INTERNAL bool situation_read(Situation *situation, Owner owner, const unsigned char *bytes, size_t size, char *reason,
                             size_t reason_size)
{
    Walk walk = {bytes, NULL, owner, 0, size, true};
    unsigned version = 0, written = 0;
    uint64_t sum = 0;

    memset(situation, 0, sizeof *situation);
    pass_all(&walk, situation, &sum, &version, &written);
    if (size <= CHECKED_FROM || memcmp(bytes, STATE_MAGIC, STATE_MAGIC_SIZE) != 0 || written != size
        || sum != hash_of_bytes(bytes + CHECKED_FROM, size - CHECKED_FROM)) {
        (void)snprintf(reason, reason_size, "of %lu bytes is damaged or not of this FMU", (unsigned long)size);
    } else if (version != LAYOUT_VERSION) {
        (void)snprintf(reason, reason_size, "has layout %u, this FMU reads layout %u", version, LAYOUT_VERSION);
    } else if (!walk.good || walk.at != size || !possible(situation)) {
        (void)snprintf(reason, reason_size, "is of another version or map; this FMU has %s and map %.12s", owner.token,
                       owner.map);
    } else {
        return true;
    }
    return false;
}
