"""One ball between two grooves: compliance, contact angle under load, axial force over axial approach."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..numerics import Array, rising_root
from ..parameters.file import FOUR_POINT, ScrewParameters
from .hertz import RACEWAYS, ball_ellipse

#: axial approach [m] -> axial force [N], its slope [N/m], normal load [N]
BallLaw = Callable[[Array], tuple[Array, Array, Array]]


def contact_compliance(screw: ScrewParameters, contact_angle: float | None = None) -> float:
    """C of the approach C Q^(2/3) of both contacts of a ball in series [m/N^(2/3)] at an angle, None: without load."""
    angle = screw.contact_angle if contact_angle is None else contact_angle
    return sum(float(ball_ellipse(screw, angle, raceway, 1.0).delta) for raceway in RACEWAYS)


def groove_distance(screw: ScrewParameters) -> float:
    """A0, distance of the groove centres with touching unloaded balls, no clearance [m]."""
    return screw.screw_raceway_radius + screw.nut_raceway_radius - screw.ball_diameter


def check_force(name: str, value: Any, allow_negative: bool = False) -> None:
    """Raise ValueError for a force that is not finite or has the wrong sign."""
    if not np.all(np.isfinite(value) & (allow_negative | (np.asarray(value) >= 0.0))):
        needs = "finite" if allow_negative else "finite, >= 0"
        raise ValueError(f"{name} = {value} N; needs {needs}: check the sign and the preload")


def contact_angle_at_ball_load(screw: ScrewParameters, ball_load: Any) -> Any:
    """Contact angle [rad] of a ball under its load [N], >= 0, float or array.

    Valid: no clearance, radial distance of the groove centres kept. cos(beta) = cos(beta0)/(1 + C Q^(2/3)/A0), Harris,
    Rolling Bearing Analysis. A ball that is squeezed by four flanks stays in their middle: beta0 at every preload.
    """
    check_force("ball_load", ball_load)
    if screw.preload_kind == FOUR_POINT:
        return screw.contact_angle + 0.0 * np.asarray(ball_load, dtype=float)
    stretch = contact_compliance(screw) * np.cbrt(ball_load) ** 2 / groove_distance(screw)
    return np.arccos(math.cos(screw.contact_angle) / (1.0 + stretch))


def loaded_contact_angle(screw: ScrewParameters, force: float, ball_count: int) -> float:
    """Contact angle of a nut whose balls carry equal parts of an axial force.

    Parameters
    ----------
    screw : ScrewParameters
        Geometry.
    force : float
        Axial force of the nut [N], >= 0.
    ball_count : int
        Balls that carry load.

    Returns
    -------
    float
        Contact angle [rad].

    Raises
    ------
    ValueError
        Force not finite or negative.

    Notes
    -----
    cos(beta) = cos(beta0)/(1 + C Q^(2/3)/A0) with Q = F/(n sin(beta) cos(lambda)), no clearance, radial distance of the
    groove centres constant; Harris, Rolling Bearing Analysis. Oversize balls keep beta0.

    Examples
    --------
    >>> import math
    >>> from ballscrew_tehl import load_screw
    >>> screw = load_screw().screw
    >>> f"{math.degrees(loaded_contact_angle(screw, 2000.0, screw.ball_count)):.2f} deg"
    '45.81 deg'
    """
    check_force("force", force)
    beta_0, per_ball = screw.contact_angle, force / (ball_count * math.cos(screw.lead_angle))
    if screw.preload_kind == FOUR_POINT:
        return beta_0
    k = contact_compliance(screw) * math.cbrt(per_ball) ** 2 / groove_distance(screw)

    def excess(beta: float) -> float:
        return math.cos(beta_0) - math.cos(beta) * (1.0 + k * math.cbrt(math.sin(beta)) ** -2)

    return rising_root(excess, beta_0, 0.5 * math.pi, 1e-15)[0]


def preload_ball_load(screw: ScrewParameters, force: Any, ball_count: int) -> Any:
    """Equal load of all balls on one pair of flanks, F/(n sin(beta) cos(lambda)) [N], at the angle without load."""
    return force / (ball_count * math.sin(screw.contact_angle) * math.cos(screw.lead_angle))


def flank_law(screw: ScrewParameters, oversize: float = 0.0) -> BallLaw:
    """Force of a ball between two flanks over the axial displacement of the nut towards it, each at its own angle.

    The ball has an oversize [m] over that which just touches the flanks if they are one of two pairs. The contacts of a
    pair lie on one line through its centre: they are in series, and their approach is oversize plus the displacement
    along that line, wherever the ball is between the other two. It joins the groove centres, A0 + oversize apart
    without load.
    """
    cos_lead, a_0 = math.cos(screw.lead_angle), groove_distance(screw)
    beta, c = screw.contact_angle, contact_compliance(screw)
    x, y_0 = (a_0 + oversize) * math.cos(beta), (a_0 + oversize) * math.sin(beta)

    def law(d: Array) -> tuple[Array, Array, Array]:
        # beyond -y_0 the line would turn over
        u = np.maximum(cos_lead * np.asarray(d, dtype=float), -y_0)
        length = np.hypot(x, y_0 + u)
        sin = (y_0 + u) / length
        # length - A0 without cancellation
        approach = oversize + u * (2.0 * y_0 + u) / (length + a_0 + oversize)
        ratio = np.maximum(approach, 0.0) / c
        root = np.sqrt(ratio)
        Q = ratio * root
        return cos_lead * sin * Q, cos_lead**2 * (1.5 * root / c * sin**2 + Q * (x / length) ** 2 / length), Q

    return law


def largest_oversize(screw: ScrewParameters) -> float:
    """Oversize of balls [m] from which on no axial displacement frees them from two of their flanks."""
    return groove_distance(screw) * (1.0 / math.cos(screw.contact_angle) - 1.0)


def flank_travel(screw: ScrewParameters, oversize: float) -> float:
    """Axial displacement [m] at which the relieved flanks leave a ball with an oversize [m] that is not too large."""
    beta, a_0 = screw.contact_angle, groove_distance(screw)
    x, y_0 = (a_0 + oversize) * math.cos(beta), (a_0 + oversize) * math.sin(beta)
    if not x < a_0:
        raise ValueError(
            f"oversize = {oversize:.3g} m; allowed: < {largest_oversize(screw):.3g} m: the preload is beyond these "
            "grooves"
        )
    return (y_0 - math.sqrt(a_0**2 - x**2)) / math.cos(screw.lead_angle)
