#include "law.h"

#include <math.h>

double regularised_sign(double speed, double regularization_speed)
{
    if (!(regularization_speed > 0.0)) {
        return speed > 0.0 ? 1.0 : speed < 0.0 ? -1.0 : 0.0;
    }
    return tanh(speed / regularization_speed);
}

double bristle_within(double deflection, double coulomb, double stiffness)
{
    const double limit = coulomb > 0.0 ? coulomb / stiffness : 0.0;
    if (deflection > limit) {
        return limit;
    }
    return deflection < -limit ? -limit : deflection;
}

double bristle_yielding(double deflection, double speed, double coulomb, double stiffness)
{
    double limit, wound, share;
    if (!(coulomb > 0.0)) {
        return 1.0;
    }
    limit = coulomb / stiffness;
    wound = bristle_within(deflection, coulomb, stiffness);
    wound = speed < 0.0 ? -wound : wound;
    share = (wound - ELASTIC_SHARE * limit) / ((1.0 - ELASTIC_SHARE) * limit);
    return share > 0.0 ? share : 0.0;
}

double bristle_rate(double deflection, double speed, double coulomb, double stiffness, int slip)
{
    if (slip != 0 || !(stiffness > 0.0)) {
        return 0.0;
    }
    return speed * (1.0 - bristle_yielding(deflection, speed, coulomb, stiffness));
}

double bristle_power(double deflection, double speed, double coulomb, double stiffness)
{
    const double wound = bristle_within(deflection, coulomb, stiffness);
    return stiffness * wound * speed * bristle_yielding(deflection, speed, coulomb, stiffness);
}

BristleStep bristle_step(double deflection, double speed, double step, double coulomb, double stiffness,
                         double damping)
{
    BristleStep out = {0.0, 0.0, 0.5 * stiffness * deflection * deflection};
    double sliding_from, elastic_to, span, z, travel, direction, q_0, q, elastic, sliding, integral, rate, heat;

    if (!(coulomb > 0.0)) {
        return out;
    }
    sliding_from = coulomb / stiffness;
    z = bristle_within(deflection, coulomb, stiffness);
    /* what the bristle stored beyond a Coulomb level that sank is lost */
    out.heat = 0.5 * stiffness * (deflection * deflection - z * z);
    out.deflection = z;
    out.torque = stiffness * z;
    travel = fabs(speed) * step;
    if (!(travel > 0.0)) {
        return out;
    }
    direction = speed < 0.0 ? -1.0 : 1.0;
    elastic_to = ELASTIC_SHARE * sliding_from;
    span = sliding_from - elastic_to;
    q_0 = direction * z;
    elastic = elastic_to - q_0 > 0.0 ? elastic_to - q_0 : 0.0;
    elastic = travel < elastic ? travel : elastic;
    q = q_0 + elastic;
    integral = q_0 * elastic + 0.5 * elastic * elastic; /* of q over the travel */
    sliding = travel - elastic;
    if (sliding > 0.0) {
        const double decay = -expm1(-sliding / span), gap = sliding_from - q;
        integral += sliding_from * sliding - gap * span * decay;
        q += gap * decay;
    }
    rate = (q - q_0) / step;
    heat = stiffness * integral - 0.5 * stiffness * (q * q - q_0 * q_0) + damping * rate * travel;
    out.heat += heat > 0.0 ? heat : 0.0;
    out.deflection = direction * q;
    out.torque = direction * (stiffness * q + damping * rate);
    return out;
}
