"""The command export: friction of a map or of a log as a table for a controller or a simulation tool."""

import math
import re
from argparse import Namespace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ballscrew_tehl.applications.export.formats import FORMATS, point_text, twincat_text
from ballscrew_tehl.applications.export.friction_table import (
    Array,
    FrictionTable,
    curve_speeds,
    friction_table,
    read_identified,
)
from ballscrew_tehl.applications.export.piecewise import Points, few_points, weighted_points
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.rating import catalogue_preload
from ballscrew_tehl.runtime.packed import Law

from ..shared.inputs import Chosen, chosen_of
from ..shared.output import Answer, check_output, write_text

#: file names by format
KINDS = {"twincat": "a file *.lis, *.txt", "csv": "a file *.csv", "modelica": "a file *.txt", "matlab": "a file *.m",
         "json": "a file *.json"}  # fmt: skip
#: of the table of lists
COLUMNS = ("file", "preload_n", "temperature_c", "entries", "largest_error_nm", "error_bound_nm")
#: speeds of a table, points of a compensation list and the speeds that it is fitted to
SPEEDS, MAX_POINTS, CURVE = 40, 20, 400
#: least standard error of a bin over the largest friction: fits of some logs have none
MIN_ERROR = 1e-6


class _List(NamedTuple):
    """Curve of a compensation list."""

    suffix: str  # end of its file's name
    where: str  # what it is of
    speed: Array  # [rad/s]
    torque: Array  # [N.m]
    about: dict[str, float]  # keys of its answer
    errors: Array | None = None  # standard errors of a log's bins [N.m]


class _Export(NamedTuple):
    """Table, or curves of the lists with lead [m] and current of the motor; answer: keys of all files."""

    table: FrictionTable
    lists: list[_List]
    lead: float | None
    current: tuple[float, float]  # per torque at the screw [A/(N.m)], unit [A]
    answer: dict[str, Any]


def run_export(args: Namespace) -> Answer:
    """One file, or one for each preload and temperature of a compensation list."""
    inputs = args.screw, args.map, args.friction, args.identified
    output = check_output("--output", args.output, KINDS[args.format], inputs=inputs)
    if args.format == "matlab" and not re.fullmatch(r"[A-Za-z]\w{0,62}", output.stem):
        raise ValueError(
            f"--output = {output}; allowed: the name of a MATLAB function, letters, digits and _ only"
        )
    twincat = args.format == "twincat"
    points = (MAX_POINTS if twincat else SPEEDS) if args.points is None else args.points
    export = (_of_map if args.identified is None else _of_log)(args, points)
    table = export.table
    if twincat:
        files, answers = _lists(output, export, points)
    else:
        files = {output: FORMATS[args.format](table, output.stem)}
        answers = [{"file": str(output), "speeds": len(table.speed)}]
        if table.preload.size:
            celsius = (table.temperature - CELSIUS).tolist()
            answers[0] |= {"preload_n": table.preload.tolist(), "temperature_c": celsius}
    for path, text in files.items():
        write_text("--output", path, text)
    answers = [{"format": args.format, **export.answer, **answer} for answer in answers]
    return Answer(answers, twincat, columns=COLUMNS)


def _lists(output: Path, export: _Export, max_points: int) -> tuple[dict[Path, str], list[dict[str, Any]]]:
    """Texts of compensation lists by path, and keys of their answers."""
    if export.lead is None:
        raise ValueError("--lead-mm (missing); needed with --format twincat, a list over the axis velocity")
    files, answers = {}, []
    for curve in export.lists:
        # the entry at rest is one of them
        points = Points(curve.speed, curve.torque, 0.0, 0.0)
        if curve.errors is not None:
            points = weighted_points(curve.speed, curve.torque, curve.errors, max_points - 1)
        elif len(curve.speed) >= max_points:
            points = few_points(curve.speed, curve.torque, max_points - 1)
        path = output.with_name(f"{output.stem}{curve.suffix}{output.suffix}")
        files[path] = twincat_text(export.table, export.lead, points, *export.current, curve.where)
        answers.append({
            "file": str(path), **curve.about, "entries": len(points.x) + 1, "largest_error_nm": points.error,
            "error_bound_nm": points.bound, "largest_error_share": points.error / float(curve.torque.mean()),
        })  # fmt: skip
    return files, answers


