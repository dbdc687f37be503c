"""Interval of a torque by the mechanistic law that follows from the constants known within bounds.

Every constant c of parameters.friction is taken as uniform between its ends, independent of the others, and
moved to both ends alone. With the parabola g_c through ln(T_c/T) at low end, value and high end, T the torque,

    m = ln T + sum_c mean(g_c),   s^2 = sum_c variance(g_c),   interval exp(m -+ 1.2816 s)

holds about 80 % of the torques: mean and variance of a sum of independent quantities, taken as normal; that a constant
changes the effect of another is neglected. Of 600 points of a Latin hypercube of constants and oil it holds 75 to 82 %
(GD4008-3 with VG 100, 303 K: 1 kN at 100 and 2500 r/min, 6 kN at 2500 r/min).

Measured torques of a screw condition the constants, the same way for one and for many: with the standardised
constants x ~ N(0, 1), their effects d at a measured point, e = ln(measured/computed) - sum mean(g_c) there and the
deviation s_e of a torque from the law,

    mean(x) = D (D^T D + s_e^2)^-1 e,   covariance(x) = 1 - D (D^T D + s_e^2)^-1 D^T,   columns d of D,

and the interval elsewhere has these, with the mean error of a point left out of the fit as the scatter of a normal
quantity; of one torque that of the packaged fit. So a calibration takes up what constants do as far as it sees it.

A stated standard error of a torque is one of measuring, independent of the others: s_e is not below it. A tolerance, or
minimum and maximum, of a sheet is one error that all points share. It is taken as what is known of the torque there
after all, whatever the constants say: ln T normal, 80 % of it between the ends. So e is taken at the middle of the ends
in ln T, and with G = D (D^T D + s_e^2)^-1 and half their width t over 1.2816 at the points, G t t^T G^T is added to the
covariance; that of a preload acts by the torques of the law at its ends. The interval then holds the tolerance.
Of 99 sheets of random screws (tolerance 5 to 50 %, oil 5 K off) it holds 81 % of the torques at the point, 79 and 82 %
at other speeds and preloads, 79 and 81 % in another oil; 100 % at the point if truths are uniform over the tolerance.
In another oil of the same screw, the constants that are of the oil count as before any fit.

A preload that is nominal (preload_basis) is a name: the true force is preload_force times it, one more unknown, uniform
in its logarithm (parameters.friction.PRELOAD_FORCE). It counts where nothing is measured, and together with the
constants where the drag torque of the screw file conditions both (friction.drag_torque); the preloads of measured
torques are forces. Of 200 random screws with a drag torque of +-25 % the interval holds 83 % of the torques at other
speeds and temperatures, most in another oil, and 80 % of the true preloads.

A constant that the screw file states counts as known. The supply of the oil counts by the length of its inlet, from 3
half-widths to flooded, uniform in 1/length. The temperature of the oil counts with the tolerance of the screw file, its
viscosity with that of an ISO grade, +-10 % (ISO 3448), where the file names the grade: as the temperature at which the
oil of the file has it. Both are off by as much at the measured torques. Not in the interval: the solver's error, seals.

Source: conditioning of a normal distribution: Rasmussen & Williams, Gaussian Processes (2006), A.2
"""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..numerics import Array
from ..parameters.file import Parameters
from ..parameters.friction import BOUNDED, PRELOAD_FORCE, ball_ball_coefficient
from ..parameters.identity import parameters_hash
from ..parameters.mineral_oil import GRADE_TOLERANCE
from ..parameters.units import COLDEST, HOTTEST
from ..physics.lubricant import eta0
from .film_shear import nut_forces
from .mechanistic import ContactValues, Nut, law_constants, loaded_nuts, powers_of_nuts, torque_line
from .sets import DRAG_TORQUE, PRELOAD, SUPPLY, FrictionSet, load_friction_sets, of_other_oil

