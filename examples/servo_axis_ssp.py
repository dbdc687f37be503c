#!/usr/bin/env python3
"""The servo axis of servo_axis.py as an SSP archive, run by fmpy, libcosim and ecos, compared with the scripted loop.

    python examples/servo_axis_ssp.py [--fmu dist/BallScrewFrictionNative_fmi2.fmu] [--output dist/servo_axis.ssp]
                                      [--plot servo_axis_ssp.png]

The archive (SSP 1.0) contains the native friction FMU, the axis as a second FMU (ServoAxis.fmu, made by pythonfmu from
the equations of servo_axis.py), their connections with units, and two parameter files: screw.ssv with
preload, temperature and presliding, axis.ssv with the circle. It is checked against the schemas of
the standard and against the FMUs before it is run. fmpy is always installed. libcosim and ecos run it if they are
installed (python -m pip install -e '.[importers]').

Coupling. All three step both FMUs with the values of the last communication point. servo_axis.py steps the friction
first, so that its torque acts one step (125 us) earlier. That is the whole difference: the same script with
`parallel` agrees with all of them to the rounding of their clocks. The effect of the order is of first order in the
step: 26 nm at most, of a quadrant error of 7.5 um. Stable for a < b (1 - b), here 0.0005 < 0.005 (a, b: head of
servo_axis.py).
"""

import ctypes
import sys
import tempfile
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import fmpy
import numpy as np
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd
from fmu_command import Parser, no_fmu, plain
from matplotlib.figure import Figure
from rich.console import Console
from servo_axis import Axis, FrictionFmu, Run, circle, reversal_spike, simulate
from servo_axis_fmu import build_axis_fmu
from ssp_archive import Component, Connection, bound_parameters, findings, write_archive

DIST = Path(__file__).resolve().parents[1] / "dist"
FMU, SSP = DIST / "BallScrewFrictionNative_fmi2.fmu", DIST / "servo_axis.ssp"
RADIUS, FEED, CUTTING_FORCE = 10e-3, 0.02, 300.0  # [m], [m/s], [N]
PARAMETER_SET = "circle"
CONNECTIONS = (
    Connection(("axis", "speed"), ("screw", "speed")),
    Connection(("axis", "axial_load"), ("screw", "axial_load")),
    Connection(("screw", "friction_torque"), ("axis", "friction_torque")),
)
OBSERVED = {  # variable of the system by field of servo_axis.Run
    "error": "axis.error",
    "angle": "axis.angle",
    "speed": "axis.speed",
    "position": "axis.position",
    "velocity": "axis.velocity",
    "motor_torque": "axis.motor_torque",
    "axial_load": "axis.axial_load",
    "friction_torque": "screw.friction_torque",
    "heat_flow": "screw.power_loss",
}
IN_RANGE = "screw.in_range"
STYLES = {
    "fmpy": {"color": "#0072B2", "lw": 3.0},
    "libcosim": {"color": "#D55E00", "lw": 1.8, "ls": "--"},
    "ecos": {"color": "#000000", "lw": 1.4, "ls": ":"},
}
Series = dict[str, np.ndarray]  # OBSERVED and IN_RANGE at the ends of the steps


class MasterError(RuntimeError):
    """A master cannot run the archive; one line."""


def write_ssp(path: Path | str, friction_fmu: Path | str, axis: Axis, stop_time: float) -> Path:
    """The archive.

    ValueError: not the right FMU, an axis that is unstable in these masters, or the archive has findings; OSError:
    cannot be written.
    """
    a, b = axis.coupling
    if not a < b * (1.0 - b):
        raise ValueError(
            f"step = {axis.step} s; masters that step both at once need step^2 s0/J < b (1 - b), b = step s1/J; "
            f"found {a:.3g}, {b * (1.0 - b):.3g}: take a smaller stiffness or step, or more damping"
        )
    screw = {
        "preload": axis.preload,
        "temperature": axis.oil_temperature,
        "presliding_stiffness": axis.presliding_stiffness,
        "presliding_damping": axis.presliding_damping,
    }
    way = {"radius": RADIUS, "feed": FEED, "cutting_force": CUTTING_FORCE}
    shown = [name.split(".") for name in (*OBSERVED.values(), IN_RANGE)]
    with tempfile.TemporaryDirectory(prefix="servo_axis_") as scratch:
        axis_fmu = build_axis_fmu(Path(scratch) / "ServoAxis.fmu", axis, **way)
        components = [
            Component(name, Path(fmu), values, [variable for owner, variable in shown if owner == name])
            for name, fmu, values in (("screw", friction_fmu, screw), ("axis", axis_fmu, way))
        ]
        write_archive(path, "servo_axis", components, CONNECTIONS, stop_time, PARAMETER_SET)
    wrong = findings(path)
    if wrong:
        raise ValueError(f"{path}: {'; '.join(wrong)}")
    return Path(path)


