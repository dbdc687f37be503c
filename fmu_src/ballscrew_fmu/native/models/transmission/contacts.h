/* Contacts of both nuts between screw and nut body: Hertz's law over the way by which the screw leads the nut,
   x = lead angle/(2 pi) - position. Screw and nut bodies are rigid (physics/stiffness.py, there the displacement
   is -x). With d_0 = (preload/k)^(2/3)

       F_A = k max(d_0 + x, 0)^(3/2),  F_B = k max(d_0 - x, 0)^(3/2),  nut force F = F_A - F_B + c x',
       c = damping time * dF/dx,       screw torque = lead/(2 pi) F + friction torque.

   A positive nut force pushes the nut along +position and loads nut A. Damping in proportion to the stiffness is an
   assumption: it vanishes with the contact and dissipates c x'^2 >= 0. Each nut has the friction of the map at its own
   force, with the one motion of oversize balls between both sets of flanks (nut_law.h), so load raises it, and the
   screw is driven back where lead/(2 pi) F exceeds the friction.

   A step: angle and position are those at its start and move on with their speeds. Powers are means of the step, so
   that shaft power - nut power - power loss is the change of stored energy over the step, exactly, if the next step
   starts where this one ends and the preload stays. A change of preload is work of the preload. Numbers: number.h. */
#ifndef BALLSCREW_CONTACTS_H
#define BALLSCREW_CONTACTS_H

#include "nut_law.h"
#include "variables.h"

#define TWO_PI 6.283185307179586

/* One nut at an approach of screw and nut. */
typedef struct {
    Number force, slope; /* [N], [N/m] */
} Contact;

/* Both nuts from the start to the end of a step. */
typedef struct {
    Number stiffness;       /* k [N/m^1.5] of k d^(3/2) */
    Number preloaded;       /* [m] approach without load */
    Number drift;           /* [m/s] rate of the deflection */
    Number first, last;     /* [m] deflection at start and end */
    Contact a, b;           /* at the end; a: loaded by a positive nut force */
} Contacts;

static inline Number screw_ratio(const Number at[]) { return over(at[LEAD], TWO_PI); }

/* k of one nut from the stiffness of both at a preload. 0 where it is so small, and limited where it is so large, that
   a force would not be finite. */
static inline Number contact_stiffness(Number nut_stiffness, Number preload)
{
    const Number one = over(nut_stiffness, 3.0);
    Number stiffness;

    if (!(value_of(nut_stiffness) > 0.0 && value_of(preload) > 0.0)) {
        return constant(0.0);
    }
    stiffness = multiply(one, root(divide(one, preload)));
    return value_of(stiffness) * TOO_LARGE > 1.0 ? lesser(stiffness, constant(TOO_LARGE)) : constant(0.0);
}

/* Approach without load; without preload half the play, negative. */
static inline Number preload_approach(Number stiffness, Number preload, Number play)
{
    if (!(value_of(preload) > 0.0)) {
        return times(-0.5, play);
    }
    return value_of(stiffness) > 0.0 ? power(divide(preload, stiffness), 2.0 / 3.0) : constant(0.0);
}

static inline Contact contact_law(Number stiffness, Number approach)
{
    Contact out;

    if (!(value_of(approach) > 0.0)) {
        out.force = out.slope = constant(0.0);
        return out;
    }
    out.slope = multiply(stiffness, root(approach));
    out.force = multiply(out.slope, approach);
    out.slope = times(1.5, out.slope);
    return out;
}

/* Mean force while the approach moves from first to last: its work over its way, without cancellation. */
static inline Number mean_contact_force(Number stiffness, Number first, Number last)
{
    const Number zero = constant(0.0), a = root(greater(first, zero)), b = root(greater(last, zero));
    const Number aa = multiply(a, a), bb = multiply(b, b), ab = multiply(a, b);
    Number work, way;

    if (value_of(first) == value_of(last)) {
        return contact_law(stiffness, times(0.5, add(first, last))).force;
    }
    if (value_of(a) > 0.0 && value_of(b) > 0.0) {
        /* the difference of the fifth powers, divided by that of the squares */
        work = add(add(multiply(aa, aa), multiply(bb, bb)), multiply(ab, add(add(aa, ab), bb)));
        way = add(a, b);
    } else {
        work = subtract(multiply(multiply(bb, bb), b), multiply(multiply(aa, aa), a));
        way = subtract(last, first);
    }
    return divide(times(0.4, multiply(stiffness, work)), way);
}

