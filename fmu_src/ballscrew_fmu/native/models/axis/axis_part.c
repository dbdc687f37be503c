/* Parts of a communication step, each with a mean rate q/h of the places over its length h:

       p = (1 + h^2/12 M^-1 K) v,  v: mean of the speeds at start and end,  q = h p
       M (v_1 - v_0)/h = (1 + h^2/12 M^-1 K)' f(q)

   with f the mean of all forces over the way q: elastic ones by their work, elasto-slip elements by their exact path,
   the rest at the middle. The kinetic energy then changes by exactly the work of f, whatever K is, and heat is what the
   friction in f dissipates: all energies balance to rounding. With K the stiffness at the middle the error of elastic
   vibrations is of fourth order (Quispel, McLaren, J. Phys. A 41 (2008) 045206, Eq. (14); there without friction).

   f comes from a convex potential, so the equations have one solution, which Newton's method finds at any h. */
#include "axis_part.h"

#include <string.h>

#define MOST_CORRECTIONS 40 /* of Newton; it takes 2 to 5 */
#define LAST_CORRECTION 1e-10 /* relative, of the last correction: that of the solution is its square */
#define TOO_FAST (0.1 * TOO_LARGE) /* of places and speeds */

typedef struct {
    double of[FREEDOMS][FREEDOMS];
} Matrix;

/* One part. */
typedef struct {
    double length;            /* [s] */
    double deflection;        /* [m] at the start */
    double elastic;           /* [N] force of the contacts at the start */
    double support, pull;     /* [N/m], [N] of screw and its bearing at the start */
    double damping, support_damping; /* [s] damping over stiffness, corrected like the rates */
    double coupled;           /* [N.s/m] correction between both */
    Matrix rate;              /* 1 + h^2/12 M^-1/2 K M^-1/2 */
} Part;

/* Means over a part at a trial, and their slopes. */
typedef struct {
    double way[FREEDOMS];
    double force[FREEDOMS];
    Matrix slope; /* [way][force] of the forces against the ways */
    double damped; /* [N] contact damping */
} Trial;

static double within(double value, double limit) { return value > limit ? limit : value < -limit ? -limit : value; }

/* --- means of forces over a way --------------------------------------------------------------------------------- */

typedef struct {
    double state, slope; /* mean of the state, its slope over the way */
    double moved;        /* change of the state */
    bool follows;        /* all of the way */
} Element;

/* way: in units of the state */
static Element mean_of_element(double before, double way, double limit)
{
    const double from = within(before, limit), to = within(from + way, limit);
    /* of the way that it follows */
    const double fraction = fabs(from + way) <= limit ? 1.0 : (to - from) / way;
    const Element out = {to - 0.5 * (to - from) * fraction, 0.5 * fraction * fraction, to - from,
                         fraction == 1.0};

    return out;
}

/* Torque of the elements of the screw, mean over a way. */
static double mean_of_elements(const double before[ELEMENTS], double way, double length, const PreslidingLevel *level,
                               double *slope)
{
    const double unit = level->unit;
    double sum = 0.0, moved = 0.0, slopes = 0.0, rate, torque;
    int following = 0;

    *slope = 0.0;
    if (!(unit > 0.0)) {
        return 0.0;
    }
    for (int i = 0; i < ELEMENTS; ++i) {
        const Element one = mean_of_element(before[i], level->root * way, (2.0 * i + 1.0) * unit);
        sum += one.state;
        slopes += one.slope;
        moved += one.moved;
        following += one.follows;
    }
    rate = level->damping / (ELEMENTS * length);
    torque = level->root * sum + rate * moved / level->root;
    if (fabs(torque) > level->coulomb) {
        return within(torque, level->coulomb);
    }
    *slope = level->root * level->root * slopes + rate * following;
    return torque;
}

/* Force and stiffness of both contacts together. */
static Contact both_contacts(const Mechanics *mechanics, double deflection)
{
    const Contact a = contact_law(mechanics->contact, mechanics->approach + deflection);
    const Contact b = contact_law(mechanics->contact, mechanics->approach - deflection);
    const Contact out = {a.force - b.force, a.slope + b.slope};

    return out;
}

