/* Outputs of the friction FMU by name. Twin of runtime/outputs.py. Numbers: number.h. A new output is assigned here, in
   torque_outputs or film_outputs, according to `needs` in its row of the table of variables. */
#ifndef BALLSCREW_FRICTION_LAW_H
#define BALLSCREW_FRICTION_LAW_H

#include "bristle_law.h"
#include "nut.h"
#include "variables.h"

static inline Friction friction_of(const Number at[])
{
    const Friction out = {at[APPARENT_VISCOSITY_RATIO], at[NET_SLIDING_COEFFICIENT], at[ROUGHNESS_HEIGHT],
                          at[BREAKAWAY_FACTOR]};
    return out;
}

/* step: [s] that the outputs belong to, 0: an instant; slip: mode of a bristle with events */
static inline Bristle bristle_at(const Number at[], Number coulomb, double step, bool continuous, int slip)
{
    const Number deflection = at[PRESLIDING_DEFLECTION], speed = at[SPEED], stiffness = at[PRESLIDING_STIFFNESS];

    if (continuous || slip != 0) {
        return bristle_continuous(deflection, speed, coulomb, stiffness, at[PRESLIDING_DAMPING], slip);
    }
    return step > 0.0 ? bristle_after_step(deflection, speed, step, coulomb, stiffness, at[PRESLIDING_DAMPING])
                      : bristle_at_instant(deflection, speed, coulomb, stiffness);
}

static inline void torque_outputs(const Parts *parts, const Bristle *bristle, const Number at[], Number out[])
{
    const Number speed = at[SPEED], coulomb = coulomb_magnitude(parts);
    Number sign, power_loss = multiply(parts->viscous, absolute(speed));

    if (value_of(at[PRESLIDING_STIFFNESS]) > 0.0) {
        sign = value_of(coulomb) > 0.0 ? divide(bristle->torque, coulomb) : constant(0.0);
        power_loss = add(power_loss, bristle->power);
    } else {
        sign = regularised_sign(speed, at[REGULARIZATION_SPEED]);
        power_loss = add(power_loss, multiply(multiply(coulomb, sign), speed));
    }
    out[VISCOUS_TORQUE] = with_sign_of(parts->viscous, speed);
    out[HYSTERESIS_TORQUE] = multiply(sign, parts->hysteresis);
    out[SLIDING_TORQUE] = multiply(sign, parts->sliding);
    out[FRICTION_TORQUE] = add(add(out[VISCOUS_TORQUE], out[HYSTERESIS_TORQUE]), out[SLIDING_TORQUE]);
    out[POWER_LOSS] = power_loss;
}

static inline void film_outputs(const Films *films, const Number at[], Number out[])
{
    out[FILM_THICKNESS_MIN] = films->minimum;
    out[FILM_THICKNESS_CENTRAL_SCREW] = films->central_screw;
    out[FILM_THICKNESS_CENTRAL_NUT] = films->central_nut;
    out[FILM_TEMPERATURE_RISE] = films->rise;
    out[CONTACT_PRESSURE_MAX] = films->pressure;
    out[BALL_LOAD_MAX] = films->ball_load;
    out[LAMBDA_RATIO] = lambda_ratio(films->minimum, at[ROUGHNESS_HEIGHT]);
}

#endif
