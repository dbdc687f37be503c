#ifndef BALLSCREW_MESSAGES_H
#define BALLSCREW_MESSAGES_H

#include "instance.h"

INTERNAL bool instance_logs(const Instance *instance, Status status);
INTERNAL void importer_error(const Importer *importer, const char *name, const char *format, ...);
INTERNAL Status instance_log(Instance *instance, Status status, const char *format, ...);
INTERNAL Status instance_set_logging(Instance *instance, bool on, size_t count, const char *const names[]);
INTERNAL void instance_list_states(unsigned states, char *text, size_t size);

#define instance_fail(instance, ...) instance_log(instance, STATUS_ERROR, __VA_ARGS__)
#define instance_discard(instance, ...) instance_log(instance, STATUS_DISCARD, __VA_ARGS__)
#define instance_warn(instance, ...) (void)instance_log(instance, STATUS_WARNING, __VA_ARGS__)
/* Without debug logging, too. */
#define instance_tell(instance, ...) \
    do { \
        const unsigned selection = (instance)->categories; \
        (instance)->categories = ALL_CATEGORIES; \
        instance_warn(instance, __VA_ARGS__); \
        (instance)->categories = selection; \
    } while (false)

#endif
