"""Friction at and near standstill: a regularised sign, or elasto-slip elements in parallel (presliding).

Rolling contacts remember the reversals of their motion (nonlocal memory). ELEMENTS springs, each with a slider in
series, have this memory: all have the same stiffness K/ELEMENTS, and the yield travels are spread evenly,
x_i = x_m (i + 1/2)/ELEMENTS with x_m = 2 Tc/K, so that their torques at yield add up to the Coulomb torque Tc. The
curve from rest is the parabola Tc (1 - (1 - x/x_m)^2) in straight pieces, every inner loop closes, and a loop loses
energy with the cube of its amplitude.

The state of an element is its deflection times the root of its stiffness [rad at 1 N.m/rad], half its square is its
energy [J]. A Coulomb torque that decreases takes the energy above it as heat, one that increases leaves the elements
where they are. The stiffness follows preload and axial load at the same energy: at constant deflection a rising
stiffness would supply energy. It does so where no element holds a load or all slide, and where it has become
STIFFNESS_RATIO times as high or as low. It stays meanwhile: if it followed a preload that swings, an axis would creep
under load.

Plain floats and `math` only: this module travels inside the FMU.
Source: Al-Bender & De Moerlooze, Adv. Tribol. 2008, 214894 (rolling contacts); Al-Bender & Swevers, IEEE Control Syst.
Mag. 28 (2008) 64 (Maxwell-slip); Iwan, J. Appl. Mech. 33 (1966) 893; changed: shares of the Coulomb torque, and damping
of the elements that stick.
"""

import math
from typing import NamedTuple

from ballscrew_tehl.runtime.constants import ELEMENTS, STIFFNESS_RATIO

States = tuple[float, ...]  # [rad at 1 N.m/rad] of the elements


_WEIGHTS = tuple(2.0 * i + 1.0 for i in range(ELEMENTS))  # yield travels spread evenly


class Elements(NamedTuple):
    """The elements between two steps."""

    states: States = (0.0,) * ELEMENTS
    stiffness: float = 0.0  # [N.m/rad] of all elements
    free: bool = True  # none holds a load, or all slide

    @property
    def energy(self) -> float:
        """Stored energy [J]."""
        return 0.5 * sum(y * y for y in self.states)


#: at rest without load
RELAXED = Elements()


class PreslidingStep(NamedTuple):
    """State and torque at the end of a step, and the heat of the step."""

    states: States
    torque: float  # [N.m], signed like the speed that loads the elements; never beyond the Coulomb torque
    heat: float  # [J], >= 0


class CoulombFriction(NamedTuple):
    """What the Coulomb torque becomes near standstill."""

    sign: float  # of the torque, -1 to 1; in between near standstill
    power: float  # [W] heat
    elements: Elements  # at the end of the step


def held_stiffness(before: Elements, present: float) -> float:
    """Stiffness of the elements where that of the loads is `present`, both [N.m/rad] (head of this module)."""
    held = before.stiffness
    kept = held <= STIFFNESS_RATIO * present and present <= STIFFNESS_RATIO * held
    return held if kept and not before.free else present


def element_limits(coulomb_torque: float, stiffness: float) -> States:
    """States at which the elements slide [rad at 1 N.m/rad]; 0 without torque [N.m] or stiffness [N.m/rad]."""
    if not (coulomb_torque > 0.0 and stiffness > 0.0):
        return RELAXED.states
    unit = coulomb_torque / (ELEMENTS**2 * math.sqrt(stiffness / ELEMENTS))
    return tuple([weight * unit for weight in _WEIGHTS])


def initial_elements(side: float, speed: float, coulomb_torque: float, stiffness: float) -> Elements:
    """Elements at the start of a simulation: after a travel from rest without load.

    side : share of the travel at which all slide, -1 to 1, values beyond count as these; 0: sign of the speed
    """
    if side == 0.0:
        side = math.copysign(1.0, speed) if speed else 0.0
    limits = element_limits(coulomb_torque, stiffness)
    travel = min(max(side, -1.0), 1.0) * 2.0 * ELEMENTS * limits[0]
    return _held(tuple(min(max(travel, -m), m) for m in limits), limits, stiffness)


def _held(states: States, limits: States, stiffness: float) -> Elements:
    slide = tuple(map(abs, states)) == limits  # none is beyond
    return Elements(states, stiffness, slide or not any(states))


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


