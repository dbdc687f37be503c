"""Fit of at most three friction parameters to measured torques, by named loss functions.

All losses use the relative error r = w (T/T_measured - 1) of the torque, w the weight of a measurement:

least_squares   sum of r^2 over the distinct points
soft_l1         sum of 2 s^2 (sqrt(1 + (r/s)^2) - 1), s = 1 %: squares below about 1 %, absolute values above, which
                limits the effect of single outliers (scipy's soft_l1)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, nnls

from ..friction.mechanistic import NutPowers
from ..friction.parts import roughness_share, roughness_share_slope
from ..friction.sets import FITTED, MECHANISTIC, SETS
from ..friction.torque import NutSums
from .measurements import Measurement

#: name of the loss -> name that scipy gives it
LOSSES = {"least_squares": "linear", "soft_l1": "soft_l1"}
#: the table of the points that are in no table
NO_TABLE = "all"
#: relative error at which soft_l1 changes from squares to absolute values
SOFT_SCALE = 0.01

#: number of the roughness height in FITTED, the parameter in which the torque is not linear
HEIGHT = 2

#: ratio [1], net sliding coefficient [1], roughness height [m], as FITTED
Values = Sequence[float] | NDArray[np.float64]


@dataclass(frozen=True)
class TorqueBasis:
    """Torque of the double nut at n operating points as a function of the fitted parameters.

    viscous (n, 4) [N.m] and film (n, 4) [m] of screw and nut raceway, first nut, then second nut; hysteresis (n,) and
    sliding (n,) [N.m]: the sums of NutSums over both nuts. The film of a nut without load is inf.
    names   of the parameters that a fit determines, the most important first;  held: values of the others

    Mechanistic law, see of_powers: viscous is the rolling part, hysteresis also holds the shear of the contacts,
    sliding the friction of ball on ball; its film is inf, for the torque does not depend on the roughness height.
    """

    measurements: tuple[Measurement, ...]
    viscous: np.ndarray
    film: np.ndarray
    hysteresis: np.ndarray
    sliding: np.ndarray
    names: tuple[str, ...] = FITTED
    held: tuple[float, ...] = (0.0, 0.0, 0.0)

    @classmethod
    def of_nuts(cls, measurements: Sequence[Measurement], sums: Sequence[Sequence[NutSums]]) -> TorqueBasis:
        """Two nuts per point, each with the sums under its own force."""
        return cls(
            tuple(measurements),
            np.array([[value for s in nuts for value in (s.viscous_screw, s.viscous_nut)] for nuts in sums]),
            np.array([[value for s in nuts for value in (s.film_screw, s.film_nut)] for nuts in sums]),
            np.array([sum(s.hysteresis for s in nuts) for nuts in sums]),
            np.array([sum(s.sliding for s in nuts) for nuts in sums]),
        )

    @classmethod
    def of_powers(
        cls, measurements: Sequence[Measurement], powers: Sequence[Sequence[NutPowers]]
    ) -> TorqueBasis:
        """Two nuts per point by the mechanistic law; the factor of the rolling part is held at 1."""
        return cls(
            tuple(measurements),
            np.array(
                [[value for p in nuts for value in (p.rolling_screw, p.rolling_nut)] for nuts in powers]
            ),
            np.full((len(measurements), 4), np.inf),
            np.array([sum(p.hysteresis + p.shear for p in nuts) for nuts in powers]),
            np.array([sum(p.thrust_factor * p.ball_ball for p in nuts) for nuts in powers]),
            SETS[MECHANISTIC],
            (1.0, 0.0, 0.0),
        )

    def fitted(self, count: int) -> list[int]:
        """Numbers of the first parameters that a fit determines, in the order of names."""
        return [FITTED.index(name) for name in self.names[:count]]

    def __len__(self) -> int:
        return len(self.measurements)

    def subset(self, keep: Sequence[int]) -> TorqueBasis:
        """The points with these numbers."""
        rows = list(keep)
        chosen = tuple(self.measurements[i] for i in rows)
        return replace(
            self,
            measurements=chosen,
            viscous=self.viscous[rows],
            film=self.film[rows],
            hysteresis=self.hysteresis[rows],
            sliding=self.sliding[rows],
        )

    def torque(self, values: Values) -> np.ndarray:
        """Torque [N.m] at the points for ratio [1], net sliding coefficient [1], roughness height [m]."""
        ratio, net, height = values
        viscous = np.sum(self.viscous * roughness_share(self.film, height), axis=1)
        return ratio * viscous + self.hysteresis + net * self.sliding

    def errors(self, values: Values) -> np.ndarray:
        """Weighted relative errors r at the points."""
        return self.weights * (self.torque(values) / self.measured - 1.0)

    def jacobian(self, values: Values) -> np.ndarray:
        """d errors/d values, (n, 3)."""
        ratio, _, height = values
        share = roughness_share(self.film, height)
        by_height = self.viscous * roughness_share_slope(self.film, height)
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


def linear_fit(basis: TorqueBasis, height: float, count: int = 2) -> np.ndarray:
    """Least squares in the fitted parameters but the roughness height, none negative, for a given height."""
    free = [i for i in basis.fitted(count) if i != HEIGHT]
    values = np.array([*basis.held[:HEIGHT], height])
    values[free] = 0.0
    if free:
        matrix = np.take(basis.jacobian((1.0, 1.0, height)), free, axis=1)
        scale = 1.0 / np.linalg.norm(matrix, axis=0)
        values[free] = nnls(matrix * scale, -basis.errors(values))[0] * scale
    return values


def _scale(basis: TorqueBasis, free: list[int]) -> np.ndarray:
    """Scale of the fitted parameters: each part alone gives the torque; the thinnest film for the height."""
    columns = np.abs(basis.jacobian((1.0, 1.0, 0.0))).mean(axis=0)
    return np.array([basis.film.min() if i == HEIGHT else 1.0 / columns[i] for i in free])


def _smallest(basis: TorqueBasis, count: int, loss: str) -> np.ndarray:
    """Least sum of scipy's loss of the errors, none of the parameters negative."""
    free = basis.fitted(count)
    rough = HEIGHT in free
    if not rough and loss == "linear":
        return linear_fit(basis, 0.0, count)
    best, lowest, scale, thinnest = None, np.inf, _scale(basis, free), basis.film.min()
    root = np.array([i == HEIGHT for i in free])

    # the square of the height as unknown: the torque changes linearly with it near 0
    def values(x: np.ndarray) -> np.ndarray:
        found = np.array(basis.held)
        found[free] = scale * np.where(root, np.sqrt(x), x)
        return found

    def slopes(x: np.ndarray) -> np.ndarray:
        slope = np.where(root, 0.5 / np.sqrt(x), 1.0)
        return np.take(basis.jacobian(values(x)), free, axis=1) * scale * slope

    # the loss may have several minima in the roughness height
    for share in (0.3, 1.0, 3.0) if rough else (0.0,):
        height = share * thinnest if rough else 0.0
        start = np.maximum(linear_fit(basis, height, count)[free] / scale, 1e-3)
        start[root] = share**2
        found = least_squares(
            lambda x: basis.errors(values(x)),
            start,
            jac=slopes,
            bounds=(0.0, np.inf),
            loss=loss,
            f_scale=SOFT_SCALE,
            xtol=1e-12,
            ftol=1e-12,
            gtol=1e-12,
            max_nfev=2000,
        )
        if not found.success:
            raise ArithmeticError(f"fit stopped without a minimum: {found.message}")
        if found.cost < lowest * (1.0 - 1e-12):
            best, lowest = values(found.x), found.cost
    assert best is not None
    if rough and best[HEIGHT] < 1e-3 * thinnest:
        # the method stays inside its bounds: a negligible height is set to 0
        return _smallest(basis, 2, loss)
    return best


def fit_values(basis: TorqueBasis, count: int, loss: str) -> np.ndarray:
    """Ratio [1], net sliding coefficient [1], roughness height [m] that minimise a loss.

    Parameters   basis : n points, n >= count;  count : fitted parameters, the first of basis.names
                 loss : name, see the top of this file
    Raises       ValueError: unknown loss;  ArithmeticError: no minimum found
    """
    if loss not in LOSSES:
        raise ValueError(f"loss = {loss!r}; allowed: {', '.join(LOSSES)}")
    return _smallest(basis, count, LOSSES[loss])
