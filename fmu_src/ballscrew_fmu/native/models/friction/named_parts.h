/* Parameters of the friction laws and their results by name, for all models with a screw. Numbers: number.h. */
#ifndef BALLSCREW_NAMED_PARTS_H
#define BALLSCREW_NAMED_PARTS_H

#include "nut_law.h"
#include "presliding_law.h"
#include "variables.h"

static inline Friction friction_of(const Number at[])
{
    const Friction out = {at[APPARENT_VISCOSITY_RATIO], at[NET_SLIDING_COEFFICIENT], at[ROUGHNESS_HEIGHT],
                          at[BREAKAWAY_FACTOR], at[SEAL_TORQUE]};
    return out;
}

/* The start values that a map carries. */
static inline void friction_of_map(const Map *map, double value[])
{
    value[APPARENT_VISCOSITY_RATIO] = map->defaults[APPARENT_VISCOSITY_RATIO_DEFAULT];
    value[NET_SLIDING_COEFFICIENT] = map->defaults[NET_SLIDING_COEFFICIENT_DEFAULT];
    value[ROUGHNESS_HEIGHT] = map->defaults[ROUGHNESS_HEIGHT_DEFAULT];
    value[BREAKAWAY_FACTOR] = map->defaults[BREAKAWAY_FACTOR_DEFAULT];
}

/* Presliding stiffness at these loads: as set, or from the screw. One that is next to 0 counts as 0, or a state would not
   be finite. */
static inline Number stiffness_at(const Number at[], const Map *map, Loads *loads, const Friction *friction)
{
    return value_of(at[PRESLIDING_STIFFNESS]) >= LEAST_STIFFNESS ? at[PRESLIDING_STIFFNESS]
                                                                 : nut_stiffness(map, loads, friction);
}

static inline Number damping_at(const Number at[], Number stiffness)
{
    return value_of(at[PRESLIDING_DAMPING]) > 0.0 ? at[PRESLIDING_DAMPING] : times(DAMPING_TIME, stiffness);
}

/* Torques. fraction: of the Coulomb torque, with the sign of the torque, -1 to 1; loads_a: nut A has the larger
   force, of equal ones either */
static inline void part_outputs(const Parts *parts, Number fraction, bool loads_a, Number speed, Number out[])
{
    const int relieved = loads_a ? FRICTION_TORQUE_NUT_B : FRICTION_TORQUE_NUT_A;
    const int loaded = loads_a ? FRICTION_TORQUE_NUT_A : FRICTION_TORQUE_NUT_B;

    out[VISCOUS_TORQUE] = with_sign_of(parts->viscous, speed);
    out[HYSTERESIS_TORQUE] = multiply(fraction, parts->hysteresis);
    out[SLIDING_TORQUE] = multiply(fraction, parts->sliding);
    out[FRICTION_TORQUE] = add(add(add(out[VISCOUS_TORQUE], out[HYSTERESIS_TORQUE]), out[SLIDING_TORQUE]),
                               multiply(fraction, parts->seal));
    /* each nut has seals */
    out[relieved] = add(with_sign_of(parts->relieved_viscous, speed),
                        multiply(fraction, add(parts->relieved_coulomb, times(0.5, parts->seal))));
    out[loaded] = subtract(out[FRICTION_TORQUE], out[relieved]);
}

static inline void film_outputs(const Films *films, const Number at[], Number out[])
{
    out[FILM_THICKNESS_MIN] = films->minimum;
    out[FILM_THICKNESS_CENTRAL_SCREW] = films->central_screw;
    out[FILM_THICKNESS_CENTRAL_NUT] = films->central_nut;
    out[FILM_TEMPERATURE_RISE] = films->rise;
    out[CONTACT_PRESSURE_MAX] = films->pressure;
    out[BALL_LOAD_MAX] = films->ball_load;
    out[LAMBDA_RATIO] = lambda_ratio(films->minimum, at[ROUGHNESS_HEIGHT]);
}

#endif
