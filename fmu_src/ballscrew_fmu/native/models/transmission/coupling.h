/* Stability of an explicit exchange of motion and force with the masses of the importer, from the steps alone.

   The rate of the way by which the screw leads the nut, ratio w - v, changes over a step h by -h F/m and by loads that
   hardly change: 1/m = 1/table mass + ratio^2/inertia of the shaft. Least squares over the last steps give m, for a force
   of the same step (screw first) and of the one before (both with the values of the last step), and the way itself shows
   how the masses are integrated: semi-implicitly (velocity, then position) or by the trapezoidal rule. Where the changes
   of the acceleration grow, the rule is applied: with
   a = h^2 k/m, b = h c/m, stiffness k and damping c of the nut, the linear exchange is stable as in coupling_stable. */
#ifndef BALLSCREW_COUPLING_H
#define BALLSCREW_COUPLING_H

#include <math.h>
#include <stdbool.h>
#include <string.h>

#define WINDOWS 4

typedef struct {
    double way, drift, acceleration; /* [m], [m/s], [m/s2] of the last step */
    double force[3];                 /* [N] of the last steps */
    double steps;                    /* that have been made, until they suffice */
    double aa, ff[2], fa[2];         /* sums of squares and products of changes; by the lag of the force */
    double miss[2];                  /* sums of squares of what the way differs from each rule: semi-implicit first */
    double window[WINDOWS];          /* steps in windows of these lengths; */
    double first[WINDOWS];           /* aa at their starts */
    double grown[WINDOWS];           /* windows in a row in which aa has grown */
} Coupling;

typedef struct {
    bool parallel, trapezoidal;
    double mass, step; /* [kg]; [s] largest stable one */
} CouplingLimit;

#define COUPLING_STEPS 6.0    /* at least for an estimate, the first three have no changes */
#define COUPLING_FORGETS 0.9  /* weight of the sums in the next step */
#define COUPLING_CERTAIN 0.99 /* squared correlation */
#define COUPLING_CLEAR 0.2    /* what the better lag leaves over what the other one leaves */
#define COUPLING_GROWN 2.0 /* windows in a row in which the changes grow, where the exchange is unstable */
#define COUPLING_SLOW 3e-3    /* h^2 k/m, below which smooth motion looks like a mass */

/* After a step that began with this way and drift. last_step [s], last_force [N]: of the step before. */
static inline void coupling_step(Coupling *c, double way, double drift, double last_step, double last_force)
{
    const double acceleration = (drift - c->drift) / last_step, change = acceleration - c->acceleration;
    const double moved = way - c->way, semi_implicit = moved - last_step * drift;
    const double trapezoidal = moved - 0.5 * last_step * (drift + c->drift);

    c->force[2] = c->force[1];
    c->force[1] = c->force[0];
    c->force[0] = last_force;
    if (c->steps >= 3.0) {
        static const double length[WINDOWS] = {1.0, 3.0, 8.0, 64.0}, growth[WINDOWS] = {100.0, 30.0, 10.0, 1.4};
        c->aa = COUPLING_FORGETS * c->aa + change * change;
        for (int i = 0; i < WINDOWS; ++i) {
            c->first[i] = c->steps > 3.0 ? c->first[i] : c->aa;
            c->window[i] += 1.0;
            if (c->window[i] >= length[i]) {
                c->grown[i] = c->first[i] > 0.0 && c->aa > growth[i] * c->first[i] ? c->grown[i] + 1.0 : 0.0;
                c->first[i] = c->aa;
                c->window[i] = 0.0;
            }
        }
        c->miss[0] = COUPLING_FORGETS * c->miss[0] + semi_implicit * semi_implicit;
        c->miss[1] = COUPLING_FORGETS * c->miss[1] + trapezoidal * trapezoidal;
        for (int lag = 0; lag < 2; ++lag) {
            const double difference = c->force[lag] - c->force[lag + 1];
            c->ff[lag] = COUPLING_FORGETS * c->ff[lag] + difference * difference;
            c->fa[lag] = COUPLING_FORGETS * c->fa[lag] + difference * change;
        }
    }
    c->way = way;
    c->drift = drift;
    c->acceleration = acceleration;
    c->steps = c->steps < COUPLING_STEPS ? c->steps + 1.0 : c->steps;
    if (!(c->aa + c->ff[0] + c->ff[1] + c->miss[0] + c->miss[1] + fabs(acceleration) < 1e300)) {
        memset(c, 0, sizeof *c); /* values that no master in use gives */
    }
}

/* Schur and Cohn, of the linear exchange. */
static inline bool coupling_stable(const CouplingLimit *of, double a, double b)
{
    const double c = b + (of->trapezoidal ? 0.5 : 1.0) * a;

    if (of->parallel) {
        return c < 1.0 && c * (1.0 - c) > a;
    }
    return of->trapezoidal ? a + b < 2.0 : 3.0 * a + 2.0 * b < 4.0;
}

static inline bool grows(const Coupling *c)
{
    bool found = false;

    for (int i = 0; i < WINDOWS; ++i) {
        found = found || c->grown[i] >= COUPLING_GROWN;
    }
    return found;
}

/* Whether steps of this length [s] are unstable, and which are not. stiffness [N/m], damping time [s] of the nut without
   load. */
static inline bool coupling_unstable(const Coupling *c, double stiffness, double damping_time, double step,
                                     CouplingLimit *limit)
{
    double left[2], low = 0.0, high = step; /* left: share of the changes that a lag leaves unexplained */
    int lag;

    if (c->steps < COUPLING_STEPS || !grows(c) || !(stiffness > 0.0)) {
        return false;
    }
    for (int i = 0; i < 2; ++i) {
        left[i] = c->fa[i] < 0.0 && c->ff[i] * c->aa > 0.0 ? 1.0 - c->fa[i] / c->ff[i] * (c->fa[i] / c->aa) : 1.0;
    }
    limit->parallel = left[1] < COUPLING_CLEAR * left[0];
    limit->trapezoidal = c->miss[1] < c->miss[0];
    lag = limit->parallel ? 1 : 0;
    if (!(left[lag] < 1.0 - COUPLING_CERTAIN)) {
        return false;
    }
    limit->mass = -c->ff[lag] / c->fa[lag];
    stiffness /= limit->mass; /* per mass */
    if (!(step * step * stiffness > COUPLING_SLOW)
        || coupling_stable(limit, step * step * stiffness, step * damping_time * stiffness)) {
        return false;
    }
    for (int i = 0; i < 40; ++i) {
        const double middle = 0.5 * (low + high);
        const bool stable = coupling_stable(limit, middle * middle * stiffness, middle * damping_time * stiffness);
        low = stable ? middle : low;
        high = stable ? high : middle;
    }
    limit->step = low;
    return true;
}

#endif
