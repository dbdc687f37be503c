/* The map of an instance: in the resources of the FMU, located by URI (FMI 2) or path (FMI 3), or compiled in. */
#include <string.h>

#include "importer.h"
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

static int hexadecimal(char c)
{
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    c = (char)(c | 0x20);
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

static bool starts_with(const char *text, const char *beginning)
{
    for (; *beginning != '\0'; ++text, ++beginning) {
        if ((*text >= 'A' && *text <= 'Z' ? (char)(*text | 0x20) : *text) != *beginning) {
            return false;
        }
    }
    return true;
}

/* Path of a file URI, or the text itself if it is not a URI. path has room for the text. */
static void path_of_uri(const char *uri, char *path)
{
    const char *from = uri;

    if (!starts_with(uri, "file:")) {
        strcpy(path, uri);
        return;
    }
    from += 5;
    if (starts_with(from, "//localhost/")) {
        from += 11;
    } else if (starts_with(from, "///")) {
        from += 2;
    }
    /* other URIs with two slashes are shares of another host and remain unchanged: //host/share */
    if (from[0] == '/' && from[1] != '\0' && (from[2] == ':' || from[2] == '|')) {
        ++from; /* /C:/folder */
    }
    while (*from != '\0') {
        const int high = *from == '%' ? hexadecimal(from[1]) : -1;
        const int low = high >= 0 ? hexadecimal(from[2]) : -1;
        if (low >= 0 && high + low > 0) {
            *path++ = (char)(unsigned char)(16 * high + low);
            from += 3;
        } else {
            *path++ = *from++;
        }
    }
    *path = '\0';
}

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
