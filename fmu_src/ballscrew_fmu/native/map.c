#include "map.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#endif

/* --- file -------------------------------------------------------------------------------------------------------- */

#define MAGIC "BSFMAP01"
#define MAGIC_SIZE 8
#define HASH_SIZE 64
#define AXES 5
#define HEAD_SIZE (MAGIC_SIZE + 16 + HASH_SIZE)
#define NUMBERS (3 * AXES + MAP_DEFAULTS) /* that come before the coefficients */
#define MOST_NODES 4096
#define LARGEST_FILE 268435456

static uint64_t little_endian(const unsigned char *bytes)
{
    uint64_t value = 0;
    for (int i = 7; i >= 0; --i) {
        value = value << 8 | bytes[i];
    }
    return value;
}

static double number_at(const unsigned char *bytes, size_t index)
{
    uint64_t bits = little_endian(bytes + 8 * index);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* FNV-1a over words of eight bytes; a rest of fewer bytes is left out: the size tells of it */
static uint64_t checksum(const unsigned char *bytes, size_t size)
{
    uint64_t sum = UINT64_C(14695981039346656037);
    for (size_t i = 0; i < size / 8; ++i) {
        sum = (sum ^ little_endian(bytes + 8 * i)) * UINT64_C(1099511628211);
    }
    return sum;
}

static bool axis_from(Axis *axis, const unsigned char *bytes, size_t index, bool logarithmic)
{
    double nodes = number_at(bytes, index + 2);
    axis->lo = number_at(bytes, index);
    axis->hi = number_at(bytes, index + 1);
    axis->logarithmic = logarithmic;
    if (!(nodes >= 4.0 && nodes <= MOST_NODES && floor(nodes) == nodes && isfinite(axis->lo) && isfinite(axis->hi)
          && axis->lo < axis->hi && (!logarithmic || axis->lo > 0.0))) {
        return false;
    }
    axis->last = (int)nodes - 2;
    axis->origin = logarithmic ? log(axis->lo) : axis->lo;
    axis->scale = (axis->last + 1) / ((logarithmic ? log(axis->hi) : axis->hi) - axis->origin);
    return isfinite(axis->scale);
}

static size_t coefficients(const Axis *axis)
{
    return (size_t)axis->last + 4;
}

Map *map_from_bytes(const unsigned char *bytes, size_t size, const char *content_hash, const char *name,
                    char *message, size_t message_size)
{
    static const char *const axis_names[AXES] = {"force", "speed", "temperature", "preload", "share"};
    static const bool logarithmic[AXES] = {true, true, false, true, false};
    Map head, *map;
    Axis *axes[AXES];
    const unsigned char *numbers = bytes + HEAD_SIZE;
    size_t nodes, torque, films, curves, separation, sharing, total;

    if (size < HEAD_SIZE + 8 * NUMBERS || memcmp(bytes, MAGIC, MAGIC_SIZE) != 0) {
        (void)snprintf(message, message_size, "%s: no nut map of this format (" MAGIC ")", name);
        return NULL;
    }
    if (little_endian(bytes + MAGIC_SIZE) != size) {
        (void)snprintf(message, message_size, "%s: %.0f bytes, expected %.0f: truncated or damaged", name, (double)size,
                       (double)little_endian(bytes + MAGIC_SIZE));
        return NULL;
    }
    if (little_endian(bytes + MAGIC_SIZE + 8) != checksum(bytes + MAGIC_SIZE + 16, size - MAGIC_SIZE - 16)) {
        (void)snprintf(message, message_size, "%s: checksum wrong: damaged", name);
        return NULL;
    }
    if (strlen(content_hash) != HASH_SIZE || memcmp(bytes + MAGIC_SIZE + 16, content_hash, HASH_SIZE) != 0) {
        (void)snprintf(message, message_size, "%s: map %.12s, expected %.12s: file of another FMU", name,
                       (const char *)bytes + MAGIC_SIZE + 16, content_hash);
        return NULL;
    }
    memset(&head, 0, sizeof head);
    axes[0] = &head.force;
    axes[1] = &head.speed;
    axes[2] = &head.temperature;
    axes[3] = &head.preload;
    axes[4] = &head.share;
    for (size_t i = 0; i < AXES; ++i) {
        if (!axis_from(axes[i], numbers, 3 * i, logarithmic[i])) {
            (void)snprintf(message, message_size, "%s: axis %s is no axis", name, axis_names[i]);
            return NULL;
        }
    }
    for (size_t i = 0; i < MAP_DEFAULTS; ++i) {
        head.defaults[i] = number_at(numbers, 3 * AXES + i);
    }
    nodes = coefficients(&head.force) * coefficients(&head.speed) * coefficients(&head.temperature);
    torque = nodes * TORQUE_COLUMNS;
    films = nodes * FILM_COLUMNS;
    curves = coefficients(&head.force) * CURVE_COLUMNS;
    separation = 2 * coefficients(&head.preload);
    sharing = separation * coefficients(&head.share);
    total = torque + films + curves + separation + sharing;
    if (total > LARGEST_FILE / 8 || size != HEAD_SIZE + 8 * (NUMBERS + total)) {
        (void)snprintf(message, message_size, "%s: size does not fit its axes", name);
        return NULL;
    }
    map = malloc(sizeof *map + 8 * total);
    if (map == NULL) {
        (void)snprintf(message, message_size, "%s: not enough memory for the map", name);
        return NULL;
    }
    *map = head;
    for (size_t i = 0; i < total; ++i) {
        map->data[i] = number_at(numbers, NUMBERS + i);
        if (!isfinite(map->data[i])) {
            (void)snprintf(message, message_size, "%s: a coefficient is not finite", name);
            free(map);
            return NULL;
        }
    }
    map->torque = map->data;
    map->films = map->torque + torque;
    map->curves = map->films + films;
    map->separation = map->curves + curves;
    map->sharing = map->separation + separation;
    return map;
}

static FILE *open_file(const char *path)
{
#ifdef _WIN32
    wchar_t wide[32768];
    int length = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, wide, 32768);
    return length > 0 ? _wfopen(wide, L"rb") : NULL;
#else
    return fopen(path, "rb");
#endif
}

