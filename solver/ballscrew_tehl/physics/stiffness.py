"""Axial stiffness of the preloaded nut from the Hertz law of its contacts, bodies rigid; presliding.

Nut A and nut B are as in `load`: an axial load > 0 on the nut relieves A and loads B, and both share one rigid body.
With approach d of screw and nut at the balls of a nut, F = k d^(3/2) (nut_stiffness_constant). Preload P gives both the
approach d_0 = (P/k)^(2/3). A displacement x of the nut against the screw adds to one and takes from the other:

    F_A = k max(d_0 - x, 0)^(3/2),  F_B = k max(d_0 + x, 0)^(3/2),  load = F_B - F_A.

With oversize balls A and B are the two pairs of flanks, each with all balls, and d_0 is the oversize over
sin(beta) cos(lambda). Assumed: rigid bodies, equal loads of the balls, constant contact angle; the chain of `load`
assumes none of these. Bodies of the default sections make GD4008-3 at 2 kN up to 18 % softer.

Presliding: travel of rolling balls from rest to rolling, as an angle of the screw. Assumed: equal loads of the balls at
the contact angle without load, the mean half width along rolling of both raceways, pure rolling. The stiffness over the
angle is in runtime/nut_law.py.
"""

import math

import numpy as np

from ..numerics import rising_root
from ..parameters.file import ScrewParameters
from .ball_law import check_force, contact_compliance, preload_ball_load
from .hertz import RACEWAYS, ball_ellipse
from .kinematics import cage_speed


def nut_stiffness_constant(screw: ScrewParameters, contact_angle: float | None = None) -> float:
    """k of the axial force k d^(3/2) of one nut over its approach d [N/m^1.5] at an angle [rad], None: without load.

    Valid: constant contact angle. At the angle under its preload the stiffness of GD4008-3 at 2 kN is 1.2 % below that
    with an angle that follows the load, at the angle without load 3.7 %. Hertz, both contacts of a ball in series: Q =
    (sb d/C)^(3/2), F = n sb Q, sb = sin(beta) cos(lambda).
    """
    beta = screw.contact_angle if contact_angle is None else contact_angle
    sb = math.sin(beta) * math.cos(screw.lead_angle)
    return screw.loaded_ball_count * sb * (sb / contact_compliance(screw, beta)) ** 1.5


def preload_approach(stiffness: float, preload: float) -> float:
    """Approach d_0 of each nut under preload [N] alone [m], also the displacement at which the relieved nut is free."""
    check_force("preload", preload)
    return float(np.cbrt(preload / stiffness)) ** 2


def forces_of_displacement(stiffness: float, preload: float, deflection: float) -> tuple[float, float]:
    """Forces of nut A and nut B [N] at a displacement x of the nut against the screw [m], > 0 loads B."""
    d_0 = preload_approach(stiffness, preload)
    a, b = max(d_0 - deflection, 0.0), max(d_0 + deflection, 0.0)
    return stiffness * a * math.sqrt(a), stiffness * b * math.sqrt(b)


def axial_stiffness(stiffness: float, preload: float, deflection: float = 0.0) -> float:
    """d load/d x of the nut [N/m]; without load 3 k^(2/3) preload^(1/3), with the cube root of the preload."""
    force_a, force_b = forces_of_displacement(stiffness, preload, deflection)
    return float(1.5 * np.cbrt(stiffness) ** 2 * (np.cbrt(force_a) + np.cbrt(force_b)))


def axial_deflection(stiffness: float, preload: float, axial_load: float) -> float:
    """Displacement x of the nut against the screw under an axial load [m], inverse of forces_of_displacement."""
    check_force("axial_load", axial_load, allow_negative=True)
    d_0, load = preload_approach(stiffness, preload), abs(axial_load)
    # of the loaded nut alone: beyond separation
    x = float(np.cbrt(load / stiffness)) ** 2 - d_0
    if x < d_0:

        def excess(x: float) -> float:
            force_a, force_b = forces_of_displacement(stiffness, preload, x)
            return force_b - force_a - load

        x, _ = rising_root(excess, 0.0, d_0, 1e-15)
    return math.copysign(x, axial_load)


#: travel of a ball from rest to rolling over the contact half width along rolling: 2 to 4 (De Moerlooze & Al-Bender
#: 2008, rolling elements: about one contact length); moved to 2 or 4, the stiffness becomes 1.5 or 0.75 times as high
TRAVEL = 3.0


def contact_half_width(screw: ScrewParameters, force: float) -> float:
    """Hertz half width along rolling under the force of one nut [N], mean of both raceways [m]."""
    check_force("force", force)
    load = preload_ball_load(screw, force, screw.loaded_ball_count)
    contacts = (ball_ellipse(screw, screw.contact_angle, raceway, load) for raceway in RACEWAYS)
    return sum(float(contact.b) for contact in contacts) / len(RACEWAYS)


def ball_travel(screw: ScrewParameters, angle: float) -> float:
    """Path of a ball centre relative to the nut at a screw angle [rad], in pure rolling [m]."""
    return float(cage_speed(screw, angle)) * screw.nominal_radius


def presliding_angle(screw: ScrewParameters, force: float) -> float:
    """Coulomb torque over presliding stiffness [rad of the screw] under the force of one nut [N], >= 0.

    Half of the angle at which sliding is complete: from rest the torque follows the parabola Tc (1 - (1 - x/x_m)^2),
    whose slope at rest is 2 Tc/x_m (runtime/standstill.py). Travel of a ball: De Moerlooze & Al-Bender, Adv. Tribol.
    2008, 561280 (balls in V-grooved tracks).
    """
    return 0.5 * TRAVEL * contact_half_width(screw, force) / ball_travel(screw, 1.0)
