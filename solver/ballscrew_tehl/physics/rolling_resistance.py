"""Closed formulas of the hydrodynamic rolling resistance: what the oil costs in pure rolling.

F_R is the force on ONE surface, int (h/2) dp/dx dA, x along the flow: the oil brakes both surfaces alike. The power
lost is W = u_e int h dp/dx dA = 2 u_e F_R (Biboulet & Houpert, Proc IMechE J 224 (2010) 765, Eq. (45) and conclusion),
for any contact area: in a film that keeps its mass without compression, by Green's theorem and Reynolds' equation, it
equals the dissipation int h^3 |grad p|^2/(12 eta) dA (part 2 of the paper assumes it, Eq. (37)). The moment of the
papers is F_R R_x. Groups as in film.py: U and W with the mean speed u_e; the papers' U is 2U.
"""

from typing import Any

import numpy as np

from .hertz import ellipse

#: film [m] between neighbouring balls, which are pressed together lightly; 0.1 to 10 um move the drag by 30 %
NEIGHBOUR_FILM = 1e-6

#: load parameter at which half of the transition of an elliptical contact is passed
_TRANSITION = 6.6


def biboulet_houpert_point(load: Any, u_e: Any, R_x: Any, R_y: Any, E_prime: float, eta0: Any) -> Any:
    """Rolling resistance on one surface [N] of an elliptical contact, rigid isoviscous to elastic, fully flooded.

    Of load [N], u_e [m/s], R_x <= R_y along and across rolling [m], E_prime [Pa], eta0 [Pa s], all > 0, broadcast. The
    transition is at M = beta^(1/4) kappa W (2U)^(-3/4).

    Validity     isothermal, Newtonian, Barus, oil to x = -R_x (rigid) or about -10 b (elastic) and far to the sides;
                 L 4 to 16, M 0.2 to 800, b/a 1/60 to 1.  The rigid limit is -13 to +24 % off a direct solution of
                 Reynolds' equation for R_y/R_x 1 to 28 and h_0/R_x 1e-5 to 1e-3
    Source       Biboulet & Houpert, Proc IMechE J 224 (2010) 777, Eqs. (14), (30) to (32) [read]; the same constants
                 in an open ball screw program.  Second print: Balan, Houpert, Tufescu & Olaru, Lubricants 3 (2015)
                 222, Eqs. (1) to (4), as powers of R_y/R_x (compared in the test)
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

    K_rs : 3e-8 low oil bath or oil jet, 6e-8 grease or oil-air, 0 flooded;  K_z : 4.4 for single-row angular contact
    Source       SKF rolling bearings catalogue, kinematic replenishment/starvation factor [from two programs that code
                 it]
    """
    lengths = (bore_mm + outer_mm) * np.sqrt(K_z / (2.0 * (outer_mm - bore_mm)))
    return np.exp(-K_rs * np.asarray(viscosity_mm2_s) * np.asarray(speed_rpm) * lengths)


def neighbour_drag_power(radius: float, sliding_speed: Any, eta0: Any) -> Any:
    """Power [W] that full oil in the gap between two neighbouring balls takes, which slide past each other.

    Parameters   radius : of a ball [m];  sliding_speed : of their surfaces [m/s];  eta0 [Pa s]; float or array
    Returns      pi eta0 r ln(r/h) v^2 with h = NEIGHBOUR_FILM, broadcast
    Validity     leading order of a narrow gap; without its own heat, and full of oil: an upper estimate where that is
                 short or aerated
    Source       Jeffrey & Onishi, J Fluid Mech 139 (1984) 261, resistance of two equal spheres to shear
    """
    return np.pi * np.asarray(eta0) * radius * np.log(radius / NEIGHBOUR_FILM) * np.square(sliding_speed)
