"""Least squares within bins of speed, and what each cluster of time moves its values."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from ..physics.ball_law import Array
from .motion import Samples

#: most and fewest bins of a direction; samples of the log for one bin, fewest independent ones
MAX_BINS, MIN_BINS, FOR_A_BIN, MIN_INDEPENDENT = 60, 6, 150, 2.0
#: longest cluster [s], or so many periods of the cutoff
CLUSTER, CLUSTER_PERIODS = 0.25, 10.0
#: of Student's t, for two-sided 95 % limits
PROBABILITY = 0.975
#: largest share of a cluster in a slope that is allowed for;  clusters that the pooled error of a bin counts as
LEVERAGE, POOLED = 0.5, 4.0


def bins_of(samples: Samples, wanted: int | None = None) -> tuple[int, Callable[[Array], np.ndarray]]:
    """Number of bins of speed in both directions, those of negative speed first; bins of a speed."""
    size = np.abs(samples.speed)
    smaller = min(int((samples.speed > 0.0).sum()), int((samples.speed < 0.0).sum())) * samples.each
    number = wanted or int(np.clip(smaller // FOR_A_BIN, MIN_BINS, MAX_BINS))
    low, high = float(size.min()), float(size.max())

    def bins(speed: Array) -> np.ndarray:
        width = (high - low or 1.0) / number
        place = np.clip(((np.abs(speed) - low) / width).astype(int), 0, number - 1)
        return np.where(speed < 0.0, number - 1 - place, number + place)

    return 2 * number, bins


def within(values: Array, speed: Array, bins: np.ndarray) -> Array:
    """Values less a straight line over speed in each bin: friction may rise within it."""
    safe = np.maximum(np.bincount(bins), 1.0)

    def mean(of: Array) -> Array:
        return np.asarray(np.bincount(bins, of) / safe)

    across = speed - mean(speed)[bins]
    rest = values - mean(values)[bins]
    spread = mean(across**2)
    slope = np.divide(mean(across * rest), spread, out=np.zeros(len(spread)), where=spread > 0.0)
    return np.asarray(rest - slope[bins] * across)


class Fit(NamedTuple):
    """Inertia and bins of speed at a delay of the effort [s].

    acceleration, jerk : without friction, a straight line over speed in each bin, each without the other
    squares : of the acceleration, without its noise;  seen : inertia of the effort;  late : delay that is left
    number, total : samples of each bin, mean effort without that of the inertia, NaN with too few samples
    """

    samples: Samples
    bins: np.ndarray
    delay: float
    effort: Array
    acceleration: Array
    jerk: Array
    squares: float
    seen: float
    inertia: float
    late: float
    number: Array
    total: Array


def fit_of(samples: Samples, delay: float, bins: np.ndarray, size: int, inertia: float | None) -> Fit:
    """Fit to samples in bins, NaN without samples; inertia None: free."""
    effort = samples.effort(delay)
    whole, change = (within(v, samples.speed, bins) for v in (samples.acceleration, samples.jerk))
    acceleration = whole - float(whole @ change) / max(float(change @ change), 1e-300) * change
    # an error of the delay moves the effort by the inertia times the jerk
    jerk = change - float(whole @ change) / max(float(whole @ whole), 1e-300) * whole
    power = float(acceleration @ acceleration)
    # noise would make the inertia too small
    squares = max(power - len(effort) * samples.noise, 0.5 * power, 1e-300)
    seen = float(acceleration @ effort) / squares if len(effort) else math.nan
    value = seen if inertia is None else inertia
    late = float(jerk @ effort) / max(abs(value) * float(jerk @ jerk), 1e-300)
    number = np.bincount(bins, minlength=size).astype(float)
    safe = np.where(number * samples.each * samples.rate >= MIN_INDEPENDENT, number, math.nan)
    total = np.bincount(bins, effort - value * samples.acceleration, size) / safe
    return Fit(samples, bins, delay, effort, acceleration, jerk, squares, seen, value, late, number, total)


def errors_of(
    fit: Fit, residual: Array, weights: Array, free: bool
) -> tuple[Array, Array, float, float, float, float]:
    """What each cluster of time moves a fit; weights: of the bins in the offset; free: the inertia is fitted.

    Returns standard errors of the bins, halves of 95 % intervals of bins, inertia, delay and offset, and quantile of
    Student's t with as many clusters.
    """
    samples, bins, number = fit.samples, fit.bins, len(fit.number)
    length = max(int(max(CLUSTER, CLUSTER_PERIODS / samples.cutoff) / samples.step), 1)
    piece = samples.row // length
    _, clusters = np.unique(samples.run * (int(piece.max()) + 1) + piece, return_inverse=True)
    size, cells = int(clusters.max()) + 1, clusters * number + bins
    of_bin = np.sum(np.bincount(cells, minlength=size * number).reshape(size, -1) > 0, axis=0)
    independent = fit.number * samples.each * samples.rate
    freedom = max(1.0 - 2.0 * (number + 1.0) / float(independent.sum()), 0.1)

    def slope(regressor: Array, squares: float) -> tuple[Array, float]:
        """What each cluster moves the slope of a regressor, and half of its 95 % interval.

        Source: Bell & McCaffrey, Survey Methodology 28 (2002) 169: a cluster that carries a large share of the
        regressor pulls the fit to itself (CR2), and few that do leave few degrees of freedom; here with the shares of
        the regressor alone
        """
        share = np.bincount(clusters, regressor**2) / max(float(regressor @ regressor), 1e-300)
        moves = np.bincount(clusters, regressor * residual) / squares / (1.0 - np.minimum(share, LEVERAGE))
        degrees = max(1.0 / max(float(share @ share), 1e-12) - 1.0, 1.0)
        return moves, float(student.ppf(PROBABILITY, degrees)) * float(np.sqrt(moves @ moves / freedom))

    by_inertia, half = slope(fit.acceleration, fit.squares)
    delay = slope(fit.jerk, max(abs(fit.inertia) * float(fit.jerk @ fit.jerk), 1e-300))[1]
    moved = np.bincount(cells, residual, size * number).reshape(size, -1) / fit.number
    moved -= free * np.outer(by_inertia, np.bincount(bins, samples.acceleration) / fit.number)
    of_offset = moved @ weights
    few = size / max(size - 1.0, 1.0)
    plain = float(np.mean(residual**2)) / independent
    variance = few * np.sum((moved - of_offset[:, None]) ** 2, axis=0)
    ratio = max(float(np.sum(variance * of_bin) / np.sum(plain * of_bin)), 1.0)
    degrees = POOLED + of_bin - 1.0
    errors = np.sqrt((POOLED * ratio * plain + (of_bin - 1.0) * variance) / degrees)
    # a bin that one cluster fills hides the error of that
    offset = max(few * float(of_offset @ of_offset), ratio * float(weights**2 @ plain))
    usual = float(student.ppf(PROBABILITY, max(size - 1, 1)))
    return errors, student.ppf(PROBABILITY, degrees) * errors, half, delay, usual * math.sqrt(offset), usual
