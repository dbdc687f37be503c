#ifndef BALLSCREW_LIFE_CYCLE_H
#define BALLSCREW_LIFE_CYCLE_H

#include "instance.h"

INTERNAL Instance *instance_create(const Importer *importer, unsigned kind, const char *name,
                                   const char *token, const char *resources, bool logging);
INTERNAL void instance_free(Instance *instance);
INTERNAL Status instance_reset(Instance *instance);
INTERNAL Instance *instance_begin(void *handle, const char *call, unsigned kinds, unsigned states);
INTERNAL Status instance_setup(Instance *instance, double start, bool stop_defined, double stop);
INTERNAL Status instance_enter(Instance *instance, unsigned state);
INTERNAL Status instance_exit_initialization(Instance *instance);
INTERNAL Status instance_step(Instance *instance, double time, double step, bool zero_allowed,
                              bool check_time);
INTERNAL Status instance_set_time(Instance *instance, double time);
INTERNAL Status instance_event(Instance *instance, bool *state_changed);

#endif
