"""Static and dynamic axial load rating of one nut, and its life, as ball-screw programs state them."""

import math
from typing import Any

import numpy as np

from ..parameters.file import ScrewParameters
from ..parameters.screw import FOUR_POINT
from .ball_law import contact_angle_at_ball_load
from .hertz import RACEWAYS, ball_ellipse

#: Hertz pressure [Pa] at which steel of ball bearings keeps a dent of 1e-4 of the ball diameter (ISO 76)
STATIC_PRESSURE = 4.2e9
#: exponent of the life of ball contacts; Weibull exponent with which the lives of two nuts add up
LIFE_EXPONENT, WEIBULL = 3.0, 10.0 / 9.0
#: groove radius over ball diameter of inner and outer ring in the tables of ISO 281
RATED_GROOVES = 0.52, 0.53


def computed_dynamic_rating(screw: ScrewParameters) -> float:
    """Dynamic axial load rating C_a of one nut [N] by its geometry: 90 % of the screws reach 1e6 turns under it.

    ISO 3408-5, as recalled: C_s = f_c cos(a)^0.86 z^(2/3) D^1.8 tan(a) cos(phi)^1.3 of one turn [N, mm], f_c = 93.2 (1
    - sin(a)/3) (1/(1 - 1/(2 f_s)))^0.41 g^0.3 (1-g)^1.39/(1+g)^(1/3), g = D cos(a)/D_pw; with the nut C_s (1 +
    (C_s/C_n)^(10/3))^-0.3, C_s/C_n = ((1-g)/(1+g))^1.723 ((2 - 1/f_n)/(2 - 1/f_s))^0.41, times (turns of all
    starts)^0.86. No factors for hardness, accuracy.
    """
    angle, lead = screw.contact_angle, screw.lead_angle
    ball, pitch = 1e3 * screw.ball_diameter, 2e3 * screw.nominal_radius
    f_s = screw.screw_raceway_radius / screw.ball_diameter
    f_n = screw.nut_raceway_radius / screw.ball_diameter
    g = ball * math.cos(angle) / pitch
    rows = screw.turns * screw.starts
    per_turn = screw.loaded_ball_count / rows
    f_c = 93.2 * (1.0 - math.sin(angle) / 3.0) * (1.0 / (1.0 - 0.5 / f_s)) ** 0.41
    f_c *= g**0.3 * (1.0 - g) ** 1.39 / (1.0 + g) ** (1.0 / 3.0)
    c_s = f_c * math.cos(angle) ** 0.86 * per_turn ** (2.0 / 3.0) * ball**1.8
    c_s *= math.tan(angle) * math.cos(lead) ** 1.3
    over = ((1.0 - g) / (1.0 + g)) ** 1.723 * ((2.0 - 1.0 / f_n) / (2.0 - 1.0 / f_s)) ** 0.41
    return c_s * (1.0 + over ** (10.0 / 3.0)) ** -0.3 * rows**0.86


def bearing_rating(screw: ScrewParameters) -> float:
    """Dynamic axial load rating C_a of one row of an angular contact ball bearing [N] by its geometry, as ISO 281.

    C_a = b_m f_c cos(a)^0.7 tan(a) Z^(2/3) D^1.8 [N, mm], b_m = 1.3, f_c = 98.07 lambda (1 - sin(a)/3) (2 f_i/(2 f_i -
    1))^0.41 g^0.3 (1-g)^1.39/(1+g)^(1/3) (1 + (C_i/C_e)^(10/3))^-0.3, lambda = 0.9, g = D cos(a)/D_pw, as recalled.
    The tables of the standard hold for grooves f_i, f_e (RATED_GROOVES), whatever those of the bearing are. SNFA's
    twelve of 60 degrees: 1.01 to 1.03 of the printed values. Below 45 degrees the standard has another formula.
    """
    angle, ball, (f_i, f_e) = screw.contact_angle, 1e3 * screw.ball_diameter, RATED_GROOVES
    g = ball * math.cos(angle) / (2e3 * screw.nominal_radius)
    f_c = 98.0665 * 0.9 * (1.0 - math.sin(angle) / 3.0) * (2.0 * f_i / (2.0 * f_i - 1.0)) ** 0.41
    f_c *= g**0.3 * (1.0 - g) ** 1.39 / (1.0 + g) ** (1.0 / 3.0)
    over = ((1.0 - g) / (1.0 + g)) ** 1.72 * (f_i * (2.0 * f_e - 1.0) / (f_e * (2.0 * f_i - 1.0))) ** 0.41
    f_c *= (1.0 + over ** (10.0 / 3.0)) ** -0.3
    of_ball = f_c * math.cos(angle) ** 0.7 * math.tan(angle) * ball**1.8
    return float(1.3 * of_ball * screw.loaded_ball_count ** (2.0 / 3.0))