Map *map_read(const char *path, const char *content_hash, char *message, size_t message_size)
{
    FILE *file = open_file(path);
    unsigned char *bytes = NULL;
    Map *map = NULL;
    long size = -1;

    if (file == NULL) {
        (void)snprintf(message, message_size, "%s: cannot be opened", path);
        return NULL;
    }
    if (fseek(file, 0, SEEK_END) == 0) {
        size = ftell(file);
    }
    if (size < 0 || size > LARGEST_FILE || fseek(file, 0, SEEK_SET) != 0) {
        (void)snprintf(message, message_size, "%s: cannot be read, or too large for a map", path);
    } else if ((bytes = malloc((size_t)size + 1)) == NULL) {
        (void)snprintf(message, message_size, "%s: not enough memory to read it", path);
    } else if (fread(bytes, 1, (size_t)size, file) != (size_t)size) {
        (void)snprintf(message, message_size, "%s: cannot be read", path);
    } else {
        map = map_from_bytes(bytes, (size_t)size, content_hash, path, message, message_size);
    }
    free(bytes);
    (void)fclose(file);
    return map;
}

void map_free(Map *map)
{
    free(map);
}

/* --- splines ----------------------------------------------------------------------------------------------------- */

Place axis_place(const Axis *axis, double value)
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

void cubic_slopes(double t, double slopes[4])
{
    double u = 1.0 - t;
    slopes[0] = -0.5 * u * u;
    slopes[1] = 0.5 * t * (3.0 * t - 4.0);
    slopes[2] = 0.5 * u * (4.0 - 3.0 * u);
    slopes[3] = 0.5 * t * t;
}

void cubic_bends(double t, double bends[4])
{
    bends[0] = 1.0 - t;
    bends[1] = 3.0 * t - 2.0;
    bends[2] = 1.0 - 3.0 * t;
    bends[3] = t;
}

ptrdiff_t map_temperature_stride(const Map *map, int columns)
{
    return (ptrdiff_t)coefficients(&map->force) * columns;
}

ptrdiff_t map_speed_stride(const Map *map, int columns)
{
    return (ptrdiff_t)coefficients(&map->temperature) * map_temperature_stride(map, columns);
}

