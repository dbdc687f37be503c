"""Closed formulas of the film thickness, its thermal reduction and the load on asperities; x: rolling direction."""

from typing import Any, NamedTuple

import numpy as np

from ..parameters.file import LubricantParameters, Parameters
from .ball_law import Array, contact_angle_at_ball_load
from .hertz import E_prime as reduced_modulus
from .hertz import ball_ellipse, reduced_radii
from .kinematics import surface_speeds
from .lubricant import eta0, pressure_viscosity, relative_density, temperature_slope

#: film [m] below which oil is no continuum
MIN_FILM = 1e-9
#: film over the ball radius above which a film is beyond lubrication theory
THICKEST_FILM = 0.1


class FilmGroups(NamedTuple):
    """Dimensionless groups: Hamrock-Dowson U, W, G and Moes M = W (2U)^(-3/4), L = G (2U)^(1/4)."""

    U: Any
    W: Any
    G: Any
    M: Any
    L: Any


def film_groups(load: Any, u_e: Any, R_x: Any, E_prime: Any, eta0: Any, alpha_pv: Any) -> FilmGroups:
    """Dimensionless groups of load [N], u_e [m/s], R_x [m], E_prime [Pa], eta0 [Pa s], alpha_pv [1/Pa]; broadcast.

    Source       U = eta0 u_e/(E' R_x), W = F/(E' R_x^2), G = alpha E' (Hamrock & Dowson 1977); Moes 1992
    """
    U, W, G = eta0 * u_e / (E_prime * R_x), load / (E_prime * R_x**2), alpha_pv * E_prime
    return FilmGroups(U, W, G, W * (2.0 * U) ** -0.75, G * (2.0 * U) ** 0.25)


def moes_groups(
    lub: LubricantParameters, load: Any, u_e: Any, R_x: Any, E_prime: float, temperature: Any
) -> FilmGroups:
    """film_groups of a contact with an oil by its laws at a temperature [K]."""
    return film_groups(load, u_e, R_x, E_prime, eta0(lub, temperature), pressure_viscosity(lub, temperature))


def nijenbanning_venner_moes(M: Any, L: Any, radius_ratio: Any) -> Any:
    """Central film H_c = (h/R_x) (2U)^(-1/2) over all four regimes, incompressible oil; radius_ratio: R_x/R_y <= 1.

    Validity     isothermal, flooded, Barus; against independent solutions of the Reynolds equation within 4 %
                 for the circle and 0 to +9 % for ellipses (+12 % at ratio 0.035, M = 200), up to M = 3e4
    Source       Nijenbanning, Venner & Moes, Wear 176 (1994) 217
    """
    lam = np.asarray(radius_ratio, dtype=float)
    shape = 1.0 + 0.006 * np.log(lam) + 0.63 * lam ** (4.0 / 7.0)
    H_RI = 145.0 * (1.0 + 0.796 * lam ** (14.0 / 15.0)) ** (-15.0 / 7.0) / (lam * np.asarray(M) ** 2)
    H_RP = 1.29 * (1.0 + 0.691 * lam) ** (-2.0 / 3.0) * np.asarray(L) ** (2.0 / 3.0)
    H_EI = 3.18 * shape ** (-14.0 / 25.0) * lam ** (-1.0 / 15.0) * np.asarray(M) ** (-2.0 / 15.0)
    H_EP = 1.48 * shape ** (-7.0 / 20.0) * lam ** (-1.0 / 24.0) * np.asarray(M) ** (-1.0 / 12.0)
    H_EP = H_EP * np.asarray(L) ** 0.75
    H_00 = 1.8 / lam
    s = 1.5 * (1.0 + np.exp(-1.2 * H_EI / H_RI))
    iso = H_RI**1.5 + (H_EI**-4.0 + H_00**-4.0) ** -0.375
    return (iso ** (2.0 * s / 3.0) + (H_RP**-8.0 + H_EP**-8.0) ** (-s / 8.0)) ** (1.0 / s)


