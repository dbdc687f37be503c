/* The axis at an instant: forces, rates of the states, outputs by name. Numbers: number.h. The equations are in
   variables/axis.py, the integration over a step is in axis_part.c. */
#ifndef BALLSCREW_AXIS_LAW_H
#define BALLSCREW_AXIS_LAW_H

#include "contacts.h"
#include "named_parts.h"

#define STANDARD_GRAVITY 9.80665 /* [m/s2] */
#define STEEL_DENSITY 7850.0     /* [kg/m3] */
#define LEAST_INERTIA 1e-9       /* [kg.m2] of motor and screw together */
#define LEAST_MASS 1e-6          /* [kg] of the table; of the screw with a support */
#define AXIS_FOLLOW_TIME 3e-5    /* [s] model exchange, in which an element that slides follows: stiff, as the axis is */
#define LEAST_TRAVEL 1e-9        /* [m] of the guide, [rad] of the shaft to sliding */
#define LEAST_ROD 0.01           /* [m] of the screw between bearing and nut: the position may be too low for free_length */

/* Degrees of freedom. The last one exists where bearing or screw is elastic only. */
enum { SHAFT, TABLE, SCREW, FREEDOMS };
/* Shaft and table each have an elasto-slip element outside the nut: of bearings and motor, and of the guide. */
enum { SLIDERS = SCREW };
static const int slider_states[SLIDERS] = {SHAFT_ELEMENT, GUIDE_ELEMENT};
/* Places where heat arises, in the order of their powers in the table of variables. */
enum { NUT_PLACE, WIPER_PLACE, BEARING_PLACE, MOTOR_PLACE, GUIDE_PLACE, DAMPING_PLACE, PLACES };
/* Behind the variables: ends of ln speed and of temperature, torques of the rows [N.m] (speed, temperature). */
#define BEARING_TABLE VARIABLE_COUNT

/* What the axis needs in addition to the variables. */
typedef struct StepContext {
    unsigned slips;  /* bit per element that slides, */
    int slip;        /* in direction +1 or -1 */
    double stiffness; /* [N.m/rad] of the elements */
    int slider_slip[SLIDERS]; /* direction of those that slide, 0: it follows */
    double heat;     /* [J] of all steps; model exchange: of events */
    double supplied; /* [J] of all steps */
} StepContext;

typedef struct {
    Number mass[FREEDOMS];  /* [kg.m2], [kg] */
    Number lever[FREEDOMS]; /* deflection of the contacts for each place [m/rad], [1] */
    Number load[FREEDOMS];  /* [N.m], [N] of motor, external force and weight */
    Number weight[FREEDOMS]; /* the same of weight alone */
    Number bearing;         /* [m/N] compliance of the support bearings, 0: rigid */
    Number rod, reach;      /* [1/N] of the screw per length, 0: rigid; its length at position 0 [m] */
    Number root[SLIDERS];   /* [sqrt(N.m/rad)], [sqrt(N/m)] of the stiffness of the sliders */
    Number guide_limit;     /* [m at 1 N/m] state at which the guide slides */
    Number preload;           /* [N] at the temperature difference of screw and nut */
    Number contact, approach; /* k of a nut [N/m^1.5]; its approach without load [m] */
} Mechanics;

/* Where the sliders slide, at a speed. */
typedef struct {
    Number limit[SLIDERS]; /* [rad], [m at stiffness 1] state */
    Number bearings;       /* their fraction of the torque at the shaft */
} Sliding;

/* A point of the states and inputs. */
typedef struct {
    Mechanics mechanics;
    Contacts contacts;
    Loads loads;
    Conditions conditions;
    Parts parts;
    PreslidingLevel level;
    Sliding sliding;
} Point;

