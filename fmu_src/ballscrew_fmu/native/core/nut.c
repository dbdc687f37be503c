/* The law of a nut in doubles. */
#include "nut_law.h"
