/* Outputs of the transmission in dual numbers. */
#define DUAL_NUMBERS
#include "transmission_point.h"
#include "tangent_law.h"