#: standard deviations of a normal quantity to the ends of the interval that holds 80 % of it
DEVIATIONS = 1.2816
#: standard deviation of a normal quantity over its mean absolute value
SCATTER_DEVIATION = math.sqrt(0.5 * math.pi)
#: a relative error that counts beside those of torques, for three may agree by chance. 100 to 1200 sets of 3, 5 and 11
#: torques with 3 % noise: 0 gives limits that hold 79 % of the truths where two numbers are fitted to three
KNOWN_ERROR = 0.02
#: names of what a fit contributes: its coefficient, the error of a point left out
FITTED_COEFFICIENT, LEFT_OUT = "net_sliding_coefficient", "leave_one_out"
#: the oil: its temperature, its viscosity over that of its grade
OIL_TEMPERATURE, OIL_VISCOSITY = "oil_temperature", "oil_viscosity"
#: what a drag torque in the oil of its test says nothing of: the limits of shear are taken as those of mineral oils
STATE_OF_OIL = (OIL_TEMPERATURE, OIL_VISCOSITY)
#: what belongs to the oil: a fit with another one says nothing of it
CONSTANTS_OF_OIL = ("eyring_stress", "limiting_shear_coefficient", *STATE_OF_OIL)
#: what makes them known
OF_OIL = {
    OIL_TEMPERATURE: "a known oil temperature (temperature_tolerance)",
    OIL_VISCOSITY: "the viscosity of the oil in place of its grade",
}
#: constants that act through the level of the torque, which a measured one fixes
BY_ONE_TORQUE = (FITTED_COEFFICIENT, "boundary_friction", "limiting_shear_coefficient", PRELOAD)
#: speed, temperature, contacts, as powers_of_nuts takes them
At = tuple[Any, Any, ContactValues]
#: nuts of each point, by the true force over the preload
Points = Callable[[float], list[list[Nut]]]
#: what the ends of an interval are, without and with a fit to the screw; the same of a nominal preload
MEANING = (
    "about 80 %, from bounded constants",
    "about 80 %, from measured torques and bounded constants",
    "about 80 %, from bounded constants and from what a nominal preload is, a force of "
    f"{PRELOAD_FORCE.low:g} to {PRELOAD_FORCE.high:g} times it (preload_basis)",
    "about 80 %, from the drag torque of the screw file and bounded constants",
)


class OperatingPoint(NamedTuple):
    """Point of a torque, as NutMap.evaluate takes it.

    Attributes
    ----------
    preload : float
        Preload, as preload_basis of the screw file says [N].
    speed : float
        Speed of the screw [rad/s], > 0.
    temperature : float
        Oil temperature [K].
    axial_load : float
        Axial load [N].
    """

    preload: float
    speed: float
    temperature: float
    axial_load: float = 0.0

    def forces(self, parameters: Parameters, factor: float = 1.0) -> Sequence[float]:
        """Forces of both nuts [N] where the true force is this factor times the preload."""
        return nut_forces(parameters, factor * self.preload, self.axial_load)


class Effects(NamedTuple):
    """Torque [N.m] of the law with what its constants do to it, by constant; each (points, ...)."""

    torque: Array
    ends: dict[str, tuple[Array, Array]]  # torques with one alone at its low and high end
    mean: dict[str, Array]  # of ln(torque)
    deviation: dict[str, Array]  # standard deviation of ln(torque), negative: falls with the constant


class Learned(NamedTuple):
    """Standardised constants (c,), covariance (c, c), scatter of ln(torque): what measured torques say, or nothing."""

    mean: Array
    covariance: Array
    scatter: float


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
        shares = ", ".join(
            f"{name} {100.0 * fraction:.0f} %" for name, fraction in list(self.shares.items())[:2]
        )
        what = meaning(LEFT_OUT in self.shares, PRELOAD in self.shares)
        return f"{what}: {shares}{self.advice and '; narrower by '}{self.advice}"

    @property
    def advice(self) -> str:
        """What removes the largest part of the variance, with that part; "" without an interval."""
        parts: Counter[str] = Counter()
        fitted = LEFT_OUT in self.shares
        for name, fraction in self.shares.items():
            remedy = f"{'raceway_rq and ball_rq' if name == 'roughness_height' else name} in the screw file"
            if fitted and name in (LEFT_OUT, FITTED_COEFFICIENT, PRELOAD):
                remedy = "torques measured around this point (calibrate MEASUREMENTS.csv)"
            elif not fitted and name in BY_ONE_TORQUE:
                remedy = "one measured torque (calibrate --torque-nm)"
                remedy = (
                    f"drag_torque_Nm in the screw file, or {remedy}" if PRELOAD in self.shares else remedy
                )
            remedy = OF_OIL.get(name, remedy)
            parts[remedy] += fraction  # type: ignore[assignment]
        return "".join(f"{remedy}, {100.0 * part:.0f} %" for remedy, part in parts.most_common(1))