def dynamic_rating(screw: ScrewParameters) -> float:
    """Dynamic axial load rating C_a of one nut [N]: that of the screw file, else computed."""
    return computed_dynamic_rating(screw) if screw.dynamic_rating is None else screw.dynamic_rating


def static_rating(screw: ScrewParameters) -> float:
    """Static axial load rating C_0a of one nut [N]: that of the screw file, else computed."""
    return computed_static_rating(screw) if screw.static_rating is None else screw.static_rating


def computed_static_rating(screw: ScrewParameters) -> float:
    """Static axial load rating C_0a of one nut [N] by its geometry: a dent of 1e-4 of the ball diameter.

    ISO 3408-5, as recalled: k_0 D^2 sin(a) cos(phi) of each ball [N, mm], with the curvatures of ball and screw k_0 =
    27.74/(D sqrt((2/D - 1/(f_s D)) (2/D + 1/(D_pw/(2 cos(a)) - D/2)))). No factors for hardness, accuracy;
    examples/catalogue_screws.py compares it with catalogues.
    """
    angle, ball = screw.contact_angle, 1e3 * screw.ball_diameter
    across = (2.0 - screw.ball_diameter / screw.screw_raceway_radius) / ball
    along = 2.0 / ball + 1.0 / (1e3 * screw.nominal_radius / math.cos(angle) - 0.5 * ball)
    of_ball = 27.74 / (ball * math.sqrt(across * along)) * ball**2 * math.sin(angle)
    return float(screw.loaded_ball_count * of_ball * math.cos(screw.lead_angle))


def ball_pressure(screw: ScrewParameters, load: float) -> float:
    """Hertz pressure of a ball under its load, the larger one of both raceways.

    Parameters
    ----------
    screw : ScrewParameters
        Geometry; the contact angle follows the load.
    load : float
        Ball load [N], > 0.

    Returns
    -------
    float
        Pressure [Pa].

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> f"{ball_pressure(load_screw().screw, 60.0) / 1e9:.2f} GPa"
    '1.32 GPa'
    """
    angle = float(contact_angle_at_ball_load(screw, load))
    return max(float(ball_ellipse(screw, angle, raceway, load).p_max) for raceway in RACEWAYS)


def life(screw: ScrewParameters, force_a: float, force_b: float) -> float:
    """Nominal life L10 of the preloaded nut in turns, under constant axial forces [N]; infinite without force.

    ISO 3408-5: L = (C_a/F)^3 1e6 of each nut, together (L_A^(-10/9) + L_B^(-10/9))^(-9/10).
    """
    rating = dynamic_rating(screw)
    spent = sum(((force / rating) ** LIFE_EXPONENT / 1e6) ** WEIBULL for force in (force_a, force_b))
    return math.inf if spent == 0.0 else float(spent ** (-1.0 / WEIBULL))


def nsk_slope(screw: ScrewParameters) -> float:
    """Drag torque per preload after NSK, 0.05 L_p/(2 pi sqrt(tan lambda)).

    Parameters
    ----------
    screw : ScrewParameters
        Lead and lead angle.

    Returns
    -------
    float
        Torque over preload [N.m/N].

    Notes
    -----
    JIS B 1192 (100 r/min, ISO VG 68), as used in Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> f"{1e3 * nsk_slope(load_screw().screw):.4f} N.m per kN"
    '0.2524 N.m per kN'
    """
    return 0.05 * screw.lead / (2.0 * math.pi * math.sqrt(math.tan(screw.lead_angle)))


def nsk_torque(screw: ScrewParameters, preload: Any) -> np.ndarray:
    """Drag torque of the double nut after NSK, in proportion to the preload.

    Parameters
    ----------
    screw : ScrewParameters
        Lead and lead angle.
    preload : float or array
        Preload [N].

    Returns
    -------
    array
        Torque [N.m].

    Notes
    -----
    Preload times nsk_slope, JIS B 1192.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> f"{nsk_torque(load_screw().screw, 2000.0):.3f} N.m"
    '0.505 N.m'
    """
    return np.asarray(preload) * nsk_slope(screw)


#: preload over the dynamic rating that catalogues state torques for, by preload kind
CATALOGUE_SHARE = {"double_nut": 0.05, "single_nut_offset": 0.05, FOUR_POINT: 0.025}


def catalogue_preload(screw: ScrewParameters) -> float:
    """Preload that catalogues state torques for, a fraction of the dynamic rating by kind of preload, in two digits.

    Parameters
    ----------
    screw : ScrewParameters
        Geometry, and the dynamic rating if the screw file states it.

    Returns
    -------
    float
        Preload [N].

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> catalogue_preload(load_screw().screw)
    1300.0
    """
    return float(f"{CATALOGUE_SHARE[screw.preload_kind] * dynamic_rating(screw):.2g}")
