/* Screw and map of an instance, in the resources of the FMU or compiled in. */
#include "resources.h"

#include <stdlib.h>

#include "file.h"
#include "map_file.h"
#include "messages.h"

/* --- the screw: layout in native_fmu/resource_files.py --- */

#define SCREW_SIZE (FILE_HEAD_SIZE + 4 * HASH_SIZE + 8 + 8 * START_COUNT + ORIGIN_SIZE)

/* Text of a field: of a name ASCII, without control characters, which no message may have; returns the byte after it. */
static const unsigned char *text_of(const unsigned char *bytes, size_t length, char *text)
{
    for (size_t i = 0; i < length; ++i) {
        const bool odd = bytes[i] < ' ' || (length == HASH_SIZE && bytes[i] > '~');
        text[i] = (char)(odd && bytes[i] != 0 ? '.' : bytes[i]);
    }
    text[length] = '\0';
    return bytes + length;
}

/* Screw from the bytes of a file; name for messages, token: of the importer. False, with the reason in message, if it
   is not one of this library, or that of another model description. */
INTERNAL bool screw_from_bytes(const unsigned char *bytes, size_t size, const char *name, const char *token, Screw *screw,
                               char *message, size_t message_size)
{
    char model[HASH_SIZE + 1], table[HASH_SIZE + 1];
    const unsigned char *at;

    if (file_fails(bytes, size, SCREW_MAGIC, name, "screw", message, message_size)) {
        return false;
    }
    if (size < FILE_HEAD_SIZE + 2 * HASH_SIZE) {
        (void)snprintf(message, message_size, "%s: %.0f bytes: truncated or damaged", name, (double)size);
        return false;
    }
    at = text_of(bytes + FILE_HEAD_SIZE, HASH_SIZE, model);
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
    for (int i = 0; i < START_COUNT; ++i, at += 8) {
        const uint64_t bits = little_endian(at);
        bool good;
        memcpy(&screw->start[i], &bits, sizeof bits);
        if (i >= VARIABLE_COUNT) {
            good = fabs(screw->start[i]) < TOO_LARGE;
        } else {
            good = model_is_set(&model_variables[i]) ? model_accepts(i, screw->start[i]) : bits == 0;
        }
        if (!good) {
            (void)snprintf(message, message_size, "%s: start value of %s is not valid", name,
                           i < VARIABLE_COUNT ? model_variables[i].name : "a table");
            return false;
        }
    }
    (void)text_of(at, ORIGIN_SIZE - 1, screw->origin);
    if (token == NULL || strcmp(token, screw->token) != 0) {
        (void)snprintf(message, message_size, "GUID or instantiation token is %.100s, the resources have %s: model "
                       "description and resources belong to different FMUs", token != NULL ? token : "NULL",
                       screw->token);
        return false;
    }
    return true;
}

#ifdef EMBEDDED_RESOURCES

#define NEEDS_RESOURCES false

static Map *read_resources(const char *folder, const char *token, Screw *screw, char *message, size_t message_size)
{
    (void)folder;
    return screw_from_bytes(screw_file, sizeof screw_file, "screw that is compiled in", token, screw, message,
                            message_size)
               ? map_compiled(message, message_size)
               : NULL;
}

#else

#define NEEDS_RESOURCES true

/* folder has room for the name of a file. */
static Map *read_resources(char *folder, const char *token, Screw *screw, char *message, size_t message_size)
{
    size_t length = strlen(folder), size;
    unsigned char *bytes;
    bool good;

    if (length > 0 && folder[length - 1] != '/' && folder[length - 1] != '\\') {
        folder[length++] = '/';
    }
    strcpy(folder + length, SCREW_FILE);
    bytes = file_read(folder, &size, message, message_size);
    good = bytes != NULL && screw_from_bytes(bytes, size, end_of_path(folder), token, screw, message, message_size);
    free(bytes);
    strcpy(folder + length, MAP_FILE);
    return good ? map_read(folder, screw->law, message, message_size) : NULL;
}

#endif

/* Screw and map in the resources, located by URI (as in FMI 2) or path (as in FMI 3; importers mix them up), or compiled
   in. token: of the importer, must be that of the screw. NULL with a message if they cannot be used. */
INTERNAL Map *importer_resources(const Importer *importer, const char *name, const char *token, const char *resources,
                                 Screw *screw)
{
    char message[MESSAGE_SIZE], *folder = NULL;
    Map *map = NULL;

    if (NEEDS_RESOURCES && (resources == NULL || resources[0] == '\0')) {
        importer_error(importer, name, "location of the resources is NULL or empty; needed to read " SCREW_FILE);
        return NULL;
    }
    resources = resources != NULL ? resources : "";
    folder = calloc(1, strlen(resources) + sizeof "/" SCREW_FILE MAP_FILE);
    if (folder == NULL) {
        importer_error(importer, name, "not enough memory");
        return NULL;
    }
    path_of_uri(resources, folder);
    map = read_resources(folder, token, screw, message, sizeof message);
    free(folder);
    if (map == NULL) {
        importer_error(importer, name, "%s", message);
    }
    return map;
}
