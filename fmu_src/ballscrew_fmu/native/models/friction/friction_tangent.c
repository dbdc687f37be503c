/* Outputs of the friction FMU in dual numbers. */
#define DUAL_NUMBERS
#include "friction_point.h"
#include "tangent_law.h"
