/* Friction at and near standstill. Twin of runtime/standstill.py, where the laws are derived. Numbers: number.h.
   Source: Dupont, Hayward, Armstrong, Altpeter, IEEE Trans. Automat. Contr. 47 (2002) 787. */
#ifndef BALLSCREW_BRISTLE_LAW_H
#define BALLSCREW_BRISTLE_LAW_H

#include "constants.h"
#include "number.h"

typedef struct {
    Number deflection; /* [rad] at the end of the step */
    Number rate;       /* [rad/s] of the deflection */
    Number torque;     /* [N.m] at the end of the step, at most the Coulomb torque */
    Number power;      /* [W] dissipated, mean of the step */
    Number supply;     /* [W] of the motion, mean of the step: power and rate of the stored energy */
} Bristle;

/* Smoothed sign of the speed. Regularization speed 0: the sign itself. */
static inline Number regularised_sign(Number speed, Number regularization_speed)
{
    Number ratio;
    double sign;

    if (!(value_of(regularization_speed) > 0.0)) {
        return constant(value_of(speed) > 0.0 ? 1.0 : value_of(speed) < 0.0 ? -1.0 : 0.0);
    }
    ratio = divide(speed, regularization_speed);
    sign = tanh(value_of(ratio));
    return function(ratio, sign, 1.0 - sign * sign);
}

/* Deflection at another stiffness with the same energy: the stiffness follows preload and axial load. */
static inline Number bristle_at_stiffness(Number deflection, double before, Number stiffness)
{
    if (!(value_of(stiffness) > 0.0)) {
        return constant(0.0);
    }
    if (value_of(stiffness) == before && slope_of(stiffness) == 0.0) {
        return deflection;
    }
    return multiply(root(divide(constant(before), stiffness)), deflection);
}

/* Deflection at the start of a simulation. side: share of that at which the bristle slides, -1 to 1; 0: from the speed */
static inline Number initial_deflection(Number side, double speed, Number coulomb, Number stiffness)
{
    if (value_of(side) == 0.0) {
        side = constant(speed > 0.0 ? 1.0 : speed < 0.0 ? -1.0 : 0.0);
    }
    if (!(value_of(coulomb) > 0.0 && value_of(stiffness) > 0.0)) {
        return constant(0.0);
    }
    return multiply(clamped(side, -1.0, 1.0), divide(coulomb, stiffness));
}

/* limit: deflection at which the bristle slides */
static inline Number bristle_within(Number deflection, Number limit)
{
    return lesser(greater(deflection, negative(limit)), limit);
}

/* Share of the motion that slides, 0 to 1, for motion in the direction of the speed. */
static inline Number bristle_yielding(Number wound, Number speed, Number limit)
{
    const Number beyond = subtract(with_sign_of(wound, speed), times(ELASTIC_SHARE, limit));

    if (!(value_of(limit) > 0.0)) {
        return constant(1.0);
    }
    return greater(divide(beyond, times(1.0 - ELASTIC_SHARE, limit)), constant(0.0));
}

/* At an instant, without damping. */
static inline Bristle bristle_at_instant(Number deflection, Number speed, Number coulomb, Number stiffness)
{
    const Number limit = divide(coulomb, stiffness), wound = bristle_within(deflection, limit);
    const Number yielding = bristle_yielding(wound, speed, limit);
    Bristle out;

    out.deflection = deflection;
    out.rate = multiply(speed, subtract(constant(1.0), yielding));
    out.torque = multiply(stiffness, wound);
    out.supply = multiply(out.torque, speed);
    out.power = multiply(out.supply, yielding);
    return out;
}

/* As a continuous state. slip: 0 the bristle follows, +1 or -1 direction of slip, with constant deflection. */
static inline Bristle bristle_continuous(Number deflection, Number speed, Number coulomb, Number stiffness,
                                         Number damping, int slip)
{
    Bristle out = bristle_at_instant(deflection, speed, coulomb, stiffness);
    const Number elastic = out.torque;

    if (slip != 0) {
        out.rate = constant(0.0);
        out.torque = times(slip, coulomb);
        out.power = out.supply = multiply(coulomb, absolute(speed));
        return out;
    }
    out.torque = bristle_within(add(elastic, multiply(damping, out.rate)), coulomb);
    out.supply = multiply(out.torque, speed);
    out.power = greater(subtract(out.supply, multiply(elastic, out.rate)), constant(0.0));
    return out;
}

/* Exact step of length > 0 at constant speed, stiffness > 0. */
static inline Bristle bristle_after_step(Number before, Number speed, double step, Number coulomb, Number stiffness,
                                         Number damping)
{
    const Number limit = divide(coulomb, stiffness), half = times(0.5, stiffness), zero = constant(0.0);
    const Number z = bristle_within(before, limit), q_0 = with_sign_of(z, speed);
    const Number elastic_to = times(ELASTIC_SHARE, limit), travel = times(step, absolute(speed));
    const Number elastic = lesser(travel, greater(subtract(elastic_to, q_0), zero));
    const Number sliding = subtract(travel, elastic);
    /* energy stored above the present limit, which is lower if the Coulomb torque has decreased, is lost */
    const Number lost = multiply(half, subtract(multiply(before, before), multiply(z, z)));
    Number q = add(q_0, elastic), rate, heat, work;
    Number integral = add(multiply(q_0, elastic), times(0.5, multiply(elastic, elastic))); /* of q over the travel */
    Bristle out;

    if (!(value_of(coulomb) > 0.0)) {
        out.deflection = out.torque = out.supply = zero;
        out.rate = over(negative(before), step);
        out.power = over(lost, step);
        return out;
    }
    if (value_of(sliding) > 0.0) {
        const Number span = subtract(limit, elastic_to), gap = subtract(limit, q);
        const Number decay = saturation(divide(sliding, span));
        integral = add(integral, subtract(multiply(limit, sliding), multiply(multiply(gap, span), decay)));
        q = add(q, multiply(gap, decay));
    }
    rate = over(subtract(q, q_0), step);
    /* of the mean torque, which is limited to the Coulomb torque like that at the end */
    work = lesser(add(multiply(stiffness, integral), multiply(multiply(damping, rate), travel)),
                  multiply(coulomb, travel));
    heat = subtract(work, multiply(half, subtract(multiply(q, q), multiply(q_0, q_0))));
    out.deflection = with_sign_of(q, speed);
    out.rate = over(subtract(out.deflection, before), step);
    out.torque = with_sign_of(lesser(add(multiply(stiffness, q), multiply(damping, rate)), coulomb), speed);
    out.power = over(add(lost, greater(heat, zero)), step);
    out.supply = over(work, step);
    return out;
}

#endif
