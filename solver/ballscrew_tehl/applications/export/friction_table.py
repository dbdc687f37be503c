"""Friction over speed as a table: of a map, with its interval where the law has one, or what identify has written."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from ballscrew_tehl.friction.sets import FrictionSet
from ballscrew_tehl.numerics import Array
from ballscrew_tehl.nut_map.interval import map_interval
from ballscrew_tehl.parameters.file import Parameters
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.runtime.evaluate import NutMap

from ..identification.directions import LINEAR, ROTARY, Bidirectional, Friction, Units, bidirectional_friction
from ..torque_curve import interval_ratios

#: numbers of the drive in what identify has written
DRIVE = ("lead_mm", "torque_constant_nm_a", "ratio")
#: content and sign
OF_SCREW = (
    "friction torque of a preloaded ball screw at the screw, axial load 0",
    "the torque opposes the motion: the drive needs it in the direction of the speed; same magnitude both ways",
)
OF_AXIS = (
    "friction of a whole axis: screw, guides, seals and bearings together, without the offset (gravity, tilt)",
    "friction has the sign of the speed: the drive needs it in addition",
)


class FrictionTable(NamedTuple):
    """Torque (speed, preload, temperature) [N.m] with low and high; None: not known.

    speed [rad/s] > 0, the torque opposes the motion; preload [N]; temperature [K]; about: screw, oil, friction set,
    hash of the map, meaning of low and high
    Of a log preload and temperature are empty, speeds are signed, each direction by itself, torque (speed,); of a
    linear axis (rotary False) speed [m/s], force [N].
    """

    speed: Array
    preload: Array
    temperature: Array
    torque: Array
    low: Array | None
    high: Array | None
    about: dict[str, str]
    rotary: bool = True

    @property
    def head(self) -> tuple[str, str]:
        """Content and sign."""
        return OF_SCREW if self.preload.size else OF_AXIS

    @property
    def units(self) -> Units:
        """Of the screw or the linear axis."""
        return ROTARY if self.rotary else LINEAR

    @property
    def values(self) -> dict[str, Array]:
        """Torque, low, high as far as they are known."""
        named = {"": self.torque, "low": self.low, "high": self.high}
        return {name: value for name, value in named.items() if value is not None}

    def curves(self, at_rest: bool = False) -> Iterator[tuple[list[float], Array]]:
        """Preload [N], temperature [degC]; columns speed, torque, low, high, both ways; at_rest: zeros between them."""
        for j, k in np.ndindex(len(self.preload), len(self.temperature)):
            half = np.column_stack([self.speed, *(value[:, j, k] for value in self.values.values())])
            zero = np.zeros((int(at_rest), half.shape[1]))
            point = [float(self.preload[j]), float(self.temperature[k]) - CELSIUS]
            yield point, np.vstack([-half[::-1], zero, half])
        if not self.preload.size:
            whole = np.column_stack([self.speed, *self.values.values()])
            remainder = [int(np.searchsorted(self.speed, 0.0))] * at_rest
            yield [], np.insert(whole, remainder, 0.0, axis=0)


def curve_speeds(low: float, high: float, count: int) -> Array:
    """Speeds that a list is fitted to: half of them evenly over their logarithm, half evenly."""
    return np.unique(np.r_[np.geomspace(low, high, count // 2), np.linspace(low, high, count - count // 2)])


def friction_table(
    nut_map: NutMap, parameters: Parameters, friction_set: FrictionSet, interval: bool,
    speed: Array, preload: Array, temperature: Array,
) -> FrictionTable:  # fmt: skip
    """Table of a map; interval: with its bounds, of the mechanistic law; ValueError: a point outside the map."""
    axes = nut_map.header["axes"]
    for name, unit, values in (("preload", "N", preload), ("temperature", "K", temperature)):
        low, high = axes[name][:2]
        if bad := [value for value in values if not low <= value <= high]:
            raise ValueError(
                f"{name} = {bad[0]:.6g} {unit}; allowed by the map: {low:.6g} to {high:.6g} {unit}"
            )
    torque = nut_map.evaluate(preload[:, None], speed[:, None, None], temperature).friction_torque
    about = {
        "screw": parameters.name,
        "oil": parameters.lubricant.name,
        "friction set": friction_set.name,
        "map": str(nut_map.header["file_hash"]),
    }
    if not interval:
        return FrictionTable(speed, preload, temperature, torque, None, None, about)
    law, middle = (parameters, axes, friction_set), math.sqrt(speed[0] * speed[-1])
    about["low and high"] = map_interval(*law, preload[0], middle, temperature[0]).meaning
    low, high = torque * interval_ratios(*law, preload, speed, temperature)
    return FrictionTable(speed, preload, temperature, torque, low, high, about)


class AxisFriction(NamedTuple):
    """Bins of a log over the signed speed: rad/s and N.m at the screw, or m/s and N of a linear axis."""

    rotary: bool
    friction: Friction
    lead: float | None  # [m], None: not known
    torque_constant: float | None  # of the drive [N.m/A]
    ratio: float
    about: dict[str, str]

    @property
    def table(self) -> FrictionTable:
        """Each direction by itself."""
        bins, none = self.friction, np.empty(0)
        return FrictionTable(bins.speed, none, none, bins.value, bins.low, bins.high, self.about, self.rotary)

    @property
    def per_turn(self) -> float:
        """Motion for one radian of the screw: 1, or of a linear axis [m]; ValueError: no lead."""
        if self.rotary:
            return 1.0
        if self.lead is None:
            raise ValueError("--lead-mm (missing); needed of a linear axis for torque and speed of the screw")
        return self.lead / (2.0 * math.pi)

    def between(self, low: float, high: float) -> Self:
        """The bins between two speeds of the screw [rad/s]; ValueError: fewer than three in a direction."""
        speed = self.friction.speed / self.per_turn
        inside = (np.abs(speed) >= low) & (np.abs(speed) <= high)
        if not min((inside & (speed > 0.0)).sum(), (inside & (speed < 0.0)).sum()) >= 3:
            slowest, fastest = np.abs(speed).min() / RPM, np.abs(speed).max() / RPM
            raise ValueError(
                f"--speed-rpm = {low / RPM:.6g} {high / RPM:.6g}; allowed: a range with 3 speeds of the log in each "
                f"direction, which has {slowest:.4g} to {fastest:.4g} r/min"
            )
        return self._replace(friction=Friction(*(values[inside] for values in self.friction)))

    @property
    def mean(self) -> Bidirectional:
        """Mean of both directions [rad/s], [N.m]; ValueError: fewer than three common speeds, no lead."""
        both = bidirectional_friction(self.friction).at_screw(self.per_turn)
        if len(both.speed) < 3:
            raise ValueError(
                f"speeds that both directions have in common = {len(both.speed)}; allowed: at least 3 for a list"
            )
        return both


def read_identified(path: Path | str) -> AxisFriction:
    """What identify --output or --json has written; ValueError: cannot be read, is something else."""
    try:
        data: dict[str, Any] = json.loads(Path(path).read_text(encoding="utf-8-sig"))
        rotary, rows = data["kind"] == "rotary", data["friction"]
        units = ROTARY if rotary else LINEAR
        keys = units.speed, *map(units.effort_key, ("", "error", "low", "high")), "samples"
        speed, *values = np.array([[row[key] for key in keys] for row in rows], dtype=np.float64).T
        # signs of a left-hand thread and of conventions are in the signals already
        drive = {key: abs(float(data[key])) for key in DRIVE if data.get(key) is not None}
        if not (
            np.isfinite([speed, *values]).all()
            and np.all(np.diff(speed) > 0.0)
            and all(0.0 < number < math.inf for number in drive.values())
        ):
            raise ValueError("friction at rising speeds, positive numbers of the drive")
        keys = "temperature_c", "preload_n", units.offset.format("")
        about = {key: f"{data[key]:.6g}" for key in keys if data.get(key) is not None}
    except OSError as error:
        raise ValueError(f"--identified = {path}: cannot be read ({error.strerror})") from error
    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        raise ValueError(
            f"--identified = {path}; allowed: a file that identify --output has written"
        ) from error
    if not speed[0] < 0.0 < speed[-1]:
        raise ValueError(
            f"--identified = {path}: friction of one direction, {speed[0]:.4g} to {speed[-1]:.4g} {units.shown[2]}; "
            "allowed: of both directions: identify a log with motion both ways"
        )
    lead, constant, ratio = (drive.get(key) for key in DRIVE)
    bins = Friction(speed * units.one, *values)
    return AxisFriction(
        rotary, bins, lead and 1e-3 * lead, constant, ratio or 1.0, {"log": str(data.get("log")), **about}
    )
