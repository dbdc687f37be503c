/* Numbers of the laws: doubles or, in a file that defines DUAL_NUMBERS before it includes a law, dual numbers (a value
   and its derivative along one direction). So each law is written once. Doubles compile to plain operators. */
#ifndef BALLSCREW_NUMBER_H
#define BALLSCREW_NUMBER_H

#include <math.h>
#include <stdbool.h>

#ifdef DUAL_NUMBERS

typedef struct {
    double v, d; /* value, derivative */
} Number;

static inline Number number(double value, double slope)
{
    const Number out = {value, slope};
    return out;
}

static inline double value_of(Number a) { return a.v; }
static inline double slope_of(Number a) { return a.d; }
static inline Number add(Number a, Number b) { return number(a.v + b.v, a.d + b.d); }
static inline Number subtract(Number a, Number b) { return number(a.v - b.v, a.d - b.d); }
static inline Number multiply(Number a, Number b) { return number(a.v * b.v, a.d * b.v + a.v * b.d); }

static inline Number divide(Number a, Number b)
{
    const double ratio = a.v / b.v, inverse = 1.0 / b.v; /* two independent divisions run in parallel */
    return number(ratio, (a.d - ratio * b.d) * inverse);
}

static inline Number times(double factor, Number a) { return number(factor * a.v, factor * a.d); }
static inline Number negative(Number a) { return number(-a.v, -a.d); }
static inline Number over(Number a, double divisor) { return number(a.v / divisor, a.d / divisor); }

#else

typedef double Number;

static inline Number number(double value, double slope)
{
    (void)slope;
    return value;
}

static inline double value_of(Number a) { return a; }

static inline double slope_of(Number a)
{
    (void)a;
    return 0.0;
}

static inline Number add(Number a, Number b) { return a + b; }
static inline Number subtract(Number a, Number b) { return a - b; }
static inline Number multiply(Number a, Number b) { return a * b; }
static inline Number divide(Number a, Number b) { return a / b; }
static inline Number times(double factor, Number a) { return factor * a; }
static inline Number negative(Number a) { return -a; }
static inline Number over(Number a, double divisor) { return a / divisor; }

#endif

static inline Number constant(double value) { return number(value, 0.0); }

/* A function of a, from its value and slope there. */
static inline Number function(Number a, double value, double slope) { return number(value, slope * slope_of(a)); }

static inline Number exponential(Number a)
{
    const double e = exp(value_of(a));
    return function(a, e, e);
}

/* a^exponent for a >= 0. The slope of a film at rest is infinite: 0 is returned there. */
static inline Number power(Number a, double exponent)
{
    const double value = pow(value_of(a), exponent);
    return value_of(a) > 0.0 ? function(a, value, exponent * value / value_of(a)) : constant(0.0);
}

static inline Number root(Number a)
{
    const double value = sqrt(value_of(a));
    return value_of(a) > 0.0 ? function(a, value, 0.5 / value) : constant(0.0);
}

static inline Number lesser(Number a, Number b) { return value_of(a) < value_of(b) ? a : b; }
static inline Number greater(Number a, Number b) { return value_of(a) > value_of(b) ? a : b; }

/* At lo and hi the derivative is 0. */
static inline Number clamped(Number a, double lo, double hi)
{
    return lesser(greater(a, constant(lo)), constant(hi));
}

static inline Number with_sign_of(Number magnitude, Number of)
{
    return value_of(of) < 0.0 ? negative(magnitude) : magnitude;
}

static inline Number absolute(Number a)
{
    return number(fabs(value_of(a)), value_of(a) < 0.0 ? -slope_of(a) : slope_of(a));
}

#endif
