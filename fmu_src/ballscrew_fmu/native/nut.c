#include "nut.h"

#include <math.h>

#include "law.h"

/* --- from inputs to places in the map ---------------------------------------------------------------------------- */

void nut_loads(const Map *map, double preload, double axial_load, Loads *loads)
{
    if (loads->known && loads->preload == preload && loads->axial_load == axial_load) {
        return;
    }
    loads->known = true;
    loads->preload = preload;
    loads->axial_load = axial_load;
    loads->preload_clamped = loads->axial_load_clamped = false;
    if (preload < map->preload.lo || preload > map->force.hi) {
        loads->preload_clamped = true;
        preload = least(most(preload, 0.0), map->force.hi);
    }
    loads->nuts = 1;
    loads->force[0] = loads->force[1] = preload;
    if (axial_load != 0.0) {
        loads->nuts = 2;
        map_forces(map, preload, axial_load, loads->force);
        if (loads->force[1] > map->force.hi) {
            loads->axial_load_clamped = true;
            loads->force[1] = map->force.hi;
        }
    }
    loads->hysteresis = loads->sliding_load = 0.0;
    for (int n = 0; n < loads->nuts; ++n) {
        const double force = loads->force[n], f = force < map->force.lo ? force / map->force.lo : 1.0;
        const Place place = axis_place(&map->force, force);
        const double *curves = map->curves + (ptrdiff_t)place.cell * CURVE_COLUMNS;
        double sum[2] = {0.0, 0.0}, *w = loads->weight[n];
        cubic_weights(place.t, w);
        for (int a = 0; a < 4; ++a) {
            sum[0] += w[a] * curves[a * CURVE_COLUMNS + HYSTERESIS_CURVE];
            sum[1] += w[a] * curves[a * CURVE_COLUMNS + SLIDING_CURVE];
        }
        loads->place[n] = place;
        loads->force_share[n] = f;
        loads->third[n] = f < 1.0 ? pow(f, 1.0 / 3.0) : 1.0;
        loads->hysteresis += exp(sum[0]) * f * loads->third[n];
        loads->sliding_load += exp(sum[1]) * f;
    }
    if (loads->nuts == 1) {
        loads->hysteresis *= 2.0;
        loads->sliding_load *= 2.0;
    }
}

/* sixteen weights of the neighbours over speed and temperature */
static void plane_weights(const double w_j[4], const double w_k[4], double plane[16])
{
    for (int b = 0; b < 4; ++b) {
        for (int c = 0; c < 4; ++c) {
            plane[4 * b + c] = w_j[b] * w_k[c];
        }
    }
}

void nut_conditions(const Map *map, double speed, double temperature, Conditions *now)
{
    double w_j[4], w_k[4];

    speed = fabs(speed);
    now->speed_clamped = speed > map->speed.hi;
    now->temperature_clamped = !(temperature >= map->temperature.lo && temperature <= map->temperature.hi);
    now->share = speed < map->speed.lo ? speed / map->speed.lo : 1.0;
    now->speed = axis_place(&map->speed, speed);
    now->temperature = axis_place(&map->temperature, temperature);
    cubic_weights(now->speed.t, w_j);
    cubic_weights(now->temperature.t, w_k);
    plane_weights(w_j, w_k, now->plane);
}

/* Weights for the slope over speed, per cell. */
static void slope_weights(const Conditions *now, double slope_plane[16])
{
    double w_j[4], w_k[4];

    cubic_slopes(now->speed.t, w_j);
    cubic_weights(now->temperature.t, w_k);
    plane_weights(w_j, w_k, slope_plane);
}

/* --- contraction ------------------------------------------------------------------------------------------------- */

/* Sum of the sixteen rows of neighbours; sums: as many columns at once as stay in registers. */
static inline void add_rows(const double *block, ptrdiff_t by_speed, ptrdiff_t by_temperature, const double plane[16],
                            double sums[], int columns)
{
    double run[16] = {0.0};

    for (int b = 0; b < 4; ++b) {
        for (int c = 0; c < 4; ++c) {
            const double *row = block + b * by_speed + c * by_temperature;
            const double w = plane[4 * b + c];
            for (int i = 0; i < columns; ++i) {
                run[i] += w * row[i];
            }
        }
    }
    for (int i = 0; i < columns; ++i) {
        sums[i] = run[i];
    }
}

