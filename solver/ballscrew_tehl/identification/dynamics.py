"""Inertia, offset and friction over speed by least squares on the inverse dynamics of an axis.

    effort = inertia * acceleration + offset + friction(speed)

Friction has a value in each bin of speed, each direction by itself: no shape is assumed. For the inertia it is a
straight line in each, and what an error of the delay would add, the jerk, is taken out; the power of the acceleration
is that without its noise. The offset is the constant of a fit of Coulomb and viscous friction and a constant to the
bins, weighted by their samples, as published identifications have it. Friction is without it.

Standard errors: the sandwich with clusters of time (pieces of a run between reversals), so that the correlation by the
filter and by the position counts; for a bin, shrunk towards what the independent samples of the filtered residual give,
times the mean ratio of both. Intervals: 95 %, Student's t, and in quadrature what follows from the width of a bin and
from half the cutoff: SMEAR times the change of a bin, COARSER times that of the inertia, LATER times that of the delay
(added, as a bias), as much by FARTHER times the travel behind reversals. The effect of a filter on a smooth curve goes
as 1/cutoff^2, so that a third of the change would do there. Forces that are not measured act on the inertia through the
controller, more so at a high cutoff. The limits of the inertia also hold the share MAX_NOISE that the choice of the
cutoff allows.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import t as student

from ..physics.ball_law import Array
from .directions import LIMIT, LINEAR, ROTARY, Bidirectional, Friction, Units, bidirectional_friction, varies
from .motion import MAX_NOISE, OF_SAMPLES, Samples, effort_later, filtered
from .regression import CONFIDENCE, MIN_BINS, Bins, alone, clusters_of, power, slope_moves, within
from .signals import Signals

#: fewest samples of the log in a bin, and independent ones
MIN_SAMPLES, MIN_INDEPENDENT = 10, 2.0
#: clusters that the pooled error of a bin counts as
POOLED = 4.0
#: most delay looked for [s], and in samples
MAX_DELAY, MAX_DELAY_SAMPLES = 5e-3, 4.0
#: change of a bin, of the inertia and of the delay by half the cutoff, as it counts in their intervals; the noise of an
#: encoder that comes back through the controller moves the delay as the cutoff or more, all of it at most twice that,
#: a bias, which adds to the random half
SMEAR, COARSER, LATER = 0.75, 1.5, 2.0
#: travel left out behind a reversal over the usual one, whose effect on inertia and delay counts the same, for friction
#: may still rise; share of the samples that has to be left
FARTHER, FARTHER_LEFT = 4.0, 0.5
#: pieces of the residual over the position
PLACES = 24
#: mean square of their mean residuals over the standard errors from which on friction depends on the position
UNEVEN = 3.0
SIGN = (
    "a force, torque or current is positive where it drives towards positive positions: check both signs; a left-hand "
    "thread has a negative --lead-mm, a drive that counts the other way a negative --ratio or torque constant"
)
#: largest standard error of the inertia over its value;  fraction of samples with friction along the motion
VAGUE, MAX_ALONG = 0.2, 0.25


@dataclass(frozen=True)
class Identified:
    """What a log says of an axis (SI: kg, N, m/s or kg m2, N m, rad/s).

    inertia with 95 % limits, None where it was given;  offset with limits
    offset_error : standard one of an offset that was given, None = the offset is by convention;  friction
    delay [s] of the effort behind the motion with limits, None where it was given
    residual : root mean square, filtered;  explained : share of variance
    places : position, mean residual, its standard error;  cutoff [Hz];  samples used;  left_out by reason;  notes
    """

    rotary: bool
    inertia: float
    inertia_limits: tuple[float, float] | None
    offset: float
    offset_limits: tuple[float, float]
    offset_error: float | None
    friction: Friction
    delay: float
    delay_limits: tuple[float, float] | None
    residual: float
    explained: float
    places: tuple[Array, Array, Array]
    cutoff: float
    samples: int
    left_out: dict[str, int]
    notes: list[str]
    temperature: float | None
    preload: float | None

    @property
    def units(self) -> Units:
        """Keys, names and units."""
        return ROTARY if self.rotary else LINEAR

    @cached_property
    def both(self) -> Bidirectional:
        """Both directions at common speeds."""
        return bidirectional_friction(self.friction, self.offset_error or 0.0)


def estimated_delay(samples: Samples, later: Callable[[float], Array], step: float) -> tuple[float, bool]:
    """Delay of the effort behind the motion [s] with the least residual; whether it is inside the range.

    Parameters   later : effort at the samples by delay;  step : of the log [s]
    """
    edges = Bins.of(samples)
    bins = edges.place(samples.speed)
    count = edges.tally(bins)
    acceleration = within(samples.acceleration, samples.speed, bins, count)
    squares = float(acceleration @ acceleration)

    def residual(delay: float) -> float:
        effort = within(later(delay), samples.speed, bins, count)
        slope = float(acceleration @ effort) / squares
        return float(np.sum((effort - slope * acceleration) ** 2))

    limit = max(MAX_DELAY, MAX_DELAY_SAMPLES * step)
    coarse = np.linspace(-limit, limit, 21)
    best = float(coarse[int(np.argmin([residual(delay) for delay in coarse]))])
    near = 2.0 * limit / 20.0
    found = minimize_scalar(
        residual, bounds=(max(best - near, -limit), min(best + near, limit)), method="bounded",
        options={"xatol": 0.005 * step},
    )  # fmt: skip
    return float(found.x), abs(found.x) < 0.98 * limit


def identify(
    signals: Signals,
    inertia: float | None = None,
    travel: float = 0.0,
    delay: float | None = None,
    cutoff: float | None = None,
    bins_wanted: int | None = None,
    offset: tuple[float, float] | None = None,
) -> Identified:
    """Fit to the signals.

    Parameters   inertia : [kg] or [kg m2], None = free;  travel : left out behind a reversal, as the position
                 delay : of the effort [s], None = estimated;  cutoff : of the filter [Hz], None = chosen
                 bins_wanted : bins of a direction, None = by the number of samples
                 offset : known, with its standard error [N] or [N m], None = by convention
    Raises       ValueError: motion in one direction only, too few samples, inertia not determined
    Source       head of this module
    """
    samples = filtered(signals, travel, cutoff)
    notes = list(signals.notes)
    for sign, name in ((1.0, "positive"), (-1.0, "negative")):
        usable = int((samples.speed * sign > 0.0).sum()) * samples.each
        if usable < MIN_BINS * MIN_SAMPLES:
            raise ValueError(
                f"samples with {name} speed away from reversals = {usable}; allowed: at least {MIN_BINS * MIN_SAMPLES} "
                "in each direction: both directions separate offset and friction; remedy: a log that moves both "
                "ways, with longer strokes, and a column with its sign, no magnitude"
            )
    inside, known = True, delay is not None
    later = effort_later(signals, samples)
    if delay is None:
        delay, inside = estimated_delay(samples, later, signals.step)
    user = _User(inertia, offset, delay, known)
    if not inside:
        notes.append(
            f"delay of the effort at the end of its range, {1e3 * delay:.3g} ms: check that both signals are of one log"
        )
    edges = Bins.of(samples, bins_wanted)
    count = edges.tally(edges.place(samples.speed))
    farther = filtered(signals, FARTHER * travel, samples.cutoff)
    others = [_other(signals, filtered(signals, travel, 0.5 * samples.cutoff), edges, user)]
    if len(farther.speed) >= FARTHER_LEFT * len(samples.speed):
        others.append(_other(signals, farther, edges, user))
    enough = (count * samples.each >= MIN_SAMPLES) & (count * samples.each * samples.rate >= MIN_INDEPENDENT)
    use = enough[edges.place(samples.speed)]
    left_out = signals.left_out | samples.left_out
    left_out[
        f"bins of speed with fewer than {MIN_SAMPLES} samples, {MIN_INDEPENDENT:g} of them independent"
    ] = int((~use).sum()) * samples.each
    if not (use & (samples.speed > 0.0)).any() or not (use & (samples.speed < 0.0)).any():
        raise ValueError(
            f"no bin of speed with {MIN_SAMPLES} samples in both directions; allowed: a longer log, or fewer bins "
            "(--bins)"
        )
    samples = replace(samples, effort=later(delay))
    samples = replace(samples, **{name: getattr(samples, name)[use] for name in OF_SAMPLES})
    bins = np.cumsum(enough)[edges.place(samples.speed)] - 1
    others = [other._replace(total=other.total[enough]) for other in others]
    return _result(signals, samples, _fit(signals, samples, bins, user), others, user, left_out, notes)


class _User(NamedTuple):
    """What identify was given; delay as used, delay_known: it was given."""

    inertia: float | None
    offset: tuple[float, float] | None
    delay: float
    delay_known: bool


class _Other(NamedTuple):
    """Inertia, delay and total of each bin with another cutoff or travel; NaN where there are none."""

    inertia: float
    delay: float
    total: Array


def _other(signals: Signals, samples: Samples, edges: Bins, user: _User) -> _Other:
    if not len(samples.speed):
        return _Other(math.nan, math.nan, np.full(2 * edges.number, math.nan))
    bins = edges.place(samples.speed)
    count = edges.tally(bins)
    effort = effort_later(signals, samples)(user.delay)
    acceleration, jerk = alone(samples, bins, count)
    value = user.inertia
    if value is None:
        value = float(acceleration @ effort) / power(acceleration, samples)
    late = float(jerk @ effort) / max(abs(value) * float(jerk @ jerk), 1e-300)
    safe = np.where(count * samples.each * samples.rate >= MIN_INDEPENDENT, count, math.nan)
    return _Other(value, user.delay - late, edges.tally(bins, effort - value * samples.acceleration) / safe)


class _Fit(NamedTuple):
    """Values of the least squares and their random errors.

    number, speed, total : samples of a bin, its speed and effort with the offset
    weights : of the bins in the offset, 0 if that is known;  residual : of the samples;  seen : inertia of the effort
    errors, wide : standard error of a bin, half of its 95 % interval;  inertia_half, delay_half : half of theirs
    usual : quantile of Student's t with as many clusters
    """

    inertia: float
    offset: float
    number: Array
    speed: Array
    total: Array
    weights: Array
    residual: Array
    seen: float
    errors: Array
    wide: Array
    inertia_half: float
    delay_half: float
    offset_variance: float
    usual: float


def _fit(signals: Signals, samples: Samples, bins: np.ndarray, user: _User) -> _Fit:
    """Inertia, bins, offset; errors from what each cluster of time moves them."""
    count = np.bincount(bins).astype(float)
    acceleration, jerk = alone(samples, bins, count)
    squares = power(acceleration, samples)
    seen = float(acceleration @ samples.effort) / squares
    inertia = seen if user.inertia is None else user.inertia
    mean_acceleration = np.bincount(bins, samples.acceleration) / count
    total = np.bincount(bins, samples.effort) / count - inertia * mean_acceleration
    residual = samples.effort - inertia * samples.acceleration - total[bins]
    speed = np.bincount(bins, samples.speed) / count
    weights = _offset_weights(speed, count)
    offset = float(weights @ total)
    if user.offset:
        offset, weights = user.offset[0], np.zeros(len(count))
    clusters, of_bin = clusters_of(samples, signals.step, bins)
    # sums of what each cluster moves: bins alone, the inertia, the values reported
    size = int(clusters.max()) + 1
    moved = np.bincount(clusters * len(count) + bins, residual, size * len(count)).reshape(size, -1) / count
    independent = count * samples.each * samples.rate
    freedom = max(1.0 - 2.0 * (len(count) + 1.0) / float(independent.sum()), 0.1)
    by_inertia, inertia_half = slope_moves(acceleration, residual, clusters, squares, freedom)
    by_jerk = max(abs(inertia) * float(jerk @ jerk), 1e-300)
    moved -= np.outer(by_inertia * (user.inertia is None), mean_acceleration)
    of_offset = moved @ weights
    few = size / max(size - 1.0, 1.0)
    plain = float(np.mean(residual**2)) / independent
    variance = few * np.sum((moved - of_offset[:, None]) ** 2, axis=0)
    ratio = max(float(np.sum(variance * of_bin) / np.sum(plain * of_bin)), 1.0)
    degrees = POOLED + of_bin - 1.0
    errors = np.sqrt((POOLED * ratio * plain + (of_bin - 1.0) * variance) / degrees)
    return _Fit(
        inertia, offset, count, speed, total, weights, residual, seen, errors,
        student.ppf(0.5 + 0.5 * CONFIDENCE, degrees) * errors, inertia_half,
        slope_moves(jerk, residual, clusters, by_jerk, freedom)[1] if not user.delay_known else 0.0,
        # a bin that one cluster fills hides the error of that
        max(few * float(of_offset @ of_offset), ratio * float(weights**2 @ plain)),
        float(student.ppf(0.5 + 0.5 * CONFIDENCE, max(size - 1, 1))),
    )  # fmt: skip


def _result(
    signals: Signals, samples: Samples, fit: _Fit, others: list[_Other], user: _User, left_out: dict[str, int],
    notes: list[str],
) -> Identified:  # fmt: skip
    """Values with limits that hold what another cutoff and travel change.

    Raises       ValueError: the log does not determine them
    """
    deviation = float(np.sqrt(np.mean(fit.residual**2)))
    explained = 1.0 - deviation**2 / max(float(np.var(samples.effort)), 1e-300)
    if not explained >= 0.0:
        units, value = ROTARY if signals.rotary else LINEAR, fit.inertia
        what, unit = units.names[0], units.shown[0]
        if user.inertia is not None:
            raise ValueError(
                f"inertia given = {value:.4g} {unit}; the log shows about {fit.seen:.3g} {unit}, and the given one "
                "explains nothing of the effort; remedy: check it and the units of the log, or leave it out"
            )
        raise ValueError(
            f"{what} = {value:.4g} {unit} explains nothing of the effort; allowed: motion and effort of one log, "
            "each with a new value in each row; remedy: check columns, signs and sampling"
        )
    noise = samples.noise / max(float(np.var(samples.acceleration)), 1e-300)
    limits = None if user.inertia is not None else _inertia_limits(signals, fit, noise, others)
    friction, offset_error = fit.total - fit.offset, user.offset[1] if user.offset else 0.0
    wrong = float(np.sum(fit.number * (np.sign(fit.speed) * friction < 0.0)) / fit.number.sum())
    if wrong > MAX_ALONG:
        raise ValueError(
            f"friction along the motion in {100.0 * wrong:.0f} % of the samples; allowed: at most "
            f"{100.0 * MAX_ALONG:.0f} %: {SIGN}{_magnitude(signals)}"
        )
    smeared = SMEAR * np.nan_to_num(others[0].total - fit.total)
    wide = np.sqrt(
        fit.wide**2 + _within_a_bin(fit.speed, friction) ** 2 + smeared**2 + (LIMIT * offset_error) ** 2
    )
    offset_wide = math.hypot(
        fit.usual * math.sqrt(fit.offset_variance), float(fit.weights @ smeared), LIMIT * offset_error
    )
    delay_limits = None
    if not user.delay_known:
        changes = [LATER * float(np.nan_to_num(other.delay - user.delay)) for other in others]
        half = fit.delay_half + math.hypot(*changes)
        delay_limits = user.delay - half, user.delay + half
    bins = Friction(
        fit.speed, friction, np.hypot(fit.errors, offset_error), friction - wide, friction + wide,
        (fit.number * samples.each).astype(int),
    )  # fmt: skip
    found = Identified(
        signals.rotary, fit.inertia, limits, fit.offset, (fit.offset - offset_wide, fit.offset + offset_wide),
        user.offset[1] if user.offset else None, bins, user.delay, delay_limits, deviation, explained,
        _places(samples, fit.residual), samples.cutoff, len(samples.speed) * samples.each, left_out, notes,
        signals.temperature, signals.preload,
    )  # fmt: skip
    found.notes.extend(_notes(found, noise))
    return found


def _inertia_limits(signals: Signals, fit: _Fit, noise: float, others: list[_Other]) -> tuple[float, float]:
    """95 % interval of a fitted inertia.

    Raises       ValueError: negative, or not determined
    """
    value = fit.inertia
    changes = (COARSER * float(np.nan_to_num(other.inertia - value)) for other in others)
    half = math.hypot(fit.inertia_half, max(noise, MAX_NOISE) * value, *changes)
    units = ROTARY if signals.rotary else LINEAR
    what, unit, option = units.names[0], units.shown[0], f"--{units.inertia.format('').replace('_', '-')}"
    if value < -half:
        raise ValueError(f"{what} = {value:.4g}; allowed: > 0: {SIGN}")
    if not half <= fit.usual * VAGUE * value:
        raise ValueError(
            f"{what} = {value:.4g} {unit} +- {half:.2g}; allowed: determined by the log: it has too little "
            f"acceleration, or noise or delay beyond it; remedy: {option} with the known value, or a log with ramps"
            f"{_magnitude(signals)}"
        )
    return value - half, value + half


def _magnitude(signals: Signals) -> str:
    """Hint where the effort never changes its sign."""
    never = all(float(section.effort.min()) >= 0.0 for section in signals.sections)
    return "; the effort is never negative: a magnitude without its sign?" if never else ""


def _notes(found: Identified, noise: float) -> list[str]:
    """What limits the result."""
    notes, unit, both, places = [], found.units.shown[1], found.both, found.places
    if noise > 10.0 * MAX_NOISE:
        notes.append(f"noise is {100.0 * noise:.2g} % of the acceleration's variance at the lowest cutoff")
    if varies(both):
        notes.append(
            f"(f+ - f-)/2, half the difference of friction between the directions, varies with speed, "
            f"{both.difference.min():+.3g} to {both.difference.max():+.3g} {unit}"
            + (": it cannot all be an offset" if found.offset_error is None else "")
        )
    uneven = float(np.mean((places[1] / places[2]) ** 2)) if len(places[1]) else 0.0
    if uneven > UNEVEN:
        effort = float(np.sqrt(np.mean(places[1] ** 2)))
        notes.append(
            f"friction depends on the position: mean residuals there {effort:.2g} {unit} (root mean square); the "
            "intervals hold for the positions of this log"
            + ("" if found.delay_limits is None else ", that of the delay leaves out the bias by them")
        )
    return notes


def _within_a_bin(speed: Array, friction: Array) -> Array:
    """By how much the mean over a bin may differ from the friction at its mean speed: a kink there.

    A kink that is seen as the second difference d of neighbouring bins moves the mean of its own by d/8.
    """
    bend = np.zeros(len(speed))
    for side in (speed < 0.0, speed > 0.0):
        if side.sum() >= 3:
            second = np.pad(np.abs(np.diff(friction[side], 2)), 2, mode="edge")
            bend[side] = np.max([second[:-2], second[1:-1], second[2:]], axis=0) / 8.0
    return bend


def _offset_weights(speed: Array, count: Array) -> Array:
    """Shares of the bins in the offset: the constant of a weighted fit with Coulomb and viscous friction."""
    shape = np.column_stack([np.ones(len(speed)), np.sign(speed), speed])
    weighted = shape * count[:, None]
    return np.asarray(np.linalg.pinv(shape.T @ weighted)[0] @ weighted.T)


def _places(samples: Samples, residual: Array) -> tuple[Array, Array, Array]:
    """Position, mean residual and its standard error over the positions."""
    low, high = float(samples.position.min()), float(samples.position.max())
    place = np.minimum(((samples.position - low) / (high - low or 1.0) * PLACES).astype(int), PLACES - 1)
    count = np.bincount(place, minlength=PLACES)
    some = count * samples.each * samples.rate >= MIN_INDEPENDENT
    safe = np.maximum(count, 1)
    mean = np.bincount(place, residual, PLACES) / safe
    error = float(np.std(residual)) / np.sqrt(safe * samples.each * samples.rate)
    middle = low + (np.arange(PLACES) + 0.5) * (high - low) / PLACES
    return middle[some], mean[some], error[some]
