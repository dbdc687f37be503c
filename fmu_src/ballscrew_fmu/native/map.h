/* The nut map: tricubic B-splines of the logarithms of torque, film and temperature over (ln force, ln speed,
   temperature), read once from a file and constant from then on. Twin of nut_map/evaluate.py. */
#ifndef BALLSCREW_MAP_H
#define BALLSCREW_MAP_H

#include <stddef.h>

#include <stdbool.h>

/* columns of the surfaces: what a torque needs, then the rest; raceway screw before nut */
enum { VISCOUS_SCREW, VISCOUS_NUT, EFFECTIVE_FILM_SCREW, EFFECTIVE_FILM_NUT, TORQUE_COLUMNS };
enum {
    MINIMUM_FILM_SCREW,
    MINIMUM_FILM_NUT,
    CENTRAL_FILM_SCREW,
    CENTRAL_FILM_NUT,
    RISE_SCREW,
    RISE_NUT,
    FILM_COLUMNS
};
enum { HYSTERESIS_CURVE, SLIDING_CURVE, PRESSURE_CURVE, BALL_LOAD_CURVE, CURVE_COLUMNS };
#define MOST_COLUMNS 6

#define MAP_DEFAULTS 3 /* apparent viscosity ratio, net sliding coefficient, roughness height */

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

typedef struct {
    Axis force, speed, temperature, preload, share;
    double defaults[MAP_DEFAULTS];
    const double *torque;     /* (speed, temperature, force, TORQUE_COLUMNS) */
    const double *films;      /* (speed, temperature, force, FILM_COLUMNS) */
    const double *curves;     /* (force, CURVE_COLUMNS) */
    const double *separation; /* (2, preload), axial load > 0 first */
    const double *sharing;    /* (2, preload, share) */
    double data[1];           /* all coefficients */
} Map;

/* Map of a file; path in UTF-8. NULL if it cannot be used, with the reason in message. */
Map *map_read(const char *path, const char *content_hash, char *message, size_t message_size);

/* The same from the bytes of a file; name for messages. */
Map *map_from_bytes(const unsigned char *bytes, size_t size, const char *content_hash, const char *name,
                    char *message, size_t message_size);

void map_free(Map *map);

/* Cell and position of a value, clamped to the axis. */
Place axis_place(const Axis *axis, double value);

/* Weights of the four B-splines of a cell, and their first and second derivatives over t. */
static inline void cubic_weights(double t, double weights[4])
{
    const double sixth = 1.0 / 6.0, u = 1.0 - t;
    weights[0] = sixth * (u * u * u);
    weights[1] = sixth * (4.0 - 3.0 * t * t * (1.0 + u));
    weights[2] = sixth * (4.0 - 3.0 * u * u * (1.0 + t));
    weights[3] = sixth * (t * t * t);
}

void cubic_slopes(double t, double slopes[4]);
void cubic_bends(double t, double bends[4]);

/* Coefficients of a surface at the first of the four neighbours of a place. */
const double *map_block(const Map *map, const double *surfaces, int columns, Place speed, Place temperature,
                        Place force);

/* Distance of neighbours over temperature and over speed in a surface, in coefficients. */
ptrdiff_t map_temperature_stride(const Map *map, int columns);
ptrdiff_t map_speed_stride(const Map *map, int columns);

/* Force of the relieved and the loaded nut [N] at a preload of 0 or more and an axial load that is not 0. */
void map_forces(const Map *map, double preload, double axial_load, double force[2]);

/* Preload at or below which the axial load parts the nuts [N]: 0 without axial load, at most the end of the map. */
double map_separation_preload(const Map *map, double axial_load);

/* Derivative of either force over the preload; 0 where the nuts part. Arguments as map_forces. */
double map_force_slope(const Map *map, double preload, double axial_load);

#endif