/* fixed: stiffness of the elements [N.m/rad]; 0: that of the loads */
static inline PreslidingLevel level_of(const Map *map, const Number at[], double fixed, Loads *loads,
                                       const Friction *friction, const Parts *parts)
{
    const Number stiffness = fixed > 0.0 ? constant(fixed) : stiffness_at(at, map, loads, friction);
    const Number damping = value_of(at[PRESLIDING_DAMPING]) > 0.0 ? at[PRESLIDING_DAMPING]
                                                                  : times(AXIS_DAMPING_TIME, stiffness);

    return presliding_level(coulomb_magnitude(parts), stiffness, damping);
}

/* Place on an axis with nodes 0 to last, clamped. */
static inline Number place_between(Number value, const Number ends[2], int last)
{
    return clamped(times(last, divide(subtract(value, ends[0]), subtract(ends[1], ends[0]))), 0.0, last);
}

static inline Number between(Number low, Number high, Number fraction)
{
    return add(low, multiply(fraction, subtract(high, low)));
}

/* Friction of the support bearings [N.m] at a speed: seals, and rows, linear in ln speed and temperature. */
static inline Number bearing_friction(const Number at[], Number speed)
{
    const Number *table = &at[BEARING_TABLE], pace = greater(absolute(speed), constant(SMOOTH));
    const Number s = place_between(function(pace, log(value_of(pace)), 1.0 / value_of(pace)), table, BEARING_SPEEDS - 1);
    const Number t = place_between(at[TEMPERATURE], table + 2, BEARING_TEMPERATURES - 1);
    const int i = value_of(s) < BEARING_SPEEDS - 2 ? (int)value_of(s) : BEARING_SPEEDS - 2;
    const int j = value_of(t) < BEARING_TEMPERATURES - 2 ? (int)value_of(t) : BEARING_TEMPERATURES - 2;
    const Number *slow = table + 4 + i * BEARING_TEMPERATURES + j, *fast = slow + BEARING_TEMPERATURES;
    const Number warmth = subtract(t, constant(j));
    const Number rows = between(between(slow[0], slow[1], warmth), between(fast[0], fast[1], warmth),
                                subtract(s, constant(i)));

    return add(at[BEARING_SEAL_TORQUE], multiply(at[BEARING_FRICTION_FACTOR], rows));
}

static inline Number inverse_of(Number a) { return value_of(a) > 0.0 ? divide(constant(1.0), a) : constant(0.0); }

static inline void mechanics_of(const Map *map, const Number at[], Mechanics *out)
{
    const Number travel = greater(at[GUIDE_PRESLIDING_TRAVEL], constant(LEAST_TRAVEL));
    const Number turn = greater(at[SHAFT_PRESLIDING_ANGLE], constant(LEAST_TRAVEL));
    const Number square = multiply(at[SCREW_DIAMETER], at[SCREW_DIAMETER]);
    const Number cylinder = times(STEEL_DENSITY * TWO_PI / 8.0, multiply(square, at[SCREW_LENGTH])); /* [kg] */
    const Number inertia = value_of(at[SCREW_INERTIA]) > 0.0 ? at[SCREW_INERTIA]
                                                             : times(0.125, multiply(cylinder, square));
    const Number screw = value_of(at[SCREW_MASS]) > 0.0 ? at[SCREW_MASS] : cylinder;
    const Number pull = function(at[INCLINATION], -STANDARD_GRAVITY * sin(value_of(at[INCLINATION])),
                                 -STANDARD_GRAVITY * cos(value_of(at[INCLINATION])));

    out->mass[SHAFT] = greater(add(at[MOTOR_INERTIA], inertia), constant(LEAST_INERTIA));
    out->mass[TABLE] = greater(at[TABLE_MASS], constant(LEAST_MASS));
    out->mass[SCREW] = greater(screw, constant(LEAST_MASS));
    out->lever[SHAFT] = screw_ratio(at);
    out->lever[TABLE] = constant(-1.0);
    out->lever[SCREW] = constant(1.0);
    out->weight[SHAFT] = constant(0.0);
    out->weight[TABLE] = multiply(pull, out->mass[TABLE]);
    out->weight[SCREW] = multiply(pull, out->mass[SCREW]);
    out->load[SHAFT] = at[MOTOR_TORQUE];
    out->load[TABLE] = add(at[EXTERNAL_FORCE], out->weight[TABLE]);
    out->load[SCREW] = out->weight[SCREW];
    out->bearing = inverse_of(at[SUPPORT_STIFFNESS]);
    out->rod = value_of(at[FREE_LENGTH]) > 0.0 ? inverse_of(at[ROD_STIFFNESS]) : constant(0.0);
    out->reach = at[FREE_LENGTH];
    /* at rest: a stiffness does not follow the speed */
    out->root[SHAFT] = root(divide(add(bearing_friction(at, constant(0.0)), at[MOTOR_COULOMB]), turn));
    out->root[TABLE] = root(divide(at[GUIDE_COULOMB], travel));
    out->guide_limit = root(multiply(at[GUIDE_COULOMB], travel));
    out->contact = contact_stiffness(at[NUT_STIFFNESS], at[STIFFNESS_PRELOAD]);
    out->preload = actual_preload(map, at[PRELOAD], at[TEMPERATURE_DIFFERENCE]);
    out->approach = preload_approach(out->contact, out->preload, at[AXIAL_PLAY]);
}

