"""One step of BallScrewFriction, and its outputs by name, from the state of the double nut and the standstill law."""

import math
from collections.abc import Sequence
from typing import Any

from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.nut_law import DoubleNutState
from ballscrew_tehl.runtime.standstill import CoulombFriction, Elements, StandstillLaw, standstill_friction


def friction_step(
    nut_map: NutMap,
    nut: DoubleNutState,
    point: Sequence[float],
    law: StandstillLaw,
    step: float | None,
    before: Elements | None,
    heat: float,
) -> tuple[dict[str, Any], CoulombFriction]:
    """Outputs and Coulomb friction at the end of a step [s], None: at an instant.

    nut : state with the seals at the point (packed.POINT, then packed.DEFAULTS)
    before : elements at the start, None: of the simulation;  heat : dissipated before it [J]
    """
    preload, speed, temperature, axial_load, _, net, _, breakaway = point

    def stiffness_of_screw() -> float:
        present = nut_map.presliding_stiffness(preload, axial_load, net, breakaway)
        return present + nut_map.seal_stiffness(nut.seal_torque)

    coulomb = standstill_friction(nut.coulomb_torque, speed, step, before, law, stiffness_of_screw)
    outputs = friction_outputs(nut, speed, coulomb, loads_a=axial_load >= 0.0)
    outputs["range_margin"] = nut_map.range_margin(preload, speed, temperature, axial_load)
    outputs["heat"] = heat + (step or 0.0) * outputs["power_loss"]
    return outputs, coulomb


def friction_outputs(
    nut: DoubleNutState, speed: float, coulomb: CoulombFriction, loads_a: bool
) -> dict[str, Any]:
    """Outputs at a speed [rad/s]: fields of the state under their names, torques with the sign of the motion.

    An output that is a field of DoubleNutState needs no line here. loads_a : whether nut A has the larger force.
    """
    viscous = math.copysign(nut.viscous_torque, speed)
    hysteresis = coulomb.sign * nut.hysteresis_torque
    sliding = coulomb.sign * nut.sliding_torque
    outputs = nut._asdict()
    seal = coulomb.sign * nut.seal_torque
    outputs["friction_torque"] = viscous + hysteresis + sliding + seal
    outputs["viscous_torque"] = viscous
    outputs["hysteresis_torque"] = hysteresis
    outputs["sliding_torque"] = sliding
    relieved = math.copysign(nut.relieved_viscous_torque, speed) + coulomb.sign * nut.relieved_coulomb_torque
    relieved += 0.5 * seal  # each nut has seals
    each = (outputs["friction_torque"] - relieved, relieved)
    outputs["friction_torque_nut_a"], outputs["friction_torque_nut_b"] = each if loads_a else each[::-1]
    outputs["power_loss"] = nut.viscous_torque * abs(speed) + coulomb.power
    return outputs
