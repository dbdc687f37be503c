/* What BallScrewTransmission computes at the latched point, for model.c: contacts, friction parts, outputs, range. */
#ifndef BALLSCREW_POINT_H
#define BALLSCREW_POINT_H

#include <string.h>

#include "model.h"
#include "transmission_law.h"

/* k and approach without load, which a step seldom changes. */
static inline void compute_approach(Model *model)
{
    const double *at = model->latched;
    const double of[] = {at[PRELOAD], at[NUT_STIFFNESS], at[STIFFNESS_PRELOAD], at[AXIAL_PLAY]};

    if (!(model->approach_known && memcmp(model->approach_of, of, sizeof of) == 0)) {
        memcpy(model->approach_of, of, sizeof of);
        model->contact = contact_stiffness(at[NUT_STIFFNESS], at[STIFFNESS_PRELOAD]);
        model->approach = preload_approach(model->contact, at[PRELOAD], at[AXIAL_PLAY]);
        model->approach_known = true;
    }
}

/* Contacts, loads and conditions of the latched point. */
static inline void locate(Model *model)
{
    const double *at = model->latched;

    if (!model->conditions_known) {
        compute_approach(model);
        contacts_at(at, model->contact, model->approach, model->step, &model->contacts);
        nut_loads_of_forces(model->map, lesser(model->contacts.a.force, model->contacts.b.force),
                            greater(model->contacts.a.force, model->contacts.b.force), &model->loads);
        nut_conditions(model->map, at[SPEED], at[TEMPERATURE], &model->conditions);
        model->conditions_known = true;
    }
}

/* Magnitudes of the friction parts at the latched point, of both nuts. */
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
    transmission_outputs(&model->contacts, friction_parts(model), bristle, model->stiffness, model->latched,
                         model->step, model->value);
}

static inline void compute_films(Model *model)
{
    Films films;

    locate(model);
    nut_films(model->map, &model->loads, &model->conditions, &films);
    film_outputs(&films, model->latched, model->value);
    model->films_known = true;
}

/* Whether a force is beyond the map by more than rounding. */
static inline bool beyond_map(const Model *model, double force)
{
    return force > model->map->force.hi * (1.0 + FORCE_ROUNDING);
}

/* One bit per input, in their order. A force of a nut beyond the map is due to the position. */
static inline unsigned clamped_at_point(Model *model)
{
    const double preload = model->latched[PRELOAD];
    const bool preload_inside = preload >= model->map->preload.lo && preload <= model->map->force.hi;

    locate(model);
    return (preload_inside ? 0U : 1U << (PRELOAD - INPUT_FIRST))
           | (model->conditions.speed_clamped ? 1U << (SPEED - INPUT_FIRST) : 0U)
           | (model->conditions.temperature_clamped ? 1U << (TEMPERATURE - INPUT_FIRST) : 0U)
           | (beyond_map(model, model->contacts.a.force) || beyond_map(model, model->contacts.b.force)
                  ? 1U << (POSITION - INPUT_FIRST)
                  : 0U);
}

/* Least distance of the latched point from the limits of the map, negative outside. */
static inline double point_margin(Model *model)
{
    locate(model);
    return margin_of_contacts(model->map, &model->contacts, model->latched);
}

/* Clear what is computed from the others. */
static inline void forget_point(Model *model)
{
    model->approach_known = false;
    memset(model->approach_of, 0, sizeof model->approach_of);
    model->contact = model->approach = 0.0;
    memset(&model->contacts, 0, sizeof model->contacts);
    memset(&model->loads, 0, sizeof model->loads);
    memset(&model->conditions, 0, sizeof model->conditions);
    memset(&model->parts, 0, sizeof model->parts);
}

#endif
