"""From the signals of a log to position and force of a linear axis, or angle and torque of a screw, evenly sampled."""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy

from ..physics.ball_law import Array
from ..tables.headings import ANGLE, EFFORT, MOTION, SPEED, TIME
from .log_file import SLOW, Log

#: a step of time longer than this many usual ones is a gap; jumps of a position that are whole periods within this
#: share are those of an encoder that starts again; most of the jumps that may be none
GAP, SAME_WRAP, NO_WRAPS = 4.5, 0.02, 0.1
#: a jump is this many times the largest usual step;  steps that count as usual
JUMP, USUAL = 8.0, 0.999
#: slowest and fastest sampling [1/s];  share by which uneven steps of time differ;  shortest section [samples]
MIN_RATE, MAX_RATE, UNEVEN, MIN_SECTION = 20.0, 2e5, 1e-3, 100
#: rows over which a slow channel repeats its value, at least (two are smooth behind the filter); changes of it,
#: fraction of them that are in phase, of those that follow each other so
MIN_HELD, MIN_CHANGES, SAME_PHASE, MIN_HELD_FRACTION = 3, 20, 0.99, 0.5


class Drive(NamedTuple):
    """What the options state; None: not given. lead [m/rad] of the screw, ratio: turns of the motor per turn of it."""

    torque_constant: float | None = None  # [N.m/A]
    gain: float | None = None  # [N/V]
    ratio: float = 1.0
    lead: float | None = None


class Section(NamedTuple):
    """Evenly sampled piece of a log: motion (position, or speed if the log has that), effort."""

    motion: Array
    effort: Array


class Signals(NamedTuple):
    """Sections of a log on one time step, position [m] and force [N], or if rotary angle [rad] and torque [N.m].

    of_speed : the motion is a speed;  quantum : least step of the motion, 0: none seen
    temperature [K], preload [N] : means of the log, None: no such column
    """

    rotary: bool
    of_speed: bool
    step: float
    quantum: float
    sections: list[Section]
    temperature: float | None
    preload: float | None
    left_out: dict[str, int]
    notes: list[str]


def signals_of(log: Log, drive: Drive) -> Signals:
    """Motion and effort of one side of the drive, in evenly sampled sections."""
    names = [next(name for name in kind if name in log.signals) for kind in (MOTION, EFFORT)]
    (motion_name, effort_name), of_speed = names, names[0].endswith("speed")
    rotary, scale, effort_scale = _scales(motion_name, effort_name, log.columns[motion_name].unit, drive)
    for name in names:
        values = log.signals[name]
        if not np.ptp(values) > 0.0:
            raise ValueError(f"{name} is constant, {values[0]:.6g} SI; allowed: an axis that moves both ways")
    whole, log = log, _without_repeats(log, names)
    time, left_out, notes = log.signals["time"], dict(log.left_out), list(log.notes)
    steps = np.diff(time)
    step, differences = float(np.median(steps)), np.diff(np.unique(steps))
    # between steps beyond rounding of the numbers, 0: they are all equal
    seen = differences[differences > 4.0 * np.spacing(np.abs(time).max())]
    resolution = float(seen.min()) if seen.size else 0.0
    if not step * MIN_RATE <= 1.0:
        column, remedy = log.columns["time"], "log faster" if log is whole else log.notes[-1]
        raw = step / TIME[column.unit][0] / (column.multiple or 1.0)
        far = log is whole and step * MIN_RATE > 10.0
        units = {factor: unit for unit, (factor, _) in reversed(TIME.items()) if far}
        fits = [one for one in units if 1.0 / MAX_RATE <= raw * one <= 1.0 / MIN_RATE]
        texts = [f"likely {raw * one:.3g} s: {column.option('time', units[one])}" for one in fits]
        remedy = f"sampled too slowly: {', or '.join([remedy, *texts])}"
        raise ValueError(f"time between samples = {step:.4g} s; allowed: <= {1.0 / MIN_RATE:g} s, {remedy}")
    motion, effort = (log.signals[name] for name in names)
    jumps = np.empty(0, dtype=int)
    if not of_speed:
        motion, left_out[f"single samples of {motion_name} that jump"] = _despiked(motion)
        motion, jumps = _unwrapped(time, motion, log, resolution, notes)
    effort, left_out[f"single samples of {effort_name} that jump"] = _despiked(effort)
    gaps = np.flatnonzero(steps > GAP * step) + 1
    if gaps.size:
        notes.append(f"{gaps.size} gap(s) in time, the longest {steps.max():.3g} s: the pieces are apart")
    if jumps.size:
        notes.append(f"{jumps.size} jump(s) of the position that are no wrap: the pieces are apart")
    step, even = _sampling(steps[steps <= GAP * step], step, resolution, notes)
    quantum = _quantum(log.signals[motion_name]) * abs(scale)
    motion, effort = motion * scale, effort * effort_scale
    sections, short = [], 0
    for first, last in pairwise(np.unique(np.r_[0, gaps, jumps, len(time)]).tolist()):
        if last - first < MIN_SECTION:
            short += last - first
            continue
        t, x, y = (values[first:last] for values in (time, motion, effort))
        if not even:
            new = np.arange(t[0], t[-1], step)
            x, y = scipy.interpolate.CubicSpline(t, x)(new), np.interp(new, t, y)
        sections.append(Section(x, y))
    left_out["samples in pieces too short"] = short
    if not sections:
        raise ValueError(f"pieces between gaps and jumps too short; allowed: >= {MIN_SECTION} samples")
    slow = (log.signals.get(name) for name in SLOW)
    temperature, preload = (None if values is None else float(np.nanmean(values)) for values in slow)
    return Signals(rotary, of_speed, step, quantum, sections, temperature, preload, left_out, notes)


