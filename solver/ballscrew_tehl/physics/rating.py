"""Static and dynamic axial load rating of one nut, and its life, as ball-screw programs state them."""

import math

from ..parameters.file import ScrewParameters
from .ball_law import contact_angle_at_ball_load, rising_root
from .hertz import RACEWAYS, ball_ellipse

#: Hertz pressure [Pa] at which steel of bearings keeps a dent of 1e-4 of the ball diameter
STATIC_PRESSURE = 4.2e9
#: exponent of the life of ball contacts; Weibull exponent with which the lives of two nuts add up
LIFE_EXPONENT, WEIBULL = 3.0, 10.0 / 9.0


def computed_dynamic_rating(screw: ScrewParameters) -> float:
    """Dynamic axial load rating C_a of one nut [N] by its geometry: 90 % of the screws reach 1e6 turns under it.

    Source       ISO 3408-5, as recalled: C_s = f_c cos(a)^0.86 z^(2/3) D^1.8 tan(a) cos(phi)^1.3 of one turn [N, mm],
                 f_c = 93.2 (1 - sin(a)/3) (1/(1 - 1/(2 f_s)))^0.41 g^0.3 (1-g)^1.39/(1+g)^(1/3), g = D cos(a)/D_pw;
                 with the nut C_s (1 + (C_s/C_n)^(10/3))^-0.3, C_s/C_n = ((1-g)/(1+g))^1.723
                 ((2 - 1/f_n)/(2 - 1/f_s))^0.41, times (turns of all starts)^0.86. No factors for hardness, accuracy
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


def dynamic_rating(screw: ScrewParameters) -> float:
    """Dynamic axial load rating C_a of one nut [N]: that of the screw file, else computed."""
    return computed_dynamic_rating(screw) if screw.dynamic_rating is None else screw.dynamic_rating


def static_rating(screw: ScrewParameters) -> float:
    """Static axial load rating C_0a of one nut [N]: that of the screw file, else computed."""
    return computed_static_rating(screw) if screw.static_rating is None else screw.static_rating


def computed_static_rating(screw: ScrewParameters) -> float:
    """Static axial load rating C_0a of one nut [N]: force at which its balls, equally loaded, reach STATIC_PRESSURE.

    Source       ISO 76 and ISO 3408-5, by the Hertz pressure that ISO 76 names for ball bearings; the closed formula of
                 ISO 3408-5 is not used. Catalogues differ by some tens of percent in their factors and conformities
    """

    def excess(ln_load: float) -> float:
        return math.log(ball_pressure(screw, math.exp(ln_load)) / STATIC_PRESSURE)

    load = math.exp(rising_root(excess, math.log(1e-3), math.log(1e9))[0])
    angle = float(contact_angle_at_ball_load(screw, load))
    return screw.loaded_ball_count * load * math.sin(angle) * math.cos(screw.lead_angle)


def ball_pressure(screw: ScrewParameters, load: float) -> float:
    """Hertz pressure [Pa] of a ball under a load [N] at its own contact angle, the larger one of both raceways."""
    angle = float(contact_angle_at_ball_load(screw, load))
    return max(float(ball_ellipse(screw, angle, raceway, load).p_max) for raceway in RACEWAYS)


def life(screw: ScrewParameters, force_a: float, force_b: float) -> float:
    """Nominal life L10 of the preloaded nut in turns, under constant axial forces [N]; infinite without force.

    Source       ISO 3408-5: L = (C_a/F)^3 1e6 of each nut, together (L_A^(-10/9) + L_B^(-10/9))^(-9/10)
    """
    rating = dynamic_rating(screw)
    spent = sum(((force / rating) ** LIFE_EXPONENT / 1e6) ** WEIBULL for force in (force_a, force_b))
    return math.inf if spent == 0.0 else float(spent ** (-1.0 / WEIBULL))
