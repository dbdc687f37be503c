"""Friction at and near standstill: a regularised sign, or elasto-slip elements in parallel (presliding); one step of
BallScrewFriction with it.

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

Source: Al-Bender & De Moerlooze, Adv. Tribol. 2008, 214894 (rolling contacts); Al-Bender & Swevers, IEEE Control Syst.
Mag. 28 (2008) 64 (Maxwell-slip); Iwan, J. Appl. Mech. 33 (1966) 893; changed: shares of the Coulomb torque, and damping
of the elements that stick.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ballscrew_tehl.runtime.constants import DAMPING_TIME, ELEMENTS, LEAST_STIFFNESS, STIFFNESS_RATIO
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.nut_law import DoubleNutState

States = tuple[float, ...]  # [rad at 1 N.m/rad] of the elements


class Elements(NamedTuple):
    """The elements between two steps."""

    states: States = (0.0,) * ELEMENTS
    stiffness: float = 0.0  # [N.m/rad] of all elements
    free: bool = True  # none holds a load, or all slide

    @property
    def energy(self) -> float:
        """Stored energy [J]."""
        return 0.5 * sum(y * y for y in self.states)


RELAXED = Elements()  # at rest without load


class StandstillLaw(NamedTuple):
    """Parameters of the friction at standstill, under their names in the FMUs."""

    regularization_speed: float  # [rad/s]
    presliding: bool
    presliding_stiffness: float  # [N.m/rad] 0: from the screw
    presliding_damping: float  # [N.m.s/rad] 0: from the stiffness
    presliding_side: float  # travel from rest at the start over that at which all slides; 0: from the speed


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
    supply: float  # [W] from the motion, mean of the step


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
    return tuple([(2.0 * i + 1.0) * unit for i in range(ELEMENTS)])


def initial_elements(side: float, speed: float, coulomb_torque: float, stiffness: float) -> Elements:
    """Elements after a travel from rest: side, -1 to 1, of that at which all slide; 0: sign of the speed."""
    if side == 0.0:
        side = math.copysign(1.0, speed) if speed else 0.0
    limits = element_limits(coulomb_torque, stiffness)
    travel = min(max(side, -1.0), 1.0) * 2.0 * ELEMENTS * limits[0]
    return _held(tuple(min(max(travel, -m), m) for m in limits), limits, stiffness)


def _held(states: States, limits: States, stiffness: float) -> Elements:
    slide = tuple(map(abs, states)) == limits  # none is beyond
    return Elements(states, stiffness, slide or not any(states))


def regularised_sign(speed: float, regularization_speed: float) -> float:
    """tanh(speed/regularization_speed), both [rad/s]: the sign of the speed, which passes smoothly through zero.

    0 gives the sign itself. It creeps under a load below the Coulomb torque (0.42 of that speed at 0.4 of the torque);
    explicit coupling with an inertia J is free of ripple for steps below 2 J regularization_speed/torque only.
    """
    if regularization_speed <= 0.0:
        return math.copysign(1.0, speed) if speed else 0.0
    return math.tanh(speed / regularization_speed)


def standstill_friction(
    coulomb_torque: float,
    speed: float,
    step: float | None,
    before: Elements | None,
    law: Any,
    stiffness_of_screw: Callable[[], float],
) -> CoulombFriction:
    """Coulomb friction near standstill over a step [s], None or 0: at an instant.

    coulomb_torque: at motion [N.m], >= 0; before: elements at the start, None: of the simulation
    law: StandstillLaw, or more parameters of these names; stiffness_of_screw: [N.m/rad] at the present loads
    """
    if not law.presliding:
        return regularised_friction(coulomb_torque, speed, step, law.regularization_speed, before or RELAXED)
    stiffness = law.presliding_stiffness
    if not stiffness >= LEAST_STIFFNESS:
        stiffness = stiffness_of_screw()
    if before is None:
        before = initial_elements(law.presliding_side, speed, coulomb_torque, stiffness)
    stiffness = held_stiffness(before, stiffness)
    damping = law.presliding_damping or DAMPING_TIME * stiffness
    return presliding_friction(coulomb_torque, speed, step, before, stiffness, damping)


def regularised_friction(
    coulomb_torque: float, speed: float, step: float | None, regularization_speed: float, before: Elements
) -> CoulombFriction:
    """The law without presliding; a step relaxes elements of a law that was switched off, and their energy is heat."""
    sign = regularised_sign(speed, regularization_speed)
    power = coulomb_torque * sign * speed
    if not step:
        return CoulombFriction(sign, power, before, power)
    return CoulombFriction(sign, power + before.energy / step, RELAXED, power)


def presliding_friction(
    coulomb_torque: float,
    speed: float,
    step: float | None,
    before: Elements,
    stiffness: float,
    damping: float,
) -> CoulombFriction:
    """The law with presliding; arguments as presliding_step. An instant leaves the elements."""
    limits = element_limits(coulomb_torque, stiffness)
    result = presliding_step(before.states, speed, step or 0.0, coulomb_torque, stiffness, damping, limits)
    sign = result.torque / coulomb_torque if coulomb_torque > 0.0 else 0.0
    if not step:
        power = presliding_power(before.states, speed, coulomb_torque, stiffness)
        return CoulombFriction(sign, power, before, coulomb_torque * sign * speed)
    power, elements = result.heat / step, _held(result.states, limits, stiffness)
    return CoulombFriction(sign, power, elements, power + (elements.energy - before.energy) / step)


def presliding_power(states: States, speed: float, coulomb_torque: float, stiffness: float) -> float:
    """Heat [W] at an instant of elements that slide, or spring back from above a level that fell; without damping."""
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
    """Elasto-slip elements over one step [s], >= 0, with the speed [rad/s] held: exact, passive for any step size.

    coulomb_torque: of the moment [N.m], >= 0; stiffness: of all elements [N.m/rad], >= 0; limits: element_limits
    damping: of all elements [N.m.s/rad], >= 0, of those that stick their part; explicit coupling with an inertia J
    needs it: stiffness < (damping/step)(1 - step damping/J)

    heat + change of the stored energy = work of the mean torque of the step. Both that and the torque at the end are
    limited to the Coulomb torque, of which damping would be several times at a reversal with 1000 rad/s2. The torque at
    the end works no less than the mean one without damping, so that the limited law is passive at both.
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


