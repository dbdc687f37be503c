"""The command export: friction of a map or of a log as a table for a controller or a simulation tool."""

from __future__ import annotations

import math
import re
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...parameters.units import CELSIUS, RPM
from ...runtime.packed import MECHANISTIC
from ...whole_file import whole_file
from ..shared.chosen import Chosen, chosen_of
from ..shared.files import check_output, written
from ..shared.progress import QUIET, progress_bar
from ..shared.quantities import (
    CURRENT_UNIT,
    LEAD,
    PRELOAD,
    RATIO,
    SPEED,
    TEMPERATURE,
    TORQUE_CONSTANT,
    whole_number,
)  # fmt: skip
from ..shared.results import print_results, say

if TYPE_CHECKING:
    from ...exchange.tables import FrictionTable

#: file names by format; speeds of a table, points of a compensation list and the speeds that it is fitted to
KINDS = {"twincat": "a file *.lis, *.txt", "csv": "a file *.csv", "modelica": "a file *.txt", "matlab": "a file *.m",
         "json": "a file *.json"}  # fmt: skip
#: of the table of lists
COLUMNS = ("file", "preload_n", "temperature_c", "entries", "largest_error_nm", "error_bound_nm")
SPEEDS, MOST_POINTS, CURVE = 40, 20, 400
#: texts by path, what is said of each
Files = tuple[dict[Path, str], list[dict[str, Any]]]


