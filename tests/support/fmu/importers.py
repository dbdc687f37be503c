"""Importers that run the FMUs in tests and in importer_table.py: how each replays, and how each couples.

A replay sets the inputs of row n, steps, and reads the outputs; model exchange reads them at the instant of the
row. A master couples friction and rotor so that both step with the values of the last communication point.
"""

import ctypes
import importlib
import importlib.metadata
import logging
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import fmpy
import numpy as np
from rotor_fmu import REFERENCES as ROTOR

from ballscrew_fmu.checks.replay import FmuInstance, replay
from ballscrew_fmu.checks.replay_fmi3 import Fmu3Instance

STEP = 2.0**-9  # [s]: all communication points are exact, in seconds and in the nanoseconds of libcosim
KINDS = {2: FmuInstance, 3: Fmu3Instance}
Row = dict[str, Any]
Rows = Sequence[Mapping[str, float]]

# --- which tools are there ---


def _load_fmpy() -> None:
    importlib.import_module("fmpy")


def _load_libcosim() -> None:
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level

    log_output_level(CosimLogLevel.ERROR)


def _load_ecos() -> None:
    for library in ("libtbb.so.12", str(Path(sys.prefix) / "lib" / "libtbb.so.12")):  # of the system, of pip
        try:
            ctypes.CDLL(library, ctypes.RTLD_GLOBAL)
            break
        except OSError:
            pass
    from ecospy import EcosLib

    EcosLib.set_log_level("warn")


def _load_toolbox() -> None:
    importlib.import_module("fmu_manipulation_toolbox.assembly")


class Tool(NamedTuple):
    distribution: str
    load: Callable[[], None]


TOOLS = {
    "fmpy": Tool("fmpy", _load_fmpy),
    "libcosim": Tool("libcosimpy", _load_libcosim),
    "ecos": Tool("ecospy", _load_ecos),
    "fmu-manipulation-toolbox": Tool("fmu-manipulation-toolbox", _load_toolbox),
}


def problem(tool: str) -> str | None:
    """Why a tool does not run here; None if it does."""
    try:
        TOOLS[tool].load()
    except (ImportError, OSError) as error:
        return f"{TOOLS[tool].distribution} does not load ({error}); python -m pip install -e '.[importers]'"
    return None


def version(tool: str) -> str:
    try:
        return importlib.metadata.version(TOOLS[tool].distribution)
    except importlib.metadata.PackageNotFoundError:
        return "-"


# --- replays ---


def outputs_of(fmu: Path) -> tuple[list[str], list[str]]:
    """Names of the Real and of the Boolean outputs."""
    variables = [v for v in fmpy.read_model_description(str(fmu)).modelVariables if v.causality == "output"]
    flags = [v.name for v in variables if v.type == "Boolean"]
    return [v.name for v in variables if v.name not in flags], flags


def references_of(fmu: Path) -> dict[str, int]:
    return {v.name: v.valueReference for v in fmpy.read_model_description(str(fmu)).modelVariables}


def in_fmpy_steps(fmu: Path, rows: Rows) -> list[Row]:
    kind = KINDS[int(fmpy.read_model_description(str(fmu)).fmiVersion[0])]
    return replay(fmu, (dict(row) for row in rows), STEP, kind)


def in_simulate_fmu(fmu: Path, rows: Rows, **options: Any) -> np.ndarray:
    """Result of fmpy.simulate_fmu with the rows as samples of its input signals."""
    names = list(rows[0])
    times = STEP * np.arange(len(rows) + 1)
    signals = np.zeros(len(times), dtype=[(name, float) for name in ("time", *names)])
    signals["time"] = times
    for name in names:
        signals[name][:-1] = [row[name] for row in rows]
        signals[name][-1] = signals[name][-2]
    reals, flags = outputs_of(fmu)
    return fmpy.simulate_fmu(
        str(fmu), stop_time=times[-1], output_interval=STEP, input=signals, output=[*reals, *flags], **options
    )


def _rows_of(result: np.ndarray, first: int) -> list[Row]:
    names = [name for name in result.dtype.names if name != "time"]
    return [{name: row[name].item() for name in names} for row in result[first:]]


def in_fmpy_co_simulation(fmu: Path, rows: Rows) -> list[Row]:
    return _rows_of(in_simulate_fmu(fmu, rows, fmi_type="CoSimulation"), 1)


