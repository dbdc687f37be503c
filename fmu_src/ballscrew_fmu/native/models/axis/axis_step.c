/* A communication step in pairs of parts. Each is compared with one part of twice the length; the length follows from the
   difference. */
#include "axis_part.h"

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
    if (mechanics->guide_limit > 0.0) {
        most = greater(most, fabs(a->guide - b->guide) / mechanics->guide_limit);
    }
    return most;
}

static void plant_of(const Map *map, const double at[VARIABLE_COUNT], Plant *plant)
{
    Mechanics *mechanics = &plant->mechanics;

    plant->map = map;
    plant->at = at;
    mechanics_of(map, at, mechanics);
    plant->freedoms = is_supported(mechanics) ? FREEDOMS : SCREW;
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

void axis_advance(const Map *map, const double at[VARIABLE_COUNT], double step, Advance *state)
{
    double left = step;
    Plant plant;

    plant_of(map, at, &plant);
    if (!(state->proposal > 0.0)) {
        level_at(&plant, deflection_of(&plant.mechanics, &state->motion), state->motion.speed[SHAFT], &state->level);
        state->proposal = FIRST_PART;
    }
    state->heat = state->supplied = 0.0;
    state->slips = 0U;
    state->slip = state->guide_slip = 0;
    state->cut = 0;
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
            state->cut = 1; /* numbers become too large: the motion ends here */
            return;
        } else {
            state->proposal = (factor < 0.7 ? factor : 0.7) * length;
        }
        state->cut = state->cut || last;
    }
}
