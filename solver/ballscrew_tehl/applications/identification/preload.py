"""Preload behind the friction that a log gives, by the law of a map, and what is separated from it.

The friction torque at the screw is the mean of both directions at one speed: gravity and tilt fall out. One preload is
fitted to all speeds, each weighted by its standard error and a shape error SHAPE of the law. Its interval contains that
of the known parts (known_parts); the test of the shape has their levels and exponents of speed as unknowns.
"""

import math
from typing import NamedTuple

import numpy as np
import scipy

from ballscrew_tehl.friction.interval import of_force
from ballscrew_tehl.friction.sets import FrictionSet
from ballscrew_tehl.numerics import Array
from ballscrew_tehl.parameters.file import Parameters
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import Law

from .directions import LIMIT, Bidirectional
from .dynamics import Identified
from .known_parts import KnownParts

#: relative error of the law's shape over speed that is allowed for;  fewest speeds within a map;  share of a torque
#: that it has to have left without known parts;  relative distance of a preload from the ends of a map
SHAPE, MIN_SPEEDS, LEFT, INSIDE = 0.01, 3, 0.05, 1e-3
#: part of the error of the known parts that moves two logs, the first that leaves a torque of the nut in both
MOVED = (1.0, 0.5, 0.25, 0.125)
#: weighted rise of ln(torque) over ln(preload) below which a log says nothing of the preload
BLIND = 1e-3
#: friction by the law over speed > 0 [SI of the axis], known parts included: speed, value, low, high, label
LawCurve = tuple[Array, Array, Array, Array, str]


class ScrewMap(NamedTuple):
    """Map of a screw with its friction set."""

    parameters: Parameters
    nut_map: NutMap
    friction_set: FrictionSet
    difference: float = 0.0  # temperature of the screw minus that of the nut [K]
    axial_load: float = 0.0  # weight of the table along an inclined axis [N]

    def torque(self, preload: float, speed: Array | float, temperature: float) -> Array:
        """[N.m], preload: with screw and nut at one temperature."""
        of_nut = {"axial_load": self.axial_load, "temperature_difference": self.difference}
        state = self.nut_map.evaluate(preload, speed, temperature, **of_nut)
        return np.asarray(state.friction_torque)

    @property
    def preloads(self) -> tuple[float, float]:
        """Lowest and highest [N]."""
        axes = self.nut_map.header["axes"]
        return float(axes["preload"][0]), min(float(axes[name][1]) for name in ("force", "preload"))

    def holds(self, preload: float) -> bool:
        """Whether a preload is inside, not at an end where a fit stops."""
        low, high = self.preloads
        return low * (1.0 + INSIDE) < preload < high * (1.0 - INSIDE)


class FoundPreload(NamedTuple):
    """Preload behind a friction, with its interval, and how the law fits over speed.

    Attributes
    ----------
    preload_n : float
        Preload [N].
    preload_low_n, preload_high_n : float
        Interval [N].
    preload_interval : str
        What the interval means.
    preload_log_low_n, preload_log_high_n : float
        95 % interval by the log alone [N].
    shape_deviation, shape_exponent_difference : float
        ln(torque/law): root mean square, and slope over ln(speed).
    shape_fits : bool
        Whether the deviation is within the errors.
    """

    preload_n: float
    preload_low_n: float
    preload_high_n: float
    preload_interval: str
    preload_log_low_n: float
    preload_log_high_n: float
    shape_deviation: float
    shape_exponent_difference: float
    shape_fits: bool


class Change(NamedTuple):
    """Preload of the log before, that of this one over it with a 95 % interval: both logs, the law's interval."""

    preload_before_n: float
    preload_ratio: float
    preload_ratio_low: float
    preload_ratio_high: float


class Apart(NamedTuple):
    """Torque that does not depend on the preload [N.m] and factor on the law, with 95 % limits."""

    without_nut_nm: float
    without_nut_low_nm: float
    without_nut_high_nm: float
    law_factor: float
    law_factor_low: float
    law_factor_high: float


def screw_friction(identified: Identified, lead: float | None) -> Bidirectional:
    """Mean of both directions at their common speeds, at the screw; lead [m/rad]: needed of a linear axis."""
    both = identified.both
    if not identified.rotary and lead is None:
        raise ValueError("--lead-mm or --screw (missing); needed for the torque of a linear axis")
    if not len(both.speed):
        raise ValueError("no common speed of both directions; allowed: a log with the same speeds both ways")
    return both if identified.rotary else both.at_screw(abs(lead or 1.0))


