/* Arguments of the importer at instantiation, and messages to it without an instance. */
#ifndef BALLSCREW_IMPORTER_H
#define BALLSCREW_IMPORTER_H

#include <stdbool.h>
#include <stddef.h>

#include "screw.h"

typedef enum { STATUS_OK, STATUS_WARNING, STATUS_DISCARD, STATUS_ERROR, STATUS_FATAL } Status; /* as FMI 2 and FMI 3 */

enum { CATEGORIES = 5 };
static const char *const log_categories[CATEGORIES] = {"logAll", "logStatusWarning", "logStatusDiscard", "logStatusError",
                                                       "logStatusFatal"}; /* by status */

#define MESSAGE_SIZE 640

typedef struct Importer Importer;
struct Importer {
    void (*emit)(const Importer *importer, const char *instance_name, Status status, const char *category,
                 const char *message); /* calls the logger as in this FMI version */
    void (*logger)(void);              /* of the importer, cast back by emit; NULL: none */
    void *environment;
    void *(*allocate)(size_t count, size_t size); /* zeroed, as calloc */
    void (*release)(void *memory);
};

/* Message if no instance can be created. Logged whatever the log settings. */
INTERNAL void importer_error(const Importer *importer, const char *name, const char *format, ...);

/* Screw and map in the resources, located by URI (FMI 2) or path (FMI 3), or compiled in. token: of the importer, must be
   that of the screw. NULL with a message if they cannot be used. */
INTERNAL Map *importer_resources(const Importer *importer, const char *name, const char *token, const char *resources,
                                          bool is_uri, Screw *screw);

/* Text of a number, the same on every platform. */
INTERNAL const char *number_text(double value, char text[32]);

#endif
