/* Screw and map of an instance, in the resources of the FMU or compiled in, and messages without an instance. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "file.h"
#include "importer.h"
#include "uri.h"

void importer_error(const Importer *importer, const char *name, const char *format, ...)
{
    char message[MESSAGE_SIZE];
    va_list arguments;

    if (importer->logger != NULL) {
        va_start(arguments, format);
        (void)vsnprintf(message, sizeof message, format, arguments);
        va_end(arguments);
        importer->emit(importer, name != NULL ? name : "", STATUS_ERROR, log_categories[STATUS_ERROR], message);
    }
}

/* True, with the reason in message, if the model description is of another FMU. */
static bool token_fails(const char *token, const Screw *screw, char *message, size_t message_size)
{
    if (token != NULL && strcmp(token, screw->token) == 0) {
        return false;
    }
    (void)snprintf(message, message_size, "GUID or instantiation token is %.100s, the resources have %s: model description "
                   "and resources belong to different FMUs", token != NULL ? token : "NULL", screw->token);
    return true;
}

#ifdef EMBEDDED_RESOURCES

#define NEEDS_RESOURCES false

static Map *read_resources(const char *folder, const char *token, Screw *screw, char *message, size_t message_size)
{
    (void)folder;
    return screw_from_bytes(screw_file, sizeof screw_file, "screw that is compiled in", screw, message, message_size)
                   && !token_fails(token, screw, message, message_size)
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
    good = bytes != NULL && screw_from_bytes(bytes, size, folder, screw, message, message_size)
           && !token_fails(token, screw, message, message_size);
    free(bytes);
    strcpy(folder + length, MAP_FILE);
    return good ? map_read(folder, screw->law, message, message_size) : NULL;
}

#endif

Map *importer_resources(const Importer *importer, const char *name, const char *token, const char *resources,
                        bool is_uri, Screw *screw)
{
    char message[MESSAGE_SIZE], *folder = NULL;
    Map *map = NULL;

    if (resources == NULL && NEEDS_RESOURCES) {
        importer_error(importer, name, "location of the resources is NULL; needed to read " SCREW_FILE);
        return NULL;
    }
    resources = resources != NULL ? resources : "";
    folder = importer->allocate(1, strlen(resources) + sizeof "/" SCREW_FILE MAP_FILE);
    if (folder == NULL) {
        importer_error(importer, name, "not enough memory");
        return NULL;
    }
    if (is_uri) {
        path_of_uri(resources, folder);
    } else {
        strcpy(folder, resources);
    }
    map = read_resources(folder, token, screw, message, sizeof message);
    importer->release(folder);
    if (map == NULL) {
        importer_error(importer, name, "%s", message);
    }
    return map;
}