def without(
    friction: Bidirectional, known: Array | float, other: Bidirectional | None = None
) -> Bidirectional:
    """Friction at the screw less known torques [N.m] and that of a log without the nut."""
    torque, error = friction.mean - known, friction.error
    if other is not None:
        if friction.speed.min() > other.speed.max() or friction.speed.max() < other.speed.min():
            spans = f"{other.span}; allowed: those of the log, {friction.span}"
            raise ValueError(f"speeds of the log without the nut = {spans}")
        torque = torque - np.interp(friction.speed, other.speed, other.mean)
        error = np.hypot(error, np.interp(friction.speed, other.speed, other.error))
    mean, whole = float(np.mean(torque)), float(np.mean(friction.mean))
    if not mean > LEFT * whole:
        raise ValueError(
            f"friction of the axis = {whole:.4g} N.m, without the known parts {mean:.4g} N.m; allowed: known parts "
            "smaller than the whole: check tables of the axis in the screw file, --guide-force-n, --seal-torque-nm, "
            "--without-nut, torque constant or gain"
        )
    return friction._replace(mean=torque, error=error).where(torque > 0.0)


def _inside(friction: Bidirectional, law: ScrewMap) -> Bidirectional:
    """The speeds within the map."""
    low, high = law.nut_map.header["axes"]["speed"][:2]
    keep = (friction.speed >= low) & (friction.speed <= high)
    if not keep.sum() >= MIN_SPEEDS:
        allowed = f"{MIN_SPEEDS} in {low / RPM:.4g} to {high / RPM:.4g} r/min: check --ratio and --lead-mm"
        inside = f"{int(keep.sum())} of {len(keep)}, {friction.span}"
        raise ValueError(f"speeds of the log within the map = {inside}; allowed: at least {allowed}")
    return friction.where(keep)


def _weight(friction: Bidirectional) -> Array:
    """Of ln(torque) in a fit."""
    return np.asarray(1.0 / np.hypot(friction.error / friction.mean, SHAPE))


def typical_speed(friction: Bidirectional, law: ScrewMap) -> float:
    """Mean of ln(speed) within the map, weighted as the fit [rad/s]."""
    friction = _inside(friction, law)
    return float(np.exp(np.average(np.log(friction.speed), weights=_weight(friction) ** 2)))


def _fitted(friction: Bidirectional, law: ScrewMap, temperature: float, factor: float = 1.0) -> float:
    """Preload at which the law, times a factor, is nearest to the friction; at an end of the map if beyond."""
    weight = _weight(friction)

    def misfit(log_preload: float) -> float:
        model = factor * law.torque(math.exp(log_preload), friction.speed, temperature)
        return float(np.sum((weight * np.log(friction.mean / model)) ** 2))

    bounds = np.log(law.preloads)
    return math.exp(scipy.optimize.minimize_scalar(misfit, bounds=bounds, options={"xatol": 1e-7}).x)


def _moved(friction: Bidirectional, law: ScrewMap, temperature: float, preload: float, other: Array) -> float:
    """Preload over the found one where the known parts have this torque more than was subtracted; 0: below the map."""
    weight, now = _weight(friction), law.torque(preload, friction.speed, temperature)

    def misfit(log_preload: float) -> float:
        model = law.torque(math.exp(log_preload), friction.speed, temperature)
        return float(np.sum((weight * (model - now + other) / now) ** 2))

    bounds = np.log(law.preloads)
    end = math.exp(scipy.optimize.minimize_scalar(misfit, bounds=bounds, options={"xatol": 1e-6}).x)
    return 0.0 if end < law.preloads[0] * (1.0 + INSIDE) else end / preload


def _shares(friction: Bidirectional, known: KnownParts, high: bool) -> Array:
    """Of each part in the error of all that moves the fitted preload most, towards their high or low ends."""
    return known.at(friction.speed).shares(high, _weight(friction) ** 2 / friction.mean)


def _excess(friction: Bidirectional, known: KnownParts | None, residual: Array, rise: Array) -> float:
    """Mean square of the residual over its errors that neither preload nor errors of the known parts explain."""
    weight, columns = _weight(friction), np.empty((len(residual), 0))
    if known is not None:
        columns = known.shape_columns(friction.mean)
    count = columns.shape[1]
    a = np.block([[rise[:, None], columns], [np.zeros((count, 1)), np.eye(count)]])
    a[: len(residual)] *= weight[:, None]
    b = np.r_[residual * weight, np.zeros(count)]
    left = b - a @ np.linalg.lstsq(a, b, rcond=None)[0]
    return float(left @ left) / max(len(residual) - 1, 1)


