"""From the signals of a log to position and force of a linear axis, or angle and torque of a screw, evenly sampled."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy

from ballscrew_tehl.numerics import Array

from ...tables.headings import ANGLE, EFFORT, MOTION, SPEED, TIME
from . import findings
from .findings import JUMP, UNEVEN, USUAL, Finding, finding, of_refusal, quantum
from .log_file import SLOW, Log

#: a step of time longer than this many usual ones is a gap; jumps of a position that are whole periods within this
#: share are those of an encoder that starts again; most of the jumps that may be none
GAP, SAME_WRAP, NO_WRAPS = 4.5, 0.02, 0.1
#: share of its range that an encoder jumps where it starts again
WHOLE = 0.995
#: slowest and fastest sampling [1/s];  shortest section [samples]
MIN_RATE, MAX_RATE, MIN_SECTION = 20.0, 2e5, 100


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

    of_speed: the motion is a speed; quantum, effort_quantum: least steps of motion and effort, 0: none seen
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
    effort_quantum: float = 0.0
    findings: Sequence[Finding] = ()


class _Rows(NamedTuple):
    """Rows of a log: time [s], motion and effort as in the log, their usual step of time [s]."""

    time: Array
    motion: Array
    effort: Array
    step: float

    def where(self, keep: np.ndarray) -> "_Rows":
        """A part of the rows."""
        return _Rows(self.time[keep], self.motion[keep], self.effort[keep], self.step)


def signals_of(log: Log, drive: Drive) -> Signals:
    """Motion and effort of one side of the drive, in evenly sampled sections, with what their rows show."""
    motion, effort = names = [next(name for name in kind if name in log.signals) for kind in (MOTION, EFFORT)]
    of_speed, (left_out, notes) = motion.endswith("speed"), (dict(log.left_out), list(log.notes))
    rotary, scale, effort_scale = _scales(motion, effort, log.columns[motion].unit, drive)
    for name in names:
        values = log.signals[name]
        if not np.ptp(values) > 0.0:
            raise ValueError(f"{name} is constant, {values[0]:.6g} SI; allowed: an axis that moves both ways")
    rows, result = _own_rate(log, names, left_out)
    words, more = findings.signed(effort, rows.effort)
    rows, result, effort_step = rows._replace(effort=words), result + more, quantum(words)
    jumps = np.empty(0, dtype=int)
    if not of_speed:
        lost = findings.codes(rows.motion)[0]
        lost |= findings.spikes(np.where(lost, np.median(rows.motion), rows.motion))
        # an encoder at rest where it starts again jumps by its whole range
        off = np.abs(rows.motion - scipy.ndimage.median_filter(rows.motion, 3))
        lost &= off < WHOLE * np.ptp(rows.motion)
        result += [finding(f"{motion} jumps there and back", lost, "left out")] * bool(lost.any())
        rows = rows.where(~lost)
        path, jumps = _unwrapped(rows.time, rows.motion, log, rows.step, notes)
        rows = rows._replace(motion=path)
    else:
        path = scipy.integrate.cumulative_trapezoid(rows.motion, rows.time, initial=0.0)
    bad, more = findings.faults(effort, rows.effort, findings.relative_speed(rows.time, path))
    result += more
    left_out["rows with damaged signals"] = sum(one.rows for one in result if "left out" in one.remedy)
    rows, jumps = rows.where(~bad), np.searchsorted(np.flatnonzero(~bad), jumps)
    if len(rows.time) < MIN_SECTION:
        raise ValueError(
            f"{len(rows.time)} rows with all signals; allowed: >= {MIN_SECTION}{of_refusal(result)}"
        )
    resolution = quantum(rows.motion) * abs(scale)
    scaled = rows._replace(motion=rows.motion * scale, effort=rows.effort * effort_scale)
    step, sections = _sections(scaled, jumps, left_out, notes)
    if not sections:
        few = f"pieces between gaps and jumps too short; allowed: >= {MIN_SECTION} samples"
        raise ValueError(few + of_refusal(result))
    turned, more = findings.motoring(effort, [(one.motion, one.effort) for one in sections], step, of_speed)
    sections, result = [Section(*one) for one in turned], result + more
    slow = {}
    for name in SLOW:
        slow[name], more = findings.sensor(name, log.signals[name]) if name in log.signals else (None, [])
        result += more
    return Signals(
        rotary, of_speed, step, resolution, sections, slow["temperature"], slow["preload"], left_out,
        notes + [str(one) for one in result], effort_step * abs(effort_scale), result,
    )  # fmt: skip


def _own_rate(log: Log, names: list[str], left_out: dict[str, int]) -> tuple[_Rows, list[Finding]]:
    """Rows at even times, and of the slower of motion and effort where an export fills its rows in between."""
    time, step, result = findings.even_stamps(log.signals["time"], log.signals[names[0]])
    new = np.diff(time, prepend=-np.inf) > 0.0
    left_out["repeated time stamps"] = repeated = int(np.sum(~new))
    if repeated > findings.REPEATS * len(time):
        few = f"{len(time) - repeated} different times in {len(time)} rows"
        raise ValueError(f"{few}; allowed: a time for each row with digits enough for the sampling")
    rows = _Rows(time, log.signals[names[0]], log.signals[names[1]], step).where(new)
    slowest = max(map(findings.slow_rows, names, (rows.motion, rows.effort)), key=lambda one: one[1])
    keep, each, text = slowest
    if each > 1:
        between = np.ones(len(rows.time), dtype=bool)
        between[keep] = False
        rate = f"one of them is used, {1.0 / (step * each):.4g} of {1.0 / step:.4g} samples/s; export at its own rate"
        result = [*result, finding(text, between, rate)]
        left_out["rows between the samples of a slow channel"] = result[-1].rows
        rows = rows.where(~between)._replace(step=step * each)
    if not rows.step * MIN_RATE <= 1.0:
        raise ValueError(_too_slow(log, rows.step, result))
    return rows, result


def _sections(
    rows: _Rows, jumps: np.ndarray, left_out: dict[str, int], notes: list[str]
) -> tuple[float, list[Section]]:
    """Even pieces between gaps in time and jumps of the position, and their step."""
    steps, step = np.diff(rows.time), rows.step
    gaps, inside = np.flatnonzero(steps > GAP * step) + 1, steps[steps <= GAP * step]
    if gaps.size:
        notes.append(f"{gaps.size} gap(s) in time, the longest {steps.max():.3g} s: the pieces are apart")
    if jumps.size:
        notes.append(f"{jumps.size} jump(s) of the position that are no wrap: the pieces are apart")
    even = float(np.ptp(inside)) <= UNEVEN * step
    step = float(np.mean(inside)) if even else step
    if not even:
        span = f"{inside.min():.3g} to {inside.max():.3g} s"
        notes.append(f"uneven sampling, {span}: interpolated on {step:.4g} s")
    sections, short = [], 0
    for first, last in pairwise(np.unique(np.r_[0, gaps, jumps, len(rows.time)]).tolist()):
        if last - first < MIN_SECTION:
            short += last - first
            continue
        t, x, y = (values[first:last] for values in rows[:3])
        if not even:
            new = np.arange(t[0], t[-1], step)
            x, y = scipy.interpolate.CubicSpline(t, x)(new), np.interp(new, t, y)
        sections.append(Section(x, y))
    left_out["samples in pieces too short"] = short
    return step, sections


def _too_slow(log: Log, step: float, found: list[Finding]) -> str:
    """Refusal of a log sampled too slowly, with the unit of time that would do."""
    column, remedy = log.columns["time"], of_refusal(found) or "log faster"
    raw = step / TIME[column.unit][0] / (column.multiple or 1.0)
    far = not found and step * MIN_RATE > 10.0
    units = {factor: unit for unit, (factor, _) in reversed(TIME.items()) if far}
    fits = [one for one in units if 1.0 / MAX_RATE <= raw * one <= 1.0 / MIN_RATE]
    texts = [f"likely {raw * one:.3g} s: {column.option('time', units[one])}" for one in fits]
    remedy = f"sampled too slowly: {', or '.join([remedy, *texts])}"
    return f"time between samples = {step:.4g} s; allowed: <= {1.0 / MIN_RATE:g} s, {remedy}"


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


def _unwrapped(
    time: Array, position: Array, log: Log, usual_time: float, notes: list[str]
) -> tuple[Array, np.ndarray]:
    """The position without the jumps of an encoder that starts again; samples behind other jumps.

    A step that differs by whole periods from what the speed of its neighbours gives over its time is such a jump.
    """
    step, times = np.diff(position), np.diff(time)
    together = times <= GAP * usual_time
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
        unsure = 0.5 * np.abs(after - before) * times
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
        result = f"{jumps.size} times, by {size[jumps].min():.4g} to {size[jumps].max():.4g} (SI)"
        raise ValueError(f"position jumps {result}; allowed: not, or by one size as an encoder starts again")
    return position, jumps + 1
