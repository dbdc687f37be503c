/* Texts of messages: of the runtime and of the entry library of the FMUs for Python hosts. */
#ifndef BALLSCREW_TEXT_H
#define BALLSCREW_TEXT_H

#include <stddef.h>
#include <stdio.h>
#include <string.h>

enum { CATEGORIES = 5 };
static const char *const log_categories[CATEGORIES] = {"logAll", "logStatusWarning", "logStatusDiscard", "logStatusError",
                                                       "logStatusFatal"}; /* by status */
#define ALL_CATEGORIES ((1U << CATEGORIES) - 1U)

/* Bit per status of the named log categories, of all without a name. NULL, or the name that is unknown. */
static inline const char *categories_mask(size_t count, const char *const names[], unsigned *mask)
{
    *mask = count == 0 ? ALL_CATEGORIES : 0U;
    for (size_t i = 0; i < count; ++i) {
        size_t known = 0;
        while (known < CATEGORIES && (names[i] == NULL || strcmp(names[i], log_categories[known]) != 0)) {
            ++known;
        }
        if (known == CATEGORIES) {
            return names[i] != NULL ? names[i] : "NULL";
        }
        *mask |= known == 0 ? ALL_CATEGORIES : 1U << known;
    }
    return NULL;
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

#endif
