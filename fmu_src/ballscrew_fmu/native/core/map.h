/* The nut map: tricubic B-splines of the logarithms of torque, film and temperature over (ln force, ln speed,
   temperature), from a file or compiled in, and constant. Order of columns and of the file: constants.h. All users in a
   process share one copy in memory. */
#ifndef BALLSCREW_MAP_H
#define BALLSCREW_MAP_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "constants.h"

typedef struct {
    double lo, hi;
    double origin, scale; /* position = (ln value or value - origin) scale */
    int last;             /* last cell */
    bool logarithmic;
} Axis;

typedef struct {
    int cell;
    double t; /* position in the cell, 0 to 1 */
} Place;

#define HASH_SIZE 64 /* sha256 in hexadecimal */

/* Of a map file: two with the same are the same map. */
typedef struct {
    uint64_t size, checksum;          /* of the file */
    char content_hash[HASH_SIZE + 1]; /* of the map as it was built, and its name in messages */
} MapIdentity;

typedef struct Map Map;
struct Map {
    int law; /* THREE_PARAMETER_LAW or MECHANISTIC_LAW */
    Axis force, speed, temperature, preload, fraction, difference;
    double defaults[MAP_DEFAULTS];
    double presliding_angle;  /* [rad] Coulomb torque over presliding stiffness at the lowest force */
    double seal_angle;        /* [rad] the same at the highest force */
    double preload_factor;    /* true force divided by the preload */
    bool oversize;            /* balls between four flanks */
    const double *torque;     /* (speed, temperature, force, TORQUE_COLUMNS) */
    const double *films;      /* (speed, temperature, force, FILM_COLUMNS) */
    const double *curves;     /* (force, CURVE_COLUMNS) */
    const double *drag;       /* (speed, temperature) of the oil between balls */
    const double *separation; /* (2, preload), axial load > 0 first */
    const double *sharing;    /* (2, preload, share) */
    const double *shift;      /* (preload, difference) */
    MapIdentity identity;
    Map *next;           /* in the list of maps in use */
    unsigned long users; /* until map_free */
    double data[1];      /* the numbers of the file; of a compiled map none */
};

#define ANY_LAW (-1)

/* Cell and position of a value, clamped to the axis. */
static inline Place axis_place(const Axis *axis, double value)
{
    Place place;
    double t;
    value = value > axis->lo ? value : axis->lo;
    value = value < axis->hi ? value : axis->hi;
    t = ((axis->logarithmic ? log(value) : value) - axis->origin) * axis->scale;
    place.cell = (int)t;
    if (place.cell > axis->last) {
        place.cell = axis->last;
    }
    place.t = t - place.cell;
    return place;
}

/* Weights of the four B-splines of a cell, and their first and second derivatives with respect to t. */
static inline void cubic_weights(double t, double weights[4])
{
    const double sixth = 1.0 / 6.0, u = 1.0 - t;
    weights[0] = sixth * (u * u * u);
    weights[1] = sixth * (4.0 - 3.0 * t * t * (1.0 + u));
    weights[2] = sixth * (4.0 - 3.0 * u * u * (1.0 + t));
    weights[3] = sixth * (t * t * t);
}

static inline void cubic_slopes(double t, double slopes[4])
{
    const double u = 1.0 - t;
    slopes[0] = -0.5 * u * u;
    slopes[1] = 0.5 * t * (3.0 * t - 4.0);
    slopes[2] = 0.5 * u * (4.0 - 3.0 * u);
    slopes[3] = 0.5 * t * t;
}

static inline void cubic_bends(double t, double bends[4])
{
    bends[0] = 1.0 - t;
    bends[1] = 3.0 * t - 2.0;
    bends[2] = 1.0 - 3.0 * t;
    bends[3] = t;
}

/* Number of coefficients along an axis. */
static inline ptrdiff_t axis_coefficients(const Axis *axis)
{
    return (ptrdiff_t)axis->last + 4;
}

#endif
