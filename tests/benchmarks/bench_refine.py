"""Cost and effect of run-time refinement: start of a process that compiles and of one that does not, first step,
new points, remembered points, and a servo axis over 20 s.

`python tests/benchmarks/bench_refine.py [--seconds 20] [--kinematics published]` prints the figures. The solver of the
FMU is compiled into a cache of its own; that of the user stays as it is.
"""

import argparse
import contextlib
import io
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))  # run as a script
import servo_axis

from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_tehl.friction.sets import FrictionSet
from ballscrew_tehl.friction.torque import double_nut_torque
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import changed, load_parameters
from ballscrew_tehl.parameters.screw import Parameters
from ballscrew_tehl.refinement.direct import DirectFilm
from ballscrew_tehl.refinement.refine import Refinement
from ballscrew_tehl.runtime.evaluate import NutMap

FIRST_STEP, LATER_STEP = 0.3, 0.05  # [s] targets
CACHES = ("XDG_CACHE_HOME", "LOCALAPPDATA", "HOME")
START = """
import json, sys, time
from ballscrew_fmu.checks.replay import FmuInstance

def seconds(call, *arguments, **inputs):
    begun = time.perf_counter()
    found = call(*arguments, **inputs)
    return time.perf_counter() - begun, found

times = {}
times["instantiation"], one = seconds(FmuInstance, sys.argv[1], preload=1500.0, speed=40.0)
times["first refined step"], _ = seconds(one.step, refine=True)
times["step at a new point"], _ = seconds(one.step, speed=60.0, preload=2000.0)
times["the same again"] = min(seconds(one.step)[0] for _ in range(100))
times["second instance"], other = seconds(FmuInstance, sys.argv[1], preload=1500.0, speed=40.0)
times["its first refined step"], _ = seconds(other.step, refine=True)
one.close()
other.close()
print(json.dumps(times))
"""


def seconds(call, *arguments) -> float:
    begun = time.perf_counter()
    call(*arguments)
    return time.perf_counter() - begun


def steps(nut_map: NutMap, points: int = 12) -> dict[str, list[float]]:
    """Times [s] by kind of step, over random operating points without axial load."""
    generator = np.random.default_rng(3)
    found: dict[str, list[float]] = {"first": [], "neighbour": [], "remembered": [], "map": []}
    Refinement(nut_map).prepare()
    for _ in range(points):
        preload = math.exp(generator.uniform(math.log(500.0), math.log(8000.0)))
        speed = math.exp(generator.uniform(math.log(10.0), math.log(300.0)))
        point = (preload, speed, float(generator.uniform(290.0, 315.0)))
        refinement = Refinement(nut_map)
        found["first"].append(seconds(refinement.evaluate, *point))
        found["remembered"].append(min(seconds(refinement.evaluate, *point) for _ in range(100)))
        found["map"].append(min(seconds(nut_map.evaluate, *point) for _ in range(100)))
        found["neighbour"].append(seconds(refinement.evaluate, preload, 1.2 * speed, point[2]))
    return found


def start(folder: str, cache: str) -> dict[str, float]:
    """Times [s] of a new process with an unpacked FMU and a cache folder, in the order of START."""
    environment = os.environ | dict.fromkeys(CACHES, cache)
    command = [sys.executable, "-c", START, folder]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


class RefinedFmu(servo_axis.FrictionFmu):
    """The refined friction of the axis, and the map stepped in parallel."""

    def __init__(self, fmu: Path, axis: servo_axis.Axis, log: io.StringIO) -> None:
        super().__init__(fmu, axis)
        self._log = log
        self._map = servo_axis.FrictionFmu(fmu, axis)
        references = {
            v.name: v.valueReference for v in servo_axis.fmpy.read_model_description(str(fmu)).modelVariables
        }
        self.loading = seconds(self._refine, references["refine"], axis)
        self.seconds: list[float] = []
        self.solving: list[bool] = []
        self.rows: list[tuple[float, ...]] = []  # speed, axial load, refined torque, that of the map

    def _refine(self, reference: int, axis: servo_axis.Axis) -> None:
        self._slave.setBoolean([reference], [True])
        super().advance(axis, 0.0, 0.0)

    def advance(self, axis, speed, axial_load):
        log_end, begun = self._log.tell(), time.perf_counter()
        found = super().advance(axis, speed, axial_load)
        self.seconds.append(time.perf_counter() - begun)
        self.solving.append(self._log.tell() > log_end)
        plain = self._map.advance(axis, speed, axial_load)
        self.rows.append((speed, axial_load, found[0], plain[0]))
        return found

    def __exit__(self, *_):
        self._map.__exit__()
        super().__exit__()


