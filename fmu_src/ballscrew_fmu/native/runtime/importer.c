#include "importer.h"

#include <stdarg.h>
#include <stdio.h>

const char *const log_categories[CATEGORIES] = {"logAll", "logStatusWarning", "logStatusDiscard", "logStatusError",
                                                "logStatusFatal"};

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

const char *number_text(double value, char text[32])
{
    if (value != value) {
        return "nan";
    }
    (void)snprintf(text, 32, "%.10g", value);
    return text;
}
