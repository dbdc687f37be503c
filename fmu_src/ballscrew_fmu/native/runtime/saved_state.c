/* Saved states of an instance, in memory, and as bytes: a file of file.c with what a state must belong to, then the
   state as it is in memory, which only a library with the same structs reads. */
#include "saved_state.h"

#include <stdlib.h>

#include "file.h"
#include "messages.h"

#define STATE_MAGIC "BSFSTA06" /* ends with the version of the layout */
#define OWNER_SIZE (3 * HASH_SIZE)
#define STATE_FROM (FILE_HEAD_SIZE + OWNER_SIZE)
/* The fields from films_known on follow from the others and are not saved. */
#define STATE_BYTES (offsetof(InstanceState, model) + offsetof(Model, films_known))
#define STATE_SIZE ((STATE_FROM + STATE_BYTES + 7) / 8 * 8)

/* --- in memory --------------------------------------------------------------------------------------------------- */

static Status missing(Instance *instance)
{
    return instance_fail(instance, "FMU state or an argument is a NULL pointer");
}

/* Stores in an existing state of the importer or in a new one. */
static Status store(Instance *instance, const InstanceState *from, void **state)
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
    memcpy(&saved->state, from, sizeof *from); /* with its padding */
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
    if (saved->state.model.continuous != (instance->kind == KIND_ME)) {
        return instance_fail(instance, "FMU state is of the other kind, %s: not restored",
                             saved->state.model.continuous ? "model exchange" : "co-simulation");
    }
    if (saved->state.model.map != instance->map) { /* equal maps are one in a process */
        return instance_fail(instance, "FMU state is of another map: not restored");
    }
    memcpy(&instance->now, &saved->state, sizeof instance->now);
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

/* What a state must belong to: the FMU, its table of variables and the map. */
static void owner_of(const Instance *instance, unsigned char owner[OWNER_SIZE])
{
    memset(owner, 0, OWNER_SIZE);
    memcpy(owner, instance->screw.token, strlen(instance->screw.token));
    memcpy(owner + HASH_SIZE, TABLE_HASH, strlen(TABLE_HASH));
    memcpy(owner + 2 * HASH_SIZE, instance->map->identity.content_hash,
           strlen(instance->map->identity.content_hash));
}

INTERNAL Status instance_serialized_size(Instance *instance, const void *state, size_t *size)
{
    if (state == NULL || size == NULL) {
        return missing(instance);
    }
    *size = STATE_SIZE;
    return STATUS_OK;
}

INTERNAL Status instance_serialize(Instance *instance, const void *state, unsigned char *bytes, size_t size)
{
    InstanceState copy;

    if (state == NULL || bytes == NULL) {
        return missing(instance);
    }
    if (size != STATE_SIZE) {
        return instance_fail(instance, "room for %lu bytes; an FMU state has %lu", (unsigned long)size,
                             (unsigned long)STATE_SIZE);
    }
    memcpy(&copy, &((const Saved *)state)->state, sizeof copy);
    copy.model.map = NULL; /* an address: equal states have equal bytes */
    memset(bytes, 0, size);
    owner_of(instance, bytes + FILE_HEAD_SIZE);
    memcpy(bytes + STATE_FROM, &copy, STATE_BYTES);
    file_seal(bytes, size, STATE_MAGIC);
    return STATUS_OK;
}

INTERNAL Status instance_deserialize(Instance *instance, const unsigned char *bytes, size_t size, void **state)
{
    unsigned char owner[OWNER_SIZE];
    char reason[MESSAGE_SIZE / 2];
    void *fresh = NULL;
    InstanceState copy;

    if (bytes == NULL || state == NULL) {
        return missing(instance);
    }
    owner_of(instance, owner);
    if (file_fails(bytes, size, STATE_MAGIC, "serialized FMU state", "state", reason, sizeof reason)) {
        return instance_fail(instance, "%s", reason);
    }
    if (size != STATE_SIZE || memcmp(bytes + FILE_HEAD_SIZE, owner, OWNER_SIZE) != 0) {
        return instance_fail(instance, "serialized FMU state is of another version or map; this FMU has %s and map %.12s",
                             instance->screw.token, instance->map->identity.content_hash);
    }
    memset(&copy, 0, sizeof copy);
    memcpy(&copy, bytes + STATE_FROM, STATE_BYTES);
    copy.model.map = instance->map;
    if (store(instance, &copy, &fresh) != STATUS_OK) {
        return STATUS_ERROR;
    }
    *state = fresh;
    return STATUS_OK;
}
