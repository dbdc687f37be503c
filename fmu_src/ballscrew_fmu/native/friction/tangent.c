/* Directional derivatives: the formulas of model.c and law.c again, in numbers that carry their derivative along one
   direction. The tests hold the values of both to each other and the derivatives to differences. */
#include <math.h>
#include <string.h>

#include "law.h"
#include "model.h"

typedef struct {
    double v, d; /* value, derivative */
} Dual;

static Dual dual(double v, double d)
{
    Dual out;
    out.v = v;
    out.d = d;
    return out;
}

static Dual constant(double v)
{
    return dual(v, 0.0);
}

static Dual add(Dual a, Dual b)
{
    return dual(a.v + b.v, a.d + b.d);
}

static Dual subtract(Dual a, Dual b)
{
    return dual(a.v - b.v, a.d - b.d);
}

static Dual multiply(Dual a, Dual b)
{
    return dual(a.v * b.v, a.d * b.v + a.v * b.d);
}

static Dual divide(Dual a, Dual b)
{
    const double ratio = a.v / b.v;
    return dual(ratio, (a.d - ratio * b.d) / b.v);
}

static Dual times(double factor, Dual a)
{
    return dual(factor * a.v, factor * a.d);
}

static Dual exponential(Dual a)
{
    const double e = exp(a.v);
    return dual(e, e * a.d);
}

static Dual power(Dual a, double exponent)
{
    /* the slope of a film at rest is infinite: 0 is answered there */
    return a.v > 0.0 ? dual(pow(a.v, exponent), exponent * pow(a.v, exponent - 1.0) * a.d) : constant(0.0);
}

static Dual lesser(Dual a, Dual b)
{
    return a.v < b.v ? a : b;
}

static Dual greater(Dual a, Dual b)
{
    return a.v > b.v ? a : b;
}

static Dual absolute(Dual a)
{
    return a.v < 0.0 ? times(-1.0, a) : a;
}

/* --- splines --- */

typedef struct {
    int cell;
    Dual weight[4], slope[4]; /* slope: derivative of the weights over the position */
} Stencil;

static Stencil stencil(const Axis *axis, Dual value)
{
    const Place place = axis_place(axis, value.v);
    const bool inside = value.v > axis->lo && value.v < axis->hi;
    const double rate = !inside ? 0.0 : value.d * axis->scale / (axis->logarithmic ? value.v : 1.0);
    double weights[4], slopes[4], bends[4];
    Stencil out;

    cubic_weights(place.t, weights);
    cubic_slopes(place.t, slopes);
    cubic_bends(place.t, bends);
    out.cell = place.cell;
    for (int i = 0; i < 4; ++i) {
        out.weight[i] = dual(weights[i], slopes[i] * rate);
        out.slope[i] = dual(slopes[i], bends[i] * rate);
    }
    return out;
}

/* values of all columns of a surface, over speed, temperature and force */
static void contracted(const Map *map, const double *surfaces, int columns, const Dual by_speed[4], int speed_cell,
                       const Stencil *temperature, const Stencil *force, Dual values[])
{
    for (int i = 0; i < columns; ++i) {
        values[i] = constant(0.0);
    }
    for (int b = 0; b < 4; ++b) {
        for (int c = 0; c < 4; ++c) {
            const double *row = surfaces + (speed_cell + b) * map_speed_stride(map, columns)
                                + (temperature->cell + c) * map_temperature_stride(map, columns)
                                + (ptrdiff_t)force->cell * columns;
            const Dual plane = multiply(by_speed[b], temperature->weight[c]);
            for (int a = 0; a < 4; ++a) {
                const Dual w = multiply(plane, force->weight[a]);
                for (int i = 0; i < columns; ++i) {
                    values[i] = add(values[i], times(row[a * columns + i], w));
                }
            }
        }
    }
}

static Dual along(const Dual weights[4], const double *values, int stride)
{
    Dual sum = constant(0.0);
    for (int a = 0; a < 4; ++a) {
        sum = add(sum, times(values[a * stride], weights[a]));
    }
    return sum;
}

/* --- nuts --- */

typedef struct {
    Dual viscous, hysteresis, sliding, film[3], extreme[3];
} Nut;

