/* Outputs of the friction FMU by name. Twin of runtime/standstill.py. Numbers: number.h. A new output of the
   friction FMU alone is assigned in point_outputs of point.h; here, if the transmission has it too; in named_parts.h
   (torques or films, as `needs` in its row of the table of variables says), if the axis has it too. */
#ifndef BALLSCREW_FRICTION_LAW_H
#define BALLSCREW_FRICTION_LAW_H

#include "named_parts.h"

/* What the elasto-slip elements need in addition to the variables. */
typedef struct StepContext {
    double step;     /* [s] that the outputs belong to; 0: an instant */
    bool continuous; /* model exchange */
    double stiffness; /* [N.m/rad] of the elements; 0: that of the loads */
    bool from_side;  /* at the start: the elements follow from presliding_side */
    unsigned slips;  /* model exchange: bit per element that slides */
    int slip;        /* +1 or -1 direction in which they slide, 0: none does */
    double heat;     /* [J] dissipated before the step; model exchange: at events */
} StepContext;

/* A step without presliding: what the elements stored becomes heat. At an instant nothing happens to them. */
static inline void presliding_off(const Number at[], double step, Presliding *out)
{
    const Number none = constant(0.0);

    out->torque = out->power = out->supply = none;
    for (int i = 0; i < ELEMENTS; ++i) {
        out->element[i] = step > 0.0 ? none : at[PRESLIDING_ELEMENT_1 + i];
        out->rate[i] = none;
    }
    if (step > 0.0) {
        out->power = over(energy_of_elements(&at[PRESLIDING_ELEMENT_1]), step);
    }
}

/* stiffness: of the elements */
static inline void presliding_at(const Number at[], Number coulomb, Number stiffness,
                                 const StepContext *context, Presliding *out)
{
    const PreslidingLevel level = presliding_level(coulomb, stiffness, damping_at(at, stiffness));
    const Number *elements = &at[PRESLIDING_ELEMENT_1];
    Number initial[ELEMENTS];

    if (context->from_side) {
        initial_elements(at[PRESLIDING_SIDE], value_of(at[SPEED]), &level, initial);
        elements = initial;
    }
    if (context->step > 0.0) {
        presliding_after_step(elements, at[SPEED], context->step, &level, out);
    } else {
        presliding_at_instant(elements, at[SPEED], &level, context->continuous, context->slips, context->slip,
                              FOLLOW_TIME, out);
    }
}

/* loads_a: nut A has the larger force, of equal ones either */
static inline void torque_outputs(const Parts *parts, const Presliding *presliding, bool loads_a, const Number at[],
                                  Number out[])
{
    const Number speed = at[SPEED], coulomb = coulomb_magnitude(parts);
    Number sign, power_loss = multiply(parts->viscous, absolute(speed));

    if (value_of(at[PRESLIDING]) != 0.0) {
        sign = value_of(coulomb) > 0.0 ? divide(presliding->torque, coulomb) : constant(0.0);
        power_loss = add(power_loss, presliding->power);
    } else {
        sign = regularised_sign(speed, at[REGULARIZATION_SPEED]);
        power_loss = add(add(power_loss, multiply(multiply(coulomb, sign), speed)), presliding->power);
    }
    part_outputs(parts, sign, loads_a, speed, out);
    out[POWER_LOSS] = power_loss;
}

/* Accumulated heat after the step, from its mean power. In model exchange, where the importer integrates the power,
   that of events alone: a continuous state for it would cost each solver a column of its Jacobian and an error
   control, for a quantity that feeds back on nothing. */
static inline void heat_output(const StepContext *context, Number out[])
{
    out[HEAT] = add(constant(context->heat),
                    context->continuous ? constant(0.0) : times(context->step, out[POWER_LOSS]));
}

#endif
