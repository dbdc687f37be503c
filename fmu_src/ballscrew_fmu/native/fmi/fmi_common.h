/* What fmi2.c and fmi3.c have in common. Each call begins with a check of its order.

   States in which each call is legal: tables of sections 3.2.3 and 4.2.4 of FMI 2.0.5; sections 2.3, 3.2 and 4.2
   of FMI 3.0.2. Conditions on the variable are in settable_in of values.c. Differs from the standards: setTime in
   Event Mode is accepted for all FMUs, as importers call it there; after a discarded step the FMU is as before
   it, so that values may be set and the step repeated without restoring a saved state, in FMI 2 too. */
#ifndef BALLSCREW_FMI_COMMON_H
#define BALLSCREW_FMI_COMMON_H

#include "life_cycle.h"
#include "messages.h"
#include "saved_state.h"
#include "values.h"

#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter" /* the standards fix the arguments */
#endif

#define RUNNING (STEP_MODE | EVENT_MODE | CONTINUOUS_TIME_MODE)
#define EVALUATED (INITIALIZATION_MODE | RUNNING | TERMINATED | FAILED)
#define SETTABLE (INSTANTIATED | INITIALIZATION_MODE | STEP_MODE | EVENT_MODE)

/* self: the instance, of the handle that the importer has as `instance` */
#define BEGIN(error, kinds, states) \
    Instance *const self = instance_begin(instance, __func__, kinds, states); \
    if (self == NULL) { \
        return error; \
    }

/* Output arguments are optional. */
#define PUT(argument, value) \
    do { \
        if ((argument) != NULL) { \
            *(argument) = (value); \
        } \
    } while (false)

#endif