def _in_fmpy_model_exchange(fmu: Path, rows: Rows, solver: str) -> list[Row]:
    result = in_simulate_fmu(
        fmu,
        rows,
        fmi_type="ModelExchange",
        solver=solver,
        step_size=STEP,
        record_events=False,
        start_values={"presliding": False},
    )
    return _rows_of(result, 0)[: len(rows)]


def in_fmpy_cvode(fmu: Path, rows: Rows) -> list[Row]:
    return _in_fmpy_model_exchange(fmu, rows, "CVode")


def in_fmpy_euler(fmu: Path, rows: Rows) -> list[Row]:
    return _in_fmpy_model_exchange(fmu, rows, "Euler")


def in_libcosim(fmu: Path, rows: Rows) -> list[Row]:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(STEP * 1e9)
    slave = execution.add_local_slave(CosimLocalSlave(str(fmu), "friction"))
    observer, manipulator = CosimObserver.create_last_value(), CosimManipulator.create_override()
    assert slave >= 0
    assert execution.add_observer(observer)
    assert execution.add_manipulator(manipulator)
    reference, (reals, flags) = references_of(fmu), outputs_of(fmu)
    results = []
    for row in rows:
        inputs = [reference[name] for name in row]
        assert manipulator.slave_real_values(slave, inputs, [float(value) for value in row.values()])
        assert execution.step(), "libcosim: step failed"
        values = observer.last_real_values(slave, [reference[name] for name in reals])
        booleans = observer.last_boolean_values(slave, [reference[name] for name in flags])
        results.append(dict(zip((*reals, *flags), (*values, *booleans), strict=True)))
    return results


def in_ecos(fmu: Path, rows: Rows) -> list[Row]:
    from ecospy import EcosSimulation, EcosSimulationStructure

    reals, flags = outputs_of(fmu)
    results = []
    with EcosSimulationStructure() as structure:
        structure.add_model("friction", str(fmu))
        with EcosSimulation(structure=structure, step_size=STEP) as simulation:
            simulation.init()
            for row in rows:
                for name, value in row.items():
                    simulation.set_real(f"friction::{name}", float(value))
                simulation.step()
                found = {name: simulation.get_real(f"friction::{name}") for name in reals}
                found |= {name: simulation.get_bool(f"friction::{name}") for name in flags}
                results.append(found)
            simulation.terminate()
    return results


class Replay(NamedTuple):
    tool: str
    way: str
    kind: str  # CS or ME
    versions: tuple[int, ...]  # of FMI
    run: Callable[[Path, Rows], list[Row]]


REPLAYS = (
    Replay("fmpy", "step by step", "CS", (2, 3), in_fmpy_steps),
    Replay("fmpy", "simulate_fmu", "CS", (2, 3), in_fmpy_co_simulation),
    Replay("fmpy", "simulate_fmu, CVode", "ME", (2, 3), in_fmpy_cvode),
    Replay("fmpy", "simulate_fmu, Euler", "ME", (2, 3), in_fmpy_euler),
    Replay("libcosim", "override manipulator", "CS", (2,), in_libcosim),
    Replay("ecos", "fixed-step algorithm", "CS", (2, 3), in_ecos),
)

# --- masters ---


class Coupling(NamedTuple):
    """Friction and rotor from time 0: start values of both, the same steps, a constant motor torque."""

    friction: Mapping[str, float]
    inertia: float  # [kg m2]
    start_speed: float  # [rad/s]
    motor_torque: float  # [N.m]
    steps: int

    def friction_starts(self) -> dict[str, float]:
        return {**self.friction, "speed": self.start_speed}

    def rotor_starts(self, friction_torque: float = 0.0) -> dict[str, float]:
        return {
            "inertia": self.inertia, "start_speed": self.start_speed, "motor_torque": self.motor_torque,
            "friction_torque": friction_torque,
        }  # fmt: skip


OBSERVED = ("friction_torque", "power_loss", "speed", "angle")  # of friction, then of the rotor