static Nut nut_at(const Map *map, const Dual at[], Dual force_value, const Stencil *speed, const Stencil *temperature,
                  Dual s)
{
    const Stencil force = stencil(&map->force, force_value);
    const double *curves = map->curves + (ptrdiff_t)force.cell * CURVE_COLUMNS;
    const Dual f = lesser(times(1.0 / map->force.lo, force_value), constant(1.0));
    const Dual third = power(f, 1.0 / 3.0), film_share = power(s, FILM_SPEED_EXPONENT), one = constant(1.0);
    Dual values[MOST_COLUMNS], slopes[MOST_COLUMNS];
    Nut nut;

    contracted(map, map->torque, TORQUE_COLUMNS, speed->weight, speed->cell, temperature, &force, values);
    contracted(map, map->torque, TORQUE_COLUMNS, speed->slope, speed->cell, temperature, &force, slopes);
    nut.viscous = constant(0.0);
    for (int raceway = 0; raceway < 2; ++raceway) {
        const Dual ratio = divide(at[ROUGHNESS_HEIGHT], exponential(values[EFFECTIVE_FILM_SCREW + raceway]));
        const Dual x = multiply(ratio, ratio), share = divide(one, add(one, x));
        Dual torque = multiply(exponential(values[VISCOUS_SCREW + raceway]), share);
        if (s.v < 1.0) {
            const Dual exponent =
                times(map->speed.scale,
                      add(slopes[VISCOUS_SCREW + raceway],
                          times(2.0, multiply(multiply(x, share), slopes[EFFECTIVE_FILM_SCREW + raceway]))));
            const Dual c =
                times(0.5, subtract(lesser(greater(exponent, constant(0.0)), constant(3.0)), one));
            torque = multiply(torque, multiply(s, add(subtract(one, c), multiply(c, multiply(s, s)))));
        }
        nut.viscous = add(nut.viscous, torque);
    }
    nut.viscous = multiply(multiply(at[APPARENT_VISCOSITY_RATIO], nut.viscous), multiply(third, third));
    nut.hysteresis =
        multiply(exponential(along(force.weight, curves + HYSTERESIS_CURVE, CURVE_COLUMNS)), multiply(f, third));
    nut.sliding = multiply(multiply(at[NET_SLIDING_COEFFICIENT], f),
                           exponential(along(force.weight, curves + SLIDING_CURVE, CURVE_COLUMNS)));
    contracted(map, map->films, FILM_COLUMNS, speed->weight, speed->cell, temperature, &force, values);
    nut.film[0] = multiply(film_share,
                           exponential(lesser(lesser(values[MINIMUM_FILM_SCREW], values[MINIMUM_FILM_NUT]),
                                             lesser(values[CENTRAL_FILM_SCREW], values[CENTRAL_FILM_NUT]))));
    nut.film[1] = multiply(film_share, exponential(values[CENTRAL_FILM_SCREW]));
    nut.film[2] = multiply(film_share, exponential(values[CENTRAL_FILM_NUT]));
    nut.extreme[0] = multiply(multiply(s, third), exponential(greater(values[RISE_SCREW], values[RISE_NUT])));
    nut.extreme[1] = multiply(third, exponential(along(force.weight, curves + PRESSURE_CURVE, CURVE_COLUMNS)));
    nut.extreme[2] = multiply(f, exponential(along(force.weight, curves + BALL_LOAD_CURVE, CURVE_COLUMNS)));
    return nut;
}

/* map_forces */
static void forces_at(const Map *map, Dual preload, Dual axial_load, Dual force[2])
{
    const Dual load = absolute(axial_load);
    const int side = axial_load.v > 0.0 ? 0 : 1, n_p = map->preload.last + 4, n_q = map->share.last + 4;
    const double *separation = map->separation + side * n_p;
    Stencil p, q;
    Dual share, y = constant(0.0);

    force[0] = constant(0.0);
    force[1] = load;
    if (!(preload.v > 0.0)) {
        return;
    }
    p = stencil(&map->preload, preload);
    share = divide(load, multiply(preload, exponential(along(p.weight, separation + p.cell, 1))));
    if (share.v >= 1.0) {
        return;
    }
    q = stencil(&map->share, share);
    for (int a = 0; a < 4; ++a) {
        const double *row = map->sharing + (ptrdiff_t)(side * n_p + p.cell + a) * n_q + q.cell;
        y = add(y, multiply(p.weight[a], along(q.weight, row, 1)));
    }
    force[0] = multiply(preload, power(y, 1.5));
    force[1] = add(force[0], load);
}

