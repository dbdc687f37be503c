"""Inertia, offset and friction over speed by least squares on the inverse dynamics of an axis.

    effort = inertia * acceleration + offset + friction(speed)

Friction has a value in each bin of speed, each direction by itself: no shape is assumed. For the inertia it is a
straight line in each, and what an error of the delay would add, the jerk, is taken out; the power of the acceleration
is that without its noise. The offset is the constant of a fit of Coulomb and viscous friction and a constant to the
bins, weighted by their samples, as published identifications have it. Friction is without it.

Standard errors: the sandwich with clusters of time (pieces of a run between reversals), so that the correlation by the
filter and by the position counts; for a bin, shrunk towards what the independent samples of the filtered residual give,
times the mean ratio of both. Intervals: 95 %, Student's t, and in quadrature what follows from the width of a bin and
from half the cutoff: SMEAR times the change of a bin, COARSER times that of the inertia. The effect of a filter on a
smooth curve goes as 1/cutoff^2, so that a third of the change would do there. Forces that are not measured act on the
inertia through the controller, more so at a high cutoff. The limits of the inertia also hold the share MOST_NOISE that
the choice of the cutoff allows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import t as student

from .log_file import Array, Progress
from .motion import MOST_NOISE, Samples, effort_later, filtered
from .signals import Signals

#: most and fewest bins of a direction; samples of the log for one bin
MOST_BINS, FEWEST_BINS, FOR_A_BIN = 60, 6, 150
#: fewest samples of the log in a bin, and independent ones
FEWEST, FEWEST_INDEPENDENT = 10, 2.0
#: longest cluster [s], or so many periods of the cutoff
CLUSTER, CLUSTER_PERIODS = 0.25, 10.0
#: clusters that the pooled error of a bin counts as
POOLED = 4.0
CONFIDENCE = 0.95
#: most delay looked for [s], and in samples
MOST_DELAY, MOST_DELAY_SAMPLES = 5e-3, 4.0
#: samples that the delay is estimated from
FOR_DELAY = 60_000
#: change of a bin and of the inertia by half the cutoff, as it counts in their intervals
SMEAR, COARSER = 0.75, 1.5
#: pieces of the residual over the position
PLACES = 24
#: mean square of their mean residuals over the standard errors from which on friction depends on the position
UNEVEN = 3.0
SIGN = "a force, torque or current is positive where it drives towards positive positions: check both signs"
#: largest standard error of the inertia over its value
VAGUE = 0.2


@dataclass(frozen=True)
class Friction:
    """Bins of speed in rising order: speed, friction without the offset, standard error, 95 % limits, samples."""

    speed: Array
    value: Array
    error: Array
    low: Array
    high: Array
    samples: np.ndarray


@dataclass(frozen=True)
class Identified:
    """What a log says of an axis (SI: kg, N, m/s or kg m2, N m, rad/s).

    inertia with 95 % limits, None where it was given;  offset with limits;  friction
    delay [s] of the effort behind the motion;  residual : root mean square, filtered;  explained : share of variance
    places : position, mean residual, its standard error;  cutoff [Hz];  samples used;  left_out by reason;  notes
    """

    rotary: bool
    inertia: float
    inertia_limits: tuple[float, float] | None
    offset: float
    offset_limits: tuple[float, float]
    friction: Friction
    delay: float
    residual: float
    explained: float
    places: tuple[Array, Array, Array]
    cutoff: float
    samples: int
    left_out: dict[str, int]
    notes: list[str]
    temperature: float | None
    preload: float | None


@dataclass(frozen=True)
class _Bins:
    """Bins of the magnitude of speed: their number in each direction, lowest and highest end."""

    number: int
    low: float
    high: float

    @classmethod
    def of(cls, samples: Samples, wanted: int | None = None) -> _Bins:
        """As many as there are samples for, or as wanted."""
        size = np.abs(samples.speed)
        smaller = min(int((samples.speed > 0.0).sum()), int((samples.speed < 0.0).sum())) * samples.each
        number = wanted or int(np.clip(smaller // FOR_A_BIN, FEWEST_BINS, MOST_BINS))
        return cls(number, float(size.min()), float(size.max()))

    def place(self, speed: Array) -> np.ndarray:
        """Number of the bin of each speed, those of negative speed first."""
        wide = (self.high - self.low or 1.0) / self.number
        place = np.clip(((np.abs(speed) - self.low) / wide).astype(int), 0, self.number - 1)
        return np.where(speed < 0.0, self.number - 1 - place, self.number + place)

    def tally(self, place: np.ndarray, weights: Array | None = None) -> Array:
        """Samples, or their sum of weights, by bin."""
        return np.asarray(np.bincount(place, weights, 2 * self.number), dtype=np.float64)


def _within(values: Array, speed: Array, bins: np.ndarray, count: Array) -> Array:
    """Values less a straight line over speed in each bin: friction may rise within it."""
    safe = np.maximum(count, 1.0)

    def mean(of: Array) -> Array:
        return np.asarray(np.bincount(bins, of, len(count)) / safe)

    across = speed - mean(speed)[bins]
    rest = values - mean(values)[bins]
    spread = mean(across**2)
    slope = np.where(spread > 0.0, mean(across * rest) / np.where(spread > 0.0, spread, 1.0), 0.0)
    return np.asarray(rest - slope[bins] * across)


def _alone(samples: Samples, bins: np.ndarray, count: Array) -> Array:
    """What of the acceleration is neither friction, a straight line over speed in each bin, nor an error of the delay.

    That moves the effort by the inertia times the jerk.
    """
    acceleration, jerk = (
        _within(values, samples.speed, bins, count) for values in (samples.acceleration, samples.jerk)
    )
    power = float(jerk @ jerk)
    return acceleration - (float(jerk @ acceleration) / power if power > 0.0 else 0.0) * jerk


def _power(acceleration: Array, samples: Samples) -> float:
    """Sum of squares of the acceleration without its noise, which would make the inertia too small; at least half."""
    whole = float(acceleration @ acceleration)
    return max(whole - len(acceleration) * samples.noise, 0.5 * whole)


def estimated_delay(signals: Signals, cutoff: float, travel: float) -> tuple[float, bool]:
    """Delay of the effort behind the motion [s] with the least residual on a part of the log; whether it is inside."""
    sections, left = [], FOR_DELAY
    for section in sorted(signals.sections, key=lambda section: -len(section.motion)):
        if left > 0:
            sections.append(section._replace(motion=section.motion[:left], effort=section.effort[:left]))
            left -= len(section.motion)
    part = signals._replace(sections=sections)
    samples = filtered(part, travel, cutoff)
    if len(samples.speed) < FEWEST:
        return 0.0, True
    edges = _Bins.of(samples)
    bins = edges.place(samples.speed)
    count = edges.tally(bins)
    acceleration = _within(samples.acceleration, samples.speed, bins, count)
    power, later = float(acceleration @ acceleration), effort_later(part, samples)

    def residual(delay: float) -> float:
        effort = _within(later(delay), samples.speed, bins, count)
        slope = float(acceleration @ effort) / power
        return float(np.sum((effort - slope * acceleration) ** 2))

    most = max(MOST_DELAY, MOST_DELAY_SAMPLES * signals.step)
    coarse = np.linspace(-most, most, 21)
    best = float(coarse[int(np.argmin([residual(delay) for delay in coarse]))])
    near = 2.0 * most / 20.0
    found = minimize_scalar(
        residual, bounds=(max(best - near, -most), min(best + near, most)), method="bounded",
        options={"xatol": 0.005 * signals.step},
    )  # fmt: skip
    return float(found.x), abs(found.x) < 0.98 * most


def identify(
    signals: Signals,
    inertia: float | None = None,
    travel: float = 0.0,
    delay: float | None = None,
    cutoff: float | None = None,
    bins_wanted: int | None = None,
    progress: Progress = lambda finished, total, what: None,
) -> Identified:
    """Fit to the signals.

    Parameters   inertia : [kg] or [kg m2], None = free;  travel : left out behind a reversal, as the position
                 delay : of the effort [s], None = estimated;  cutoff : of the filter [Hz], None = chosen
                 bins_wanted : bins of a direction, None = by the number of samples
    Raises       ValueError: motion in one direction only, too few samples, inertia not determined
    Source       head of this module
    """
    samples = filtered(signals, travel, cutoff, progress)
    notes = list(signals.notes)
    for sign, name in ((1.0, "positive"), (-1.0, "negative")):
        usable = int((samples.speed * sign > 0.0).sum()) * samples.each
        if usable < FEWEST_BINS * FEWEST:
            raise ValueError(
                f"samples with {name} speed away from reversals = "
                f"{usable}; "
                f"allowed: at least {FEWEST_BINS * FEWEST} in each direction: the offset and friction are told "
                "apart by "
                "both directions; remedy: a log that moves both ways, with longer strokes"
            )
    inside = True
    if delay is None:
        delay, inside = estimated_delay(signals, samples.cutoff, travel)
    if not inside:
        notes.append(
            f"delay of the effort at the end of its range, {1e3 * delay:.3g} ms: check that both signals are of "
            "one log"
        )
    samples = replace(samples, effort=effort_later(signals, samples)(delay))
    edges = _Bins.of(samples, bins_wanted)
    bins = edges.place(samples.speed)
    count = edges.tally(bins)
    coarser = _coarser(signals, travel, 0.5 * samples.cutoff, delay, edges, inertia)
    enough = (count * samples.each >= FEWEST) & (count * samples.each * samples.rate >= FEWEST_INDEPENDENT)
    use = enough[bins]
    left_out = signals.left_out | samples.left_out
    left_out[
        f"bins of speed with fewer than {FEWEST} samples, {FEWEST_INDEPENDENT:g} of them independent"
    ] = int((~use).sum()) * samples.each
    if not (use & (samples.speed > 0.0)).any() or not (use & (samples.speed < 0.0)).any():
        raise ValueError(
            f"no bin of speed with {FEWEST} samples in both directions; allowed: a longer log, or fewer bins (--bins)"
        )
    if not use.all():
        names = ("speed", "acceleration", "jerk", "effort", "position", "run", "section", "index")
        samples = replace(samples, **{name: getattr(samples, name)[use] for name in names})
    kept = np.flatnonzero(enough)
    bins = np.cumsum(enough)[bins[use]] - 1
    change = coarser[0], coarser[1][kept]
    return _fit(signals, samples, bins, change, inertia, delay, left_out, notes)


def _coarser(
    signals: Signals, travel: float, cutoff: float, delay: float, edges: _Bins, inertia: float | None
) -> tuple[float, Array]:
    """Inertia and total of each bin with another cutoff; NaN where there are none."""
    samples = filtered(signals, travel, cutoff)
    if not len(samples.speed):
        return math.nan, np.full(2 * edges.number, math.nan)
    bins = edges.place(samples.speed)
    count = edges.tally(bins)
    effort = effort_later(signals, samples)(delay)
    acceleration = _alone(samples, bins, count)
    power = _power(acceleration, samples)
    value = (
        inertia if inertia is not None else float(acceleration @ effort) / power if power > 0.0 else math.nan
    )
    safe = np.where(count * samples.each * samples.rate >= FEWEST_INDEPENDENT, count, math.nan)
    return value, edges.tally(bins, effort - value * samples.acceleration) / safe


def _fit(
    signals: Signals, samples: Samples, bins: np.ndarray, coarser: tuple[float, Array], inertia: float | None,
    delay: float, left_out: dict[str, int], notes: list[str],
) -> Identified:  # fmt: skip
    count = np.bincount(bins).astype(float)
    acceleration = _alone(samples, bins, count)
    power = _power(acceleration, samples)
    free = inertia is None
    value = float(acceleration @ samples.effort) / max(power, 1e-300) if inertia is None else inertia
    mean_acceleration = np.bincount(bins, samples.acceleration) / count
    total = np.bincount(bins, samples.effort) / count - value * mean_acceleration
    residual = samples.effort - value * samples.acceleration - total[bins]
    speed = np.bincount(bins, samples.speed) / count
    share = _offset_weights(speed, count)
    offset = float(share @ total)
    clusters, of_bin = _clusters(samples, signals.step, bins)
    # sums of what each cluster moves: bins alone, the inertia, the values reported
    size = int(clusters.max()) + 1
    own = np.bincount(clusters * len(count) + bins, residual, size * len(count)).reshape(size, -1) / count
    by_inertia = (
        np.bincount(clusters, acceleration * residual, size) / max(power, 1e-300) if free else np.zeros(size)
    )
    moved = own - np.outer(by_inertia, mean_acceleration)
    of_offset = moved @ share
    values = moved - of_offset[:, None]
    few = size / max(size - 1.0, 1.0)
    deviation = float(np.sqrt(np.mean(residual**2)))
    independent = count * samples.each * samples.rate
    plain = deviation**2 / independent
    seen = few * np.sum(values**2, axis=0)
    ratio = max(float(np.sum(seen * of_bin) / np.sum(plain * of_bin)), 1.0)
    degrees = POOLED + of_bin - 1.0
    errors = np.sqrt((POOLED * ratio * plain + (of_bin - 1.0) * seen) / degrees)
    friction = total - offset
    smeared = SMEAR * np.nan_to_num(coarser[1] - total)
    wide = np.sqrt(
        (student.ppf(0.5 + 0.5 * CONFIDENCE, degrees) * errors) ** 2
        + _within_a_bin(speed, friction) ** 2
        + smeared**2
    )
    usual = float(student.ppf(0.5 + 0.5 * CONFIDENCE, max(size - 1, 1)))
    offset_wide = math.hypot(usual * math.sqrt(few * float(of_offset @ of_offset)), float(share @ smeared))
    noise = samples.noise / max(float(np.var(samples.acceleration)), 1e-300)
    limits = None
    if free:
        error = math.sqrt(few * float(by_inertia @ by_inertia)) * usual
        half = math.hypot(
            error, max(noise, MOST_NOISE) * value, COARSER * float(np.nan_to_num(coarser[0] - value))
        )
        limits = value - half, value + half
        what, option = ("inertia", "--inertia-kgm2") if signals.rotary else ("mass", "--mass-kg")
        if value < -half:
            raise ValueError(f"{what} = {value:.4g}; allowed: > 0: {SIGN}")
        if not half <= usual * VAGUE * value:
            unit = "kg m2" if signals.rotary else "kg"
            raise ValueError(
                f"{what} = {value:.4g} {unit} +- {half:.2g}; allowed: determined by the log: it has too little "
                f"acceleration, or noise or delay beyond it; remedy: {option} with the known value, or a log with "
                "ramps"
            )
    if noise > 10.0 * MOST_NOISE:
        notes.append(f"noise is {100.0 * noise:.2g} % of the acceleration's variance at the lowest cutoff")
    wrong = float(np.sum(count * (np.sign(speed) * friction < 0.0)) / count.sum())
    if wrong > 0.5:
        raise ValueError(
            f"friction along the motion in {100.0 * wrong:.0f} % of the samples; allowed: less than half: {SIGN}"
        )
    places = _places(samples, residual)
    uneven = float(np.mean((places[1] / places[2]) ** 2)) if len(places[1]) else 0.0
    if uneven > UNEVEN:
        effort = float(np.sqrt(np.mean(places[1] ** 2)))
        notes.append(
            f"friction depends on the position: mean residuals there {effort:.2g} {'N m' if signals.rotary else 'N'} "
            "(root mean square); the intervals hold for the positions of this log"
        )
    return Identified(
        signals.rotary, value, limits, offset, (offset - offset_wide, offset + offset_wide),
        Friction(speed, friction, errors, friction - wide, friction + wide, (count * samples.each).astype(int)),
        delay, deviation, 1.0 - deviation**2 / max(float(np.var(samples.effort)), 1e-300),
        places, samples.cutoff, len(bins) * samples.each, left_out, notes,
        signals.temperature, signals.preload,
    )  # fmt: skip


def _within_a_bin(speed: Array, friction: Array) -> Array:
    """By how much the mean over a bin may differ from the friction at its mean speed: a kink there.

    A kink that is seen as the second difference d of neighbouring bins moves the mean of its own by d/8.
    """
    bend = np.zeros(len(speed))
    for side in (speed < 0.0, speed > 0.0):
        if side.sum() >= 3:
            second = np.abs(np.diff(friction[side], 2))
            bend[side] = np.maximum(np.r_[second, second[-1:], 0.0], np.r_[0.0, second[:1], second])
            bend[side] = np.maximum(bend[side], np.r_[second[:1], second, second[-1:]]) / 8.0
    return bend


def _offset_weights(speed: Array, count: Array) -> Array:
    """Shares of the bins in the offset: the constant of a weighted fit with Coulomb and viscous friction."""
    shape = np.column_stack([np.ones(len(speed)), np.sign(speed), speed])
    weighted = shape * count[:, None]
    return np.asarray(np.linalg.pinv(shape.T @ weighted)[0] @ weighted.T)


def _clusters(samples: Samples, step: float, bins: np.ndarray) -> tuple[np.ndarray, Array]:
    """Number of the cluster of each sample, and clusters of each bin."""
    length = max(int(max(CLUSTER, CLUSTER_PERIODS / samples.cutoff) / step), 1)
    piece = samples.index // length
    key = samples.run.astype(np.int64) * (int(piece.max()) + 1) + piece
    _, clusters = np.unique(key, return_inverse=True)
    pairs = np.unique(clusters.astype(np.int64) * (int(bins.max()) + 1) + bins)
    return clusters, np.bincount(pairs % (int(bins.max()) + 1), minlength=int(bins.max()) + 1).astype(float)


def _places(samples: Samples, residual: Array) -> tuple[Array, Array, Array]:
    """Position, mean residual and its standard error over the positions."""
    low, high = float(samples.position.min()), float(samples.position.max())
    place = np.minimum(((samples.position - low) / (high - low or 1.0) * PLACES).astype(int), PLACES - 1)
    count = np.bincount(place, minlength=PLACES)
    some = count * samples.each * samples.rate >= FEWEST_INDEPENDENT
    safe = np.maximum(count, 1)
    mean = np.bincount(place, residual, PLACES) / safe
    error = float(np.std(residual)) / np.sqrt(safe * samples.each * samples.rate)
    middle = low + (np.arange(PLACES) + 0.5) * (high - low) / PLACES
    return middle[some], mean[some], error[some]
