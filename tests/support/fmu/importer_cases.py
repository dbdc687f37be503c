"""Cases of the importers for test_importers.py and importer_table.py: inputs, expected numbers, checks."""

import atexit
import contextlib
import functools
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from importers import FULL_SCALE_SHARE, OWN_LOOP, Coupling, Master, Pair, Replay, Row, deviation
from importers import STEP as REPLAY_STEP
from rotor_fmu import build_rotor
from synthetic_map import make_map

from ballscrew_fmu.checks.monitor_check import monitor_outputs
from ballscrew_fmu.checks.reference import expected_outputs, presliding_outputs, reference_input
from ballscrew_fmu.models import MODELS
from ballscrew_fmu.native_fmu.package import build_native_fmu, native_file_name
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_tehl.runtime.evaluate import NutMap

MONITOR_AGREEMENT = 1e-9  # of its search for the preload, as in ballscrew_fmu.checks
AGREEMENT = 1e-12  # of a value, or of 1e-3 of full scale: rounding of the C library against that of numpy
MASTER_AGREEMENT = 1e-12
REGULARIZATION_SPEED = 0.1  # [rad/s], start value of the FMUs
ZEROS: tuple[Row, ...] = ({"preload": 0.0, "speed": 0.0, "temperature": 0.0, "axial_load": 0.0},) * 4
SMOOTH = Coupling({"preload": 2000.0, "temperature": 303.15}, 0.05, 20.0, 1.2, 800)  # slides all the time
# from sliding to rest and back into sliding is in the standstill cases below; here it is stopped and held
HELD = Coupling(
    {"preload": 2000.0, "temperature": 303.15, "presliding_stiffness": 400.0, "presliding_damping": 2.0},
    0.01, 20.0, 0.3, 800,
)  # fmt: skip


class Subject(NamedTuple):
    """A friction FMU of the closed-form map, and a rotor and a preload monitor of the same FMI version."""

    friction: Path
    rotor: Path
    native: bool
    monitor: Path


NAMES = {"native FMI 2.0": 2, "native FMI 3.0": 3, "Python FMI 2.0": 2}  # FMI version of each subject


