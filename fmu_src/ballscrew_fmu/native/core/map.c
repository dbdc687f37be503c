#include "system.h"

#include "map_file.h"

#include "file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define NUMBERS (3 * MAP_AXES + MAP_DEFAULTS + 3) /* before the coefficients */
#define MOST_NODES 4096

/* Name of a friction law. */
INTERNAL const char *map_law_name(int law)
{
    static const char *const names[LAWS] = LAW_NAMES;
    return law >= 0 && law < LAWS ? names[law] : "unknown";
}

/* --- from numbers to a map --------------------------------------------------------------------------------------- */

static bool axis_from(Axis *axis, const double numbers[3], bool logarithmic)
{
    const double nodes = numbers[2];
    axis->lo = numbers[0];
    axis->hi = numbers[1];
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

/* Axes, defaults, law and presliding angle. NULL, or the name of what is invalid. */
static const char *head_from(Map *map, const double *numbers)
{
    const struct {
        const char *name;
        Axis *axis;
        bool logarithmic;
    } axes[MAP_AXES] = {{"axis force is invalid", &map->force, true},
                        {"axis speed is invalid", &map->speed, true},
                        {"axis temperature is invalid", &map->temperature, false},
                        {"axis preload is invalid", &map->preload, true},
                        {"axis share is invalid", &map->fraction, false},
                        {"axis difference is invalid", &map->difference, false}};

    for (size_t i = 0; i < MAP_AXES; ++i) {
        if (!axis_from(axes[i].axis, numbers + 3 * i, axes[i].logarithmic)) {
            return axes[i].name;
        }
    }
    memcpy(map->defaults, numbers + 3 * MAP_AXES, sizeof map->defaults);
    map->presliding_angle = numbers[NUMBERS - 2] * pow(map->force.lo, 1.0 / 3.0); /* that at 1 N is in the file */
    map->seal_angle = numbers[NUMBERS - 2] * pow(map->force.hi, 1.0 / 3.0);
    if (!(map->presliding_angle > 0.0 && isfinite(map->presliding_angle))) {
        return "presliding angle is invalid";
    }
    map->preload_factor = numbers[NUMBERS - 1];
    if (!(map->preload_factor > 0.0 && isfinite(map->preload_factor))) {
        return "preload factor is invalid";
    }
    for (map->law = 0; map->law < LAWS; ++map->law) {
        if (numbers[NUMBERS - 3] == map->law) {
            return NULL;
        }
    }
    return "friction law is invalid";
}

/* Number of coefficients that the axes require. */
static uint64_t coefficients_of(const Map *map)
{
    const uint64_t force = (uint64_t)axis_coefficients(&map->force);
    const uint64_t plane = (uint64_t)axis_coefficients(&map->speed) * (uint64_t)axis_coefficients(&map->temperature);
    const uint64_t fraction = (uint64_t)axis_coefficients(&map->fraction);

    return force * (plane * (TORQUE_COLUMNS + FILM_COLUMNS) + CURVE_COLUMNS) + plane
           + (uint64_t)axis_coefficients(&map->preload)
                 * (2 * (1 + fraction) + (uint64_t)axis_coefficients(&map->difference));
}

/* Fills map from count numbers, which must last as long as it. NULL, or what is wrong with them. */
static const char *map_over(Map *map, const double *numbers, size_t count)
{
    const char *wrong = count < NUMBERS ? "size does not fit its axes" : head_from(map, numbers);
    size_t surface, curves, plane;

    if (wrong != NULL) {
        return wrong;
    }
    if (coefficients_of(map) != count - NUMBERS) {
        return "size does not fit its axes";
    }
    for (size_t i = 3 * MAP_AXES; i < count; ++i) {
        if (!isfinite(numbers[i])) {
            return i < NUMBERS ? "a default is not finite" : "a coefficient is not finite";
        }
    }
    curves = (size_t)axis_coefficients(&map->force);
    plane = (size_t)axis_coefficients(&map->speed) * (size_t)axis_coefficients(&map->temperature);
    surface = curves * plane;
    map->torque = numbers + NUMBERS;
    map->films = map->torque + surface * TORQUE_COLUMNS;
    map->curves = map->films + surface * FILM_COLUMNS;
    for (size_t i = 0; i < curves && !map->oversize; ++i) {
        map->oversize = map->curves[i * CURVE_COLUMNS + FREE_SHEAR_SHARE_CURVE] < 0.0;
    }
    map->drag = map->curves + curves * CURVE_COLUMNS;
    map->separation = map->drag + plane;
    map->shift = map->separation + 2 * (size_t)axis_coefficients(&map->preload)
                                       * (1 + (size_t)axis_coefficients(&map->fraction));
    map->sharing = map->separation + 2 * (size_t)axis_coefficients(&map->preload);
    return NULL;
}

/* --- one copy for all users -------------------------------------------------------------------------------------- */

/* Mutual exclusion of the threads of a process, initialized statically, so that no call has to come first. With
   BALLSCREW_NO_THREADS, or on other systems, there is none: instances must then be created and freed by one thread. */
#if defined(BALLSCREW_NO_THREADS) || !(defined(_WIN32) || defined(__unix__) || defined(__APPLE__))
typedef char Lock;
#define LOCK_OPEN 0
static inline void lock_enter(Lock *lock) { (void)lock; }
static inline void lock_leave(Lock *lock) { (void)lock; }
#elif defined(_WIN32)
typedef SRWLOCK Lock;
#define LOCK_OPEN SRWLOCK_INIT
static inline void lock_enter(Lock *lock) { AcquireSRWLockExclusive(lock); }
static inline void lock_leave(Lock *lock) { ReleaseSRWLockExclusive(lock); }
#else
#include <pthread.h>
typedef pthread_mutex_t Lock;
#define LOCK_OPEN PTHREAD_MUTEX_INITIALIZER
static inline void lock_enter(Lock *lock) { (void)pthread_mutex_lock(lock); }
static inline void lock_leave(Lock *lock) { (void)pthread_mutex_unlock(lock); }
#endif

/* The maps in use. They are constant, so that instances in several threads can read them. This is the only data of the
   runtime that instances share and that changes. */
static struct {
    Lock lock; /* of list, and of next and users of the maps in it */
    Map *list;
} in_use = {LOCK_OPEN, NULL};

static bool same_map(const MapIdentity *one, const MapIdentity *other)
{
    return one->size == other->size && one->checksum == other->checksum
           && memcmp(one->content_hash, other->content_hash, HASH_SIZE) == 0;
}

static Map *listed(const MapIdentity *identity)
{
    Map *map = in_use.list;

    while (map != NULL && !same_map(&map->identity, identity)) {
        map = map->next;
    }
    if (map != NULL) {
        ++map->users;
    }
    return map;
}

/* The map in use with this identity, with one user more, or NULL. */
static Map *map_in_use(const MapIdentity *identity)
{
    Map *map;

    lock_enter(&in_use.lock);
    map = listed(identity);
    lock_leave(&in_use.lock);
    return map;
}

/* A new map for all. Another thread may have read it at the same time: its map is used then, and this one freed. */
static Map *map_for_all(Map *map)
{
    Map *earlier;

    lock_enter(&in_use.lock);
    earlier = listed(&map->identity);
    if (earlier == NULL) {
        map->users = 1;
        map->next = in_use.list;
        in_use.list = map;
    }
    lock_leave(&in_use.lock);
    if (earlier != NULL) {
        free(map);
        return earlier;
    }
    return map;
}

/* End of use by one of those who have got it. */
INTERNAL void map_free(Map *map)
{
    Map **place;
    bool last = false;

    if (map == NULL) {
        return;
    }
    lock_enter(&in_use.lock);
    if (--map->users == 0) {
        for (place = &in_use.list; *place != map; place = &(*place)->next) {
        }
        *place = map->next;
        last = true;
    }
    lock_leave(&in_use.lock);
    if (last) {
        free(map);
    }
}

/* A map from numbers that are compiled in, or from the bytes of those of a file. name: for messages */
static Map *new_map(const MapIdentity *identity, const double *numbers, const unsigned char *bytes, size_t count,
                    const char *name, char *message, size_t message_size)
{
    const size_t copied = bytes != NULL ? count : 0;
    Map *map = calloc(1, sizeof *map + 8 * copied);
    const char *wrong;

    if (map == NULL) {
        (void)snprintf(message, message_size, "%s: not enough memory for the map", name);
        return NULL;
    }
    for (size_t i = 0; i < copied; ++i) {
        const uint64_t bits = little_endian(bytes + 8 * i);
        memcpy(&map->data[i], &bits, sizeof bits);
    }
    map->identity = *identity;
    wrong = map_over(map, bytes != NULL ? map->data : numbers, count);
    if (wrong != NULL) {
        (void)snprintf(message, message_size, "%s: %s", name, wrong);
        free(map);
        return NULL;
    }
    return map_for_all(map);
}

#ifdef EMBEDDED_RESOURCES

/* map_numbers and map_identity of embedded.h; no file is opened */
INTERNAL Map *map_compiled(char *message, size_t message_size)
{
    Map *map = map_in_use(&map_identity);

    return map != NULL ? map
                       : new_map(&map_identity, map_numbers, NULL, sizeof map_numbers / sizeof *map_numbers,
                                 "the map that is compiled in", message, message_size);
}

#else

#define HEAD_SIZE (FILE_HEAD_SIZE + HASH_SIZE)

/* Map from the bytes of a file; name for messages. */
INTERNAL Map *map_from_bytes(const unsigned char *bytes, size_t size, int law, const char *name, char *message,
                             size_t message_size)
{
    MapIdentity identity = {0, 0, ""};
    Map *map;

    if (file_fails(bytes, size, MAP_MAGIC, name, "nut map", message, message_size)) {
        return NULL;
    }
    if (size < HEAD_SIZE + 8 * NUMBERS) {
        (void)snprintf(message, message_size, "%s: %.0f bytes: truncated or damaged", name, (double)size);
        return NULL;
    }
    identity.size = size;
    identity.checksum = little_endian(bytes + FILE_MAGIC_SIZE + 8);
    for (size_t i = 0; i < HASH_SIZE; ++i) {
        const char c = (char)bytes[FILE_HEAD_SIZE + i];
        identity.content_hash[i] = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') ? c : '.';
    }
    map = map_in_use(&identity);
    if (map == NULL) {
        map = new_map(&identity, NULL, bytes + HEAD_SIZE, (size - HEAD_SIZE) / 8, name, message, message_size);
    }
    if (map != NULL && law != ANY_LAW && map->law != law) {
        (void)snprintf(message, message_size, "%s: map %.12s has the friction law %s, expected %s: another model",
                       name, identity.content_hash, map_law_name(map->law), map_law_name(law));
        map_free(map);
        return NULL;
    }
    return map;
}

/* Map from a file, path in UTF-8, for a model of this law. NULL if it cannot be used, with the reason in message. */
INTERNAL Map *map_read(const char *path, int law, char *message, size_t message_size)
{
    size_t size;
    unsigned char *bytes = file_read(path, &size, message, message_size);
    Map *map = bytes != NULL ? map_from_bytes(bytes, size, law, end_of_path(path), message, message_size) : NULL;

    free(bytes);
    return map;
}

#endif