def friction_step(
    nut_map: NutMap,
    nut: DoubleNutState,
    point: Sequence[float],
    law: StandstillLaw,
    step: float | None,
    before: Elements | None,
    heat: float,
    range_margin: float,
) -> tuple[dict[str, Any], CoulombFriction]:
    """Outputs and Coulomb friction at the end of a step [s], None: at an instant.

    nut: state with the seals at the point (packed.POINT, the actual preload, then packed.DEFAULTS)
    before: elements at the start, None: of the simulation; heat: dissipated before it [J]
    """
    preload, speed, _, axial_load, _, net, _, breakaway = point

    def stiffness_of_screw() -> float:
        present = nut_map.presliding_stiffness(preload, axial_load, net, breakaway)
        return present + nut_map.seal_stiffness(nut.seal_torque)

    coulomb = standstill_friction(nut.coulomb_torque, speed, step, before, law, stiffness_of_screw)
    outputs = friction_outputs(nut, speed, coulomb, loads_a=axial_load >= 0.0)
    outputs["range_margin"] = range_margin
    outputs["heat"] = heat + (step or 0.0) * outputs["power_loss"]
    return outputs, coulomb


def friction_outputs(
    nut: DoubleNutState, speed: float, coulomb: CoulombFriction, loads_a: bool
) -> dict[str, Any]:
    """Fields of the state under their names, torques with the sign of the motion at a speed [rad/s], and others.

    loads_a: whether nut A has the larger force
    """
    viscous = math.copysign(nut.viscous_torque, speed)
    hysteresis, sliding, seal = (
        coulomb.sign * part for part in (nut.hysteresis_torque, nut.sliding_torque, nut.seal_torque)
    )
    outputs = nut._replace(
        viscous_torque=viscous, hysteresis_torque=hysteresis, sliding_torque=sliding
    )._asdict()
    outputs["friction_torque"] = viscous + hysteresis + sliding + seal
    relieved = math.copysign(nut.relieved_viscous_torque, speed) + coulomb.sign * nut.relieved_coulomb_torque
    relieved += 0.5 * seal  # each nut has seals
    each = (outputs["friction_torque"] - relieved, relieved)
    outputs["friction_torque_nut_a"], outputs["friction_torque_nut_b"] = each if loads_a else each[::-1]
    outputs["power_loss"] = nut.viscous_torque * abs(speed) + coulomb.power
    return outputs
