#!/usr/bin/env python3
"""Build dist/BallScrewFriction.fmu from a screw file and its map, check it in fmpy, and show its torque."""

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
EPILOG = """\
what is done
  1. read the screw file (checked: a wrong key or value is one line and exit code 2)
  2. load the map of this screw; a map of another screw or version is refused
  3. pack map and Python code into an FMI 2.0 co-simulation FMU: same input, same bytes
  4. validate it with fmpy: any finding stops the build
  5. replay a reference input in fmpy and compare every output with the map (1e-9)
  6. print measured torque beside this model, Zhao, Zhou and NSK (for the packaged screw),
     the path and the SHA-256 of the FMU
The FMU appears in the output folder after all checks have passed, or not at all.

examples
  python build_fmu.py                                  the screw GD4008-3 with its packaged map
  python build_fmu.py --kinematics rolling_frame       its other kinematics: films to trust
  python -m ballscrew_tehl map build --screw my.toml --output my_map.nc
  python build_fmu.py --screw my.toml --map my_map.nc --output my_fmus

exit codes: 0 done, 1 a check failed, 2 bad input
"""


class CheckError(RuntimeError):
    """The built FMU fails a check; it is not delivered."""


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
        "--output",
        metavar="FOLDER",
        type=Path,
        default=ROOT / "dist",
        help="where the FMU goes; default: %(default)s",
    )
    return options


def read_inputs(screw: str | None, map_file: str | None, kinematics: str | None) -> tuple[Any, Any]:
    """Parameters and their nut map, whose header carries the start values of the friction parameters.

    Raises       ValueError or OSError: bad input, one line
    """
    from ballscrew_tehl.nut_map.store import load_map
    from ballscrew_tehl.parameters import changed, load_parameters

    parameters = load_parameters(screw)
    if kinematics not in (None, parameters.friction.kinematics):
        parameters = changed(parameters, friction={"kinematics": kinematics})
    return parameters, load_map(map_file, parameters)


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
    from ballscrew_tehl.standstill import regularised_sign

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


def check_replay(fmu: Path, nut_map: Any) -> float:
    """Largest relative difference between the FMU in fmpy and the map over the reference input.

    Raises       CheckError: an output differs by more than AGREEMENT
    """
    from ballscrew_fmu.replay import replay
    from ballscrew_fmu.variables import fmu_variables

    starts = {v.name: v.start or 0.0 for v in fmu_variables(nut_map.header)}
    rows = list(reference_input(nut_map.header))
    worst = 0.0
    for n, (row, outputs) in enumerate(zip(rows, replay(fmu, rows, STEP), strict=True)):
        expected = expected_outputs(nut_map, starts["regularization_speed"], row)
        if outputs.keys() != expected.keys():
            raise CheckError(f"replay: outputs {sorted(outputs)}; expected {sorted(expected)}")
        for name, value in outputs.items():
            difference = abs(value - expected[name]) / max(abs(expected[name]), 1e-300)
            if not difference <= AGREEMENT:
                raise CheckError(f"replay step {n}: {name} = {value!r}; the map says {expected[name]!r}")
            worst = max(worst, difference)
    return worst


def torque_tables(fmu: Path, parameters: Any, nut_map: Any) -> str:
    """Torque of the FMU beside measurement and published models; for another screw beside NSK and Zhou."""
    from ballscrew_fmu.replay import FmuInstance
    from ballscrew_tehl.baselines import nsk_torque, zhou_torque
    from ballscrew_tehl.parameters import load_parameters
    from ballscrew_tehl.validation import table_text, validation_tables

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


def build(parameters: Any, nut_map: Any, folder: Path, advance: Any = lambda text: None) -> tuple[Path, str]:
    """Pack, check and deliver the FMU; returns its path and the text of the tables.

    Raises       CheckError: a check fails, nothing is delivered; OSError: the folder cannot be written
    """
    from fmpy.validation import validate_fmu

    from ballscrew_fmu.description import MODEL_NAME
    from ballscrew_fmu.package import build_fmu

    folder.mkdir(parents=True, exist_ok=True)
    target = folder / f"{MODEL_NAME}.fmu"
    with tempfile.TemporaryDirectory(dir=folder, prefix=".build_") as scratch:
        advance("packing")
        fmu = build_fmu(nut_map, Path(scratch) / target.name).path
        advance("validating with fmpy")
        findings = validate_fmu(str(fmu))
        if findings:
            raise CheckError("fmpy validation: " + " | ".join(findings))
        advance("replaying in fmpy")
        worst = check_replay(fmu, nut_map)
        advance("computing the tables")
        tables = torque_tables(fmu, parameters, nut_map)
        os.replace(fmu, target)
    checks = f"fmpy: no finding; replay against the map: largest difference {worst:.1e} (limit {AGREEMENT:g})"
    return target, f"{tables}\n\n{checks}"


def main(arguments: list[str] | None = None) -> int:
    args = parser().parse_args(arguments)
    try:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        import ballscrew_fmu  # noqa: F401
    except ImportError as error:
        return _complain(f"{error}; install the project first: python -m pip install -e {ROOT}")
    columns = (TextColumn("{task.description:<28}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("reading screw and map", total=5)
        try:
            parameters, nut_map = read_inputs(args.screw, args.map, args.kinematics)
        except (ValueError, OSError) as error:
            return _complain(str(error))
        try:
            path, text = build(
                parameters,
                nut_map,
                args.output,
                lambda text: progress.update(task, description=text, advance=1),
            )
        except OSError as error:
            reason = error.strerror or error
            return _complain(f"--output {args.output}: {reason}; needs a folder that can be written")
        except CheckError as error:
            return _complain(f"check failed, no FMU delivered: {error}", code=1)
    content = path.read_bytes()
    print(text)
    print(f"{path}  {len(content) / 1024:.0f} kB")
    print(f"sha256 {hashlib.sha256(content).hexdigest()}")
    return 0


def _complain(message: str, code: int = 2) -> int:
    print(f"build_fmu.py: {' '.join(message.split())}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
