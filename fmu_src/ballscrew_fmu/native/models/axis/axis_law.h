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
#define LEAST_TRAVEL 1e-9        /* [m] of the guide to sliding */

/* What the axis needs in addition to the variables. */
typedef struct StepContext {
    unsigned slips;  /* bit per element that slides, */
    int slip;        /* in direction +1 or -1 */
    double stiffness; /* [N.m/rad] of the elements */
    int guide_slip;  /* direction of the guide that slides, 0: it follows */
    double heat;     /* [J] of all steps; model exchange: of events */
    double supplied; /* [J] of all steps */
} StepContext;

/* Degrees of freedom. The last one exists with a support only. */
enum { SHAFT, TABLE, SCREW, FREEDOMS };

typedef struct {
    Number mass[FREEDOMS];  /* [kg.m2], [kg] */
    Number lever[FREEDOMS]; /* deflection of the contacts for each place [m/rad], [1] */
    Number load[FREEDOMS];  /* [N.m], [N] of motor, external force and weight */
    Number weight[FREEDOMS]; /* the same of weight alone */
    Number support;         /* [N/m] 0: rigid */
    Number guide_root;      /* [sqrt(N/m)] of the stiffness of the guide */
    Number guide_limit;     /* [m at 1 N/m] state at which it slides */
    Number preload;           /* [N] at the temperature difference of screw and nut */
    Number contact, approach; /* k of a nut [N/m^1.5]; its approach without load [m] */
} Mechanics;

/* A point of the states and inputs. */
typedef struct {
    Mechanics mechanics;
    Contacts contacts;
    Loads loads;
    Conditions conditions;
    Parts parts;
    PreslidingLevel level;
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

static inline void mechanics_of(const Map *map, const Number at[], Mechanics *out)
{
    const Number travel = greater(at[GUIDE_PRESLIDING_TRAVEL], constant(LEAST_TRAVEL));
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
    out->support = at[SUPPORT_STIFFNESS];
    out->guide_root = root(divide(at[GUIDE_COULOMB], travel));
    out->guide_limit = root(multiply(at[GUIDE_COULOMB], travel));
    out->contact = contact_stiffness(at[NUT_STIFFNESS], at[STIFFNESS_PRELOAD]);
    out->preload = actual_preload(map, at[PRELOAD], at[TEMPERATURE_DIFFERENCE]);
    out->approach = preload_approach(out->contact, out->preload, at[AXIAL_PLAY]);
}

static inline bool is_supported(const Mechanics *mechanics) { return value_of(mechanics->support) > 0.0; }

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
    if (is_supported(mechanics)) {
        drift = add(drift, at[SCREW_VELOCITY]);
    }
    contacts_of(mechanics->contact, mechanics->approach, deflection, deflection, drift, &point->contacts);
    friction_at(map, at, at[SPEED], fixed, point);
}

/* Guide, an elasto-slip element: force without viscous part [N], rate of its state, power [W]. */
typedef struct {
    Number force, rate, power;
} Guide;

static inline Guide guide_at_instant(const Mechanics *mechanics, Number element, Number velocity, int slip)
{
    const Number limit = mechanics->guide_limit, direction = slip != 0 ? constant(slip) : velocity;
    const bool at_limit = value_of(velocity) != 0.0 && value_of(with_sign_of(element, velocity)) >= value_of(limit);
    Guide out = {constant(0.0), constant(0.0), constant(0.0)};

    if (slip == 0) { /* on past the limit, as the elements */
        out.rate = multiply(mechanics->guide_root, velocity);
    }
    if (slip != 0 || at_limit) {
        out.force = multiply(mechanics->guide_root, with_sign_of(limit, direction));
        out.power = multiply(out.force, velocity);
    } else {
        out.force = multiply(mechanics->guide_root, element_within(element, limit));
    }
    return out;
}

static inline Number half_square(Number factor, Number a) { return times(0.5, multiply(factor, multiply(a, a))); }

