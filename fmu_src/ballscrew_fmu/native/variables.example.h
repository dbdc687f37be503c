/* GENERATED from the table of variables: do not edit. */
#ifndef BALLSCREW_VARIABLES_H
#define BALLSCREW_VARIABLES_H

#define MODEL_NAME "BallScrewFrictionNative"
#define MODEL_TOKEN "{8c4e...}" /* guid or instantiationToken */
#define MODEL_MAP "<content hash of the map>"

#include <stdbool.h>

enum Reference {
    PRELOAD = 0, SPEED, TEMPERATURE, AXIAL_LOAD,
    FRICTION_TORQUE, VISCOUS_TORQUE, HYSTERESIS_TORQUE, SLIDING_TORQUE, POWER_LOSS,
    FILM_THICKNESS_MIN, FILM_THICKNESS_CENTRAL_SCREW, FILM_THICKNESS_CENTRAL_NUT, FILM_TEMPERATURE_RISE,
    CONTACT_PRESSURE_MAX, BALL_LOAD_MAX, LAMBDA_RATIO, IN_RANGE,
    APPARENT_VISCOSITY_RATIO, NET_SLIDING_COEFFICIENT, ROUGHNESS_HEIGHT, REGULARIZATION_SPEED,
    PRESLIDING_STIFFNESS, PRESLIDING_DAMPING,
    PRESLIDING_DEFLECTION, PRESLIDING_DEFLECTION_RATE, IN_RANGE_INDICATOR, SLIP_INDICATOR,
    VARIABLE_COUNT
};

enum Causality { CAUSALITY_INPUT, CAUSALITY_OUTPUT, CAUSALITY_PARAMETER, CAUSALITY_STATE, CAUSALITY_RATE };

typedef struct {
    const char *name;
    enum Causality causality;
    bool boolean;
    double start;     /* of inputs, parameters and the state, else 0 */
    double lowest;    /* of what may be set: -1e30 for inputs, 0 for parameters */
} Variable;

extern const Variable model_variables[VARIABLE_COUNT];

#define INPUT_FIRST PRELOAD
#define INPUT_COUNT 4

#endif
