"""Whether the units of a log can be right: speed, acceleration and drive of an axis are within wide limits."""

from typing import NamedTuple

import numpy as np

from ballscrew_tehl.numerics import Array
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.runtime.evaluate import NutMap

from ...tables.headings import ANGLE, EFFORT, LENGTH, LOG, MOTION, SPEED, VELOCITY
from .log_file import Log
from .signals import MAX_RATE, MIN_RATE, Signals

#: limits of the largest speed and acceleration [m/s], [m/s2];  of a screw [rad/s], [rad/s2]
LINEAR = (1e-3, 10.0), (5e-3, 200.0)
ROTARY = (1.0 * RPM, 3e4 * RPM), (1.0, 2e5)
#: of the time between samples and the whole log [s];  of the largest current [A], voltage [V], torque [N.m], force [N]
STEP, DURATION = (1.0 / MAX_RATE, 1.0 / MIN_RATE), (0.2, 1e6)
DRIVE = {"current": (0.02, 1e3), "voltage": (0.02, 1e3), "torque": (1e-3, 1e3), "force": (0.5, 2e5)}
#: with a map: largest speed over its range;  largest torque over the least friction of the map, over the largest
MAP_SPEED, MAP_TORQUE = 3.0, (0.1, 20.0)
#: so many times the upper limits no unit can be right, even if it is stated
NEVER = 3.0
#: samples that speed and acceleration are taken over, against noise;  part of them that is not above the largest value
SHORT, LONG, USUAL = 10, 25, 0.999


class Value(NamedTuple):
    """A largest value with its limits [SI], the unit it is shown in, and the powers of the columns' units in it."""

    what: str
    value: float
    limits: tuple[float, float]
    unit: str
    powers: dict[str, int]
    one: float = 1.0

    def plausible(self, column: str = "", ratio: float = 1.0) -> bool:
        """Whether it is within the limits, with a unit of a column so many times as large."""
        return self.limits[0] <= self.value * ratio ** self.powers.get(column, 0) <= self.limits[1]

    def __str__(self) -> str:
        low, high = (limit / self.one for limit in self.limits)
        return f"{self.what} {self.value / self.one:.4g} {self.unit} (plausible: {low:.3g} to {high:.6g})"


def check_units(log: Log, signals: Signals, nut_map: NutMap | None = None) -> None:
    """Refuse units that cannot be right, note those that an option states; nut_map: of the screw, with its ranges."""
    log = log._replace(notes=signals.notes)
    motion, effort = (next(name for name in kind if name in log.signals) for kind in (MOTION, EFFORT))
    speed, acceleration = _largest(signals)
    speeds, accelerations = ROTARY if signals.rotary else LINEAR
    shown, one = (("r/min", "rad/s2"), RPM) if signals.rotary else (("m/s", "m/s2"), 1.0)
    name, value = effort.removeprefix("screw_"), _usual([log.signals[effort]])
    unit = next(iter(LOG.quantities[effort].units))
    drive = [Value(f"{name} up to", value, DRIVE[name], unit, {effort: 1})]
    if nut_map is not None and signals.rotary:
        axes = nut_map.header["axes"]
        speeds = axes["speed"][0], MAP_SPEED * axes["speed"][1]
        friction = nut_map.evaluate(
            np.array(axes["preload"][:2])[:, None, None], np.geomspace(axes["speed"][0], axes["speed"][1], 5),
            np.array(axes["temperature"][:2])[:, None],
        ).friction_torque  # fmt: skip
        torques = MAP_TORQUE[0] * float(np.min(friction)), MAP_TORQUE[1] * float(np.max(friction))
        torque = _usual([section.effort for section in signals.sections])
        drive.append(Value("torque at the screw up to", torque, torques, "N.m", {effort: 1}))
    of_time, samples = int(signals.of_speed), sum(len(section.motion) for section in signals.sections)
    _check(log, ("time", motion), [
        Value("time between samples", signals.step, STEP, "s", {"time": 1}),
        Value("length of the log", signals.step * samples, DURATION, "s", {"time": 1}),
        Value("speed up to", speed, speeds, shown[0], {motion: 1, "time": of_time - 1}, one),
        Value("acceleration up to", acceleration, accelerations, shown[1], {motion: 1, "time": of_time - 2}),
    ])  # fmt: skip
    _check(log, (effort,), drive)


def _check(log: Log, names: tuple[str, ...], values: list[Value]) -> None:
    """Refuse implausible values, but no small ones (an axis that hardly moves) where no other unit would do."""
    wrong = [value for value in values if not value.plausible()]
    over = max((value.value / value.limits[1] for value in wrong), default=0.0)
    columns = {name: log.columns[name] for name in names if not log.columns[name].stated}
    likely: dict[tuple[str, float], str] = {}
    for name, column in columns.items():
        # a unit is mistaken for one of its family: an angle is no length
        families = LENGTH, ANGLE, SPEED, VELOCITY, LOG.quantities[name].units
        units = next(units for units in families if column.unit in units)
        for unit, (factor, _) in units.items():
            ratio = factor / units[column.unit][0] / (column.multiple or 1.0)
            if ratio != 1.0 and all(value.plausible(name, ratio) for value in values):
                text = f"{name} in {unit}, {ratio:.4g} times: {column.option(name, unit)}"
                likely.setdefault((name, ratio), text)
    shown = ", ".join(map(str, wrong))
    if not wrong or not (likely or over > NEVER or (columns and over > 1.0)):
        log.notes.extend([f"{shown}: check the units"] * bool(wrong))
        return
    remedy = "likely " + " or ".join([*likely.values()][:2])
    if not likely:
        remedy = f"check {' and '.join(log.columns[name].option(name) for name in names[::-1])}"
        remedy += " and --torque-constant-nm-a" * ("current" in names)
    end = f"; if the log is right, state its units: {' '.join(c.option(name) for name, c in columns.items())}"
    raise ValueError(f"{shown}; {remedy}{end * (over <= NEVER)}")


def _usual(pieces: list[Array]) -> float:
    return float(np.quantile(np.abs(np.concatenate(pieces)), USUAL))


def _largest(signals: Signals) -> tuple[float, float]:
    """Largest speed and acceleration."""
    pieces, step = [section.motion for section in signals.sections], signals.step
    if signals.of_speed:
        return _usual(pieces), _usual([x[2 * LONG :] - x[: -2 * LONG] for x in pieces]) / (2 * LONG * step)
    return (
        _usual([x[SHORT:] - x[:-SHORT] for x in pieces]) / (SHORT * step),
        _usual([x[2 * LONG :] - 2.0 * x[LONG:-LONG] + x[: -2 * LONG] for x in pieces]) / (LONG * step) ** 2,
    )