def meaning(fitted: bool, nominal: bool) -> str:
    """What the ends of an interval are; nominal: PRELOAD is one of the unknown."""
    return MEANING[fitted + 2 * nominal]


def unknown_constants(parameters: Parameters) -> tuple[str, ...]:
    """Names of the bounded constants that the screw file does not state; kappa does not count where it states k.

    PRELOAD is among them where the preload is nominal.
    """
    friction = parameters.friction
    known = (friction.model_fields_set - {"roughness_height"}) | parameters.lubricant.model_fields_set
    spaced = parameters.screw.spacer_balls
    implied = {
        # stated, or the composite of both surfaces
        "roughness_height": friction.roughness_height is not None,
        "ball_thrust": spaced or friction.net_sliding_coefficient is not None,
    }
    known |= {name for name, follows in implied.items() if follows}
    names = tuple(name for name in BOUNDED if name not in known)
    return (*names, PRELOAD) if parameters.screw.preload_basis == "nominal" else names


def of_force(parameters: Parameters, friction_set: FrictionSet) -> Parameters:
    """The screw for a preload that a torque measures: it is a force, unless the set has the drag torque of both."""
    if friction_set.nominal:
        return parameters
    screw = parameters.screw.model_copy(update={"preload_basis": "force"})
    return parameters.model_copy(update={"screw": screw})


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


def learned_of(
    friction_set: FrictionSet, parameters: Parameters, fitted: bool, names: Sequence[str]
) -> Learned:
    """What the measurements of a set say of these constants, nothing if it is not fitted to this screw."""
    mean, covariance, scatter = np.zeros(len(names)), np.eye(len(names)), 0.0
    if fitted:
        result = friction_set.learned
        known = list(result["mean"])
        of_oil = set(STATE_OF_OIL if friction_set.loss == DRAG_TORQUE else CONSTANTS_OF_OIL)
        other = of_oil if of_other_oil(friction_set, parameters) else set()
        of = [i for i, name in enumerate(names) if name in known and name not in other]
        place = [known.index(names[i]) for i in of]
        mean[of] = np.array(list(result["mean"].values()))[place]
        rows = np.reshape(list(result["covariance"].values()), (len(known), -1))
        covariance[np.ix_(of, of)] = rows[np.ix_(place, place)]
        errors = friction_set.errors
        if "leave_one_out_mean" not in errors:
            errors = load_friction_sets()[friction_set.law].errors
        scatter = SCATTER_DEVIATION * errors["leave_one_out_mean"]
    return Learned(mean, covariance, scatter)


def is_fitted(friction_set: FrictionSet, parameters: Parameters) -> bool:
    """Whether the numbers are fitted to measurements of this screw, in any oil, with these constants of the law."""
    theirs, ours = dict(friction_set.learned.get("constants", {})), _constants(parameters)
    if other := of_other_oil(friction_set, parameters):
        theirs.pop("eyring_stress", None)
        ours.pop("eyring_stress", None)
    return theirs == ours and (other or friction_set.parameters_hash == parameters_hash(parameters))


def _constants(parameters: Parameters) -> dict[str, float]:
    """law_constants as they are written."""
    return {name: float(f"{x:.6g}") for name, x in law_constants(parameters).items() if x is not None}


