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
as 1/cutoff^2, so that a third would do there; forces that are not measured act on the inertia through the controller,
more so at a high cutoff. The limits of the inertia also hold the share MAX_NOISE of the choice of the cutoff.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy

from ..physics.ball_law import Array
from . import directions
from .directions import LIMIT, PROBABILITY, UNITS, Bidirectional, Friction, option
from .motion import MAX_NOISE, Samples, chosen_cutoff, differences, effort_curves, filtered, white_noise
from .findings import of_refusal
from .signals import Signals

#: most and fewest bins of a direction; samples of the log for one bin, fewest independent ones
MAX_BINS, MIN_BINS, FOR_A_BIN, MIN_INDEPENDENT = 60, 6, 150, 2.0
#: longest cluster [s], or so many periods of the cutoff
CLUSTER, CLUSTER_PERIODS = 0.25, 10.0
#: largest share of a cluster in a slope that is allowed for;  clusters that the pooled error of a bin counts as
LEVERAGE, POOLED = 0.5, 10.0
#: least variance of a bin over that of as many independent samples: pieces shorter than the filter have more
MIN_RATIO = 0.25
#: fewest samples of the log in a bin
MIN_SAMPLES = 10
#: delays looked for [s], and their step;  longest lag of a filter [s], least one;  samples that they are looked for in
DELAYS, DELAY_STEP, MAX_LAG, LEAST_LAG, LOOKED_AT = (-0.02, 0.05), 1.25e-3, 0.15, 2e-3, 30_000
#: misfit over that of one sample by which a delay is told from another, a filter from none;  steps of plausible delays
#: from which on the data do not tell one
TELL, LAG_TELLS, UNTOLD = 6.0, 15.0, 3.5
#: noise of the acceleration in a misfit, at two times and safely
NOISES = 3.0
#: power of a wave over the usual one, its share of the variance of the residual;  least share of a loss or drift, of
#: samples that brake;  error of a loss that tells none
WAVE, WAVE_SHARE, LEAST_PATTERN, BRAKES, UNSURE_LOSS = 30.0, 0.02, 0.02, 0.03, 0.02
#: delay [s] that a filter may have made;  longest period of a resonance [s]
LATE, SLOWEST = 4e-3, 0.3
#: share of the error by steps that noise leaves, from which on data do not exclude truncation;  variance of the residual
#: over that of the noise from which on something else acts
KEPT, MORE = 0.05, 2.5
#: share by which the noise of the acceleration is unsure
NOISE_UNSURE = 0.2
#: square of a second difference over its variance that is by chance
BY_CHANCE = 4.0
#: change of a bin, of the inertia and of the delay by half the cutoff, as it counts in their intervals; the noise of an
#: encoder that comes back through the controller moves the delay as the cutoff or more, all of it at most twice that,
#: a bias, which adds to the random half
SMEAR, COARSER, LATER = 0.75, 1.5, 2.0
#: travel left out behind a reversal over the usual one, whose effect on inertia and delay counts the same, for friction
#: may still rise; share of the samples that has to be left
FARTHER, FARTHER_LEFT = 4.0, 0.5
#: pieces of the residual over the position;  mean square of their means over the standard errors from which on friction
#: depends on the position
PLACES, UNEVEN = 24, 3.0
SIDES = {1.0: "positive", -1.0: "negative"}
SIGN = (
    "a force, torque or current is positive where it drives towards positive positions: check both signs; a left-hand "
    "thread has a negative --lead-mm, a drive that counts the other way a negative --ratio or torque constant"
)
MAGNITUDE = "a magnitude without its sign? export it with its sign"
#: inertia of one direction over that of the other, at least, where a load pulls one way
ALIKE = 0.3
#: largest standard error of the inertia over its value;  fraction of samples with friction along the motion
VAGUE, MAX_ALONG = 0.2, 0.25