@functools.cache
def subject(name: str) -> Subject:
    """One of NAMES, built once for x86_64 Linux and removed at exit."""
    folder = Path(tempfile.mkdtemp(prefix="ballscrew_importers_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    rotor = build_rotor(folder, NAMES[name])
    if name.startswith("Python"):
        friction, monitor = (build_fmu(make_map(), folder / f"{m.name}.fmu", model=m).path for m in MODELS)
    else:
        friction, monitor = (
            build_native_fmu(
                make_map(),
                NAMES[name],
                folder / native_file_name(NAMES[name], m),
                platforms=("x86_64-linux",),
                model=m,
            ).path
            for m in MODELS
        )
    return Subject(friction, rotor, not name.startswith("Python"), monitor)


def subjects_of(case: Replay | Master) -> list[str]:
    """Names of the subjects that an importer can read."""
    kind = getattr(case, "kind", "CS")
    return [
        name for name, version in NAMES.items()
        if version in case.versions and (kind == "CS" or name.startswith("native"))
    ]  # fmt: skip


def reference(nut_map: NutMap) -> tuple[list[Row], dict[str, list[Row]]]:
    """The reference input of the checks, with standstill and points outside the map, and the expected outputs.

    Of co-simulation with presliding; of model exchange without it, as the bristle is then a matter of the solver.
    """
    rows = list(reference_input(nut_map.header))
    # without a bristle no event gives off heat
    without = [expected_outputs(nut_map, REGULARIZATION_SPEED, row) | {"heat": 0.0} for row in rows]
    return rows, {"CS": presliding_outputs(nut_map, rows, REPLAY_STEP), "ME": without}


def replayed(case: Replay, fmu: Path, rows: Sequence[Row], outputs: Mapping[str, Sequence[Row]]) -> float:
    """Deviation of a replay. fmpy's Euler looks for events before it sets the inputs of the new time, so that
    in_range follows one step late: there it may be that of the row before."""
    found, expected = list(case.run(fmu, rows)), outputs[case.kind]
    if "Euler" in case.way:
        late = [expected[0], *expected[:-1]]
        for row, now, before in zip(found, expected, late, strict=True):
            if row["in_range"] == before["in_range"]:
                row["in_range"] = now["in_range"]
    return deviation(found, expected)


def beside_the_monitor(
    case: Replay, name: str, nut_map: NutMap, rows: Sequence[Row], expected: Sequence[Row]
) -> tuple[float, float]:
    """Deviation of friction and of preload monitor, two different FMUs in one process, stepped in turns."""
    inputs = [
        {"torque": wanted["friction_torque"], **{key: row[key] for key in row if key != "preload"}}
        for row, wanted in zip(rows, expected, strict=True)
    ]
    both = zip(case.run(subject(name).friction, rows), case.run(subject(name).monitor, inputs), strict=True)
    friction, monitor = zip(*both, strict=True)
    return deviation(friction, expected), deviation(monitor, monitor_outputs(nut_map, inputs))


SPECIAL_FOLDER = (
    "a blank, hash#, plus+, umlaut \u00fc"  # no %: ecos 0.7 does not encode it in the URI of the resources
)


@contextlib.contextmanager
def below_special_characters(fmu: Path) -> Iterator[Path]:
    """A copy of the FMU in a folder with this name, where importers unpack as well."""
    kept, kept_default = os.environ.get("TMPDIR"), tempfile.tempdir
    folder = Path(tempfile.mkdtemp()) / SPECIAL_FOLDER
    folder.mkdir()
    try:
        os.environ["TMPDIR"] = tempfile.tempdir = str(folder)
        yield Path(shutil.copy(fmu, folder))
    finally:
        tempfile.tempdir = kept_default
        if kept is None:
            del os.environ["TMPDIR"]
        else:
            os.environ["TMPDIR"] = kept
        shutil.rmtree(folder.parent, ignore_errors=True)


def zero_findings(case: Replay, fmu: Path) -> list[str]:
    """Errors of the outputs while all inputs are 0, the value of unconnected inputs in importers."""
    row: dict[str, Any] = list(case.run(fmu, ZEROS))[-1]
    findings = [f"{name} = {value}" for name, value in row.items() if not np.isfinite(value)]
    findings += [f"{name} = {row[name]}" for name in ("friction_torque", "power_loss") if row[name] != 0.0]
    return findings + ([] if row["in_range"] is False else ["in_range is true"])


def coupled(
    master: Master, friction: Path, rotor: Path, coupling: Coupling, folder: Path
) -> tuple[float, np.ndarray]:
    """Largest difference from the own loop over the largest value of each observed variable, and the run."""
    expected = OWN_LOOP.run(friction, rotor, coupling, folder)
    found = master.run(friction, rotor, coupling, folder)
    return float(np.max(np.abs(found - expected) / np.abs(expected).max(axis=0))), found


def differences(found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Element by element, over max(|expected|, 1e-3 of full scale of the column)."""
    scale = np.maximum(np.abs(expected), FULL_SCALE_SHARE * np.abs(expected).max(axis=0))
    return np.abs(found - expected) / np.where(scale > 0.0, scale, 1.0)


# --- standstill in explicit co-simulation ---

INERTIA = 0.01  # [kg m2]
STEP = 1e-3  # [s]
STIFFNESS = 400.0  # [N.m/rad]
DAMPING = 0.2 * INERTIA / STEP  # [N.m.s/rad], 2: stiffness < (damping/step)(1 - step damping/inertia) = 1600
START_SPEED = 20.0  # [rad/s]
STILL = 1e-9  # [rad/s]: standstill begins where the speed stays below
PRELOAD, TEMPERATURE = 2000.0, 303.15


def coulomb_torque(nut_map: NutMap) -> float:
    state = nut_map.evaluate(preload=PRELOAD, speed=0.0, temperature=TEMPERATURE, axial_load=0.0)
    return float(state.coulomb_torque)


class Stop:
    """Stopped from START_SPEED under half of the Coulomb torque, held for 10 s, nudged by 0.65 of it for a second,
    then moved by 1.1 times it.

    Attributes   run : OBSERVED at each step until the motor torque is raised;  still : standstill [s]
                 drift : largest change of angle in the 10 s after standstill [rad]
                 moved : angle in the last second, under 1.1 times the Coulomb torque [rad]
                 supplied : work of the motor and loss of kinetic energy [J]
                 rotor_residual : energy that the rotor does not account for [J]
                 residual : supplied energy less integral of power_loss and energy of the bristle [J]
                 wound : energy of a bristle that slips [J]
                 nudge_work, nudge_stored, nudge_residual : the same for the nudge alone [J]
    """

    def __init__(self, friction: Path, rotor: Path, coulomb: float, friction_first: bool, step: float = STEP):
        starts = {
            "preload": PRELOAD, "temperature": TEMPERATURE, "presliding_stiffness": STIFFNESS,
            "presliding_damping": DAMPING,
        }  # fmt: skip
        held = 0.5 * coulomb
        steps = round(1.0 / step)
        with Pair(friction, rotor, Coupling(starts, INERTIA, START_SPEED, held, 0), friction_first) as pair:
            first = pair._torque
            self.run = pair.run(11 * steps, step)
            rest = float(self.run[-1, 3])
            nudge = pair.run(steps, step, 0.65 * coulomb)
            self.moved = float(pair.run(steps, step, 1.1 * coulomb)[-1, 3]) - float(nudge[-1, 3])
        torque, power, speed, angle = self.run.T
        moving = int(np.nonzero(np.abs(speed) >= STILL)[0][-1]) + 1
        assert moving + 10 * steps <= len(speed), "no standstill within a second"
        self.still = (moving + 1) * step
        after = angle[moving : moving + 10 * steps + 1]
        self.drift = float(np.abs(after - after[0]).max())
        # torque on the rotor in each step
        felt = torque if friction_first else np.concatenate([[first], torque[:-1]])
        travel = np.diff(angle, prepend=0.0)
        kinetic = 0.5 * INERTIA * (START_SPEED**2 - speed[-1] ** 2)
        self.supplied = kinetic + held * rest
        self.rotor_residual = self.supplied - float(felt @ travel)
        bristle = torque[-1] ** 2 / (2.0 * STIFFNESS)  # at rest all torque is that of the bristle
        self.residual = self.supplied - float(power.sum()) * step - bristle
        self.wound = coulomb**2 / (2.0 * STIFFNESS)
        self.nudge_stored = (nudge[-1, 0] ** 2 - torque[-1] ** 2) / (2.0 * STIFFNESS)
        self.nudge_work = 0.65 * coulomb * (float(nudge[-1, 3]) - rest)
        self.nudge_residual = self.nudge_work - float(nudge[:, 1].sum()) * step - self.nudge_stored
