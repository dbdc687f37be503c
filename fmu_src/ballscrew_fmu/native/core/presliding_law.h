/* Friction at and near standstill: elasto-slip elements in parallel (Maxwell-slip). Twin of runtime/standstill.py, where
   the law is derived. Numbers: number.h.
   Source: Al-Bender, Swevers, IEEE Control Syst. Mag. 28 (2008) 64; Iwan, J. Appl. Mech. 33 (1966) 893. */
#ifndef BALLSCREW_PRESLIDING_LAW_H
#define BALLSCREW_PRESLIDING_LAW_H

#include "constants.h"
#include "number.h"

/* Level of all elements at a moment. */
typedef struct {
    Number coulomb; /* [N.m] torque of sliding */
    Number root;    /* [sqrt(N.m/rad)] of the stiffness of one element */
    Number damping; /* [N.m.s/rad] of all elements */
    Number unit;    /* state at which the first element slides; element i at 2 i + 1 times it: even yield travels */
} PreslidingLevel;

/* The state of an element is its deflection times the root of its stiffness [rad at 1 N.m/rad]: its energy is half the
   square of that. So the energy stays when the stiffness follows preload and axial load. */
typedef struct {
    Number element[ELEMENTS]; /* at the end of the step */
    Number rate[ELEMENTS];    /* per second */
    Number torque;            /* [N.m] at the end of the step, at most the Coulomb torque */
    Number power;             /* [W] dissipated, mean of the step */
    Number supply;            /* [W] of the motion, mean of the step: power and rate of the stored energy */
} Presliding;

/* Whether the stiffness follows the loads at the same energy. While elements hold a load it stays: if it followed, a
   preload that swings would let the screw creep. free: none holds one, or all slide. */
static inline bool stiffness_follows(bool free, double fixed, double present)
{
    return free || !(fixed <= STIFFNESS_RATIO * present && present <= STIFFNESS_RATIO * fixed);
}

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

/* stiffness: of all elements at rest [N.m/rad]; 0: none, which has no Coulomb torque either */
static inline PreslidingLevel presliding_level(Number coulomb, Number stiffness, Number damping)
{
    PreslidingLevel out = {coulomb, root(over(stiffness, ELEMENTS)), damping, constant(0.0)};

    if (value_of(out.root) > 0.0 && value_of(coulomb) > 0.0) {
        out.unit = divide(coulomb, times((double)ELEMENTS * ELEMENTS, out.root));
    }
    return out;
}

/* Event indicator, to where the stiffness that is held follows that of the loads. */
static inline double distance_to_stiffness(double fixed, double present)
{
    if (fixed == present) {
        return 1.0;
    }
    if (!(fixed > 0.0 && present > 0.0)) {
        return -1.0;
    }
    return STIFFNESS_RATIO - (fixed > present ? fixed / present : present / fixed);
}

/* Whether no element holds a load, or all slide. unit: limit of the first element. */
static inline bool elements_free(const double element[ELEMENTS], double unit)
{
    int slide = 0, relaxed = 0;

    for (int i = 0; i < ELEMENTS; ++i) {
        slide += fabs(element[i]) >= (2.0 * i + 1.0) * unit;
        relaxed += element[i] == 0.0;
    }
    return slide == ELEMENTS || relaxed == ELEMENTS;
}

static inline Number element_within(Number element, Number limit)
{
    return lesser(greater(element, negative(limit)), limit);
}

static inline Number energy_of_elements(const Number element[ELEMENTS])
{
    Number sum = constant(0.0);

    for (int i = 0; i < ELEMENTS; ++i) {
        sum = add(sum, multiply(element[i], element[i]));
    }
    return times(0.5, sum);
}

/* Elements at the start of a simulation, after a travel from rest without load. side: share of the travel at which all
   slide, -1 to 1; 0: from the speed */
static inline void initial_elements(Number side, double speed, const PreslidingLevel *level, Number element[ELEMENTS])
{
    const Number unit = level->unit;
    Number travel;

    if (value_of(side) == 0.0) {
        side = constant(speed > 0.0 ? 1.0 : speed < 0.0 ? -1.0 : 0.0);
    }
    travel = multiply(clamped(side, -1.0, 1.0), times(2.0 * ELEMENTS, unit));
    for (int i = 0; i < ELEMENTS; ++i) {
        element[i] = element_within(travel, times(2.0 * i + 1.0, unit));
    }
}

/* Adds the damping of the elements that move: damped [N.m] along the speed; the sum is at most the Coulomb torque.
   elastic: torque along the speed without damping. */
static inline Number damped_torque(Number elastic, Number damped, Number coulomb)
{
    return lesser(add(elastic, damped), coulomb);
}

/* Exact step of length > 0 at constant speed. An element above a level that has decreased loses the energy above it; one
   below a level that has increased stays. */
