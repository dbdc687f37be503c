/* Files of the resources: eight characters that name the format, size of the file, checksum of what follows,
   content. Little-endian, a multiple of eight bytes. */
#ifndef BALLSCREW_FILE_H
#define BALLSCREW_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "constants.h"

#define FILE_MAGIC_SIZE 8
#define FILE_HEAD_SIZE (FILE_MAGIC_SIZE + 16)

static inline uint64_t little_endian(const unsigned char bytes[8])
{
    uint64_t value = 0;
    for (int i = 7; i >= 0; --i) {
        value = value << 8 | bytes[i];
    }
    return value;
}

INTERNAL bool file_fails(const unsigned char *bytes, size_t size, const char *magic, const char *name,
                         const char *what, char *message, size_t message_size);
INTERNAL void file_seal(unsigned char *bytes, size_t size, const char *magic);
#ifndef EMBEDDED_RESOURCES
INTERNAL const char *end_of_path(const char *path);
INTERNAL unsigned char *file_read(const char *path, size_t *size, char *message, size_t message_size);
#endif

#endif
