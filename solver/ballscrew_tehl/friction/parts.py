"""Friction of one ball in its two raceways: viscous, hysteresis and sliding part.

Source of all equations: Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231; "Eq. (n)" is its numbering.
The forces work on floats and arrays alike and check nothing: their callers do.
"""

from typing import Any

import numpy as np


def viscous_force(a: Any, b: Any, viscosity: Any, slip: Any, film: Any) -> Any:
    """Force that shears the film of one contact.

    Parameters   a, b : semi-axes of the Hertz ellipse [m], > 0;  viscosity : apparent shear viscosity [Pa s]
                 slip : speed difference of the surfaces [m/s], >= 0;  film : isothermal central film [m], > 0
    Returns      pi a b eta |du| / h [N]
    Validity     Newtonian Couette flow in a parallel film over the whole ellipse
    Source       Zhao 2023, Eqs. (15)-(16); errata: the integral as printed in Eq. (15) gives 2 pi a b/3, its
                 printed result and all printed torques need pi a b, which is kept
    """
    return np.pi * np.asarray(a) * b * viscosity * np.abs(slip) / film


def roughness_share(film: Any, roughness_height: Any) -> Any:
    """Share of the viscous part that remains where the film is as thin as the roughness.

    Parameters   film : central film [m], > 0;  roughness_height : h_r [m], >= 0
    Returns      1/(1 + (h_r/h)^2), 1 without roughness
    Validity     an empirical transition from film to asperities; h_r is fitted and not a measured roughness
    Source       differs from paper: added here, Zhao 2023 has no such term
    """
    return 1.0 / (1.0 + np.square(np.asarray(roughness_height) / film))


def roughness_share_slope(film: Any, roughness_height: Any) -> Any:
    """Derivative of roughness_share with respect to the roughness height [1/m], arguments alike."""
    x = np.asarray(roughness_height) / film
    return -2.0 * x / film / np.square(1.0 + np.square(x))


def hysteresis_force(load: Any, b: Any, ball_radius: float, coefficient: float) -> Any:
    """Rolling resistance of one contact by elastic hysteresis.

    Parameters   load : Q [N], >= 0;  b : semi-axis along rolling [m];  ball_radius : r_b [m]
                 coefficient : share of the elastic work that is lost [1]
    Returns      3 mu_hs Q b/(16 r_b) [N]
    Source       Zhao 2023, Eq. (18); errata: the printed integrand lacks the square root of the Hertz
                 pressure, the printed result has it
    """
    return 3.0 * coefficient * np.asarray(load) * b / (16.0 * ball_radius)


def sliding_force(load: Any, net_coefficient: Any) -> Any:
    """Sliding friction of one ball, counted once per ball and not once per raceway.

    Parameters   load : Q [N], >= 0;  net_coefficient : mu_s (1 - 3c + c^3) [1], fitted as one number
    Returns      net_coefficient Q [N]
    Source       Zhao 2023, Eqs. (20)-(21), c the lines without slip as a fraction of the semi-axis; errata: the
                 printed c = a^2/(6 d_b) is a length; the middle integral is printed with the opposite sign and half the
                 weight of the stated result
    """
    return np.asarray(load) * net_coefficient


def spin_moment(load: Any, a: Any, b: Any, coefficient: float) -> Any:
    """Moment of Coulomb friction in a contact that only spins.

    Parameters   load : Q [N], >= 0;  a, b : semi-axes of the Hertz ellipse [m], a >= b > 0;  coefficient : mu [1]
    Returns      3/8 mu Q a E(e) [N m], E complete elliptic integral of the second kind, e^2 = 1 - (b/a)^2
    Source       Harris, Rolling Bearing Analysis; a circle has 3 pi/16 mu Q a
    """
    from scipy.special import ellipe

    return 0.375 * coefficient * np.asarray(load) * a * ellipe(1.0 - np.square(np.asarray(b) / a))
