"""Contact of the asperities of two rough surfaces: height integrals, mean pressure, real area of contact.

h is the distance between the mean planes of the two surfaces; E_prime = 2/sum((1-nu^2)/E).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from .bounds import needs, needs_finite, needs_not_negative, needs_positive

#: Gauss-Legendre nodes of a height integral: relative error below 1e-13 for the orders 0 to 3
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(96)
#: the integrand is left out where it is below exp(-40) of its peak
_LN_CUT = 40.0
#: a sigma beta eta and sigma/beta of ground steel, see typical_roughness
TYPICAL_PRODUCT, TYPICAL_SLENDERNESS = 0.05, 1e-3


@dataclass(frozen=True)
class Roughness:
    """Two rough surfaces in contact, after Greenwood & Tripp 1970.

    sigma : standard deviation of the sum of both surfaces' asperity heights, sqrt(sigma_1^2 + sigma_2^2) [m],
            >= 0; 0 is a smooth contact.  The rms of the composite profile is the usual estimate
    asperity_density : eta, asperities of one surface per area [1/m2], > 0
    asperity_radius : beta, radius of curvature of one asperity [m], > 0
    Raises       ValueError: out of these bounds or not finite
    """

    sigma: float
    asperity_density: float
    asperity_radius: float

    def __post_init__(self) -> None:
        needs_not_negative(sigma=self.sigma)
        needs_positive(asperity_density=self.asperity_density, asperity_radius=self.asperity_radius)

    @property
    def product(self) -> float:
        """The dimensionless roughness sigma beta eta."""
        return self.sigma * self.asperity_radius * self.asperity_density


def typical_roughness(
    sigma: float, product: float = TYPICAL_PRODUCT, slenderness: float = TYPICAL_SLENDERNESS
) -> Roughness:
    """Roughness of a ground or honed steel pair of which only the height is known.

    Parameters   sigma : composite rms height [m], > 0;  product : sigma beta eta, > 0;
                 slenderness : sigma/beta, > 0
    Returns      Roughness with beta = sigma/slenderness and eta = product/(sigma beta)
    Raises       ValueError: not finite or not positive
    Validity     intervals in use: product 0.03 to 0.05, slenderness 1e-4 to 1e-2, so that p_a at a given h/sigma
                 is uncertain by about a factor of 3 upwards and 9 downwards.  At h = 0 these numbers give p_a =
                 26 MPa between steels, 4 % of a mean Hertz pressure of 0.7 GPa: measure the surfaces
    Source       Greenwood & Tripp, Proc IMechE 185 (1970) 625, intervals as quoted in the literature of mixed
                 lubrication; the paper itself was not available.  Open codes use 0.04 and 0.055 with 1e-3
    Example
        >>> r = typical_roughness(2e-7)
        >>> round(r.product, 4), round(r.asperity_radius, 7), f"{r.asperity_density:.3g}"
        (0.05, 0.0002, '1.25e+09')
    """
    needs_positive(sigma=sigma, product=product, slenderness=slenderness)
    radius = sigma / slenderness
    return Roughness(sigma, product / (sigma * radius), radius)


def height_integral(order: float, u: Any) -> Any:
    """Height integral of a Gaussian surface, F_n(u) = (2 pi)^(-1/2) int_u^inf (s-u)^n exp(-s^2/2) ds.

    Parameters   order : n, float, 0 to 3;  u : float or array, h/sigma, any sign
    Returns      F_n(u), shaped like u, >= 0; relative error 1e-14, rounding of exp(-u^2/2) added; 0 where it
                 underflows
    Raises       ValueError: order out of range, u not finite
    Source       Greenwood & Tripp 1970.  Equal to Gamma(n+1) exp(-u^2/4) D_(-n-1)(u)/sqrt(2 pi) with the
                 parabolic cylinder function D; here by Gauss-Legendre quadrature in q, s = u + q^2, where the
                 integrand is smooth for half-integer n
    Example
        >>> round(float(height_integral(2.5, 0.0)), 6)
        0.616634
    """
    needs(0.0 <= order <= 3.0, "order", order, "0 to 3")
    needs_finite(u=u)
    u = np.asarray(u, dtype=float)
    above, below = np.maximum(u, 0.0)[..., None], np.minimum(u, 0.0)[..., None]
    width = math.sqrt(2.0 * _LN_CUT)
    # s - u = q^2 runs from 0, or from the foot of the bell, to where the integrand is exp(-40) of its peak
    first = np.sqrt(np.maximum(0.0, -below - width))
    last = np.sqrt(-below + 2.0 * _LN_CUT / (above + np.hypot(above, width)))
    q = 0.5 * (last - first) * _NODES + 0.5 * (last + first)
    weight = (last - first) * _WEIGHTS / math.sqrt(2.0 * math.pi)
    exponent = -above * q * q - 0.5 * (below + q * q) ** 2
    # the decay exp(-u^2/2) apart
    return np.sum(weight * q ** (2.0 * order + 1.0) * np.exp(exponent), axis=-1) * np.exp(
        -0.5 * np.maximum(u, 0.0) ** 2
    )


def pressure_scale(roughness: Roughness, E_prime: float) -> float:
    """Factor of F_5/2 in the asperity pressure, (16 sqrt(2) pi/15) (sigma beta eta)^2 sqrt(sigma/beta) E'/2.

    Parameters   roughness : Roughness;  E_prime : float [Pa], > 0
    Returns      float [Pa], >= 0; 0 for a smooth contact
    Raises       ValueError: E_prime not finite or not positive
    Source       Greenwood & Tripp 1970, their modulus E* = 1/sum((1-nu^2)/E) = E'/2.  Derived anew: two asperities
                 of radius beta whose axes are r apart overlap by w = s - h - r^2/(4 beta) and carry
                 (4/3) E* sqrt(beta/2) w^(3/2); integrated over r with density eta and over s
    Example
        >>> round(pressure_scale(typical_roughness(2e-7), 226e9) / 1e6, 2)
        42.34
    """
    needs_positive(E_prime=E_prime)
    slenderness = roughness.sigma / roughness.asperity_radius
    constant = 16.0 * math.sqrt(2.0) * math.pi / 15.0
    return constant * roughness.product**2 * math.sqrt(slenderness) * 0.5 * E_prime


@cache
def _pressure_over_mean_gap() -> tuple[Any, Any]:
    """ln of the mean gap over sigma and ln of F_5/2 there, from touching to far surfaces."""
    u = np.linspace(-8.0, 8.0, 1601)
    return np.log(height_integral(1.0, -u)), np.log(height_integral(2.5, u))


def film_asperity_share(roughness: Roughness, E_prime: float, film: Any, mean_pressure: Any) -> Any:
    """Share of the load that the asperities of a contact carry whose oil film has a given thickness.

    Parameters   roughness : Roughness;  E_prime : float [Pa], > 0;  film : float or array [m], > 0, of the smooth
                 contact;  mean_pressure : float or array [Pa], > 0
    Returns      f, 0 to 1, broadcast; 0 for a smooth contact (sigma = 0); 1 for film -> 0
    Raises       ValueError: not positive or not finite
    Validity     the volume of oil that the inlet draws in fills the gap of the rough surfaces, so the film is the mean
                 gap sigma F_1(-h/sigma), not the distance h of the mean planes, which vanishes at 0.4 sigma and is
                 negative below. The film does not depend on the share of the load that it carries, as in the
                 piezoviscous limit (Johnson, Greenwood & Poon 1972)
    Source       f = p_a(h)/mean_pressure, p_a = pressure_scale F_5/2(h/sigma) of elastic asperities on both surfaces
                 (Greenwood & Tripp, Proc IMechE 185 (1970) 625); table of 1601 nodes over h/sigma -8 to 8
    Example
        >>> share = film_asperity_share(typical_roughness(2e-7), 226e9, np.array([1e-12, 2e-8, 2e-7, 6e-7]), 6e8)
        >>> [round(float(f), 4) for f in share]
        [1.0, 0.1713, 0.0072, 0.0]
    """
    needs_positive(E_prime=E_prime, film=film, mean_pressure=mean_pressure)
    if roughness.sigma == 0.0:
        return np.zeros(np.broadcast(film, mean_pressure).shape)[()]
    ln_gap, ln_integral = _pressure_over_mean_gap()
    at = np.interp(np.log(np.asarray(film) / roughness.sigma), ln_gap, ln_integral)
    return np.minimum(pressure_scale(roughness, E_prime) * np.exp(at) / mean_pressure, 1.0)
