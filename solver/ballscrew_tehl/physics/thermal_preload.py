"""Preload of a nut whose screw is warmer or colder than the nut.

A common rise of temperature changes the scale of screw and nut and no preload. A screw that is warmer by dT than nuts
and spacer is larger by e = alpha dT in all directions, from its axis and from the middle of the spacer:

radially  the circle of the balls grows by e r_m on the side of the screw and closes the contacts of all kinds of nut.
          It is r_m to first order for balls at the mean temperature: their growth and that of the groove radius cancel.
          Balls as cold as the nut would take away r_s/(r_m cos(beta)) of it, 18 % for GD4008-3.
axially   the thread moves away from the middle by e z. Screw flanks that bear nuts which are pushed apart move away
          from the nuts, those of nuts that are pulled together move towards them. The inner balls of the two nuts are
          spacer_length apart, the balls of one nut (n - 1) dz, which is turns times lead: in the mean the elongation is
          e (spacer_length + (n - 1) dz), more for the outer balls than for the inner ones. A single nut with offset
          lead has the same with the distance of its halves, one lead by default. Oversize balls bear on flanks of both
          directions: no preload from axial elongation.

Groove centres at the radial distance A0 cos(beta) + e r_m touch the balls at another contact angle, and further along
the screw, than before:

    cos(beta_1) = cos(beta) + e r_m/A0,    advance = A0 (sin(beta) - sin(beta_1))/cos(lambda).

Two nuts or halves are then chains of module `load` at beta_1, with s = 1 (pushed apart) or -1 (pulled together):

    d_2 - d_1 = K f(d_1) + s e dz    at the outer ball,
    2 d_n(F) + spacer_stretch F = that of the preload at dT = 0 + 2 advance - s e spacer_length    at the inner ones.

Contacts, bodies and spacer have the stiffness that belongs to the force F. Oversize balls, A = A0 + oversize:

    F = n sin(beta_1) cos(lambda) ((L - A0)/C)^(3/2),    L = |(A cos(beta) + e r_m, A sin(beta))|.

Assumed: one temperature of the screw and one of nuts and spacer, one expansion, bodies stiff in radial direction. The
loads of nuts that are pulled together are those of nuts pushed apart: screw and nut exchange tension and compression.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from ..numerics import Array, rising_root
from ..parameters.file import FOUR_POINT, ScrewParameters
from .ball_law import check_force, contact_compliance, groove_distance
from .load import BallChain, ball_oversize, ball_pitch

#: share of the preload below which F^(2/3) is linear in the gap, as between there and twice that F^(2/3): two long nuts
#: lose contact ball by ball and the slope vanishes; moved to 0.001, forces change by less than 0.001 preloads
LAST_BALLS = 0.01
#: forces of preload_shifts
SHIFT_FORCES = 16


def preload_at_temperature_difference(
    screw: ScrewParameters, preload: float, temperature_difference: float, ball_count: int
) -> float:
    """Preload that remains when the screw is warmer or colder than the nut.

    Parameters
    ----------
    screw : ScrewParameters
        Geometry, kind and sense of the preload, expansion, section areas.
    preload : float
        Force of each nut, or of one set of flanks of oversize balls, without difference and axial load [N], >= 0;
        0: with clearance, whose size is not known.
    temperature_difference : float
        Screw minus nut [K].
    ball_count : int
        Balls of each nut that carry load.

    Returns
    -------
    float
        Preload [N], >= 0; 0: lost. Without difference the preload itself, without preload 0.

    Raises
    ------
    ValueError
        Not finite, preload negative, or a difference that turns the contacts of two nuts into the radial direction.

    Notes
    -----
    Head of this module. Balls of a long nut may carry at its inner end while the outer ones are free.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> screw = load_screw().screw
    >>> f"{preload_at_temperature_difference(screw, 2000.0, 5.0, screw.loaded_ball_count):.0f} N"
    '1911 N'
    """
    shift = preload_shift(screw, preload, temperature_difference, ball_count)
    if temperature_difference == 0.0:
        return float(preload)
    power = max(float(np.cbrt(preload)) ** 2 + shift, 0.0)
    return power * math.sqrt(power)


def preload_shift(
    screw: ScrewParameters, preload: float, temperature_difference: float, ball_count: int
) -> float:
    """Change of preload^(2/3) by a temperature difference, for tables.

    Parameters
    ----------
    screw, preload, temperature_difference, ball_count
        As of preload_at_temperature_difference.

    Returns
    -------
    float
        F^(2/3) - preload^(2/3) [N^(2/3)], F the preload that remains. Where it is lost F^(2/3) goes on below 0, linear
        in the gap between the flanks.

    Raises
    ------
    ValueError
        As of preload_at_temperature_difference.

    Notes
    -----
    Nearly linear in the difference while all balls carry, bent where the first lose contact. The map has a cubic
    spline over 13 geometric preloads in a range of 100 and 17 differences 20 K sinh(3 t)/sinh(3), t = -1 to 1: of 1925
    points of 35 random screws F is within 0.7 % of the larger one of F and preload for 99 %, 4.2 % at most (a long
    steep nut under light preload; 9 equal steps: 25 %).
    """
    check_force("preload", preload)
    if not math.isfinite(temperature_difference):
        raise ValueError(f"temperature_difference = {temperature_difference} K; needs to be finite")
    if temperature_difference == 0.0 or preload == 0.0:
        return 0.0
    strain = screw.thermal_expansion * temperature_difference
    closed = _oversize_balls if screw.preload_kind == FOUR_POINT else _two_nuts
    return closed(screw, float(preload), strain, ball_count) - float(np.cbrt(preload)) ** 2


def _oversize_balls(screw: ScrewParameters, preload: float, strain: float, ball_count: int) -> float:
    """F^(2/3) of one set of flanks [N^(2/3)], < 0 with a gap."""
    a_0, beta = groove_distance(screw), screw.contact_angle
    apart = a_0 + ball_oversize(screw, preload, ball_count)
    x, y = apart * math.cos(beta) + strain * screw.nominal_radius, apart * math.sin(beta)
    length = math.hypot(x, y)
    force_of_load = ball_count * y / length * math.cos(screw.lead_angle)
    return float(np.cbrt(force_of_load)) ** 2 * (length - a_0) / contact_compliance(screw)


class _TwoNuts:
    """Closure of two nuts or halves on a screw with a thermal strain."""

    def __init__(self, screw: ScrewParameters, strain: float, ball_count: int) -> None:
        a_0, beta = groove_distance(screw), screw.contact_angle
        cosine = math.cos(beta) + strain * screw.nominal_radius / a_0
        if not cosine < 1.0:
            raise ValueError(
                f"screw {strain / screw.thermal_expansion:.3g} K warmer than the nut; allowed: < "
                f"{(1.0 - math.cos(beta)) * a_0 / screw.nominal_radius / screw.thermal_expansion:.3g} K with these "
                "grooves"
            )
        touching = math.acos(cosine)
        advance = a_0 * (math.sin(beta) - math.sin(touching)) / math.cos(screw.lead_angle)
        outwards = strain if screw.preload_sense == "pushed_apart" else -strain
        self._slope = outwards * ball_pitch(screw, ball_count)
        self._chain = BallChain(screw.model_copy(update={"contact_angle": touching}), ball_count)
        #: by which the flanks are closer than without strain [m]
        self.closer = 2.0 * advance - outwards * screw.spacer_length

    def approach(self, power: float) -> float:
        """Of the flanks of both nuts [m] at the force power^(3/2) [N]."""
        force = power * math.sqrt(power)
        return 2.0 * float(self._chain.nut(force, self._slope)[-1]) + self._chain.spacer_stretch * force

    def power(self, preload: float, closed: float, approach: Callable[[float], float]) -> float:
        """F^(2/3) of each nut [N^(2/3)] at an approach [m] of the flanks, < 0 with a gap; preload: without strain."""
        low = float(np.cbrt(LAST_BALLS * preload)) ** 2
        at = approach(low) - closed
        if at >= 0.0:
            return low - at * low / (approach(2.0 * low) - closed - at)
        high = max(2.0 * low, float(np.cbrt(preload)) ** 2)
        while approach(high) < closed:
            high *= 2.0
        return rising_root(lambda power: approach(power) - closed, low, high, 1e-10)[0]


@lru_cache(maxsize=64)
def _closure(screw: ScrewParameters, strain: float, ball_count: int) -> _TwoNuts:
    return _TwoNuts(screw, strain, ball_count)


@lru_cache(maxsize=4096)
def _two_nuts(screw: ScrewParameters, preload: float, strain: float, ball_count: int) -> float:
    """F^(2/3) of each nut [N^(2/3)], < 0 with a gap."""
    nuts, cold = (_closure(screw, own, ball_count) for own in (strain, 0.0))
    return nuts.power(preload, cold.approach(float(np.cbrt(preload)) ** 2) + nuts.closer, nuts.approach)


def preload_shifts(screw: ScrewParameters, preloads: Array, differences: Array, ball_count: int) -> Array:
    """preload_shift (p, d) of many preloads [N], rising, and temperature differences [K], of two nuts by splines.

    The approach over F^(2/3) follows from SHIFT_FORCES forces at each difference: within 1e-3 of
    preload_shift.
    """
    from scipy.interpolate import CubicSpline  # imports much

    # a screw with so flat contacts that the warmest turns them into the radial direction
    steepest = 0.9 * (1.0 - math.cos(screw.contact_angle)) * groove_distance(screw) / screw.nominal_radius
    strains = np.minimum(screw.thermal_expansion * differences, steepest)
    powers = np.cbrt(preloads) ** 2
    if screw.preload_kind == FOUR_POINT:
        rows = [[_oversize_balls(screw, float(p), float(e), ball_count) for e in strains] for p in preloads]
        return np.asarray(rows) - powers[:, None]
    lowest, highest = float(np.cbrt(LAST_BALLS * preloads[0])) ** 2, 2.0 * float(powers[-1])
    at = np.geomspace(0.9 * lowest, highest, SHIFT_FORCES)
    cold = [_closure(screw, 0.0, ball_count).approach(float(power)) for power in powers]
    result = np.empty((preloads.size, differences.size))
    for d, strain in enumerate(strains):
        nuts = _closure(screw, float(strain), ball_count)
        spline = CubicSpline(np.log(at), [nuts.approach(float(power)) for power in at])

        def approach(power: float, nuts: _TwoNuts = nuts, spline: Any = spline) -> float:
            return float(spline(math.log(power))) if power <= highest else nuts.approach(power)

        for i, preload in enumerate(preloads):
            result[i, d] = nuts.power(float(preload), cold[i] + nuts.closer, approach) - powers[i]
    return result
