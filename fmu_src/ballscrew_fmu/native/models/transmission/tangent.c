/* Outputs of the transmission in dual numbers. Tests compare the values with model.c and the derivatives with
   differences. */
#define DUAL_NUMBERS
#include "tangent.h"

#include "nut_law.h"
#include "transmission_law.h"

void outputs_along(const Map *map, const double at[VARIABLE_COUNT], const double direction[VARIABLE_COUNT],
                   const Moment *moment, double values[VARIABLE_COUNT], double slopes[VARIABLE_COUNT])
{
    Number in[VARIABLE_COUNT], out[VARIABLE_COUNT], contact, force[2], stiffness;
    Bristle bristle;
    Conditions conditions;
    Contacts contacts;
    Friction friction;
    Films films[2];
    Loads loads[2];
    Parts part[2], parts;

    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        in[i] = out[i] = number(at[i], direction[i]);
    }
    contact = contact_stiffness(in[NUT_STIFFNESS], in[STIFFNESS_PRELOAD]);
    contacts_at(in, contact, preload_approach(contact, in[PRELOAD], in[AXIAL_PLAY]), moment->step, &contacts);
    force[0] = contacts.a.force;
    force[1] = contacts.b.force;
    nut_conditions(map, in[SPEED], in[TEMPERATURE], &conditions);
    friction = friction_of(in);
    for (int n = 0; n < 2; ++n) {
        nut_loads(map, force[n], constant(0.0), &loads[n]);
        nut_parts(map, &loads[n], &conditions, NULL, &friction, &part[n]);
        nut_films(map, &loads[n], &conditions, &films[n]);
        part[n] = parts_of_one(part[n]);
    }
    parts = parts_of_both(part);
    films[0] = films_of_both(films[0], films[1]);
    stiffness = stiffness_of_both(in, map, loads, &friction);
    if (at[PRESLIDING] != 0.0) {
        bristle = bristle_at(in, coulomb_magnitude(&parts), stiffness, moment);
        if (moment->continuous && moment->start == RUNNING) { /* changes at events only */
            stiffness = constant(moment->stiffness);
        }
    } else {
        bristle = bristle_unwound(in[PRESLIDING_DEFLECTION], moment);
        if (!(moment->step > 0.0)) { /* only a step unwinds it */
            bristle.deflection = in[PRESLIDING_DEFLECTION];
            stiffness = constant(moment->stiffness);
        }
    }
    transmission_outputs(&contacts, part, &bristle, stiffness, in, moment->step, out);
    film_outputs(&films[0], in, out);
    out[RANGE_MARGIN] = margin_of_contacts(map, &contacts, in);
    out[PRESLIDING_DEFLECTION_RATE] = bristle.rate;
    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        values[i] = value_of(out[i]);
        slopes[i] = slope_of(out[i]);
    }
}
