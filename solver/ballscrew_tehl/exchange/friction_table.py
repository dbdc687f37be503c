"""Friction over speed as a table: of a map, with its interval where the law has one, or what identify has written."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from ..friction.sets import FrictionSet
from ..identification.directions import LINEAR, ROTARY, Bidirectional, Friction, Units, bidirectional_friction
from ..nut_map.built import Progress
from ..parameters.file import Parameters
from ..parameters.units import CELSIUS, RPM
from ..physics.ball_law import Array
from ..runtime.evaluate import NutMap

#: speeds at which an interval is computed; between them its ends over the torque are interpolated over ln(speed)
INTERVALS = 5
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

    speed [rad/s] > 0, the torque opposes the motion;  preload [N];  temperature [K];  about : screw, oil, friction set,
    hash of the map, meaning of low and high
    Of a log preload and temperature are None, speeds are signed, each direction by itself; of a linear axis (rotary
    False) speed [m/s], force [N].
    """

    speed: Array
    preload: Array | None
    temperature: Array | None
    torque: Array
    low: Array | None
    high: Array | None
    about: dict[str, str]
    rotary: bool = True

    @property
    def head(self) -> tuple[str, str]:
        """Content and sign."""
        return OF_AXIS if self.preload is None else OF_SCREW

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
        """For each preload [N] and temperature [degC]: columns speed, torque, low, high over both directions.

        Parameters   at_rest : with a row of zeros between the directions
        """
        for j, preload in enumerate([] if self.preload is None else self.preload):
            for k, kelvin in enumerate([] if self.temperature is None else self.temperature):
                half = np.column_stack([self.speed, *(value[:, j, k] for value in self.values.values())])
                zero = np.zeros((int(at_rest), half.shape[1]))
                yield [float(preload), float(kelvin) - CELSIUS], np.vstack([-half[::-1], zero, half])
        if self.preload is None:
            whole = np.column_stack([self.speed, *self.values.values()])
            rest = [int(np.searchsorted(self.speed, 0.0))] * at_rest
            yield [], np.insert(whole, rest, 0.0, axis=0)


def speeds_of(low: float, high: float, count: int) -> Array:
    """Speeds [rad/s] evenly over their logarithm."""
    return np.clip(np.geomspace(low, high, count), low, high)


def curve_speeds(low: float, high: float, count: int) -> Array:
    """Speeds that a list is fitted to: half of them evenly over their logarithm, half evenly."""
    return np.unique(np.r_[speeds_of(low, high, count // 2), np.linspace(low, high, count - count // 2)])


def friction_table(
    nut_map: NutMap, parameters: Parameters, friction_set: FrictionSet, interval: bool,
    speed: Array, preload: Array, temperature: Array,
    progress: Progress = lambda finished, total, what: None,
) -> FrictionTable:  # fmt: skip
    """Table of a map.

    Parameters   interval : with the bounds of the interval, of the mechanistic law
    Raises       ValueError: a point outside the map;  ArithmeticError: as map_interval
    """
    from ..nut_map.interval import map_interval

    axes = nut_map.header["axes"]
    for name, unit, values in (("preload", "N", preload), ("temperature", "K", temperature)):
        low, high = axes[name][:2]
        if bad := [value for value in values if not low <= value <= high]:
            raise ValueError(
                f"{name} = {bad[0]:.6g} {unit}; allowed by the map: {low:.6g} to {high:.6g} {unit}"
            )
    torque = np.asarray(
        nut_map.evaluate(
            preload[None, :, None], speed[:, None, None], temperature[None, None, :]
        ).friction_torque
    )
    about = {
        "screw": parameters.name,
        "oil": parameters.lubricant.name,
        "friction set": f"{friction_set.kinematics}.{friction_set.name}",
        "map": str(nut_map.header["file_hash"]),
    }
    if not interval:
        return FrictionTable(speed, preload, temperature, torque, None, None, about)
    nodes = np.geomspace(speed[0], speed[-1], INTERVALS)
    bounds = np.ones((2, *torque.shape))
    total = len(preload) * len(temperature)
    for number, (j, k) in enumerate(np.ndindex(len(preload), len(temperature))):
        progress(number, total, "intervals")
        at = [
            map_interval(parameters, axes, friction_set, float(preload[j]), x, float(temperature[k])) for x in nodes
        ]  # fmt: skip
        about.setdefault("low and high", at[INTERVALS // 2].meaning)
        for side in (0, 1):
            ratios = [one.relative[side] for one in at]
            bounds[side, :, j, k] = np.interp(np.log(speed), np.log(nodes), ratios)
    progress(total, total, "intervals")
    return FrictionTable(speed, preload, temperature, torque, torque * bounds[0], torque * bounds[1], about)


class AxisFriction(NamedTuple):
    """Bins of a log over the signed speed: rad/s and N.m at the screw, or m/s and N of a linear axis.

    lead [m], torque_constant [N.m/A], ratio : of the drive, None = not known
    """

    rotary: bool
    friction: Friction
    lead: float | None
    torque_constant: float | None
    ratio: float
    about: dict[str, str]

    @property
    def table(self) -> FrictionTable:
        """Each direction by itself."""
        bins = self.friction
        return FrictionTable(bins.speed, None, None, bins.value, bins.low, bins.high, self.about, self.rotary)

    @property
    def per_turn(self) -> float:
        """Motion for one radian of the screw: 1, or of a linear axis [m]; ValueError: no lead."""
        if not self.rotary and self.lead is None:
            raise ValueError("--lead-mm (missing); needed of a linear axis for torque and speed of the screw")
        return 1.0 if self.rotary else (self.lead or math.nan) / (2.0 * math.pi)

    def between(self, low: float, high: float) -> Self:
        """The bins between two speeds of the screw [rad/s].

        Raises       ValueError: fewer than three in a direction
        """
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
    """What identify --output or --json has written.

    Raises       ValueError: cannot be read, is something else
    """
    try:
        data: dict[str, Any] = json.loads(Path(path).read_text(encoding="utf-8-sig"))
        rotary, rows = data["kind"] == "rotary", data["friction"]
        units = ROTARY if rotary else LINEAR
        keys = units.speed, *map(units.effort_key, ("", "error", "low", "high")), "samples"
        values = [np.array([row[key] for row in rows], dtype=np.float64) for key in keys]
        values[0] = values[0] * units.one
        stated = [data.get(key) for key in ("lead_mm", "torque_constant_nm_a", "ratio")]
        # signs of a left-hand thread and of conventions are in the signals already
        lead, constant, ratio = (None if number is None else abs(float(number)) for number in stated)
        if not (
            all(number is None or 0.0 < number < math.inf for number in (lead, constant, ratio))
            and np.isfinite(values).all()
            and bool(np.all(np.diff(values[0]) > 0.0))
            and values[0][0] < 0.0 < values[0][-1]
        ):
            raise ValueError("friction in both directions at rising speeds, positive numbers of the drive")
        about = {"log": str(data.get("log"))}
        for key in ("temperature_c", "preload_n", units.offset.format("")):
            if data.get(key) is not None:
                about[key] = f"{data[key]:.6g}"
    except OSError as error:
        raise ValueError(f"--identified = {path}: cannot be read ({error.strerror})") from error
    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        raise ValueError(
            f"--identified = {path}; allowed: a file that identify --output has written"
        ) from error
    return AxisFriction(rotary, Friction(*values), lead and 1e-3 * lead, constant, ratio or 1.0, about)
