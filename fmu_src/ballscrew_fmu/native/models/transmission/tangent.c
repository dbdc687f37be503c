/* Outputs of the transmission in dual numbers. Tests compare the values with model.c and the derivatives with
   differences. */
#define DUAL_NUMBERS
#include "tangent.h"

#include "nut_law.h"
#include "transmission_law.h"

void outputs_along(const Map *map, const double at[VARIABLE_COUNT], const double direction[VARIABLE_COUNT],
                   const Moment *moment, double values[VARIABLE_COUNT], double slopes[VARIABLE_COUNT])
{
    Number in[VARIABLE_COUNT], out[VARIABLE_COUNT], contact, stiffness;
    Bristle bristle;
    Conditions conditions;
    Contacts contacts;
    Friction friction;
    Films films;
    Loads loads;
    Parts parts;
    bool loads_a;

    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        in[i] = out[i] = number(at[i], direction[i]);
    }
    contact = contact_stiffness(in[NUT_STIFFNESS], in[STIFFNESS_PRELOAD]);
    contacts_at(in, contact, preload_approach(contact, in[PRELOAD], in[AXIAL_PLAY]), moment->step, &contacts);
    loads_a = loads_nut_a(&contacts);
    nut_loads_of_forces(map, loads_a ? contacts.b.force : contacts.a.force,
                        loads_a ? contacts.a.force : contacts.b.force, &loads);
    nut_conditions(map, in[SPEED], in[TEMPERATURE], &conditions);
    friction = friction_of(in);
    nut_parts(map, &loads, &conditions, NULL, &friction, &parts);
    nut_films(map, &loads, &conditions, &films);
    stiffness = stiffness_at(in, map, &loads, &friction);
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
    transmission_outputs(&contacts, &parts, &bristle, stiffness, in, moment->step, out);
    heat_output(moment, out);
    film_outputs(&films, in, out);
    out[RANGE_MARGIN] = margin_of_contacts(map, &contacts, in);
    out[PRESLIDING_DEFLECTION_RATE] = bristle.rate;
    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        values[i] = value_of(out[i]);
        slopes[i] = slope_of(out[i]);
    }
}
