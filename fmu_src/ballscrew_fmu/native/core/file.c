#include "system.h"

#include "file.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LARGEST_FILE 67108864 /* bytes, thirty times a map */
#define SHOWN_PATH 300U       /* bytes of a path in a message, which has room for the reason then */

static void put_little_endian(uint64_t value, unsigned char bytes[8])
{
    for (int i = 0; i < 8; ++i) {
        bytes[i] = (unsigned char)(value >> (8 * i) & 0xFFU);
    }
}

/* FNV-1a of words of eight bytes. A remainder of fewer bytes is omitted: the check of the size finds it. */
static uint64_t checksum(const unsigned char *bytes, size_t size)
{
    uint64_t sum = UINT64_C(14695981039346656037);
    for (size_t i = 0; i < size / 8; ++i) {
        sum = (sum ^ little_endian(bytes + 8 * i)) * UINT64_C(1099511628211);
    }
    return sum;
}

/* True, with the reason in message, if these bytes are not a whole file of the format. name, what: for messages */
INTERNAL bool file_fails(const unsigned char *bytes, size_t size, const char *magic, const char *name, const char *what,
                         char *message, size_t message_size)
{
    char result[FILE_MAGIC_SIZE + 1] = "";

    for (size_t i = 0; i < FILE_MAGIC_SIZE && i < size; ++i) {
        result[i] = bytes[i] > ' ' && bytes[i] < 127 ? (char)bytes[i] : '.';
    }
    if (size < FILE_HEAD_SIZE || memcmp(bytes, magic, FILE_MAGIC_SIZE) != 0) {
        (void)snprintf(message, message_size, "%s: %.0f bytes that begin with '%s': not a %s of this format, which begins "
                       "with '%s'", name, (double)size, result, what, magic);
    } else if (little_endian(bytes + FILE_MAGIC_SIZE) != size || size % 8 != 0) {
        (void)snprintf(message, message_size, "%s: %.0f bytes, expected %.0f: truncated or damaged", name, (double)size,
                       (double)little_endian(bytes + FILE_MAGIC_SIZE));
    } else if (little_endian(bytes + FILE_MAGIC_SIZE + 8) != checksum(bytes + FILE_HEAD_SIZE, size - FILE_HEAD_SIZE)) {
        (void)snprintf(message, message_size, "%s: wrong checksum: damaged", name);
    } else {
        return false;
    }
    return true;
}

/* Writes the head of bytes of a whole file, whose content is there. */
INTERNAL void file_seal(unsigned char *bytes, size_t size, const char *magic)
{
    memcpy(bytes, magic, FILE_MAGIC_SIZE);
    put_little_endian(size, bytes + FILE_MAGIC_SIZE);
    put_little_endian(checksum(bytes + FILE_HEAD_SIZE, size - FILE_HEAD_SIZE), bytes + FILE_MAGIC_SIZE + 8);
}

#ifndef EMBEDDED_RESOURCES

/* Path for a message, of a long one its end. */
INTERNAL const char *end_of_path(const char *path)
{
    const size_t length = strlen(path);
    path += length > SHOWN_PATH ? length - SHOWN_PATH : 0;
    while ((*path & 0xC0) == 0x80) {
        ++path; /* within a character of UTF-8 */
    }
    return path;
}

#if defined(_WIN32)

static FILE *open_file(const char *path)
{
    wchar_t wide[32768];
    int length = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, wide, 32768);
    return length > 0 ? _wfopen(wide, L"rb") : NULL;
}

#elif defined(__unix__) || defined(__APPLE__)

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

/* A folder, a device, a pipe or a symbolic link could lead out of the FMU, or have no end. */
static FILE *open_file(const char *path)
{
    const int descriptor = open(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    struct stat status;
    FILE *file = NULL;

    if (descriptor >= 0 && fstat(descriptor, &status) == 0) {
        errno = S_ISDIR(status.st_mode) ? EISDIR : EINVAL;
        file = S_ISREG(status.st_mode) ? fdopen(descriptor, "rb") : NULL;
    }
    if (descriptor >= 0 && file == NULL) {
        (void)close(descriptor);
    }
    return file;
}

#else

static FILE *open_file(const char *path) { return fopen(path, "rb"); }

#endif

/* Content of a file, path in UTF-8, in new memory (free). NULL, with the reason in message. */
INTERNAL unsigned char *file_read(const char *path, size_t *size, char *message, size_t message_size)
{
    FILE *file = open_file(path);
    unsigned char *bytes = NULL;
    long length = -1;

    if (file == NULL) {
        (void)snprintf(message, message_size, "%s: %s; needs a file that can be read, not a folder or a link",
                       end_of_path(path), strerror(errno));
        return NULL;
    }
    if (fseek(file, 0, SEEK_END) == 0) {
        length = ftell(file);
    }
    if (length < 0 || length > LARGEST_FILE || fseek(file, 0, SEEK_SET) != 0) {
        (void)snprintf(message, message_size, "%s: cannot be read, or is larger than %d bytes", end_of_path(path),
                       LARGEST_FILE);
    } else if ((bytes = malloc((size_t)length + 1)) == NULL) {
        (void)snprintf(message, message_size, "%s: not enough memory to read it", end_of_path(path));
    } else if (fread(bytes, 1, (size_t)length, file) != (size_t)length) {
        (void)snprintf(message, message_size, "%s: cannot be read", end_of_path(path));
        free(bytes);
        bytes = NULL;
    }
    *size = bytes != NULL ? (size_t)length : 0;
    (void)fclose(file);
    return bytes;
}

#endif
