/* What BallScrewTransmission computes at a point of its inputs: contacts, loads, outputs, range.
   The laws are in contacts.h. Numbers: number.h. */
#ifndef BALLSCREW_POINT_H
#define BALLSCREW_POINT_H

#include <string.h>

#include "contacts.h"
#include "friction_law.h"

typedef struct {
    bool kept;                /* contact and approach, valid while the numbers that they belong to do not change: */
    double of[5];             /* preload, temperature difference, nut stiffness, its preload, play */
    Number preload;           /* [N] at the temperature difference of screw and nut */
    Number contact, approach; /* k [N/m^1.5]; without load [m] */
    Contacts contacts;
    Loads loads;
    Conditions conditions;
} Point;

/* Contacts, loads and conditions at the end of a step [s] from this point; 0: an instant */
static inline void point_locate(const Map *map, const Number at[], double step, Point *point)
{
    const double of[] = {value_of(at[PRELOAD]), value_of(at[TEMPERATURE_DIFFERENCE]), value_of(at[NUT_STIFFNESS]),
                         value_of(at[STIFFNESS_PRELOAD]), value_of(at[AXIAL_PLAY])};
    const Number ratio = screw_ratio(at);
    Number first, drift;

    if (!(point->kept && memcmp(point->of, of, sizeof of) == 0)) { /* a step seldom changes them */
        memcpy(point->of, of, sizeof of);
        point->contact = contact_stiffness(at[NUT_STIFFNESS], at[STIFFNESS_PRELOAD]);
        point->preload = actual_preload(map, at[PRELOAD], at[TEMPERATURE_DIFFERENCE]);
        point->approach = preload_approach(point->contact, point->preload, at[AXIAL_PLAY]);
        point->kept = true;
    }
    drift = subtract(multiply(ratio, at[SPEED]), at[VELOCITY]);
    first = subtract(multiply(ratio, at[ANGLE]), at[POSITION]);
    contacts_of(point->contact, point->approach, first, add(first, times(step, drift)), drift, &point->contacts);
    loads_of_contacts(map, &point->contacts, &point->loads);
    nut_conditions(map, at[SPEED], at[TEMPERATURE], &point->conditions);
}

/* Outputs by name: torque, force, friction of both nuts, powers. Friction and films are those of friction_law.h. */
static inline void point_outputs(const Point *point, const Parts *both, const Presliding *presliding, const Number at[],
                                 double step, Number out[])
{
    const Contacts *contacts = &point->contacts;
    const Contact a = contacts->a, b = contacts->b;
    const Number ratio = screw_ratio(at), speed = at[SPEED], drift = contacts->drift;
    const Number stiffness = add(a.slope, b.slope);
    const Number damping = multiply(multiply(at[CONTACT_DAMPING_TIME], stiffness), drift);
    const Number elastic = subtract(a.force, b.force), force = add(elastic, damping), ideal = multiply(ratio, force);
    const Number magnitude = add(both->viscous, coulomb_magnitude(both));
    const Number stored = energy_of_elements(presliding->element);
    Number mean = force, mean_damping = damping, friction_power, friction;

    torque_outputs(both, presliding, loads_nut_a(contacts), at, out);
    friction = out[FRICTION_TORQUE];
    friction_power = value_of(at[PRESLIDING]) != 0.0 ? add(multiply(both->viscous, absolute(speed)), presliding->supply)
                                                     : multiply(friction, speed);
    if (step > 0.0) {
        const Number d_0 = contacts->preloaded, k = contacts->stiffness, first = contacts->first;
        const Number before = subtract(contact_law(k, add(d_0, first)).force, contact_law(k, subtract(d_0, first)).force);
        mean_damping = over(multiply(at[CONTACT_DAMPING_TIME], subtract(elastic, before)), step);
        mean = add(mean_elastic_force(k, d_0, first, contacts->last), mean_damping);
    }
    out[PRELOAD_ACTUAL] = point->preload;
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
    out[STORED_ENERGY] = add(contact_energy(contacts), stored);
}

static inline unsigned point_clamped(const Map *map, const Point *point, const Number at[])
{
    return contacts_clamped(map, &point->contacts, &point->conditions, point->preload, at);
}

static inline Number point_margin(const Map *map, const Point *point, const Number at[])
{
    return contacts_margin(map, &point->contacts, point->preload, at);
}

#endif
