"""Outputs of the FMU BallScrewFriction by name, from the state of the double nut and the standstill law.

Standard library only: this module travels inside the FMU.
"""

import math
from typing import Any

from ballscrew_tehl.runtime.nut_law import DoubleNutState
from ballscrew_tehl.runtime.standstill import CoulombFriction


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
