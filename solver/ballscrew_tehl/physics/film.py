"""Closed formulas of a film: thickness, thermal reduction, load on asperities, rolling resistance, supply of oil.

x is the rolling direction. Rolling resistance: F_R is the force on ONE surface, int (h/2) dp/dx dA: the oil brakes both
surfaces alike. The power lost is W = u_e int h dp/dx dA = 2 u_e F_R (Biboulet & Houpert, Proc IMechE J 224 (2010) 765,
Eq. (45) and conclusion), for any contact area: in a film that keeps its mass without compression, by Green's theorem
and Reynolds' equation, it equals the dissipation int h^3 |grad p|^2/(12 eta) dA (part 2 of the paper assumes it, Eq.
(37)). The moment of the papers is F_R R_x; their U is 2U.

Supply: what a rolling contact loses where oil begins a stated length before it. The flooded loss is that of oil as far
as R_x before the contact. Lengths along rolling are in Hertz half-widths b.
"""

from typing import Any, NamedTuple

import numpy as np

from ..numerics import Array
from ..parameters.file import LubricantParameters, Parameters
from .ball_law import contact_angle_at_ball_load
from .hertz import E_prime as reduced_modulus
from .hertz import ball_ellipse, ellipse, reduced_radii
from .kinematics import surface_speeds
from .lubricant import eta0, pressure_viscosity, relative_density, temperature_slope

#: film [m] below which oil is no continuum
MIN_FILM = 1e-9
#: film over the ball radius above which a film is beyond lubrication theory
THICKEST_FILM = 0.1


class FilmGroups(NamedTuple):
    """Dimensionless groups of an elliptical contact.

    Attributes
    ----------
    U, W, G : float or array
        Speed, load and material parameter of Hamrock and Dowson.
    M, L : float or array
        Load and lubricant parameter of Moes, M = W (2U)^(-3/4), L = G (2U)^(1/4).
    """

    U: Any
    W: Any
    G: Any
    M: Any
    L: Any


