/* State of BallScrewTransmission. */
#include "coupling.h"
#include "transmission_point.h"

#define MODEL_COUPLING
#define MODEL_COUPLING_NUMBERS(X) \
    X(coupling.way) X(coupling.drift) X(coupling.acceleration) X(coupling.steps) X(coupling.aa)
#define MODEL_COUPLING_ARRAYS(X) \
    X(coupling.force, 3) X(coupling.ff, 2) X(coupling.fa, 2) X(coupling.miss, 2) \
    X(coupling.window, WINDOWS) X(coupling.first, WINDOWS) X(coupling.grown, WINDOWS)
#include "screw_state.h"
