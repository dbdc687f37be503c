/* Messages, and which of them are logged. */
#include "messages.h"

static const char *const state_names[] = {"Instantiated", "Initialization Mode", "Event Mode", "Continuous-Time Mode",
                                          "Step Mode",    "Terminated",          "Error"};
#define STATE_NAMES (sizeof state_names / sizeof state_names[0])

INTERNAL bool instance_logs(const Instance *instance, Status status)
{
    return instance->importer.logger != NULL && (instance->categories >> status & 1U) != 0U;
}

/* Message if no instance can be created. Logged whatever the log settings. */
INTERNAL void importer_error(const Importer *importer, const char *name, const char *format, ...)
{
    char message[MESSAGE_SIZE];
    va_list arguments;

    if (importer->logger != NULL) {
        va_start(arguments, format);
        write_message(message, sizeof message, NULL, format, arguments);
        va_end(arguments);
        importer->emit(importer, name != NULL ? name : "", STATUS_ERROR, log_categories[STATUS_ERROR], message);
    }
}

/* Logs and returns the status: STATUS_ERROR; or STATUS_DISCARD, nothing has changed. */
INTERNAL Status instance_log(Instance *instance, Status status, const char *format, ...)
{
    char message[MESSAGE_SIZE];
    va_list arguments;

    if (instance_logs(instance, status)) {
        va_start(arguments, format);
        write_message(message, sizeof message, status > STATUS_WARNING ? instance->call : NULL, format, arguments);
        va_end(arguments);
        instance->importer.emit(&instance->importer, instance->name, status, log_categories[status], message);
    }
    return status;
}

INTERNAL Status instance_set_logging(Instance *instance, bool on, size_t count, const char *const names[])
{
    const char *unknown_name;
    unsigned mask;

    if (count > 0 && names == NULL) {
        return instance_fail(instance, "%lu log categories, but the array is NULL", (unsigned long)count);
    }
    unknown_name = categories_mask(on, count, names, &mask);
    instance->categories = mask;
    if (unknown_name == NULL) {
        return STATUS_OK;
    }
    instance_tell(instance, "log category %.80s is unknown and has no effect; known: %s, %s, %s, %s, %s", unknown_name,
                  log_categories[0], log_categories[1], log_categories[2], log_categories[3], log_categories[4]);
    return STATUS_WARNING;
}

/* Names of a set of states, e.g. "Event Mode, Terminated". */
INTERNAL void instance_list_states(unsigned states, char *text, size_t size)
{
    size_t used = 0;

    text[0] = '\0';
    for (size_t i = 0; i < STATE_NAMES; ++i) {
        if ((states >> i & 1U) != 0U && used < size) {
            const int more = snprintf(text + used, size - used, "%s%s", used > 0 ? ", " : "", state_names[i]);
            used += more > 0 ? (size_t)more : 0;
        }
    }
}
