"""Friction at and near standstill: a regularised sign, or an elasto-plastic bristle (presliding).

Plain floats and `math` only: this module travels inside the FMU.
Source: Dupont, Hayward, Armstrong, Altpeter, IEEE Trans. Automat. Contr. 47 (2002) 787 (elasto-plastic
friction); changed: the piecewise linear transition between elastic and sliding, integrated exactly over a
step of constant speed.
"""

import math
from typing import NamedTuple

from ballscrew_tehl.runtime.constants import ELASTIC_SHARE


class PreslidingStep(NamedTuple):
    """State and torque at the end of a step, and the heat of the step."""

    deflection: float  # [rad]
    torque: float  # [N.m], signed like the speed that winds the bristle up
    heat: float  # [J], >= 0


def regularised_sign(speed: float, regularization_speed: float) -> float:
    """Sign of the speed that passes smoothly through zero.

    Parameters   speed : [rad/s]
                 regularization_speed : [rad/s], >= 0; 0 gives the sign itself (0 at rest)
    Returns      tanh(speed/regularization_speed), within 1e-9 of the sign above 11 regularisation speeds
    Validity     creeps under a load below the Coulomb torque (at 0.42 of the speed for 0.4 of the torque);
                 explicit coupling with an inertia J is free of ripple only for steps below
                 2 J regularization_speed/torque
    Example
                 >>> regularised_sign(0.0, 0.1), regularised_sign(-2.0, 0.1)
                 (0.0, -1.0)
    """
    if regularization_speed <= 0.0:
        return math.copysign(1.0, speed) if speed else 0.0
    return math.tanh(speed / regularization_speed)


class CoulombFriction(NamedTuple):
    """What the Coulomb torque becomes near standstill."""

    sign: float  # of the torque, -1 to 1; in between near standstill, beyond it with damping
    power: float  # [W] heat
    deflection: float  # [rad] of the bristle at the end of the step


def coulomb_friction(
    coulomb_torque: float,
    speed: float,
    step: float | None,
    deflection: float,
    regularization_speed: float,
    stiffness: float,
    damping: float,
) -> CoulombFriction:
    """Standstill law of the FMU: the bristle where its stiffness is positive, else the regularised sign.

    Parameters   coulomb_torque : hysteresis and sliding part at these inputs, at motion [N.m], >= 0
                 step : [s]; None or 0: at an instant, which leaves the deflection
                 the rest : as in regularised_sign and presliding_step
    """
    if stiffness > 0.0:
        bristle = presliding_step(deflection, speed, step or 0.0, coulomb_torque, stiffness, damping)
        sign = bristle.torque / coulomb_torque if coulomb_torque > 0.0 else 0.0
        if step:
            return CoulombFriction(sign, bristle.heat / step, bristle.deflection)
        return CoulombFriction(
            sign, presliding_power(deflection, speed, coulomb_torque, stiffness), deflection
        )
    sign = regularised_sign(speed, regularization_speed)
    # a bristle that is switched off is unwound
    return CoulombFriction(sign, coulomb_torque * sign * speed, 0.0 if step else deflection)


def presliding_power(deflection: float, speed: float, coulomb_torque: float, stiffness: float) -> float:
    """Heat per time of the sliding share of the bristle at an instant (no damping).

    Parameters   as in presliding_step
    Returns      dissipated power [W], >= 0: zero while the bristle is elastic or springs back
    """
    if coulomb_torque <= 0.0:
        return 0.0
    limit = coulomb_torque / stiffness
    wound = min(max(math.copysign(1.0, speed) * deflection, -limit), limit)
    yielding = (wound - ELASTIC_SHARE * limit) / ((1.0 - ELASTIC_SHARE) * limit)
    return stiffness * wound * abs(speed) * yielding if yielding > 0.0 else 0.0


def presliding_step(
    deflection: float, speed: float, step: float, coulomb_torque: float, stiffness: float, damping: float
) -> PreslidingStep:
    """Elasto-plastic bristle over one step with the speed held: exact, passive for any step size.

    Parameters   deflection : state at the start of the step [rad]
                 speed : [rad/s]          step : [s], >= 0; 0 leaves the state and reports its torque
                 coulomb_torque : sliding torque of the moment [N.m], >= 0; may change from step to step
                 stiffness : [N.m/rad], > 0; constant: if it followed the Coulomb torque, a change of load
                             would make energy
                 damping : [N.m.s/rad], >= 0; explicit coupling with an inertia J needs it:
                           stiffness < (damping/step)(1 - step damping/J)
    Returns      PreslidingStep; work done on the bristle = heat + change of stiffness deflection^2/2
    Validity     the torque is that at the end of the step; it may point along the motion while the bristle
                 springs back
    """
    if coulomb_torque <= 0.0:
        if step <= 0.0:
            return PreslidingStep(deflection, 0.0, 0.0)
        return PreslidingStep(0.0, 0.0, 0.5 * stiffness * deflection * deflection)
    z_s = coulomb_torque / stiffness
    z = max(-z_s, min(z_s, deflection))
    if step <= 0.0:
        return PreslidingStep(deflection, stiffness * z, 0.0)
    # what the bristle stored beyond a Coulomb level that sank is lost
    heat = 0.5 * stiffness * (deflection * deflection - z * z)
    travel = abs(speed) * step
    if travel == 0.0:
        return PreslidingStep(z, stiffness * z, heat)
    direction = math.copysign(1.0, speed)
    z_b = ELASTIC_SHARE * z_s
    span = z_s - z_b
    q_0 = direction * z
    elastic = min(travel, max(z_b - q_0, 0.0))
    q = q_0 + elastic
    integral = q_0 * elastic + 0.5 * elastic * elastic  # of q over the travel
    sliding = travel - elastic
    if sliding > 0.0:
        decay = -math.expm1(-sliding / span)
        gap = z_s - q
        integral += z_s * sliding - gap * span * decay
        q += gap * decay
    rate = (q - q_0) / step
    heat += max(0.0, stiffness * integral - 0.5 * stiffness * (q * q - q_0 * q_0) + damping * rate * travel)
    return PreslidingStep(direction * q, direction * (stiffness * q + damping * rate), heat)
