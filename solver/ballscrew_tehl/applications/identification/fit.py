"""Least squares of inertia and other regressors besides friction in bins of speed, and its errors."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import scipy

from ballscrew_tehl.numerics import Array

from .directions import PROBABILITY
from .motion import Samples

#: most and fewest bins of a direction; samples of the log for one bin, fewest independent ones
MAX_BINS, MIN_BINS, FOR_A_BIN, MIN_INDEPENDENT = 60, 6, 150, 2.0
#: longest cluster [s], or so many periods of the cutoff
CLUSTER, CLUSTER_PERIODS = 0.25, 10.0
#: largest share of a cluster in a slope that is allowed for;  clusters that the pooled error of a bin counts as
LEVERAGE, POOLED = 0.5, 10.0
#: least variance of a bin over that of as many independent samples: pieces shorter than the filter have more
MIN_RATIO = 0.25
SIDES = {1.0: "positive", -1.0: "negative"}


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


class Fit(NamedTuple):
    """Inertia and bins of speed at a delay and lag of the effort [s].

    columns: regressors of the effort, the acceleration first; within: without friction, a straight line over speed
    in each bin; influence: of each sample on each coefficient
    number, total: samples of each bin, mean effort without that of the columns, NaN with too few samples
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
    samples: Samples, time: Timing, bins: np.ndarray, size: int, inertia: float | None, more: Sequence[Array] = ()
) -> Fit:  # fmt: skip
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
            inverse = np.linalg.pinv(gram[1:, 1:], rcond=1e-12, hermitian=True)
            influence[:, 1:] = flat[:, 1:] @ inverse / scale[1:]
            coefficients = influence.T @ (effort - inertia * samples.acceleration)
            coefficients[0] = inertia
        every = np.column_stack(columns)
        remainder = effort - every @ coefficients
        total = np.bincount(bins, remainder, size) / safe
        residual = remainder - total[bins]
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


def offset_weights(speed: Array, number: Array, row: int = 0, bent: bool = False) -> Array:
    """Of the bins in the constant, or another row, of a fit of a constant, Coulomb and viscous friction; bent: and
    of friction over the root and the square of the speed, alike in both directions.
    """
    size = np.abs(speed) / float(np.max(np.abs(speed)))
    more = [np.sign(speed) * size**power for power in (0.5, 2.0)] if bent else []
    shape = np.column_stack([np.ones(len(speed)), np.sign(speed), speed, *more])
    weighted = shape * number[:, None]
    return np.asarray(np.linalg.pinv(shape.T @ weighted)[row] @ weighted.T)


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
        fraction = np.bincount(clusters, influence**2) / max(float(influence @ influence), 1e-300)
        moves.append(np.bincount(clusters, influence * residual) / (1.0 - np.minimum(fraction, LEVERAGE)))
        degrees = max(1.0 / max(float(fraction @ fraction), 1e-12) - 1.0, 1.0)
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
