/* A communication step in pairs of parts. Each is compared with one part of twice the length; the length follows from the
   difference. */
#include "axis_part.h"

#include <string.h>

#define MOST_PAIRS 20000   /* of parts in a communication step with control of the error */
#define LAST_PAIRS 32      /* for the rest of it, without */
#define LEAST_PART 1e-6    /* [s] below which a part is accepted with any error: at a kink of the contacts or of friction */
#define PART_ROUNDING 1e-6 /* of a part: rounding of the step does not change the number of parts */
#define FIRST_PART 2e-5    /* [s] first proposal */

/* Difference of two ends of a pair of parts, relative. Elements that slide follow the limit, others do not. */
static double difference(const Plant *plant, const Motion *from, const Advance *one, const Advance *two)
{
    const Mechanics *mechanics = &plant->mechanics;
    const Motion *a = &one->motion, *b = &two->motion;
    const double unit_a = one->level.elements.unit, unit_b = two->level.elements.unit;
    const double deflection = deflection_of(mechanics, b);
    double speeds = 0.0, energy = 2.0 * plant->force * plant->way, most;

    for (int i = 0; i < plant->freedoms; ++i) {
        const double mass = mechanics->mass[i], change = a->speed[i] - b->speed[i];
        speeds += mass * change * change;
        energy += mass * (from->speed[i] * from->speed[i] + b->speed[i] * b->speed[i]);
    }
    most = sqrt(speeds / energy);
    most = greater(most, fabs(deflection_of(mechanics, a) - deflection) / (plant->way + fabs(deflection)));
    most = greater(most, fabs(a->place[TABLE] - b->place[TABLE]) / (plant->way + fabs(b->place[TABLE] - from->place[TABLE])));
    for (int i = 0; i < ELEMENTS && unit_a > 0.0 && unit_b > 0.0; ++i) {
        const double follows = fabs(a->element[i] / unit_a - b->element[i] / unit_b);
        const double stays = fabs(a->element[i] - b->element[i]) / unit_b;
        most = greater(most, lesser(follows, stays) / (2.0 * ELEMENTS - 1.0));
    }
    for (int i = 0; i < SLIDERS; ++i) {
        const double limit_a = one->level.sliding.limit[i], limit_b = two->level.sliding.limit[i];
        if (limit_a > 0.0 && limit_b > 0.0) {
            const double follows = fabs(a->slider[i] * (limit_b / limit_a) - b->slider[i]);
            most = greater(most, lesser(follows, fabs(a->slider[i] - b->slider[i])) / limit_b);
        }
    }
    return most;
}

static void plant_of(const Map *map, const double at[START_COUNT], Plant *plant)
{
    Mechanics *mechanics = &plant->mechanics;

    plant->map = map;
    plant->at = at;
    mechanics_of(map, at, mechanics);
    plant->freedoms = is_elastic(mechanics) ? FREEDOMS : SCREW;
    for (int i = 0; i < FREEDOMS; ++i) {
        plant->inverse[i] = 1.0 / sqrt(mechanics->mass[i]);
    }
    plant->force = greater(greater(contact_law(mechanics->contact, mechanics->approach).force, 1.0),
                          fabs(mechanics->weight[TABLE]));
    plant->way = mechanics->contact > 0.0 ? pow(plant->force / mechanics->contact, 2.0 / 3.0) : 1e-6;
}

/* Advances by two equal parts. *error: of them, in error bounds. */
static bool make_pair(const Plant *plant, double length, Advance *state, double *error)
{
    const Motion from = state->motion;
    Advance whole = *state;

    if (!(make_part(plant, length, &whole) && make_part(plant, 0.5 * length, state)
          && make_part(plant, 0.5 * length, state))) {
        return false;
    }
    *error = difference(plant, &from, &whole, state) / plant->at[ERROR_BOUND];
    return *error < HUGE_VAL;
}

bool axis_advance(const Map *map, const double at[START_COUNT], double step, Advance *state)
{
    double left = step;
    bool cut = false;
    Plant plant;

    plant_of(map, at, &plant);
    if (!(state->proposal > 0.0)) {
        level_at(&plant, deflection_of(&plant.mechanics, &state->motion), state->motion.speed[SHAFT], &state->level);
        state->proposal = FIRST_PART;
    }
    memset(state->heat, 0, sizeof state->heat);
    memset(state->slider_slip, 0, sizeof state->slider_slip);
    state->supplied = 0.0;
    state->slips = 0U;
    state->slip = 0;
    for (int pairs = 0; left > 0.0; ++pairs) {
        const bool last = pairs >= MOST_PAIRS;
        const double count = last ? MOST_PAIRS + LAST_PAIRS - pairs : ceil(left / state->proposal - PART_ROUNDING);
        const double length = count > 1.0 ? left / count : left;
        Advance next = *state;
        double error = HUGE_VAL, factor;
        const bool good = make_pair(&plant, length, &next, &error);
        const bool accepted = good && (error <= 1.0 || length <= LEAST_PART || last);
        factor = good ? 0.9 * pow(greater(error, 1e-4), -0.25) : 0.1;
        factor = greater(factor > 4.0 ? 4.0 : factor, 0.1);
        if (accepted) {
            left = length < left ? left - length : 0.0;
            *state = next;
            /* a part that is short because the step ends says nothing against longer ones */
            state->proposal = error <= 1.0 && length < state->proposal ? greater(state->proposal, factor * length)
                                                                        : greater(factor * length, LEAST_PART);
        } else if (length <= LEAST_PART || last) {
            return false; /* numbers become too large: the motion ends here */
        } else {
            state->proposal = (factor < 0.7 ? factor : 0.7) * length;
        }
        cut = cut || last;
    }
    return !cut;
}
