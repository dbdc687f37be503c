/* Reset and outputs on demand of a model of a screw. */
#include "screw_model.h"

INTERNAL void model_reset(Model *model, const Map *map, const double start[START_COUNT], bool continuous)
{
    model_start(model, map, start, continuous);
    model->in_range = true;
    model_latch(model);
}

INTERNAL void model_set(Model *model, int reference, double value)
{
    model->value[reference] = value;
}

static void compute_films(Model *model)
{
    const Point *point = locate(model);
    Films films;

    nut_films(model->map, &point->loads, &point->conditions, &films);
    film_outputs(&films, model->latched, model->value);
    model->films_known = true;
}

INTERNAL double model_get(Model *model, int reference)
{
    const Variable *variable = &model_variables[reference];

    if (reference == IN_RANGE) {
        return in_range(model);
    }
    if (reference == RANGE_MARGIN) {
        model->value[RANGE_MARGIN] = point_margin(model->map, locate(model), model->latched);
    } else if (variable->causality == CAUSALITY_INDICATOR) {
        model_indicators(model);
    } else if (variable->causality == CAUSALITY_OUTPUT && variable->films) {
        if (!model->films_known) {
            compute_films(model);
        }
    } else if ((variable->causality == CAUSALITY_OUTPUT || variable->causality == CAUSALITY_RATE)
               && !model->outputs_known) {
        compute_outputs(model);
    }
    return model->value[reference];
}
