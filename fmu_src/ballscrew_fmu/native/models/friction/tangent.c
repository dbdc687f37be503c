/* Outputs of the friction FMU in dual numbers. Tests compare the values with model.c and the derivatives with
   differences. */
#define DUAL_NUMBERS
#include "tangent.h"

#include "friction_law.h"
#include "nut_law.h"
#include "range.h"

void outputs_along(const Map *map, const double at[VARIABLE_COUNT], const double direction[VARIABLE_COUNT],
                   const Moment *moment, double values[VARIABLE_COUNT], double slopes[VARIABLE_COUNT])
{
    Number in[VARIABLE_COUNT], out[VARIABLE_COUNT];
    Bristle bristle;
    Loads loads;
    Conditions conditions;
    Friction friction;
    Parts parts;
    Films films;

    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        in[i] = out[i] = number(at[i], direction[i]);
    }
    nut_loads(map, in[PRELOAD], in[AXIAL_LOAD], &loads);
    nut_conditions(map, in[SPEED], in[TEMPERATURE], &conditions);
    friction = friction_of(in);
    nut_parts(map, &loads, &conditions, NULL, &friction, &parts);
    nut_films(map, &loads, &conditions, &films);
    bristle = at[PRESLIDING] != 0.0
                  ? bristle_at(in, coulomb_magnitude(&parts), stiffness_at(in, map, &loads, &friction), moment)
                  : bristle_unwound(in[PRESLIDING_DEFLECTION], moment);
    torque_outputs(&parts, &bristle, !(at[AXIAL_LOAD] < 0.0), in, out);
    heat_output(moment, out);
    film_outputs(&films, in, out);
    out[RANGE_MARGIN] = margin_of_inputs(map, in);
    out[PRESLIDING_DEFLECTION_RATE] = bristle.rate;
    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        values[i] = value_of(out[i]);
        slopes[i] = slope_of(out[i]);
    }
}
