"""Files of friction over speed for a controller or a tool, of a screw or of an axis that `identify` has written."""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ballscrew_tehl.numerics import Array
from ballscrew_tehl.nut_map.grid import Progress
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.rating import catalogue_preload
from ballscrew_tehl.runtime.packed import Law

from ..quantities import CURRENT_UNIT, LEAD, POINTS, PRELOAD, RATIO, SPEED, TEMPERATURE, TORQUE_CONSTANT
from ..screw_model import ScrewModel
from .formats import FORMATS, point_text, twincat_text
from .friction_table import FrictionTable, curve_speeds, friction_table, read_identified
from .piecewise import Points, few_points, weighted_points

#: ends of file names by format
SUFFIXES = {"twincat": (".lis", ".txt"), "csv": (".csv",), "modelica": (".txt",), "matlab": (".m",),
            "json": (".json",)}  # fmt: skip
#: speeds of a table, points of a compensation list and the speeds that it is fitted to
SPEEDS, MAX_POINTS, CURVE = 40, 20, 400
#: least standard error of a bin over the largest friction: fits of some logs have none
MIN_ERROR = 1e-6


class TableOptions(NamedTuple):
    """What is stated of a table, under names and units of the options of `export`; None: the default."""

    preload_n: Sequence[float] | None = None  # default of both: as catalogues take them
    temperature_c: Sequence[float] | None = None
    speed_rpm: Sequence[float] | None = None  # lowest and highest of the screw; default: of map or log
    lead_mm: float | None = None  # of the screw of a log
    torque_constant_nm_a: float | None = None  # of the motor, for a compensation list
    ratio: float | None = None  # turns of the motor for one of the screw
    current_unit_a: float | None = None  # one of the current of the drive; default: 0.001
    points: int | None = None  # most entries of a list, speeds of a table

    def checked(self) -> "TableOptions":
        """Itself; ValueError: a value out of the range of its option."""
        loaded, of_drive = PRELOAD._replace(not_zero=True), (LEAD, TORQUE_CONSTANT, RATIO, CURRENT_UNIT)
        for one in (loaded, TEMPERATURE, SPEED, *of_drive, POINTS):
            for value in np.atleast_1d([] if (x := getattr(self, one.name)) is None else x).tolist():
                one.checked(value)
        return self

    def current(self, twincat: bool, constant: float | None, ratio: float = 1.0) -> tuple[float, float]:
        """Current per torque at the screw [A/(N.m)] and its unit [A]; constant, ratio: of the drive of a log.

        ValueError: no torque constant, or one without need
        """
        given = self.torque_constant_nm_a is not None
        if (given and not twincat) or (twincat and not given and constant is None):
            needed = "allowed only with" if given else "needed with"
            text = "--format twincat, whose list is a motor current"
            raise ValueError(f"--torque-constant-nm-a; {needed} {text}")
        constant = self.torque_constant_nm_a or constant or 1.0
        return 1.0 / (constant * (self.ratio or ratio)), self.current_unit_a or 1e-3

    def speeds(self, low: float, high: float) -> tuple[float, float]:
        """Range of speed [rad/s], a part of the one that there is; ValueError: not a rising one in it."""
        if self.speed_rpm is None:
            return low, high
        first, last = (value * RPM for value in self.speed_rpm)
        if not low * (1.0 - 1e-6) <= first < last <= high * (1.0 + 1e-6):
            raise ValueError(
                f"--speed-rpm = {first / RPM:g} {last / RPM:g}; allowed: a rising range in {low / RPM:.6g} to "
                f"{high / RPM:.6g} r/min"
            )
        return max(first, low), min(last, high)


class FrictionFile(NamedTuple):
    """A file to write: where, its content, what `export --json` prints of it."""

    path: Path
    text: str
    about: dict[str, Any]


class _List(NamedTuple):
    """Curve of a compensation list."""

    suffix: str  # end of its file's name
    where: str  # what it is of
    speed: Array  # [rad/s]
    torque: Array  # [N.m]
    about: dict[str, float]
    errors: Array | None = None  # standard errors of a log's bins [N.m]


class _Export(NamedTuple):
    """Table, or curves of the lists with lead [m] and current of the motor; about: keys of all files."""

    table: FrictionTable
    lists: list[_List]
    lead: float | None
    current: tuple[float, float]  # per torque at the screw [A/(N.m)], unit [A]
    about: dict[str, Any]