/* --- standstill --- */

static Dual sign_at(Dual speed, Dual regularization)
{
    Dual t;
    if (!(regularization.v > 0.0)) {
        return constant(regularised_sign(speed.v, 0.0));
    }
    t = divide(speed, regularization);
    t.v = tanh(t.v);
    t.d *= 1.0 - t.v * t.v;
    return t;
}

static Dual within_at(Dual deflection, Dual limit)
{
    return lesser(greater(deflection, times(-1.0, limit)), limit);
}

static Dual rate_at(Dual deflection, Dual speed, Dual limit)
{
    Dual wound, yielding;
    if (!(limit.v > 0.0)) {
        return constant(0.0);
    }
    wound = within_at(deflection, limit);
    wound = speed.v < 0.0 ? times(-1.0, wound) : wound;
    yielding = divide(subtract(wound, times(ELASTIC_SHARE, limit)), times(1.0 - ELASTIC_SHARE, limit));
    return multiply(speed, subtract(constant(1.0), greater(yielding, constant(0.0))));
}

/* torque, power and rate of the bristle */
typedef struct {
    Dual torque, power, rate;
} Bristle;

static Bristle bristle_over_step(Dual before, Dual speed, double step, Dual limit, Dual stiffness, Dual damping)
{
    const Dual z = within_at(before, limit), travel = times(step, absolute(speed));
    const Dual lost = times(0.5, multiply(stiffness, subtract(multiply(before, before), multiply(z, z))));
    const double direction = speed.v < 0.0 ? -1.0 : 1.0;
    const Dual q_0 = times(direction, z), span = times(1.0 - ELASTIC_SHARE, limit);
    const Dual elastic = lesser(travel, greater(subtract(times(ELASTIC_SHARE, limit), q_0), constant(0.0)));
    const Dual sliding = subtract(travel, elastic);
    Dual q = add(q_0, elastic), heat;
    Dual integral = add(multiply(q_0, elastic), times(0.5, multiply(elastic, elastic)));
    Bristle out;

    if (sliding.v > 0.0) {
        const Dual x = divide(sliding, span), gap = subtract(limit, q);
        const Dual decay = dual(-expm1(-x.v), exp(-x.v) * x.d);
        integral = add(integral, subtract(multiply(limit, sliding), multiply(multiply(gap, span), decay)));
        q = add(q, multiply(gap, decay));
    }
    out.rate = times(direction / step, subtract(q, q_0));
    out.torque = add(multiply(stiffness, times(direction, q)), multiply(damping, out.rate));
    heat = subtract(multiply(stiffness, integral),
                    times(0.5, multiply(stiffness, subtract(multiply(q, q), multiply(q_0, q_0)))));
    heat = add(heat, multiply(damping, multiply(times(direction, out.rate), travel)));
    out.power = times(1.0 / step, add(lost, greater(heat, constant(0.0))));
    out.rate = times(1.0 / step, subtract(times(direction, q), before));
    return out;
}

static Bristle bristle_at(const Model *model, const Dual at[], Dual coulomb)
{
    const Dual stiffness = at[PRESLIDING_STIFFNESS], damping = at[PRESLIDING_DAMPING], speed = at[SPEED];
    const Dual deflection = at[PRESLIDING_DEFLECTION], limit = divide(coulomb, stiffness);
    Bristle out = {{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}};

    if (model->continuous && model->slip != 0) {
        out.torque = times(model->slip, coulomb);
        out.power = multiply(coulomb, absolute(speed));
        return out;
    }
    if (model->continuous) {
        const Dual wound = multiply(stiffness, within_at(deflection, limit));
        out.rate = rate_at(deflection, speed, limit);
        out.torque = add(wound, multiply(damping, out.rate));
        out.power = add(multiply(wound, subtract(speed, out.rate)), multiply(multiply(damping, out.rate), speed));
        out.power = greater(out.power, constant(0.0));
        return out;
    }
    if (!(coulomb.v > 0.0)) {
        return out;
    }
    if (model->step > 0.0) {
        return bristle_over_step(deflection, speed, model->step, limit, stiffness, damping);
    }
    out.torque = multiply(stiffness, within_at(deflection, limit));
    out.rate = rate_at(deflection, speed, limit);
    out.power = multiply(out.torque, subtract(speed, out.rate));
    return out;
}

