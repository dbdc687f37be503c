/* The live page: BallScrewFriction in motion at one point, by the laws of the FMU. JavaScript writes the inputs into the
   values, calls page_point and reads the results, both by name. Memory is allocated in page_bytes and page_open alone.
   There is no C library: exp, log and pow are those of JavaScript, other functions are below. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

extern unsigned char __heap_base; /* of the linker: end of the data */

/* Zeroed memory that is never used again. */
void *malloc(size_t size)
{
    enum { PAGE = 65536, ALIGNMENT = 16 };
    static size_t used;
    const size_t base = (size_t)&__heap_base, first = (base + used + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    const size_t pages = (first + size + PAGE - 1) / PAGE, present = __builtin_wasm_memory_size(0);

    if (pages > present && __builtin_wasm_memory_grow(0, pages - present) == (size_t)-1) {
        return NULL;
    }
    used = first + size - base;
    return (void *)first;
}

void *calloc(size_t count, size_t size) { return malloc(count * size); }

void free(void *memory) { (void)memory; }

/* The only problem of a map that is in the page. */
int snprintf(char *to, size_t size, const char *format, ...)
{
    static const char damaged[] = "the map of this page is damaged";

    (void)format;
    memcpy(to, damaged, size < sizeof damaged ? size : sizeof damaged);
    return 0;
}

#include "point.h"

#include "file.c"
#include "map.c"

#define EXPORTED __attribute__((visibility("default")))

/* After the variables of the FMU. torque_low, torque_high: NAN without a table of intervals; clamped: one bit per input,
   in their order */
enum {
    TORQUE_LOW = VARIABLE_COUNT,
    TORQUE_HIGH,
    BREAKAWAY_TORQUE,
    FORCE_NUT_A,
    FORCE_NUT_B,
    DRIVING_EFFICIENCY,
    BACKDRIVING_EFFICIENCY,
    CLAMPED,
    VALUE_COUNT
};
static const char *const local_names[VALUE_COUNT - VARIABLE_COUNT] = {
    "torque_low",  "torque_high",        "breakaway_torque",       "force_nut_a",
    "force_nut_b", "driving_efficiency", "backdriving_efficiency", "clamped"};

/* Ends of the interval of the torque over the torque, of a nut at its force: B-spline coefficients of their logarithms,
   (force, speed, temperature, END_COLUMNS), on the axes of the map with other numbers of nodes. */
enum { LOW_END, HIGH_END, END_COLUMNS };

static struct {
    Map *map;
    double lead;         /* [m] */
    const double *ends;  /* NULL: none */
    Axis axes_of_ends[3];
    double value[VALUE_COUNT];
} page;

EXPORTED int page_count(void) { return VALUE_COUNT; }

EXPORTED const char *page_name(int n)
{
    return n < VARIABLE_COUNT ? model_variables[n].name : local_names[n - VARIABLE_COUNT];
}

EXPORTED double *page_values(void) { return page.value; }

/* Memory for a map file or a table of intervals; NULL: there is none. */
EXPORTED void *page_bytes(size_t size) { return malloc(size); }

/* Takes the map of a file. Empty text, or why it cannot. */
EXPORTED const char *page_open(const unsigned char *bytes, size_t size, int law, double lead, double seal)
{
    static char message[256];

    page.map = map_from_bytes(bytes, size, law, "map", message, sizeof message);
    if (page.map == NULL) {
        return message;
    }
    page.lead = lead;
    page.value[SEAL_TORQUE] = seal;
    friction_of_map(page.map, page.value);
    return "";
}

/* Takes the table of intervals with its numbers of nodes. */
EXPORTED void page_take_ends(const double *ends, int forces, int speeds, int temperatures)
{
    const Axis *axes[3] = {&page.map->force, &page.map->speed, &page.map->temperature};
    const int nodes[3] = {forces, speeds, temperatures};

    page.ends = ends;
    for (int i = 0; i < 3; ++i) {
        page.axes_of_ends[i] = *axes[i];
        page.axes_of_ends[i].scale *= (nodes[i] - 1.0) / (axes[i]->last + 1.0);
        page.axes_of_ends[i].last = nodes[i] - 2;
    }
}

/* Adds the ends of the interval of a nut with its force and torque. */
static void add_ends(double force, double torque)
{
    const double at[3] = {force, fabs(page.value[SPEED]), page.value[TEMPERATURE]};
    const Axis *axes = page.axes_of_ends;
    double weights[3][4], sums[END_COLUMNS] = {0.0};
    ptrdiff_t first[3];

    for (int i = 0; i < 3; ++i) {
        const Place place = axis_place(&axes[i], at[i]);
        cubic_weights(place.t, weights[i]);
        first[i] = place.cell;
    }
    for (int n = 0; n < 64; ++n) {
        const int i = n / 16, j = n / 4 % 4, k = n % 4;
        const ptrdiff_t line = (first[0] + i) * axis_coefficients(&axes[1]) + first[1] + j;
        const double *ends = page.ends + (line * axis_coefficients(&axes[2]) + first[2] + k) * END_COLUMNS;
        sums[LOW_END] += weights[0][i] * weights[1][j] * weights[2][k] * ends[LOW_END];
        sums[HIGH_END] += weights[0][i] * weights[1][j] * weights[2][k] * ends[HIGH_END];
    }
    page.value[TORQUE_LOW] += torque * exp(sums[LOW_END]);
    page.value[TORQUE_HIGH] += torque * exp(sums[HIGH_END]);
}

/* The results at the inputs; of a point beyond the map those at its edge. */
EXPORTED void page_point(void)
{
    double *value = page.value;
    const double speed = value[SPEED], ideal = fabs(value[AXIAL_LOAD] * page.lead) / 6.283185307179586;
    const double sign = speed > 0.0 ? 1.0 : speed < 0.0 ? -1.0 : 0.0;
    const bool loads_a = !(value[AXIAL_LOAD] < 0.0);
    const Friction friction = friction_of(value);
    Point point;
    Parts parts;
    Films films;

    memset(&point, 0, sizeof point);
    point_locate(page.map, value, 0.0, &point);
    nut_parts(page.map, &point.loads, &point.conditions, NULL, &friction, &parts);
    nut_films(page.map, &point.loads, &point.conditions, &films);
    part_outputs(&parts, sign, loads_a, speed, value);
    film_outputs(&films, value, value);
    value[POWER_LOSS] = value[FRICTION_TORQUE] * speed;
    value[RANGE_MARGIN] = point_margin(page.map, &point, value);
    value[CLAMPED] = point_clamped(page.map, &point, value);
    value[BREAKAWAY_TORQUE] = add(parts.viscous, coulomb_magnitude(&parts));
    value[FORCE_NUT_A] = point.loads.nut[loads_a ? point.loads.nuts - 1 : 0].force;
    value[FORCE_NUT_B] = point.loads.nut[loads_a ? 0 : point.loads.nuts - 1].force;
    value[DRIVING_EFFICIENCY] = efficiency_of(ideal, value[BREAKAWAY_TORQUE], 1.0);
    value[BACKDRIVING_EFFICIENCY] = efficiency_of(ideal, value[BREAKAWAY_TORQUE], -1.0);
    value[TORQUE_LOW] = value[TORQUE_HIGH] = page.ends != NULL ? 0.0 : NAN;
    if (page.ends != NULL) { /* the constants of the law are those of both nuts: their torques end together */
        const double seal = sign * parts.seal;
        add_ends(value[FORCE_NUT_A], value[FRICTION_TORQUE_NUT_A] - 0.5 * seal);
        add_ends(value[FORCE_NUT_B], value[FRICTION_TORQUE_NUT_B] - 0.5 * seal);
        value[TORQUE_LOW] += seal;
        value[TORQUE_HIGH] += seal;
    }
}
