/* Outputs of the transmission by name: torque, force, friction of both nuts, powers. Twin of runtime/transmission.py,
   where the laws are derived. Friction and films by name are those of friction_law.h. Numbers: number.h. */
#ifndef BALLSCREW_TRANSMISSION_LAW_H
#define BALLSCREW_TRANSMISSION_LAW_H

#include "contacts.h"
#include "friction_law.h"

/* Friction of one nut from that of two equal ones, the unit of the map. */
static inline Parts parts_of_one(Parts two)
{
    const Parts one = {times(0.5, two.viscous), times(0.5, two.hysteresis), times(0.5, two.sliding)};
    return one;
}

static inline Parts parts_of_both(const Parts nut[2])
{
    const Parts both = {add(nut[0].viscous, nut[1].viscous), add(nut[0].hysteresis, nut[1].hysteresis),
                        add(nut[0].sliding, nut[1].sliding)};
    return both;
}

static inline Films films_of_both(Films a, Films b)
{
    const Films both = {lesser(a.minimum, b.minimum),     lesser(a.central_screw, b.central_screw),
                        lesser(a.central_nut, b.central_nut), greater(a.rise, b.rise),
                        greater(a.pressure, b.pressure),  greater(a.ball_load, b.ball_load)};
    return both;
}

/* Share of the power that arrives in steady motion. friction: magnitude at motion */
static inline Number efficiency_of(Number ideal_torque, Number friction, Number speed)
{
    const Number ideal = absolute(ideal_torque);

    if (!(value_of(ideal) > 0.0)) {
        return constant(0.0);
    }
    if (value_of(ideal_torque) * value_of(speed) >= 0.0) {
        return divide(ideal, add(ideal, friction));
    }
    return divide(greater(subtract(ideal, friction), constant(0.0)), ideal);
}

/* Stiffness of the bristle of both nuts, each with the half of two nuts at its force. */
static inline Number stiffness_of_both(const Number at[], const Map *map, Loads loads[2], const Friction *friction)
{
    return times(0.5, add(stiffness_at(at, map, &loads[0], friction), stiffness_at(at, map, &loads[1], friction)));
}

/* Least distance from the limits of preload, speed, temperature and force of the loaded nut, each as a share of the
   length of its axis. */
static inline Number margin_of_contacts(const Map *map, const Contacts *contacts, const Number at[])
{
    const Number highest = greater(contacts->a.force, contacts->b.force);
    const Number left = subtract(constant(map->force.hi * (1.0 + FORCE_ROUNDING)), highest);

    return lesser(nut_margin(map, at[PRELOAD], at[SPEED], at[TEMPERATURE]), over(left, map->force.hi));
}

/* bristle_stiffness: that the deflection of the bristle belongs to */
static inline void transmission_outputs(const Contacts *contacts, const Parts nut[2], const Bristle *bristle,
                                        Number bristle_stiffness, const Number at[], double step, Number out[])
{
    const Contact a = contacts->a, b = contacts->b;
    const Number ratio = screw_ratio(at), speed = at[SPEED], drift = contacts->drift;
    const Number stiffness = add(a.slope, b.slope);
    const Number damping = multiply(multiply(at[CONTACT_DAMPING_TIME], stiffness), drift);
    const Number elastic = subtract(a.force, b.force), force = add(elastic, damping), ideal = multiply(ratio, force);
    const Parts both = parts_of_both(nut);
    const Number coulomb = coulomb_magnitude(&both), magnitude = add(both.viscous, coulomb);
    const Number wound =
        multiply(times(0.5, bristle_stiffness), multiply(bristle->deflection, bristle->deflection));
    Number mean = force, mean_damping = damping, friction_power, friction;

    torque_outputs(&both, bristle, at, out);
    friction = out[FRICTION_TORQUE];
    friction_power = value_of(at[PRESLIDING]) != 0.0 ? add(multiply(both.viscous, absolute(speed)), bristle->supply)
                                                     : multiply(friction, speed);
    if (step > 0.0) {
        const Number d_0 = contacts->preloaded, k = contacts->stiffness, first = contacts->first;
        const Number before = subtract(contact_law(k, add(d_0, first)).force, contact_law(k, subtract(d_0, first)).force);
        mean_damping = over(multiply(at[CONTACT_DAMPING_TIME], subtract(elastic, before)), step);
        mean = add(mean_elastic_force(contacts, first, contacts->last), mean_damping);
    }
    for (int n = 0; n < 2; ++n) {
        const Number share = value_of(coulomb) > 0.0 ? divide(coulomb_magnitude(&nut[n]), coulomb) : constant(0.0);
        out[n == 0 ? FRICTION_TORQUE_NUT_A : FRICTION_TORQUE_NUT_B] =
            add(with_sign_of(nut[n].viscous, speed), multiply(share, add(out[HYSTERESIS_TORQUE], out[SLIDING_TORQUE])));
    }
    out[SCREW_TORQUE] = add(ideal, friction);
    out[NUT_FORCE] = force;
    out[FORCE_NUT_A] = a.force;
    out[FORCE_NUT_B] = b.force;
    out[DAMPING_FORCE] = damping;
    out[AXIAL_DEFLECTION] = contacts->last;
    out[AXIAL_STIFFNESS] = stiffness;
    out[EFFICIENCY] = efficiency_of(ideal, magnitude, speed);
    out[SHAFT_POWER] = add(multiply(mean, multiply(ratio, speed)), friction_power);
    out[NUT_POWER] = multiply(mean, at[VELOCITY]);
    out[POWER_LOSS] = add(out[POWER_LOSS], multiply(mean_damping, drift));
    out[STORED_ENERGY] =
        add(multiply(contacts->last, mean_elastic_force(contacts, constant(0.0), contacts->last)), wound);
}

#endif
