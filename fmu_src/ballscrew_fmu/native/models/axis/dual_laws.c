/* Outputs and rates of the axis in dual numbers. Tests compare them with differences of model.c. */
#define DUAL_NUMBERS
#include "dual_laws.h"

#include "axis_law.h"

void slopes_along(const Map *map, const double at[START_COUNT], const double direction[VARIABLE_COUNT],
                  const struct StepContext *context, double slopes[VARIABLE_COUNT])
{
    Number in[START_COUNT], out[VARIABLE_COUNT];
    Point point;
    Films films;

    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        in[i] = out[i] = number(at[i], direction[i]);
    }
    for (int i = VARIABLE_COUNT; i < START_COUNT; ++i) {
        in[i] = constant(at[i]);
    }
    point_locate(map, in, context->stiffness, &point);
    nut_films(map, &point.loads, &point.conditions, &films);
    axis_outputs(&point, in, context, out);
    film_outputs(&films, in, out);
    out[RANGE_MARGIN] = point_margin(map, &point, in);
    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        slopes[i] = slope_of(out[i]);
    }
}
