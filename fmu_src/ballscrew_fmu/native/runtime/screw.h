/* What differs between the FMUs of a model: the screw of an FMU, read from the resources beside its map. */
#ifndef BALLSCREW_SCREW_H
#define BALLSCREW_SCREW_H

#include "map.h"
#include "variables.h"

typedef struct {
    char token[HASH_SIZE + 1]; /* guid of FMI 2, instantiationToken of FMI 3 */
    char map[HASH_SIZE + 1];   /* content hash of the map that the model description is of */
    int law;                   /* of its friction: required of the map */
    double start[VARIABLE_COUNT]; /* of inputs, parameters and the state, else 0 */
    char origin[ORIGIN_SIZE];  /* of friction numbers that were measured on another screw; "": none */
} Screw;

/* Screw from the bytes of a file; name for messages. False, with the reason in message, if it is not one of this
   library. */
INTERNAL bool screw_from_bytes(const unsigned char *bytes, size_t size, const char *name, Screw *screw, char *message,
                               size_t message_size);

#endif
