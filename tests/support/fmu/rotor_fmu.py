"""A rotor as an FMU of pythonfmu, to couple the friction FMUs with in real importers."""

import platform
import subprocess
import sys
from pathlib import Path

RUNS_HERE = sys.platform == "linux" and platform.machine() == "x86_64"
SCRIPT = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

VARIABLES = {"motor_torque": "input", "friction_torque": "input", "speed": "output", "angle": "output",
             "inertia": "parameter", "start_speed": "parameter"}


class Rotor(Fmi2Slave):
    # J dw/dt = motor_torque - friction_torque, exactly with the torques held over the step
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        for name, causality in VARIABLES.items():
            setattr(self, name, 0.0)
            fixed = Fmi2Variability.fixed if causality == "parameter" else Fmi2Variability.continuous
            setter = {"setter": self._start} if name == "start_speed" else {}
            self.register_variable(Real(name, causality=Fmi2Causality[causality], variability=fixed, **setter))

    def _start(self, speed):
        self.start_speed = self.speed = speed  # also before the end of initialization

    def do_step(self, time, step):
        rate = (self.motor_torque - self.friction_torque) / self.inertia
        self.angle += step * (self.speed + 0.5 * step * rate)
        self.speed += step * rate
        return True
"""


def build_rotor(folder: Path) -> Path:
    """Rotor.fmu, FMI 2.0."""
    (folder / "rotor.py").write_text(SCRIPT)
    command = [sys.executable, "-m", "pythonfmu", "build", "-f", "rotor.py", "--no-external-tool"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return folder / "Rotor.fmu"