def learned(
    parameters: Parameters,
    points: Sequence[OperatingPoint],
    errors: Array,
    weights: Array,
    contacts: ContactValues,
    friction_set: FrictionSet,
    own: Array | float = 0.0,
    tolerances: Sequence[Array] = (),
) -> dict[str, dict[str, Any]]:
    """Entry `learned` of a friction set: mean of the standardised constants and rows of their covariance, by constant.

    errors : ln(measured/computed) with the set;  weights : over which the error of a torque is larger
    own : stated standard errors of ln(torque), independent
    tolerances : of each error that all points share, low and high end of ln(torque) there, (2, n)
    """
    names = counted_constants(parameters, friction_set, True)
    result = [effects_at(parameters, point, contacts, friction_set, names) for point in points]
    names = list(result[0].mean)
    D = np.array([[float(each.deviation[name][0]) for name in names] for each in result]).T
    shifts = [0.5 * (low + high) for low, high in tolerances]
    shared = np.array([0.5 * (high - low) / DEVIATIONS for low, high in tolerances]).reshape(-1, errors.size)
    e = errors + sum(shifts) - [sum(float(part[0]) for part in each.mean.values()) for each in result]
    noise = (np.sum((weights * errors) ** 2) + KNOWN_ERROR**2) / errors.size / weights**2
    noise = np.maximum(noise, np.square(own))
    gain = np.linalg.solve(D.T @ D + np.diag(noise), D.T).T
    rows = np.eye(len(names)) - gain @ D.T + (gain @ shared.T) @ (gain @ shared.T).T
    return {
        "constants": _constants(parameters),
        "mean": {name: float(f"{x:.6g}") for name, x in zip(names, gain @ e, strict=True)},
        "covariance": {name: [float(f"{x:.6g}") for x in row] for name, row in zip(names, rows, strict=True)},
    }


def implied_thrust(coefficient: float, parameters: Parameters) -> float:
    """kappa of a coefficient k = 2 mu_b Lambda kappa."""
    return coefficient / ball_ball_coefficient(parameters.friction, 1.0)


def torque_interval(
    parameters: Parameters, point: OperatingPoint, contacts: ContactValues, friction_set: FrictionSet
) -> TorqueInterval:
    """Torque of all nuts at an operating point, with its interval.

    Parameters
    ----------
    parameters : Parameters
        Screw and oil.
    point : OperatingPoint
        Preload, speed, temperature and axial load.
    contacts : ContactValues
        Contacts of the balls.
    friction_set : FrictionSet
        Fitted number of the law, and the force of a nominal preload.

    Returns
    -------
    TorqueInterval
        Torque and its interval [N.m], with the effect of each constant.

    Raises
    ------
    ArithmeticError
        Equilibrium of a ball not found.

    Notes
    -----
    The coefficient of the friction set is that of the constants in the parameters. It varies with them unless it was
    fitted to this screw or the screw file states it. The force of a nominal preload counts without a fit and with the
    drag torque of the screw file; the preloads of measured torques are forces.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> from ballscrew_tehl.atlas.ball_contacts import BallContacts
    >>> from ballscrew_tehl.friction.sets import default_friction_set
    >>> screw = load_screw("example_25x10.toml")
    >>> point = OperatingPoint(preload=800.0, speed=104.7, temperature=313.15)
    >>> interval = torque_interval(screw, point, BallContacts(screw), default_friction_set(screw))
    >>> interval.low < interval.torque < interval.high
    True
    """
    if not any(force > 0.0 for force in point.forces(parameters)):
        return TorqueInterval(0.0, 0.0, 0.0, {}, {})
    fitted = is_fitted(friction_set, parameters)
    unknown = counted_constants(parameters, friction_set, fitted)
    effects = effects_at(parameters, point, contacts, friction_set, unknown)
    torque = float(effects.torque[0])
    ends = {name: (float(low[0]), float(high[0])) for name, (low, high) in effects.ends.items()}
    known = learned_of(friction_set, parameters, fitted, list(ends))
    low, high = (torque * float(end[0]) for end in _ends(effects, known))
    # both are the one number of the law
    names = {"ball_thrust": FITTED_COEFFICIENT}
    deviations = np.array([float(part[0]) for part in effects.deviation.values()])
    parts = np.maximum(deviations * (known.covariance @ deviations), 0.0)
    variances = {names.get(name, name): float(part) for name, part in zip(ends, parts, strict=True)}
    variances |= {LEFT_OUT: known.scatter**2} if known.scatter else {}
    whole = sum(variances.values()) or 1.0
    ordered = sorted(variances, key=variances.__getitem__, reverse=True)
    return TorqueInterval(torque, low, high, ends, {name: variances[name] / whole for name in ordered})