const double *map_block(const Map *map, const double *surfaces, int columns, Place speed, Place temperature,
                        Place force)
{
    return surfaces + speed.cell * map_speed_stride(map, columns)
           + temperature.cell * map_temperature_stride(map, columns) + (ptrdiff_t)force.cell * columns;
}

static double weighted(const double weights[4], const double *values)
{
    return weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2] + weights[3] * values[3];
}

void map_forces(const Map *map, double preload, double axial_load, double force[2])
{
    double load = fabs(axial_load), share, y, w_p[4], w_q[4], rows[4];
    size_t side = axial_load > 0.0 ? 0 : 1, n_p = coefficients(&map->preload), n_q = coefficients(&map->share);
    Place p, q;

    force[0] = 0.0;
    force[1] = load;
    if (!(preload > 0.0)) {
        return;
    }
    p = axis_place(&map->preload, preload);
    cubic_weights(p.t, w_p);
    share = load / (preload * exp(weighted(w_p, map->separation + side * n_p + p.cell)));
    if (share >= 1.0) {
        return; /* the nuts part: the relieved one carries nothing */
    }
    q = axis_place(&map->share, share);
    cubic_weights(q.t, w_q);
    for (int a = 0; a < 4; ++a) {
        rows[a] = weighted(w_q, map->sharing + (side * n_p + (size_t)(p.cell + a)) * n_q + q.cell);
    }
    y = weighted(w_p, rows);
    y = y > 0.0 ? y : 0.0;
    force[0] = preload * y * sqrt(y);
    force[1] = force[0] + load;
}

#define SEPARATION_STEPS 6 /* of Newton: load over preload at separation hardly changes with preload */

double map_separation_preload(const Map *map, double axial_load)
{
    const double load = fabs(axial_load);
    const double *separation = map->separation + (axial_load > 0.0 ? 0 : coefficients(&map->preload));
    double preload = load;

    for (int i = 0; load > 0.0 && i < SEPARATION_STEPS; ++i) {
        const Place p = axis_place(&map->preload, preload);
        const bool within = preload >= map->preload.lo && preload <= map->preload.hi;
        double w[4], d[4], step;
        cubic_weights(p.t, w);
        cubic_slopes(p.t, d);
        step = (log(load / preload) - weighted(w, separation + p.cell))
               / (1.0 + (within ? map->preload.scale * weighted(d, separation + p.cell) : 0.0));
        step = step > -50.0 ? step : -50.0;
        preload *= exp(step < 50.0 ? step : 50.0);
    }
    return preload < map->force.hi ? preload : map->force.hi;
}

double map_force_slope(const Map *map, double preload, double axial_load)
{
    const size_t side = axial_load > 0.0 ? 0 : 1, n_p = coefficients(&map->preload), n_q = coefficients(&map->share);
    double w_p[4], d_p[4], w_q[4], d_q[4], share, share_d, y = 0.0, y_d = 0.0;
    Place p, q;

    if (!(preload > 0.0)) {
        return 0.0;
    }
    /* all derivatives: over the logarithm of the preload */
    p = axis_place(&map->preload, preload);
    cubic_weights(p.t, w_p);
    cubic_slopes(p.t, d_p);
    for (int a = 0; a < 4; ++a) {
        d_p[a] *= preload > map->preload.lo && preload < map->preload.hi ? map->preload.scale : 0.0;
    }
    share = fabs(axial_load) / (preload * exp(weighted(w_p, map->separation + side * n_p + p.cell)));
    if (share >= 1.0) {
        return 0.0;
    }
    share_d = -share * (1.0 + weighted(d_p, map->separation + side * n_p + p.cell));
    q = axis_place(&map->share, share);
    cubic_weights(q.t, w_q);
    cubic_slopes(q.t, d_q);
    for (int a = 0; a < 4; ++a) {
        const double *row = map->sharing + (side * n_p + (size_t)(p.cell + a)) * n_q + q.cell;
        const double along = weighted(w_q, row);
        y += w_p[a] * along;
        y_d += d_p[a] * along + w_p[a] * weighted(d_q, row) * map->share.scale * share_d;
    }
    return y > 0.0 ? sqrt(y) * (y + 1.5 * y_d) : 0.0;
}
