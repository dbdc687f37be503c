/* The map of an instance: in the resources of the FMU, located by URI (FMI 2) or path (FMI 3), or compiled in. */
#include <string.h>

#include "importer.h"
#include "uri.h"
#include "variables.h"

#if MAP_COMPILED

Map *importer_map(const Importer *importer, const char *name, const char *resources, bool is_uri)
{
    char message[128];
    Map *map = map_compiled(message, sizeof message);

    (void)resources, (void)is_uri;
    if (map == NULL) {
        importer_error(importer, name, "%s", message);
    }
    return map;
}

#else

Map *importer_map(const Importer *importer, const char *name, const char *resources, bool is_uri)
{
    char message[MESSAGE_SIZE], *path;
    Map *map;
    size_t length;

    if (resources == NULL) {
        importer_error(importer, name, "location of the resources is NULL; needed to read " MAP_FILE);
        return NULL;
    }
    path = importer->allocate(1, strlen(resources) + sizeof "/" MAP_FILE);
    if (path == NULL) {
        importer_error(importer, name, "not enough memory");
        return NULL;
    }
    if (is_uri) {
        path_of_uri(resources, path);
    } else {
        strcpy(path, resources);
    }
    length = strlen(path);
    if (length > 0 && path[length - 1] != '/' && path[length - 1] != '\\') {
        path[length++] = '/';
    }
    strcpy(path + length, MAP_FILE);
    map = map_read(path, MODEL_LAW, message, sizeof message);
    importer->release(path);
    if (map == NULL) {
        importer_error(importer, name, "%s", message);
    }
    return map;
}

#endif
