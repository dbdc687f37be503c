"""Outputs of the FMU BallScrewFriction by name, from the state of the double nut and the standstill law.

Standard library only: this module travels inside the FMU.
"""

import math
from typing import Any

from ballscrew_tehl.runtime.nut_law import DoubleNutState
from ballscrew_tehl.runtime.standstill import CoulombFriction


def friction_outputs(nut: DoubleNutState, speed: float, coulomb: CoulombFriction) -> dict[str, Any]:
    """Outputs at a speed [rad/s]: fields of the state under their names, torques with the sign of the motion.

    An output that is a field of DoubleNutState needs no line here.
    """
    viscous = math.copysign(nut.viscous_torque, speed)
    hysteresis = coulomb.sign * nut.hysteresis_torque
    sliding = coulomb.sign * nut.sliding_torque
    return {
        **nut._asdict(),
        "friction_torque": viscous + hysteresis + sliding,
        "viscous_torque": viscous,
        "hysteresis_torque": hysteresis,
        "sliding_torque": sliding,
        "power_loss": nut.viscous_torque * abs(speed) + coulomb.power,
    }
