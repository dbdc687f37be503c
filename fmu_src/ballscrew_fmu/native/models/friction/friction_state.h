/* State of BallScrewFriction. */
#include "friction_point.h"
#include "screw_state.h"