# --- masters ---


def in_fmpy(ssp: Path, step: float, steps: int) -> Series:
    # half a step less, so that rounding does not add one
    result = simulate_ssp(
        str(ssp), stop_time=(steps - 0.5) * step, step_size=step, parameter_set=bound_parameters(ssp)
    )
    return {name: result[name].copy() for name in (*OBSERVED.values(), IN_RANGE)}


def in_libcosim(ssp: Path, step: float, steps: int) -> Series:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.ERROR)
    try:
        execution = CosimExecution.from_ssp_file(str(ssp), round(step * 1e9))  # [ns]
    except AssertionError as error:
        raise MasterError(f"libcosim: {error}") from error
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    places = {name: execution.slave_index_from_instance_name(name) for name in ("screw", "axis")}
    references = _references(ssp)
    target = {owner: [name for name in OBSERVED.values() if name.startswith(f"{owner}.")] for owner in places}
    result: dict[str, list[float]] = {name: [] for name in (*OBSERVED.values(), IN_RANGE)}
    for _ in range(steps):
        if not execution.step():
            raise MasterError("libcosim: a step failed")
        for owner, names in target.items():
            values = observer.last_real_values(places[owner], [references[name] for name in names])
            for name, value in zip(names, values, strict=True):
                result[name].append(value)
        result[IN_RANGE] += observer.last_boolean_values(places["screw"], [references[IN_RANGE]])
    return {name: np.array(values) for name, values in result.items()}


def _references(ssp: Path) -> dict[str, int]:
    """Value references by component and variable."""
    with zipfile.ZipFile(ssp) as archive:
        return {
            f"{component.name}.{variable.name}": variable.valueReference
            for component in read_ssd(str(ssp)).system.elements
            for variable in fmpy.read_model_description(archive.open(component.source)).modelVariables
        }


def in_ecos(ssp: Path, step: float, steps: int) -> Series:
    for library in ("libtbb.so.12", str(Path(sys.prefix) / "lib" / "libtbb.so.12")):  # of the system, of pip
        try:
            ctypes.CDLL(library, ctypes.RTLD_GLOBAL)
            break
        except OSError:
            pass
    from ecospy import EcosLib, EcosSimulation

    EcosLib.set_log_level("warn")
    result: dict[str, list[float]] = {name: [] for name in (*OBSERVED.values(), IN_RANGE)}
    with EcosSimulation(step_size=step, ssp_path=str(ssp)) as simulation:
        if not simulation.init(parameter_set=PARAMETER_SET):
            raise MasterError("ecos: initialization failed")
        for _ in range(steps):
            simulation.step()
            for name in OBSERVED.values():
                result[name].append(simulation.get_real(name.replace(".", "::")))
            result[IN_RANGE].append(simulation.get_bool(IN_RANGE.replace(".", "::")))
        simulation.terminate()
    return {name: np.array(values) for name, values in result.items()}


MASTERS: Mapping[str, Callable[[Path, float, int], Series]] = {
    "fmpy": in_fmpy, "libcosim": in_libcosim, "ecos": in_ecos,
}  # fmt: skip


# --- comparison ---


class Difference(NamedTuple):
    """Of two runs, over the largest value of each variable."""

    worst: float
    variable: str


def difference(series: Series, run: Run) -> Difference:
    """Between a master and a scripted run, whose rows are the starts of the steps."""
    worst = Difference(0.0, "")
    for field, name in OBSERVED.items():
        target = getattr(run, field)
        result = np.abs(series[name][: target.size - 1] - target[1:]).max() / np.abs(target).max()
        if not result <= worst.worst:
            worst = Difference(float(result), name)
    return worst


