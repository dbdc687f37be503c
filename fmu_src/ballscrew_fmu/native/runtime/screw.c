/* Reads the file of a screw. Layout: native_fmu/resource_files.py. */
#include "screw.h"

#include <stdio.h>
#include <string.h>

#include "file.h"
#include "model.h"

#define SCREW_SIZE (FILE_HEAD_SIZE + 4 * HASH_SIZE + 8 + 8 * VARIABLE_COUNT + ORIGIN_SIZE)

/* Text of a field; returns the byte after it. */
static const unsigned char *text_of(const unsigned char *bytes, size_t length, char *text)
{
    memcpy(text, bytes, length);
    text[length] = '\0';
    return bytes + length;
}

bool screw_from_bytes(const unsigned char *bytes, size_t size, const char *name, Screw *screw, char *message,
                      size_t message_size)
{
    char model[HASH_SIZE + 1], table[HASH_SIZE + 1];
    const unsigned char *at = bytes + FILE_HEAD_SIZE;

    if (file_fails(bytes, size, SCREW_MAGIC, name, "screw", message, message_size)) {
        return false;
    }
    if (size < FILE_HEAD_SIZE + 2 * HASH_SIZE) {
        (void)snprintf(message, message_size, "%s: %.0f bytes: truncated or damaged", name, (double)size);
        return false;
    }
    at = text_of(at, HASH_SIZE, model);
    at = text_of(at, HASH_SIZE, table);
    if (strcmp(model, MODEL_NAME) != 0) {
        (void)snprintf(message, message_size, "%s is of %.64s, this library is " MODEL_NAME ": another model", name, model);
        return false;
    }
    if (strcmp(table, TABLE_HASH) != 0 || size != SCREW_SIZE) {
        (void)snprintf(message, message_size, "%s is of variables %.12s, this library has %.12s: another version", name,
                       table, TABLE_HASH);
        return false;
    }
    at = text_of(at, HASH_SIZE, screw->token);
    at = text_of(at, HASH_SIZE, screw->map);
    screw->law = at[0] < LAWS ? (int)at[0] : LAWS;
    at += 8;
    for (int i = 0; i < VARIABLE_COUNT; ++i, at += 8) {
        const uint64_t bits = little_endian(at);
        memcpy(&screw->start[i], &bits, sizeof bits);
        if (model_is_set(&model_variables[i]) ? !model_accepts(i, screw->start[i]) : bits != 0) {
            (void)snprintf(message, message_size, "%s: start value of %s is not valid", name, model_variables[i].name);
            return false;
        }
    }
    (void)text_of(at, ORIGIN_SIZE - 1, screw->origin);
    return true;
}
