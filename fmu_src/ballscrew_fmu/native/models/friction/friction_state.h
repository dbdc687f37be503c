/* State of BallScrewFriction. */
#include "friction_point.h"

#define MODEL_COUPLING_NUMBERS(X)
#define MODEL_COUPLING_ARRAYS(X)
#include "screw_state.h"
