"""Least squares for the friction numbers of a law on measured torques.

Minimised is the sum of r^2, r = w (T/T_measured - 1) the relative error with the weight w of a measurement. The torque
is linear in the apparent viscosity ratio and in the net sliding coefficient, and no film changes during a fit: each
operating point is evaluated once. Only the roughness height of the set three_parameter needs iterations.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np

from ..friction.mechanistic import ContactValues, nut_powers
from ..friction.sets import FITTED, SETS
from ..friction.torque import (
    UNLOADED,
    FilmModel,
    NutTorques,
    nut_forces,
    nut_sums,
    roughness_share,
    roughness_share_slope,
)
from ..nut_map.built import Progress
from ..parameters.file import Parameters
from ..physics.ball_law import Array
from ..physics.load import nut_loads
from ..runtime.packed import MECHANISTIC
from .measurements import Measurement

#: ratio [1], net sliding coefficient [1], roughness height [m], as FITTED
Values = Sequence[float] | Array
#: number of the roughness height in FITTED, the parameter in which the torque is not linear
HEIGHT = 2
#: roughness height over the thinnest film below which it counts as 0: the method stays inside its bounds
MIN_HEIGHT = 1e-3
#: deviation of a torque below which it is no outlier: drag torques of one screw do not repeat more closely
MIN_OUTLIER = 0.03
#: leverage above which no other point checks a point
MAX_LEVERAGE = 0.9


@dataclass(frozen=True)
class TorqueBasis:
    """Torque of the double nut at n operating points as a function of the fitted parameters.

    viscous (n, 4) [N.m] and film (n, 4) [m] of screw and nut raceway, first nut, then second nut; hysteresis (n,) and
    sliding (n,) [N.m]: sums over both nuts. The film of a nut without load is inf.
    names   of the parameters that a fit determines;  fixed: values of the others

    Mechanistic law: viscous is the rolling part, hysteresis also holds the shear of the contacts, sliding the friction
    of ball on ball; its film is inf, for the torque does not depend on the roughness height.
    """

    measurements: tuple[Measurement, ...]
    viscous: Array
    film: Array
    hysteresis: Array
    sliding: Array
    names: tuple[str, ...] = FITTED
    fixed: tuple[float, ...] = (0.0, 0.0, 0.0)

    @classmethod
    def of_nuts(cls, measurements: Sequence[Measurement], sums: Sequence[Sequence[NutTorques]]) -> Self:
        """Two nuts per point, each with the sums under its own force."""
        return cls(
            tuple(measurements),
            np.array([[value for s in nuts for value in (s.viscous_screw, s.viscous_nut)] for nuts in sums]),
            np.array([[value for s in nuts for value in (s.film_screw, s.film_nut)] for nuts in sums]),
            np.array([sum(s.hysteresis + s.shear for s in nuts) for nuts in sums]),
            np.array([sum(s.thrust_factor * s.sliding for s in nuts) for nuts in sums]),
        )

    @property
    def fitted(self) -> list[int]:
        """Numbers in FITTED of the parameters that a fit determines."""
        return [FITTED.index(name) for name in self.names]

    def __len__(self) -> int:
        return len(self.measurements)

    def subset(self, rows: Sequence[int]) -> Self:
        """The points with these numbers."""
        rows = list(rows)
        parts = {name: getattr(self, name)[rows] for name in ("viscous", "film", "hysteresis", "sliding")}
        return replace(self, measurements=tuple(self.measurements[i] for i in rows), **parts)

    def torque(self, values: Values) -> Array:
        """Torque [N.m] at the points for ratio [1], net sliding coefficient [1], roughness height [m]."""
        ratio, net, height = values
        viscous = np.sum(self.viscous * roughness_share(self.film, height), axis=1)
        return np.asarray(ratio * viscous + self.hysteresis + net * self.sliding)

    def errors(self, values: Values) -> Array:
        """Weighted relative errors r at the points."""
        return np.asarray(self.weights * (self.torque(values) / self.measured - 1.0))

    def jacobian(self, values: Values) -> Array:
        """d errors/d values, (n, 3)."""
        ratio, _, height = values
        viscous = np.sum(self.viscous * roughness_share(self.film, height), axis=1)
        by_height = ratio * np.sum(self.viscous * roughness_share_slope(self.film, height), axis=1)
        columns = np.stack([viscous, self.sliding, by_height], axis=1)
        return np.asarray(columns * (self.weights / self.measured)[:, None])

    @property
    def measured(self) -> Array:
        """Measured torques [N.m]."""
        return np.array([m.torque for m in self.measurements])

    @property
    def weights(self) -> Array:
        """Factors on the relative errors."""
        return np.array([m.weight for m in self.measurements])


def torque_basis(
    parameters: Parameters,
    film_model: FilmModel | ContactValues,
    measurements: Sequence[Measurement],
    progress: Progress = lambda finished, total, what: None,
) -> TorqueBasis:
    """Evaluate both nuts at every operating point: loads of the balls, films, sums.

    Parameters   film_model : films, or the contacts of the mechanistic law
    Raises       ValueError: a point outside the range of the film model or of the load distribution, by name
    """
    screw, sums, what = parameters.screw, [], f"operating points with {film_model.name}"
    mechanistic = film_model.name == MECHANISTIC
    evaluate: Callable[..., NutTorques] = nut_powers if mechanistic else nut_sums
    count = screw.loaded_ball_count if mechanistic else screw.ball_count
    for number, m in enumerate(measurements):
        progress(number, len(measurements), what)
        try:
            nuts = [
                evaluate(parameters, nut_loads(screw, force, count), m.speed, m.temperature, film_model)
                if force > 0.0
                else UNLOADED
                for force in dict.fromkeys(nut_forces(parameters, m.preload, m.axial_load))
            ]
        except ValueError as err:
            raise ValueError(f"{m.point}: {err}") from err
        sums.append(nuts if len(nuts) == 2 else 2 * nuts)
    progress(len(measurements), len(measurements), what)
    basis = TorqueBasis.of_nuts(measurements, sums)
    # the factor of the rolling part is fixed
    return replace(basis, names=SETS[MECHANISTIC], fixed=(1.0, 0.0, 0.0)) if mechanistic else basis


def fit_values(basis: TorqueBasis) -> Array:
    """Values (3,) as FITTED that minimise the sum of squared errors, none negative.

    The sum may have two minima over the roughness height: iterations start at the thinnest and at the median film.

    Raises       ValueError: viscous and sliding part proportional;  ArithmeticError: no minimum reached
    """
    if FITTED[HEIGHT] not in basis.names:
        return _minimum(basis, basis.fixed[HEIGHT])
    films = basis.film[np.isfinite(basis.film)]
    found = [_minimum(basis, float(height)) for height in (films.min(), np.median(films))]
    best = min(found, key=lambda values: float(np.sum(basis.errors(values) ** 2)))
    if best[HEIGHT] < MIN_HEIGHT * films.min():
        return _minimum(replace(basis, names=basis.names[:HEIGHT]), 0.0)
    return best


def _minimum(basis: TorqueBasis, height: float) -> Array:
    """Linear least squares at a roughness height [m], from which iterations start if the height is free."""
    free, start = basis.fitted, np.array([*basis.fixed[:HEIGHT], height])
    linear = [i for i in free if i != HEIGHT]
    start[linear] = 0.0
    columns = np.take(basis.jacobian((1.0, 1.0, height)), linear, axis=1)
    norm = np.linalg.norm(columns, axis=0)
    if len(linear) > 1 and not np.linalg.cond(columns / norm) < 1e6:
        raise ValueError("viscous and sliding part are proportional at all points: measure at several speeds")
    from scipy.optimize import least_squares, nnls

    start[linear] = nnls(columns / norm, -basis.errors(start))[0] / norm
    if HEIGHT not in free:
        return start
    start[linear] = np.maximum(start[linear], 1e-3 / norm)
    scale = start[free]

    def values(x: Array) -> Array:
        start[free] = scale * x
        return start

    found = least_squares(
        lambda x: basis.errors(values(x)), np.ones(len(free)), bounds=(0.0, np.inf),
        jac=lambda x: np.take(basis.jacobian(values(x)), free, axis=1) * scale,
        xtol=1e-12, ftol=1e-12, gtol=1e-12,
    )  # fmt: skip
    if not found.success:
        raise ArithmeticError(f"fit stopped without a minimum: {found.message}")
    return values(found.x).copy()


class Fit(NamedTuple):
    """Values with what the linearised model says of them; arrays per point (n,).

    deviation     model/measured - 1;  left_out: the same by the fit without the point and its repeats, NaN if those
                  are needed to determine a parameter
    leverage      hat value: share of the point in its own fitted value, 0 to 1
    studentised   deleted studentised residual, NaN if not determined;  limit: its bound for one false alarm in 20 fits
    half_width    of the 95 % interval by parameter, inf if not determined
    """

    values: Array
    deviation: Array
    left_out: Array
    leverage: Array
    studentised: Array
    limit: float
    half_width: dict[str, float]

    @property
    def outliers(self) -> list[int]:
        """Numbers of the points that do not agree with the others; NaN is none: no other point checks it."""
        large = (np.abs(self.deviation) > MIN_OUTLIER) & (np.abs(self.studentised) > self.limit)
        return np.flatnonzero(large).tolist()

    @property
    def limits(self) -> dict[str, dict[str, float]]:
        """Bounds of the 95 % intervals, none negative."""
        values = {name: float(self.values[FITTED.index(name)]) for name in self.half_width}
        return {
            name: {"low": max(value - half, 0.0), "high": value + half}
            for (name, value), half in zip(values.items(), self.half_width.values(), strict=True)
        }


def fit(basis: TorqueBasis, groups: Sequence[Sequence[int]]) -> Fit:
    """Least squares with hat values, Student t intervals and errors of points left out.

    Parameters   groups : numbers of the points of each operating point, which are left out together
    Validity     intervals and hat values: exact for a linear model, linearised for the roughness height, with which
                 the left-out errors are those of new fits; errors independent, normal, of equal relative size
    Source       Cook & Weisberg, Residuals and Influence in Regression (1982), sections 2.2.1 (deleted studentised
                 residuals, Bonferroni bound) and 3.4: residuals left out together (1 - H_gg)^-1 r_g
    """
    from scipy.stats import t as student_t

    values, n, p = fit_values(basis), len(basis), len(basis.names)
    r, J = basis.errors(values), basis.jacobian(values)
    sum_of_squares, half_width = float(r @ r), dict.fromkeys(basis.names, math.inf)
    # at height 0 the torque does not depend on the height to first order
    free = [i for i in basis.fitted if i != HEIGHT or values[i] > 0.0]
    norm = np.linalg.norm(J[:, free], axis=0)
    R = np.linalg.qr(J[:, free] / norm, mode="r")
    if np.linalg.cond(R) < 1e7:
        sigma = math.sqrt(sum_of_squares / (n - p)) * np.linalg.norm(np.linalg.inv(R), axis=1) / norm
        for i, half in zip(free, student_t.ppf(0.975, n - p) * sigma, strict=True):
            half_width[FITTED[i]] = float(half)
    # a value at its bound 0 stays there without the point
    inner = [i for i in free if values[i] > 0.0]
    Q = np.linalg.qr(J[:, inner] / np.linalg.norm(J[:, inner], axis=0)).Q
    H = Q @ Q.T
    leverage = np.diag(H)
    left_out = np.full(n, math.nan)
    for group in groups if len(groups) > p else [[i] for i in range(n)]:
        kept = np.eye(len(group)) - H[np.ix_(group, group)]
        if HEIGHT in basis.fitted:
            # not linear: with the hat values the error would be two thirds of that of a fit to the other points
            others = fit_values(basis.subset([i for i in range(n) if i not in group]))
            left_out[group] = (basis.torque(others) / basis.measured - 1.0)[group]
        elif np.linalg.cond(kept) < 1e9 and leverage[group].max() < 1.0 - 1e-9:
            left_out[group] = np.linalg.solve(kept, r[group]) / basis.weights[group]
    studentised, limit = np.full(n, math.nan), math.inf
    if n - p >= 2:
        checked, own = leverage < 1.0 - 1e-6, np.maximum(1.0 - leverage, 1e-12)
        rest = np.maximum(sum_of_squares - r**2 / own, 1e-24 * n)
        studentised[checked] = (r * np.sqrt((n - p - 1) / (own * rest)))[checked]
        limit = float(student_t.ppf(1.0 - 0.05 / (2 * n), n - p - 1))
    return Fit(values, r / basis.weights, left_out, leverage, studentised, limit, half_width)
