/* Outputs of the transmission by name: torque, force, friction of both nuts, powers. Twin of runtime/transmission.py,
   where the laws are derived. Friction and films by name are those of friction_law.h. Numbers: number.h. */
#ifndef BALLSCREW_TRANSMISSION_LAW_H
#define BALLSCREW_TRANSMISSION_LAW_H

#include "contacts.h"
#include "friction_law.h"

static inline void transmission_outputs(const Contacts *contacts, const Parts *both, const Presliding *presliding,
                                        const Number at[], double step, Number out[])
{
    const Contact a = contacts->a, b = contacts->b;
    const Number ratio = screw_ratio(at), speed = at[SPEED], drift = contacts->drift;
    const Number stiffness = add(a.slope, b.slope);
    const Number damping = multiply(multiply(at[CONTACT_DAMPING_TIME], stiffness), drift);
    const Number elastic = subtract(a.force, b.force), force = add(elastic, damping), ideal = multiply(ratio, force);
    const Number magnitude = add(both->viscous, coulomb_magnitude(both));
    const Number held = energy_of_elements(presliding->element);
    Number mean = force, mean_damping = damping, friction_power, friction;

    torque_outputs(both, presliding, loads_nut_a(contacts), at, out);
    friction = out[FRICTION_TORQUE];
    friction_power = value_of(at[PRESLIDING]) != 0.0 ? add(multiply(both->viscous, absolute(speed)), presliding->supply)
                                                     : multiply(friction, speed);
    if (step > 0.0) {
        const Number d_0 = contacts->preloaded, k = contacts->stiffness, first = contacts->first;
        const Number before = subtract(contact_law(k, add(d_0, first)).force, contact_law(k, subtract(d_0, first)).force);
        mean_damping = over(multiply(at[CONTACT_DAMPING_TIME], subtract(elastic, before)), step);
        mean = add(mean_elastic_force(contacts, first, contacts->last), mean_damping);
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
        add(multiply(contacts->last, mean_elastic_force(contacts, constant(0.0), contacts->last)), held);
}

#endif
