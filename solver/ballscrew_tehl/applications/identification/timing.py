"""Delay and lag of the effort behind the motion, and what the data do not tell of them."""

from typing import NamedTuple

import numpy as np

from ballscrew_tehl.numerics import Array

from .fit import Timing, bins_of, fit_of, offset_weights, without_friction
from .log.signals import Signals
from .motion import Samples, differences, effort_curves

#: delays looked for [s], and their step;  longest lag of a filter [s], least one;  samples that they are looked for in
DELAYS, DELAY_STEP, MAX_LAG, LEAST_LAG, LOOKED_AT = (-0.02, 0.05), 1.25e-3, 0.15, 2e-3, 30_000
#: misfit over that of one sample by which a delay is told from another, a filter from none;  steps of plausible delays
#: from which on the data do not tell one
TELL, LAG_TELLS, UNTOLD = 6.0, 15.0, 3.5
#: noise of the acceleration in a misfit, at two times and safely
NOISES = 3.0


class Searched(NamedTuple):
    """Delays [s] that were tried, for each the lag [s] with the least misfit, inertia, misfit; one: of one sample."""

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
    """Misfit of the effort e at delays, without and with a lag: e(t + delay) + lag e'(t + delay) is before a filter."""
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
        remainder, more = effort - moved[0] * whole, rate - moved[1] * whole
        misfit, bend, along = (
            product(remainder, remainder),
            product(more, more),
            max(-product(remainder, more), 0.0),
        )
        # noise would make the lag too small
        lag = min(along / max(bend - len(rate) * samples.rate_noise, 0.2 * bend, 1e-300), MAX_LAG)
        less = misfit - along**2 / max(bend, 1e-300)
        rows.append((delay, 0.0, moved[0], misfit, lag, moved[0] + lag * moved[1], less))
    delay, none, inertias, misfits, lags, lagged, less = np.array(rows).T
    one = max(float(less.min()), 0.0) / max(len(whole) * samples.each * samples.rate, 1.0)
    return Searched(delay, none, inertias, misfits, one), Searched(delay, lags, lagged, less, one)


def expected(signals: Signals, samples: Samples, delay: float, delays: Array, inertia: float | None) -> Array:
    """Misfit at delays of an effort without noise, with the inertia and friction that are seen at a delay."""
    size, bins = bins_of(samples)
    place = bins(samples.speed)
    fit = fit_of(samples, Timing(delay), place, size, inertia)
    some = np.isfinite(fit.total)
    speeds = np.bincount(place, samples.speed, size)[some] / fit.number[some]
    rows = (offset_weights(speeds, fit.number[some], k) for k in range(3))
    constant, coulomb, viscous = (row @ fit.total[some] for row in rows)
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


def timing(
    signals: Signals, samples: Samples, rough: Samples, delay: float | None, inertia: float | None
) -> Timing:
    """Of the effort behind the motion; rough: at a lower cutoff, where noise does not hide a lag; delay: known."""
    delays = np.arange(DELAYS[0], DELAYS[1], DELAY_STEP) if delay is None else np.array([delay])
    plain, lagged = searched(rough, delays, inertia)
    k = lagged.best
    lags = lagged.misfit[k] + LAG_TELLS * lagged.one < plain.misfit.min()
    with_lag = bool(lags and lagged.lag[k] > max(LEAST_LAG, samples.step))
    result = lagged if with_lag else plain if rough is samples else searched(samples, delays, inertia)[0]
    best, step = float(result.delay[result.best]), DELAY_STEP
    allowed = np.ones(len(result.delay), dtype=bool)
    if with_lag:
        if delay is None:
            result = searched(rough, best + np.linspace(-0.01, 0.01, 41), inertia)[1]
        allowed = result.misfit <= result.misfit.min() + TELL * result.one
    elif delay is None:
        allowed = expected(signals, samples, best, delays, inertia) <= TELL * result.one
        allowed[result.best] = True
        if np.ptp(result.delay[allowed]) <= UNTOLD * step:
            while step > 0.01 * samples.step:
                # finer about the best
                result = searched(samples, best + step * np.linspace(-1.0, 1.0, 9), inertia)[0]
                best, step = float(result.delay[result.best]), 0.25 * step
            return Timing(best)
    # of delays that the data do not tell from each other, the least
    at = result.best if with_lag else int(np.argmin(np.where(allowed, np.abs(result.delay), np.inf)))
    off = float(np.max(np.abs(result.inertia[allowed] - result.inertia[at])))
    low, high = result.delay[allowed].min(), result.delay[allowed].max()
    return Timing(float(result.delay[at]), float(result.lag[at]), off, with_lag, float(low), float(high))
