"""Least squares for the friction numbers of a law on measured torques.

Minimised is the sum of r^2, r = w (T/T_measured - 1) the relative error with the weight w of a measurement. The torque
is linear in the apparent viscosity ratio and in the net sliding coefficient, and no film changes during a fit: each
operating point is evaluated once. Only a third value is searched for: the roughness height of the set three_parameter,
one over the supply length of the mechanistic law, all lengths of which take the same contacts.
"""

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np

from ballscrew_tehl.friction.film_shear import (
    UNLOADED,
    UnfittedTorques,
    nut_forces,
    nut_sums,
    roughness_share,
    roughness_share_slope,
)
from ballscrew_tehl.friction.interval import KNOWN_ERROR, with_constants
from ballscrew_tehl.friction.mechanistic import loaded_nuts, powers_of_nuts, torque_line
from ballscrew_tehl.friction.sets import FITTED, SETS, SUPPLY
from ballscrew_tehl.numerics import Array
from ballscrew_tehl.nut_map.grid import Progress
from ballscrew_tehl.parameters.file import Parameters
from ballscrew_tehl.parameters.friction import BOUNDED, ball_ball_coefficient
from ballscrew_tehl.physics.load import nut_loads
from ballscrew_tehl.runtime.packed import Law

from .measurements import Measurement

#: parameters of the mechanistic law; those of the others are FITTED
INVERSE_SUPPLY = "inverse_supply_length"
OF_MECHANISTIC = *FITTED[:2], INVERSE_SUPPLY
#: ratio [1], net sliding coefficient [1], roughness height [m] or 1/supply_length [1]
Values = Sequence[float] | Array
#: place of the parameter in which the torque is not linear
THIRD = 2
#: roughness heights over the thinnest film between which the search starts: the sum may have two minima
HEIGHTS = np.r_[0.0, np.geomspace(0.03, 30.0, 50)]
#: deviation of a torque below which it is no outlier: drag torques of one screw do not repeat more closely
MIN_OUTLIER = 0.03
#: least relative standard error of a torque in the half-widths, of a good sensor: equal readings do not claim less
LEAST_ERROR = 0.005
#: fewest points of which a length of the supply is asked
FOR_SUPPLY = 3
#: largest 1/length [1], lengths of which the rolling part is computed, and to which it is interpolated
MAX_INVERSE = 1.0 / BOUNDED[SUPPLY].low
INVERSES, DENSE = np.linspace(0.0, MAX_INVERSE, 25), np.linspace(0.0, MAX_INVERSE, 301)