def central_film_estimate(
    lub: LubricantParameters, groups: FilmGroups, R_x: Any, R_y: Any, p_max: Any, temperature: Any
) -> Any:
    """Central film [m] by nijenbanning_venner_moes, isothermal, of a compressible oil; R_x, R_y [m], p_max [Pa].

    Source       Venner & Bos, Wear 173 (1994) 151: mass flow is kept, the density at the centre sets the film
    """
    H_c = nijenbanning_venner_moes(groups.M, groups.L, R_x / R_y)
    return H_c * R_x * np.sqrt(2.0 * groups.U) / relative_density(lub.density_law, p_max)


def thermal_load_parameter(lub: LubricantParameters, u_e: Any, temperature: Any) -> Any:
    """N = eta0 beta u_e^2/k_oil of the thermal factors, beta = -d ln(eta0)/dT.

    Parameters   u_e : float or array [m/s];  temperature : float or array [K], inlet
    Returns      N, dimensionless, >= 0
    Source       Murch & Wilson 1975; Wilson & Sheu 1983
    """
    slope = temperature_slope(lub, temperature)
    return -eta0(lub, temperature) * slope * np.asarray(u_e) ** 2 / lub.thermal_conductivity


def wilson_sheu(N: Any, srr: Any) -> Any:
    """Thermal reduction of the film with sliding: 1/(1 + 0.241 (1 + 14.8 Z^0.83) N^0.64), Z = |srr|/2.

    Parameters   N : float or array, >= 0;  srr : float or array, slide-to-roll ratio (u_1-u_2)/u_e
    Returns      factor, 0 to 1
    Source       Wilson & Sheu, J Lubr Technol 105 (1983) 187, Z = |u_1-u_2|/(u_1+u_2)
    """
    return 1.0 / (1.0 + 0.241 * (1.0 + 14.8 * (0.5 * np.abs(srr)) ** 0.83) * np.asarray(N) ** 0.64)


def asperity_share(film: Any, sigma: float, film_ratio: float) -> Any:
    """Share exp(-(h/(L_0 sigma))^2) of the load on asperities; film: h, central film of the smooth contact [m], > 0.

    sigma : composite rms roughness [m], >= 0;  film_ratio : L_0, h/sigma where 1/e of the load is on asperities
    Source       form: assumption, between the sources. At h/sigma = 0.5 Greenwood & Tripp (1970) give 0.03 (L_0 0.27),
                 Balan et al. (2015), Eq. A2, 0.33 (0.475), the mixed-film weighting factor of SKF with sigma = 0.2 um
                 0.39 (0.5), at eight bearings exp(-1.4 (h/sigma)^1.7) within a factor 1.5 (0.85)
    """
    if sigma == 0.0:
        return np.zeros(np.shape(film))[()]
    return np.exp(-((np.asarray(film) / (film_ratio * sigma)) ** 2))


def moes_groups_of(parameters: Parameters, raceway: str, load: Array, speed: Any, temperature: Any) -> Any:
    """FilmGroups, R_x and R_y [m] of a ball with its own contact angle; load, speed and temperature broadcast."""
    screw = parameters.screw
    R_x, R_y = reduced_radii(screw, contact_angle_at_ball_load(screw, load), raceway)
    u_e = surface_speeds(parameters, raceway, speed).u_e
    return moes_groups(parameters.lubricant, load, u_e, R_x, reduced_modulus(screw), temperature), R_x, R_y


def film_formula(parameters: Parameters, raceway: str, load: Array, speed: Any, temperature: Any) -> Array:
    """Closed film formula that the samples are divided by [m]; load, speed and temperature broadcast."""
    groups, R_x, R_y = moes_groups_of(parameters, raceway, load, speed, temperature)
    # the pressure that compresses the oil varies little with the contact angle: that of the drawing
    p_max = ball_ellipse(parameters.screw, parameters.screw.contact_angle, raceway, load).p_max
    return np.asarray(central_film_estimate(parameters.lubricant, groups, R_x, R_y, p_max, temperature))
