"""Laws of the double nut, written once for floats, arrays and numbers with a derivative (dual.py).

Every function takes its operations as `ops`: FLOATS, ARRAYS or dual.DUALS. Look-ups and clamps are those of evaluate.py
and preload.py, which call it.

Two friction laws share all but the torques of a nut (NUT_TORQUES): film_shear, the law of the fitted sets, and
mechanistic, the power balance of rolling loss, shear and ball-on-ball friction. Both may rise towards breakaway at
standstill (coulomb_rise).

Assumptions: below the force axis the power laws of Hertz continue from its end, below the speed axis the standstill
law does (evaluate.py). Torques of the double nut are sums over both nuts, films the least, the others the
largest value.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ballscrew_tehl.runtime.constants import (
    BREAKAWAY_EXPONENT_MAX,
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
from ballscrew_tehl.runtime.packed import (
    FILM_SHEAR,
    MECHANISTIC,
    TORQUE_CURVES,
    TORQUE_SURFACES,
    FrictionParameters,
)


@dataclass(frozen=True, slots=True)
class Ops:
    """Operations on one kind of number; + - * / ** and < are those of Python."""

    exp: Callable[[Any], Any]
    least: Callable[[Any, Any], Any]
    most: Callable[[Any, Any], Any]
    where: Callable[[Any, Any, Any], Any]


FLOATS = Ops(math.exp, min, max, lambda condition, yes, no: yes if condition else no)
ARRAYS = Ops(np.exp, np.minimum, np.maximum, np.where)


Numbers = Sequence[Any] | NDArray[Any]  # one number, array or Dual per column


class DoubleNutState(NamedTuple):
    """Operating point of the double nut; torques are magnitudes >= 0, floats or arrays."""

    viscous_torque: Any  # [N.m] mechanistic law: rolling loss of the films
    hysteresis_torque: Any  # [N.m]
    sliding_torque: Any  # [N.m]
    film_thickness_min: Any  # [m]
    film_thickness_central_screw: Any  # [m]
    film_thickness_central_nut: Any  # [m]
    film_temperature_rise: Any  # [K] mean over a contact, highest of all
    contact_pressure_max: Any  # [Pa]
    ball_load_max: Any  # [N]
    lambda_ratio: Any  # minimum film over roughness height, at most LAMBDA_RATIO_MAX
    relieved_viscous_torque: Any  # [N.m] share of the nut with the lower force, a half if both have the same
    relieved_coulomb_torque: Any  # [N.m] the same
    in_range: Any  # bool
    clamped: tuple[str, ...]  # names of the inputs beyond the map, at any point
    seal_torque: Any = 0.0  # [N.m] constant drag of the seals, not a part of the balls

    @property
    def coulomb_torque(self) -> Any:
        """Hysteresis, sliding and seals [N.m]: what does not vanish with the speed."""
        return self.hysteresis_torque + self.sliding_torque + self.seal_torque

    @property
    def friction_torque(self) -> Any:
        """Sum of the three parts and of the seals [N.m]."""
        return self.viscous_torque + self.hysteresis_torque + self.sliding_torque + self.seal_torque


class Spin(NamedTuple):
    """What the shear of oversize balls between two sets of flanks follows from, of one set."""

    shear: Any  # [N.m] of balls held by four flanks alike
    free: Any  # [1] that of balls on two flanks over it; 1: no oversize balls
    push: Any  # [N.m] friction on balls that slide on this set, at coefficient 1 and the rolling speed


def film_shear_torques(
    surfaces: Numbers,
    slopes: Numbers | None,
    curves: Numbers,
    f: Any,
    s: Any,
    friction: FrictionParameters,
    ops: Ops,
) -> tuple[Any, Any, Any, None]:
    """Viscous, hysteresis and sliding torque of one nut [N.m] by the law of the fitted sets, and no Spin.

    surfaces, curves : logarithms, columns as packed.SURFACES and FORCE_CURVES, at least those of torque
    slopes : of the surfaces over ln speed, None: s is 1 everywhere
    f, s : force and speed over the low ends of their axes, at most 1
    """
    torque_screw, torque_nut, film_screw, film_nut = surfaces[:TORQUE_SURFACES]
    hysteresis, sliding, _ = curves[:TORQUE_CURVES]
    screw = nut = None
    if slopes is not None:
        slope_screw, slope_nut, film_slope_screw, film_slope_nut = slopes[:TORQUE_SURFACES]
        screw, nut = (slope_screw, film_slope_screw), (slope_nut, film_slope_nut)
    viscous = _raceway(torque_screw, film_screw, screw, s, friction.roughness_height, ops)
    viscous = viscous + _raceway(torque_nut, film_nut, nut, s, friction.roughness_height, ops)
    third = f ** (1.0 / 3.0)
    coulomb = friction.net_sliding_coefficient * ops.exp(sliding) * f
    if slopes is not None:
        coulomb = coulomb * coulomb_rise(s, 1.0, 0.0, friction.breakaway_factor, ops)
    return (
        friction.apparent_viscosity_ratio * viscous * third * third,
        ops.exp(hysteresis) * f * third,
        coulomb,
        None,
    )


def mechanistic_torques(
    surfaces: Numbers,
    slopes: Numbers | None,
    curves: Numbers,
    f: Any,
    s: Any,
    friction: FrictionParameters,
    ops: Ops,
) -> tuple[Any, Any, Any, Spin]:
    """Rolling, hysteresis and sliding torque of one nut [N.m] by the power balance, and Spin; arguments as above.

    The sliding part is the shear of the raceway contacts and the friction of balls on each other. The roughness height
    has no effect on a torque: the surfaces hold its asperities.
    """
    rolling_screw, rolling_nut, shear, thrust = surfaces[:TORQUE_SURFACES]
    hysteresis, sliding, free = curves[:TORQUE_CURVES]
    exp = ops.exp
    rolling_screw, rolling_nut, factor = exp(rolling_screw), exp(rolling_nut), exp(thrust)
    shear, push = f * exp(shear), f * exp(sliding)
    on_balls, rise = friction.net_sliding_coefficient * push * factor, 1.0
    if slopes is not None:
        slope_screw, slope_nut, _, thrust_slope = slopes[:TORQUE_SURFACES]
        rolling_screw = rolling_screw * _slow_share(slope_screw, s, ops)
        rolling_nut = rolling_nut * _slow_share(slope_nut, s, ops)
        rise = coulomb_rise(s, factor, thrust_slope, friction.breakaway_factor, ops)
    third = f ** (1.0 / 3.0)
    rolling = rolling_screw + rolling_nut
    return (
        friction.apparent_viscosity_ratio * rolling * third * third,
        exp(hysteresis) * f * third,
        (shear + on_balls) * rise,
        Spin(shear * rise, exp(free), push * rise),
    )


def freed_shear(relieved: Spin | None, loaded: Spin | None, ops: Ops) -> Any:
    """Sliding torque [N.m] by which oversize balls lose less than two sets of flanks alone; 0 without such balls, <= 0.

    Held by all four flanks, a ball costs the shear of both sets. Where the relieved set cannot hold it, it rolls on the
    loaded diagonal and slides on the other. It takes the motion that costs less.

    Validity     against the solved equilibrium of balls of ten screws over load, speed and temperature: 0.9 % of the
                 torque in the mean; 9 % for 95 % of the points where the relieved set has 2 to 5 % of the other's force
    """
    if relieved is None or loaded is None:
        return 0.0
    held = relieved.shear + loaded.shear
    free = loaded.free * loaded.shear + FREE_PUSH * relieved.push
    # of the smaller over the larger, so that no power overflows
    low, high = ops.least(held, free), ops.most(held, free)
    both = low * (1.0 + (low / ops.most(high, SMOOTH)) ** FREE_SHARPNESS) ** (-1.0 / FREE_SHARPNESS)
    return ops.where(loaded.free < 1.0, both - held, 0.0)


#: torques of one nut by law
NUT_TORQUES: Mapping[str, Callable[..., tuple[Any, Any, Any, Spin | None]]] = {
    FILM_SHEAR: film_shear_torques,
    MECHANISTIC: mechanistic_torques,
}


def _raceway(torque: Any, film: Any, slopes: Any, s: Any, roughness: Any, ops: Ops) -> Any:
    """Viscous torque of a raceway from the logarithms of torque and film; slopes: of both over ln speed, or None."""
    exp = ops.exp
    x = (roughness / exp(film)) ** 2
    share = 1.0 / (1.0 + x)
    viscous = exp(torque) * share
    if slopes is None:
        return viscous
    slope, film_slope = slopes
    return viscous * _slow_share(slope + 2.0 * x * share * film_slope, s, ops)


def _slow_share(slope: Any, s: Any, ops: Ops) -> Any:
    """Torque below the slowest node over that there: odd in speed, linear at rest, monotone.

    slope : exponent of speed at the node, continued below SPEED_EXPONENT_MAX;  s : speed over that of the node
    """
    c = 0.5 * (ops.least(ops.most(slope, 0.0), SPEED_EXPONENT_MAX) - 1.0)
    return s * (1.0 - c + c * s * s)


def coulomb_rise(s: Any, factor: Any, slope: Any, breakaway: Any, ops: Ops) -> Any:
    """Coulomb part below the slowest node over that there: even in speed, rises monotonically to standstill.

    A film thins with a power of the speed and asperities take over slowly: from the slowest node on the part follows
    its own slope, and reaches breakaway at standstill only.

    Parameters   s : speed over that of the node, at most 1
                 factor : Coulomb part at the node over that in a full film, >= 1
                 slope : of its logarithm over ln speed at the node
                 breakaway : the same at standstill; at or below the factor nothing rises
    Returns      1 at s = 1, breakaway/factor at standstill, with the slope of the factor at s = 1 where that is
                 between LEAST_HALF and BREAKAWAY_EXPONENT_MAX times the rise, downwards
    """
    rise = ops.most(ops.most(breakaway, 1.0) / factor - 1.0, 0.0)
    q = ops.least(ops.most(0.0 - slope / ops.most(rise, LEAST_RISE), 0.0), BREAKAWAY_EXPONENT_MAX)
    # speed, with slope 0 at rest; half: where half of the rise is left
    t = (1.0 + REST) * s * s / (s + REST)
    half = ops.most(q / ((1.0 + 2.0 * REST) / (1.0 + REST) - q), LEAST_HALF)
    return 1.0 + rise * (1.0 - (1.0 + half) * t / (t + half))


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


def relieved_share(relieved: Spin, loaded: Spin, ops: Ops) -> Any:
    """Share of the relieved set of flanks in freed_shear: that of the shear of balls held by all four. A convention."""
    return relieved.shear / ops.most(relieved.shear + loaded.shear, SMOOTH)


def double_nut(
    first: tuple[Numbers, Numbers],
    second: tuple[Numbers, Numbers],
    roughness: Any,
    in_range: Any,
    clamped: tuple[str, ...],
    ops: Ops,
) -> DoubleNutState:
    """State from nut_torques and nut_extremes of the relieved and the loaded nut: torques added, extremes over both."""
    ((viscous, hysteresis, sliding, spin), (film, screw, nut, rise, pressure, load)) = first
    ((viscous_2, hysteresis_2, sliding_2, spin_2), (film_2, screw_2, nut_2, rise_2, pressure_2, load_2)) = (
        second
    )
    least, most = ops.least, ops.most
    film = least(film, film_2)
    freed = freed_shear(spin, spin_2, ops)
    relieved = hysteresis + sliding
    if spin is not None and spin_2 is not None:
        relieved = relieved + freed * relieved_share(spin, spin_2, ops)
    return DoubleNutState(
        viscous + viscous_2, hysteresis + hysteresis_2, sliding + sliding_2 + freed, film,
        least(screw, screw_2), least(nut, nut_2), most(rise, rise_2), most(pressure, pressure_2),
        most(load, load_2), least(film / most(roughness, SMOOTH), LAMBDA_RATIO_MAX), viscous, relieved,
        in_range, clamped,
    )  # fmt: skip


def nut_forces(
    preload: Any, load: Any, separation: Any, sharing: Callable[[Any], Any], ops: Ops
) -> tuple[Any, Any]:
    """Forces of the relieved and of the loaded nut [N] under a preload > 0 and an axial load, its magnitude [N].

    separation : ln(load that parts the nuts over preload) at this preload
    sharing : (force of the relieved nut over preload)^(2/3) at a share of the separation load
    """
    share = load / (preload * ops.exp(separation))
    relieved = ops.where(share < 1.0, preload * ops.most(sharing(share), 0.0) ** 1.5, 0.0)
    return relieved, relieved + load