def film_groups(load: Any, u_e: Any, R_x: Any, E_prime: Any, eta0: Any, alpha_pv: Any) -> FilmGroups:
    """Dimensionless groups of Hamrock and Dowson and of Moes; the arguments broadcast.

    Parameters
    ----------
    load : float or array
        Load [N].
    u_e : float or array
        Entrainment speed [m/s].
    R_x : float or array
        Reduced radius along rolling [m].
    E_prime : float or array
        Reduced modulus 2/sum((1-nu^2)/E) [Pa].
    eta0 : float or array
        Viscosity at ambient pressure [Pa s].
    alpha_pv : float or array
        Pressure-viscosity coefficient [1/Pa].

    Returns
    -------
    FilmGroups
        U = eta0 u_e/(E' R_x), W = F/(E' R_x^2), G = alpha E', M, L.

    Notes
    -----
    Hamrock & Dowson 1977; Moes 1992.

    Examples
    --------
    >>> groups = film_groups(100.0, 1.0, 2e-3, 226e9, 0.1, 2e-8)
    >>> f"M = {groups.M:.0f}, L = {groups.L:.1f}"
    'M = 1147, L = 20.7'
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

    Valid: isothermal, flooded, Barus; against independent solutions of the Reynolds equation within 4 % for the circle
    and 0 to +9 % for ellipses (+12 % at ratio 0.035, M = 200), up to M = 3e4. Nijenbanning, Venner & Moes, Wear 176
    (1994) 217.
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
    """Central film of a compressible oil by the formula of Nijenbanning, Venner and Moes, without heat.

    Parameters
    ----------
    lub : LubricantParameters
        Oil; its density law is taken.
    groups : FilmGroups
        Dimensionless groups of the contact.
    R_x, R_y : float or array
        Reduced radii along and across rolling [m], R_x <= R_y.
    p_max : float or array
        Hertz pressure [Pa].
    temperature : float or array
        Temperature [K]; not used by the density laws.

    Returns
    -------
    float or array
        Central film thickness [m].

    Notes
    -----
    Isothermal, flooded. Venner & Bos, Wear 173 (1994) 151: the mass flow is conserved, so that the density at the
    centre sets the film.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> groups = film_groups(100.0, 1.0, 2e-3, 226e9, 0.1, 2e-8)
    >>> film = central_film_estimate(load_screw().lubricant, groups, 2e-3, 2e-2, 2e9, 303.15)
    >>> f"{1e6 * film:.2f} um"
    '0.28 um'
    """
    H_c = nijenbanning_venner_moes(groups.M, groups.L, R_x / R_y)
    return H_c * R_x * np.sqrt(2.0 * groups.U) / relative_density(lub.density_law, p_max)


def thermal_load_parameter(lub: LubricantParameters, u_e: Any, temperature: Any) -> Any:
    """Thermal load parameter N = eta0 beta u_e^2/k_oil of film reductions, beta = -d ln(eta0)/dT.

    Parameters
    ----------
    lub : LubricantParameters
        Oil.
    u_e : float or array
        Entrainment speed [m/s].
    temperature : float or array
        Temperature of the inlet [K].

    Returns
    -------
    float or array
        N, dimensionless, >= 0.

    Notes
    -----
    Murch & Wilson 1975; Wilson & Sheu 1983.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> f"{thermal_load_parameter(load_screw().lubricant, 1.0, 303.15):.3f}"
    '0.017'
    """
    slope = temperature_slope(lub, temperature)
    return -eta0(lub, temperature) * slope * np.asarray(u_e) ** 2 / lub.thermal_conductivity


def wilson_sheu(N: Any, srr: Any) -> Any:
    """Thermal reduction of a film with sliding after Wilson and Sheu.

    Parameters
    ----------
    N : float or array
        Thermal load parameter, >= 0.
    srr : float or array
        Slide-to-roll ratio (u_1-u_2)/u_e.

    Returns
    -------
    float or array
        Factor on the isothermal film, 0 to 1.

    Notes
    -----
    1/(1 + 0.241 (1 + 14.8 Z^0.83) N^0.64) with Z = |u_1-u_2|/(u_1+u_2) = |srr|/2. Wilson & Sheu, J Lubr Technol 105
    (1983) 187.

    Examples
    --------
    >>> f"{wilson_sheu(1.0, 0.0):.3f} {wilson_sheu(1.0, 0.5):.3f}"
    '0.806 0.422'
    """
    return 1.0 / (1.0 + 0.241 * (1.0 + 14.8 * (0.5 * np.abs(srr)) ** 0.83) * np.asarray(N) ** 0.64)


def asperity_share(film: Any, sigma: float, film_ratio: float) -> Any:
    """Fraction exp(-(h/(L_0 sigma))^2) of the load on asperities; film: h, central film of the smooth contact [m], > 0.

    sigma: composite rms roughness [m], >= 0; film_ratio: L_0, h/sigma where 1/e of the load is on asperities. Form:
    assumption, between the sources. At h/sigma = 0.5 Greenwood & Tripp (1970) give 0.03 (L_0 0.27), Balan et al.
    (2015), Eq. A2, 0.33 (0.475), the mixed-film weighting factor of SKF with sigma = 0.2 um 0.39 (0.5), at eight
    bearings exp(-1.4 (h/sigma)^1.7) within a factor 1.5 (0.85).
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


#: film [m] between neighbouring balls, which are pressed together lightly; 0.1 to 10 um move the drag by 30 %
NEIGHBOUR_FILM = 1e-6


#: load parameter at which half of the transition of an elliptical contact is passed
_TRANSITION = 6.6


