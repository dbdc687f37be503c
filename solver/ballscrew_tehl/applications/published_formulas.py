"""Published closed formulas for the drag torque of a preloaded nut."""

import math
from typing import Any

import numpy as np

from ..parameters.file import FOUR_POINT, Parameters, ScrewParameters
from ..parameters.units import CELSIUS
from ..physics.hertz import E_prime
from ..physics.lubricant import ambient_density, eta0

#: friction coefficient that the printed torques of Zhou's model imply
ZHOU_COEFFICIENT = 0.0065
#: Jungnickel's factor, and exponents of the speed and of the load group of a double nut with two-point contact
JUNGNICKEL_FACTOR, JUNGNICKEL_SPEED, JUNGNICKEL_LOAD = 9.16, 0.512, -0.516
#: exponent of the material group G; pressure coefficient [1/Pa] of a mineral oil of 1 m2/s at 40 C, and its exponent
JUNGNICKEL_MATERIAL, JUNGNICKEL_ALPHA, JUNGNICKEL_ALPHA_EXPONENT = -0.2, 1.29e-7, 0.204
#: torque over preload and nominal diameter that Rexroth prints, by kind of preload (R310RU 3301, pages 106 to 109: 207
#: rows within rounding); nominal diameter below the pitch circle, over ball
REXROTH = {"double_nut": 0.004, FOUR_POINT: 0.010}
BELOW_CIRCLE = 0.27


def rexroth_torque(screw: ScrewParameters, preload: float) -> float:
    """T_pr0 [N.m] of Rexroth's catalogue at a preload [N], without seals.

    0.004 d0 F of double nuts, 0.010 d0 F of single nuts with oversize balls: it prints torques, no formula.
    """
    diameter = 2.0 * screw.nominal_radius - BELOW_CIRCLE * screw.ball_diameter
    return REXROTH[screw.preload_kind] * diameter * preload


def zhou_torque(screw: ScrewParameters, preload: Any) -> np.ndarray:
    """Drag torque of the double nut after Zhou.

    Parameters
    ----------
    screw : ScrewParameters
        Geometry.
    preload : float or array
        Preload [N].

    Returns
    -------
    array
        Torque [N.m].

    Notes
    -----
    2 mu P (r_m + r_b cos(beta))/sin(beta): the form and mu = 0.0065 that reproduce the values of Zhou's model printed
    in Zhao 2023 Table 2 at 4 to 6 kN to all digits; the formula itself is not printed there.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> f"{zhou_torque(load_screw().screw, 4000.0):.3f} N.m"
    '1.595 N.m'
    """
    arm = screw.nominal_radius + 0.5 * screw.ball_diameter * math.cos(screw.contact_angle)
    return np.asarray(preload) * (2.0 * ZHOU_COEFFICIENT * arm / math.sin(screw.contact_angle))


def jungnickel_torque(parameters: Parameters, preload: float, speed: float, temperature: float) -> float:
    """Friction torque of the lubricated contacts of the double nut after Jungnickel.

    Parameters
    ----------
    parameters : Parameters
        Screw and oil.
    preload : float
        Preload [N].
    speed : float
        Speed of the screw [rad/s].
    temperature : float
        Temperature of the oil [K].

    Returns
    -------
    float
        Torque [N.m].

    Notes
    -----
    2 z 9.16 G^-0.2 W^-0.516 U^0.512 F_k r_m/cos(lambda) with F_k = F/(z sin(beta) cos(lambda)) the load of a ball,
    W = F_k/(E' r_b^2), U = eta u/(E' r_b), u = w r_m/(2 cos(lambda)) and G = alpha E'.

    Jungnickel, Simulation des thermischen Verhaltens von Werkzeugmaschinen, TU Dresden 2010, Eq. 9.49, as implemented
    in an open library; Eq. 4.23: alpha = 1.29e-7 nu_40^0.204, nu_40 [m2/s] at 40 C. The original is not seen. differs
    from it: z load-carrying balls of each nut, as the mechanistic law counts them; E' and viscosity of the screw file;
    no factor of seals.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> f"{jungnickel_torque(load_screw(), 2000.0, 104.7, 303.15):.3f} N.m"
    '0.267 N.m'
    """
    screw, oil = parameters.screw, parameters.lubricant
    z, r_b, cos_lead = screw.loaded_ball_count, 0.5 * screw.ball_diameter, math.cos(screw.lead_angle)
    warm, E = 40.0 + CELSIUS, E_prime(screw)
    nu_40 = eta0(oil, warm) / ambient_density(oil, warm)
    F_k = preload / (z * math.sin(screw.contact_angle) * cos_lead)
    G = JUNGNICKEL_ALPHA * nu_40**JUNGNICKEL_ALPHA_EXPONENT * E
    W = F_k / (E * r_b**2)
    U = eta0(oil, temperature) * speed * screw.nominal_radius / (2.0 * cos_lead * E * r_b)
    groups = G**JUNGNICKEL_MATERIAL * W**JUNGNICKEL_LOAD * U**JUNGNICKEL_SPEED
    return float(2.0 * z * JUNGNICKEL_FACTOR * groups * F_k * screw.nominal_radius / cos_lead)
