"""Surface speeds of ball and raceway by the two laws; how a ball slides and spins for any attitude.

Those of `three_parameter` reproduce the paper, in the fixed frame; those of `mechanistic`, in a frame that turns with
the ball, are the physical ones, whose films are shown with both laws: entrainment is nearly equal on both raceways, and
what slides is differential slip and spin, see contact_motion (Lu et al., Machines 10(3) (2022) 203; Harris, Rolling
Bearing Analysis, in the limit of zero lead).

contact_motion: rigid-body kinematics on the exact helix. The frame moves along the helix with the ball centre: e_r away
from the screw axis, e_t along the helix, e_b = e_r x e_t. A raceway turns about the screw axis, with w - w_c (screw) or
-w_c (nut), and slides along itself; the ball turns with w_b. The motion of the ball, q = (w_c, w_b), is unknown: its
equilibrium gives it (friction.ball_equilibrium). Contact frame: x along rolling at positive speed, z along the normal
from raceway to ball, y = z cross x; slip and spin are those of the raceway against the ball.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..numerics import Array
from ..parameters.file import Law, Parameters, ScrewParameters
from ..parameters.screw import FOUR_POINT
from .hertz import RACEWAYS, raceway_sign, reduced_radii


class ContactSpeeds(NamedTuple):
    """Surface speeds of one contact.

    Attributes
    ----------
    u_1, u_2 : float or array
        Speed of raceway and ball [m/s].
    """

    u_1: Any
    u_2: Any

    @property
    def u_e(self) -> Any:
        """Entrainment speed [m/s]."""
        return 0.5 * (self.u_1 + self.u_2)

    @property
    def srr(self) -> Any:
        """Slide-to-roll ratio."""
        return (self.u_1 - self.u_2) / self.u_e


def surface_speeds(parameters: Parameters, raceway: str, speed: Any) -> ContactSpeeds:
    """Surface speeds of one contact by the law of the parameters.

    Parameters
    ----------
    parameters : Parameters
        Screw, with its friction law.
    raceway : str
        Raceway that the ball touches, "screw" or "nut".
    speed : float or array
        Speed of the screw against the nut [rad/s], any sign.

    Returns
    -------
    ContactSpeeds
        Speeds u_1 of the raceway and u_2 of the ball [m/s].

    Raises
    ------
    ValueError
        Unknown raceway.

    Notes
    -----
    mechanistic: pure rolling on the mean line.

    three_parameter: Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231, Eqs. 1-4; differs from paper: the rotation of
    the ball is not printed, so the pairs that the printed entrainment speeds and slide-to-roll ratios imply are scaled
    with the screw speed. errata: Eq. 3 must read r_b^2 sin^2; Eq. 4 gives 399.7 mm/s on the nut, which no ball speed
    reconciles with both printed nut values; the printed 1.94203 there is the magnitude.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> speeds = surface_speeds(load_screw("gd4008_vg100.toml"), "screw", 104.7)
    >>> f"u_e = {speeds.u_e:.3f} m/s, srr = {speeds.srr:.1f}"
    'u_e = 1.040 m/s, srr = 0.0'
    """
    on_screw = raceway_sign(raceway) > 0
    if parameters.friction.law is Law.MECHANISTIC:
        u_e = entrainment_speed(parameters.screw, speed)
        return ContactSpeeds(u_e, u_e)
    table = parameters.published_speeds
    assert table is not None  # held by the parameter check
    u_1, u_2 = table.screw if on_screw else table.nut
    return ContactSpeeds(u_1 * (speed / table.reference_speed), u_2 * (speed / table.reference_speed))


def _gamma(screw: ScrewParameters) -> float:
    """r_b cos(beta)/r_m."""
    return 0.5 * screw.ball_diameter * math.cos(screw.contact_angle) / screw.nominal_radius


def cage_speed(screw: ScrewParameters, speed: Any) -> Any:
    """Angular speed of the ball centres about the screw axis [rad/s], the nut at rest; pure rolling, zero lead.

    Harris, Rolling Bearing Analysis: w (1 - g)/2, g = r_b cos(beta)/r_m; with the screw at rest 1 + g.
    """
    return 0.5 * (1.0 - _gamma(screw)) * speed


def entrainment_speed(screw: ScrewParameters, speed: Any) -> Any:
    """Entrainment speed on both raceways in the frame of the ball centre, zero lead.

    Parameters
    ----------
    screw : ScrewParameters
        Geometry.
    speed : float or array
        Speed of the screw against the nut [rad/s].

    Returns
    -------
    float or array
        Entrainment speed [m/s].

    Notes
    -----
    r_m w (1 - g^2)/2 with g = r_b cos(beta)/r_m: the raceways move at r_m (1-g)(w - w_c) = r_m (1+g) w_c.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> f"{entrainment_speed(load_screw().screw, 104.7):.3f} m/s"
    '1.040 m/s'
    """
    return 0.5 * screw.nominal_radius * (1.0 - _gamma(screw) ** 2) * speed


class ContactMotion(NamedTuple):
    """Slip and spin at the middle of the c contacts of one ball: matrix q + offset w, w the screw speed.

    Of several balls: with an axis (n,) in front of all three.
    """

    raceways: tuple[str, ...]
    matrix: Array  # (c, 3, 4) slip along x, along y [m], spin [1] per (w_c, w_b along e_r, e_t, e_b)
    offset: Array  # (c, 3) the same per screw speed
    differential: Array  # (c,) Heathcote's slip along x over y^2 and screw speed [1/m]


def contact_motion(screw: ScrewParameters, contact_angle: float | Sequence[float]) -> ContactMotion:
    """Motion of the contacts of a ball: screw and nut of a two-point ball, both flanks of each of an oversize ball.

    Its contact angle [rad] is the same at all contacts; or that of each diagonal that carries load, one or two, in any
    order: turned half around e_r, the ball sees the same screw turn the other way. Valid: contact points in the normal
    plane of the helix of the ball centre. Between two flanks a rolling ball is left with the slip r_b w sin(lambda)
    across rolling, of both contacts, and the spin w sin(beta). Derived. Raceway of a screw motion: (W
    r_m/cos(lambda)) e_t + W e_z x d at d from the ball centre, e_z = sin(lambda) e_t + cos(lambda) e_b.
    """
    if isinstance(contact_angle, (float, int)):
        angles = [contact_angle] * (2 if screw.preload_kind == FOUR_POINT else 1)
    else:
        angles = list(contact_angle)
    r_b = 0.5 * screw.ball_diameter
    along = np.array([0.0, 1.0, 0.0])
    axis = np.array([0.0, math.sin(screw.lead_angle), math.cos(screw.lead_angle)])
    path = screw.nominal_radius / math.cos(screw.lead_angle) * along
    raceways, matrix, offset, differential = [], [], [], []
    rolling = float(entrainment_speed(screw, 1.0))
    for raceway, r_groove in zip(
        RACEWAYS, (screw.screw_raceway_radius, screw.nut_raceway_radius), strict=True
    ):
        sign, drive = (1.0, 1.0) if raceway == "screw" else (-1.0, 0.0)
        # of the deformed contact across rolling: mean curvature of ball and groove
        R_c = 2.0 * r_groove * r_b / (r_groove + r_b)
        for flank, angle in zip((1.0, -1.0), angles, strict=False):
            R_x, _ = reduced_radii(screw, angle, raceway)
            # from the contact to the ball centre
            z = sign * np.array([math.cos(angle), 0.0, flank * math.sin(angle)])
            x = sign * along
            y = np.cross(z, x)
            arm = -r_b * z
            raceway_moves, turn = path + np.cross(axis, arm), axis @ z
            # of the ball under unit turns about e_r, e_t, e_b
            ball_moves = np.array([np.cross(unit, arm) for unit in np.eye(3)])
            rows = [[-raceway_moves @ e, *(-ball_moves @ e)] for e in (x, y)]
            matrix.append([*rows, [-turn, *(-z)]])
            offset.append([drive * (raceway_moves @ x), drive * (raceway_moves @ y), drive * turn])
            differential.append(rolling / (2.0 * R_c * float(R_x)))
            raceways.append(raceway)
    return ContactMotion(tuple(raceways), np.array(matrix), np.array(offset), np.array(differential))


def rolling_motion(motion: ContactMotion) -> Array:
    """Motion (..., 4) per screw speed that slides least at the middle of the contacts, in the sense of least squares.

    Spin is left free: it would outweigh the slip. Of the spins of a ball between two contacts, that with the least w_b.
    """
    shape = motion.matrix.shape[:-3]
    slip = motion.matrix[..., :2, :].reshape(*shape, -1, 4)
    return np.asarray(-(np.linalg.pinv(slip) @ motion.offset[..., :2].reshape(*shape, -1, 1))[..., 0])


def neighbour_sliding(screw: ScrewParameters, motion: Array) -> Array:
    """Speed at which neighbouring balls slide on each other over 2 u_e: twice that of a ball's surface on the helix.

    Two contacts: 1 but for the helix. Oversize balls turn about an axis parallel to that of the screw: 1/cos(beta).
    motion: of a ball (..., 4) per screw speed. Valid: rolling_motion for the equilibrium with traction: GD4008-3, 300 N
    to 6 kN, 10 to 2500 r/min, 12 to 77 C: they differ by 0.4 %, oversize balls by 2 %, but 10 % in the thickest film of
    a light load.
    """
    turn = np.hypot(motion[..., 1], motion[..., 3])
    return np.asarray(0.5 * screw.ball_diameter * turn / entrainment_speed(screw, 1.0))