@dataclass(frozen=True)
class TorqueBasis:
    """Torque of the double nut at n operating points as a function of the fitted parameters.

    Attributes
    ----------
    measurements : tuple of Measurement
        The points.
    viscous, film : (n, k) array
        Viscous torque [N.m] and film [m] of k raceways; the film of a nut without load is inf. Mechanistic law: the
        rolling part, k = 1 with a film of inf, for the torque does not depend on the roughness height.
    hysteresis, sliding : (n,) array
        Of both nuts [N.m]. Mechanistic law: hysteresis with the shear of the contacts; sliding is ball on ball.
    names : tuple of str
        Parameters that a fit determines.
    fixed : tuple of float
        Values of the others.
    rolling : (len(DENSE), n) array or None
        Rolling part by 1/supply_length [N.m]; None: the length is known, or there are too few points.

    Notes
    -----
    The torque is linear in the apparent viscosity ratio and the net sliding coefficient; the third value is a roughness
    height [m] or 1/supply_length [1]. Values are these three, (3,).

    Examples
    --------
    >>> import numpy as np
    >>> point = Measurement(1000.0, 10.472, 303.15, 0.5)
    >>> basis = TorqueBasis((point,), np.array([[0.3]]), np.array([[np.inf]]), np.array([0.1]), np.array([10.0]))
    >>> basis.torque((1.0, 0.01, 0.0))
    array([0.5])
    """

    measurements: tuple[Measurement, ...]
    viscous: Array
    film: Array
    hysteresis: Array
    sliding: Array
    names: tuple[str, ...] = FITTED
    fixed: tuple[float, ...] = (0.0, 0.0, 0.0)
    rolling: Array | None = None

    @classmethod
    def of_nuts(cls, measurements: Sequence[Measurement], sums: Sequence[Sequence[UnfittedTorques]]) -> Self:
        """By the law of the paper, the sums of both nuts at each point."""

        def columns(*names: str) -> Array:
            return np.array([[getattr(s, name) for s in nuts for name in names] for nuts in sums])

        viscous, film = columns("viscous_screw", "viscous_nut"), columns("film_screw", "film_nut")
        parts = (columns(name).sum(axis=1) for name in ("hysteresis", "sliding"))
        return cls(tuple(measurements), viscous, film, *parts)

    @classmethod
    def of_powers(
        cls,
        measurements: Sequence[Measurement],
        powers: Sequence[Sequence[Sequence[tuple[int, UnfittedTorques]]]],
    ) -> Self:
        """By the mechanistic law, powers_of_nuts at each point, of the screw file and of INVERSES if there are any."""
        from scipy.interpolate import PchipInterpolator

        remainder, sliding = np.array([torque_line(nuts, 0.0) for nuts, *_ in powers]).T
        rolling = np.array([[torque_line(nuts)[0] for nuts in lengths] for lengths in powers]).T - remainder
        dense = PchipInterpolator(INVERSES, rolling[1:])(DENSE) if len(rolling) > 1 else None
        film = np.full((len(remainder), 1), np.inf)
        law = SETS[Law.MECHANISTIC], (1.0, 0.0, 0.0), dense
        return cls(tuple(measurements), rolling[0][:, None], film, remainder, sliding, *law)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the values."""
        return FITTED if self.rolling is None else OF_MECHANISTIC

    @property
    def fitted(self) -> list[int]:
        """Places of the values that a fit determines."""
        return [self.parameters.index(name) for name in self.names]

    def __len__(self) -> int:
        return len(self.measurements)

    def subset(self, rows: Sequence[int]) -> Self:
        """The points with these numbers."""
        rows = list(rows)
        parts = {name: getattr(self, name)[rows] for name in ("viscous", "film", "hysteresis", "sliding")}
        parts["rolling"] = None if self.rolling is None else self.rolling[:, rows]
        return replace(self, measurements=tuple(self.measurements[i] for i in rows), **parts)

    def torque(self, values: Values) -> Array:
        """Torque [N.m] at the points."""
        ratio, net, third = values
        viscous, _ = self._viscous(third)
        return np.asarray(ratio * viscous + self.hysteresis + net * self.sliding)

    def errors(self, values: Values) -> Array:
        """Weighted relative errors r at the points."""
        return np.asarray(self.weights * (self.torque(values) / self.measured - 1.0))

    def jacobian(self, values: Values) -> Array:
        """d errors/d values, (n, 3)."""
        ratio, _, third = values
        viscous, slope = self._viscous(third)
        columns = np.stack([viscous, self.sliding, ratio * slope], axis=1)
        return np.asarray(columns * (self.weights / self.measured)[:, None])

    def _viscous(self, third: float) -> tuple[Array, Array]:
        """Viscous part [N.m] at a roughness height, or rolling part at 1/length, with its derivative."""
        if self.rolling is not None and INVERSE_SUPPLY in self.names:
            i = min(int(third / DENSE[1]), len(DENSE) - 2)
            slope = (self.rolling[i + 1] - self.rolling[i]) / DENSE[1]
            return self.rolling[i] + (third - DENSE[i]) * slope, slope
        shares = roughness_share(self.film, third), roughness_share_slope(self.film, third)
        return np.sum(self.viscous * shares[0], axis=1), np.sum(self.viscous * shares[1], axis=1)

    @property
    def starts(self) -> Array:
        """Third values between which the search starts."""
        return self.film.min() * HEIGHTS if self.rolling is None else INVERSES

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
    film_model: Any,
    measurements: Sequence[Measurement],
    progress: Progress = lambda finished, total, what: None,
) -> TorqueBasis:
    """Both nuts at every operating point by a FilmModel, or by ContactValues of the mechanistic law."""
    mechanistic, nuts = parameters.friction.law is Law.MECHANISTIC, list[Any]()
    what, variants = "operating points", [parameters]
    if len(measurements) >= FOR_SUPPLY and SUPPLY not in parameters.friction.model_fields_set:
        # the first of finite length, too: beyond R_x none changes anything
        variants += [with_constants(parameters, {SUPPLY: 1.0 / max(each, 1e-6)}) for each in INVERSES]
    screw = parameters.screw
    for number, m in enumerate(measurements):
        progress(number, len(measurements), what)
        try:
            forces = nut_forces(parameters, m.preload, m.axial_load)
            if mechanistic:
                loaded = loaded_nuts(parameters, forces)
                powers = powers_of_nuts(variants, loaded, m.speed, m.temperature, film_model)
                times = [nut.times for nut in loaded]
                nuts.append([list(zip(times, each, strict=True)) for each in powers])
            else:
                loads = {force: nut_loads(screw, force, screw.ball_count) for force in {*forces} - {0.0}}
                sums = {
                    force: nut_sums(parameters, each, m.speed, m.temperature, film_model)
                    for force, each in loads.items()
                }
                nuts.append([sums.get(force, UNLOADED) for force in forces])
        except ValueError as err:
            raise ValueError(f"{m.point}: {err}") from err
    progress(len(measurements), len(measurements), what)
    return (TorqueBasis.of_powers if mechanistic else TorqueBasis.of_nuts)(measurements, nuts)


def fit_values(basis: TorqueBasis) -> Array:
    """Values (3,) that minimise the sum of squared errors, none negative."""
    if THIRD not in basis.fitted:
        return _linear_values(basis, basis.fixed[THIRD])
    from scipy.optimize import minimize_scalar

    def squares(third: float) -> float:
        return float(np.sum(basis.errors(_linear_values(basis, third)) ** 2))

    starts = basis.starts
    k = int(np.argmin([squares(third) for third in starts]))
    around = starts[max(k - 1, 0)], starts[min(k + 1, len(starts) - 1)]
    result = minimize_scalar(squares, bounds=around, method="bounded", options={"xatol": 1e-9 * around[1]})
    return _linear_values(basis, min((starts[k], result.x), key=squares))


def _linear_values(basis: TorqueBasis, third: float) -> Array:
    """Values with a third one: linear least squares in the others that are fitted."""
    from scipy.optimize import nnls

    linear = [i for i in basis.fitted if i != THIRD]
    values = np.array([*basis.fixed[:THIRD], third])
    if linear:
        values[linear] = 0.0
        columns = basis.jacobian((1.0, 1.0, third))[:, linear]
        norm = np.linalg.norm(columns, axis=0)
        if not np.linalg.cond(columns / norm) < 1e6:
            raise ValueError(
                "viscous and sliding part are proportional at all points: measure at several speeds"
            )
        values[linear] = nnls(columns / norm, -basis.errors(values))[0] / norm
    return values


class Supply(NamedTuple):
    """95 % limits of both numbers of the mechanistic law, of each whatever the other is within its bounds."""

    inverse: tuple[float, ...]  # 1/length [1]
    coefficient: tuple[float, ...]

    @property
    def length(self) -> tuple[float, float]:
        """Limits of the supply length, inf: flooded."""
        low, high = self.inverse
        return 1.0 / high, 1.0 / low if low > 0.0 else math.inf


def supply_limits(basis: TorqueBasis) -> Supply:
    """Limits from all points.

    Valid: exact for normal errors of equal relative size, lengths uniform in 1/length between their bounds,
    coefficients uniform from 0; so also where the data say little of the length, after any choice by them. Box & Tiao,
    Bayesian Inference in Statistical Analysis (1973), section 2.7: coefficient and size of the errors integrated out
    of the posterior. Highest density for the length, equal tails for the coefficient.
    """
    from scipy.stats import t as student_t

    n, rolling = len(basis), np.asarray(basis.rolling)
    column = basis.weights * basis.sliding / basis.measured
    remainder = basis.weights * ((rolling + basis.hysteresis) / basis.measured - 1.0)
    fitted = -(remainder @ column) / (column @ column)
    squares = np.sum((remainder + fitted[:, None] * column) ** 2, axis=1) + KNOWN_ERROR**2
    freedom = n  # with the error that is known, without the coefficient
    scale = np.sqrt(squares / (freedom * (column @ column)))
    positive = np.maximum(student_t.cdf(fitted / scale, freedom), 1e-300)
    density = (squares / squares.min()) ** (-0.5 * freedom) * positive
    density /= density.sum()
    ordered = np.argsort(-density)
    inside = DENSE[ordered[: int(np.searchsorted(np.cumsum(density[ordered]), 0.95)) + 1]]

    upper = positive[:, None] * (np.arange(100.0) + 0.5) / 100.0
    samples = np.maximum(fitted[:, None] - scale[:, None] * student_t.ppf(upper, freedom), 0.0)
    order = np.argsort(samples, axis=None)
    weights = np.cumsum(np.repeat(density, upper.shape[1])[order]) / upper.shape[1]
    ends = np.ravel(samples)[order][np.searchsorted(weights, (0.025, 0.975))]
    inverse = np.clip([inside.min() - DENSE[1], inside.max() + DENSE[1]], 0.0, MAX_INVERSE)
    return Supply(*(tuple(map(float, numbers)) for numbers in (inverse, ends)))


class Fit(NamedTuple):
    """Values with what the linearised model says of them; arrays per point (n,).

    deviation: model/measured - 1; left_out: the same by the fit without the point and its repeats, NaN if a parameter
    depends on those; leverage: hat value, fraction of the point in its fitted value; studentised: deleted
    studentised residual, NaN if not determined; limit: its bound for one false alarm in 20 fits; half_width: of the
    95 % interval by parameter, inf if not determined; supply: of the mechanistic law, None if its length is known
    """

    values: Array
    deviation: Array
    left_out: Array
    leverage: Array
    studentised: Array
    limit: float
    half_width: dict[str, float]
    supply: Supply | None = None

    @property
    def outliers(self) -> list[int]:
        """Numbers of the points that do not agree with the others; NaN is none: no other point checks it."""
        large = (np.abs(self.deviation) > MIN_OUTLIER) & (np.abs(self.studentised) > self.limit)
        return np.flatnonzero(large).tolist()

    @property
    def limits(self) -> dict[str, dict[str, float]]:
        """Bounds of the 95 % intervals, none negative."""
        if self.supply is not None:
            pairs = {FITTED[1]: self.supply.coefficient, SUPPLY: self.supply.length}
            return {name: {"low": low, "high": high} for name, (low, high) in pairs.items()}
        values = dict(zip(FITTED, self.values.tolist(), strict=True))
        ends = {name: (values[name] - half, values[name] + half) for name, half in self.half_width.items()}
        return {name: {"low": max(low, 0.0), "high": high} for name, (low, high) in ends.items()}


def fit(
    basis: TorqueBasis,
    groups: Sequence[Sequence[int]],
    chosen: Callable[[Sequence[int]], TorqueBasis] | None = None,
) -> Fit:
    """Least squares with hat values, Student t intervals and errors of points left out, those of a group together.

    chosen: basis of some of the points with the parameters that their fit determines; None: those of the basis. Valid:
    intervals and hat values: exact for a linear model; errors independent, normal, of equal relative size. Cook &
    Weisberg, Residuals and Influence in Regression (1982), section 2.2.1: deleted studentised residuals, Bonferroni
    bound.
    """
    from scipy.stats import t as student_t

    values, n, p = fit_values(basis), len(basis), len(basis.names)
    r, J, freedom = basis.errors(values), basis.jacobian(values), n - p
    sum_of_squares, half_width = float(r @ r), dict.fromkeys(basis.names, math.inf)
    # at height 0 the torque does not depend on the height to first order
    free = [i for i in basis.fitted if i != THIRD or values[i] > 0.0]
    norm = np.linalg.norm(J[:, free], axis=0)
    R = np.linalg.qr(J[:, free] / norm, mode="r")
    if freedom > 0 and np.linalg.cond(R) < 1e7:
        sigma = (
            max(math.sqrt(sum_of_squares / freedom), LEAST_ERROR)
            * np.linalg.norm(np.linalg.inv(R), axis=1)
            / norm
        )
        half_width |= zip(
            [basis.parameters[i] for i in free], (student_t.ppf(0.975, freedom) * sigma).tolist(), strict=True
        )
    # a value at its bound stays there
    inner = [i for i in free if values[i] > 0.0 and not (i == THIRD and values[i] == basis.starts[-1])]
    Q = np.linalg.qr(J[:, inner] / np.linalg.norm(J[:, inner], axis=0)).Q
    leverage = np.sum(Q**2, axis=1)
    left_out = np.full(n, math.nan)
    for group in groups if len(groups) > p else [[i] for i in range(n)]:
        others = [i for i in range(n) if i not in group]
        # ValueError: they do not determine all parameters
        with suppress(ValueError):
            part = (chosen or basis.subset)(others)
            if len(others) >= len(part.names):
                own = replace(basis, names=part.names, fixed=part.fixed)
                left_out[group] = (own.torque(fit_values(part)) / basis.measured - 1.0)[group]
    studentised, limit = np.full(n, math.nan), math.inf
    if freedom >= 2:
        checked = leverage < 1.0 - 1e-6
        own = 1.0 - leverage[checked]
        remainder = np.maximum(sum_of_squares - r[checked] ** 2 / own, 1e-24 * n)
        studentised[checked] = r[checked] * np.sqrt((freedom - 1) / (own * remainder))
        limit = float(student_t.ppf(1.0 - 0.05 / (2 * n), freedom - 1))
    return Fit(values, r / basis.weights, left_out, leverage, studentised, limit, half_width)


def fit_law(
    basis: TorqueBasis, groups: Sequence[Sequence[int]], parameters: Parameters, coefficient: float
) -> tuple[TorqueBasis, Fit]:
    """Fit of what the data determine: the coefficient, the supply length or both; the others have their defaults.

    Of the mechanistic law the length is fitted where its default is outside its 95 % limits, and then the coefficient
    unless its limits hold the bounds of ball_thrust.
    """
    if basis.rolling is None:
        return basis, fit(basis, groups)
    whole, default, bound = basis, 1.0 / parameters.friction.supply_length, BOUNDED["ball_thrust"]
    low, high = (ball_ball_coefficient(parameters.friction, thrust) for thrust in (bound.low, bound.high))

    def chosen(rows: Sequence[int]) -> tuple[TorqueBasis, Supply | None]:
        part = whole.subset(rows)
        if len(rows) < FOR_SUPPLY:
            return part, None
        supply = supply_limits(part)
        if not supply.inverse[0] <= default <= supply.inverse[1]:
            level = not (supply.coefficient[0] <= low and high <= supply.coefficient[1])
            names = OF_MECHANISTIC[1:] if level else OF_MECHANISTIC[THIRD:]
            part = replace(part, names=names, fixed=(1.0, coefficient, 0.0))
        return part, supply

    basis, supply = chosen(range(len(whole)))
    result = fit(basis, groups, lambda rows: chosen(rows)[0])
    if supply is None:
        return basis, result
    k = float(result.values[1])
    ends = min(supply.coefficient[0], k), max(supply.coefficient[1], k)
    half_width = {FITTED[1]: 0.5 * (ends[1] - ends[0])}
    return basis, result._replace(supply=supply._replace(coefficient=ends), half_width=half_width)