static inline bool is_elastic(const Mechanics *mechanics)
{
    return value_of(mechanics->bearing) > 0.0 || value_of(mechanics->rod) > 0.0;
}

/* [m/N] of bearing and screw in series, the nut at a position */
static inline Number compliance_at(const Mechanics *mechanics, Number position)
{
    const Number length = greater(add(mechanics->reach, position), constant(LEAST_ROD));

    return add(mechanics->bearing, multiply(mechanics->rod, length));
}

static inline void sliding_at(const Number at[], const Mechanics *mechanics, Number speed, Sliding *out)
{
    const Number bearings = bearing_friction(at, speed), torque = add(bearings, at[MOTOR_COULOMB]);

    out->limit[SHAFT] = out->bearings = constant(0.0);
    out->limit[TABLE] = mechanics->guide_limit;
    if (value_of(mechanics->root[SHAFT]) > 0.0) {
        out->limit[SHAFT] = divide(torque, mechanics->root[SHAFT]);
        out->bearings = divide(bearings, torque);
    }
}

/* Loads of both nuts, and friction at a speed of the screw [rad/s]. fixed: as in level_of */
static inline void friction_at(const Map *map, const Number at[], Number speed, double fixed, Point *point)
{
    const Friction friction = friction_of(at);

    loads_of_contacts(map, &point->contacts, &point->loads);
    nut_conditions(map, speed, at[TEMPERATURE], &point->conditions);
    nut_parts(map, &point->loads, &point->conditions, NULL, &friction, &point->parts);
    point->level = level_of(map, at, fixed, &point->loads, &friction, &point->parts);
}

static inline void point_locate(const Map *map, const Number at[], double fixed, Point *point)
{
    Mechanics *mechanics = &point->mechanics;
    Number drift, deflection; /* rate and way by which the screw leads the nut */

    mechanics_of(map, at, mechanics);
    deflection = add(subtract(multiply(mechanics->lever[SHAFT], at[ANGLE]), at[POSITION]), at[SCREW_DISPLACEMENT]);
    drift = subtract(multiply(mechanics->lever[SHAFT], at[SPEED]), at[VELOCITY]);
    if (is_elastic(mechanics)) {
        drift = add(drift, at[SCREW_VELOCITY]);
    }
    contacts_of(mechanics->contact, mechanics->approach, deflection, deflection, drift, &point->contacts);
    friction_at(map, at, at[SPEED], fixed, point);
    sliding_at(at, mechanics, at[SPEED], &point->sliding);
}

/* Force of a slider [N] or [N.m], rate of its state, power [W]. */
typedef struct {
    Number force, rate, power;
} Slider;

