#ifndef BALLSCREW_VALUES_H
#define BALLSCREW_VALUES_H

#include "instance.h"

INTERNAL Status instance_missing_array(Instance *instance);
INTERNAL bool instance_is_valid(Instance *instance);
INTERNAL void update_outputs(Instance *instance);
INTERNAL Status instance_get_reals(Instance *instance, const unsigned references[], size_t count,
                                   double values[]);
INTERNAL Status instance_get_booleans(Instance *instance, const unsigned references[], size_t count,
                                      bool values[]);
INTERNAL Status instance_set(Instance *instance, const unsigned references[], size_t count,
                             const void *values, bool boolean);
INTERNAL Status instance_no_variables(Instance *instance, const char *type, const unsigned references[],
                                      size_t count);
INTERNAL Status instance_put_count(Instance *instance, enum Causality causality, size_t *count);
INTERNAL Status instance_get_all(Instance *instance, enum Causality causality, bool nominal, double values[],
                                 size_t length);
INTERNAL Status instance_get_nominals(Instance *instance, double nominals[], size_t length);
INTERNAL Status instance_set_states(Instance *instance, const double states[], size_t length);
INTERNAL Status instance_derivative(Instance *instance, const unsigned unknowns[], size_t unknown_count,
                                    const unsigned knowns[], size_t known_count, const double seed[],
                                    double sensitivity[], bool adjoint);

#endif
