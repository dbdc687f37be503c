#ifndef BALLSCREW_SAVED_STATE_H
#define BALLSCREW_SAVED_STATE_H

#include "instance.h"

INTERNAL Status instance_save(Instance *instance, void **state);
INTERNAL Status instance_restore(Instance *instance, const void *state);
INTERNAL Status instance_free_state(void **state);
INTERNAL Status instance_serialized_size(Instance *instance, const void *state, size_t *size);
INTERNAL Status instance_serialize(Instance *instance, const void *state, unsigned char *bytes, size_t size);
INTERNAL Status instance_deserialize(Instance *instance, const unsigned char *bytes, size_t size,
                                     void **state);

#endif
