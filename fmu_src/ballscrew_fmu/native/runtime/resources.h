#ifndef BALLSCREW_RESOURCES_H
#define BALLSCREW_RESOURCES_H

#include "instance.h"

INTERNAL Map *importer_resources(const Importer *importer, const char *name, const char *token,
                                 const char *resources, Screw *screw);

#endif
