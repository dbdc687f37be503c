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

#define MAGIC_SIZE (sizeof MAP_MAGIC - 1)
#define HASH_SIZE 64 /* sha256 in hexadecimal */
#define HEAD_SIZE (MAGIC_SIZE + 16 + HASH_SIZE)
#define NUMBERS (3 * MAP_AXES + MAP_DEFAULTS + 2) /* before the coefficients */
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

/* FNV-1a of words of eight bytes. A remainder of fewer bytes is omitted: the check of the size finds it. */
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

/* True, with the reason in message, if a file is not the map with this content hash. */
static bool head_fails(const unsigned char *bytes, size_t size, const char *content_hash, const char *name,
                       char *message, size_t message_size)
{
    const unsigned char *body = bytes + MAGIC_SIZE + 16;

    if (size < HEAD_SIZE + 8 * NUMBERS || memcmp(bytes, MAP_MAGIC, MAGIC_SIZE) != 0) {
        (void)snprintf(message, message_size, "%s: not a nut map of this format (" MAP_MAGIC ")", name);
    } else if (little_endian(bytes + MAGIC_SIZE) != size) {
        (void)snprintf(message, message_size, "%s: %.0f bytes, expected %.0f: truncated or damaged", name, (double)size,
                       (double)little_endian(bytes + MAGIC_SIZE));
    } else if (little_endian(bytes + MAGIC_SIZE + 8) != checksum(body, size - MAGIC_SIZE - 16)) {
        (void)snprintf(message, message_size, "%s: wrong checksum: damaged", name);
    } else if (strlen(content_hash) != HASH_SIZE || memcmp(body, content_hash, HASH_SIZE) != 0) {
        (void)snprintf(message, message_size, "%s: map %.12s, expected %.12s: file of another FMU", name,
                       (const char *)body, content_hash);
    } else {
        return false;
    }
    return true;
}

/* Axes, defaults, law and presliding angle. NULL, or the name of what is invalid. */
static const char *numbers_from(Map *head, const unsigned char *numbers)
{
    const struct {
        const char *name;
        Axis *axis;
        bool logarithmic;
    } axes[MAP_AXES] = {{"axis force", &head->force, true},
                        {"axis speed", &head->speed, true},
                        {"axis temperature", &head->temperature, false},
                        {"axis preload", &head->preload, true},
                        {"axis share", &head->share, false}};
    double law;

    for (size_t i = 0; i < MAP_AXES; ++i) {
        if (!axis_from(axes[i].axis, numbers, 3 * i, axes[i].logarithmic)) {
            return axes[i].name;
        }
    }
    for (size_t i = 0; i < MAP_DEFAULTS; ++i) {
        head->defaults[i] = number_at(numbers, 3 * MAP_AXES + i);
    }
    head->presliding_angle = number_at(numbers, NUMBERS - 1);
    if (!(head->presliding_angle > 0.0 && isfinite(head->presliding_angle))) {
        return "presliding angle";
    }
    law = number_at(numbers, NUMBERS - 2);
    for (head->law = 0; head->law < LAWS; ++head->law) {
        if (law == head->law) {
            return NULL;
        }
    }
    return "friction law";
}

Map *map_from_bytes(const unsigned char *bytes, size_t size, const char *content_hash, const char *name,
                    char *message, size_t message_size)
{
    const unsigned char *numbers = bytes + HEAD_SIZE;
    const char *wrong;
    Map head, *map;
    size_t surface, curves, separation, total;

    if (head_fails(bytes, size, content_hash, name, message, message_size)) {
        return NULL;
    }
    memset(&head, 0, sizeof head);
    wrong = numbers_from(&head, numbers);
    if (wrong != NULL) {
        (void)snprintf(message, message_size, "%s: %s is invalid", name, wrong);
        return NULL;
    }
    curves = (size_t)axis_coefficients(&head.force);
    surface = curves * (size_t)axis_coefficients(&head.speed) * (size_t)axis_coefficients(&head.temperature);
    separation = 2 * (size_t)axis_coefficients(&head.preload);
    total = surface * (TORQUE_COLUMNS + FILM_COLUMNS) + curves * CURVE_COLUMNS
            + separation * (size_t)(1 + axis_coefficients(&head.share));
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
    map->films = map->torque + surface * TORQUE_COLUMNS;
    map->curves = map->films + surface * FILM_COLUMNS;
    map->separation = map->curves + curves * CURVE_COLUMNS;
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
