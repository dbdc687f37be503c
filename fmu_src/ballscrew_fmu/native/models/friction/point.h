/* What BallScrewFriction computes at a point of its inputs: loads, outputs, range. Numbers: number.h. */
#ifndef BALLSCREW_POINT_H
#define BALLSCREW_POINT_H

#include "friction_law.h"

typedef struct {
    bool kept;                       /* the loads, valid while preload and axial load do not change: */
    double of_preload, of_axial_load; /* [N] that loads belong to */
    Number preload;                  /* [N] at the temperature difference of screw and nut */
    Loads loads;
    Conditions conditions;
} Point;

/* Loads and conditions. step is that of the transmission. */
static inline void point_locate(const Map *map, const Number at[], double step, Point *point)
{
    const Number actual = actual_preload(map, at[PRELOAD], at[TEMPERATURE_DIFFERENCE]);
    const double preload = value_of(actual), axial_load = value_of(at[AXIAL_LOAD]);

    (void)step;
    point->preload = actual;
    nut_conditions(map, at[SPEED], at[TEMPERATURE], &point->conditions);
    if (!(point->kept && point->of_preload == preload && point->of_axial_load == axial_load)) {
        nut_loads(map, actual, at[AXIAL_LOAD], &point->loads);
        point->of_preload = preload;
        point->of_axial_load = axial_load;
        point->kept = true;
    }
}

static inline void point_outputs(const Point *point, const Parts *parts, const Presliding *presliding,
                                 const Number at[], double step, Number out[])
{
    (void)step;
    torque_outputs(parts, presliding, !(value_of(at[AXIAL_LOAD]) < 0.0), at, out);
    out[PRELOAD_ACTUAL] = point->preload;
}

/* One bit per input, in their order. */
static inline unsigned point_clamped(const Map *map, const Point *point, const Number at[])
{
    const bool inside = value_of(difference_margin(map, at[PRELOAD], at[TEMPERATURE_DIFFERENCE])) >= 0.0;

    return (inside ? 0U : 1U << (TEMPERATURE_DIFFERENCE - INPUT_FIRST))
           | (point->loads.preload_clamped ? 1U << (PRELOAD - INPUT_FIRST) : 0U)
           | (point->conditions.speed_clamped ? 1U << (SPEED - INPUT_FIRST) : 0U)
           | (point->conditions.temperature_clamped ? 1U << (TEMPERATURE - INPUT_FIRST) : 0U)
           | (point->loads.axial_load_clamped ? 1U << (AXIAL_LOAD - INPUT_FIRST) : 0U);
}

/* Least distance from the limits of preload, speed, temperature and force of the loaded nut, each as a share of the
   length of its axis. Negative outside. Twin of runtime/evaluate.py. */
static inline Number point_margin(const Map *map, const Point *point, const Number at[])
{
    const Number preload = actual_preload(map, at[PRELOAD], at[TEMPERATURE_DIFFERENCE]);
    const bool loose = value_of(preload) == 0.0; /* as nut_loads */
    const Number holding = loose ? absolute(at[AXIAL_LOAD]) : preload;
    Number margin = nut_margin(map, holding, at[SPEED], at[TEMPERATURE]), force[2];

    (void)point;
    margin = lesser(margin, difference_margin(map, at[PRELOAD], at[TEMPERATURE_DIFFERENCE]));
    if (value_of(at[AXIAL_LOAD]) != 0.0) {
        nut_forces(map, clamped(preload, 0.0, map->force.hi), at[AXIAL_LOAD], force);
        margin = lesser(margin, over(subtract(constant(map->force.hi), force[1]), map->force.hi));
        if (map->oversize) {
            margin = lesser(margin, over(held_force(force[0], force[1]), map->force.hi));
        }
    }
    return margin;
}

#endif