def biboulet_houpert_point(load: Any, u_e: Any, R_x: Any, R_y: Any, E_prime: float, eta0: Any) -> Any:
    """Rolling resistance on one surface [N] of an elliptical contact, rigid isoviscous to elastic, fully flooded.

    Of load [N], u_e [m/s], R_x <= R_y along and across rolling [m], E_prime [Pa], eta0 [Pa s], all > 0, broadcast. The
    transition is at M = beta^(1/4) kappa W (2U)^(-3/4). Valid: isothermal, Newtonian, Barus, oil to x = -R_x (rigid)
    or about -10 b (elastic) and far to the sides; L 4 to 16, M 0.2 to 800, b/a 1/60 to 1. The rigid limit is -13 to
    +24 % off a direct solution of Reynolds' equation for R_y/R_x 1 to 28 and h_0/R_x 1e-5 to 1e-3. Biboulet & Houpert,
    Proc IMechE J 224 (2010) 777, Eqs. (14), (30) to (32) [read]; the same constants in an open ball screw program.
    Second print: Balan, Houpert, Tufescu & Olaru, Lubricants 3 (2015) 222, Eqs. (1) to (4), as powers of R_y/R_x
    (compared in the test).
    """
    contact = ellipse(load, R_x, R_y, E_prime)
    U, W = 2.0 * np.asarray(eta0) * u_e / (E_prime * R_x), np.asarray(load) / (E_prime * R_x**2)
    kappa, beta = contact.b / contact.a, contact.b * E_prime / (np.pi * contact.p_max * R_x)
    M, length = beta**0.25 * kappa * W * U**-0.75, 2.0 * contact.a / R_x
    scale = E_prime * R_x**2
    rigid = 0.77 * scale * beta ** (-1.0 / 3.0) * kappa**0.12 * length * U ** (2.0 / 3.0)
    elastic = 1.8 * scale * beta**-0.25 * length * U**0.75
    return (rigid - elastic) / (1.0 + M / _TRANSITION) + elastic


def replenishment_factor(
    K_rs: float, K_z: float, speed_rpm: Any, viscosity_mm2_s: Any, bore_mm: float, outer_mm: float
) -> Any:
    """Reduction exp(-K_rs nu n (d + D) sqrt(K_z/(2 (D - d)))) of the rolling resistance where oil flows back too late.

    K_rs: 3e-8 low oil bath or oil jet, 6e-8 grease or oil-air, 0 flooded; K_z: 4.4 for single-row angular contact. SKF
    rolling bearings catalogue, kinematic replenishment/starvation factor [from two programs that code it].
    """
    lengths = (bore_mm + outer_mm) * np.sqrt(K_z / (2.0 * (outer_mm - bore_mm)))
    return np.exp(-K_rs * np.asarray(viscosity_mm2_s) * np.asarray(speed_rpm) * lengths)


def neighbour_drag_power(radius: float, sliding_speed: Any, eta0: Any) -> Any:
    """Power [W] that full oil in the gap between two neighbouring balls takes, which slide past each other.

    radius: of a ball [m]; sliding_speed: of their surfaces [m/s]; eta0 [Pa s]; float or array. Returns pi eta0 r
    ln(r/h) v^2 with h = NEIGHBOUR_FILM, broadcast. Valid: leading order of a narrow gap; without its heat, and
    full of oil: an upper estimate where that is short or aerated. Jeffrey & Onishi, J Fluid Mech 139 (1984) 261,
    resistance of two equal spheres to shear.
    """
    return np.pi * np.asarray(eta0) * radius * np.log(radius / NEIGHBOUR_FILM) * np.square(sliding_speed)


#: supply length of a flooded contact
FLOODED = np.inf


#: Gauss nodes along and across rolling of the inlet that holds no oil: 2e-4 of its loss
ALONG, ACROSS = (tuple(0.5 * v for v in np.polynomial.legendre.leggauss(n)) for n in (5, 8))


#: least factor: maps store logarithms
LEAST_FACTOR = 1e-4


