/* What BallScrewTransmission computes at a point of its inputs: contacts, loads, outputs, range. Numbers: number.h. */
#ifndef BALLSCREW_POINT_H
#define BALLSCREW_POINT_H

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

    if (!(point->kept && memcmp(point->of, of, sizeof of) == 0)) { /* a step seldom changes them */
        memcpy(point->of, of, sizeof of);
        point->contact = contact_stiffness(at[NUT_STIFFNESS], at[STIFFNESS_PRELOAD]);
        point->approach = preload_approach(point->contact, at[PRELOAD], at[AXIAL_PLAY]);
        point->kept = true;
    }
    contacts_at(at, point->contact, point->approach, step, &point->contacts);
    loads_of_contacts(map, &point->contacts, &point->loads);
    nut_conditions(map, at[SPEED], at[TEMPERATURE], &point->conditions);
}

static inline void point_outputs(const Point *point, const Parts *parts, const Presliding *presliding,
                                 const Number at[], double step, Number out[])
{
    transmission_outputs(&point->contacts, parts, presliding, at, step, out);
}

static inline unsigned point_clamped(const Map *map, const Point *point, const Number at[])
{
    return contacts_clamped(map, &point->contacts, &point->conditions, value_of(at[PRELOAD]));
}

static inline Number point_margin(const Map *map, const Point *point, const Number at[])
{
    return contacts_margin(map, &point->contacts, at);
}

#endif
