#ifndef BALLSCREW_MAP_FILE_H
#define BALLSCREW_MAP_FILE_H

#include "map.h"

INTERNAL const char *map_law_name(int law);
INTERNAL void map_free(Map *map);
#ifdef EMBEDDED_RESOURCES
INTERNAL Map *map_compiled(char *message, size_t message_size);
#else
INTERNAL Map *map_from_bytes(const unsigned char *bytes, size_t size, int law, const char *name,
                             char *message, size_t message_size);
INTERNAL Map *map_read(const char *path, int law, char *message, size_t message_size);
#endif

#endif
