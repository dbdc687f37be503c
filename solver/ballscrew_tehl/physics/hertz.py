"""Hertz contact of ball and raceway: reduced radii, ellipse, pressure, approach; exact elliptic integrals.

scipy.special is imported in the functions: evaluation of a stored map needs no elliptic integral.
"""

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..parameters.file import ScrewParameters

RACEWAYS = ("screw", "nut")
#: most steps to the axes of an ellipse; about seven are needed
MAX_SECANTS = 40


class HertzContact(NamedTuple):
    """Contact ellipse with its pressure and approach.

    Attributes
    ----------
    a, b : float or array
        Semi-axes across and along rolling [m], a >= b.
    p_max : float or array
        Maximum pressure [Pa].
    delta : float or array
        Approach of the bodies [m].
    """

    a: Any
    b: Any
    p_max: Any
    delta: Any


def raceway_sign(raceway: str) -> int:
    """+1 for the screw (convex along rolling), -1 for the nut (concave); ValueError for an unknown name."""
    if raceway not in RACEWAYS:
        raise ValueError(f"raceway = {raceway!r}; allowed: {', '.join(RACEWAYS)}")
    return 1 if raceway == "screw" else -1


def E_prime(screw: ScrewParameters) -> float:
    """Reduced modulus 2/sum((1-nu^2)/E) of ball and raceway.

    Parameters
    ----------
    screw : ScrewParameters
        Moduli and Poisson's ratios of raceways and balls.

    Returns
    -------
    float
        Reduced modulus [Pa].

    Examples
    --------
    >>> from ballscrew_tehl.parameters.file import load_screw
    >>> round(E_prime(load_screw().screw) / 1e9, 2)
    225.27
    """
    compliance = (1.0 - screw.poisson_ratio**2) / screw.youngs_modulus
    return 2.0 / (compliance + (1.0 - screw.ball_poisson_ratio**2) / screw.ball_youngs_modulus)


def reduced_radii(screw: ScrewParameters, contact_angle: Any, raceway: str) -> tuple[Any, Any]:
    """Reduced radii of ball and groove.

    Parameters
    ----------
    screw : ScrewParameters
        Geometry.
    contact_angle : float or array
        Contact angle [rad], 0 < beta < pi/2.
    raceway : str
        Raceway that the ball touches, "screw" or "nut".

    Returns
    -------
    R_x : float or array
        Radius along rolling [m].
    R_y : float
        Radius across rolling [m].

    Raises
    ------
    ValueError
        Unknown raceway.

    Notes
    -----
    1/R_x = 1/r_b +- cos(beta)/(r_m -+ r_b cos(beta)), 1/R_y = 1/r_b - 1/r_raceway: the formula of bearings, which
    takes the lead angle as small in the curvature.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> R_x, R_y = reduced_radii(load_screw().screw, 0.785, "screw")
    >>> f"{1e3 * R_x:.2f} mm, {1e3 * R_y:.1f} mm"
    '2.18 mm, 61.8 mm'
    """
    sign = raceway_sign(raceway)
    r_b = 0.5 * screw.ball_diameter
    r_groove = screw.screw_raceway_radius if sign > 0 else screw.nut_raceway_radius
    cos = np.cos(contact_angle)
    R_x = 1.0 / (1.0 / r_b + sign * cos / (screw.nominal_radius - sign * r_b * cos))
    return R_x, 1.0 / (1.0 / r_b - 1.0 / r_groove)


def ratio_of_axes(radius_ratio: Any) -> Any:
    """a/b >= 1 of the contact ellipse of R_x/R_y, 0 < ratio <= 1, float or array, relative error below 1e-13.

    Johnson, Contact Mechanics 1985, Eqs. 4.26-4.28, written with the symmetric integral R_D, which has no cancellation
    near the circle: R_y/R_x = R_D(0,1,1/k^2)/R_D(0,1/k^2,1); by secants.
    """
    ratio = np.asarray(radius_ratio, dtype=float)
    if not np.all((ratio > 0.0) & (ratio <= 1.0)):
        bad = float(ratio[~((ratio > 0.0) & (ratio <= 1.0))].flat[0])
        raise ValueError(f"radius_ratio = {bad}; needs 0 < R_x/R_y <= 1: rolling is along the short axis")
    from scipy.special import elliprd

    def mismatch(ln_k: Any) -> Any:
        q = np.exp(-2.0 * ln_k)
        return np.log(elliprd(0.0, 1.0, q) / elliprd(0.0, q, 1.0) * ratio)

    # ln k over ln(R_y/R_x): 0.75 near the circle, towards 0.5 of a long ellipse
    before, at = -0.5 * np.log(ratio), -0.75 * np.log(ratio)
    left = mismatch(before)
    for _ in range(MAX_SECANTS):
        here = mismatch(at)
        wide = here - left
        step = here * (at - before) / np.where(wide == 0.0, 1.0, wide)
        before, left, at = at, here, at - step
        if np.all(np.abs(step) <= 1e-15):
            break
    return np.exp(np.maximum(at, 0.0))


def _unit_contacts(R_x: Any, R_y: Any, modulus: float) -> HertzContact:
    """Contacts under 1 N."""
    from scipy.special import ellipkm1, elliprd

    k = ratio_of_axes(R_x / R_y)
    q = 1.0 / k**2
    a = np.cbrt(2.0 * R_y * elliprd(0.0, q, 1.0) / (math.pi * modulus))
    p_max = 1.5 * k / (math.pi * a**2)
    return HertzContact(a, a / k, p_max, 3.0 * ellipkm1(q) / (math.pi * a * modulus))


@lru_cache(maxsize=4096)
def _unit_contact(R_x: float, R_y: float, modulus: float) -> HertzContact:
    return HertzContact(*map(float, _unit_contacts(R_x, R_y, modulus)))


def ellipse(load: Any, R_x: Any, R_y: Any, E_prime: float) -> HertzContact:
    """Ellipse, maximum pressure and approach of an elliptical Hertz contact; the arguments broadcast.

    Parameters
    ----------
    load : float or array
        Load [N], >= 0.
    R_x, R_y : float or array
        Reduced radii along and across rolling [m], 0 < R_x <= R_y.
    E_prime : float
        Reduced modulus 2/sum((1-nu^2)/E) [Pa].

    Returns
    -------
    HertzContact
        Semi-axes a, b [m], p_max [Pa], delta [m].

    Raises
    ------
    ValueError
        R_x above R_y.

    Notes
    -----
    Elastic half-spaces, a much below the radii. Johnson, Contact Mechanics 1985, Eqs. 4.24-4.28 with E* = E_prime/2:
    a^3 = 2 Q R_y R_D(0,b^2/a^2,1)/(pi E'), p_max = 3 Q/(2 pi a b), delta = 3 Q K/(pi a E').

    Examples
    --------
    >>> round(float(ellipse(100.0, 5e-3, 5e-3, 226e9).p_max) / 1e6, 1)
    2146.0
    """
    root = np.cbrt(load)
    one = np.ndim(R_x) == np.ndim(R_y) == 0
    unit = _unit_contact(float(R_x), float(R_y), E_prime) if one else _unit_contacts(R_x, R_y, E_prime)
    return HertzContact(unit.a * root, unit.b * root, unit.p_max * root, unit.delta * root**2)


def ball_ellipse(screw: ScrewParameters, contact_angle: float, raceway: str, load: Any) -> HertzContact:
    """Contact of a ball under a load [N] with a raceway: ellipse with reduced_radii and E_prime."""
    return ellipse(load, *reduced_radii(screw, contact_angle, raceway), E_prime(screw))
