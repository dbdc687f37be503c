"""Regressors of an identification within bins of speed, and what each cluster of time moves."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.stats import t as student

from ..physics.ball_law import Array
from .motion import Samples

#: most and fewest bins of a direction; samples of the log for one bin
MAX_BINS, MIN_BINS, FOR_A_BIN = 60, 6, 150
#: longest cluster [s], or so many periods of the cutoff
CLUSTER, CLUSTER_PERIODS = 0.25, 10.0
CONFIDENCE = 0.95
#: largest share of a cluster in a slope that is allowed for
LEVERAGE = 0.5


@dataclass(frozen=True)
class Bins:
    """Bins of the magnitude of speed: their number in each direction, lowest and highest end."""

    number: int
    low: float
    high: float

    @classmethod
    def of(cls, samples: Samples, wanted: int | None = None) -> Self:
        """As many as there are samples for, or as wanted."""
        size = np.abs(samples.speed)
        smaller = min(int((samples.speed > 0.0).sum()), int((samples.speed < 0.0).sum())) * samples.each
        number = wanted or int(np.clip(smaller // FOR_A_BIN, MIN_BINS, MAX_BINS))
        return cls(number, float(size.min()), float(size.max()))

    def place(self, speed: Array) -> np.ndarray:
        """Number of the bin of each speed, those of negative speed first."""
        wide = (self.high - self.low or 1.0) / self.number
        place = np.clip(((np.abs(speed) - self.low) / wide).astype(int), 0, self.number - 1)
        return np.where(speed < 0.0, self.number - 1 - place, self.number + place)

    def tally(self, place: np.ndarray, weights: Array | None = None) -> Array:
        """Samples, or their sum of weights, by bin."""
        return np.asarray(np.bincount(place, weights, 2 * self.number), dtype=np.float64)


def within(values: Array, speed: Array, bins: np.ndarray, count: Array) -> Array:
    """Values less a straight line over speed in each bin: friction may rise within it."""
    safe = np.maximum(count, 1.0)

    def mean(of: Array) -> Array:
        return np.asarray(np.bincount(bins, of, len(count)) / safe)

    across = speed - mean(speed)[bins]
    rest = values - mean(values)[bins]
    spread = mean(across**2)
    slope = np.where(spread > 0.0, mean(across * rest) / np.where(spread > 0.0, spread, 1.0), 0.0)
    return np.asarray(rest - slope[bins] * across)


def alone(samples: Samples, bins: np.ndarray, count: Array) -> tuple[Array, Array]:
    """Acceleration and jerk without friction, a straight line over speed in each bin, each without the other.

    An error of the delay moves the effort by the inertia times the jerk.
    """
    acceleration, jerk = (
        within(values, samples.speed, bins, count) for values in (samples.acceleration, samples.jerk)
    )

    def less(values: Array, other: Array) -> Array:
        return np.asarray(values - float(values @ other) / max(float(other @ other), 1e-300) * other)

    return less(acceleration, jerk), less(jerk, acceleration)


def power(acceleration: Array, samples: Samples) -> float:
    """Sum of squares of the acceleration without its noise, which would make the inertia too small; at least half."""
    whole = float(acceleration @ acceleration)
    return max(whole - len(acceleration) * samples.noise, 0.5 * whole, 1e-300)


def clusters_of(samples: Samples, step: float, bins: np.ndarray) -> tuple[np.ndarray, Array]:
    """Number of the cluster of each sample, and clusters of each bin."""
    length = max(int(max(CLUSTER, CLUSTER_PERIODS / samples.cutoff) / step), 1)
    piece = samples.index // length
    key = samples.run.astype(np.int64) * (int(piece.max()) + 1) + piece
    _, clusters = np.unique(key, return_inverse=True)
    pairs = np.unique(clusters.astype(np.int64) * (int(bins.max()) + 1) + bins)
    return clusters, np.bincount(pairs % (int(bins.max()) + 1), minlength=int(bins.max()) + 1).astype(float)


def slope_moves(
    regressor: Array, residual: Array, clusters: np.ndarray, squares: float, freedom: float
) -> tuple[Array, float]:
    """What each cluster moves the slope of a regressor, and half of its 95 % interval.

    Parameters   squares : sum of squares of the regressor;  freedom : independent samples less parameters over samples
    Source       Bell & McCaffrey, Survey Methodology 28 (2002) 169: a cluster that carries a large share of the
                 regressor pulls the fit to itself (CR2), and few that do leave few degrees of freedom; here with the
                 shares of the regressor alone
    """
    share = np.bincount(clusters, regressor**2) / max(float(regressor @ regressor), 1e-300)
    moves = np.bincount(clusters, regressor * residual) / squares / (1.0 - np.minimum(share, LEVERAGE))
    degrees = max(1.0 / max(float(share @ share), 1e-12) - 1.0, 1.0)
    quantile = float(student.ppf(0.5 + 0.5 * CONFIDENCE, degrees))
    return moves, quantile * float(np.sqrt(moves @ moves / freedom))