def run_export(args: Namespace) -> int:
    """One file, or one for each preload and temperature of a compensation list."""
    output = check_output(
        "--output",
        args.output,
        KINDS[args.format],
        inputs=(args.screw, args.map, args.friction, args.identified),
    )
    if args.format == "matlab" and not re.fullmatch(r"[A-Za-z]\w{0,62}", output.stem):
        raise ValueError(
            f"--output = {output}; allowed: the name of a MATLAB function, letters, digits and _ only"
        )
    whole_number("--points", args.points)
    most = args.points or (MOST_POINTS if args.format == "twincat" else SPEEDS)
    if not 3 <= most <= CURVE:
        raise ValueError(f"--points = {most}; allowed: a whole number, 3 to {CURVE}")
    files, answer = (_of_map if args.identified is None else _of_log)(args, output, most)
    for path, text in files.items():
        with written("--output", path), whole_file(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
        say(f"written: {path}")
    print_results(answer, args.json, args.format == "twincat", columns=COLUMNS)
    return 0


class _Current(NamedTuple):
    """Of a compensation list: current of the motor per torque at the screw [A/(N.m)], unit [A]."""

    per_torque: float
    unit: float


def _current(args: Namespace, constant: float | None = None, ratio: float = 1.0) -> _Current:
    """From the options, or the constant and ratio of a log's drive.

    Raises       ValueError: no torque constant, or one without need
    """
    given, twincat = args.torque_constant_nm_a is not None, args.format == "twincat"
    if (given and not twincat) or (twincat and not given and constant is None):
        needed = "allowed only with" if given else "needed with"
        raise ValueError(f"--torque-constant-nm-a; {needed} --format twincat, whose list is a motor current")
    options = ((TORQUE_CONSTANT, constant or 1.0), (RATIO, ratio), (CURRENT_UNIT, 1e-3))
    constant, ratio, unit = (
        usual
        if getattr(args, quantity.name) is None
        else quantity.checked(quantity.option, getattr(args, quantity.name))
        for quantity, usual in options
    )
    return _Current(1.0 / (constant * ratio), unit)


def _speeds(args: Namespace, low: float, high: float) -> tuple[float, float]:
    """Range of speed [rad/s], a part of the one that there is.

    Raises       ValueError
    """
    if args.speed_rpm is None:
        return low, high
    ends = [SPEED.checked("--speed-rpm", value) * RPM for value in args.speed_rpm]
    if not low * (1.0 - 1e-6) <= ends[0] < ends[1] <= high * (1.0 + 1e-6):
        raise ValueError(
            f"--speed-rpm = {' '.join(args.speed_rpm)}; allowed: a rising range in {low / RPM:.6g} to "
            f"{high / RPM:.6g} r/min"
        )
    return max(ends[0], low), min(ends[1], high)


def _of_map(args: Namespace, output: Path, most: int) -> Files:
    """Texts of the friction of a map, and what is said of them."""
    from ...exchange.tables import curve_speeds, friction_table, speeds_of

    current = _current(args)
    if args.lead_mm is not None:
        raise ValueError("--lead-mm; allowed with --identified, a screw file has its lead")
    chosen = chosen_of(args)
    nut_map = chosen.nut_map(args)
    preload, temperature = _grid(args, chosen)
    low, high = _speeds(args, *nut_map.header["axes"]["speed"][:2])
    speed = curve_speeds(low, high, CURVE) if args.format == "twincat" else speeds_of(low, high, most)
    with progress_bar(QUIET) as progress:
        table = friction_table(
            nut_map, chosen.parameters, chosen.friction_set,
            nut_map.law == MECHANISTIC and args.format != "twincat", speed, preload, temperature, progress,
        )  # fmt: skip
    return _files(args, output, table, most, current)


def _grid(args: Namespace, chosen: Chosen) -> tuple[np.ndarray, np.ndarray]:
    """Preloads [N] and temperatures [K] in rising order; default: as catalogues take them."""
    from ...mechanics import CATALOGUE_SHARE
    from ...physics.rating import dynamic_rating

    usual = float(f"{CATALOGUE_SHARE * dynamic_rating(chosen.parameters.screw):.2g}")
    preloads = [
        PRELOAD._replace(not_zero=True).checked("--preload-n", value) for value in args.preload_n or [usual]
    ]
    reference = chosen.parameters.lubricant.reference_temperature - CELSIUS
    celsius = [TEMPERATURE.checked("--temperature-c", value) for value in args.temperature_c or [reference]]
    return np.unique(np.array(preloads)), np.unique(np.array(celsius)) + CELSIUS


def _files(args: Namespace, output: Path, table: FrictionTable, most: int, current: _Current) -> Files:
    """Texts by path, and what is said of them."""
    from ...exchange import formats
    from ...exchange.piecewise import few_points

    head = {"format": args.format, "screw": table.about["screw"], "friction_set": table.about["friction set"]}
    if args.format != "twincat":
        text = {
            "csv": formats.csv_text, "json": formats.json_text, "modelica": formats.modelica_text,
            "matlab": lambda one: formats.matlab_text(one, output.stem),
        }[args.format](table)  # fmt: skip
        answer = {
            "file": str(output),
            "speeds": len(table.speed),
            "preload_n": table.preload.tolist(),
            "temperature_c": (table.temperature - CELSIUS).tolist(),
        }
        return {output: text}, [head | answer]
    files, answers = {}, []
    for j, preload in enumerate(table.preload):
        for k, kelvin in enumerate(table.temperature):
            # the entry at rest is one of them
            points = few_points(table.speed, table.torque[:, j, k], most - 1)
            where = f"preload {preload:.6g} N, oil {kelvin - CELSIUS:.6g} degC"
            many = len(table.preload) * len(table.temperature) > 1
            name = (
                f"{output.stem}_{preload:.6g}N_{kelvin - CELSIUS:.6g}C{output.suffix}"
                if many
                else output.name
            )
            path = output.with_name(name)
            files[path] = formats.twincat_text(table, table.lead, points, *current, where)
            answers.append(head | {
                "file": str(path), "preload_n": float(preload), "temperature_c": float(kelvin - CELSIUS),
                "entries": len(points.x) + 1, "largest_error_nm": points.error, "error_bound_nm": points.bound,
                "largest_error_share": points.error / float(table.torque[:, j, k].mean()),
            })  # fmt: skip
    return files, answers


def _of_log(args: Namespace, output: Path, most: int) -> Files:
    """Texts of the friction that identify has found, and what is said of them."""
    from ...exchange import axis as formats
    from ...exchange.formats import twincat_text
    from ...exchange.piecewise import Points, few_points

    options = ("screw", "map", "friction", "kinematics", "preload_n", "temperature_c")
    if needless := [name for name in options if getattr(args, name) is not None]:
        raise ValueError(
            f"--{needless[0].replace('_', '-')} with --identified; allowed: with --map, whose friction is then written"
        )
    if args.points and args.format != "twincat":
        raise ValueError(
            "--points with --identified; allowed: with --format twincat, other files have all speeds"
        )
    found = formats.read_identified(args.identified)
    if args.lead_mm is not None:
        found = found._replace(lead=1e-3 * LEAD.checked("--lead-mm", args.lead_mm))
    if args.speed_rpm is not None:
        found = found.between(*_speeds(args, 0.0, math.inf))
    head = {"format": args.format, "file": str(output), "log": found.about["log"]}
    if args.format != "twincat":
        text = {
            "csv": formats.csv_text, "json": formats.json_text, "modelica": formats.modelica_text,
            "matlab": lambda one: formats.matlab_text(one, output.stem),
        }[args.format](found)  # fmt: skip
        _current(args)
        return {output: text}, [head | {"speeds": len(found.friction.speed)}]
    if found.lead is None:
        raise ValueError(
            "--lead-mm (missing); needed with --format twincat, whose list is over the velocity of the axis"
        )
    current, both = _current(args, found.torque_constant, found.ratio), found.mean
    points = Points(both.speed, both.mean, 0.0, 0.0)
    if len(both.speed) >= most:
        points = few_points(both.speed, both.mean, most - 1)
    apart = float(np.max(np.abs(both.difference)))
    where = (
        f"mean of both directions, for a list has none; each differs from it by up to "
        f"{apart * current.per_torque:.3g} A = {apart:.3g} N.m"
    )
    text = twincat_text(found, found.lead, points, *current, where)
    return {output: text}, [head | {
        "entries": len(points.x) + 1, "largest_error_nm": points.error, "error_bound_nm": points.bound,
        "largest_error_share": points.error / float(both.mean.mean()), "direction_difference_nm": apart,
    }]  # fmt: skip