class PreloadedLog(NamedTuple):
    """Friction of the nut, the preload behind it, oil temperature [K], what was subtracted."""

    friction: Bidirectional
    result: FoundPreload
    temperature: float
    known: KnownParts | None = None


def found_preload(
    friction: Bidirectional, law: ScrewMap, temperature: float, known: KnownParts | None = None
) -> FoundPreload:
    """Preload at which the law of a map gives the friction of the nut alone.

    Parameters
    ----------
    friction : Bidirectional
        Mean friction torque of both directions over speed, with errors.
    law : Law
        Map of the screw with its friction set.
    temperature : float
        Temperature of the oil [K].
    known : KnownParts, optional
        What was subtracted, whose errors count.

    Returns
    -------
    FoundPreload
        Preload [N] with its interval.

    Raises
    ------
    ValueError
        Speeds, temperature or torque outside the map.
    ArithmeticError
        As preload_interval.

    Examples
    --------
    >>> from ballscrew_tehl import load_map, load_screw
    >>> from ballscrew_tehl.friction.sets import default_friction_set
    >>> screw, speed = load_screw("gd4008_vg100.toml"), np.linspace(20.0, 200.0, 5)
    >>> law = ScrewMap(screw, load_map(parameters=screw), default_friction_set(screw))
    >>> torque = law.torque(2000.0, speed, 303.15)
    >>> result = found_preload(Bidirectional(speed, torque, 0.0 * torque, 0.01 * torque), law, 303.15)
    >>> f"{result.preload_n:.0f} N"
    '2000 N'
    """
    from ..preload import preload_interval

    coldest, hottest = law.nut_map.header["axes"]["temperature"][:2]
    if not coldest <= temperature <= hottest:
        raise ValueError(
            f"temperature = {temperature - CELSIUS:.4g} C; allowed by the map: {coldest - CELSIUS:.4g} to "
            f"{hottest - CELSIUS:.4g} C: check the unit, or ballscrew map build with other --temperature-c"
        )
    friction = _inside(friction, law)
    preload = _fitted(friction, law, temperature)
    if not law.holds(preload):
        lowest, highest = law.preloads
        least, most = (np.mean(law.torque(end, friction.speed, temperature)) for end in (lowest, highest))
        raise ValueError(
            f"torque of the nut = {np.mean(friction.mean):.4g} N.m in the mean; allowed: {least:.4g} to {most:.4g} "
            f"N.m (preload {lowest:g} to {highest:g} N): check torque constant or gain, known parts, --ratio, lead"
        )
    weight, steps = _weight(friction), (0.0, 1e-3, -1e-3)
    now, above, below = (law.torque(preload * (1.0 + step), friction.speed, temperature) for step in steps)
    residual, rise = np.log(friction.mean / now), np.log(above / below) / (2.0 * steps[1])
    if not float(np.sum((rise * weight) ** 2)) > BLIND**2:
        raise ValueError(
            f"preload = {preload:.4g} N; the torque does not depend on it at the axial load {law.axial_load:.4g} N of "
            "the weight, which frees a nut; allowed: a smaller moved mass or inclination in [axis]"
        )
    known = known and known.at(friction.speed)
    excess = _excess(friction, known, residual, rise)
    of_log = math.sqrt(max(excess, 1.0) / float(np.sum((rise * weight) ** 2))) * LIMIT
    bounds, meaning = (preload, preload), "95 %, of the log alone: this friction set has no interval"
    if law.nut_map.law == Law.MECHANISTIC:
        point = preload, typical_speed(friction, law), temperature
        torque = float(law.torque(*point))
        ends = preload_interval(
            law.parameters, law.nut_map, law.friction_set, torque, *point, law.difference, law.axial_load
        )
        bounds = ends.low, ends.high
        meaning = f"law {ends.meaning}; 95 % of the log added in quadrature"
        if ends.at_edge:
            meaning += f"; the {' and '.join(ends.at_edge)} end is that of the map"
    parts = [1.0, 1.0]
    if known is not None and known.parts:
        meaning += "; 80 % of the known parts as well"
        parts = [
            _moved(friction, law, temperature, preload, _shares(friction, known, high) @ known.to_end(high))
            for high in (True, False)
        ]
        meaning += ", which leave nothing to the nut at their high end" * (parts[0] == 0.0)
    low, high = (
        math.hypot(math.log(end / preload), of_log, math.log(part) if part > 0.0 else math.inf)
        for end, part in zip(bounds, parts, strict=True)
    )
    slope = float(np.polyfit(np.log(friction.speed), residual, 1)[0])
    return FoundPreload(
        preload, preload * math.exp(-low), preload * math.exp(high), meaning,
        preload * math.exp(-of_log), preload * math.exp(of_log),
        float(np.sqrt(np.mean(residual**2))), slope, excess <= 2.0,
    )  # fmt: skip


