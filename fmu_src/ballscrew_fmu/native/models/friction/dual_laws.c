/* Outputs of a screw with friction in dual numbers. Tests compare them with differences of model.c. */
#define DUAL_NUMBERS
#include "dual_laws.h"

#include "point.h"

void slopes_along(const Map *map, const double at[START_COUNT], const double direction[VARIABLE_COUNT],
                  const struct StepContext *context, double slopes[VARIABLE_COUNT])
{
    Number in[VARIABLE_COUNT], out[VARIABLE_COUNT];
    Point point = {0};
    Friction friction;
    Presliding presliding;
    Parts parts;
    Films films;

    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        in[i] = out[i] = number(at[i], direction[i]);
    }
    point_locate(map, in, context->step, &point);
    friction = friction_of(in);
    nut_parts(map, &point.loads, &point.conditions, NULL, &friction, &parts);
    nut_films(map, &point.loads, &point.conditions, &films);
    if (at[PRESLIDING] != 0.0) {
        presliding_at(in, coulomb_magnitude(&parts),
                      context->stiffness > 0.0 ? constant(context->stiffness)
                                              : stiffness_at(in, map, &point.loads, &friction),
                      context, &presliding);
    } else {
        presliding_off(in, context->step, &presliding);
    }
    point_outputs(&point, &parts, &presliding, in, context->step, out);
    heat_output(context, out);
    film_outputs(&films, in, out);
    out[RANGE_MARGIN] = point_margin(map, &point, in);
    for (int i = 0; i < ELEMENTS; ++i) {
        out[PRESLIDING_ELEMENT_1_RATE + i] = presliding.rate[i];
    }
    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        slopes[i] = slope_of(out[i]);
    }
}