def _scales(motion: str, effort: str, unit: str, drive: Drive) -> tuple[bool, float, float]:
    """Whether the result is that of a screw; motion and effort there over those of the log."""
    angular, rotary = unit in ANGLE or unit in SPEED, effort in ("torque", "screw_torque", "current")
    constant = {"current": drive.torque_constant, "voltage": drive.gain}.get(effort, 1.0)
    if constant is None:
        option = "--torque-constant-nm-a" if effort == "current" else "--gain-n-v"
        raise ValueError(f"{option} (missing); needed with a column {effort}")
    scale = 1.0 if motion.startswith("screw") or not angular else 1.0 / drive.ratio
    if angular != rotary:
        if drive.lead is None:
            which = "a motion along the axis and a torque" if rotary else "an angle and a force"
            raise ValueError(f"--lead-mm or --screw (missing); needed with {which}")
        scale *= drive.lead if angular else 1.0 / drive.lead
    return rotary, scale, constant * (drive.ratio if effort in ("torque", "current") else 1.0)


def _sampling(inside: Array, step: float, resolution: float, notes: list[str]) -> tuple[float, bool]:
    """Time step of sections and whether their samples are even, of the steps that are no gaps and their median."""
    mean, spread = float(inside.mean()), float(np.ptp(inside))
    if spread <= UNEVEN * step:
        return mean, True
    rounded = float(np.max(np.abs(inside - step))) <= min(1.01 * resolution, 0.5 * step)
    if rounded and abs(mean / step - 1.0) <= 1e-2:
        notes.append(f"time rounded to {resolution:.3g} s: taken as evenly sampled, each {mean:.6g} s")
        return mean, True
    notes.append(f"uneven sampling, {inside.min():.3g} to {inside.max():.3g} s: interpolated on {step:.4g} s")
    return step, False


def _without_repeats(log: Log, names: list[str]) -> Log:
    """The rows in which the slower of motion and effort is sampled, where an export repeats its value in between.

    The changes of a slow channel all are a whole number of such rows apart; those of a coarse encoder are not.
    """
    held, phase, slow = 1, 0, ""
    for name in names:
        changes = np.flatnonzero(np.diff(log.signals[name])) + 1
        apart = np.diff(changes)
        if len(apart) >= MIN_CHANGES:
            rows = int(np.median(apart))
            first = int(np.bincount(changes % rows).argmax())
            in_phase, follow = np.mean(changes % rows == first), np.mean(apart == rows)
            if rows > held and in_phase >= SAME_PHASE and follow >= MIN_HELD_FRACTION:
                held, phase, slow = rows, first, name
    if held < MIN_HELD:
        return log
    rate = 1.0 / float(np.median(np.diff(log.signals["time"])))
    note = f"{slow} repeats each value in {held} rows: one of them is used, {rate / held:.4g} of {rate:.4g} samples/s"
    signals = {key: values[phase::held] for key, values in log.signals.items()}
    left_out = log.left_out | {f"rows that repeat the {slow}": len(log.signals[slow]) - len(signals[slow])}
    return log._replace(signals=signals, left_out=left_out, notes=[*log.notes, note])