def torque_and_ends(
    parameters: Parameters,
    preloads: Array,
    contacts: ContactValues,
    speeds: Array,
    temperatures: Array,
    friction_set: FrictionSet,
    axial_load: float = 0.0,
    on_the_way: Callable[[], None] = lambda: None,
) -> tuple[Array, Array, Array]:
    """Torque [N.m] and the ends of its interval over it (p, s, t), at preloads [N], speeds [rad/s] > 0 and
    temperatures [K].

    All points side by side: a point by itself, as torque_interval, takes 50 times as long. on_the_way: called often.
    """

    def points(factor: float) -> list[list[Nut]]:
        forces = (nut_forces(parameters, factor * float(preload), axial_load) for preload in preloads)
        return [loaded_nuts(parameters, both) for both in forces]

    fitted = is_fitted(friction_set, parameters)
    names = counted_constants(parameters, friction_set, fitted)
    at = speeds[:, None], temperatures, contacts
    effects = _effects(parameters, points, at, friction_set, names, on_the_way)
    return effects.torque, *_ends(effects, learned_of(friction_set, parameters, fitted, list(effects.mean)))


def counted_constants(parameters: Parameters, friction_set: FrictionSet, fitted: bool) -> list[str]:
    """Constants that count; in a fit to measured forces not PRELOAD, but the coefficient that the screw file states."""
    names = list(unknown_constants(parameters))
    if fitted and not (PRELOAD in names and friction_set.loss == DRAG_TORQUE):
        names = [name for name in names if name != PRELOAD]
        names += ["ball_thrust"] * ("ball_thrust" not in names)
    return names + [SUPPLY] * (friction_set.supply_length is not None and SUPPLY not in names)


def effects_at(
    parameters: Parameters,
    point: OperatingPoint,
    contacts: ContactValues,
    friction_set: FrictionSet,
    names: Sequence[str],
) -> Effects:
    """Effects of these constants at one point, (1,) each."""

    def points(factor: float) -> list[list[Nut]]:
        return [loaded_nuts(parameters, point.forces(parameters, factor))]

    return _effects(parameters, points, (point.speed, point.temperature, contacts), friction_set, names)


def _effects(
    parameters: Parameters, points: Points, at: At, friction_set: FrictionSet, names: Sequence[str],
    on_the_way: Callable[[], None] = lambda: None,
) -> Effects:  # fmt: skip
    """Of the nuts of each point."""
    friction, coefficient = parameters.friction, friction_set.net_sliding_coefficient
    names, nominal = [name for name in names if name != PRELOAD], PRELOAD in names
    values = [{}, *({name: end} for name in names for end in (BOUNDED[name].low, BOUNDED[name].high))]
    variants = [with_constants(parameters, value) for value in values]
    kappa, ratio = implied_thrust(coefficient, parameters), friction_set.apparent_viscosity_ratio
    coefficients = [coefficient] * len(variants)
    if "ball_thrust" in names or friction.net_sliding_coefficient is None:
        coefficients = [
            ball_ball_coefficient(changed.friction, value.get("ball_thrust", kappa))
            for changed, value in zip(variants, values, strict=True)
        ]
    nuts = points(friction_set.preload_factor)
    lines = _lines(variants, nuts, at, ratio, on_the_way)
    lines += _oil_lines(parameters, nuts, at, ratio, lines[0][0].shape, on_the_way)
    for factor in (PRELOAD_FORCE.low, PRELOAD_FORCE.high) if nominal else ():
        lines += _lines([parameters], points(factor), at, ratio, on_the_way)
    coefficients += [coefficient] * (len(lines) - len(coefficients))
    middle, *of_ends = (
        remainder + k * slope for (remainder, slope), k in zip(lines, coefficients, strict=True)
    )
    names += [*oil_shifts(parameters, at[1]), *[PRELOAD] * nominal]
    ends = dict(zip(names, zip(of_ends[::2], of_ends[1::2], strict=True), strict=True))
    own = {"ball_thrust": kappa, SUPPLY: friction.supply_length, PRELOAD: friction_set.preload_factor}
    result = Effects(middle, ends, {}, {})
    for name, (low, high) in ends.items():
        known = PRELOAD_FORCE if name == PRELOAD else BOUNDED.get(name)
        place = known.place(own.get(name, known.value)) if known else 0.5
        mean, variance = uniform_moments(np.log(low / middle), np.log(high / middle), place)
        result.mean[name], result.deviation[name] = mean, np.copysign(np.sqrt(variance), high - low)
    return result