static inline void over_force(const double w[4], const double sums[], int columns, double values[])
{
    for (int i = 0; i < columns; ++i) {
        values[i] = w[0] * sums[i] + w[1] * sums[columns + i] + w[2] * sums[2 * columns + i]
                    + w[3] * sums[3 * columns + i];
    }
}

/* surfaces at the cell of a force, contracted over speed and temperature */
static void contract_columns(const Map *map, Place force, const Conditions *now, const double plane[16],
                             double sums[4 * TORQUE_COLUMNS])
{
    const double *block = map_block(map, map->torque, TORQUE_COLUMNS, now->speed, now->temperature, force);

    add_rows(block, map_speed_stride(map, TORQUE_COLUMNS), map_temperature_stride(map, TORQUE_COLUMNS), plane, sums,
             4 * TORQUE_COLUMNS);
}

/* surfaces at the force of a nut: contracted over speed and temperature, then over force */
static void contract_torque(const Map *map, const Loads *loads, int nut, const Conditions *now, const double plane[16],
                            double values[TORQUE_COLUMNS])
{
    double sums[4 * TORQUE_COLUMNS];

    contract_columns(map, loads->place[nut], now, plane, sums);
    over_force(loads->weight[nut], sums, TORQUE_COLUMNS, values);
}

static void contract_films(const Map *map, const Loads *loads, int nut, const Conditions *now,
                           double values[FILM_COLUMNS])
{
    const double *block =
        map_block(map, map->films, FILM_COLUMNS, now->speed, now->temperature, loads->place[nut]);
    const ptrdiff_t by_speed = map_speed_stride(map, FILM_COLUMNS);
    const ptrdiff_t by_temperature = map_temperature_stride(map, FILM_COLUMNS);
    double sums[4 * FILM_COLUMNS];

    for (int half = 0; half < 4 * FILM_COLUMNS; half += 2 * FILM_COLUMNS) {
        add_rows(block + half, by_speed, by_temperature, now->plane, sums + half, 2 * FILM_COLUMNS);
    }
    over_force(loads->weight[nut], sums, FILM_COLUMNS, values);
}

/* --- torque and films at a point --------------------------------------------------------------------------------- */

/* Share of the viscous torque that is left below the lowest speed of the map. The exponent of speed at the end of the
   axis follows from the slopes of torque and film; x: roughness over film, squared. Below 3 the law is monotone. */
static double slow_share(const Map *map, const Conditions *now, int raceway, const double slopes[TORQUE_COLUMNS],
                         double x)
{
    const double s = now->share;
    const double exponent =
        (slopes[VISCOUS_SCREW + raceway] + 2.0 * x / (1.0 + x) * slopes[EFFECTIVE_FILM_SCREW + raceway])
        * map->speed.scale;
    const double c = 0.5 * (least(most(exponent, 0.0), 3.0) - 1.0);

    return s * (1.0 - c + c * s * s);
}

double nut_viscous_torque(const Map *map, const Loads *loads, const Conditions *now, double ratio, double roughness)
{
    double slope_plane[16], total = 0.0;

    if (now->share < 1.0) {
        slope_weights(now, slope_plane);
    }
    for (int n = 0; n < loads->nuts; ++n) {
        double values[TORQUE_COLUMNS], slopes[TORQUE_COLUMNS], viscous = 0.0;
        contract_torque(map, loads, n, now, now->plane, values);
        if (now->share < 1.0) {
            contract_torque(map, loads, n, now, slope_plane, slopes);
        }
        for (int raceway = 0; raceway < 2; ++raceway) {
            const double share = roughness * exp(-values[EFFECTIVE_FILM_SCREW + raceway]), x = share * share;
            const double torque = exp(values[VISCOUS_SCREW + raceway]) / (1.0 + x);
            viscous += now->share < 1.0 ? torque * slow_share(map, now, raceway, slopes, x) : torque;
        }
        total += viscous * loads->third[n] * loads->third[n];
    }
    total *= ratio;
    return loads->nuts == 1 ? 2.0 * total : total;
}