static inline void presliding_after_step(const Number before[ELEMENTS], Number speed, double step,
                                         const PreslidingLevel *level, Presliding *out)
{
    const Number travel = absolute(times(step, speed)), length = multiply(level->root, travel);
    const Number way = with_sign_of(length, speed);
    const double per_second = step > 1e-300 ? 1.0 / step : 0.0; /* infinite where the step has no normal number */
    Number from[ELEMENTS], slack = constant(0.0), moved = slack, lost = slack, stored = slack, sum = slack, heat, damped,
                           work;

    for (int i = 0; i < ELEMENTS; ++i) {
        const Number limit = times(2.0 * i + 1.0, level->unit);

        from[i] = element_within(before[i], limit);
        out->element[i] = element_within(add(from[i], way), limit);
        out->rate[i] = times(per_second, subtract(out->element[i], before[i]));
    }
    for (int i = 0; i < ELEMENTS; ++i) {
        const Number to = out->element[i], change = subtract(to, from[i]);

        lost = add(lost, multiply(subtract(before[i], from[i]), add(before[i], from[i])));
        stored = add(stored, multiply(change, add(to, from[i])));
        slack = add(slack, times(2.0 * i + 1.0, change));
        moved = add(moved, change);
        sum = add(sum, to);
    }
    lost = times(0.5, lost);
    stored = times(0.5, stored);
    /* all move along the speed: what they do not follow, they slide */
    heat = multiply(level->unit, subtract(times((double)ELEMENTS * ELEMENTS, length), absolute(slack)));
    heat = greater(heat, constant(0.0)); /* rounding */
    /* of the mean deflection; it is 0 without stiffness */
    damped = value_of(level->root) > 0.0
                 ? multiply(level->damping, times(per_second / ELEMENTS, absolute(divide(moved, level->root))))
                 : constant(0.0);
    work = damped_torque(add(heat, stored), multiply(damped, travel), multiply(level->coulomb, travel));
    sum = multiply(level->root, value_of(speed) < 0.0 ? negative(sum) : sum);
    out->torque = with_sign_of(damped_torque(sum, damped, level->coulomb), speed);
    out->power = times(per_second, add(lost, greater(subtract(work, stored), heat)));
    out->supply = times(per_second, work);
}

/* At an instant. slips: bit per element that slides (model exchange), in direction; the others follow the motion, except
   those at their limit, of which torque and power are those of sliding. The state of one that slides follows its limit,
   not faster than the motion and within follow_time [s]: what it stores is taken from the work of sliding. Its torque is
   that of the state and the motion in follow_time: a level that rises does not raise it without motion. */
static inline void presliding_at_instant(const Number element[ELEMENTS], Number speed, const PreslidingLevel *level,
                                         bool continuous, unsigned slips, int direction, double follow_time,
                                         Presliding *out)
{
    const Number pace = absolute(speed);
    const Number travel = multiply(level->root, pace);
    Number along = constant(0.0), power = along, stored = along, elastic, damped;
    int moving = 0;

    for (int i = 0; i < ELEMENTS; ++i) {
        const Number limit = times(2.0 * i + 1.0, level->unit);
        const Number limited = element_within(element[i], limit);
        const Number loaded = value_of(speed) < 0.0 ? negative(element[i]) : element[i];

        out->element[i] = element[i];
        out->rate[i] = constant(0.0);
        if ((slips >> i & 1U) != 0U) {
            const Number state = times(direction, element[i]);
            const Number torque = lesser(limit, add(state, times(follow_time, travel)));

            along = add(along, (direction < 0) == (value_of(speed) < 0.0) ? torque : negative(torque));
            power = add(power, multiply(torque, pace));
            out->rate[i] = element_within(over(subtract(limit, state), follow_time), travel);
            out->rate[i] = times(direction, out->rate[i]);
            stored = add(stored, multiply(element[i], out->rate[i]));
        } else if (value_of(speed) != 0.0 && value_of(loaded) >= value_of(limit)) {
            along = add(along, limit);
            power = add(power, multiply(limit, pace));
            if (continuous) { /* on beyond the limit: an integrator finds the event more easily */
                out->rate[i] = multiply(level->root, speed);
            }
        } else {
            const Number signed_limited = value_of(speed) < 0.0 ? negative(limited) : limited;

            out->rate[i] = multiply(level->root, speed);
            along = add(along, signed_limited);
            /* 0 unless above a level that decreases */
            power = add(power, multiply(subtract(signed_limited, loaded), pace));
            ++moving;
        }
    }
    elastic = multiply(level->root, along);
    damped = continuous ? multiply(times((double)moving / ELEMENTS, level->damping), pace) : constant(0.0);
    out->torque = damped_torque(elastic, damped, level->coulomb);
    power = add(multiply(level->root, power), subtract(multiply(subtract(out->torque, elastic), pace), stored));
    out->power = greater(power, constant(0.0));
    out->supply = multiply(out->torque, pace);
    out->torque = with_sign_of(out->torque, speed);
}

#endif
