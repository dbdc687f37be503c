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
    torque: float  # [N.m], signed like the speed that winds the bristle up; never beyond the Coulomb torque
    heat: float  # [J], >= 0


class Bristle(NamedTuple):
    """State of the presliding bristle between two steps."""

    deflection: float = 0.0  # [rad]
    stiffness: float = 0.0  # [N.m/rad] that the deflection belongs to

    @property
    def energy(self) -> float:
        """Stored energy [J]."""
        return 0.5 * self.stiffness * self.deflection * self.deflection

    def at_stiffness(self, stiffness: float) -> "Bristle":
        """The bristle at another stiffness [N.m/rad], >= 0, with the same energy (none at stiffness 0).

        The stiffness follows preload and axial load. At constant deflection a rising stiffness would supply energy.
        """
        if stiffness == self.stiffness:
            return self
        scale = math.sqrt(self.stiffness / stiffness) if stiffness > 0.0 else 0.0
        return Bristle(scale * self.deflection, stiffness)


def initial_bristle(side: float, speed: float, coulomb_torque: float, stiffness: float) -> Bristle:
    """Bristle at the start of a simulation: wound up to a share of its sliding deflection.

    Parameters   side : -1 to 1, values beyond count as these; 0: sign of the speed, 0 at rest
                 coulomb_torque : [N.m], >= 0;  stiffness : [N.m/rad], >= 0
    """
    if side == 0.0:
        side = math.copysign(1.0, speed) if speed else 0.0
    if not (coulomb_torque > 0.0 and stiffness > 0.0):
        return Bristle(0.0, stiffness)
    return Bristle(min(max(side, -1.0), 1.0) * (coulomb_torque / stiffness), stiffness)


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

    sign: float  # of the torque, -1 to 1; in between near standstill
    power: float  # [W] heat
    bristle: Bristle  # at the end of the step


def regularised_friction(
    coulomb_torque: float, speed: float, step: float | None, regularization_speed: float, before: Bristle
) -> CoulombFriction:
    """Standstill law without presliding.

    Parameters   coulomb_torque : hysteresis and sliding part at these inputs, at motion [N.m], >= 0
                 step : [s]; None or 0: at an instant
                 before : bristle of a law that was switched off: a step unwinds it, its energy is heat
    """
    sign = regularised_sign(speed, regularization_speed)
    power = coulomb_torque * sign * speed
    if not step:
        return CoulombFriction(sign, power, before)
    return CoulombFriction(sign, power + before.energy / step, Bristle())


def bristle_friction(
    coulomb_torque: float, speed: float, step: float | None, before: Bristle, stiffness: float, damping: float
) -> CoulombFriction:
    """Standstill law with presliding.

    Parameters   coulomb_torque, step : as above; an instant leaves the deflection
                 before : bristle at the start of the step
                 stiffness, damping : as in presliding_step; stiffness >= 0, 0 where there is no Coulomb torque
    """
    start = before.at_stiffness(stiffness)
    if not stiffness > 0.0:
        return CoulombFriction(0.0, before.energy / step if step else 0.0, start)
    result = presliding_step(start.deflection, speed, step or 0.0, coulomb_torque, stiffness, damping)
    sign = result.torque / coulomb_torque if coulomb_torque > 0.0 else 0.0
    if step:
        return CoulombFriction(sign, result.heat / step, Bristle(result.deflection, stiffness))
    power = presliding_power(start.deflection, speed, coulomb_torque, stiffness)
    return CoulombFriction(sign, power, start)


def longest_step(stiffness: float, damping: float) -> float:
    """Step from which on explicit coupling does not hold an axis, whatever its inertia [s].

    Rotor (inertia J) and bristle that both step with the values of the last step are stable in the elastic range for
    a < b (1 - b) with a = h^2 stiffness/J and b = h damping/J, that is h stiffness/damping < 1 - h damping/J. For
    h >= damping/stiffness no J fulfils it; below, J > h damping/(1 - h stiffness/damping) does.
    """
    return damping / stiffness


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
                 stiffness : [N.m/rad], > 0; that of the deflection (Bristle.at_stiffness)
                 damping : [N.m.s/rad], >= 0; explicit coupling with an inertia J needs it:
                           stiffness < (damping/step)(1 - step damping/J)
    Returns      PreslidingStep; heat + change of stiffness deflection^2/2 = work of the mean torque of the step
    Validity     the torque is that at the end of the step; it may point along the motion while the bristle
                 springs back. It and the mean torque are limited to the Coulomb torque: at a reversal with
                 1000 rad/s2 the damping alone reached seven times that. The work at the torque of the end is not
                 less than at the mean torque without damping, so that the limited law is passive at both.
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
    # of the mean torque, which is limited to the Coulomb torque like that at the end
    work = min(stiffness * integral + damping * rate * travel, coulomb_torque * travel)
    heat += max(0.0, work - 0.5 * stiffness * (q * q - q_0 * q_0))
    return PreslidingStep(
        direction * q, direction * min(stiffness * q + damping * rate, coulomb_torque), heat
    )
