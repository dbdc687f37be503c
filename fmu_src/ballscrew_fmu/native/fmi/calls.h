/* Functions of both FMI versions, FMI: fmi2 or fmi3. A call begins with a check of its order.

   States in which each call is legal: tables of sections 3.2.3 and 4.2.4 of FMI 2.0.5; sections 2.3, 3.2 and 4.2 of
   FMI 3.0.2. Conditions on the variable are in settable_in of values.c. Differs from the standards: setTime in Event Mode is
   accepted for all FMUs, as importers call it there; after a discarded step the FMU is as before it, so that values may
   be set and the step repeated without restoring a saved state, in FMI 2 too. */
#ifndef BALLSCREW_CALLS_H
#define BALLSCREW_CALLS_H

#include "instance.h"

#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter" /* the standards fix the arguments */
#endif

#define RUNNING (STEP_MODE | EVENT_MODE | CONTINUOUS_TIME_MODE)
#define EVALUATED (INITIALIZATION_MODE | RUNNING | TERMINATED | FAILED)
#define SETTABLE (INSTANTIATED | INITIALIZATION_MODE | STEP_MODE | EVENT_MODE)

#define FMI_TEXT_OF(version) #version
#define FMI_TEXT(version) FMI_TEXT_OF(version)
#define FMI_JOINED(version, name) version##name
#define FMI_OF(version, name) FMI_JOINED(version, name)

/* self: the instance, of the handle that the importer has as `instance` */
#define BEGIN(name, kinds, states) \
    static const Call legal = {FMI_TEXT(FMI) FMI_TEXT(name), kinds, states}; \
    Instance *const self = instance_begin(instance, &legal); \
    if (self == NULL) { \
        return FMI_OF(FMI, Error); \
    }
#define RETURN(status) return (FMI_OF(FMI, Status))instance_end(self, status)

/* A function with one call. */
#define FORWARD(name, kinds, states, arguments, call) \
    FMI_OF(FMI, Status) FMI_OF(FMI, name) arguments \
    { \
        BEGIN(name, kinds, states) \
        RETURN(call); \
    }

/* Output arguments are optional. */
#define PUT(argument, value) \
    do { \
        if ((argument) != NULL) { \
            *(argument) = (value); \
        } \
    } while (false)

#endif
