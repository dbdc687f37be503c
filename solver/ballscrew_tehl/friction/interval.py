"""Interval of a torque by the mechanistic law that follows from the constants known within bounds.

Every constant c of parameters.friction_constants is taken as uniform between its ends, independent of the others, and
moved to both ends alone. With the parabola g_c through ln(T_c/T) at low end, value and high end, T the torque,

    m = ln T + sum_c mean(g_c),   s^2 = sum_c variance(g_c),   interval exp(m -+ 1.2816 s)

holds about 80 % of the torques: mean and variance of a sum of independent quantities, taken as normal; that a constant
changes the effect of another is neglected. Of 600 points of a Latin hypercube of constants and oil it holds 75 to 82 %
(GD4008-3 with VG 100, 303 K: 1 kN at 100 and 2500 r/min, 6 kN at 2500 r/min).

Zero fitted: kappa of the ball-ball part is one of the constants. Fitted: the coefficient k has the 95 % interval of its
fit, mu_b, Lambda and kappa do not count as far as they enter through k, and the mean error of a point left out of the
fit counts as the scatter of a normal quantity. Calibrated on one torque: with every constant moved, the coefficient is
fitted again to the torque at that point; the scatter is that of the packaged fit. Fitted to three and more torques: the
supply length has the 95 % limits of the fit, with the coefficient fitted again at both.

A constant that the screw file states counts as known. The supply of the oil counts by the length of its inlet, from 3
half-widths to flooded, uniform in 1/length. The temperature of the oil counts with the tolerance of the screw file, its
viscosity with that of an ISO grade, +-10 % (ISO 3448), where the file names the grade: as the temperature at which the
oil of the file has it. Both are off by as much at the one torque of a calibration. Not in the interval: the solver's
error, seals; and what a fit at other constants would take up of their effect: a fitted interval is rather too wide.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..parameters.file import PACKAGED_VG100, Parameters, load_screw
from ..parameters.friction_constants import BOUNDED
from ..parameters.identity import parameters_hash
from ..parameters.screw import ball_ball_coefficient
from ..parameters.units import COLDEST, HOTTEST
from ..physics.ball_law import Array
from ..physics.lubricant import eta0
from .mechanistic import ContactValues, Nut, law_constants, loaded_nuts, powers_of_nuts, torque_line
from .sets import CALIBRATED_AT, SUPPLY, FrictionSet, load_friction_sets

#: standard deviations of a normal quantity to the ends of the interval that holds 80 % of it
DEVIATIONS = 1.2816
#: standard deviations between the 95 % limits of a fit; of a normal quantity, over its mean absolute value
FIT_DEVIATIONS, SCATTER_DEVIATION = 2.0 * 1.96, math.sqrt(0.5 * math.pi)
#: names of what a fit contributes: its coefficient, the error of a point left out
FITTED_COEFFICIENT, LEFT_OUT = "net_sliding_coefficient", "leave_one_out"
#: the oil: its temperature, its viscosity over that of its grade, and how far that may be off
OIL_TEMPERATURE, OIL_VISCOSITY, GRADE_TOLERANCE = "oil_temperature", "oil_viscosity", 0.1
#: what makes them known
OF_OIL = {
    OIL_TEMPERATURE: "a known oil temperature (temperature_tolerance)",
    OIL_VISCOSITY: "the viscosity of the oil in place of its grade",
}
#: constants that act through the level of the torque, which a measured one fixes
BY_ONE_TORQUE = (FITTED_COEFFICIENT, "boundary_friction", "limiting_shear_coefficient")
#: speed, temperature, contacts, as powers_of_nuts takes them
At = tuple[Any, Any, ContactValues]
#: what the ends of an interval are
MEANING = "about 80 %, from bounded constants"


class Fit(NamedTuple):
    """95 % limits of the coefficient fitted to a screw, both itself if to one torque; mean error of points left out."""

    low: float
    high: float
    left_out: float


class TorqueInterval(NamedTuple):
    """Torque with its interval [N.m]."""

    torque: float
    low: float
    high: float
    ends: Mapping[
        str, tuple[float, float]
    ]  # by constant, torques with this one alone at its low and high end
    shares: Mapping[
        str, float
    ]  # of the variance of ln(torque), largest first; ball_thrust: FITTED_COEFFICIENT

    @property
    def relative(self) -> tuple[float, float]:
        """Ends over the torque."""
        return self.low / self.torque, self.high / self.torque

    @property
    def meaning(self) -> str:
        """What it is, with the two constants that contribute most, and what narrows it most."""
        shares = ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in list(self.shares.items())[:2])
        return f"{MEANING}: {shares}{self.advice and '; narrower by '}{self.advice}"

    @property
    def advice(self) -> str:
        """What removes the largest part of the variance, with that part; "" without an interval."""
        parts: Counter[str] = Counter()
        fitted = LEFT_OUT in self.shares
        for name, share in self.shares.items():
            remedy = f"{'raceway_rq and ball_rq' if name == 'roughness_height' else name} in the screw file"
            if fitted and name in (LEFT_OUT, FITTED_COEFFICIENT):
                remedy = "torques measured around this point (calibrate MEASUREMENTS.csv)"
            elif not fitted and name in BY_ONE_TORQUE:
                remedy = "one measured torque (calibrate --torque-nm)"
            remedy = OF_OIL.get(name, remedy)
            parts[remedy] += share  # type: ignore[assignment]
        return "".join(f"{remedy}, {100.0 * part:.0f} %" for remedy, part in parts.most_common(1))


def unknown_constants(parameters: Parameters) -> tuple[str, ...]:
    """Names of the bounded constants that the screw file does not state; kappa does not count where it states k."""
    friction = parameters.friction
    known = (friction.model_fields_set - {"roughness_height"}) | parameters.lubricant.model_fields_set
    implied = {
        # stated, or the composite of both surfaces
        "roughness_height": friction.roughness_height is not None,
        "ball_thrust": friction.net_sliding_coefficient is not None,
    }
    known |= {name for name, follows in implied.items() if follows}
    return tuple(name for name in BOUNDED if name not in known)


def oil_shifts(parameters: Parameters, temperature: Any) -> dict[str, list[Any]]:
    """Temperatures [K] of the oil at both ends of what is not known of it, lower value first."""
    oil, shifts = parameters.lubricant, {}
    if tolerance := oil.temperature_tolerance:
        shifts[OIL_TEMPERATURE] = [-tolerance, tolerance]
    if oil.iso_vg is not None:
        thinning = 0.5 * np.log(eta0(oil, temperature - 1.0) / eta0(oil, temperature + 1.0))  # per kelvin
        shifts[OIL_VISCOSITY] = [-math.log1p(side * GRADE_TOLERANCE) / thinning for side in (-1.0, 1.0)]
    return {name: [np.clip(temperature + k, COLDEST, HOTTEST) for k in pair] for name, pair in shifts.items()}


def with_constants(parameters: Parameters, values: Mapping[str, float]) -> Parameters:
    """Parameters with other values of bounded constants, within their intervals: not checked again."""
    tables: dict[str, dict[str, float]] = {"lubricant": {}, "friction": {}}
    for name, value in values.items():
        tables["lubricant" if name == "eyring_stress" else "friction"][name] = value
    changes = {name: getattr(parameters, name).model_copy(update=table) for name, table in tables.items()}
    return parameters.model_copy(update=changes)


def fit_of(friction_set: FrictionSet, parameters: Parameters) -> Fit | None:
    """Fit of the coefficient to measurements of this screw with this oil and these constants; None: there is none."""
    if friction_set.parameters_hash != parameters_hash(parameters):
        return None
    packaged = load_friction_sets()[friction_set.law]
    value, left_out = friction_set.net_sliding_coefficient, friction_set.errors.get("leave_one_out_mean", 0.0)
    if friction_set.calibrated_at:
        return Fit(value, value, packaged.errors["leave_one_out_mean"])
    ours = packaged.net_sliding_coefficient == value
    if ours and law_constants(parameters) != law_constants(load_screw(PACKAGED_VG100)):
        return None
    limits, half = friction_set.limits.get(FITTED_COEFFICIENT), friction_set.intervals.get(FITTED_COEFFICIENT)
    if refitted := friction_set.refitted:
        # at a known supply length, which counts by itself
        limits, half = None, refitted["half_width"]
    if limits is not None and math.isfinite(limits["high"]):
        return Fit(limits["low"], limits["high"], left_out)
    return None if half is None else Fit(max(value - half, 0.0), value + half, left_out)


def implied_thrust(coefficient: float, parameters: Parameters) -> float:
    """kappa of a coefficient k = 2 mu_b Lambda kappa."""
    return coefficient / ball_ball_coefficient(parameters.friction, 1.0)


def torque_interval(
    parameters: Parameters,
    forces: Sequence[float],
    contacts: ContactValues,
    speed: float,
    temperature: float,
    friction_set: FrictionSet,
) -> TorqueInterval:
    """Torque of all nuts under their forces [N] with its interval, at a speed [rad/s] > 0 and an oil temperature [K].

    The coefficient k of the friction set is that of the constants in the parameters. It varies with them unless it was
    fitted to this screw or the screw file states it.
    """
    nuts = loaded_nuts(parameters, forces)
    if not nuts:
        return TorqueInterval(0.0, 0.0, 0.0, {}, {})
    middle, of_ends, moments = _effects(parameters, [nuts], (speed, temperature, contacts), friction_set)
    torque = float(middle[0])
    ends = {name: (float(low[0]), float(high[0])) for name, (low, high) in of_ends.items()}
    low, high = (torque * float(end[0]) for end in _ends(moments))
    # both are the one number of the law: the bounds of ball_thrust are those of the coefficient without a fit
    names = {"ball_thrust": FITTED_COEFFICIENT}
    variances = {names.get(name, name): float(np.ravel(part)[0]) for name, (_, part) in moments.items()}
    whole = sum(variances.values()) or 1.0
    ordered = sorted(variances, key=variances.__getitem__, reverse=True)
    return TorqueInterval(torque, low, high, ends, {name: variances[name] / whole for name in ordered})


def interval_ends(
    parameters: Parameters,
    preloads: Array,
    contacts: ContactValues,
    speeds: Array,
    temperatures: Array,
    friction_set: FrictionSet,
) -> tuple[Array, Array]:
    """Ends of the interval over the torque (p, s, t) at preloads [N], speeds [rad/s] > 0 and temperatures [K].

    Without axial load. All points side by side: a point by itself, as torque_interval, takes 50 times as long.
    """
    points = [loaded_nuts(parameters, [float(force)] * 2) for force in preloads]
    return _ends(_effects(parameters, points, (speeds[:, None], temperatures, contacts), friction_set)[2])


def _effects(
    parameters: Parameters, points: Sequence[Sequence[Nut]], at: At, friction_set: FrictionSet
) -> tuple[Array, dict[str, tuple[Array, Array]], dict[str, tuple[Any, Any]]]:
    """Torque; by constant: torques at its ends; mean and variance of ln(torque); (points, ...), of the nuts of each."""
    fit, coefficient = fit_of(friction_set, parameters), friction_set.net_sliding_coefficient
    names = [name for name in unknown_constants(parameters) if fit is None or name != "ball_thrust"]
    bounds = {name: (BOUNDED[name].low, BOUNDED[name].high) for name in names}
    refitted = friction_set.refitted if fit is not None else {}
    if refitted and (SUPPLY in names or friction_set.supply_length is not None):
        bounds[SUPPLY] = friction_set.limits[SUPPLY]["low"], friction_set.limits[SUPPLY]["high"]
    names = list(bounds)
    values = [{}, *({name: end} for name, pair in bounds.items() for end in pair)]
    variants = [with_constants(parameters, value) for value in values]
    kappa, ratio = implied_thrust(coefficient, parameters), friction_set.apparent_viscosity_ratio
    coefficients = [coefficient] * len(variants)
    if fit is not None and friction_set.calibrated_at:
        # the torque at the point of the calibration is that of the first variant
        preload, speed, temperature = (friction_set.calibrated_at[name] for name in CALIBRATED_AT)
        point = loaded_nuts(parameters, [preload] * 2)
        there = _lines(variants, [point], (speed, temperature, at[2]), ratio)
        there += _oil_lines(parameters, [point], (speed, temperature, at[2]), ratio, there[0][0].shape)
        torque = there[0][0] + coefficient * there[0][1]
        coefficients = [max(float((torque - rest)[0] / slope[0]), 0.0) for rest, slope in there]
    elif fit is None and parameters.friction.net_sliding_coefficient is None:
        coefficients = [
            ball_ball_coefficient(changed.friction, value.get("ball_thrust", kappa))
            for changed, value in zip(variants, values, strict=True)
        ]
    if refitted and SUPPLY in names:
        first = 1 + 2 * names.index(SUPPLY)
        coefficients[first : first + 2] = refitted["low"], refitted["high"]
    lines = _lines(variants, points, at, ratio)
    lines += _oil_lines(parameters, points, at, ratio, lines[0][0].shape)
    coefficients += [coefficient] * (len(lines) - len(coefficients))
    names += oil_shifts(parameters, at[1])
    middle, *of_ends = (rest + k * slope for (rest, slope), k in zip(lines, coefficients, strict=True))
    ends = dict(zip(names, zip(of_ends[::2], of_ends[1::2], strict=True), strict=True))
    moments: dict[str, tuple[Any, Any]] = {}
    for name, (low, high) in ends.items():
        known = BOUNDED.get(name)
        place = known.place(kappa if name == "ball_thrust" else known.value) if known else 0.5
        moments[name] = uniform_moments(np.log(low / middle), np.log(high / middle), place)
    if refitted and SUPPLY in ends:
        moments[SUPPLY] = 0.0, (np.log(ends[SUPPLY][1] / ends[SUPPLY][0]) / FIT_DEVIATIONS) ** 2
    if fit is not None:
        rest, slope = lines[0]
        low, high = ends[FITTED_COEFFICIENT] = rest + fit.low * slope, rest + fit.high * slope
        moments[FITTED_COEFFICIENT] = 0.0, (np.log(high / low) / FIT_DEVIATIONS) ** 2
        moments[LEFT_OUT] = 0.0, (SCATTER_DEVIATION * fit.left_out) ** 2
    return middle, ends, moments


def _lines(
    variants: Sequence[Parameters], points: Sequence[Sequence[Nut]], at: At, ratio: float
) -> list[tuple[Array, Array]]:
    """torque_line of variants with other constants, each (points, ...)."""
    nuts, result = [nut for point in points for nut in point], []
    for powers in powers_of_nuts(variants, nuts, *at):
        of_nuts = iter(powers)
        lines = [torque_line([(nut.times, next(of_nuts)) for nut in point], ratio) for point in points]
        rest, slope = map(np.array, zip(*lines, strict=True))
        result.append((rest, slope))
    return result


def _oil_lines(
    parameters: Parameters, points: Sequence[Sequence[Nut]], at: At, ratio: float, shape: tuple[int, ...]
) -> list[tuple[Array, Array]]:
    """torque_line at the oil_shifts of a temperature, each of this shape (points, ...)."""
    speed, temperature, contacts = at
    shifted = [np.atleast_1d(one) for pair in oil_shifts(parameters, temperature).values() for one in pair]
    if not shifted:
        return []
    # in order: a ball begins from its motion at the temperature before
    warm, place = np.unique(np.concatenate(shifted), return_inverse=True)
    ((rest, slope),) = _lines([parameters], points, (speed, warm, contacts), ratio)
    parts = (np.broadcast_to(part, rest.shape)[..., place] for part in (rest, slope))
    of_each = (np.split(part, len(shifted), axis=-1) for part in parts)
    return [(one.reshape(shape), other.reshape(shape)) for one, other in zip(*of_each, strict=True)]


def _ends(moments: Mapping[str, tuple[Any, Any]]) -> tuple[Any, Any]:
    """Ends over the torque; constants at one end of their interval move the middle."""
    middle = sum(mean for mean, _ in moments.values())
    wide = DEVIATIONS * np.sqrt(sum(part for _, part in moments.values()))
    return np.minimum(np.exp(middle - wide), 1.0), np.maximum(np.exp(middle + wide), 1.0)


def uniform_moments(low: Any, high: Any, place: float) -> tuple[Any, Any]:
    """Mean and variance over 0 <= x <= 1 of the parabola that is low at 0, 0 at `place`, high at 1.

    Without a place inside it is the straight line from low to high.
    """
    slope = high - low
    bend = (low + slope * place) / (place * (1.0 - place)) if 0.0 < place < 1.0 else 0.0
    # low + slope x - bend x (1 - x)
    return low + 0.5 * slope - bend / 6.0, slope**2 / 12.0 + bend**2 / 180.0