#: film over the gap where oil begins at which the missing loss fades: its wedge is there no longer. At 1 the torque of
#: the packaged screw falls with preload in cold fast oil; chosen on the seven solves below, where 2 to 5 differ little
FADES = 3.0


def hertz_gap(length: Any, b: Any, R_x: Any) -> Any:
    """Gap of the flattened bodies [m] a length [b] >= 1 before the middle of a Hertz contact, across from it.

    Line contact, Johnson, Contact Mechanics (1985), Eq. 4.44 with 4.22: within 2 % of the exact one of ellipses with a
    >= 4 b.
    """
    root = np.sqrt(length**2 - 1.0)
    return 0.5 * b**2 / R_x * (length * root - np.log(length + root))


def missing_loss(length: float, u_e: Any, eta0: Any, film: Any, b: Any, R_x: Any, R_y: Any) -> Array:
    """Loss [W] of the oil that a flooded contact has between R_x and the supply length [b] before it, without heat.

    Derived: with the pressure p = c |x|/h^2 of a wide inlet, c = 12 eta0 u_e/(3 + 2 R_x/R_y)
    (contact.result.resistance_beyond), u_e int h dp/dx dA over X < -x < R_x, |y| < R_x. Gap h: parabolas above the
    flattened bodies at X.
    """
    (t, along), (s, across) = ALONG, ACROSS
    u_e, eta0, film, b, R_x, R_y = (
        np.asarray(v, float)[..., None, None] for v in (u_e, eta0, film, b, R_x, R_y)
    )
    X = np.minimum(length * b, R_x)
    t, s = (t + 0.5)[:, None], s + 0.5
    x, y = X * (R_x / X) ** t, R_x * s**2
    h = 0.5 * (x**2 - X**2) / R_x + 0.5 * y**2 / R_y + film + hertz_gap(X / b, b, R_x)
    area = along[:, None] * x * np.log(R_x / X) * across * 4.0 * R_x * s
    c = 12.0 * eta0 * u_e / (3.0 + 2.0 * R_x / R_y)
    return np.asarray((u_e * c * (2.0 * x**2 / (R_x * h**2) - 1.0 / h) * area).sum(axis=(-2, -1)))


def supply_factor(
    length: float, load: Any, loss: Any, u_e: Any, eta0: Any, film: Any, b: Any, R_x: Any, R_y: Any
) -> Any:
    """Rolling loss with oil from a supply length [b], >= 2, on, over the flooded one with heat [W].

    (1 - q/3)^3, at least LEAST_FACTOR, with q = missing_loss/loss/(1 + (film/(FADES hertz_gap))^2); joined by a fourth
    power with its limit in films above the gap where oil begins, X before the middle: there the load [N] acts about
    X/3 before the middle, load u_e X/(3 R_x). u_e [m/s], eta0 [Pa s] and central film [m] are those of the inlet.
    Valid: 19 thermal solves with that inlet, M 53 to 24,000: mean and largest error of the loss 0 and 13 % at 6 b, -1
    and 6 % at 10 b, +10 and 61 % at 3 b (light hot contacts). Seven, M 2.8 to 37: -8 to 14 % at 6 b, -28 to 4 % at 10
    b; 14 to 15 % too high where the film is 0.15 of the gap. The cube and the join are assumptions of form, compared
    with these solves.
    """
    if length == FLOODED:
        return np.ones(np.broadcast(load, loss, u_e, eta0, film, b, R_x, R_y).shape)[()]
    X = np.minimum(length, R_x / b)
    thick = film / (FADES * hertz_gap(X, b, R_x))
    missing = missing_loss(length, u_e, eta0, film, b, R_x, R_y) / (1.0 + thick**2)
    factor = np.maximum(1.0 - missing / (3.0 * np.asarray(loss)), LEAST_FACTOR ** (1.0 / 3.0)) ** 3
    limit = load * u_e * X * b / (3.0 * R_x * loss)
    return factor / (1.0 + (factor / limit) ** 4) ** 0.25
