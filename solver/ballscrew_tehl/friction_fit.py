"""Fit of at most three friction parameters to measured torques, by named loss functions.

All losses look at the relative error r = w (T/T_measured - 1) of the torque, w the weight of a measurement:

least_squares        sum of r^2 over the distinct points
table_least_squares  sum over the tables of mean(r^2)/target^2: every table weighs the same, however many points it
                     has, in units of the mean deviation that it is to reach; a point counts in each of its tables
table_minimax        the largest over the tables of mean(|r|)/target

A target is 1 unless given. Points that stand in no table form one table together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares, linprog, minimize_scalar, nnls

from .friction import roughness_share
from .measurements import Measurement
from .torque import NutSums

#: the table of the points that stand in none
NO_TABLE = "all"


@dataclass(frozen=True)
class TorqueBasis:
    """Torque of the double nut at n operating points as a function of the fitted parameters only.

    viscous (n, 2) [N.m] and film (n, 2) [m] of screw and nut raceway, hysteresis (n,) and sliding (n,) [N.m]: the
    sums of NutSums over both nuts
    """

    measurements: tuple[Measurement, ...]
    viscous: np.ndarray
    film: np.ndarray
    hysteresis: np.ndarray
    sliding: np.ndarray

    @classmethod
    def of_equal_nuts(cls, measurements: Sequence[Measurement], sums: Sequence[NutSums]) -> TorqueBasis:
        """Both nuts under the preload only: twice the sums of one nut per point."""
        return cls(
            tuple(measurements),
            2.0 * np.array([(s.viscous_screw, s.viscous_nut) for s in sums]),
            np.array([(s.film_screw, s.film_nut) for s in sums]),
            2.0 * np.array([s.hysteresis for s in sums]),
            2.0 * np.array([s.sliding for s in sums]),
        )

    def __len__(self) -> int:
        return len(self.measurements)

    def subset(self, keep: Sequence[int]) -> TorqueBasis:
        """The points with these numbers."""
        rows = list(keep)
        chosen = tuple(self.measurements[i] for i in rows)
        return TorqueBasis(chosen, self.viscous[rows], self.film[rows], self.hysteresis[rows], self.sliding[rows])

    def torque(self, values: Sequence[float]) -> np.ndarray:
        """Torque [N.m] at the points for ratio [1], net sliding coefficient [1], roughness height [m]."""
        ratio, net, height = values
        viscous = np.sum(self.viscous * roughness_share(self.film, height), axis=1)
        return ratio * viscous + self.hysteresis + net * self.sliding

    def errors(self, values: Sequence[float]) -> np.ndarray:
        """Weighted relative errors r at the points."""
        return self.weights * (self.torque(values) / self.measured - 1.0)

    def jacobian(self, values: Sequence[float]) -> np.ndarray:
        """d errors/d values, (n, 3)."""
        ratio, _, height = values
        share = roughness_share(self.film, height)
        by_height = -2.0 * height / self.film**2 * share**2 * self.viscous
        columns = np.stack(
            [np.sum(self.viscous * share, axis=1), self.sliding, ratio * np.sum(by_height, axis=1)], axis=1
        )
        return columns * (self.weights / self.measured)[:, None]

    @property
    def measured(self) -> np.ndarray:
        """Measured torques [N.m]."""
        return np.array([m.torque for m in self.measurements])

    @property
    def weights(self) -> np.ndarray:
        """Factors on the relative errors."""
        return np.array([m.weight for m in self.measurements])

    @property
    def tables(self) -> dict[str, np.ndarray]:
        """Table -> numbers of its points, in order of appearance."""
        found: dict[str, list[int]] = {}
        for i, m in enumerate(self.measurements):
            for name in m.tables or (NO_TABLE,):
                found.setdefault(name, []).append(i)
        return {name: np.array(rows) for name, rows in found.items()}


Targets = Mapping[str, float]
Loss = Callable[[TorqueBasis, int, Targets], np.ndarray]


def point_shares(basis: TorqueBasis, loss: str, targets: Targets) -> np.ndarray:
    """Weight of r^2 of each point in a loss of squares, mean 1; for table_minimax all 1."""
    shares = np.ones(len(basis))
    if loss == "table_least_squares":
        shares[:] = 0.0
        for name, rows in basis.tables.items():
            shares[rows] += 1.0 / (len(rows) * targets.get(name, 1.0) ** 2)
    return shares / shares.mean()


def _linear_fit(basis: TorqueBasis, height: float, root_share: np.ndarray) -> np.ndarray:
    """Least squares in ratio and net coefficient for a given roughness height."""
    matrix = basis.jacobian((1.0, 1.0, height))[:, :2]
    rest = basis.errors((0.0, 0.0, height))
    scale = 1.0 / np.linalg.norm(matrix, axis=0)
    solution, _ = nnls(matrix * scale * root_share[:, None], -rest * root_share)
    return np.array([*(solution * scale), height])


def _squares(basis: TorqueBasis, count: int, shares: np.ndarray) -> np.ndarray:
    """Minimise sum(shares r^2) over the first `count` parameters; the others are 0, none is negative."""
    root_share = np.sqrt(shares)
    if count == 2:
        return _linear_fit(basis, 0.0, root_share)
    best, lowest = None, np.inf
    # the loss may have several valleys in the roughness height
    for height in basis.film.min() * np.array([0.3, 1.0, 3.0]):
        start = _linear_fit(basis, height, root_share)
        # a height of zero or a vanished part must not make the scale zero
        scale = np.maximum(start, 1e-3 * np.array([start[0] + 1.0, start[1] + 1e-3, height]))
        found = least_squares(
            lambda x, scale=scale: root_share * basis.errors(x * scale),
            np.maximum(start / scale, 1e-3),
            jac=lambda x, scale=scale: root_share[:, None] * basis.jacobian(x * scale) * scale,
            bounds=(0.0, np.inf),
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
            max_nfev=400,
        )
        if not found.success:
            raise ValueError(f"fit stopped without a minimum: {found.message}")
        if found.cost < lowest * (1.0 - 1e-12):
            best, lowest = found.x * scale, found.cost
    assert best is not None
    # trf stays inside its bounds: a height whose effect is below rounding is none
    if best[2] < 1e-4 * basis.film.min():
        return _linear_fit(basis, 0.0, root_share)
    return best


def _least_squares(basis: TorqueBasis, count: int, targets: Targets) -> np.ndarray:
    return _squares(basis, count, point_shares(basis, "least_squares", targets))


def _table_least_squares(basis: TorqueBasis, count: int, targets: Targets) -> np.ndarray:
    return _squares(basis, count, point_shares(basis, "table_least_squares", targets))


def _minimax_at(basis: TorqueBasis, height: float, targets: Targets) -> tuple[float, np.ndarray]:
    """Smallest table_minimax loss at a roughness height: a linear programme.

    Unknowns: ratio, net coefficient, a bound on |r| per point, the loss. All are >= 0.
    """
    matrix = basis.jacobian((1.0, 1.0, height))[:, :2]
    rest = basis.errors((0.0, 0.0, height))
    scale = 1.0 / np.abs(matrix).max(axis=0)
    n, tables = len(basis), basis.tables
    mean = np.zeros((len(tables), n))
    for row, (name, members) in enumerate(tables.items()):
        mean[row, members] = 1.0 / (len(members) * targets.get(name, 1.0))
    above = np.hstack([matrix * scale, -np.eye(n), np.zeros((n, 1))])
    below = np.hstack([-matrix * scale, -np.eye(n), np.zeros((n, 1))])
    bound = np.hstack([np.zeros((len(tables), 2)), mean, -np.ones((len(tables), 1))])
    found = linprog(
        np.r_[np.zeros(n + 2), 1.0],
        A_ub=np.vstack([above, below, bound]),
        b_ub=np.concatenate([-rest, rest, np.zeros(len(tables))]),
        method="highs-ds",
    )
    if not found.success:
        raise ValueError(f"fit stopped without a minimum: {found.message}")
    return float(found.fun), np.array([*(found.x[:2] * scale), height])


def _table_minimax(basis: TorqueBasis, count: int, targets: Targets) -> np.ndarray:
    if count == 2:
        return _minimax_at(basis, 0.0, targets)[1]
    heights = np.r_[0.0, basis.film.min() * np.geomspace(0.05, 5.0, 24)]
    losses = [_minimax_at(basis, height, targets)[0] for height in heights]
    i = int(np.argmin(losses))
    around = (heights[max(i - 1, 0)], heights[min(i + 1, len(heights) - 1)])
    refined = minimize_scalar(
        lambda height: _minimax_at(basis, height, targets)[0],
        bounds=around,
        method="bounded",
        options={"xatol": 1e-5 * basis.film.min()},
    )
    return _minimax_at(basis, float(refined.x) if refined.fun < losses[i] else float(heights[i]), targets)[1]


LOSSES: dict[str, Loss] = {
    "least_squares": _least_squares,
    "table_least_squares": _table_least_squares,
    "table_minimax": _table_minimax,
}


def fit_values(basis: TorqueBasis, count: int, loss: str, targets: Targets | None = None) -> np.ndarray:
    """Ratio [1], net sliding coefficient [1], roughness height [m] that minimise a loss.

    Parameters   basis : n points, n >= count;  count : 2 (no roughness height) or 3
                 loss : name, see the top of this file;  targets : table -> mean deviation it is to reach
    Raises       ValueError: unknown loss, too few points, no minimum found
    """
    if loss not in LOSSES:
        raise ValueError(f"loss = {loss!r}; allowed: {', '.join(LOSSES)}")
    if count not in (2, 3):
        raise ValueError(f"count = {count}; allowed: 2, 3 fitted parameters")
    if len(basis) < count:
        raise ValueError(f"{len(basis)} distinct points; {count} fitted parameters need at least {count}")
    return LOSSES[loss](basis, count, targets or {})
