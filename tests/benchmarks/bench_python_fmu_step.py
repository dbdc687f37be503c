"""Cost of a step of the Python FMU compared with that of an empty pythonfmu slave, measured in one run.

`python tests/benchmarks/bench_python_fmu_step.py` prints the figures.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))  # run as a script
from synthetic_map import make_map

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.python_fmu.package import build_fmu

TARGET = 25e-6  # [s] allowed cost of a step above that of the empty slave
EMPTY = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Empty(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.preload = self.speed = self.temperature = self.axial_load = self.friction_torque = 0.0
        for name in ("preload", "speed", "temperature", "axial_load", "friction_torque"):
            kind = Fmi2Causality.output if name == "friction_torque" else Fmi2Causality.input
            self.register_variable(Real(name, causality=kind))

    def do_step(self, current_time, step_size):
        return True
"""


def empty_fmu(folder: Path) -> Path:
    script = folder / "empty.py"
    script.write_text(EMPTY)
    command = [sys.executable, "-m", "pythonfmu", "build", "-f", str(script), "-d", str(folder)]
    subprocess.run(command, check=True, capture_output=True, cwd=folder)
    return folder / "Empty.fmu"


NAMES = ("preload", "speed", "temperature", "axial_load", "friction_torque")


def seconds_per_step(instance: FmuInstance, steps: int, axial_load: float) -> float:
    """Set the inputs, step, get the torque, as a master does."""
    slave = instance.slave
    references = {v.name: v.valueReference for v in instance.description.modelVariables}
    *inputs, output = (references[name] for name in NAMES)
    begin = time.perf_counter()
    for n in range(steps):
        slave.setReal(inputs, [2000.0, 1.0 + 0.01 * n, 303.15, axial_load])
        slave.doStep(currentCommunicationPoint=1e-3 * n, communicationStepSize=1e-3)
        slave.getReal([output])
    return (time.perf_counter() - begin) / steps


def measure(folder: Path, repeats: int = 25, steps: int = 400) -> dict[str, float]:
    """Least time per step [s] of several rounds, all cases in each round."""
    fmu = build_fmu(make_map(), folder / "BallScrewFriction.fmu").path
    with (
        FmuInstance(empty_fmu(folder)) as empty,
        FmuInstance(fmu) as map_step,
        FmuInstance(fmu, presliding_stiffness=400.0) as stiff,
    ):
        cases = {
            "empty slave": (empty, 0.0), "map": (map_step, 0.0), "map with axial load": (map_step, 800.0),
            "map with set stiffness": (stiff, 0.0),
        }  # fmt: skip
        least = dict.fromkeys(cases, float("inf"))
        for _ in range(repeats):
            for name, (instance, axial_load) in cases.items():
                least[name] = min(least[name], seconds_per_step(instance, steps, axial_load))
    return least


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        figures = measure(Path(scratch))
    for case, seconds in figures.items():
        print(f"{case:22s} {1e6 * seconds:6.1f} us  {1e6 * (seconds - figures['empty slave']):+6.1f} us")
    print(f"target: {1e6 * TARGET:+.0f} us")