def _current(args: Namespace, constant: float | None = None, ratio: float = 1.0) -> tuple[float, float]:
    """Current per torque at the screw [A/(N.m)] and its unit [A], from the options or a log's drive.

    ValueError: no torque constant, or one without need
    """
    given, twincat = args.torque_constant_nm_a is not None, args.format == "twincat"
    if (given and not twincat) or (twincat and not given and constant is None):
        needed = "allowed only with" if given else "needed with"
        raise ValueError(f"--torque-constant-nm-a; {needed} --format twincat, whose list is a motor current")
    constant = args.torque_constant_nm_a or constant or 1.0
    return 1.0 / (constant * (args.ratio or ratio)), args.current_unit_a or 1e-3


def _speeds(args: Namespace, low: float, high: float) -> tuple[float, float]:
    """Range of speed [rad/s], a part of the one that there is.

    ValueError: not a rising range of the map.
    """
    if args.speed_rpm is None:
        return low, high
    ends = [value * RPM for value in args.speed_rpm]
    if not low * (1.0 - 1e-6) <= ends[0] < ends[1] <= high * (1.0 + 1e-6):
        raise ValueError(
            f"--speed-rpm = {ends[0] / RPM:g} {ends[1] / RPM:g}; allowed: a rising range in {low / RPM:.6g} to "
            f"{high / RPM:.6g} r/min"
        )
    return max(ends[0], low), min(ends[1], high)


def _of_map(args: Namespace, max_points: int) -> _Export:
    """Friction of a map."""
    current = _current(args)
    if args.lead_mm is not None:
        raise ValueError("--lead-mm; allowed with --identified, a screw file has its lead")
    selection = chosen_of(args)
    nut_map = selection.nut_map(args)
    preload, temperature = _grid(args, selection)
    low, high = _speeds(args, *nut_map.header["axes"]["speed"][:2])
    twincat = args.format == "twincat"
    speed = curve_speeds(low, high, CURVE) if twincat else np.geomspace(low, high, max_points)
    interval = nut_map.law == Law.MECHANISTIC and not twincat
    table = friction_table(
        nut_map, selection.parameters, selection.friction_set, interval, speed, preload, temperature
    )
    lists = []
    for j, k in np.ndindex(len(preload), len(temperature)):
        point = float(preload[j]), float(temperature[k] - CELSIUS)
        suffix = "_{:.6g}N_{:.6g}C".format(*point) if len(preload) * len(temperature) > 1 else ""
        about = {"preload_n": point[0], "temperature_c": point[1]}
        lists.append(_List(suffix, point_text(point), speed, table.torque[:, j, k], about))
    answer = {"screw": table.about["screw"], "friction_set": table.about["friction set"]}
    return _Export(table, lists, float(selection.parameters.screw.lead), current, answer)


def _grid(args: Namespace, chosen: Chosen) -> tuple[Array, Array]:
    """Preloads [N] and temperatures [K] in rising order; default: as catalogues take them."""
    preloads = args.preload_n or [catalogue_preload(chosen.parameters.screw)]
    celsius = args.temperature_c or [chosen.parameters.lubricant.reference_temperature - CELSIUS]
    return np.unique(preloads), np.unique(celsius) + CELSIUS


def _of_log(args: Namespace, max_points: int) -> _Export:
    """Friction that identify has written."""
    options = ("screw", "map", "friction", "preload_n", "temperature_c")
    if needless := [name for name in options if getattr(args, name) is not None]:
        raise ValueError(
            f"--{needless[0].replace('_', '-')} with --identified; allowed: with --map, whose friction is then written"
        )
    if args.points and args.format != "twincat":
        raise ValueError("--points with --identified; allowed: with --format twincat, others have all speeds")
    axis = read_identified(args.identified)
    if args.lead_mm is not None:
        axis = axis._replace(lead=1e-3 * abs(args.lead_mm))
    if args.speed_rpm is not None:
        axis = axis.between(*_speeds(args, 0.0, math.inf))
    current, lists = _current(args, axis.torque_constant, axis.ratio), []
    if args.format == "twincat" and axis.lead is not None:
        both = axis.mean
        differs = float(np.max(np.abs(both.difference)))
        where = (
            f"mean of both directions, for a list has none; each differs from it by up to "
            f"{differs * current[0]:.3g} A = {differs:.3g} N.m; bins by their errors"
        )
        errors = np.maximum(both.error, MIN_ERROR * both.mean.max())
        lists = [_List("", where, both.speed, both.mean, {"direction_difference_nm": differs}, errors)]
    return _Export(axis.table, lists, axis.lead, current, {"log": axis.about["log"]})
