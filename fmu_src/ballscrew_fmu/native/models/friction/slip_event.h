/* Start of slip: where the bristle of a step at constant speed reaches the deflection at which it slips. */
#ifndef BALLSCREW_SLIP_EVENT_H
#define BALLSCREW_SLIP_EVENT_H

#include "constants.h"
#include "number.h"

/* Travel to the start of slip [rad], inverse of bristle_after_step: the bristle follows to ELASTIC_SHARE of the sliding
   deflection, then approaches it exponentially. wound: deflection along the motion; sliding: sliding deflection > 0. */
static inline double travel_to_slip(double wound, double sliding)
{
    const double elastic_to = ELASTIC_SHARE * sliding, from = wound > -sliding ? wound : -sliding;
    const double elastic = elastic_to > from ? elastic_to - from : 0.0, gap = sliding - (from + elastic);
    const double left = (1.0 - SLIDING_FROM) * sliding;

    return gap > left ? elastic + (sliding - elastic_to) * log(gap / left) : 0.0;
}

#endif
