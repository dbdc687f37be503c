"""Diagnostics of a fit to measured torques: profile limits, outliers, what the data do not identify."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar
from scipy.stats import t as student_t
from scipy.stats import wilcoxon

from ..friction.sets import FITTED
from .fit import HEIGHT, TorqueBasis, Values, fit_values, linear_fit

Array = NDArray[np.float64]

#: a parameter counts as identified if half its 95 % interval is at most this share of its value
PRECISION = 0.25
#: the split counts as identified if the 95 % interval of the sliding share of the torque is at most this wide
SPLIT_WIDTH = 0.10
#: correlation that is reported as the cause of a wide interval
STRONG = 0.9
#: residual over robust spread beyond which a point is an outlier; finds outliers that mask each other
ROBUST_LIMIT = 6.0
#: deviation of a torque below which it is no outlier: drag torques of one screw do not repeat more closely
LEAST_OUTLIER = 0.03
#: leverage above which no other point checks a point
LEVERAGE_LIMIT = 0.9
SPLIT = "split into viscous and sliding torque"


def free_parameters(basis: TorqueBasis, values: Values, count: int) -> list[int]:
    """Numbers of the fitted parameters that change the torque to first order: all but a height of 0."""
    return [i for i in basis.fitted(count) if i != HEIGHT or values[i] > 0.0]


def condition(basis: TorqueBasis, values: Values, count: int) -> float:
    """Condition number of the derivatives with respect to relative changes; inf if a parameter has no effect."""
    J = basis.jacobian(values)[:, free_parameters(basis, values, count)]
    norm = np.linalg.norm(J, axis=0)
    return float(np.linalg.cond(J / norm)) if np.all(norm > 0.0) else math.inf


def _profile(basis: TorqueBasis, count: int, parameter: int, value: float) -> float:
    """Least sum of squared errors with one of the fitted parameters fixed, the others free and not negative."""
    names = tuple(name for name in basis.names[:count] if name != FITTED[parameter])
    held = tuple(value if i == parameter else other for i, other in enumerate(basis.held))
    rest = replace(basis, names=names, held=held)

    def cost(height: float) -> float:
        return float(np.sum(rest.errors(linear_fit(rest, height, len(names))) ** 2))

    if FITTED[HEIGHT] not in names:
        return cost(held[HEIGHT])
    heights = float(basis.film.min()) * np.r_[0.0, np.geomspace(0.03, 30.0, 50)]
    costs = [cost(height) for height in heights]
    i = int(np.argmin(costs))
    around = (heights[max(i - 1, 0)], heights[min(i + 1, len(heights) - 1)])
    refined = minimize_scalar(cost, bounds=around, method="bounded", options={"xatol": 1e-6 * heights[-1]})
    return float(min(costs[i], refined.fun))


def profile_limits(basis: TorqueBasis, count: int) -> dict[str, dict[str, float]]:
    """95 % limits of the fitted parameters by the profile of the sum of squared errors.

    Returns      parameter -> {"low", "high"} (SI): 0 if the data are compatible with 0, inf if they set no bound
    Validity     errors independent, normal, of equal relative size (as the weights say); other
                 than intervals of the linearised fit also valid at the bound 0 and for large changes of the height
    Source       Bates & Watts, Nonlinear Regression Analysis (1988), section 6.1: limits where the cost exceeds its
                 least value by s^2 F(1, n - p; 0.95)
    """
    freedom = len(basis) - count
    if freedom < 1:
        return {name: {"low": 0.0, "high": math.inf} for name in basis.names[:count]}
    values = fit_values(basis, count, "least_squares")
    least = float(np.sum(basis.errors(values) ** 2))
    # rounding errors are not a spread
    allowed = max(least, 1e-24 * len(basis)) * (1.0 + student_t.ppf(0.975, freedom) ** 2 / freedom)
    jacobian = basis.jacobian((1.0, 1.0, 0.0))[:, :2]
    sizes = (*(1.0 / np.abs(jacobian).mean(axis=0)), float(basis.film.min()))
    found = {}
    for i in basis.fitted(count):

        def excess(value: float, i: int = i) -> float:
            return _profile(basis, count, i, value) - allowed

        best, low, high = float(values[i]), 0.0, math.inf
        if best > 0.0 and excess(0.0) > 0.0:
            low = float(brentq(excess, 0.0, best, xtol=1e-9 * best)) if excess(best) < 0.0 else best
        step, start = 0.1 * max(best, 1e-3 * sizes[i]), best
        while step < 1e3 * max(best, sizes[i]):
            if excess(best + step) > 0.0:
                inside = excess(start) < 0.0
                high = (
                    float(brentq(excess, start, best + step, xtol=1e-9 * (best + step))) if inside else best
                )
                break
            start, step = best + step, 2.0 * step
        found[FITTED[i]] = {"low": low, "high": high}
    return found


@dataclass(frozen=True)
class PointDiagnostics:
    """Per point (n,), in units of its weighted relative error.

    deviation    model/measured - 1 without weight
    leverage     share of the point in its own fitted value, 0..1
    studentised  deleted studentised residual, NaN if not determined;  limit: its bound for one false alarm among 20
                 whole files of good points
    robust       error of the soft_l1 fit, over the robust spread of these errors
    detectable   how much too high a torque must be measured to become an outlier by its studentised residual, over the
                 good torque; inf where the fit follows the point, NaN if not determined
    """

    deviation: Array
    leverage: Array
    studentised: Array
    robust: Array
    limit: float
    detectable: Array

    @property
    def outliers(self) -> list[int]:
        """Numbers of the points that do not agree with the others."""
        # NaN is not an outlier: no other point checks it
        return [
            i
            for i in range(len(self.deviation))
            if abs(self.deviation[i]) > LEAST_OUTLIER
            and (abs(self.studentised[i]) > self.limit or abs(self.robust[i]) > ROBUST_LIMIT)
        ]

    @property
    def unchecked(self) -> list[int]:
        """Numbers of the points that no other point checks."""
        return [i for i in range(len(self.deviation)) if not self.leverage[i] <= LEVERAGE_LIMIT]


def point_diagnostics(basis: TorqueBasis, values: Values, count: int) -> PointDiagnostics:
    """Residuals of the points and which of them are outliers.

    Parameters   values : of the fit whose deviations are shown; the criteria use the least squares and the soft_l1 fit
    Source       Cook & Weisberg, Residuals and Influence in Regression (1982), section 2.2.1 (deleted studentised
                 residuals, Bonferroni bound); spread: 1.4826 times the median of |r| without the p smallest
    """
    n, freedom = len(basis), len(basis) - count
    squares = fit_values(basis, count, "least_squares")
    residual = basis.errors(squares)
    J = basis.jacobian(squares)[:, free_parameters(basis, squares, count)]
    leverage = np.sum(np.linalg.svd(J / np.linalg.norm(J, axis=0), full_matrices=False)[0] ** 2, axis=1)
    studentised, detectable, robust, limit = np.full(n, math.nan), np.full(n, math.nan), np.zeros(n), math.inf
    if freedom >= 2:
        own = 1.0 - leverage
        rest = float(residual @ residual) - residual**2 / np.maximum(own, 1e-12)
        rest = np.maximum(rest, 1e-24 * n)
        checked = own > 1e-6
        studentised[checked] = (residual * np.sqrt((freedom - 1) / (np.maximum(own, 1e-12) * rest)))[checked]
        limit = float(student_t.ppf(1.0 - 0.05 / (2 * n), freedom - 1))
        # the residual that reaches the limit with the scatter of the other points; residuals are model/measured - 1
        share = limit * np.sqrt(rest / ((freedom - 1) * np.maximum(own, 1e-12))) / basis.weights
        detectable = np.where(share < 1.0, share / np.maximum(1.0 - share, 1e-12), math.inf)
        soft_residual = basis.errors(fit_values(basis, count, "soft_l1"))
        # such a fit nearly passes through as many points as it has parameters: these are left out of the spread
        spread = 1.4826 * float(np.median(np.sort(np.abs(soft_residual))[count:]))
        robust = soft_residual / max(spread, 1e-9)
    return PointDiagnostics(
        basis.torque(values) / basis.measured - 1.0, leverage, studentised, robust, limit, detectable
    )


class Rival(NamedTuple):
    """Another model fitted to the same points: its name, basis, values, absolute deviations of left-out points (n,)."""

    name: str
    basis: TorqueBasis
    values: Values
    left_out: Array


def predicts_better(ours: Array, theirs: Array) -> bool:
    """Whether the first model predicts left-out points better.

    Parameters   absolute deviations of the points (n,)
    Returns      result of Wilcoxon's signed-rank test, one-sided, 2.5 %; never below 6 points. A test of means
                 would have no power as soon as both models miss one outlier
    """
    if np.all(ours == theirs):
        return False
    return bool(wilcoxon(ours, theirs, alternative="less").pvalue < 0.025)


def share_name(basis: TorqueBasis) -> str:
    """What sliding_share is called."""
    return "sliding share" if basis.names == FITTED else "share of ball on ball"


def sliding_share(basis: TorqueBasis, net: float) -> float:
    """Sliding part of the measured torque, mean over the points."""
    return float(net * np.mean(basis.sliding / basis.measured))


def not_identified(
    basis: TorqueBasis,
    values: Values,
    count: int,
    limits: Mapping[str, Mapping[str, float]],
    correlations: Mapping[str, float],
    left_out: Array,
    rivals: Sequence[Rival] = (),
) -> dict[str, str]:
    """Parameters that these points do not identify, with the reasons.

    Parameters   limits : see profile_limits;  correlations : "first, second" -> -1..1
                 left_out : deviations of the points from the fit to all others (n,);  rivals : other models
    Returns      parameter, or SPLIT -> reasons as one text; empty if all is identified
    Source       a parameter: half its interval is above PRECISION of its value, or another model predicts
                 left-out points as well with a value further off. The split: see SPLIT_WIDTH, limits and equal rivals
                 together. The limits are choices, not results.
    """
    reasons: dict[str, list[str]] = {}
    equal = [rival for rival in rivals if not predicts_better(left_out, rival.left_out)]
    for i in basis.fitted(count):
        name = FITTED[i]
        value, low, high = float(values[i]), limits[name]["low"], limits[name]["high"]
        found = []
        if not 0.5 * (high - low) <= PRECISION * value:
            found.append(
                f"95 % interval {_text(name, low)} to {_text(name, high)} around {_text(name, value)}"
            )
            for pair, correlation in correlations.items():
                if name in pair.split(", ") and abs(correlation) >= STRONG:
                    other = next(one for one in pair.split(", ") if one != name)
                    found.append(f"correlation {correlation:.2f} with {other}")
        for rival in equal:
            theirs = float(rival.values[i])
            if not abs(theirs - value) <= PRECISION * max(value, theirs):
                found.append(f"{_text(name, theirs)} in {_not_worse(rival, left_out)}")
        if found:
            reasons[name] = found
    net = FITTED[1]
    shares = [sliding_share(basis, limits[net][end]) for end in ("low", "high")]
    within = (max(shares[0], 0.0), min(shares[1], 1.0))
    all_shares = [*within, *(sliding_share(rival.basis, float(rival.values[1])) for rival in equal)]
    if not max(all_shares) - min(all_shares) <= SPLIT_WIDTH:
        found = [f"{share_name(basis)} of the torque {100.0 * within[0]:.0f} to {100.0 * within[1]:.0f} %"]
        for rival, share in zip(equal, all_shares[2:], strict=True):
            found.append(f"{100.0 * share:.0f} % in {_not_worse(rival, left_out)}")
        strongest = max(correlations.items(), key=lambda entry: abs(entry[1]), default=None)
        if strongest and abs(strongest[1]) >= STRONG:
            found.append(f"correlation {strongest[0]}: {strongest[1]:.2f}")
        reasons[SPLIT] = found
    return {name: "; ".join(found) for name, found in reasons.items()}


def _not_worse(rival: Rival, left_out: Array) -> str:
    theirs, ours = 100.0 * float(rival.left_out.mean()), 100.0 * float(left_out.mean())
    return f"the fit {rival.name}, not significantly worse at left-out points ({theirs:.1f} %, here {ours:.1f} %)"


def _text(name: str, value: float) -> str:
    if not math.isfinite(value):
        return "no bound"
    return f"{1e9 * value:.3g} nm" if name == "roughness_height" else f"{value:.3g}"