/* Force of the contacts over a change of the deflection, with damping. */
static double mean_of_contacts(const Mechanics *mechanics, const Part *part, double change, Trial *trial, double *slope)
{
    const double last = part->deflection + change;
    const Contact end = both_contacts(mechanics, last);
    const double mean = mean_elastic_force(mechanics->contact, mechanics->approach, part->deflection, last);
    const double rate = part->damping / part->length;
    const double least = 1e-6 * (fabs(mechanics->approach) + fabs(last));

    trial->damped = rate * (end.force - part->elastic);
    /* of a short way the difference has no digits */
    *slope = fabs(change) > least ? (end.force - mean) / change
                                 : 0.5 * both_contacts(mechanics, part->deflection).slope;
    *slope += rate * end.slope;
    return mean + trial->damped;
}

/* Slope of the compliance of screw and bearing over the position, mean over a way. */
static double mean_growth(const Mechanics *mechanics, double position, double way)
{
    const double from = mechanics->reach + position, to = from + way;

    if (from > LEAST_ROD && to > LEAST_ROD) {
        return mechanics->rod;
    }
    return from > LEAST_ROD || to > LEAST_ROD
               ? (compliance_at(mechanics, position + way) - compliance_at(mechanics, position)) / way
               : 0.0;
}

/* Screw and its bearing, an elastic energy P^2 c(x)/2 with pull P and compliance c at the position x of the table. From P
   to Q its change is (P + Q)/2 times the way of the screw - c' P Q/2 times that of the table, exactly. */
static void add_support(const Plant *plant, const Motion *from, const Part *part, double change, Trial *trial)
{
    const Mechanics *mechanics = &plant->mechanics;
    const double *way = trial->way, h = part->length, drag = part->support_damping * part->support / h;
    const double growth = mean_growth(mechanics, from->place[TABLE], way[TABLE]), coupled = part->coupled / h;
    const double stiffness = 1.0 / compliance_at(mechanics, from->place[TABLE] + way[TABLE]);
    const double pull = stiffness * (from->place[SCREW] + way[SCREW]);

    trial->force[SCREW] -= 0.5 * (part->pull + pull) + drag * way[SCREW] + coupled * change;
    trial->force[TABLE] += 0.5 * growth * part->pull * pull;
    trial->slope.of[SCREW][SCREW] += 0.5 * stiffness + drag;
    trial->slope.of[TABLE][SCREW] -= 0.5 * stiffness * growth * pull;
    trial->slope.of[SCREW][TABLE] -= 0.5 * stiffness * growth * part->pull;
    trial->slope.of[TABLE][TABLE] += 0.5 * stiffness * growth * part->pull * growth * pull;
    for (int i = 0; i < plant->freedoms; ++i) {
        trial->force[i] -= coupled * mechanics->lever[i] * way[SCREW];
        trial->slope.of[i][SCREW] += coupled * mechanics->lever[i];
        trial->slope.of[SCREW][i] += coupled * mechanics->lever[i];
    }
}

static void mean_forces(const Plant *plant, const Motion *from, const Level *level, const Part *part, Trial *trial)
{
    const Mechanics *mechanics = &plant->mechanics;
    const double *lever = mechanics->lever, *way = trial->way, h = part->length;
    const double drag[SLIDERS] = {level->viscous / h, plant->at[GUIDE_VISCOUS] / h};
    const double change = lever[SHAFT] * way[SHAFT] + lever[TABLE] * way[TABLE]
                          + (plant->freedoms > SCREW ? lever[SCREW] * way[SCREW] : 0.0);
    double stiffness, slope[SLIDERS] = {0.0}, nut[SLIDERS] = {0.0};
    const double force = mean_of_contacts(mechanics, part, change, trial, &stiffness);

    for (int i = 0; i < plant->freedoms; ++i) {
        trial->force[i] = mechanics->load[i] - lever[i] * force;
        for (int j = 0; j < plant->freedoms; ++j) {
            trial->slope.of[i][j] = stiffness * lever[i] * lever[j];
        }
    }
    nut[SHAFT] = mean_of_elements(from->element, way[SHAFT], h, &level->elements, &slope[SHAFT]);
    for (int i = 0; i < SLIDERS; ++i) {
        const double root = mechanics->root[i];
        const Element slider = mean_of_element(from->slider[i], root * way[i], level->sliding.limit[i]);
        trial->force[i] -= nut[i] + root * slider.state + drag[i] * way[i];
        trial->slope.of[i][i] += slope[i] + root * root * slider.slope + drag[i];
    }
    if (plant->freedoms > SCREW) {
        add_support(plant, from, part, change, trial);
    }
}

