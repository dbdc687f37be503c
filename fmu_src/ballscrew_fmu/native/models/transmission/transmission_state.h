/* State of BallScrewTransmission. */
#include "transmission_point.h"
#include "screw_state.h"
