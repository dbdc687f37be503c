/* What friction/model.c and axis/model.c have in common: events of elements and of the range. screw_model.c has
   the outputs on demand, computed by two functions of the model. */
#ifndef BALLSCREW_SCREW_MODEL_H
#define BALLSCREW_SCREW_MODEL_H

#include "model.h"

#include <math.h>

#define RANGE_HYSTERESIS 1e-6 /* of an axis: avoids repeated events at the limit of the map */
#define SPEED_HYSTERESIS 1e-6 /* [rad/s], [m/s] */

/* Of the model, at the latched point: loads and conditions; all outputs and rates except range and films. */
INTERNAL const Point *locate(Model *model);
INTERNAL void compute_outputs(Model *model);

/* in model exchange it changes, after the initial event, at events only */
static inline bool in_range(Model *model)
{
    return model->continuous && model->began ? model->in_range : model_clamped(model) == 0U;
}

static inline double range_indicator(Model *model)
{
    return point_margin(model->map, locate(model), model->latched)
           + (in_range(model) ? RANGE_HYSTERESIS : -RANGE_HYSTERESIS);
}

static inline bool range_after_event(const Model *model)
{
    const double margin = model->value[IN_RANGE_INDICATOR];

    return model->in_range ? !(margin < 0.0) : margin > 0.0;
}

/* Of an elasto-slip element. Sliding in a direction: until the speed reverses. Sticking: to its limit > 0, which is
   higher where the motion is away from it. */
static inline double slip_indicator(double element, double speed, double limit, int slip)
{
    const bool towards = speed != 0.0 && with_sign_of(element, speed) > 0.0;

    return slip != 0 ? slip * speed + SPEED_HYSTERESIS
                     : (towards ? limit : (1.0 + LEVEL_MARGIN) * limit) - fabs(element);
}

/* Direction in which an element of the screw slides after the last event; 0: it sticks. */
static inline int slip_of_element(unsigned slips, int slip, int element)
{
    return (slips >> element & 1U) != 0U ? slip : 0;
}

#endif
