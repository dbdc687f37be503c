/* Texts of messages and of file URIs: of the runtime and of the entry library of the FMUs for Python hosts. */
#ifndef BALLSCREW_TEXT_H
#define BALLSCREW_TEXT_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

enum { CATEGORIES = 5 };
static const char *const log_categories[CATEGORIES] = {"logAll", "logStatusWarning", "logStatusDiscard", "logStatusError",
                                                       "logStatusFatal"}; /* by status */
#define ALL_CATEGORIES ((1U << CATEGORIES) - 1U)
#define PROBLEMS (ALL_CATEGORIES & ~3U) /* what is logged without debug logging: why a call is discarded or an error */

/* Bit per status of the named log categories, of all without a name. NULL, or the first name that is unknown. */
static inline const char *categories_mask(bool on, size_t count, const char *const names[], unsigned *mask)
{
    const char *unknown = NULL;

    *mask = !on ? PROBLEMS : count == 0 ? ALL_CATEGORIES : 0U;
    for (size_t i = 0; i < count; ++i) {
        size_t known = 0;
        while (known < CATEGORIES && (names[i] == NULL || strcmp(names[i], log_categories[known]) != 0)) {
            ++known;
        }
        if (known == CATEGORIES) {
            unknown = unknown != NULL ? unknown : names[i] != NULL ? names[i] : "NULL";
        } else if (on) {
            *mask |= known == 0 ? ALL_CATEGORIES : 1U << known;
        }
    }
    return unknown;
}

/* Text of a number, the same on every platform. */
static inline const char *number_text(double value, char text[32])
{
    if (value != value) {
        return "nan";
    }
    (void)snprintf(text, 32, "%.10g", value);
    return text;
}

/* A message, with the call that it is about; NULL: none. */
static inline void write_message(char *message, size_t size, const char *call, const char *format, va_list arguments)
{
    const int used = vsnprintf(message, size, format, arguments);

    if (call != NULL && used >= 0 && (size_t)used < size) {
        (void)snprintf(message + used, size - (size_t)used, " (%s)", call);
    }
}

static inline bool is_blank(const char *name) { return name == NULL || name[strspn(name, " \t\r\n\f\v")] == '\0'; }

/* The logger of FMI 2 takes a printf format, in which # marks a value reference. The message is passed as the format,
   without arguments: many importers print the format unchanged. */
static inline void format_of(const char *message, char *format, size_t size)
{
    size_t used = 0;

    for (; *message != '\0' && used < size - 2; ++message) {
        if (*message == '%' || *message == '#') {
            format[used++] = *message;
        }
        format[used++] = *message;
    }
    format[used] = '\0';
}

/* --- file URIs, which locate the resources --- */

static inline int hexadecimal(char c)
{
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    c = (char)(c | 0x20);
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

static inline bool starts_with(const char *text, const char *beginning)
{
    for (; *beginning != '\0'; ++text, ++beginning) {
        if ((*text >= 'A' && *text <= 'Z' ? (char)(*text | 0x20) : *text) != *beginning) {
            return false;
        }
    }
    return true;
}

/* Path of a file URI, or the text itself if it is not a URI. path has room for the text. */
static inline void path_of_uri(const char *uri, char *path)
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

#endif