/* stiffness: of contact_stiffness, approach: of preload_approach; first, last, drift: as in Contacts */
static inline void contacts_of(Number stiffness, Number approach, Number first, Number last, Number drift, Contacts *out)
{
    out->stiffness = stiffness;
    out->preloaded = approach;
    out->drift = drift;
    out->first = first;
    out->last = last;
    out->a = contact_law(stiffness, add(approach, last));
    out->b = contact_law(stiffness, subtract(approach, last));
}

/* Mean of the nut force, without damping, while the deflection moves from first to last. stiffness, approach: as above */
static inline Number mean_elastic_force(Number stiffness, Number approach, Number first, Number last)
{
    return subtract(mean_contact_force(stiffness, add(approach, first), add(approach, last)),
                    mean_contact_force(stiffness, subtract(approach, first), subtract(approach, last)));
}

/* [J] stored in both contacts, without load 0 */
static inline Number contact_energy(const Contacts *contacts)
{
    return multiply(contacts->last, mean_elastic_force(contacts->stiffness, contacts->preloaded, constant(0.0),
                                                       contacts->last));
}

static inline bool loads_nut_a(const Contacts *contacts)
{
    return value_of(contacts->a.force) >= value_of(contacts->b.force);
}

/* Loads of the friction at the forces of both contacts. */
static inline void loads_of_contacts(const Map *map, const Contacts *contacts, Loads *loads)
{
    const Number a = contacts->a.force, b = contacts->b.force;
    const bool loads_a = loads_nut_a(contacts);

    nut_loads_of_forces(map, loads_a ? b : a, loads_a ? a : b, loads);
}

/* What a force lacks to the end of the map, negative outside by more than rounding [N]. */
static inline Number force_left(const Map *map, Number force)
{
    return subtract(constant(map->force.hi * (1.0 + FORCE_ROUNDING)), force);
}

/* What the map must hold: the preload, without one the force of the loaded nut [N]. */
static inline Number holding_force(const Contacts *contacts, Number preload)
{
    return value_of(preload) == 0.0 ? greater(contacts->a.force, contacts->b.force) : preload;
}

/* What is clamped, one bit per variable from the first input. */
static inline unsigned contacts_clamped(const Map *map, const Contacts *contacts, const Conditions *conditions,
                                        Number preload, const Number at[])
{
    const double holding = value_of(holding_force(contacts, preload));
    const bool preload_inside = holding >= map->preload.lo && holding <= map->force.hi;

    const Number a = contacts->a.force, b = contacts->b.force;
    const double held = value_of(held_force(lesser(a, b), greater(a, b)));
    const unsigned apart = map->oversize && held < 0.0 ? 1U << (PRELOAD - INPUT_FIRST) : 0U;

    const bool warm = value_of(difference_margin(map, at[PRELOAD], at[TEMPERATURE_DIFFERENCE])) < 0.0;

    return apart | (warm ? 1U << (TEMPERATURE_DIFFERENCE - INPUT_FIRST) : 0U)
           | (preload_inside ? 0U : 1U << (PRELOAD - INPUT_FIRST))
           | (conditions->speed_clamped ? 1U << (SPEED - INPUT_FIRST) : 0U)
           | (conditions->temperature_clamped ? 1U << (TEMPERATURE - INPUT_FIRST) : 0U)
           | (value_of(force_left(map, contacts->a.force)) < 0.0 ? 1U << (FORCE_NUT_A - INPUT_FIRST) : 0U)
           | (value_of(force_left(map, contacts->b.force)) < 0.0 ? 1U << (FORCE_NUT_B - INPUT_FIRST) : 0U);
}

/* Least distance from the limits of preload, speed, temperature and force of the loaded nut, each as a share of the
   length of its axis. Negative outside. */
static inline Number contacts_margin(const Map *map, const Contacts *contacts, Number preload, const Number at[])
{
    const Number highest = greater(contacts->a.force, contacts->b.force);
    const Number inside = lesser(nut_margin(map, holding_force(contacts, preload), at[SPEED], at[TEMPERATURE]),
                                 over(force_left(map, highest), map->force.hi));
    const Number margin = lesser(inside, difference_margin(map, at[PRELOAD], at[TEMPERATURE_DIFFERENCE]));

    if (!map->oversize) {
        return margin;
    }
    return lesser(margin, over(held_force(lesser(contacts->a.force, contacts->b.force), highest), map->force.hi));
}

#endif
