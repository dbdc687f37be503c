#!/usr/bin/env python3
"""Build the FMUs of a screw from its map - friction and preload monitor, for Python hosts and native - check them in
fmpy, show their torque."""

import argparse
import hashlib
import math
import os
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NoReturn

ROOT = Path(__file__).resolve().parent
STEP = 1e-3  # [s] communication step of the replay
AGREEMENT = 1e-9  # relative, FMU against the map itself
RECOVERY = 1e-6  # relative, preload of the monitor against the one that the torque is made from
EPILOG = """\
what is done
  1. read the screw file (checked: a wrong key or value is one line and exit code 2)
  2. load the map of this screw; a map of another screw or version is refused
  3. pack map and Python code into BallScrewFriction.fmu (torque from preload) and BallScrewPreloadMonitor.fmu
     (preload from torque): FMI 2.0 co-simulation for Python hosts
  4. compile the C runtime for Linux, Windows and macOS with ziglang, and pack it with the map into
     BallScrewFrictionNative_fmi2.fmu and _fmi3.fmu, BallScrewPreloadMonitorNative_fmi2.fmu and _fmi3.fmu:
     co-simulation and model exchange for every host
     (first time: some minutes, for the C libraries of these systems; then about a minute)
  5. validate each with fmpy: any finding stops the build
  6. replay a reference input in fmpy and compare every output with the map (1e-9); the monitors must also
     find the preload again that the torque was made from (1e-6)
  7. print measured torque beside this model, Zhao, Zhou and NSK (for the packaged screw),
     and path, size and SHA-256 of each FMU
Same input, same bytes. The FMUs appear in the output folder after all checks have passed, or not at all.

examples
  python build_fmu.py                                  the screw GD4008-3 with its packaged map
  python build_fmu.py --kinematics rolling_frame       its other kinematics: films to trust
  python build_fmu.py --python-only                    no compiler: the FMUs for Python hosts only
  python -m ballscrew_tehl map build --screw my.toml --output my_map.nc
  python build_fmu.py --screw my.toml --map my_map.nc --output my_fmus
  python -m ballscrew_tehl calibrate measurements.csv --screw my.toml --map my_map.nc --output friction.toml
  python build_fmu.py --screw my.toml --map my_map.nc --friction friction.toml

exit codes: 0 done, 1 a check failed, 2 bad input
"""


class CheckError(RuntimeError):
    """A built FMU fails a check; none is delivered."""


class Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        self.exit(2, f"build_fmu.py: {message} (see --help)\n")


