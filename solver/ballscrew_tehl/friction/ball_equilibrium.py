"""Motion of a ball between its raceways, and the power that slip and spin cost: the minimum of a convex potential.

Each contact slides as its motion says (physics.ball_motion), with Heathcote's parabola and spin over a Hertz-shaped
pressure; the shear stress follows the local slip:
tau = (1-f) min(tau_0 asinh(eta v/(h tau_0)), Lambda p) + f mu_b p, with the share f of the asperities.
tau is the derivative of a convex potential with respect to the slip v, so the forces and moments of the contacts
on the ball vanish where the integral of the potential over all contacts is least. The motion there is unique.
Where oil or asperities stick, the potential has a kink: v is smoothed over 1e-6 of the entrainment speed
(equilibrium_kernels), which moves the power by less than 2e-6 of it (1000 random balls; the smoothing a hundredth).

Assumption: no other force on the ball. What drives it against rolling resistance, hysteresis and its neighbours is a
small part of what the contacts can transmit, its inertia less.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..physics.ball_law import Array
from ..physics.ball_motion import ContactMotion, rolling_motion
from .equilibrium_kernels import AROUND, MOST_STEPS, RADIAL, Motion, equilibria


class BallMotion(NamedTuple):
    """Equilibrium of n balls: power of each contact (n, c) [W], motion q (n, 4) [rad/s], its steps (n,)."""

    power: Array
    motion: Array
    steps: NDArray[np.int64]


class Traction(NamedTuple):
    """What the shear stress of the contacts follows from.

    viscosity (n, c, RADIAL) [Pa s] at the radial nodes; pressure (n, c): largest [Pa]; film (n, c) [m]; asperities
    (n, c): their share of the load; tau_0 [Pa], limiting: Lambda [1], boundary: mu_b [1].
    """

    viscosity: Array
    pressure: Array
    film: Array
    asperities: Array
    tau_0: float
    limiting: float
    boundary: float


def radial_nodes() -> tuple[Array, Array]:
    """Radius of the nodes over the semi-axes, and weights with which the sum around is the mean over the ellipse."""
    x, w = np.polynomial.legendre.leggauss(RADIAL)
    r = 0.5 * (x + 1.0)
    return r, w * r / AROUND


def ball_equilibrium(motion: ContactMotion, speed: Array, axes: Array, traction: Traction) -> BallMotion:
    """Motion and power of balls.

    Parameters   motion : of the c contacts;  speed : of the screw (n,) [rad/s], > 0
                 axes : semi-axes of the pressure across and along rolling (n, c, 2) [m]
    Raises       ArithmeticError: a ball whose equilibrium was not found
    """
    first = rolling_motion(motion)
    radius, weight = radial_nodes()
    moved = Motion(motion.matrix, motion.offset, motion.differential)
    power, q, steps = equilibria(moved, np.asarray(speed, dtype=float), axes, traction, radius, weight, first)
    known = (steps >= 0) & np.isfinite(power).all(axis=1)
    if not known.all():
        bad = int(np.argmin(known))
        raise ArithmeticError(
            f"equilibrium of a ball not found in {MOST_STEPS} steps: speed {speed[bad]:.6g} rad/s, pressure "
            f"{traction.pressure[bad].max():.4g} Pa, film {traction.film[bad].min():.4g} m"
        )
    return BallMotion(power, q, steps)
