"""Asperity pressure in the compiled loops: F_5/2 by two Chebyshev series, made at import from the exact integral.

u >= 0: F_5/2 = exp(-u^2/2) (1 + u/c)^(-7/2) P(x), x = (u - c)/(u + c).
u < 0:  F_5/2 = (u^2 + c^2)^(5/4) Q(x), x = (-u - c)/(-u + c).
The factors before the series have the limit of F_5/2 for large |u|: P and Q are smooth and positive for every u.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba import njit

from ...physics.asperity import scaled_height_integral
from ..half_space.grid import Array

#: c and degree of the series above and below u = 0
ABOVE, ABOVE_DEGREE = 4.0, 16
BELOW, BELOW_DEGREE = 2.0, 36
#: largest relative errors against the exact integral, of the value and of the slope, -50 <= u <= 37
VALUE_ERROR, SLOPE_ERROR = 1e-9, 1e-8
#: exp(-u^2/2) is 0 in double precision beyond this
FARTHEST = 38.6


def _above(x: Array) -> Array:
    u = ABOVE * (1.0 + x) / (1.0 - x)
    return scaled_height_integral(2.5, u) * (1.0 + u / ABOVE) ** 3.5


def _below(x: Array) -> Array:
    u = -BELOW * (1.0 + x) / (1.0 - x)
    return scaled_height_integral(2.5, u) / (u * u + BELOW * BELOW) ** 1.25


def _interpolated(function: Callable[[Array], Array], degree: int) -> Array:
    """Coefficients of the Chebyshev series that equals the function at the zeros of the next polynomial."""
    count = degree + 1
    angle = np.pi * (np.arange(count) + 0.5) / count
    coefficients = 2.0 / count * np.cos(np.outer(np.arange(count), angle)) @ function(np.cos(angle))
    coefficients[0] *= 0.5
    return coefficients


# constants of the compiled code: its cache keeps them until this file changes
P, Q = _interpolated(_above, ABOVE_DEGREE), _interpolated(_below, BELOW_DEGREE)


@njit(cache=True, error_model="numpy")
def _series(c: Array, x: float) -> tuple[float, float]:
    """Chebyshev series and its derivative at x by Clenshaw's recurrence."""
    b1 = b2 = d1 = d2 = 0.0
    for k in range(c.size - 1, 0, -1):
        d1, d2 = 2.0 * b1 + 2.0 * x * d1 - d2, d1
        b1, b2 = c[k] + 2.0 * x * b1 - b2, b1
    return c[0] + x * b1 - b2, b1 + x * d1 - d2


@njit(cache=True, error_model="numpy")
def height_integral_5_2(u: float) -> tuple[float, float]:
    """F_5/2(u) and its derivative; within VALUE_ERROR and SLOPE_ERROR of physics.asperity.height_integral."""
    if u > FARTHEST:
        return 0.0, 0.0
    if u >= 0.0:
        span = u + ABOVE
        p, dp = _series(P, (u - ABOVE) / span)
        factor = np.exp(-0.5 * u * u) * (span / ABOVE) ** -3.5
        return factor * p, factor * (dp * 2.0 * ABOVE / (span * span) - p * (u + 3.5 / span))
    span, squares = BELOW - u, u * u + BELOW * BELOW
    q, dq = _series(Q, -(u + BELOW) / span)
    factor = squares**1.25
    return factor * q, factor * (2.5 * u / squares * q - dq * 2.0 * BELOW / (span * span))


@njit(cache=True, error_model="numpy")
def asperity_pressure(scale: float, sigma: float, h: float) -> tuple[float, float]:
    """Mean asperity pressure p_a [Pa], >= 0, and dp_a/dh [Pa/m], <= 0, at a film h [m] of any sign.

    scale : physics.asperity.pressure_scale [Pa];  sigma : composite roughness [m], 0 for a smooth contact: zeros.
    Greenwood & Tripp 1970; the plain twin is physics.asperity.asperity_pressure.
    """
    if sigma <= 0.0 or scale <= 0.0:
        return 0.0, 0.0
    value, slope = height_integral_5_2(h / sigma)
    return scale * value, scale / sigma * slope


@njit(cache=True, error_model="numpy")
def asperity_field(scale: float, sigma: float, gap: Array, p_a: Array, slope: Array) -> None:
    """asperity_pressure and its slope at every node of gap (n_y, n_x)."""
    for j in range(gap.shape[0]):
        for i in range(gap.shape[1]):
            p_a[j, i], slope[j, i] = asperity_pressure(scale, sigma, gap[j, i])


class Asperities(NamedTuple):
    """Asperities in the units of a solve: scale [p_max] as in asperity_pressure, sigma [b^2/R_x], 0 = smooth."""

    scale: float = 0.0
    sigma: float = 0.0

    @property
    def rough(self) -> bool:
        """Whether they carry anything at all."""
        return self.scale > 0.0 and self.sigma > 0.0

    def gap_at(self, pressure: float) -> float:
        """Gap [b^2/R_x] at which they carry a pressure [p_max]; -8 sigma at the closest, 0 of smooth surfaces."""
        low, high = -8.0 * self.sigma, FARTHEST * self.sigma
        while high - low > 1e-3 * self.sigma:
            middle = 0.5 * (low + high)
            if asperity_pressure(self.scale, self.sigma, middle)[0] > pressure:
                low = middle
            else:
                high = middle
        return low

    def pressure(self, gap: Array) -> tuple[Array, Array]:
        """Their pressure (n_y, n_x) [p_max] and its slope over the gap, <= 0."""
        p_a, slope = np.zeros((2, *gap.shape))
        if self.rough:
            asperity_field(self.scale, self.sigma, gap, p_a, slope)
        return p_a, slope
