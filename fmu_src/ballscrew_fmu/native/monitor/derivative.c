/* The monitor has no directional derivatives, as its description says: that of the torque over the preload is an
   output. */
#include "instance.h"

Status instance_derivative(Instance *instance, const unsigned unknowns[], size_t unknown_count,
                           const unsigned knowns[], size_t known_count, const double seed[], double sensitivity[],
                           bool adjoint)
{
    (void)unknowns;
    (void)unknown_count;
    (void)knowns;
    (void)known_count;
    (void)seed;
    (void)sensitivity;
    (void)adjoint;
    return instance_fail(instance, "no directional derivatives, as the model description says");
}