def main(
    friction_fmu: Path | str = FMU,
    ssp: Path | str = SSP,
    axis: Axis | None = None,
    masters: Sequence[str] = tuple(MASTERS),
) -> dict[str, Any]:
    """Write the archive, run it in all installed masters and the script in both orders.

    ssp: archive to write; masters: names of MASTERS. Returns `series` by master; `missing`: reason by master;
    `sequential`, `parallel`: scripted runs with the friction first and both at once; then numbers by name with unit.
    ValueError, OSError: as write_ssp; MasterError.
    """
    axis, ssp = axis or Axis(), Path(ssp)
    motion, reversal = circle(axis, RADIUS, FEED, CUTTING_FORCE)
    steps = motion.time.size
    ssp.parent.mkdir(parents=True, exist_ok=True)
    with Console(stderr=True).status("writing the archive") as status:
        write_ssp(ssp, friction_fmu, axis, steps * axis.step)
        runs = {}
        for name in ("sequential", "parallel"):
            status.update(f"scripted loop, {name}")
            with FrictionFmu(friction_fmu, axis, presliding=True) as friction:
                runs[name] = simulate(axis, motion, friction, parallel=name == "parallel")
        result: dict[str, Any] = {
            "axis": axis,
            "reversal_s": reversal,
            "ssp": ssp,
            **runs,
            "series": {},
            "missing": {},
        }
        for name in masters:
            status.update(f"the archive in {name}")
            try:
                result["series"][name] = MASTERS[name](ssp, axis.step, steps)
            except (ImportError, OSError) as error:
                result["missing"][name] = (
                    f"{name} does not load here ({error}); python -m pip install -e '.[importers]'"
                )
    for name in ("sequential", "parallel"):
        result[f"spike_um_{name}"] = 1e6 * reversal_spike(runs[name], reversal)
    for name, series in result["series"].items():
        error = runs["sequential"].error
        shift = np.abs(series["axis.error"][:-1] - error[1:])
        result[f"error_difference_nm_{name}"] = 1e9 * float(shift.max())
        spike = runs["parallel"]._replace(error=np.concatenate([[0.0], series["axis.error"][:-1]]))
        result[f"spike_um_{name}"] = 1e6 * reversal_spike(spike, reversal)
        result[f"from_parallel_{name}"] = difference(series, runs["parallel"]).worst
        result[f"in_range_{name}"] = bool(series[IN_RANGE].all())
    return result


def table(result: dict[str, Any]) -> str:
    """The numbers of main(), one line per run."""
    lines = [f"{'':28}{'spike':>10}{'error - friction first':>25}{'all - both at once':>21}"]
    for name in ("sequential", "parallel"):
        text = {"sequential": "script, friction first", "parallel": "script, both at once"}[name]
        lines.append(f"{text:28}{result[f'spike_um_{name}']:7.3f} um")
    for name in result["series"]:
        spike, shift = result[f"spike_um_{name}"], result[f"error_difference_nm_{name}"]
        lines.append(
            f"{f'SSP in {name}':28}{spike:7.3f} um{shift:22.1f} nm{result[f'from_parallel_{name}']:21.1e}"
        )
    return "\n".join(lines)


def plot(result: dict[str, Any], path: Path | str) -> None:
    """Draw the result of main() to a picture file: around the reversal, the error and the effect of the order."""
    run, reversal = result["sequential"], result["reversal_s"]
    near = np.flatnonzero(np.abs(run.motion.time - reversal) <= 0.06)
    time = 1e3 * (run.motion.time[near] - reversal)
    figure = Figure(figsize=(9.0, 8.2), layout="constrained")
    error, change, rounding = figure.subplots(3, 1, sharex=True, height_ratios=(3, 3, 2))
    figure.suptitle("Servo axis as an SSP archive, around the reversal", fontsize=15)
    error.plot(time, 1e6 * run.error[near], color="0.75", lw=6.0, label="script, friction first")
    both = result["parallel"].error[near]
    change.plot(time, 1e9 * (both - run.error[near]), color="0.75", lw=6.0, label="script, both at once")
    for name, series in result["series"].items():
        values, look = series["axis.error"][near - 1], {"label": f"SSP in {name}", **STYLES[name]}
        error.plot(time, 1e6 * values, **look)
        change.plot(time, 1e9 * (values - run.error[near]), **look)
        rounding.plot(time, 1e9 * np.abs(values - both), **look)
    rounding.set_yscale("log")
    error.set(ylabel="following error [\u00b5m]")
    change.set(ylabel="less that of the script,\nfriction first [nm]")
    rounding.set(
        ylabel="from the script, both\nat once [nm]", xlabel="time from the reversal of the reference [ms]"
    )
    plain((error, change, rounding))
    rounding.set_xlim(-60.0, 60.0)
    error.legend(frameon=False, loc="lower left")
    change.legend(frameon=False, loc="upper left")
    figure.savefig(path, dpi=130)


def command_line(arguments: list[str] | None = None) -> int:
    parser = Parser(__file__, __doc__)
    parser.add_argument("--fmu", type=Path, default=FMU, help="the friction FMU; default: %(default)s")
    parser.add_argument("--output", type=Path, default=SSP, help="the archive to write; default: %(default)s")
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="draw the result to this file")
    options = parser.parse_args(arguments)
    if problem := no_fmu(options.fmu):
        return parser.complain(problem)
    try:
        result = main(options.fmu, options.output)
        print(table(result))
        print(f"{options.output}  {options.output.stat().st_size / 1024:.0f} kB, no finding")
        for reason in result["missing"].values():
            print(f"not run: {reason}", file=sys.stderr)
        if options.plot:
            plot(result, options.plot)
            print(options.plot)
    except OSError as error:
        return parser.complain(
            f"{error.filename or options.output}: {error.strerror or error}; needs a path that can be written"
        )
    except (ValueError, MasterError) as error:
        return parser.complain(str(error))
    return 0


if __name__ == "__main__":
    sys.exit(command_line())