/* As the elements in presliding_law.h: on past the limit, to an event; sliding, its state follows the limit. */
static inline Slider slider_at_instant(Number stiffness_root, Number limit, Number element, Number velocity, int slip)
{
    const Number way = multiply(stiffness_root, velocity), along = times(slip, element), pace = absolute(way);
    const bool at_limit = value_of(velocity) != 0.0 && value_of(with_sign_of(element, velocity)) >= value_of(limit);
    Slider out = {constant(0.0), way, constant(0.0)};

    if (slip != 0) {
        out.rate = times(slip, element_within(over(subtract(limit, along), AXIS_FOLLOW_TIME), pace));
        out.force = times(slip, multiply(stiffness_root, lesser(limit, add(along, times(AXIS_FOLLOW_TIME, pace)))));
        out.power = subtract(multiply(out.force, velocity), multiply(element, out.rate));
    } else if (at_limit) {
        out.force = multiply(stiffness_root, with_sign_of(limit, velocity));
        out.power = multiply(out.force, velocity);
    } else {
        out.force = multiply(stiffness_root, element_within(element, limit));
    }
    out.power = greater(out.power, constant(0.0));
    return out;
}

static inline Number half_square(Number factor, Number a) { return times(0.5, multiply(factor, multiply(a, a))); }

static inline void energy_outputs(const Point *point, const Number at[], Number out[])
{
    const Mechanics *mechanics = &point->mechanics;
    const Number one = constant(1.0);
    const Number sliders = add(half_square(one, at[SHAFT_ELEMENT]), half_square(one, at[GUIDE_ELEMENT]));

    out[KINETIC_ENERGY] = add(half_square(mechanics->mass[SHAFT], at[SPEED]),
                              half_square(mechanics->mass[TABLE], at[VELOCITY]));
    out[POTENTIAL_ENERGY] = negative(multiply(mechanics->weight[TABLE], at[POSITION]));
    out[STORED_ENERGY] =
        add(contact_energy(&point->contacts),
            add(energy_of_elements(&at[PRESLIDING_ELEMENT_1]), sliders));
    if (is_elastic(mechanics)) {
        out[KINETIC_ENERGY] = add(out[KINETIC_ENERGY], half_square(mechanics->mass[SCREW], at[SCREW_VELOCITY]));
        out[POTENTIAL_ENERGY] =
            subtract(out[POTENTIAL_ENERGY], multiply(mechanics->weight[SCREW], at[SCREW_DISPLACEMENT]));
        out[STORED_ENERGY] = add(out[STORED_ENERGY], half_square(inverse_of(compliance_at(mechanics, at[POSITION])),
                                                                 at[SCREW_DISPLACEMENT]));
    }
}