def parser() -> Parser:
    options = Parser(
        prog="build_fmu.py",
        description=__doc__,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    options.add_argument("--screw", metavar="FILE.toml", help="screw file; default: the packaged GD4008-3")
    options.add_argument(
        "--map",
        metavar="FILE",
        help="map file of this screw; default: the packaged map of screw and kinematics",
    )
    options.add_argument(
        "--kinematics",
        choices=("published", "rolling_frame"),
        help="surface speeds: published reproduces the paper, rolling_frame has the trustworthy films; "
        "default: as the screw file says",
    )
    options.add_argument(
        "--friction",
        metavar="FILE.toml",
        help="friction parameters that `calibrate --output` has written for this screw; default: the packaged set that "
        "the screw file selects",
    )
    options.add_argument(
        "--output",
        metavar="FOLDER",
        type=Path,
        default=ROOT / "dist",
        help="where the FMUs go; default: %(default)s",
    )
    options.add_argument(
        "--python-only",
        action="store_true",
        help="build the FMUs for Python hosts only, without the native ones, which need ziglang",
    )
    return options


def read_inputs(
    screw: str | None, map_file: str | None, kinematics: str | None, friction: str | None = None
) -> tuple[Any, Any]:
    """Parameters and their nut map, whose header carries start values and provenance of the friction parameters.

    Raises       ValueError or OSError: bad input, one line
    """
    from ballscrew_tehl.friction.sets import friction_set_of_file
    from ballscrew_tehl.nut_map.file import load_map
    from ballscrew_tehl.parameters.file import changed, load_parameters

    parameters = load_parameters(screw)
    if kinematics not in (None, parameters.friction.kinematics):
        parameters = changed(parameters, friction={"kinematics": kinematics})
    friction_set = None if friction is None else friction_set_of_file(friction, parameters)
    return parameters, load_map(map_file, parameters, friction_set)


def reference_input(header: Mapping[str, Any]) -> Iterator[dict[str, float]]:
    """Runs in both directions through standstill, with loads and temperatures, and visits beyond the map."""
    axes = header["axes"]
    force_hi, fastest = axes["force"][1], axes["speed"][1]
    cold, hot = axes["temperature"][:2]
    steps = 240
    for n in range(steps):
        phase = n / steps
        swing = math.sin(6.0 * math.pi * phase)
        yield {
            "preload": force_hi * (0.02 + 0.5 * phase),
            "speed": 1.05 * fastest * swing**3,
            "temperature": cold + (hot - cold) * (1.1 * phase - 0.05),
            "axial_load": 0.3 * force_hi * math.sin(20.0 * math.pi * phase) if n % 4 else 0.0,
        }


def expected_outputs(nut_map: Any, regularization_speed: float, row: Mapping[str, float]) -> dict[str, float]:
    """What the FMU must answer without presliding, from the map."""
    from ballscrew_tehl.runtime.standstill import regularised_sign

    state = nut_map.evaluate(**row)
    speed = row["speed"]
    sign = regularised_sign(speed, regularization_speed)
    parts = {
        "viscous_torque": math.copysign(state.viscous_torque, speed),
        "hysteresis_torque": sign * state.hysteresis_torque,
        "sliding_torque": sign * state.sliding_torque,
    }
    friction = sum(parts.values())
    outputs = {**state._asdict(), **parts, "friction_torque": friction, "power_loss": friction * speed}
    del outputs["clamped"]
    return outputs


def check_replay(fmu: Path, nut_map: Any, kind: Any = None, model: Any = None) -> float:
    """Largest relative difference between the FMU in fmpy and the map over the reference input.

    Parameters   kind : of instance, as replay; None takes that of FMI 2.0;  model : as reference_results
    Raises       CheckError: an output differs by more than AGREEMENT
    """
    from ballscrew_fmu.checks.replay import FmuInstance, replay

    rows, wanted = reference_results(nut_map, model)
    worst = 0.0
    results = replay(fmu, rows, STEP, kind or FmuInstance)
    for n, (outputs, expected) in enumerate(zip(results, wanted, strict=True)):
        if outputs.keys() != expected.keys():
            raise CheckError(f"replay: outputs {sorted(outputs)}; expected {sorted(expected)}")
        for name, value in outputs.items():
            difference = abs(value - expected[name]) / max(abs(expected[name]), 1e-300)
            if not difference <= AGREEMENT:
                raise CheckError(f"replay step {n}: {name} = {value!r}; the map says {expected[name]!r}")
            worst = max(worst, difference)
    return worst


def reference_results(
    nut_map: Any, model: Any = None
) -> tuple[list[dict[str, float]], list[dict[str, float]]]:
    """Reference input, and what the map gives for it with the start values of the parameters.

    Parameters   model : of ballscrew_fmu.models; None takes FRICTION
    Raises       CheckError: the monitor does not find the preload that its reference torque is made from
    """
    from ballscrew_fmu.checks.monitor_check import lost_preload, monitor_outputs
    from ballscrew_fmu.models import FRICTION, MONITOR

    starts = {v.name: v.start or 0.0 for v in FRICTION.variables(nut_map.header)}
    rows = list(reference_input(nut_map.header))
    results = [expected_outputs(nut_map, starts["regularization_speed"], row) for row in rows]
    if model is not MONITOR:
        return rows, results
    inputs = [
        {"torque": result["friction_torque"]}
        | {name: row[name] for name in ("speed", "temperature", "axial_load")}
        for row, result in zip(rows, results, strict=True)
    ]
    outputs = monitor_outputs(nut_map, inputs)
    lost = lost_preload([row["preload"] for row in rows], outputs)
    if not lost <= RECOVERY:
        raise CheckError(f"preload from torque is off by {lost:.1e}, relative; allowed {RECOVERY:g}")
    return inputs, outputs


def torque_tables(fmu: Path, parameters: Any, nut_map: Any) -> str:
    """Torque of the FMU beside measurement and published models; for another screw beside NSK and Zhou."""
    from ballscrew_fmu.checks.replay import FmuInstance
    from ballscrew_tehl.friction.baselines import nsk_torque, zhou_torque
    from ballscrew_tehl.parameters.file import load_parameters
    from ballscrew_tehl.validation.tables import table_text, validation_tables

    with FmuInstance(fmu) as instance:

        def torque(preload: float, speed: float, temperature: float) -> float:
            if not instance.step(STEP, preload=preload, speed=speed, temperature=temperature):
                raise CheckError(f"the FMU discards a step: {instance.messages[-1][1]}")
            return instance.get("friction_torque")

        screw, (lowest, highest) = parameters.screw, nut_map.header["axes"]["force"][:2]
        if screw == load_parameters().screw:
            tables = validation_tables(torque, preload_range=(lowest, highest))
            return "\n\n".join(table_text(table) for table in tables)
        lines = ["No measurement of this screw is packaged. Torque [N.m] at 303.15 K"]
        lines.append(" preload     r/min  this model   Zhou      NSK")
        for preload in (0.05 * highest, 0.1 * highest, 0.2 * highest, 0.4 * highest):
            for rpm in (100.0, 1000.0):
                ours = torque(preload, rpm * math.pi / 30.0, 303.15)
                values = (ours, float(zhou_torque(screw, preload)), float(nsk_torque(screw, preload)))
                lines.append(f"{preload:8.0f} N{rpm:8.0f}" + "".join(f"{value:10.4f}" for value in values))
        return "\n".join(lines)


def check(fmu: Path, nut_map: Any, kind: Any = None, model: Any = None) -> str:
    """Validation and replay of one FMU; returns the line that says so.

    Raises       CheckError
    """
    from fmpy.validation import validate_fmu

    findings = validate_fmu(str(fmu))
    if findings:
        raise CheckError(f"fmpy validation of {fmu.name}: {' | '.join(findings)}")
    try:
        worst = check_replay(fmu, nut_map, kind, model)
    except CheckError as error:
        raise CheckError(f"{fmu.name}: {error}") from error
    return f"fmpy: no finding; replay against the map: largest difference {worst:.1e} (limit {AGREEMENT:g})"


def recovered_preload(fmu: Path, parameters: Any, kind: Any = None) -> str:
    """How far the preload of a monitor is off Table 3, as the end of its line; nothing for another screw.

    Raises       CheckError: a torque of the table is beyond what the map gives
    """
    from ballscrew_fmu.checks.monitor_check import table3
    from ballscrew_fmu.checks.replay import FmuInstance
    from ballscrew_tehl.parameters.file import load_parameters
    from ballscrew_tehl.validation.tables import mean_deviations

    if parameters.screw != load_parameters().screw:
        return ""
    with (kind or FmuInstance)(fmu) as instance:
        try:
            deviation = mean_deviations(table3(instance))[0]
        except RuntimeError as error:
            raise CheckError(f"{fmu.name}: {error}") from error
    return f"; preload of Table 3: {100.0 * deviation:.2f} % off on average"


def build_native(
    parameters: Any, nut_map: Any, folder: Path, advance: Any, model: Any
) -> list[tuple[Path, str]]:
    """The native FMUs of a model in a folder, each with the line about its checks.

    Raises       CheckError; BuildError or SourceError: they cannot be compiled
    """
    from ballscrew_fmu.checks.replay import FmuInstance
    from ballscrew_fmu.checks.replay_fmi3 import Fmu3Instance
    from ballscrew_fmu.models import MONITOR
    from ballscrew_fmu.native_fmu.compile import PLATFORMS
    from ballscrew_fmu.native_fmu.package import Reference, build_native_fmu, native_file_name
    from ballscrew_fmu.pages.validation import validation_report

    reference = Reference(STEP, *reference_results(nut_map, model))
    report = validation_report(parameters, nut_map)
    built = []
    for version, kind in ((2, FmuInstance), (3, Fmu3Instance)):
        target = folder / native_file_name(version, model)
        advance(f"compiling {model.name}, FMI {version}")
        platforms = tuple(PLATFORMS)
        fmu = build_native_fmu(nut_map, version, target, reference, report, platforms, model=model).path
        advance(f"checking {model.name}, FMI {version}")
        line = check(fmu, nut_map, kind, model)
        built.append((fmu, line + (recovered_preload(fmu, parameters, kind) if model is MONITOR else "")))
    return built


def build(
    parameters: Any, nut_map: Any, folder: Path, advance: Any = lambda text: None, python_only: bool = False
) -> tuple[list[Path], str]:
    """Pack, check and deliver the FMUs; returns their paths and the text of tables and checks.

    Raises       CheckError, BuildError, SourceError: nothing is delivered; OSError: the folder cannot be written
    """
    from ballscrew_fmu.models import FRICTION, MODELS, MONITOR
    from ballscrew_fmu.python_fmu.package import build_fmu

    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder, prefix=".build_") as scratch:
        built, text = [], ""
        for model in MODELS:
            advance(f"packing {model.name}")
            fmu = build_fmu(nut_map, Path(scratch) / f"{model.name}.fmu", model=model).path
            advance(f"checking {model.name}")
            line = check(fmu, nut_map, model=model)
            built.append((fmu, line + (recovered_preload(fmu, parameters) if model is MONITOR else "")))
            if model is FRICTION:
                text = torque_tables(fmu, parameters, nut_map)
        for model in () if python_only else MODELS:
            built += build_native(parameters, nut_map, Path(scratch), advance, model)
        text += "\n\n" + "\n".join(f"{made.name}: {line}" for made, line in built)
        for made, _ in built:
            os.replace(made, folder / made.name)
    return [folder / made.name for made, _ in built], text