def bins_of(samples: Samples, wanted: int | None = None) -> tuple[int, Callable[[Array], np.ndarray]]:
    """Number of bins of speed in both directions, those of negative speed first; bins of a speed."""
    size = np.abs(samples.speed)
    sides = [int((samples.speed * sign > 0.0).sum()) * samples.each for sign in SIDES]
    smaller = min((side for side in sides if side), default=0)
    number = wanted or int(np.clip(smaller // FOR_A_BIN, MIN_BINS, MAX_BINS))
    low, high = float(size.min()), float(size.max())

    def bins(speed: Array) -> np.ndarray:
        width = (high - low or 1.0) / number
        place = np.clip(((np.abs(speed) - low) / width).astype(int), 0, number - 1)
        return np.where(speed < 0.0, number - 1 - place, number + place)

    return 2 * number, bins


def without_friction(speed: Array, bins: np.ndarray) -> Callable[[Array], Array]:
    """Takes a straight line over speed in each bin out of values: friction may rise within it."""
    safe = np.maximum(np.bincount(bins), 1.0)
    across = speed - (np.bincount(bins, speed) / safe)[bins]
    squares = np.maximum(np.bincount(bins, across**2), 1e-300)

    def rest(values: Array) -> Array:
        values = values - (np.bincount(bins, values) / safe)[bins]
        return np.asarray(values - (np.bincount(bins, across * values) / squares)[bins] * across)

    return rest


class Searched(NamedTuple):
    """Delays [s] that were tried, for each the lag [s] with the least misfit, inertia, misfit;  one: of one sample."""

    delay: Array
    lag: Array
    inertia: Array
    misfit: Array
    one: float

    @property
    def best(self) -> int:
        """Place of the least misfit."""
        return int(np.argmin(self.misfit))


def searched(samples: Samples, delays: Array, inertia: float | None) -> tuple[Searched, Searched]:
    """Misfit of the effort e at delays, without and with a lag: e(t + delay) + lag e'(t + delay) is that before a filter
    of first order.
    """
    samples = samples.where(np.arange(len(samples.speed)) % max(len(samples.speed) // LOOKED_AT, 1) == 0)
    within = without_friction(samples.speed, bins_of(samples)[1](samples.speed))
    whole = within(samples.acceleration)

    def product(one: Array, other: Array) -> float:
        # not by a library with threads, which wait for each other on a busy machine
        return float(np.sum(one * other))

    squares, rows = max(product(whole, whole), 1e-300), []
    for delay in delays:
        effort, rate = (within(samples.effort(delay, k)) for k in (0, 1))
        moved = (product(whole, effort) / squares, product(whole, rate) / squares)
        if inertia is not None:
            moved = inertia, 0.0
        rest, more = effort - moved[0] * whole, rate - moved[1] * whole
        misfit, bend, along = product(rest, rest), product(more, more), max(-product(rest, more), 0.0)
        # noise would make the lag too small
        lag = min(along / max(bend - len(rate) * samples.rate_noise, 0.2 * bend, 1e-300), MAX_LAG)
        less = misfit - along**2 / max(bend, 1e-300)
        rows.append((delay, 0.0, moved[0], misfit, lag, moved[0] + lag * moved[1], less))
    columns = np.array(rows).T
    one = max(float(columns[6].min()), 0.0) / max(len(whole) * samples.each * samples.rate, 1.0)
    return Searched(*columns[:4], one), Searched(*columns[[0, 4, 5, 6]], one)


class Timing(NamedTuple):
    """Delay of the effort [s] and lag [s] of its filter; how far the inertia may be off by both, whether the data tell
    the delay, its least and largest plausible value.
    """

    delay: float
    lag: float = 0.0
    inertia: float = 0.0
    told: bool = True
    low: float = 0.0
    high: float = 0.0


def expected(signals: Signals, samples: Samples, delay: float, delays: Array, inertia: float | None) -> Array:
    """Misfit at delays of an effort without noise, with the inertia and friction that are seen at a delay."""
    size, bins = bins_of(samples)
    place = bins(samples.speed)
    fit = fit_of(samples, Timing(delay), place, size, inertia)
    some = np.isfinite(fit.total)
    speeds = np.bincount(place, samples.speed, size)[some] / fit.number[some]
    constant, coulomb, viscous = (
        offset_weights(speeds, fit.number[some], k) @ fit.total[some] for k in range(3)
    )
    sections = []
    for section in signals.sections:
        _, speed, acceleration = differences(section.motion, samples.cutoff, signals)
        effort = fit.inertia * acceleration + constant + coulomb * np.sign(speed) + viscous * speed
        sections.append(section._replace(effort=np.pad(effort, 1, mode="edge")))
    same = effort_curves(signals._replace(sections=sections), samples.cutoff)
    same_noise = min(len(samples.speed), LOOKED_AT) * samples.noise
    misfit = searched(samples._replace(curves=same), delays - delay, inertia)[0].misfit
    # the noise of the acceleration is not that of the effort
    return np.asarray(np.maximum(misfit - misfit.min() - NOISES * fit.inertia**2 * same_noise, 0.0))


def timing(signals: Signals, samples: Samples, delay: float | None, inertia: float | None) -> Timing:
    """Of the effort behind the motion; delay: known."""
    delays = np.arange(DELAYS[0], DELAYS[1], DELAY_STEP) if delay is None else np.array([delay])
    plain, lagged = searched(samples, delays, inertia)
    k = lagged.best
    lags = lagged.misfit[k] + LAG_TELLS * lagged.one < plain.misfit.min()
    with_lag = bool(lags and lagged.lag[k] > max(LEAST_LAG, samples.step))
    found = lagged if with_lag else plain
    best, step = float(found.delay[found.best]), DELAY_STEP
    if with_lag:
        if delay is None:
            found = searched(samples, best + np.linspace(-0.01, 0.01, 41), inertia)[1]
        allowed, at = found.misfit <= found.misfit.min() + TELL * found.one, found.best
    else:
        if delay is None:
            allowed = expected(signals, samples, best, delays, inertia) <= TELL * found.one
            allowed[found.best] = True
        else:
            allowed = np.array([True])
        if np.ptp(found.delay[allowed]) <= UNTOLD * step and delay is None:
            while step > 0.01 * samples.step:
                # finer about the best
                found = searched(samples, best + step * np.linspace(-1.0, 1.0, 9), inertia)[0]
                best, step = float(found.delay[found.best]), 0.25 * step
            return Timing(best)
        # the least one that the data allow
        at = int(np.argmin(np.where(allowed, np.abs(found.delay), np.inf)))
    off = float(np.max(np.abs(found.inertia[allowed] - found.inertia[at])))
    low, high = found.delay[allowed].min(), found.delay[allowed].max()
    return Timing(float(found.delay[at]), float(found.lag[at]), off, with_lag, float(low), float(high))


class Fit(NamedTuple):
    """Inertia and bins of speed at a delay and lag of the effort [s].

    columns : regressors of the effort, the acceleration first;  within : without friction, a straight line over speed
    in each bin;  influence : of each sample on each coefficient
    number, total : samples of each bin, mean effort without that of the columns, NaN with too few samples
    """

    samples: Samples
    bins: np.ndarray
    timing: Timing
    effort: Array
    columns: Array
    influence: Array
    coefficients: Array
    number: Array
    total: Array
    residual: Array

    @property
    def inertia(self) -> float:
        """The first coefficient."""
        return float(self.coefficients[0])


def fit_of(
    samples: Samples,
    time: Timing,
    bins: np.ndarray,
    size: int,
    inertia: float | None,
    more: Sequence[Array] = (),
) -> Fit:
    """Fit to samples in bins, NaN without samples; inertia None: free; more: other regressors."""
    effort = samples.effort(time.delay) + time.lag * samples.effort(time.delay, 1)
    within, number = without_friction(samples.speed, bins), np.bincount(bins, minlength=size).astype(float)
    safe = np.where(number * samples.each * samples.rate >= MIN_INDEPENDENT, number, math.nan)

    def solved(columns: list[Array]) -> Fit:
        flat = np.column_stack([within(column) for column in columns])
        scale = np.sqrt(np.maximum(np.sum(flat**2, axis=0), 1e-300))
        flat = flat / scale
        gram = flat.T @ flat
        # noise would make the inertia too small
        gram[0, 0] -= min(len(effort) * samples.noise / scale[0] ** 2, 0.5 * gram[0, 0])
        influence = flat @ np.linalg.pinv(gram, rcond=1e-12, hermitian=True) / scale
        coefficients = influence.T @ effort
        if inertia is not None:
            influence[:, 1:] = (
                flat[:, 1:] @ np.linalg.pinv(gram[1:, 1:], rcond=1e-12, hermitian=True) / scale[1:]
            )
            coefficients = influence.T @ (effort - inertia * samples.acceleration)
            coefficients[0] = inertia
        every = np.column_stack(columns)
        rest = effort - every @ coefficients
        total = np.bincount(bins, rest, size) / safe
        residual = rest - total[bins]
        return Fit(samples, bins, time, effort, every, influence, coefficients, number, total, residual)

    fit = solved([samples.acceleration, *more])
    if not time.told:
        return fit
    # an error of the delay moves the effort by its derivative: that of the inertia and of friction that rises
    some = np.isfinite(fit.total)
    speed = np.bincount(bins, samples.speed, size)[some] / number[some]
    slope = float(offset_weights(speed, number[some], 2) @ fit.total[some])
    change = fit.inertia * samples.jerk + slope * samples.acceleration
    return solved([samples.acceleration, *more, change])


def offset_weights(speed: Array, number: Array, row: int = 0) -> Array:
    """Of the bins in the constant, or another row, of a fit of a constant, Coulomb and viscous friction."""
    shape = np.column_stack([np.ones(len(speed)), np.sign(speed), speed])
    weighted = shape * number[:, None]
    return np.asarray(np.linalg.pinv(shape.T @ weighted)[row] @ weighted.T)


Pattern = Callable[[Samples], Array]


def wave_of(
    place: Array, residual: Array, shortest: float, turns: bool, longest: float = math.inf
) -> tuple[float, float]:
    """Wave number over a place or time that the residual shows most clearly, not shorter than a period, and its
    amplitude; 0: none; turns: a whole number of waves a turn is meant where it is near.
    """
    place = place - place.min()
    span = float(place.max()) or 1.0
    number = int(np.clip(8.0 * span / shortest, 512, 2**18))
    power = (
        np.abs(
            np.fft.rfft(np.bincount((place / span * (number - 1)).astype(int), residual, number), 2 * number)
        )
        ** 2
    )
    # at least two periods in the span, eight pieces of it in one
    low = max(4, math.ceil(2.0 * span / longest))
    high = max(number // 4, low + 2)
    at = low + int(np.argmax((power / scipy.ndimage.median_filter(power, 101, mode="nearest"))[low:high]))
    usual = float(np.median(power[max(at - 50, low) : at + 51]))
    exact = math.pi * np.linspace(at - 1.0, at + 1.0, 41) / span
    if turns and exact[0] < (whole := round(exact[20])) < exact[-1]:
        exact = np.array([float(whole)])
    sizes = [abs(np.sum(residual * np.exp(-1j * k * place))) for k in exact]
    amplitude = 2.0 * max(sizes) / len(residual)
    clear = power[at] > WAVE * usual and amplitude**2 > WAVE_SHARE * 2.0 * float(np.mean(residual**2))
    return (float(exact[int(np.argmax(sizes))]), amplitude) if clear else (0.0, 0.0)


def patterns_of(fit: Fit, signals: Signals, inertia: float | None, notes: list[str]) -> list[Pattern]:
    """What the residual shows beyond friction over speed: a wave over the position, to be fitted with the rest; a loss
    of the effort that is transmitted, and friction or load that drifts, which are notes.
    """
    units, found = UNITS[signals.rotary], list[Pattern]()
    position = fit.samples.position
    shortest = 2.0 * math.pi / 4.0 if signals.rotary else float(np.ptp(position)) / 1024.0
    wave, amplitude = wave_of(position, fit.residual, shortest, signals.rotary)
    if wave:
        period = f"{wave:.4g} times a turn" if signals.rotary else f"each {2e3 * math.pi / wave:.4g} mm"
        notes.append(
            f"friction varies by +-{amplitude:.2g} {units.si[1]} {period}, over the position: fitted as a wave"
        )
        found = [lambda s: np.cos(wave * s.position), lambda s: np.sin(wave * s.position)]
    clock = fit.samples.row * signals.step + 1e4 * fit.samples.section
    period = (
        2.0
        * math.pi
        / (wave_of(clock, fit.residual, 1.0 / fit.samples.cutoff, False, SLOWEST)[0] or math.inf)
        if np.ptp(clock) < 1e3
        else 0.0
    )
    if period:
        notes.append(
            f"the residual oscillates with {1.0 / period:.3g} Hz: a resonance or a loop; bins and intervals do not hold it"
        )
    noise = (
        white_noise([section.effort for section in signals.sections], 1, signals.effort_quantum)
        * fit.samples.rate
    )
    noise += fit.inertia**2 * fit.samples.noise
    deviation = float(np.mean(without_friction(fit.samples.speed, fit.bins)(fit.residual) ** 2))
    if deviation > MORE * max(noise, 1e-12 * float(np.var(fit.effort))):
        times = math.sqrt(deviation / max(noise, 1e-300))
        notes.append(
            f"the residual is {times:.3g} times the noise of the {units.names[2]}: a resonance, backlash, a load, a drift or "
            "a filter acts besides inertia and friction, and may be in no interval"
        )
    number = np.unique(
        fit.samples.section * int(fit.samples.row.max() + 1) + fit.samples.row, return_inverse=True
    )[1]
    time, sign = number / max(float(number.max()), 1.0) - 0.5, np.sign(fit.samples.speed)
    model = fit.effort - fit.residual
    friction = float(np.mean(np.abs(fit.total - fit.total.mean())))
    for column, size, most, text in (
        (sign * np.abs(model), 1.0, 0.5, "{:.2g} of the transmitted {effort} is lost in friction: bins of speed hold that at "
         "the {effort} of this log"),
        (sign * time, friction, 2.0, "friction drifts by {:.2g} of it over the log (temperature, running in): bins and "
         "intervals are those of the time each speed was run at"),
        (time, friction, 2.0, "the offset drifts by {:.2g} of the friction over the log (load, tilt, temperature): intervals "
         "do not hold that"),
    ):  # fmt: skip
        other = fit_of(fit.samples, fit.timing, fit.bins, len(fit.number), inertia, [column])
        half = errors_of(other, np.zeros(len(fit.number)), inertia is None)[2][1]
        if most < 1.0 and (half > UNSURE_LOSS or np.mean(model * sign < 0.0) < BRAKES):
            notes.append(
                f"the {units.names[2]} brakes too little in this log to tell a loss in proportion to it (motor, gear, its "
                "constant) from inertia and friction: it is in no interval"
            )
            continue
        if (
            LEAST_PATTERN < abs(other.coefficients[1]) / size < most
            and abs(other.coefficients[1]) > 2.0 * half
        ):
            notes.append(text.format(abs(other.coefficients[1]) / size, effort=units.names[2]))
    return found


def errors_of(fit: Fit, weights: Array, free: bool) -> tuple[Array, Array, Array, float, float]:
    """What each cluster of time moves a fit; weights: of the bins in the offset; free: the inertia is fitted.

    Returns standard errors of the bins, halves of 95 % intervals of bins, coefficients and offset, and quantile of
    Student's t with as many clusters.

    Source: Bell & McCaffrey, Survey Methodology 28 (2002) 169: a cluster that carries a large share of a regressor
    pulls the fit to itself (CR2), and few that do leave few degrees of freedom; here with the shares of the influence
    """
    samples, bins, number, student = fit.samples, fit.bins, len(fit.number), scipy.special.stdtrit
    residual = fit.residual
    length = max(int(max(CLUSTER, CLUSTER_PERIODS / samples.cutoff) / samples.step), 1)
    piece = samples.row // length
    _, clusters = np.unique(samples.run * (int(piece.max()) + 1) + piece, return_inverse=True)
    size, cells = int(clusters.max()) + 1, clusters * number + bins
    of_bin = np.sum(np.bincount(cells, minlength=size * number).reshape(size, -1) > 0, axis=0)
    independent = fit.number * samples.each * samples.rate
    freedom = max(1.0 - 2.0 * (number + 1.0) / float(independent.sum()), 0.1)
    moves, halves = [], []
    for influence in fit.influence.T:
        share = np.bincount(clusters, influence**2) / max(float(influence @ influence), 1e-300)
        moves.append(np.bincount(clusters, influence * residual) / (1.0 - np.minimum(share, LEVERAGE)))
        degrees = max(1.0 / max(float(share @ share), 1e-12) - 1.0, 1.0)
        halves.append(float(student(degrees, PROBABILITY)) * float(np.sqrt(moves[-1] @ moves[-1] / freedom)))
    moved = np.bincount(cells, residual, size * number).reshape(size, -1) / fit.number
    for k, move in enumerate(moves):
        if k or free:
            moved -= np.outer(move, np.bincount(bins, fit.columns[:, k]) / fit.number)
    of_offset = moved @ weights
    few = size / max(size - 1.0, 1.0)
    plain = float(np.mean(residual**2)) / independent
    variance = few * np.sum((moved - of_offset[:, None]) ** 2, axis=0)
    ratio = max(float(np.sum(variance * of_bin) / np.sum(plain * of_bin)), MIN_RATIO)
    degrees = POOLED + of_bin - 1.0
    errors = np.sqrt((POOLED * ratio * plain + (of_bin - 1.0) * variance) / degrees)
    # a bin that one cluster fills hides the error of that
    offset = max(few * float(of_offset @ of_offset), ratio * float(weights**2 @ plain))
    usual = float(student(max(size - 1, 1), PROBABILITY))
    return errors, student(degrees, PROBABILITY) * errors, np.array(halves), usual * math.sqrt(offset), usual


@dataclass(frozen=True)
class Identified:
    """What a log says of an axis (SI: kg, N, m/s or kg m2, N m, rad/s), with 95 % limits, None of what was given.

    offset_error : standard one of an offset that was given, None = the offset is by convention;  offset_limits : None =
    motion in one direction, whose friction holds the offset
    delay of the effort behind the motion;  residual : root mean square, filtered;  explained : share of variance
    places : position, mean residual, its standard error;  samples : used;  left_out : by reason
    """

    rotary: bool
    inertia: float
    inertia_limits: tuple[float, float] | None
    offset: float
    offset_limits: tuple[float, float] | None
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

    @cached_property
    def both(self) -> Bidirectional:
        """Both directions at common speeds."""
        return directions.bidirectional_friction(self.friction, self.offset_error or 0.0)


def one_sign(pieces: list[Array]) -> bool:
    """Whether a signal is never negative, or never positive."""
    return min(float(x.min()) for x in pieces) >= 0.0 or max(float(x.max()) for x in pieces) <= 0.0


def check_sign(signals: Signals, fit: Fit) -> None:
    """Refuse an effort that is a magnitude: its inertia has another sign in each direction."""
    if one_sign([section.effort for section in signals.sections]):
        sides = [fit.samples.speed > 0.0, fit.samples.speed < 0.0]
        acceleration = without_friction(fit.samples.speed, fit.bins)(fit.samples.acceleration)
        one, other = (float(acceleration[side] @ fit.effort[side]) for side in sides)
        if not one * other >= ALIKE * max(one**2, other**2):
            units = UNITS[signals.rotary]
            raise ValueError(
                f"the {units.names[2]} never changes its sign: {MAGNITUDE}; where a load pulls one way: "
                f"{option(units.offset)} with its {units.names[2]}"
            )


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
    Raises       ValueError: too few samples, inertia not determined, and free with motion in one direction only;
                 with what the rows of the log show
    """
    try:
        return _identified(signals, inertia, travel, delay, cutoff, bins_wanted, offset)
    except ValueError as error:
        raise ValueError(f"{error}{of_refusal(signals.findings)}") from None


def _identified(
    signals: Signals, inertia: float | None, travel: float, delay: float | None, cutoff: float | None,
    bins_wanted: int | None, offset: tuple[float, float] | None,
) -> Identified:  # fmt: skip
    chosen, variance = chosen_cutoff(signals)
    cutoff = chosen if cutoff is None else cutoff
    samples = filtered(signals, travel, cutoff, variance)
    usable = {name: int((samples.speed * sign > 0.0).sum()) * samples.each for sign, name in SIDES.items()}
    few = min(usable, key=lambda name: usable[name])
    if usable[few] < MIN_BINS * MIN_SAMPLES and (
        inertia is None or max(usable.values()) < MIN_BINS * MIN_SAMPLES
    ):
        magnitude = signals.of_speed and one_sign([section.motion for section in signals.sections])
        remedy = f"the speed never changes its sign: {MAGNITUDE}" if magnitude else "longer strokes both ways"
        known = option(UNITS[signals.rotary].inertia)
        known = f"; or {known} with its value, for the friction of one direction" * (inertia is None)
        raise ValueError(
            f"samples with {few} speed away from reversals = {usable[few]}, {1.0 / signals.step:.4g} a second; "
            f"allowed: at least {MIN_BINS * MIN_SAMPLES} in each direction; remedy: {remedy}{known}"
        )
    notes = list(signals.notes)
    free = [name for name, value in (("inertia", inertia), ("delay", delay)) if value is None]
    time = timing(signals, samples, delay, inertia)
    if time.lag > 0.0:
        samples = filtered(signals, travel, cutoff, variance, time.lag)
        time = timing(signals, samples, delay, inertia)
    size, bins = bins_of(samples, bins_wanted)
    place = bins(samples.speed)
    number = np.bincount(place, minlength=size) * samples.each
    enough = (number >= MIN_SAMPLES) & (number * samples.rate >= MIN_INDEPENDENT)
    use = enough[place]
    reason = f"bins of speed with fewer than {MIN_SAMPLES} samples, {MIN_INDEPENDENT:g} of them independent"
    left_out = signals.left_out | samples.left_out | {reason: int((~use).sum()) * samples.each}
    # what half the cutoff and a farther travel change
    pairs = (travel, 0.5 * cutoff), (FARTHER * travel, cutoff)
    others = [filtered(signals, *pair, variance, time.lag) for pair in pairs]
    if len(others[1].speed) < FARTHER_LEFT * len(samples.speed):
        del others[1]
    changed = [fit_of(other, time, bins(other.speed), size, inertia) for other in others]
    sides = set(np.sign(samples.speed[use]))
    if len(sides) < (2 if inertia is None else 1):
        few = f"no bin of speed with {MIN_SAMPLES} samples in both directions"
        raise ValueError(f"{few}; allowed: a longer log, or fewer bins (--bins)")
    fit = fit_of(samples.where(use), time, np.cumsum(enough)[place[use]] - 1, int(enough.sum()), inertia)
    if offset is None and len(sides) == 2:
        check_sign(signals, fit)
    patterns = patterns_of(fit, signals, inertia, notes)
    if patterns:
        fit = fit_of(
            fit.samples, time, fit.bins, len(fit.number), inertia, [one(fit.samples) for one in patterns]
        )
        changed = [
            fit_of(other, time, bins(other.speed), size, inertia, [one(other) for one in patterns])
            for other in others
        ]  # fmt: skip
    smeared = SMEAR * np.nan_to_num(changed[0].total[enough] - fit.total)
    return _result(signals._replace(left_out=left_out, notes=notes), fit, changed, smeared, offset, free)


def _result(
    signals: Signals, fit: Fit, changed: list[Fit], smeared: Array, user_offset: tuple[float, float] | None,
    free: list[str],
) -> Identified:  # fmt: skip
    """Values with limits that hold what another cutoff and travel change; free: what is fitted."""
    samples, residual, time = fit.samples, fit.residual, fit.timing
    deviation = float(np.sqrt(np.mean(residual**2)))
    explained = 1.0 - deviation**2 / max(float(np.var(fit.effort)), 1e-300)
    speed = np.bincount(fit.bins, samples.speed) / fit.number
    weights = offset_weights(speed, fit.number)
    one_way = user_offset is None and len(set(np.sign(speed))) == 1
    offset, offset_error = user_offset or (0.0 if one_way else float(weights @ fit.total), 0.0)
    weights = weights * (user_offset is None and not one_way)
    friction = fit.total - offset
    errors, wide, halves, offset_wide, usual = errors_of(fit, weights, "inertia" in free)
    noise = samples.noise / max(float(np.var(samples.acceleration)), 1e-300)

    def beyond(change: float, random: float) -> float:
        """Of a change, what is no chance."""
        return math.sqrt(max(change**2 - random**2, 0.0))

    half = float(halves[0])
    moved = (COARSER * beyond(float(np.nan_to_num(other.inertia - fit.inertia)), half) for other in changed)
    half = math.hypot(half, NOISE_UNSURE * noise * fit.inertia, time.inertia, *moved)
    _check(signals, fit, "inertia" in free, explained, half, usual, speed * friction * (not one_way) < 0.0)
    late = 0.0
    low, high = time.low, time.high
    if time.told and "delay" in free:
        late = float(halves[-1]) + math.hypot(
            *(
                LATER * float(np.nan_to_num(other.coefficients[-1] - fit.coefficients[-1]))
                for other in changed
            )
        )
        low, high = time.delay - late, time.delay + late
    wide = np.sqrt(
        wide**2 + _within_a_bin(speed, friction, errors) ** 2 + smeared**2 + (LIMIT * offset_error) ** 2
    )
    offset_wide = math.hypot(offset_wide, float(weights @ smeared), LIMIT * offset_error)
    of_bins, of_offset, of_inertia = _of_steps(signals, fit, weights)
    if np.median(of_bins) > 0.1 * np.median(wide):
        text = f"the {UNITS[signals.rotary].names[2]} has steps of {signals.effort_quantum:.3g} {UNITS[signals.rotary].si[1]}"
        signals.notes.append(
            f"{text}: rounding, and truncation unless the data exclude it, are in the intervals"
        )
    if 0.5 * signals.effort_quantum > 0.5 * offset_wide > 0.0:
        signals.notes.append(
            f"steps of {signals.effort_quantum:.3g} {UNITS[signals.rotary].si[1]}: if the drive rounds down, the offset is half "
            "a step higher than shown"
        )
    wide, offset_wide, half = wide + of_bins, offset_wide + of_offset, half + of_inertia
    # residual over the position
    first, last = float(samples.position.min()), float(samples.position.max())
    place = np.minimum(((samples.position - first) / (last - first or 1.0) * PLACES).astype(int), PLACES - 1)
    count = np.bincount(place, minlength=PLACES)
    some = count * samples.each * samples.rate >= MIN_INDEPENDENT
    middle = first + (np.flatnonzero(some) + 0.5) * (last - first) / PLACES
    mean = np.bincount(place, residual, PLACES)[some] / count[some]
    places = middle, mean, float(np.std(residual)) / np.sqrt(count[some] * samples.each * samples.rate)
    bins = Friction(
        speed, friction, np.hypot(errors, offset_error), friction - wide, friction + wide,
        (fit.number * samples.each).astype(int),
    )  # fmt: skip
    result = Identified(
        signals.rotary, fit.inertia, (fit.inertia - half, fit.inertia + half) if "inertia" in free else None,
        offset, None if one_way else (offset - offset_wide, offset + offset_wide), user_offset and offset_error, bins,
        time.delay, (low, high) if "delay" in free else None, deviation, explained,
        places, samples.cutoff, len(residual) * samples.each, signals.left_out, signals.notes,
        signals.temperature, signals.preload,
    )  # fmt: skip
    result.notes.extend(_notes(result, noise, time))
    return result


def _of_steps(signals: Signals, fit: Fit, weights: Array) -> tuple[Array, float, float]:
    """What steps of the effort may move the bins, the offset and the inertia: rounding as far as noise does not average
    it, and half a step of truncation towards 0 unless the data exclude it.
    """
    step, samples, size = signals.effort_quantum, fit.samples, len(fit.number)
    if not step > 0.0:
        return np.zeros(size), 0.0, 0.0
    variance = white_noise([section.effort for section in signals.sections], 1, 0.0)
    kept = math.exp(-2.0 * math.pi**2 * max(variance / step**2 - 1.0 / 12.0, 0.0))
    rounded = 0.5 * step * kept
    cut = [section._replace(effort=0.5 * step * np.sign(section.effort)) for section in signals.sections]
    curves = effort_curves(signals._replace(sections=cut), samples.cutoff)
    column = samples._replace(curves=curves).effort(fit.timing.delay)
    other = fit_of(samples, fit.timing, fit.bins, size, None, [column])
    half = float(errors_of(other, weights, True)[2][1])
    excluded = kept < KEPT and half < 0.25 and abs(other.coefficients[1] + 1.0) > 2.0 * half + 0.5
    # without noise a ramp may have one error, up to a step
    column = column * (0.0 if excluded else 1.0 + kept)
    means = np.bincount(fit.bins, column) / fit.number
    of_offset = abs(float(weights @ means)) + 0.5 * rounded * float(np.sum(np.abs(weights)))
    return np.abs(means) + rounded, of_offset, abs(float(fit.influence[:, 0] @ column))


def _check(
    signals: Signals, fit: Fit, free: bool, explained: float, half: float, usual: float, along: np.ndarray
) -> None:
    """Refuse a log that does not determine the values; half: of the inertia's interval, along: bins of wrong sign."""
    units, value = UNITS[signals.rotary], fit.inertia
    what, unit = units.names[0], units.shown[0]
    if not explained >= 0.0:
        seen = fit_of(
            fit.samples, timing(signals, fit.samples, None, None), fit.bins, len(fit.number), None
        ).inertia
        shown = "" if free else f"; the log shows about {seen:.3g} {unit}"
        raise ValueError(
            f"inertia{' given' * (not free)} = {value:.4g} {unit}{shown}; it explains nothing of the effort; allowed: "
            "motion and effort of one log, with new values in each row; remedy: check columns, units, signs, sampling"
        )
    if free and value < -half:
        raise ValueError(f"{what} = {value:.4g}; allowed: > 0: {SIGN}")
    if free and not half <= usual * VAGUE * value:
        raise ValueError(
            f"{what} = {value:.4g} {unit} +- {half:.2g}: too little acceleration, or noise or delay beyond it; "
            f"remedy: {option(units.inertia)} with the known value, or a log with ramps"
        )
    wrong = float(np.sum(fit.number * along) / fit.number.sum())
    if wrong > MAX_ALONG:
        along_it = f"friction along the motion in {wrong:.0%} of the samples"
        raise ValueError(f"{along_it}; allowed: at most {MAX_ALONG:.0%}: {SIGN}")


def _notes(result: Identified, noise: float, time: Timing) -> list[str]:
    """What limits the result."""
    notes, unit, both, (_, mean, error) = [], UNITS[result.rotary].shown[1], result.both, result.places
    if result.offset_limits is None:
        notes.append(
            "motion in one direction: the friction holds the offset (gravity, tilt), which it cannot be told from"
        )
    if not time.told and result.delay_limits is not None:
        notes.append(
            f"the motion does not tell the delay of the {UNITS[result.rotary].names[2]}, {1e3 * time.low:.3g} to "
            f"{1e3 * time.high:.3g} ms: the interval of the {UNITS[result.rotary].names[0]} holds that range; state it "
            "by --delay-ms, or log ramps"
        )
    if result.delay_limits is not None and not time.lag and abs(time.delay) > LATE:
        notes.append(
            f"the {UNITS[result.rotary].names[2]} is {1e3 * time.delay:.3g} ms behind the motion: if a filter of the drive "
            "makes that delay, what else it does is in no interval"
        )
    if time.lag > 0.0:
        notes.append(
            f"the {UNITS[result.rotary].names[2]} is smoothed as by a filter with a time constant of "
            f"{1e3 * time.lag:.3g} ms, and a delay of {1e3 * time.delay:.3g} ms: taken out; log the unfiltered signal"
        )
    if noise > 10.0 * MAX_NOISE:
        notes.append(f"noise is {100.0 * noise:.2g} % of the acceleration's variance at the lowest cutoff")
    if directions.varies(both):
        notes.append(
            f"(f+ - f-)/2, half the difference of friction between the directions, varies with speed, "
            f"{both.difference.min():+.3g} to {both.difference.max():+.3g} {unit}"
            + (
                ": it cannot all be an offset, unless load, tilt or temperature changed during the log"
                if result.offset_error is None
                else ""
            )
        )
    if len(mean) and float(np.mean((mean / error) ** 2)) > UNEVEN:
        notes.append(
            f"friction depends on the position: mean residuals there {float(np.sqrt(np.mean(mean**2))):.2g} {unit} "
            "(root mean square); the intervals hold for the positions of this log"
            + ("" if result.delay_limits is None else ", that of the delay leaves out the bias by them")
        )
    return notes


def _within_a_bin(speed: Array, friction: Array, errors: Array) -> Array:
    """Second difference over 8 [effort]: what a kink in a bin moves its mean from the friction at its mean speed."""
    bend = np.zeros(len(speed))
    for side in (speed < 0.0, speed > 0.0):
        if side.sum() >= 3:
            # less what is by chance
            chance = np.convolve(errors[side] ** 2, [1.0, 4.0, 1.0], "valid")
            second = np.sqrt(np.maximum(np.diff(friction[side], 2) ** 2 - BY_CHANCE * chance, 0.0))
            second = np.pad(second, 1, mode="edge")
            bend[side] = scipy.ndimage.maximum_filter1d(second, 3, mode="nearest") / 8.0
    return bend
