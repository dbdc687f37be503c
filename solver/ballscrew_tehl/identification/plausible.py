"""Whether the units of a log can be right: speed, acceleration and drive of an axis are within wide limits."""

from collections.abc import Callable

import numpy as np

from ..parameters.units import RPM
from ..physics.ball_law import Array
from ..runtime.evaluate import NutMap
from ..tables.headings import ANGLE, EFFORT, LENGTH, LOG, MOTION, SPEED, VELOCITY, Units, parted
from .log_file import Log
from .signals import Signals

#: what, value, its limits, the unit that both are in, its factor
Finding = tuple[str, float, tuple[float, float], str, float]
#: limits of the largest speed and acceleration [m/s], [m/s2];  of a screw [rad/s], [rad/s2]
LINEAR = (1e-3, 10.0), (5e-3, 200.0)
ROTARY = (1.0 * RPM, 3e4 * RPM), (1.0, 2e5)
#: of the time between samples [s];  of the largest current [A], voltage [V], torque [N.m], force [N]
STEP = 5e-6, 0.05
DRIVE = {"current": (0.02, 1e3), "voltage": (0.02, 1e3), "torque": (1e-3, 1e3), "force": (0.5, 2e5)}
#: with a map: largest speed over its range;  largest torque over the least friction of the map, over the largest
MAP_SPEED, MAP_TORQUE = 3.0, (0.1, 20.0)
#: samples that speed and acceleration are taken over, against noise;  part of them that is not above the largest value
SHORT, LONG, USUAL = 10, 25, 0.999


def check_units(log: Log, signals: Signals, nut_map: NutMap | None = None) -> None:
    """Refuse units that cannot be right, unless an option has stated them.

    Parameters   nut_map : of the screw, whose ranges of speed and torque are narrower
    Raises       ValueError: values, limits, the unit that would be plausible
    """
    motion, effort = (next(name for name in kind if name in log.signals) for kind in (MOTION, EFFORT))
    speed, acceleration = _largest(signals)
    speeds, accelerations = ROTARY if signals.rotary else LINEAR
    one, unit, change = (RPM, "r/min", "rad/s2") if signals.rotary else (1.0, "m/s", "m/s2")
    value, torque, torques = _usual([log.signals[effort]]), 0.0, (0.0, 0.0)
    if nut_map is not None and signals.rotary:
        axes = nut_map.header["axes"]
        speeds = axes["speed"][0], MAP_SPEED * axes["speed"][1]
        friction = [
            nut_map.evaluate(preload, np.geomspace(axes["speed"][0], axes["speed"][1], 5), kelvin).friction_torque
            for preload in axes["preload"][:2] for kelvin in axes["temperature"][:2]
        ]  # fmt: skip
        torque = _usual([section.effort for section in signals.sections])
        torques = MAP_TORQUE[0] * float(np.min(friction)), MAP_TORQUE[1] * float(np.max(friction))

    def of_motion(time: float = 1.0, place: float = 1.0) -> list[Finding]:
        """What the motion would be with units so many times as large."""
        by_time = 1.0 if signals.of_speed else time
        return [
            ("time between samples", signals.step * time, STEP, "s", 1.0),
            ("speed up to", speed * place / by_time, speeds, unit, one),
            ("acceleration up to", acceleration * place / by_time / time, accelerations, change, 1.0),
        ]

    def of_drive(ratio: float = 1.0) -> list[Finding]:
        name, si = effort.removeprefix("screw_"), next(iter(LOG.quantities[effort].units))
        return [
            (f"{name} up to", value * ratio, DRIVE[name], si, 1.0),
            ("torque at the screw up to", torque * ratio, torques, "N.m", 1.0),
        ]

    _check(log, {"time": of_motion, motion: lambda ratio=1.0: of_motion(1.0, ratio)})
    _check(log, {effort: of_drive})


def _check(log: Log, values: dict[str, Callable[..., list[Finding]]]) -> None:
    """ValueError with the units in which values are plausible, unless options have stated all units.

    Too small values without such a unit are no matter of units: an axis that hardly moves.
    """
    wrong = [finding for finding in next(iter(values.values()))() if not _within(finding)]
    columns = {name: log.columns[name] for name in values if not log.columns[name].stated}
    if not wrong or not columns:
        return
    stems = {name: parted(column.heading)[0] for name, column in columns.items()}
    likely = []
    for name, column in columns.items():
        units, tried = _family(name, column.unit), {1.0}
        for unit, (factor, _) in units.items():
            ratio = factor / units[column.unit][0]
            if ratio not in tried and all(map(_within, values[name](ratio))):
                likely.append(
                    f'{name} in {unit}, {ratio:.4g} times: --column "{name}={stems[name]} [{unit}]"'
                )
            tried.add(ratio)
    if not likely and not any(value > high for _, value, (_, high), _, _ in wrong):
        return
    shown = ", ".join(
        f"{what} {value / one:.4g} {unit} (plausible: {low / one:.3g} to {high / one:.6g})"
        for what, value, (low, high), unit, one in wrong
    )
    remedy = "likely " + " or ".join(likely[:2])
    if not likely:
        remedy = f"check {' and '.join(repr(column.heading) for column in columns.values())}"
        remedy += " and --torque-constant-nm-a" * ("current" in columns)
    stated = " ".join(f'--column "{name}={stems[name]} [{column.unit}]"' for name, column in columns.items())
    raise ValueError(f"{log.path}: {shown}; {remedy}; if the log is right, state its units: {stated}")


def _within(finding: Finding) -> bool:
    _, value, (low, high), _, _ = finding
    return low <= value <= high


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


def _family(name: str, unit: str) -> Units:
    """Units that a unit may be mistaken for: an angle is no length."""
    return next(
        units for units in (LENGTH, ANGLE, SPEED, VELOCITY, LOG.quantities[name].units) if unit in units
    )