def main(arguments: list[str] | None = None) -> int:
    args = parser().parse_args(arguments)
    try:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        from ballscrew_fmu.native_fmu.compile import BuildError
        from ballscrew_fmu.native_fmu.sources import SourceError
    except ImportError as error:
        return _complain(f"{error}; install the project first: python -m pip install -e {ROOT}")
    columns = (TextColumn("{task.description:<40}"), BarColumn(24), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("reading screw and map", total=5 if args.python_only else 13)
        try:
            parameters, nut_map = read_inputs(args.screw, args.map, args.kinematics, args.friction)
        except (ValueError, OSError) as error:
            return _complain(str(error))
        try:
            paths, text = build(
                parameters,
                nut_map,
                args.output,
                lambda text: progress.update(task, description=text, advance=1),
                args.python_only,
            )
        except OSError as error:
            reason = error.strerror or error
            return _complain(f"--output {args.output}: {reason}; needs a folder that can be written")
        except CheckError as error:
            return _complain(f"check failed, no FMU delivered: {error}", code=1)
        except (BuildError, SourceError) as error:
            return _complain(f"no FMU delivered: {error}", code=1)
    print(text)
    if told := nut_map.header.get("friction"):
        print(f"friction: {told['set']}, {told['loss'] or 'not fitted'}; {told['provenance']}")
    for path in paths:
        content = path.read_bytes()
        print(f"{path}  {len(content) / 1024:.0f} kB\nsha256 {hashlib.sha256(content).hexdigest()}")
    return 0


def _complain(message: str, code: int = 2) -> int:
    print(f"build_fmu.py: {' '.join(message.split())}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
