/* Outputs of the friction FMU by name. Twin of runtime/outputs.py. Numbers: number.h. A new output is assigned here, in
   torque_outputs or film_outputs, according to `needs` in its row of the table of variables. */
#ifndef BALLSCREW_FRICTION_LAW_H
#define BALLSCREW_FRICTION_LAW_H

#include "bristle_law.h"
#include "nut.h"
#include "tangent.h"
#include "variables.h"

static inline Friction friction_of(const Number at[])
{
    const Friction out = {at[APPARENT_VISCOSITY_RATIO], at[NET_SLIDING_COEFFICIENT], at[ROUGHNESS_HEIGHT],
                          at[BREAKAWAY_FACTOR]};
    return out;
}

/* Stiffness of the bristle at these loads: as set, or from the screw. One that is next to 0 counts as 0, or a
   deflection would not be finite. */
static inline Number stiffness_at(const Number at[], const Map *map, Loads *loads, const Friction *friction)
{
    return value_of(at[PRESLIDING_STIFFNESS]) >= LEAST_STIFFNESS ? at[PRESLIDING_STIFFNESS]
                                                                 : nut_stiffness(map, loads, friction);
}

static inline Number damping_at(const Number at[], Number stiffness)
{
    return value_of(at[PRESLIDING_DAMPING]) > 0.0 ? at[PRESLIDING_DAMPING] : times(DAMPING_TIME, stiffness);
}

/* A step without presliding, or where there is no Coulomb torque: what the bristle stored becomes heat. */
static inline Bristle bristle_unwound(Number deflection, const Moment *moment)
{
    const Number none = constant(0.0), stored = times(0.5 * moment->stiffness, multiply(deflection, deflection));
    const Bristle out = {none, none, none, moment->step > 0.0 ? over(stored, moment->step) : none, none};

    return out;
}

/* The bristle as a continuous state, at the present stiffness. The state is the deflection at the stiffness of the last
   event, that of the Moment, with the same energy: so it follows the loads without their rates. */
static inline Bristle bristle_of_state(const Number at[], Number coulomb, Number stiffness, const Moment *moment)
{
    const Number state = at[PRESLIDING_DEFLECTION];
    Bristle out;

    if (moment->slip == 0 && !(value_of(stiffness) > 0.0 && moment->stiffness > 0.0)) {
        out.rate = out.torque = out.power = out.supply = constant(0.0); /* until the event that is due */
    } else {
        out = bristle_continuous(bristle_at_stiffness(state, moment->stiffness, stiffness), at[SPEED], coulomb, stiffness,
                                 damping_at(at, stiffness), moment->slip);
    }
    if (moment->slip == 0 && moment->stiffness > 0.0) {
        out.rate = multiply(out.rate, root(over(stiffness, moment->stiffness)));
    }
    out.deflection = state;
    return out;
}

/* stiffness: at the present loads */
static inline Bristle bristle_at(const Number at[], Number coulomb, Number stiffness, const Moment *moment)
{
    const Number speed = at[SPEED];
    Number deflection = at[PRESLIDING_DEFLECTION];

    if (moment->continuous && moment->start == RUNNING) {
        return bristle_of_state(at, coulomb, stiffness, moment);
    }
    if (moment->start == FROM_SIDE) {
        deflection = initial_deflection(at[PRESLIDING_SIDE], value_of(speed), coulomb, stiffness);
    } else if (moment->start == RUNNING) {
        deflection = bristle_at_stiffness(deflection, moment->stiffness, stiffness);
    }
    if (!(value_of(stiffness) > 0.0) && !(moment->continuous && moment->slip != 0)) {
        return bristle_unwound(at[PRESLIDING_DEFLECTION], moment);
    }
    if (moment->continuous || moment->slip != 0) {
        return bristle_continuous(deflection, speed, coulomb, stiffness, damping_at(at, stiffness), moment->slip);
    }
    return moment->step > 0.0
               ? bristle_after_step(deflection, speed, moment->step, coulomb, stiffness, damping_at(at, stiffness))
               : bristle_at_instant(deflection, speed, coulomb, stiffness);
}

/* loads_a: nut A has the larger force, of equal ones either */
static inline void torque_outputs(const Parts *parts, const Bristle *bristle, bool loads_a, const Number at[],
                                  Number out[])
{
    const Number speed = at[SPEED], coulomb = coulomb_magnitude(parts);
    const int relieved = loads_a ? FRICTION_TORQUE_NUT_B : FRICTION_TORQUE_NUT_A;
    const int loaded = loads_a ? FRICTION_TORQUE_NUT_A : FRICTION_TORQUE_NUT_B;
    Number sign, power_loss = multiply(parts->viscous, absolute(speed));

    if (value_of(at[PRESLIDING]) != 0.0) {
        sign = value_of(coulomb) > 0.0 ? divide(bristle->torque, coulomb) : constant(0.0);
        power_loss = add(power_loss, bristle->power);
    } else {
        sign = regularised_sign(speed, at[REGULARIZATION_SPEED]);
        power_loss = add(add(power_loss, multiply(multiply(coulomb, sign), speed)), bristle->power);
    }
    out[VISCOUS_TORQUE] = with_sign_of(parts->viscous, speed);
    out[HYSTERESIS_TORQUE] = multiply(sign, parts->hysteresis);
    out[SLIDING_TORQUE] = multiply(sign, parts->sliding);
    out[FRICTION_TORQUE] = add(add(out[VISCOUS_TORQUE], out[HYSTERESIS_TORQUE]), out[SLIDING_TORQUE]);
    out[relieved] =
        add(with_sign_of(parts->relieved_viscous, speed), multiply(sign, parts->relieved_coulomb));
    out[loaded] = subtract(out[FRICTION_TORQUE], out[relieved]);
    out[POWER_LOSS] = power_loss;
}

/* Accumulated heat after the step, from its mean power. In model exchange, where the importer integrates the power,
   that of events alone: a continuous state for it would cost each solver a column of its Jacobian and an error
   control, for a quantity that feeds back on nothing. */
static inline void heat_output(const Moment *moment, Number out[])
{
    out[HEAT] = add(constant(moment->heat),
                    moment->continuous ? constant(0.0) : times(moment->step, out[POWER_LOSS]));
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
