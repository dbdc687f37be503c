"""The axis of servo_axis.py without its friction as a pythonfmu slave: friction torque in, speed and axial load out.

One axis of a milled circle from a reversal at time 0. Each communication step is one cycle of the controller, so
that only steps of this length are accepted. servo_axis_fmu.py packs this file under another name.
"""

import json
import math
from dataclasses import fields
from pathlib import Path

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real
from pythonfmu.enums import Fmi2Status
from servo_drive import Axis, Drive, on_circle

from ballscrew_fmu.python_fmu.process_end import reset_at_exit

AXIS_FILE = "axis.json"  # the values of Axis, in the resources
INPUTS = {"friction_torque": ("N.m", "Torque that opposes positive speed")}
PARAMETERS = {
    "radius": ("m", "Radius of the circle"),
    "feed": ("m/s", "Feed along the path"),
    "cutting_force": ("N", "Force of the process along the path, against it"),
}
OUTPUTS = {
    "speed": ("rad/s", "Speed of the screw"),
    "axial_load": ("N", "Of the table on the nut; positive loads the nut at the flange"),
    "angle": ("rad", "Angle of the screw"),
    "position": ("m", "Position of the table"),
    "velocity": ("m/s", "Velocity of the table"),
    "error": ("m", "Reference less position of the table"),
    "motor_torque": ("N.m", "Torque of the motor"),
}
STEP_TOLERANCE = 1e-9  # relative: rounding of importers that count in nanoseconds or add up steps


def communication_step(axis):
    """The only step that is accepted [s]."""
    return axis.step


class ServoAxis(Fmi2Slave):
    """A wrong step or value is rejected with a message and changes nothing."""

    description = (
        "Servo axis on a circle, without friction of its screw: P-PI cascade, current loop, two masses"
    )

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        reset_at_exit(self.resources)
        stored = json.loads((Path(self.resources) / AXIS_FILE).read_text(encoding="utf-8"))
        self._axis = Axis(**{field.name: stored[field.name] for field in fields(Axis)})
        self._drive = Drive(self._axis)
        self._path = {name: stored[name] for name in PARAMETERS}
        self.friction_torque = self.error = 0.0
        for name, start in self._path.items():
            setattr(self, name, start)
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        for name in INPUTS:
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        for name in OUTPUTS:
            self._output(name)
        for name in PARAMETERS:
            self.register_variable(Real(name, **fixed))

    def _output(self, name):
        owner = self if name == "error" else self._drive
        output = Real(name, causality=Fmi2Causality.output, getter=lambda: getattr(owner, name))
        self.register_variable(output)

    def exit_initialization_mode(self):
        self._path = {name: getattr(self, name) for name in PARAMETERS}

    def do_step(self, current_time, step_size):
        cycle = communication_step(self._axis)
        if not abs(step_size / cycle - 1.0) <= STEP_TOLERANCE:
            return self._refuse(f"step size = {step_size} s; needs the cycle of the controller, {cycle} s")
        path, torque = self._path, self.friction_torque
        if not (path["radius"] > 0.0 and path["feed"] > 0.0 and all(map(math.isfinite, path.values()))):
            return self._refuse(f"{path}; needs finite numbers, radius and feed above 0")
        if not math.isfinite(torque):
            return self._refuse(f"friction_torque = {torque} N.m; needs a finite number")
        position, velocity, force = map(float, on_circle(current_time, **path))
        self._drive.advance(position, velocity, force, torque)
        self.error = float(on_circle(current_time + step_size, **path)[0]) - self._drive.position
        return True

    def _refuse(self, reason):
        self.log(f"step discarded: {reason}", Fmi2Status.discard)
        return False
