/* What BallScrewFriction computes at the latched point, for model.c: friction parts, outputs, range. */
#ifndef BALLSCREW_POINT_H
#define BALLSCREW_POINT_H

#include <string.h>

#include "friction_law.h"
#include "model.h"
#include "range.h"

static inline void compute_loads(Model *model)
{
    const double preload = model->latched[PRELOAD], axial_load = model->latched[AXIAL_LOAD];

    if (!(model->loads_known && model->loads_preload == preload && model->loads_axial_load == axial_load)) {
        nut_loads(model->map, preload, axial_load, &model->loads);
        model->loads_preload = preload;
        model->loads_axial_load = axial_load;
        model->loads_known = true;
    }
}

/* Loads and conditions of the latched point. */
static inline void locate(Model *model)
{
    if (!model->conditions_known) {
        nut_conditions(model->map, model->latched[SPEED], model->latched[TEMPERATURE], &model->conditions);
        compute_loads(model);
        model->conditions_known = true;
    }
}

/* Magnitudes of the friction parts at the latched point. */
static inline const Parts *friction_parts(Model *model)
{
    if (!model->parts_known) {
        const Friction friction = friction_of(model->latched);
        locate(model);
        nut_parts(model->map, &model->loads, &model->conditions, NULL, &friction, &model->parts);
        model->parts_known = true;
    }
    return &model->parts;
}

static inline double present_stiffness(Model *model)
{
    const Friction friction = friction_of(model->latched);

    locate(model);
    return stiffness_at(model->latched, model->map, &model->loads, &friction);
}

static inline void torques_at_point(Model *model, const Bristle *bristle)
{
    torque_outputs(friction_parts(model), bristle, !(model->latched[AXIAL_LOAD] < 0.0), model->latched, model->value);
}

static inline void compute_films(Model *model)
{
    Films films;

    locate(model);
    nut_films(model->map, &model->loads, &model->conditions, &films);
    film_outputs(&films, model->latched, model->value);
    model->films_known = true;
}

/* One bit per input, in their order. */
static inline unsigned clamped_at_point(Model *model)
{
    locate(model);
    return (model->loads.preload_clamped ? 1U << (PRELOAD - INPUT_FIRST) : 0U)
           | (model->conditions.speed_clamped ? 1U << (SPEED - INPUT_FIRST) : 0U)
           | (model->conditions.temperature_clamped ? 1U << (TEMPERATURE - INPUT_FIRST) : 0U)
           | (model->loads.axial_load_clamped ? 1U << (AXIAL_LOAD - INPUT_FIRST) : 0U);
}

/* Least distance of the latched point from the limits of the map, negative outside. */
static inline double point_margin(const Model *model)
{
    return margin_of_inputs(model->map, model->latched);
}

/* Clear what is computed from the others. */
static inline void forget_point(Model *model)
{
    model->loads_known = false;
    model->loads_preload = model->loads_axial_load = 0.0;
    memset(&model->loads, 0, sizeof model->loads);
    memset(&model->conditions, 0, sizeof model->conditions);
    memset(&model->parts, 0, sizeof model->parts);
}

#endif