def friction_files(
    output: Path | str, form: str, source: ScrewModel | Path | str, options: TableOptions | None = None,
    progress: Progress | None = None,
) -> list[FrictionFile]:  # fmt: skip
    """Friction over speed as files for a controller or a tool; nothing is written.

    Parameters
    ----------
    output : path or str
        File to be; of several lists the stem of their names.
    form : str
        Format: a key of SUFFIXES.
    source : ScrewModel, path or str
        A screw; or the file that `identify --output` has written, of a whole axis.
    options : TableOptions, optional
        Ranges and numbers of the drive.
    progress : callable, optional
        Called while the map of the screw is made.

    Returns
    -------
    list of FrictionFile
        One file, or one for each preload and temperature of a compensation list.

    Raises
    ------
    ValueError
        A point outside the map, an option that is missing or has no effect, a file that is none of `identify`.

    Examples
    --------
    >>> from ballscrew_tehl.applications.screw_model import screw_model
    >>> screw = screw_model("gd4008_vg100.toml")
    >>> (file,) = friction_files("friction.m", "matlab", screw, TableOptions(preload_n=[2000.0]))
    >>> file.text.splitlines()[0]
    'function [torque, t] = friction(speed, preload, temperature)'
    """
    output, options, twincat = Path(output), (options or TableOptions()).checked(), form == "twincat"
    if form not in SUFFIXES:
        raise ValueError(f"--format = {form}; allowed: {', '.join(SUFFIXES)}")
    if form == "matlab" and not re.fullmatch(r"[A-Za-z]\w{0,62}", output.stem):
        allowed = "the name of a MATLAB function, letters, digits and _ only"
        raise ValueError(f"--output = {output}; allowed: {allowed}")
    if isinstance(source, ScrewModel):
        export = _of_screw(source, options, twincat, progress)
    else:
        export = _of_log(source, options, twincat)
    about, table = {"format": form} | export.about, export.table
    if twincat:
        return _lists(output, export, MAX_POINTS if options.points is None else options.points, about)
    about |= {"file": str(output), "speeds": len(table.speed)}
    if table.preload.size:
        celsius = (table.temperature - CELSIUS).tolist()
        about |= {"preload_n": table.preload.tolist(), "temperature_c": celsius}
    return [FrictionFile(output, FORMATS[form](table, output.stem), about)]


def _lists(output: Path, export: _Export, max_points: int, about: dict[str, Any]) -> list[FrictionFile]:
    """Compensation lists."""
    if export.lead is None:
        raise ValueError("--lead-mm (missing); needed with --format twincat, a list over the axis velocity")
    files = []
    for curve in export.lists:
        # the entry at rest is one of them
        points = Points(curve.speed, curve.torque, 0.0, 0.0)
        if curve.errors is not None:
            points = weighted_points(curve.speed, curve.torque, curve.errors, max_points - 1)
        elif len(curve.speed) >= max_points:
            points = few_points(curve.speed, curve.torque, max_points - 1)
        path = output.with_name(f"{output.stem}{curve.suffix}{output.suffix}")
        text = twincat_text(export.table, export.lead, points, *export.current, curve.where)
        of_list = {
            "file": str(path), **curve.about, "entries": len(points.x) + 1, "largest_error_nm": points.error,
            "error_bound_nm": points.bound, "largest_error_share": points.error / float(curve.torque.mean()),
        }  # fmt: skip
        files.append(FrictionFile(path, text, about | of_list))
    return files


def _of_screw(screw: ScrewModel, options: TableOptions, twincat: bool, progress: Progress | None) -> _Export:
    """Friction of a screw by its map."""
    current = options.current(twincat, None)
    if options.lead_mm is not None:
        raise ValueError("--lead-mm; allowed with --identified, a screw file has its lead")
    nut_map, parameters = screw.nut_map(progress), screw.parameters
    preload = np.unique(options.preload_n or [catalogue_preload(parameters.screw)])
    celsius = np.unique(options.temperature_c or [parameters.lubricant.reference_temperature - CELSIUS])
    low, high = options.speeds(*nut_map.header["axes"]["speed"][:2])
    number = SPEEDS if options.points is None else options.points
    speed = curve_speeds(low, high, CURVE) if twincat else np.geomspace(low, high, number)
    interval = nut_map.law == Law.MECHANISTIC and not twincat
    at = speed, preload, celsius + CELSIUS
    table = friction_table(nut_map, parameters, screw.friction_set, interval, *at)
    lists = []
    for j, k in np.ndindex(len(preload), len(celsius)):
        point = float(preload[j]), float(table.temperature[k] - CELSIUS)
        suffix = "_{:.6g}N_{:.6g}C".format(*point) if preload.size * celsius.size > 1 else ""
        about = dict(zip(("preload_n", "temperature_c"), point, strict=True))
        lists.append(_List(suffix, point_text(point), speed, table.torque[:, j, k], about))
    about_all = {"screw": table.about["screw"], "friction_set": table.about["friction set"]}
    return _Export(table, lists, float(parameters.screw.lead), current, about_all)


def _of_log(path: Path | str, options: TableOptions, twincat: bool) -> _Export:
    """Friction that identify has written."""
    for name in ("preload_n", "temperature_c"):
        if getattr(options, name) is not None:
            raise ValueError(needless(name))
    if options.points and not twincat:
        raise ValueError("--points with --identified; allowed: with --format twincat, others have all speeds")
    axis = read_identified(path)
    if options.lead_mm is not None:
        axis = axis._replace(lead=1e-3 * abs(options.lead_mm))
    if options.speed_rpm is not None:
        axis = axis.between(*options.speeds(0.0, math.inf))
    current, lists = options.current(twincat, axis.torque_constant, axis.ratio), []
    if twincat and axis.lead is not None:
        both = axis.mean
        differs = float(np.max(np.abs(both.difference)))
        where = (
            f"mean of both directions, for a list has none; each differs from it by up to "
            f"{differs * current[0]:.3g} A = {differs:.3g} N.m; bins by their errors"
        )
        errors = np.maximum(both.error, MIN_ERROR * both.mean.max())
        lists = [_List("", where, both.speed, both.mean, {"direction_difference_nm": differs}, errors)]
    return _Export(axis.table, lists, axis.lead, current, {"log": axis.about["log"]})


def needless(name: str) -> str:
    """Refusal of an option of a map with the friction of a log."""
    option = name.replace("_", "-")
    return f"--{option} with --identified; allowed: with --map, whose friction is then written"
