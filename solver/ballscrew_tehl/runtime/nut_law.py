"""Laws of the double nut, written once for floats and arrays.

Every function takes its operations as `ops`: FLOATS or ARRAYS. Two friction laws differ in the torques
of a nut only: film_shear, the law of the fitted sets, and mechanistic, the power balance of rolling loss, shear and
ball-on-ball friction. Both may rise towards breakaway at standstill (coulomb_rise).

Assumptions: below the force axis the power laws of Hertz continue from its end, below the speed axis the standstill
law does (evaluate.py). Torques of the double nut are sums over both nuts, films the least, the others the
largest value.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .bspline import Axis
from .constants import (
    BREAKAWAY_EXPONENT_MAX,
    DRAG_SHARPNESS,
    FILM_SPEED_EXPONENT,
    FREE_PUSH,
    FREE_SHARPNESS,
    LAMBDA_RATIO_MAX,
    LEAST_HALF,
    LEAST_RISE,
    REST,
    SMOOTH,
    SPEED_EXPONENT_MAX,
)
from .packed import TORQUE_CURVES, TORQUE_SURFACES, FrictionParameters, Law

#: slope of coulomb_rise at the node over its rise, at least
LEAST_FALL = (1.0 + 2.0 * REST) / (1.0 + REST) * LEAST_HALF / (1.0 + LEAST_HALF)


class Ops(NamedTuple):
    """Operations on one kind of number; + - * / ** and < are those of Python."""

    exp: Callable[[Any], Any]
    least: Callable[[Any, Any], Any]
    most: Callable[[Any, Any], Any]
    where: Callable[[Any, Any, Any], Any]
    place: Callable[[Axis, Any], tuple[Any, Any]]  # cell of a value on an axis, and position in it


FLOATS = Ops(math.exp, min, max, lambda condition, yes, no: yes if condition else no, Axis.place)
ARRAYS = Ops(np.exp, np.minimum, np.maximum, np.where, Axis.place_array)
Numbers = Sequence[Any] | NDArray[Any]  # one number or array per column


class DoubleNutState(NamedTuple):
    """Operating point of the double nut; floats or arrays.

    Attributes
    ----------
    viscous_torque, hysteresis_torque, sliding_torque : float or array
        Magnitudes >= 0 [N.m]; viscous of the mechanistic law: rolling loss of the films.
    film_thickness_min, film_thickness_central_screw, film_thickness_central_nut : float or array
        Least film of all contacts, least central film of each raceway [m].
    film_temperature_rise : float or array
        Mean over a contact, highest of all [K].
    contact_pressure_max, ball_load_max : float or array
        Of the most heavily loaded ball [Pa], [N].
    lambda_ratio : float or array
        Least film over roughness height [1], at most LAMBDA_RATIO_MAX.
    relieved_viscous_torque, relieved_coulomb_torque : float or array
        Part of the nut with the lower force [N.m], a half if both have the same.
    in_range : bool or array
        Whether no input lies beyond the map.
    clamped : tuple of str
        Names of the inputs beyond the map, at any point.
    seal_torque : float
        Constant drag of the seals [N.m], not a part of the balls.
    preload_actual : float or array
        True preload at the temperature difference of screw and nut [N], >= 0.
    """

    viscous_torque: Any
    hysteresis_torque: Any
    sliding_torque: Any
    film_thickness_min: Any
    film_thickness_central_screw: Any
    film_thickness_central_nut: Any
    film_temperature_rise: Any
    contact_pressure_max: Any
    ball_load_max: Any
    lambda_ratio: Any
    relieved_viscous_torque: Any
    relieved_coulomb_torque: Any
    in_range: Any
    clamped: tuple[str, ...]
    seal_torque: Any = 0.0
    preload_actual: Any = 0.0

    @property
    def coulomb_torque(self) -> Any:
        """Hysteresis, sliding and seals [N.m]: what does not vanish with the speed."""
        return self.hysteresis_torque + self.sliding_torque + self.seal_torque

    @property
    def friction_torque(self) -> Any:
        """Sum of the three parts and of the seals [N.m]."""
        return self.viscous_torque + self.hysteresis_torque + self.sliding_torque + self.seal_torque


class NutTorques(NamedTuple):
    """Torques of one nut [N.m], and what the shear of oversize balls between two sets of flanks follows from."""

    viscous: Any
    hysteresis: Any
    sliding: Any
    shear: Any = 0.0  # of balls held by four flanks alike
    free: Any = 1.0  # [1] that of balls on two flanks over it; 1: no oversize balls
    turn: Any = 1.0  # [1] the same of the speed at which neighbours slide on each other
    push: Any = 0.0  # friction on balls that slide on this set, at coefficient 1 and the rolling speed
    on_balls: Any = 0.0  # friction of balls on each other, part of sliding
    drag: Any = 0.0  # of the oil between balls, if their contacts transmit it
    limit: Any = 0.0  # what they transmit at most


def nut_torques(
    law: str,
    surfaces: Numbers,
    slopes: Numbers | None,
    curves: Numbers,
    drag: Any,
    f: Any,
    s: Any,
    friction: FrictionParameters,
    ops: Ops,
) -> NutTorques:
    """Torques of one nut from logarithms, columns packed.SURFACES and FORCE_CURVES, at least those of torque.

    Of the mechanistic law the viscous part is the rolling loss, to which double_nut adds the drag of the oil between
    balls, the sliding part the shear of the raceway contacts and the friction of balls on each other; its surfaces hold
    the asperities, so that the roughness height has no effect.
    slopes: of the surfaces over ln speed, None: s is 1; drag: logarithm of the surface `drag`; f, s: force and speed
    over the low ends of their axes, up to 1.
    """
    exp, third, viscous = ops.exp, f ** (1.0 / 3.0), 0.0
    hysteresis, sliding, free, turn, boundary, gaps, limit = curves[:TORQUE_CURVES]
    for raceway in (0, 1):
        part, exponent = exp(surfaces[raceway]), None if slopes is None else slopes[raceway]
        if law == Law.THREE_PARAMETER:
            x = (friction.roughness_height / exp(surfaces[2 + raceway])) ** 2
            fraction = 1.0 / (1.0 + x)
            part = part * fraction
            if slopes is not None:
                exponent = exponent + 2.0 * x * fraction * slopes[2 + raceway]
        viscous = viscous + (part if slopes is None else part * _slow_share(exponent, s, ops))
    viscous = friction.apparent_viscosity_ratio * viscous * third * third
    hysteresis = exp(hysteresis) * f * third
    if law == Law.THREE_PARAMETER:
        sliding = friction.net_sliding_coefficient * exp(sliding) * f
        if slopes is not None:
            sliding = sliding * coulomb_rise(s, 1.0, 0.0, friction.breakaway_factor, ops)
        return NutTorques(viscous, hysteresis, sliding)
    factor, rise = exp(surfaces[3]), 1.0
    shear, push = f * exp(surfaces[2]), f * exp(sliding)
    if slopes is not None:
        rise = coulomb_rise(s, factor, slopes[3], friction.breakaway_factor, ops)
        shear = shear * shear_rise(s, boundary - surfaces[2], slopes[2], friction.breakaway_factor, ops)
    on_balls = friction.net_sliding_coefficient * push * factor
    # a factor below 1 is of oversize balls that turn slower
    sliding, slower = shear + on_balls * rise, ops.least(factor, 1.0)
    of_oil = slower * slower * s * exp(drag + gaps), slower * f * exp(limit)
    oversize = exp(free), exp(turn), push * rise, on_balls * rise
    return NutTorques(viscous, hysteresis, sliding, shear, *oversize, *of_oil)


def smooth_lesser(one: Any, other: Any, sharpness: float, ops: Ops) -> Any:
    """Lesser of two numbers >= 0, (one^-n + other^-n)^(-1/n)."""
    # of the smaller over the larger, so that no power overflows
    low, high = ops.least(one, other), ops.most(one, other)
    return low * (1.0 + (low / ops.most(high, SMOOTH)) ** sharpness) ** (-1.0 / sharpness)


def neighbour_drags(relieved: NutTorques, loaded: NutTorques, turn: Any, ops: Ops) -> tuple[Any, Any]:
    """Torques [N.m] of the oil between balls of both nuts, at most what the contacts transmit.

    An oversize ball is driven by the contacts of both sets of flanks together; each takes its share of the limit. turn:
    speed at which neighbours slide, over that of balls held by four flanks alike.
    """
    drag, limit = turn * turn * (relieved.drag + loaded.drag), turn * (relieved.limit + loaded.limit)
    both = smooth_lesser(drag, limit, DRAG_SHARPNESS, ops)
    each, fraction = [], relieved.limit / ops.most(relieved.limit + loaded.limit, SMOOTH)
    for nut, part in ((relieved, fraction), (loaded, 1.0 - fraction)):
        alone = smooth_lesser(nut.drag, nut.limit, DRAG_SHARPNESS, ops)
        each.append(ops.where(loaded.free < 1.0, both * part, alone))
    return each[0], each[1]


def freed(relieved: NutTorques, loaded: NutTorques, ops: Ops) -> tuple[Any, Any]:
    """Sliding torque [N.m] by which oversize balls lose less than two sets of flanks alone, <= 0, and their turn [1].

    Held by all four flanks, a ball costs the shear of both sets; where the relieved set cannot hold it, it rolls on the
    loaded diagonal and slides on the other: the motion that costs less. The turn is the speed at which neighbours slide
    over that of balls held by four flanks alike. Without such balls 0 and 1. Against the equilibrium of 800 points of
    four screws: HELD in constants.py.
    """
    held = relieved.shear + loaded.shear
    free = loaded.free * loaded.shear + FREE_PUSH * relieved.push
    both = smooth_lesser(held, free, FREE_SHARPNESS, ops)
    rolls = (both / ops.most(free, SMOOTH)) ** FREE_SHARPNESS
    turn = 1.0 - ops.where(loaded.free < 1.0, rolls, 0.0) * (1.0 - loaded.turn)
    less = both - held - (1.0 - turn) * (relieved.on_balls + loaded.on_balls)
    return ops.where(loaded.free < 1.0, less, 0.0), turn


def _slow_share(slope: Any, s: Any, ops: Ops) -> Any:
    """Torque below the slowest node over that there, odd, monotone; slope: exponent of speed, s: speed over it."""
    c = 0.5 * (ops.least(ops.most(slope, 0.0), SPEED_EXPONENT_MAX) - 1.0)
    return s * (1.0 - c + c * s * s)


def coulomb_rise(s: Any, factor: Any, slope: Any, breakaway: Any, ops: Ops) -> Any:
    """Coulomb part below the slowest node over that there: even in speed, rises monotonically to standstill.

    1 at s = 1, with the slope of the factor, from LEAST_HALF to BREAKAWAY_EXPONENT_MAX times the rise, downwards;
    breakaway/factor at standstill: asperities take over slowly. s: speed over that of the node, at most 1; factor,
    slope: Coulomb part at the node over that in a full film, >= 1, and of its logarithm over ln speed; breakaway: the
    factor at standstill, at or below that of the node nothing rises.
    """
    rise = ops.most(ops.most(breakaway, 1.0) / factor - 1.0, 0.0)
    q = ops.least(ops.most(0.0 - slope / ops.most(rise, LEAST_RISE), 0.0), BREAKAWAY_EXPONENT_MAX)
    # speed, with slope 0 at rest; half: where half of the rise is left
    t = (1.0 + REST) * s * s / (s + REST)
    half = ops.most(q / ((1.0 + 2.0 * REST) / (1.0 + REST) - q), LEAST_HALF)
    return 1.0 + rise * (1.0 - (1.0 + half) * t / (t + half))


def shear_rise(s: Any, boundary: Any, slope: Any, breakaway: Any, ops: Ops) -> Any:
    """Shear torque below the slowest node over that there: to that of asperities at standstill, with the slope at 1.

    boundary: logarithm of the shear torque on asperities alone over that at the node; slope: of the logarithm over ln
    speed, where oil falls off with speed before asperities take over it dips. Breakaway up to 1: no rise.
    """
    most = ops.where(breakaway > 1.0, ops.exp(ops.most(boundary, 0.0)), 1.0)
    falls = ops.most(slope + LEAST_FALL * (most - 1.0), 0.0)
    dip = 1.0 - 0.5 * falls * s * s * (1.0 - s * s)
    return dip * coulomb_rise(s, 1.0, slope, most, ops)


def nut_extremes(surfaces: Numbers, curves: Numbers, f: Any, s: Any, ops: Ops) -> tuple[Any, ...]:
    """Least film, central films [m], temperature rise [K], pressure [Pa] and ball load [N] of one nut."""
    least_screw, least_nut, film_screw, film_nut, rise_screw, rise_nut = surfaces[TORQUE_SURFACES:]
    pressure, load = curves[TORQUE_CURVES:]
    exp, least = ops.exp, ops.least
    third = f ** (1.0 / 3.0)
    slow = s**FILM_SPEED_EXPONENT
    return (
        # a spline through nearly equal films may cross another
        slow * exp(least(least(least_screw, least_nut), least(film_screw, film_nut))),
        slow * exp(film_screw),
        slow * exp(film_nut),
        s * third * exp(ops.most(rise_screw, rise_nut)),
        third * exp(pressure),
        f * exp(load),
    )


def double_nut(
    first: tuple[NutTorques, Numbers],
    second: tuple[NutTorques, Numbers],
    roughness: Any,
    in_range: Any,
    clamped: tuple[str, ...],
    ops: Ops,
) -> DoubleNutState:
    """State from nut_torques and nut_extremes of the relieved and the loaded nut: torques added, extremes over both."""
    (relieved, extremes), (loaded, other_extremes) = first, second
    viscous, hysteresis, sliding = (a + b for a, b in zip(relieved[:3], loaded[:3], strict=True))
    film, screw, nut = (ops.least(a, b) for a, b in zip(extremes[:3], other_extremes[:3], strict=True))
    rise, pressure, load = (ops.most(a, b) for a, b in zip(extremes[3:], other_extremes[3:], strict=True))
    less, turn = freed(relieved, loaded, ops)
    drags = neighbour_drags(relieved, loaded, turn, ops)
    # share of the relieved set of flanks: that of the shear of balls held by all four, a convention
    fraction = relieved.shear / ops.most(relieved.shear + loaded.shear, SMOOTH)
    lambda_ratio = ops.least(film / ops.most(roughness, SMOOTH), LAMBDA_RATIO_MAX)
    relieved_coulomb = relieved.hysteresis + relieved.sliding + less * fraction
    return DoubleNutState(
        viscous + drags[0] + drags[1], hysteresis, sliding + less, film, screw, nut, rise, pressure, load, lambda_ratio,
        relieved.viscous + drags[0], relieved_coulomb, in_range, clamped,
    )  # fmt: skip