def to_and_fro(axis: servo_axis.Axis, duration: float) -> servo_axis.Motion:
    """Positioning moves back and forth until `duration` [s] has passed."""
    move, _ = servo_axis.positioning(axis)
    back = move._replace(position=move.position[-1] - move.position, velocity=-move.velocity)
    count = round(duration / axis.step)
    runs = [move, back] * (1 + count // (2 * move.time.size))
    columns = [np.concatenate(column)[:count] for column in zip(*(run[1:] for run in runs), strict=True)]
    return servo_axis.Motion(axis.step * np.arange(count), *columns)


def deviations(parameters: Parameters, nut_map: NutMap, rows: np.ndarray, count: int) -> dict[str, float]:
    """Refined torque and map against direct per-ball solves at random steps of a run; rows as RefinedFmu.rows."""
    film = str(nut_map.header["film_model"])
    friction_set = FrictionSet("map", parameters.friction.kinematics, film, *nut_map.defaults[:3])
    model = DirectFilm(parameters, film == "solved_thermal")
    axis = servo_axis.Axis()
    sliding = rows[np.abs(rows[:, 0]) > 2.0]  # there the regularised sign is 1
    chosen = np.random.default_rng(5).choice(len(sliding), count, replace=False)
    errors = []
    for speed, axial_load, refined, looked_up in sliding[chosen].tolist():
        point = (axis.preload, abs(speed), axis.oil_temperature, axial_load)
        direct = double_nut_torque(parameters, friction_set, model, *point).total
        errors.append((abs(refined) / direct - 1.0, abs(looked_up) / direct - 1.0))
    refined, looked_up = np.abs(np.array(errors)).T
    return {
        f"refined torque to direct at {count} steps, largest": float(refined.max()),
        "refined torque to direct, mean": float(refined.mean()),
        "map to direct, largest": float(looked_up.max()),
        "map to direct, mean": float(looked_up.mean()),
    }


def servo(fmu: Path, duration: float) -> tuple[dict[str, float], np.ndarray]:
    """Figures of a refined run of the servo axis, and its rows."""
    axis = servo_axis.Axis()
    log = io.StringIO()  # fmpy prints what the FMU logs, a line for every solve
    with contextlib.redirect_stdout(log), RefinedFmu(fmu, axis, log) as friction:
        begun = time.perf_counter()
        run = servo_axis.simulate(axis, to_and_fro(axis, duration), friction)
        elapsed = time.perf_counter() - begun
    took = np.array(friction.seconds)
    rows = np.array(friction.rows)
    refined, looked_up = rows[:, 2:].T
    moving = np.abs(looked_up) > 0.05 * np.abs(looked_up).max()
    difference = np.abs(refined[moving] / looked_up[moving] - 1.0)
    solving = np.array(friction.solving)
    figures = {
        "steps": took.size,
        "solves": log.getvalue().count(" solved: "),
        "a contact without solution": float(" not solved" in log.getvalue()),
        "steps with solves": int(solving.sum()),
        "steps with solves, second half": int(solving[took.size // 2 :].sum()),
        "loading of the solver [s]": friction.loading,
        "worst step [s]": float(took.max()),
        "mean step with solves [s]": float(took[solving].mean()) if solving.any() else 0.0,
        "median step without [us]": 1e6 * float(np.median(took[~solving])),
        "whole run [s]": elapsed,
        "largest relative torque difference to the map": float(difference.max()),
        "mean relative torque difference": float(difference.mean()),
        "largest torque difference to the map [N m]": float(np.abs(refined - looked_up).max()),
        "in range": float(run.in_range),
    }
    return figures, rows


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=20.0, help="simulated time of the servo axis")
    parser.add_argument("--kinematics", choices=("published", "rolling_frame"), default="published")
    parser.add_argument(
        "--direct", type=int, default=0, help="steps of it that are compared with direct solves"
    )
    options = parser.parse_args()
    parameters = changed(load_parameters(), friction={"kinematics": options.kinematics})
    nut_map = load_map(None, parameters)
    print(f"{options.kinematics} kinematics, film model {nut_map.header['film_model']}")
    print(f"{'step':12s}{'median':>12s}{'largest':>12s}{'target':>10s}   [ms]")
    targets = {"first": FIRST_STEP, "neighbour": LATER_STEP, "remembered": LATER_STEP}
    for name, times in steps(nut_map).items():
        target = f"{1e3 * targets[name]:10.0f}" if name in targets else ""
        print(f"{name:12s}{1e3 * np.median(times):12.3f}{1e3 * max(times):12.3f}{target}")
    with tempfile.TemporaryDirectory() as scratch:
        os.environ |= dict.fromkeys(CACHES, scratch)
        fmu = build_fmu(nut_map, Path(scratch) / "BallScrewFriction.fmu").path
        folder = servo_axis.fmpy.extract(str(fmu), unzipdir=str(Path(scratch) / "unpacked"))
        compiles, loads = start(folder, scratch), start(folder, scratch)
        print(f"\n{'start of a process [s]':32s}{'compiles':>12s}{'does not':>12s}")
        for name, figure in compiles.items():
            print(f"{name:32s}{figure:12.4g}{loads[name]:12.4g}")
        print(f"\nservo axis over {options.seconds:g} s, positioning moves forth and back")
        figures, rows = servo(fmu, options.seconds)
        if options.direct:
            figures |= deviations(parameters, nut_map, rows, options.direct)
        for name, figure in figures.items():
            print(f"{name:48s}{figure:12.4g}")


if __name__ == "__main__":
    main()
