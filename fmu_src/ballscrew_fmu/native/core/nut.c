/* The law of a nut for doubles. */
#include "nut_law.h"
