/* Files of the resources: eight characters that name the format, size of the file, checksum of what follows, content.
   Little-endian, a multiple of eight bytes. */
#ifndef BALLSCREW_FILE_H
#define BALLSCREW_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "constants.h"

#define FILE_MAGIC_SIZE 8
#define FILE_HEAD_SIZE (FILE_MAGIC_SIZE + 16)

INTERNAL uint64_t little_endian(const unsigned char bytes[8]);

#ifndef EMBEDDED_RESOURCES
/* Content of a file, path in UTF-8, in new memory (free). NULL, with the reason in message. */
INTERNAL unsigned char *file_read(const char *path, size_t *size, char *message, size_t message_size);
#endif

/* True, with the reason in message, if these bytes are not a whole file of the format. name, what: for messages */
INTERNAL bool file_fails(const unsigned char *bytes, size_t size, const char *magic, const char *name, const char *what,
                         char *message, size_t message_size);

#endif
