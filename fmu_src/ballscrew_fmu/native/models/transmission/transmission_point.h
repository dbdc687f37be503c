/* What BallScrewTransmission computes at a point of its inputs: contacts, loads, outputs, range. Numbers: number.h. */
#ifndef BALLSCREW_TRANSMISSION_POINT_H
#define BALLSCREW_TRANSMISSION_POINT_H

#include <string.h>

#include "transmission_law.h"

typedef struct {
    bool kept;                /* contact and approach, valid while the numbers that they belong to do not change: */
    double of[4];             /* preload, nut stiffness, its preload, play */
    Number contact, approach; /* k [N/m^1.5]; without load [m] */
    Contacts contacts;
    Loads loads;
    Conditions conditions;
} Point;

/* Contacts, loads and conditions at the end of a step [s] from this point; 0: an instant */
static inline void point_locate(const Map *map, const Number at[], double step, Point *point)
{
    const double of[] = {value_of(at[PRELOAD]), value_of(at[NUT_STIFFNESS]), value_of(at[STIFFNESS_PRELOAD]),
                         value_of(at[AXIAL_PLAY])};
    Number a, b;
    bool loads_a;

    if (!(point->kept && memcmp(point->of, of, sizeof of) == 0)) { /* a step seldom changes them */
        memcpy(point->of, of, sizeof of);
        point->contact = contact_stiffness(at[NUT_STIFFNESS], at[STIFFNESS_PRELOAD]);
        point->approach = preload_approach(point->contact, at[PRELOAD], at[AXIAL_PLAY]);
        point->kept = true;
    }
    contacts_at(at, point->contact, point->approach, step, &point->contacts);
    a = point->contacts.a.force;
    b = point->contacts.b.force;
    loads_a = loads_nut_a(&point->contacts);
    nut_loads_of_forces(map, loads_a ? b : a, loads_a ? a : b, &point->loads);
    nut_conditions(map, at[SPEED], at[TEMPERATURE], &point->conditions);
}

static inline void point_outputs(const Point *point, const Parts *parts, const Presliding *presliding,
                                 const Number at[], double step, Number out[])
{
    transmission_outputs(&point->contacts, parts, presliding, at, step, out);
}

/* What a force lacks to the end of the map, negative outside by more than rounding [N]. */
static inline Number force_left(const Map *map, Number force)
{
    return subtract(constant(map->force.hi * (1.0 + FORCE_ROUNDING)), force);
}

/* One bit per variable, from the first input. */
static inline unsigned point_clamped(const Map *map, const Point *point, const Number at[])
{
    const double preload = value_of(at[PRELOAD]);
    const bool preload_inside = preload >= map->preload.lo && preload <= map->force.hi;

    return (preload_inside ? 0U : 1U << (PRELOAD - INPUT_FIRST))
           | (point->conditions.speed_clamped ? 1U << (SPEED - INPUT_FIRST) : 0U)
           | (point->conditions.temperature_clamped ? 1U << (TEMPERATURE - INPUT_FIRST) : 0U)
           | (value_of(force_left(map, point->contacts.a.force)) < 0.0 ? 1U << (FORCE_NUT_A - INPUT_FIRST) : 0U)
           | (value_of(force_left(map, point->contacts.b.force)) < 0.0 ? 1U << (FORCE_NUT_B - INPUT_FIRST) : 0U);
}

/* Least distance from the limits of preload, speed, temperature and force of the loaded nut, each as a share of the
   length of its axis. Negative outside. */
static inline Number point_margin(const Map *map, const Point *point, const Number at[])
{
    const Number highest = greater(point->contacts.a.force, point->contacts.b.force);

    return lesser(nut_margin(map, at[PRELOAD], at[SPEED], at[TEMPERATURE]),
                  over(force_left(map, highest), map->force.hi));
}

#endif