static inline void energy_outputs(const Point *point, const Number at[], Number out[])
{
    const Mechanics *mechanics = &point->mechanics;
    const Number one = constant(1.0);

    out[KINETIC_ENERGY] = add(half_square(mechanics->mass[SHAFT], at[SPEED]),
                              half_square(mechanics->mass[TABLE], at[VELOCITY]));
    out[POTENTIAL_ENERGY] = negative(multiply(mechanics->weight[TABLE], at[POSITION]));
    out[STORED_ENERGY] =
        add(contact_energy(&point->contacts),
            add(energy_of_elements(&at[PRESLIDING_ELEMENT_1]), half_square(one, at[GUIDE_ELEMENT])));
    if (is_supported(mechanics)) {
        out[KINETIC_ENERGY] = add(out[KINETIC_ENERGY], half_square(mechanics->mass[SCREW], at[SCREW_VELOCITY]));
        out[POTENTIAL_ENERGY] =
            subtract(out[POTENTIAL_ENERGY], multiply(mechanics->weight[SCREW], at[SCREW_DISPLACEMENT]));
        out[STORED_ENERGY] = add(out[STORED_ENERGY], half_square(mechanics->support, at[SCREW_DISPLACEMENT]));
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
    const Guide guide = guide_at_instant(mechanics, at[GUIDE_ELEMENT], velocity, context->guide_slip);
    const Number drag = multiply(at[GUIDE_VISCOUS], velocity);
    const Number coulomb = coulomb_magnitude(&point->parts);
    Presliding elements;
    Number power, fraction;

    presliding_at_instant(&at[PRESLIDING_ELEMENT_1], speed, &point->level, true, context->slips,
                          context->slip, AXIS_FOLLOW_TIME, &elements);
    fraction = value_of(coulomb) > 0.0 ? clamped(divide(elements.torque, coulomb), -1.0, 1.0) : constant(0.0);
    part_outputs(&point->parts, fraction, loads_nut_a(contacts), speed, out);
    out[GUIDE_FORCE] = add(guide.force, drag);
    out[NUT_FORCE] = force;
    out[FORCE_NUT_A] = contacts->a.force;
    out[FORCE_NUT_B] = contacts->b.force;
    out[PRELOAD_ACTUAL] = mechanics->preload;
    out[AXIAL_DEFLECTION] = subtract(multiply(mechanics->lever[SHAFT], at[ANGLE]), at[POSITION]);
    out[AXIAL_STIFFNESS] = stiffness;
    power = add(add(multiply(point->parts.viscous, absolute(speed)), elements.power),
                add(multiply(damping, contacts->drift), add(multiply(drag, velocity), guide.power)));
    energy_outputs(point, at, out);

    out[ANGLE_RATE] = speed;
    out[SPEED_RATE] = divide(subtract(subtract(mechanics->load[SHAFT], multiply(mechanics->lever[SHAFT], force)),
                                      out[FRICTION_TORQUE]), mechanics->mass[SHAFT]);
    out[POSITION_RATE] = velocity;
    out[VELOCITY_RATE] =
        divide(subtract(add(mechanics->load[TABLE], force), out[GUIDE_FORCE]), mechanics->mass[TABLE]);
    out[SCREW_DISPLACEMENT_RATE] = out[SCREW_VELOCITY_RATE] = constant(0.0);
    if (is_supported(mechanics)) {
        const Number support = mechanics->support, damper = multiply(multiply(time, support), at[SCREW_VELOCITY]);
        out[SCREW_DISPLACEMENT_RATE] = at[SCREW_VELOCITY];
        out[SCREW_VELOCITY_RATE] =
            divide(subtract(subtract(mechanics->load[SCREW], force),
                            add(multiply(support, at[SCREW_DISPLACEMENT]), damper)), mechanics->mass[SCREW]);
        power = add(power, multiply(damper, at[SCREW_VELOCITY]));
    }
    for (int i = 0; i < ELEMENTS; ++i) {
        out[PRESLIDING_ELEMENT_1_RATE + i] = elements.rate[i];
    }
    out[GUIDE_ELEMENT_RATE] = guide.rate;
    out[POWER_LOSS] = greater(power, constant(0.0));
    out[HEAT] = constant(context->heat);
    out[SUPPLIED_ENERGY] = constant(context->supplied);
}

static inline Number point_margin(const Map *map, const Point *point, const Number at[])
{
    return contacts_margin(map, &point->contacts, point->mechanics.preload, at);
}

#endif