def _lines(
    variants: Sequence[Parameters], points: Sequence[Sequence[Nut]], at: At, ratio: float,
    on_the_way: Callable[[], None],
) -> list[tuple[Array, Array]]:  # fmt: skip
    """torque_line of variants with other constants, each (points, ...)."""
    nuts, result = [nut for point in points for nut in point], []
    for powers in powers_of_nuts(variants, nuts, *at, on_the_way):
        of_nuts = iter(powers)
        lines = [torque_line([(nut.times, next(of_nuts)) for nut in point], ratio) for point in points]
        remainder, slope = map(np.array, zip(*lines, strict=True))
        result.append((remainder, slope))
    return result


def _oil_lines(
    parameters: Parameters, points: Sequence[Sequence[Nut]], at: At, ratio: float, shape: tuple[int, ...],
    on_the_way: Callable[[], None],
) -> list[tuple[Array, Array]]:  # fmt: skip
    """torque_line at the oil_shifts of a temperature, each of this shape (points, ...)."""
    speed, temperature, contacts = at
    shifted = [np.atleast_1d(one) for pair in oil_shifts(parameters, temperature).values() for one in pair]
    if not shifted:
        return []
    # in order: a ball begins from its motion at the temperature before
    warm, place = np.unique(np.concatenate(shifted), return_inverse=True)
    ((remainder, slope),) = _lines([parameters], points, (speed, warm, contacts), ratio, on_the_way)
    parts = (np.broadcast_to(part, remainder.shape)[..., place] for part in (remainder, slope))
    of_each = (np.split(part, len(shifted), axis=-1) for part in parts)
    return [(one.reshape(shape), other.reshape(shape)) for one, other in zip(*of_each, strict=True)]


def _ends(effects: Effects, known: Learned) -> tuple[Array, Array]:
    """Ends over the torque; constants at one end of their interval move the middle."""
    deviations = np.reshape(list(effects.deviation.values()), (-1, *effects.torque.shape))
    middle = sum(effects.mean.values(), 0.0) + np.tensordot(known.mean, deviations, 1)
    variance = np.sum(deviations * np.tensordot(known.covariance, deviations, 1), axis=0) + known.scatter**2
    return ends_of(middle, variance)


def ends_of(mean: Any, variance: Any) -> tuple[Array, Array]:
    """Ends over a value whose ln is off by a normal quantity; the value itself is between them."""
    wide = DEVIATIONS * np.sqrt(np.maximum(variance, 0.0))
    return np.minimum(np.exp(mean - wide), 1.0), np.maximum(np.exp(mean + wide), 1.0)


def uniform_moments(low: Any, high: Any, place: float) -> tuple[Any, Any]:
    """Mean and variance over 0 <= x <= 1 of the parabola that is low at 0, 0 at `place`, high at 1.

    Without a place inside it is the straight line from low to high.
    """
    slope = high - low
    bend = (low + slope * place) / (place * (1.0 - place)) if 0.0 < place < 1.0 else 0.0
    # low + slope x - bend x (1 - x)
    return low + 0.5 * slope - bend / 6.0, slope**2 / 12.0 + bend**2 / 180.0
