/* Arguments of the importer at instantiation, and messages to it without an instance. */
#ifndef BALLSCREW_IMPORTER_H
#define BALLSCREW_IMPORTER_H

#include <stdbool.h>
#include <stddef.h>

#include "map.h"

typedef enum { STATUS_OK, STATUS_WARNING, STATUS_DISCARD, STATUS_ERROR, STATUS_FATAL } Status; /* as FMI 2 and FMI 3 */

enum { CATEGORIES = 5 };
extern const char *const log_categories[CATEGORIES]; /* by status */

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
void importer_error(const Importer *importer, const char *name, const char *format, ...);

/* The map in the resources, or that which is compiled in (resources.c). NULL with a message if it cannot be used. */
Map *importer_map(const Importer *importer, const char *name, const char *resources, bool is_uri);

/* Text of a number, the same on every platform. */
const char *number_text(double value, char text[32]);

#endif
