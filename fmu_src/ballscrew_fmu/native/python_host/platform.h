/* Library of pythonfmu and files of the resources, as the systems have them. */
#ifndef BALLSCREW_PLATFORM_H
#define BALLSCREW_PLATFORM_H

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#define LIBRARY "pythonfmu-export.dll"
#else
#include <dlfcn.h>
#define LIBRARY "libpythonfmu-export.so"
#endif

/* --- library of pythonfmu, in the folder of this one --- */

typedef void (*Function)(void);

#ifdef _WIN32
static void *open_library(char *reason, size_t size)
{
    enum { LONGEST = 32768 };
    wchar_t *path = calloc(LONGEST, sizeof *path);
    static const int here = 0;
    HMODULE local = NULL, library = NULL;
    DWORD length = 0;

    if (path != NULL
        && GetModuleHandleExW(
            GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT,
            (LPCWSTR)(const void *)&here, &local)) {
        length = GetModuleFileNameW(local, path, LONGEST);
    }
    while (length > 0 && path[length - 1] != L'\\') {
        --length;
    }
    if (length > 0 && length + sizeof LIBRARY < LONGEST) {
        for (size_t i = 0; i < sizeof LIBRARY; ++i) {
            path[length + i] = (wchar_t)LIBRARY[i];
        }
        library = LoadLibraryW(path);
    }
    if (library == NULL) {
        (void)snprintf(reason, size, "Windows error %lu", (unsigned long)GetLastError());
    }
    free(path);
    return (void *)library;
}

#else
static void *open_library(char *reason, size_t size)
{
    static const int here = 0;
    Dl_info local;
    size_t length;
    char *path;
    void *library = NULL;

    (void)snprintf(reason, size, "folder not found");
    if (dladdr(&here, &local) == 0 || local.dli_fname == NULL) {
        return NULL;
    }
    for (length = strlen(local.dli_fname); length > 0 && local.dli_fname[length - 1] != '/';) {
        --length;
    }
    path = calloc(1, length + sizeof LIBRARY);
    if (path != NULL) {
        memcpy(path, local.dli_fname, length);
        strcpy(path + length, LIBRARY);
        library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
        if (library == NULL) {
            const char *error = dlerror();
            (void)snprintf(reason, size, "%s", error != NULL ? error : "unknown reason");
        }
    }
    free(path);
    return library;
}

#endif

static Function function_of(void *library, const char *name)
{
#ifdef _WIN32
    const FARPROC result = GetProcAddress((HMODULE)library, name);
#else
    void *const result = dlsym(library, name);
#endif
    Function function;

    memcpy(&function, &result, sizeof function); /* ISO C has no conversion */
    return function;
}

/* --- folder of the resources --- */

static bool is_utf8(const char *text)
{
    int more = 0; /* bytes of a character that has begun */

    for (; *text != '\0' || more > 0; ++text) {
        const unsigned char byte = (unsigned char)*text;

        if (more > 0 ? (byte & 0xC0) != 0x80 : (byte >= 0x80 && byte < 0xC2) || byte >= 0xF5) {
            return false;
        }
        more = more > 0 ? more - 1 : byte >= 0xF0 ? 3 : byte >= 0xE0 ? 2 : byte >= 0xC2 ? 1 : 0;
    }
    return true;
}

#ifdef _WIN32
/* pythonfmu opens files by the code page of the system: with other characters by the short name of the folder. Path in
   new memory; NULL: there is none. */
static char *readable_path(char *path)
{
    enum { LONGEST = 32768 };
    wchar_t *wide = calloc(2 * LONGEST, sizeof *wide), *brief = wide != NULL ? wide + LONGEST : NULL;
    bool good = wide != NULL && MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, LONGEST) > 0;

    for (const char *c = path; good && *c != '\0'; ++c) {
        if ((unsigned char)*c >= 0x80) {
            good = GetShortPathNameW(wide, brief, LONGEST) > 0;
            for (size_t i = 0; good && (i == 0 || brief[i - 1] != 0); ++i) {
                good = brief[i] < 0x80;
                path[i] = (char)brief[i]; /* shorter than in UTF-8 */
            }
            break;
        }
    }
    free(wide);
    return good ? path : NULL;
}
#else
static char *readable_path(char *path) { return path; }
#endif

/* First line of a file in the folder; false: it cannot be read. */
static bool first_line(const char *folder, const char *file, char *line, int size)
{
    const size_t length = strlen(folder) + strlen(file) + 2;
    char *path = calloc(1, length);
    FILE *stream = NULL;
    bool result = false;

    if (path != NULL) {
        (void)snprintf(path, length, "%s/%s", folder, file);
        stream = fopen(path, "rb");
        free(path);
    }
    if (stream != NULL) {
        result = fgets(line, size, stream) != NULL;
        (void)fclose(stream);
        line[result ? strcspn(line, "\r\n") : 0] = '\0';
    }
    return result;
}

#endif