class Pair:
    """Friction FMU and rotor FMU of any FMI version in a co-simulation loop of its own; use it in a `with`
    block.

    Parameters   friction_first : sequential master, the rotor steps with the torque of the same step; else
                 both step with the values of the last communication point
    """

    def __init__(
        self, friction: Path | str, rotor: Path | str, coupling: Coupling, friction_first: bool = False
    ):
        self.friction = self._instance(friction, coupling.friction_starts())
        self._torque = self._get(self.friction, "friction_torque")[0]
        self.rotor = self._instance(rotor, coupling.rotor_starts(self._torque))
        self.speed, self.angle = self._get(self.rotor, "speed", "angle")
        self._friction_first = friction_first

    @staticmethod
    def _instance(fmu: Path | str, starts: Mapping[str, float]) -> FmuInstance:
        kind = KINDS[int(fmpy.read_model_description(str(fmu)).fmiVersion[0])]
        return kind(fmu, **starts)

    @staticmethod
    def _get(instance: FmuInstance, *names: str) -> list[float]:
        references = [instance._references[name] for name in names]
        get = instance.slave.getFloat64 if isinstance(instance, Fmu3Instance) else instance.slave.getReal
        return get(references)

    def run(self, steps: int, step: float, motor_torque: float | None = None) -> np.ndarray:
        """OBSERVED at the end of each step, one row per step."""
        if motor_torque is not None:
            self.rotor.set(motor_torque=motor_torque)
        found = np.empty((steps, len(OBSERVED)))
        for n in range(steps):
            assert self.friction.step(step, speed=self.speed)
            before, (self._torque, power) = (
                self._torque,
                self._get(self.friction, "friction_torque", "power_loss"),
            )
            assert self.rotor.step(step, friction_torque=self._torque if self._friction_first else before)
            self.speed, self.angle = self._get(self.rotor, "speed", "angle")
            found[n] = self._torque, power, self.speed, self.angle
        return found

    def __enter__(self) -> "Pair":
        return self

    def __exit__(self, *_: object) -> None:
        self.friction.close()
        self.rotor.close()


def coupled_in_own_loop(friction: Path, rotor: Path, coupling: Coupling, folder: Path) -> np.ndarray:
    with Pair(friction, rotor, coupling) as pair:
        return pair.run(coupling.steps, STEP)


def coupled_in_libcosim(friction: Path, rotor: Path, coupling: Coupling, folder: Path) -> np.ndarray:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(STEP * 1e9)
    reference = references_of(friction)
    slaves = [
        execution.add_local_slave(CosimLocalSlave(str(fmu), name))
        for fmu, name in ((friction, "friction"), (rotor, "rotor"))
    ]
    for slave, known, starts in (
        (slaves[0], reference, coupling.friction_starts()),
        (slaves[1], ROTOR, coupling.rotor_starts()),
    ):
        for name, value in starts.items():
            if name != "friction_torque":  # is connected
                assert execution.real_initial_value(slave, known[name], value)
    torque = reference["friction_torque"]
    assert execution.connect_real_variables(slaves[0], torque, slaves[1], ROTOR["friction_torque"]) == 0
    assert execution.connect_real_variables(slaves[1], ROTOR["speed"], slaves[0], reference["speed"]) == 0
    observer = CosimObserver.create_last_value()
    assert execution.add_observer(observer)
    found = np.empty((coupling.steps, len(OBSERVED)))
    for n in range(coupling.steps):
        assert execution.step(), "libcosim: step failed"
        found[n, :2] = observer.last_real_values(slaves[0], [torque, reference["power_loss"]])
        found[n, 2:] = observer.last_real_values(slaves[1], [ROTOR["speed"], ROTOR["angle"]])
    return found


def coupled_in_ecos(friction: Path, rotor: Path, coupling: Coupling, folder: Path) -> np.ndarray:
    from ecospy import EcosSimulation, EcosSimulationStructure

    starts = {f"friction::{name}": float(value) for name, value in coupling.friction_starts().items()}
    starts |= {f"rotor::{name}": float(value) for name, value in coupling.rotor_starts().items()}
    found = np.empty((coupling.steps, len(OBSERVED)))
    with EcosSimulationStructure() as structure:
        structure.add_model("friction", str(friction))
        structure.add_model("rotor", str(rotor))
        structure.make_real_connection("friction::friction_torque", "rotor::friction_torque")
        structure.make_real_connection("rotor::speed", "friction::speed")
        structure.add_parameter_set("starts", starts)
        with EcosSimulation(structure=structure, step_size=STEP) as simulation:
            assert simulation.init(parameter_set="starts"), "ecos: initialization failed"
            for n in range(coupling.steps):
                simulation.step()
                found[n, :2] = [simulation.get_real(f"friction::{name}") for name in OBSERVED[:2]]
                found[n, 2:] = [simulation.get_real(f"rotor::{name}") for name in OBSERVED[2:]]
            simulation.terminate()
    return found