void nut_films(const Map *map, const Loads *loads, const Conditions *now, Films *out)
{
    const double s = now->share, film_share = s < 1.0 ? pow(s, FILM_SPEED_EXPONENT) : 1.0;

    for (int n = 0; n < loads->nuts; ++n) {
        const double *curves = map->curves + (ptrdiff_t)loads->place[n].cell * CURVE_COLUMNS, *w = loads->weight[n];
        double values[FILM_COLUMNS], pressure = 0.0, load = 0.0, film[3], extreme[3];
        contract_films(map, loads, n, now, values);
        for (int a = 0; a < 4; ++a) {
            pressure += w[a] * curves[a * CURVE_COLUMNS + PRESSURE_CURVE];
            load += w[a] * curves[a * CURVE_COLUMNS + BALL_LOAD_CURVE];
        }
        /* a spline through nearly equal films may cross another */
        film[0] = film_share
                  * exp(least(least(values[MINIMUM_FILM_SCREW], values[MINIMUM_FILM_NUT]),
                              least(values[CENTRAL_FILM_SCREW], values[CENTRAL_FILM_NUT])));
        film[1] = film_share * exp(values[CENTRAL_FILM_SCREW]);
        film[2] = film_share * exp(values[CENTRAL_FILM_NUT]);
        extreme[0] = s * loads->third[n] * exp(most(values[RISE_SCREW], values[RISE_NUT]));
        extreme[1] = loads->third[n] * exp(pressure);
        extreme[2] = loads->force_share[n] * exp(load);
        for (int i = 0; i < 3; ++i) {
            out->film[i] = n == 0 ? film[i] : least(out->film[i], film[i]);
            out->extreme[i] = n == 0 ? extreme[i] : most(out->extreme[i], extreme[i]);
        }
    }
}

/* --- torque over preload ----------------------------------------------------------------------------------------- */

/* A value and its derivative over the logarithm of the force of a nut. */
typedef struct {
    double v, d;
} Along;

/* slow_share with its derivative; values, slopes, x: along the force */
static Along slow_share_along(const Map *map, const Conditions *now, Along torque_slope, Along film_slope, Along x)
{
    const double s = now->share, rough = x.v / (1.0 + x.v), rough_d = x.d / ((1.0 + x.v) * (1.0 + x.v));
    const double exponent = (torque_slope.v + 2.0 * rough * film_slope.v) * map->speed.scale;
    const double c = 0.5 * (least(most(exponent, 0.0), 3.0) - 1.0);
    Along share = {s * (1.0 - c + c * s * s), 0.0};

    if (exponent > 0.0 && exponent < 3.0) {
        const double c_d =
            0.5 * (torque_slope.d + 2.0 * (rough * film_slope.d + rough_d * film_slope.v)) * map->speed.scale;
        share.d = s * (s * s - 1.0) * c_d;
    }
    return share;
}

/* Viscous torque of one nut at apparent viscosity ratio 1 and full share of force. w_d: derivative of the weights */
static Along viscous_along(const Map *map, const Conditions *now, const double w[4], const double w_d[4],
                           const double sums[], const double slope_sums[], double roughness)
{
    double value[TORQUE_COLUMNS], value_d[TORQUE_COLUMNS], slope[TORQUE_COLUMNS], slope_d[TORQUE_COLUMNS];
    Along viscous = {0.0, 0.0};

    over_force(w, sums, TORQUE_COLUMNS, value);
    over_force(w_d, sums, TORQUE_COLUMNS, value_d);
    if (now->share < 1.0) {
        over_force(w, slope_sums, TORQUE_COLUMNS, slope);
        over_force(w_d, slope_sums, TORQUE_COLUMNS, slope_d);
    }
    for (int raceway = 0; raceway < 2; ++raceway) {
        const int t = VISCOUS_SCREW + raceway, h = EFFECTIVE_FILM_SCREW + raceway;
        const double share = roughness * exp(-value[h]);
        const Along x = {share * share, -2.0 * share * share * value_d[h]};
        Along torque = {exp(value[t]) / (1.0 + x.v), 0.0};
        torque.d = torque.v * (value_d[t] - x.d / (1.0 + x.v));
        if (now->share < 1.0) {
            const Along torque_slope = {slope[t], slope_d[t]}, film_slope = {slope[h], slope_d[h]};
            const Along slow = slow_share_along(map, now, torque_slope, film_slope, x);
            torque.d = torque.d * slow.v + torque.v * slow.d;
            torque.v *= slow.v;
        }
        viscous.v += torque.v;
        viscous.d += torque.d;
    }
    return viscous;
}

