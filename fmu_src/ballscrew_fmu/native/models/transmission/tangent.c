/* Outputs of the transmission in dual numbers. Tests compare the values with model.c and the derivatives with
   differences. */
#define DUAL_NUMBERS
#include "tangent.h"

#include "nut_law.h"
#include "transmission_law.h"

void outputs_along(const Map *map, const double at[VARIABLE_COUNT], const double direction[VARIABLE_COUNT], double step,
                   bool continuous, int slip, double values[VARIABLE_COUNT], double slopes[VARIABLE_COUNT])
{
    Number in[VARIABLE_COUNT], out[VARIABLE_COUNT], stiffness, force[2];
    Bristle bristle = {constant(0.0), constant(0.0), constant(0.0), constant(0.0)};
    Conditions conditions;
    Contacts contacts;
    Friction friction;
    Films films[2];
    Parts parts[2], both;

    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        in[i] = out[i] = number(at[i], direction[i]);
    }
    stiffness = contact_stiffness(in[NUT_STIFFNESS], in[STIFFNESS_PRELOAD]);
    contacts_at(in, stiffness, preload_approach(stiffness, in[PRELOAD], in[AXIAL_PLAY]), step, &contacts);
    force[0] = contacts.a.force;
    force[1] = contacts.b.force;
    nut_conditions(map, in[SPEED], in[TEMPERATURE], &conditions);
    friction = friction_of(in);
    for (int n = 0; n < 2; ++n) {
        Loads loads;
        nut_loads(map, force[n], constant(0.0), &loads);
        nut_parts(map, &loads, &conditions, NULL, &friction, &parts[n]);
        nut_films(map, &loads, &conditions, &films[n]);
        parts[n] = parts_of_one(parts[n]);
    }
    both = parts_of_both(parts);
    films[0] = films_of_both(films[0], films[1]);
    if (at[PRESLIDING_STIFFNESS] > 0.0) {
        bristle = bristle_at(in, coulomb_magnitude(&both), step, continuous, slip);
    }
    transmission_outputs(&contacts, parts, &bristle, in[PRESLIDING_DEFLECTION], in, step, out);
    film_outputs(&films[0], in, out);
    out[PRESLIDING_DEFLECTION_RATE] = bristle.rate;
    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        values[i] = value_of(out[i]);
        slopes[i] = slope_of(out[i]);
    }
}
