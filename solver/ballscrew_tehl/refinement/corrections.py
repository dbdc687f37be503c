"""Corrections of a map at solved points and their interpolation by simple kriging.

Kriging gives the most likely value and its standard deviation for fields with the covariance of the solved values.
These are a smooth field with scatter around it; only the smooth part is interpolated.

Source       simple kriging, covariances Matern 3/2 and, for the scatter, exponential: Rasmussen & Williams, Gaussian
             Processes for Machine Learning, 2006, Eqs. (2.25), (2.26), (4.17), (4.18)
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: scatter of solved films between neighbouring points, relative, and its correlation length [cells]: grids change in
#: steps. Without it contacts are solved again and again where neighbours scatter
SCATTER, SCATTER_LENGTH = 1.5e-3, 0.05
#: keeps the matrix of points that nearly coincide invertible
JITTER = 1e-9
#: distance [cells] from a contact without a solution within which none is tried again
UNSOLVABLE_RADIUS = 0.1
#: weight of the expected size of corrections in solved points: larger, the data count later
EXPECTED_WEIGHT = 1.0
#: correlation with a point above which a look-up counts as its use
USED_ABOVE = 0.5
#: iterations between the deviation and the share of scatter in it
DEVIATION_STEPS = 4


class Known(NamedTuple):
    """Interpolated correction of one raceway."""

    values: list[float]  # of the logarithms, five columns
    deviation: float  # standard deviation of the first column, scatter left out
    #: to the nearest solved point [cells]; 0 near a contact without a solution
    distance: float


class CorrectionStore:
    """Corrections of one raceway, a bounded number, interpolated by kriging.

    Parameters   capacity : solved points that are kept;  expected : standard deviation of a correction before any is
                 known
    """

    COLUMNS = 5

    def __init__(self, capacity: int, expected: float) -> None:
        self.capacity = capacity
        self.expected = expected
        self._clock = 0
        self._unsolvable = np.empty((0, 3))
        self._set(np.empty((0, 3)), np.empty((0, self.COLUMNS)), np.empty(0, dtype=int))

    def __len__(self) -> int:
        return len(self._points)

    def look_up(self, point: Array) -> Known:
        """Correction at a point (3,) [cells]."""
        useless = bool((((self._unsolvable - point) ** 2).sum(axis=1) < UNSOLVABLE_RADIUS**2).any())
        if not len(self._points):
            return Known([0.0] * self.COLUMNS, self.expected, 0.0 if useless else math.inf)
        distances = np.sqrt(((self._points - point) ** 2).sum(axis=1))
        nearness = _covariance(distances)
        self._clock += 1
        self._used[nearness > USED_ABOVE] = self._clock
        unknown = 1.0 - float(nearness @ self._inverse @ nearness)
        scatter = (SCATTER / self._sigma) ** 2 * np.exp(-distances / SCATTER_LENGTH)
        values = ((nearness + scatter) @ self._weights).tolist()
        distance = 0.0 if useless else float(distances.min())
        return Known(values, self._sigma * math.sqrt(max(unknown, 0.0)), distance)

    def insert(self, point: Array, values: Array) -> None:
        """Store the correction (5,) at a point (3,) [cells]; the least recently used one is dropped."""
        if not np.isfinite(values).all():
            raise ValueError(f"correction = {values}; needs finite")
        keep = np.ones(len(self._points), dtype=bool)
        if len(self._points) >= self.capacity:
            keep[np.argmin(self._used)] = False
        self._set(
            np.vstack([self._points[keep], point]),
            np.vstack([self._values[keep], values]),
            np.append(self._used[keep], self._clock),
        )

    def insert_unsolvable(self, point: Array) -> None:
        """Store that there is no solution at a point (3,) [cells]; the oldest one is dropped."""
        self._unsolvable = np.vstack([self._unsolvable, point])[-self.capacity :]

    def _set(self, points: Array, values: Array, used: NDArray[np.int_]) -> None:
        self._points, self._values, self._used = points, values, used
        self._sigma = self.expected
        if not len(points):
            return
        distances = np.sqrt(((points[:, None] - points) ** 2).sum(axis=-1))
        smooth, rough = _covariance(distances), np.exp(-distances / SCATTER_LENGTH)
        first = values[:, 0]
        for _ in range(DEVIATION_STEPS):
            covariance = smooth + (SCATTER / self._sigma) ** 2 * rough
            self._weights = np.linalg.solve(covariance, values)
            misfit = EXPECTED_WEIGHT * self.expected**2 + float(first @ self._weights[:, 0])
            self._sigma = math.sqrt(misfit / (EXPECTED_WEIGHT + len(points)))
        covariance = smooth + (SCATTER / self._sigma) ** 2 * rough
        self._weights = np.linalg.solve(covariance, values)
        self._inverse = np.linalg.inv(smooth + JITTER * np.eye(len(points)))

    def state(self) -> dict[str, Any]:
        """Content for JSON."""
        return {
            "clock": self._clock,
            "points": self._points.tolist(),
            "values": self._values.tolist(),
            "used": self._used.tolist(),
            "unsolvable": self._unsolvable.tolist(),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Content from state()."""
        self._clock = int(state["clock"])
        self._unsolvable = np.array(state["unsolvable"], dtype=float).reshape(-1, 3)
        self._set(
            np.array(state["points"], dtype=float).reshape(-1, 3),
            np.array(state["values"], dtype=float).reshape(-1, self.COLUMNS),
            np.array(state["used"], dtype=int),
        )


def _covariance(distance: Array) -> Array:
    """Matern 3/2 with a length of one cell."""
    scaled = math.sqrt(3.0) * distance
    return np.asarray((1.0 + scaled) * np.exp(-scaled))