def _despiked(values: Array) -> tuple[Array, int]:
    """A position or effort without single samples that jump there and back, and their number."""
    limit = min(0.5 * float(np.ptp(values)), JUMP * float(np.quantile(np.abs(np.diff(values)), USUAL)))
    spikes = np.flatnonzero(np.abs(values - scipy.ndimage.median_filter(values, 3)) > limit)
    if not limit > 0.0 or spikes.size > 0.01 * len(values):
        return values, 0
    mended = values.copy()
    mended[spikes] = 0.5 * (values[spikes - 1] + values[spikes + 1])
    return mended, int(spikes.size)


def _unwrapped(
    time: Array, position: Array, log: Log, resolution: float, notes: list[str]
) -> tuple[Array, np.ndarray]:
    """The position without the jumps of an encoder that starts again; samples behind other jumps.

    A step that differs by whole periods from what the speed of its neighbours gives over its time is such a jump.
    """
    step, times = np.diff(position), np.diff(time)
    together = times <= GAP * float(np.median(times))
    # of neighbours that are mostly no jumps
    usual_step = scipy.ndimage.median_filter(step / times, 5, mode="mirror") * times
    other = (np.abs(step) > 0.5 * float(np.ptp(position))) & together
    if other.any():
        unit = next(log.columns[name].unit for name in MOTION if name in log.signals)
        period = float(np.median(np.abs(step - usual_step)[other]))
        turn = 2.0 * math.pi * max(round(period / (2.0 * math.pi)), 1)
        if unit in ANGLE and abs(period / turn - 1.0) <= SAME_WRAP:
            period = turn
        wraps = np.round((usual_step - step) / period)
        joined = step + period * wraps
        speed = np.pad(joined / times, 1, mode="edge")
        before, after = speed[:-2], speed[2:]
        unsure = 0.5 * np.abs(after - before) * times + resolution * np.maximum(np.abs(before), np.abs(after))
        differs = np.abs(joined - 0.5 * (before + after) * times) > SAME_WRAP * period + unsure
        jumps = (wraps != 0.0) & together
        if (differs & jumps).sum() <= NO_WRAPS * jumps.sum():
            other, step = differs & jumps, joined
            usual_step = scipy.ndimage.median_filter(joined, 5, mode="mirror")
            position = position[0] + np.r_[0.0, np.cumsum(joined)]
            shown = f"{period / ANGLE[unit][0]:.6g} {unit}" if unit in ANGLE else f"{period:.6g} m"
            times_of = int((jumps & ~differs).sum())
            notes.append(f"position starts again {times_of} times, every {shown}: joined")
    size = np.abs(step)
    usual = float(np.quantile(np.abs(usual_step), USUAL) or np.quantile(size, USUAL))
    jumps = np.flatnonzero(other | ((size > JUMP * usual) & together & (usual > 0.0)))
    if jumps.size > 0.01 * len(position):
        found = f"{jumps.size} times, by {size[jumps].min():.4g} to {size[jumps].max():.4g} (SI)"
        raise ValueError(f"position jumps {found}; allowed: not, or by one size as an encoder starts again")
    return position, jumps + 1


def _quantum(values: Array) -> float:
    """Least step of a signal that has few values; 0: it has many."""
    steps = np.diff(np.unique(values[: 20 * 2048]))
    if len(steps) < 2:
        return 0.0
    least = float(steps[steps > 1e-9 * np.ptp(values)].min(initial=np.ptp(values)))
    whole = steps / least
    return least if float(np.mean(np.abs(whole - np.round(whole)) < 0.05)) > 0.9 else 0.0