void nut_torque_over_preload(const Map *map, double preload, double axial_load, const Conditions *now, double ratio,
                             double roughness, Loads *loads, Columns *columns, TorqueOverPreload *out)
{
    const TorqueOverPreload none = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    double slope_plane[16], force_slope = 1.0, both;

    nut_loads(map, preload, axial_load, loads);
    if (loads->nuts == 2) {
        force_slope = map_force_slope(map, least(most(preload, 0.0), map->force.hi), axial_load);
    }
    if (now->share < 1.0) {
        slope_weights(now, slope_plane);
    }
    *out = none;
    for (int n = 0; n < loads->nuts; ++n) {
        const double force = loads->force[n], f = loads->force_share[n], third = loads->third[n];
        const double *w = loads->weight[n];
        const double *curves = map->curves + (ptrdiff_t)loads->place[n].cell * CURVE_COLUMNS;
        /* over the logarithm of the force: of the weights within the axis, of the power laws below it */
        const double within = force >= map->force.lo && force <= map->force.hi ? map->force.scale : 0.0;
        const double below = force < map->force.lo ? 1.0 : 0.0;
        const double rate = n == 1 && loads->axial_load_clamped ? 0.0 : force_slope / most(force, SMOOTH);
        double w_d[4], curve[2] = {0.0, 0.0}, curve_d[2] = {0.0, 0.0}, hysteresis, sliding;
        Along viscous;

        cubic_slopes(loads->place[n].t, w_d);
        for (int a = 0; a < 4; ++a) {
            w_d[a] *= within;
            curve[0] += w[a] * curves[a * CURVE_COLUMNS + HYSTERESIS_CURVE];
            curve[1] += w[a] * curves[a * CURVE_COLUMNS + SLIDING_CURVE];
            curve_d[0] += w_d[a] * curves[a * CURVE_COLUMNS + HYSTERESIS_CURVE];
            curve_d[1] += w_d[a] * curves[a * CURVE_COLUMNS + SLIDING_CURVE];
        }
        if (columns->cell[n] != loads->place[n].cell) {
            columns->cell[n] = loads->place[n].cell;
            contract_columns(map, loads->place[n], now, now->plane, columns->sums[n]);
            if (now->share < 1.0) {
                contract_columns(map, loads->place[n], now, slope_plane, columns->slope_sums[n]);
            }
        }
        viscous = viscous_along(map, now, w, w_d, columns->sums[n], columns->slope_sums[n], roughness);
        viscous.v *= ratio * third * third;
        viscous.d = ratio * third * third * viscous.d + below * (2.0 / 3.0) * viscous.v;
        hysteresis = exp(curve[0]) * f * third;
        sliding = exp(curve[1]) * f;
        out->viscous += viscous.v;
        out->hysteresis += hysteresis;
        out->sliding_load += sliding;
        out->viscous_slope += rate * viscous.d;
        out->hysteresis_slope += rate * hysteresis * (curve_d[0] + below * (4.0 / 3.0));
        out->sliding_slope += rate * sliding * (curve_d[1] + below);
    }
    both = loads->nuts == 1 ? 2.0 : 1.0;
    out->viscous *= both;
    out->hysteresis *= both;
    out->sliding_load *= both;
    out->viscous_slope *= both;
    out->hysteresis_slope *= both;
    out->sliding_slope *= both;
}