def container_of(friction: Path, rotor: Path, coupling: Coupling, folder: Path) -> Path:
    """FMU of both, made by the FMU manipulation toolbox; its outputs are OBSERVED."""
    from fmu_manipulation_toolbox.assembly import AssemblyNode

    logging.getLogger("fmu_manipulation_toolbox").setLevel(logging.CRITICAL)
    for fmu in (friction, rotor):
        if fmu.parent != folder:
            (folder / fmu.name).write_bytes(fmu.read_bytes())
    a, b = friction.name, rotor.name
    node = AssemblyNode("container.fmu", STEP, auto_link=False, auto_input=False, auto_output=False)
    node.add_fmu(b)  # first, so that the friction starts with its speed
    node.add_fmu(a)
    node.add_link(a, "friction_torque", b, "friction_torque")
    node.add_link(b, "speed", a, "speed")
    for name, owner in zip(OBSERVED, (a, a, b, b), strict=True):
        node.add_output(owner, name, name)
    for owner, starts in ((a, coupling.friction_starts()), (b, coupling.rotor_starts())):
        for name, value in starts.items():
            if (owner, name) not in ((a, "speed"), (b, "friction_torque")):
                node.add_start_value(owner, name, repr(float(value)))
    node.make_fmu(folder)
    return folder / "container.fmu"


def coupled_in_container(friction: Path, rotor: Path, coupling: Coupling, folder: Path) -> np.ndarray:
    container = container_of(friction, rotor, coupling, folder)
    result = fmpy.simulate_fmu(
        str(container), stop_time=coupling.steps * STEP, output_interval=STEP, output=OBSERVED,
        fmi_type="CoSimulation",
    )  # fmt: skip
    # no argument `logger`: FMPy keeps the address of the last logger for all instances of the process,
    # and calls it after Python has freed it
    return np.array([[row[name] for name in OBSERVED] for row in result[1:]])


class Master(NamedTuple):
    tool: str
    way: str
    versions: tuple[int, ...]  # of FMI
    run: Callable[[Path, Path, Coupling, Path], np.ndarray]  # the last argument is a folder to write to


OWN_LOOP = Master("fmpy", "own Jacobi loop", (2, 3), coupled_in_own_loop)
MASTERS = (
    OWN_LOOP,
    Master("libcosim", "fixed-step algorithm", (2,), coupled_in_libcosim),
    Master("ecos", "fixed-step algorithm", (2, 3), coupled_in_ecos),
    Master("fmu-manipulation-toolbox", "container, parallel, in fmpy", (2, 3), coupled_in_container),
)


# --- checks of the FMU manipulation toolbox ---


def toolbox_findings(fmu: Path) -> list[str]:
    """Errors that its schema check and its semantic check report."""
    from fmu_manipulation_toolbox.checker import OperationGenericCheck, OperationSemanticCheck
    from fmu_manipulation_toolbox.operations import FMU

    errors: list[str] = []
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: errors.append(record.getMessage())  # type: ignore[method-assign]
    logger = logging.getLogger("fmu_manipulation_toolbox")
    logger.addHandler(handler)
    try:
        opened = FMU(str(fmu))
        schema = OperationGenericCheck()
        for check in (schema, OperationSemanticCheck()):
            opened.apply_operation(check)
    finally:
        logger.removeHandler(handler)
    if schema.compliant_with_version is None and not errors:
        errors.append("the schema check did not pass")
    return errors


# --- comparison ---

FULL_SCALE_SHARE = 1e-3  # values below this share of full scale are compared with it


def deviation(found: Sequence[Row], expected: Sequence[Row]) -> float:
    """Largest difference over max(|expected|, 1e-3 of the largest |expected| of that output); infinite for NaN,
    other names or another Boolean."""
    if len(found) != len(expected) or any(a.keys() != b.keys() for a, b in zip(found, expected, strict=True)):
        return float("inf")
    worst = 0.0
    for name in expected[0]:
        got = np.array([row[name] for row in found], dtype=float)
        want = np.array([row[name] for row in expected], dtype=float)
        if isinstance(expected[0][name], bool):
            difference = np.where(got == want, 0.0, np.inf)
        else:
            scale = np.maximum(np.abs(want), FULL_SCALE_SHARE * np.abs(want).max())
            difference = np.abs(got - want) / np.where(scale > 0.0, scale, 1.0)
        if not np.isfinite(difference).all():
            return float("inf")
        worst = float(np.maximum(worst, difference.max()))
    return worst