/* --- all outputs along one direction --- */

static void outputs_at(const Model *model, const Dual at[], Dual out[])
{
    const Map *map = model->map;
    const Dual speed = absolute(at[SPEED]), s = lesser(times(1.0 / map->speed.lo, speed), constant(1.0));
    const Stencil by_speed = stencil(&map->speed, speed), by_temperature = stencil(&map->temperature, at[TEMPERATURE]);
    Dual preload = at[PRELOAD], force[2], magnitude, coulomb, sign, hysteresis, sliding;
    Nut nut[2];

    preload = lesser(greater(preload, constant(0.0)), constant(map->force.hi));
    force[0] = force[1] = preload;
    if (at[AXIAL_LOAD].v != 0.0) {
        forces_at(map, preload, at[AXIAL_LOAD], force);
        force[1] = lesser(force[1], constant(map->force.hi));
    }
    for (int n = 0; n < 2; ++n) {
        nut[n] = nut_at(map, at, force[n], &by_speed, &by_temperature, s);
    }
    magnitude = add(nut[0].viscous, nut[1].viscous);
    hysteresis = add(nut[0].hysteresis, nut[1].hysteresis);
    sliding = add(nut[0].sliding, nut[1].sliding);
    coulomb = add(hysteresis, sliding);
    out[POWER_LOSS] = multiply(magnitude, speed);
    out[PRESLIDING_DEFLECTION_RATE] = constant(0.0);
    if (at[PRESLIDING_STIFFNESS].v > 0.0) {
        const Bristle bristle = bristle_at(model, at, coulomb);
        sign = coulomb.v > 0.0 ? divide(bristle.torque, coulomb) : constant(0.0);
        out[POWER_LOSS] = add(out[POWER_LOSS], bristle.power);
        out[PRESLIDING_DEFLECTION_RATE] = bristle.rate;
    } else {
        sign = sign_at(at[SPEED], at[REGULARIZATION_SPEED]);
        out[POWER_LOSS] = add(out[POWER_LOSS], multiply(multiply(coulomb, sign), at[SPEED]));
    }
    out[VISCOUS_TORQUE] = at[SPEED].v < 0.0 ? times(-1.0, magnitude) : magnitude;
    out[HYSTERESIS_TORQUE] = multiply(sign, hysteresis);
    out[SLIDING_TORQUE] = multiply(sign, sliding);
    out[FRICTION_TORQUE] = add(out[VISCOUS_TORQUE], add(out[HYSTERESIS_TORQUE], out[SLIDING_TORQUE]));
    for (int i = 0; i < 3; ++i) {
        out[FILM_THICKNESS_MIN + i] = lesser(nut[0].film[i], nut[1].film[i]);
        out[FILM_TEMPERATURE_RISE + i] = greater(nut[0].extreme[i], nut[1].extreme[i]);
    }
    out[LAMBDA_RATIO] = lesser(divide(out[FILM_THICKNESS_MIN], greater(at[ROUGHNESS_HEIGHT], constant(SMOOTH))),
                              constant(LAMBDA_RATIO_MAX));
}

void model_directional_derivative(Model *model, const int unknowns[], size_t unknown_count, const int knowns[],
                                  size_t known_count, const double seed[], double sensitivity[])
{
    Dual at[VARIABLE_COUNT], out[VARIABLE_COUNT];

    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        at[i] = constant(model->latched[i]);
        out[i] = constant(0.0);
    }
    /* a step is a function of the deflection at its start */
    at[PRESLIDING_DEFLECTION].v = model->deflection_before;
    for (size_t k = 0; k < known_count; ++k) {
        at[knowns[k]].d += seed[k];
    }
    outputs_at(model, at, out);
    for (size_t i = 0; i < unknown_count; ++i) {
        sensitivity[i] = out[unknowns[i]].d;
    }
}

void model_values_with_derivatives(const Model *model, double values[VARIABLE_COUNT])
{
    Dual at[VARIABLE_COUNT], out[VARIABLE_COUNT];

    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        at[i] = constant(model->latched[i]);
        out[i] = at[i];
    }
    at[PRESLIDING_DEFLECTION].v = model->deflection_before;
    outputs_at(model, at, out);
    for (int i = 0; i < VARIABLE_COUNT; ++i) {
        values[i] = out[i].v;
    }
}