def change_of_preload(now: PreloadedLog, before: PreloadedLog, law: ScrewMap) -> Change:
    """The law's level is common to both: it moves the ratio only as far as the law is no power of the preload. The
    exponent of that power may be wrong as far as it is from 1 (torque in proportion to the preload, as in ISO 3408).
    Errors of the known parts are common, too, and move both logs the same way.
    """
    from ballscrew_tehl.nut_map.interval import map_interval

    logs = now, before
    ratio = now.result.preload_n / before.result.preload_n
    own = math.hypot(*(math.log(log.result.preload_log_high_n / log.result.preload_n) for log in logs))
    moved = [0.0]
    if law.nut_map.law == Law.MECHANISTIC:
        friction, result, temperature, _ = now
        point = result.preload_n, typical_speed(friction, law), temperature, law.axial_load
        of_law = of_force(law.parameters, law.friction_set), law.nut_map.header["axes"], law.friction_set
        for factor in map_interval(*of_law, *point).relative:
            ends = [_fitted(_inside(part, law), law, kelvin, factor) for part, _, kelvin, _ in logs]
            if all(map(law.holds, ends)):
                moved.append(math.log(ends[0] / ends[1] / ratio))
    low, high = law.nut_map.header["axes"]["speed"][:2]
    speed = now.friction.speed[(now.friction.speed >= low) & (now.friction.speed <= high)]
    torques = [float(np.mean(law.torque(log.result.preload_n, speed, now.temperature))) for log in logs]
    of_exponent = abs(math.log(ratio) - math.log(torques[0] / torques[1]))
    wide = math.hypot(own, max(map(abs, moved)), _moved_ratio(now, before, law)) + of_exponent
    return Change(before.result.preload_n, ratio, ratio * math.exp(-wide), ratio * math.exp(wide))


def _moved_ratio(now: PreloadedLog, before: PreloadedLog, law: ScrewMap) -> float:
    """Change of ln(ratio of the preloads) by one error of the known parts in both logs."""
    if now.known is None or before.known is None:
        return 0.0
    moved = [0.0]
    for high in (True, False) if now.known.parts else ():
        shares = _shares(_inside(now.friction, law), now.known, high)
        for part in MOVED:
            ends = []
            for log, known in ((now, now.known), (before, before.known)):
                friction = _inside(log.friction, law)
                other = part * shares @ known.at(friction.speed).to_end(high)
                ends.append(_moved(friction, law, log.temperature, log.result.preload_n, other))
            if min(ends) > 0.0:
                moved.append(math.log(ends[0] / ends[1]) / part)
                break
    return max(map(abs, moved))


def separated_parts(logs: list[tuple[Bidirectional, float, float]], law: ScrewMap) -> Apart:
    """Least squares of other + factor * law over logs at known preloads [N] and temperatures [K]."""
    logs = [(_inside(friction, law), preload, kelvin) for friction, preload, kelvin in logs]
    parts = [friction for friction, _, _ in logs]
    model = np.concatenate([law.torque(preload, part.speed, kelvin) for part, preload, kelvin in logs])
    torque, error = (np.concatenate([getattr(part, name) for part in parts]) for name in ("mean", "error"))
    weight = 1.0 / np.hypot(error, SHAPE * torque)
    inverse = np.linalg.pinv(np.column_stack([weight, model * weight]))
    best = inverse @ (torque * weight)
    residual = (best[0] + best[1] * model - torque) * weight
    spread = max(float(residual @ residual) / max(len(residual) - 2, 1), 1.0)
    variance = spread * np.sum(inverse**2, axis=1)
    of_log = np.repeat(np.arange(len(parts)), [len(part.mean) for part in parts])
    for number, part in enumerate(parts):
        # errors of the speeds of one log may all have one sign
        common = float(np.mean(part.error / part.mean)) * torque * weight * (of_log == number)
        variance += (inverse @ common) ** 2
    half = LIMIT * np.sqrt(variance)
    if not half[0] <= float(np.mean(torque)):
        raise ValueError(
            f"part without the nut = {best[0]:.3g} +- {half[0]:.2g} N.m; allowed: logs at less similar preloads"
        )
    return Apart(*np.column_stack([best, best - half, best + half]).ravel().tolist())