/* --- one part --------------------------------------------------------------------------------------------------- */

INTERNAL double deflection_of(const Mechanics *mechanics, const Motion *motion)
{
    return mechanics->lever[SHAFT] * motion->place[SHAFT] - motion->place[TABLE] + motion->place[SCREW];
}

/* middle: deflection at which the stiffness is taken [m] */
static void begin_part(const Plant *plant, const Motion *from, double length, double middle, Part *part)
{
    const Mechanics *mechanics = &plant->mechanics;
    const double twelfth = length * length / 12.0, stiffness = both_contacts(mechanics, middle).slope;
    const double time = plant->at[CONTACT_DAMPING_TIME];
    double nut = 0.0;

    part->length = length;
    part->deflection = deflection_of(mechanics, from);
    part->elastic = both_contacts(mechanics, part->deflection).force;
    for (int i = 0; i < plant->freedoms; ++i) {
        const double scaled = mechanics->lever[i] * plant->inverse[i];
        for (int j = 0; j < plant->freedoms; ++j) {
            part->rate.of[i][j] =
                (i == j) + twelfth * stiffness * scaled * (mechanics->lever[j] * plant->inverse[j]);
        }
        nut += scaled * scaled;
    }
    if (plant->freedoms > SCREW) {
        double flexible;
        part->support = 1.0 / compliance_at(mechanics, from->place[TABLE]);
        part->pull = part->support * from->place[SCREW];
        flexible = twelfth * part->support * plant->inverse[SCREW] * plant->inverse[SCREW];
        part->rate.of[SCREW][SCREW] += flexible;
        part->support_damping = time * (1.0 + flexible);
        part->coupled = time * flexible * stiffness;
    }
    part->damping = time * (1.0 + twelfth * stiffness * nut);
}

/* out = matrix in */
static void product(const Matrix *matrix, const double in[], int n, double out[])
{
    for (int i = 0; i < n; ++i) {
        out[i] = 0.0;
        for (int j = 0; j < n; ++j) {
            out[i] += matrix->of[i][j] * in[j];
        }
    }
}

/* Solution of a symmetric positive definite system, in place of the right-hand side. False: it is not one. */
static bool solved(Matrix *matrix, double right[], int n)
{
    for (int i = 0; i < n; ++i) {
        if (!(matrix->of[i][i] > 0.0 && matrix->of[i][i] < HUGE_VAL)) {
            return false;
        }
        for (int j = i + 1; j < n; ++j) {
            const double factor = matrix->of[j][i] / matrix->of[i][i];
            for (int k = i; k < n; ++k) {
                matrix->of[j][k] -= factor * matrix->of[i][k];
            }
            right[j] -= factor * right[i];
        }
    }
    for (int i = n; i-- > 0;) {
        for (int k = i + 1; k < n; ++k) {
            right[i] -= matrix->of[i][k] * right[k];
        }
        right[i] /= matrix->of[i][i];
    }
    return true;
}

static double square(const double a[], int n)
{
    double sum = 0.0;

    for (int i = 0; i < n; ++i) {
        sum += a[i] * a[i];
    }
    return sum;
}

/* Mean forces at mean speeds, scaled by the roots of the masses; what is left of the equation of motion. */
static double residual(const Plant *plant, const Motion *from, const Level *level, const Part *part,
                       const double before[], const double mean[], Trial *trial, double left[])
{
    const int n = plant->freedoms;
    double rates[FREEDOMS], scaled[FREEDOMS] = {0.0};

    product(&part->rate, mean, n, rates);
    for (int i = 0; i < n; ++i) {
        trial->way[i] = part->length * plant->inverse[i] * rates[i];
    }
    mean_forces(plant, from, level, part, trial);
    for (int i = 0; i < n; ++i) {
        scaled[i] = plant->inverse[i] * trial->force[i];
    }
    product(&part->rate, scaled, n, left);
    for (int i = 0; i < n; ++i) {
        left[i] = 2.0 * (mean[i] - before[i]) - part->length * left[i];
    }
    return square(left, n);
}