/* Outputs and rates at an instant, except those of a whole step, which the model adds. */
static inline void axis_outputs(const Point *point, const Number at[], const StepContext *context,
                                Number out[])
{
    const Mechanics *mechanics = &point->mechanics;
    const Contacts *contacts = &point->contacts;
    const Number time = at[CONTACT_DAMPING_TIME], speed = at[SPEED], velocity = at[VELOCITY];
    const Number stiffness = add(contacts->a.slope, contacts->b.slope);
    const Number damping = multiply(multiply(time, stiffness), contacts->drift);
    const Number force = add(subtract(contacts->a.force, contacts->b.force), damping);
    const Number drag = multiply(at[GUIDE_VISCOUS], velocity), bearings = point->sliding.bearings;
    const Number coulomb = coulomb_magnitude(&point->parts);
    const Number wipers = value_of(coulomb) > 0.0 ? divide(point->parts.seal, coulomb) : constant(0.0);
    Number power[PLACES], sum = constant(0.0), fraction;
    Slider slider[SLIDERS];
    Presliding elements;

    presliding_at_instant(&at[PRESLIDING_ELEMENT_1], speed, &point->level, true, context->slips,
                          context->slip, AXIS_FOLLOW_TIME, &elements);
    fraction = value_of(coulomb) > 0.0 ? clamped(divide(elements.torque, coulomb), -1.0, 1.0) : constant(0.0);
    part_outputs(&point->parts, fraction, loads_nut_a(contacts), speed, out);
    for (int i = 0; i < SLIDERS; ++i) {
        slider[i] = slider_at_instant(mechanics->root[i], point->sliding.limit[i], at[slider_states[i]],
                                      i == SHAFT ? speed : velocity, context->slider_slip[i]);
        out[i == SHAFT ? SHAFT_ELEMENT_RATE : GUIDE_ELEMENT_RATE] = slider[i].rate;
    }
    out[BEARING_TORQUE] = multiply(bearings, slider[SHAFT].force);
    out[MOTOR_FRICTION_TORQUE] = subtract(slider[SHAFT].force, out[BEARING_TORQUE]);
    out[GUIDE_FORCE] = add(slider[TABLE].force, drag);
    out[NUT_FORCE] = force;
    out[FORCE_NUT_A] = contacts->a.force;
    out[FORCE_NUT_B] = contacts->b.force;
    out[PRELOAD_ACTUAL] = mechanics->preload;
    out[AXIAL_DEFLECTION] = subtract(multiply(mechanics->lever[SHAFT], at[ANGLE]), at[POSITION]);
    out[AXIAL_STIFFNESS] = stiffness;
    power[WIPER_PLACE] = multiply(wipers, elements.power);
    power[NUT_PLACE] = add(multiply(point->parts.viscous, absolute(speed)), subtract(elements.power, power[WIPER_PLACE]));
    power[BEARING_PLACE] = multiply(bearings, slider[SHAFT].power);
    power[MOTOR_PLACE] = subtract(slider[SHAFT].power, power[BEARING_PLACE]);
    power[GUIDE_PLACE] = add(multiply(drag, velocity), slider[TABLE].power);
    power[DAMPING_PLACE] = multiply(damping, contacts->drift);
    energy_outputs(point, at, out);

    out[ANGLE_RATE] = speed;
    out[SPEED_RATE] = divide(subtract(subtract(mechanics->load[SHAFT], multiply(mechanics->lever[SHAFT], force)),
                                      add(out[FRICTION_TORQUE], slider[SHAFT].force)), mechanics->mass[SHAFT]);
    out[POSITION_RATE] = velocity;
    out[VELOCITY_RATE] = subtract(add(mechanics->load[TABLE], force), out[GUIDE_FORCE]);
    out[SCREW_DISPLACEMENT_RATE] = out[SCREW_VELOCITY_RATE] = constant(0.0);
    if (is_elastic(mechanics)) {
        const Number support = inverse_of(compliance_at(mechanics, at[POSITION]));
        const Number pull = multiply(support, at[SCREW_DISPLACEMENT]);
        const Number damper = multiply(multiply(time, support), at[SCREW_VELOCITY]);
        const bool grows = value_of(add(mechanics->reach, at[POSITION])) > LEAST_ROD; /* the rod, as the table moves on */
        out[SCREW_DISPLACEMENT_RATE] = at[SCREW_VELOCITY];
        out[SCREW_VELOCITY_RATE] = divide(subtract(subtract(mechanics->load[SCREW], force), add(pull, damper)),
                                          mechanics->mass[SCREW]);
        if (grows) {
            out[VELOCITY_RATE] = add(out[VELOCITY_RATE], half_square(mechanics->rod, pull));
        }
        power[DAMPING_PLACE] = add(power[DAMPING_PLACE], multiply(damper, at[SCREW_VELOCITY]));
    }
    out[VELOCITY_RATE] = divide(out[VELOCITY_RATE], mechanics->mass[TABLE]);
    for (int i = 0; i < ELEMENTS; ++i) {
        out[PRESLIDING_ELEMENT_1_RATE + i] = elements.rate[i];
    }
    for (int i = 0; i < PLACES; ++i) {
        out[POWER_NUT + i] = power[i];
        sum = add(sum, power[i]);
    }
    out[POWER_LOSS] = sum;
    out[HEAT] = constant(context->heat);
    out[SUPPLIED_ENERGY] = constant(context->supplied);
}

static inline Number point_margin(const Map *map, const Point *point, const Number at[])
{
    return contacts_margin(map, &point->contacts, point->mechanics.preload, at);
}

#endif