def regularised_friction(
    coulomb_torque: float, speed: float, step: float | None, regularization_speed: float, before: Elements
) -> CoulombFriction:
    """Standstill law without presliding, over a step [s], None or 0: at an instant.

    coulomb_torque : at motion [N.m], >= 0;  before : elements of a law that was switched off: a step relaxes them, and
    their energy is heat
    """
    sign = regularised_sign(speed, regularization_speed)
    power = coulomb_torque * sign * speed
    if not step:
        return CoulombFriction(sign, power, before)
    return CoulombFriction(sign, power + before.energy / step, RELAXED)


def presliding_friction(
    coulomb_torque: float,
    speed: float,
    step: float | None,
    before: Elements,
    stiffness: float,
    damping: float,
) -> CoulombFriction:
    """Standstill law with presliding; arguments as above and as presliding_step. An instant leaves the elements."""
    limits = element_limits(coulomb_torque, stiffness)
    result = presliding_step(before.states, speed, step or 0.0, coulomb_torque, stiffness, damping, limits)
    sign = result.torque / coulomb_torque if coulomb_torque > 0.0 else 0.0
    if step:
        return CoulombFriction(sign, result.heat / step, _held(result.states, limits, stiffness))
    return CoulombFriction(sign, presliding_power(before.states, speed, coulomb_torque, stiffness), before)


def longest_step(stiffness: float, damping: float) -> float:
    """Step from which on explicit coupling does not hold an axis, whatever its inertia [s].

    Rotor (inertia J) and elements that both step with the values of the last step are stable in the elastic range for
    a < b (1 - b) with a = h^2 stiffness/J and b = h damping/J, that is h stiffness/damping < 1 - h damping/J. For
    h >= damping/stiffness no J fulfils it; below, J > h damping/(1 - h stiffness/damping) does.
    """
    return damping / stiffness


def presliding_power(states: States, speed: float, coulomb_torque: float, stiffness: float) -> float:
    """Heat per time [W] of the elements at an instant, without damping; arguments as presliding_step.

    Of the elements that slide, and of those above a level that has decreased while they spring back.
    """
    direction, power = math.copysign(1.0, speed), 0.0
    for y, m in zip(states, element_limits(coulomb_torque, stiffness), strict=True):
        loaded = direction * y
        power += m if loaded >= m else max(loaded, -m) - loaded
    return power * math.sqrt(stiffness / ELEMENTS) * abs(speed)


def presliding_step(
    before: States,
    speed: float,
    step: float,
    coulomb_torque: float,
    stiffness: float,
    damping: float,
    limits: States,
) -> PreslidingStep:
    """Elasto-slip elements over one step with the speed held: exact, passive for any step size.

    Parameters   before : states at the start of the step;  speed : [rad/s];  step : [s], >= 0; 0 leaves the elements
                 coulomb_torque : of the moment [N.m], >= 0;  stiffness : of all elements [N.m/rad], >= 0
                 damping : of all elements [N.m.s/rad], >= 0, of those that stick their share; explicit coupling
                           with an inertia J needs it: stiffness < (damping/step)(1 - step damping/J)
                 limits : element_limits of this torque and stiffness
    Returns      PreslidingStep; heat + change of the stored energy = work of the mean torque of the step
    Validity     the torque is that at the end of the step; it may point along the motion while the elements spring
                 back. It and the mean torque are limited to the Coulomb torque: at a reversal with 1000 rad/s2 the
                 damping alone would reach several times that. The work at the torque of the end is not less than at
                 the mean torque without damping, so that the limited law is passive at both.
    """
    root = math.sqrt(stiffness / ELEMENTS)
    direction, travel = math.copysign(1.0, speed), abs(speed) * step
    way = direction * root * travel
    end, lost, slid, stored, moved = [], 0.0, 0.0, 0.0, 0.0
    for y, m in zip(before, limits, strict=True):
        start = -m if y < -m else m if y > m else y
        after = start + way
        after = -m if after < -m else m if after > m else after
        change = after - start
        lost += (y - start) * (y + start)  # above a level that has decreased
        slid += m * (abs(way) - abs(change))
        stored += change * (after + start)
        moved += change
        end.append(after)
    if step <= 0.0:
        return PreslidingStep(before, root * sum(end), 0.0)
    slid, stored = max(0.0, slid), 0.5 * stored  # rounding
    damped = damping * abs(moved) / (root * ELEMENTS * step) if root > 0.0 else 0.0
    # of the mean torque, which is limited to the Coulomb torque like that at the end
    work = min(slid + stored + damped * travel, coulomb_torque * travel)
    torque = min(direction * root * sum(end) + damped, coulomb_torque)
    return PreslidingStep(tuple(end), direction * torque, 0.5 * lost + max(work - stored, slid))