/* Correction of the mean speeds, in place of the residual. */
static bool corrected(const Plant *plant, const Part *part, const Trial *trial, double left[])
{
    const int n = plant->freedoms;
    const double h = part->length;
    double half[FREEDOMS][FREEDOMS];
    Matrix scaled, whole;

    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
            scaled.of[i][j] = plant->inverse[i] * trial->slope.of[i][j] * plant->inverse[j];
        }
    }
    for (int i = 0; i < n; ++i) {
        product(&scaled, part->rate.of[i], n, half[i]); /* row i of rate times slope, which is transposed */
    }
    for (int i = 0; i < n; ++i) {
        product(&part->rate, half[i], n, whole.of[i]);
        for (int j = 0; j < n; ++j) {
            whole.of[i][j] = h * h * whole.of[i][j] + (i == j ? 2.0 : 0.0);
        }
    }
    return solved(&whole, left, n);
}

/* Mean speeds of a part, scaled, from a guess. False: no solution was found. */
static bool find_means(const Plant *plant, const Motion *from, const Level *level, const Part *part, double mean[],
                       Trial *trial)
{
    const int n = plant->freedoms;
    double before[FREEDOMS], left[FREEDOMS], next[FREEDOMS] = {0.0}, size, scale;

    for (int i = 0; i < n; ++i) {
        before[i] = from->speed[i] / plant->inverse[i];
    }
    size = residual(plant, from, level, part, before, mean, trial, left);
    for (int k = 0; k < MOST_CORRECTIONS; ++k) {
        double result = HUGE_VAL, correction;
        bool better = false;
        if (!corrected(plant, part, trial, left)) {
            return false;
        }
        correction = square(left, n);
        /* the equation is the slope of a convex function: some share of the correction is better */
        for (double fraction = 1.0; !better; fraction *= 0.5) {
            double remaining[FREEDOMS] = {0.0};
            for (int i = 0; i < n; ++i) {
                next[i] = mean[i] - fraction * left[i];
            }
            result = residual(plant, from, level, part, before, next, trial, remaining);
            better = result <= size || fraction < 0.2 || correction <= 1e-24 * square(next, n);
            if (better) {
                memcpy(mean, next, sizeof next);
                memcpy(left, remaining, sizeof remaining);
            }
        }
        size = result;
        scale = square(mean, n) + square(before, n);
        if (correction <= LAST_CORRECTION * LAST_CORRECTION * scale || !(size > 0.0)) {
            return size < HUGE_VAL;
        }
    }
    return false;
}

/* Friction of the screw at a deflection [m] and a speed [rad/s]. */
INTERNAL void level_at(const Plant *plant, double deflection, double speed, Level *level)
{
    const double least = 1e-3 * plant->map->speed.lo, pace = fabs(speed) > least ? fabs(speed) : least;
    Point point;

    contacts_of(plant->mechanics.contact, plant->mechanics.approach, deflection, deflection, 0.0, &point.contacts);
    friction_at(plant->map, plant->at, pace, 0.0, &point);
    sliding_at(plant->at, &plant->mechanics, pace, &level->sliding);
    level->elements = point.level;
    level->viscous = point.parts.viscous / pace;
    level->wipers = point.level.coulomb > 0.0 ? point.parts.seal / point.level.coulomb : 0.0;
}

/* Direction of what has slid over a way, unless the speed at its end is against it. */
static int slip_of(double way, double speed) { return way > 0.0 && speed > 0.0 ? 1 : way < 0.0 && speed < 0.0 ? -1 : 0; }

static void slips_after(const Motion *from, const double way[], const Level *level, const Motion *to, Advance *out)
{
    const double unit = level->elements.unit;

    out->slips = 0U;
    out->slip = slip_of(way[SHAFT], to->speed[SHAFT]);
    for (int i = 0; i < ELEMENTS && out->slip != 0; ++i) {
        const Element one =
            mean_of_element(from->element[i], level->elements.root * way[SHAFT], (2.0 * i + 1.0) * unit);
        out->slips |= one.follows ? 0U : 1U << i;
    }
}

/* End of a slider over a way; its heat. */
static double end_slider(double root, double limit, double way, double speed, double *state, int *slip)
{
    const double before = within(*state, limit);
    const Element one = mean_of_element(*state, root * way, limit);
    const double lost = 0.5 * (*state * *state - before * before);

    *state = before + one.moved;
    *slip = one.follows ? 0 : slip_of(way, speed);
    return limit * (fabs(root * way) - fabs(one.moved)) + lost;
}

