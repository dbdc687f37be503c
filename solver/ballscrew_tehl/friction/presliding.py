"""Presliding of rolling balls: travel from rest to rolling, as an angle of the screw.

Assumptions: all balls of a nut carry the same load at the contact angle without load; the contact half width along
rolling is the mean of both raceways; pure rolling. The stiffness over the angle is in runtime/nut_law.py.
"""

from ..parameters.screw import ScrewParameters
from ..physics.ball_law import check_force, preload_ball_load
from ..physics.hertz import RACEWAYS, ball_ellipse
from ..physics.kinematics import cage_speed

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