/* End of a part, and what it has dissipated and taken up. False: numbers become too large. */
static bool end_part(const Plant *plant, const Motion *from, const Level *level, const Part *part, const double mean[],
                     const Trial *trial, Advance *out)
{
    const Mechanics *mechanics = &plant->mechanics;
    const double h = part->length, *way = trial->way;
    double heat[PLACES], sum = 0.0, slid[SLIDERS], change = 0.0;
    Presliding elements;
    Motion *to = &out->motion;
    bool good = true;

    *to = *from;
    for (int i = 0; i < plant->freedoms; ++i) {
        to->place[i] = from->place[i] + way[i];
        to->speed[i] = 2.0 * mean[i] * plant->inverse[i] - from->speed[i];
        good = good && fabs(to->place[i]) < TOO_FAST && fabs(to->speed[i]) < TOO_FAST;
        change += mechanics->lever[i] * way[i];
    }
    presliding_after_step(from->element, way[SHAFT] / h, h, &level->elements, &elements);
    for (int i = 0; i < ELEMENTS; ++i) {
        to->element[i] = elements.element[i];
        good = good && fabs(to->element[i]) < TOO_FAST;
    }
    for (int i = 0; i < SLIDERS; ++i) {
        slid[i] = end_slider(mechanics->root[i], level->sliding.limit[i], way[i], to->speed[i], &to->slider[i],
                             &out->slider_slip[i]);
        good = good && fabs(to->slider[i]) < TOO_FAST;
    }
    heat[WIPER_PLACE] = level->wipers * h * elements.power;
    heat[NUT_PLACE] = level->viscous * way[SHAFT] * way[SHAFT] / h + (h * elements.power - heat[WIPER_PLACE]);
    heat[BEARING_PLACE] = level->sliding.bearings * slid[SHAFT];
    heat[MOTOR_PLACE] = slid[SHAFT] - heat[BEARING_PLACE];
    heat[GUIDE_PLACE] = plant->at[GUIDE_VISCOUS] * way[TABLE] * way[TABLE] / h + slid[TABLE];
    heat[DAMPING_PLACE] = fabs(trial->damped * change);
    if (plant->freedoms > SCREW) {
        heat[DAMPING_PLACE] +=
            (part->support_damping * part->support * way[SCREW] + 2.0 * part->coupled * change) * way[SCREW] / h;
    }
    for (int i = 0; i < PLACES; ++i) {
        out->heat[i] += heat[i];
        sum += out->heat[i];
    }
    out->supplied += plant->at[MOTOR_TORQUE] * way[SHAFT] + plant->at[EXTERNAL_FORCE] * way[TABLE];
    slips_after(from, way, level, to, out);
    return good && sum < HUGE_VAL && fabs(out->supplied) < HUGE_VAL;
}

/* The stiffness of the elements stays while they hold a load. */
static void hold_stiffness(const Motion *from, const PreslidingLevel *before, PreslidingLevel *level)
{
    const double fixed = ELEMENTS * before->root * before->root;
    const double present = ELEMENTS * level->root * level->root;

    if (!stiffness_follows(elements_free(from->element, before->unit), fixed, present)) {
        *level = presliding_level(level->coulomb, fixed, level->damping);
    }
}

/* Advances by a part. The friction is that at the middle of a first solution, which is made with the last friction. */
INTERNAL bool make_part(const Plant *plant, double length, Advance *state)
{
    const Motion from = state->motion;
    double mean[FREEDOMS], middle;
    Level level;
    Trial trial;
    Part part;

    for (int i = 0; i < plant->freedoms; ++i) {
        mean[i] = from.speed[i] / plant->inverse[i];
    }
    begin_part(plant, &from, length, deflection_of(&plant->mechanics, &from), &part);
    if (!find_means(plant, &from, &state->level, &part, mean, &trial)) {
        return false;
    }
    middle = part.deflection;
    for (int i = 0; i < plant->freedoms; ++i) {
        middle += 0.5 * plant->mechanics.lever[i] * trial.way[i];
    }
    level_at(plant, middle, trial.way[SHAFT] / length, &level);
    hold_stiffness(&from, &state->level.elements, &level.elements);
    state->level = level;
    begin_part(plant, &from, length, middle, &part);
    return find_means(plant, &from, &state->level, &part, mean, &trial)
           && end_part(plant, &from, &state->level, &part, mean, &trial, state);
}
