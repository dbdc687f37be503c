"""Friction that follows the film: power balance of one nut from the contacts of its balls, by the atlas or solved.

T w = sum over balls and raceways (P_roll + P_shear + P_hysteresis) + sum over balls (P_neighbour + P_ball_ball), every
part >= 0. What is called powers of nuts below are torques: power over the speed of the screw (torque.UnfittedTorques).

P_roll        loss of the contact in pure rolling (contact.ContactResult.rolling_loss), times the factor of oil supply
P_shear       spin, differential and helix slip with the shear stress of an Eyring oil limited at Lambda p, and of the
              asperities: the equilibrium of the ball gives its motion (ball_equilibrium)
P_hysteresis  3/16 mu_hs Q b times the angular speed of rolling, u_e/R_x (Zhao 2023, Eq. 18; differs from paper:
              u_e/r_b)
P_neighbour   oil sheared in the gap between neighbouring balls; neighbour_oil is the filled share of the gap, times the
              replenishment of a starved nut. What drags on a ball turns it against the traction of its contacts, which
              is at most Lambda Q each: oil and balls together do not drag more (drag_limit); so the drag ends with the
              load of a ball
P_ball_ball   neighbours slide on each other with twice the speed of their surfaces (physics.kinematics) and have no
              entrainment, so that no film parts them: mu_b N times that speed. N = kappa Lambda Q times thrust_factor

Fitted: kappa, as the one number 2 mu_b Lambda kappa that multiplies Q u_e (net_sliding_coefficient of the set).

Assumptions: only the load-carrying balls cost power, not those in the returns; balls touch each other, or smaller ones
between them roll on both and cost nothing (spacer_balls); seals, grease churning and the returns are not modelled. The
shear stress acts on the core of the pressure (contact.result.pressure_core) with the central film and the mean
temperature of the film. The shear of the mean ball stands for all, with the power 4/3 of the load, and so does its oil
supply: the loads of one nut differ by some percent. Oversize balls: a ball has one motion between all its flanks, and
of its shear those of one nut count.
"""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..numerics import Array
from ..parameters.file import FOUR_POINT, FrictionTable, Parameters, ScrewParameters
from ..parameters.friction import BOUNDED, ball_ball_coefficient
from ..parameters.units import RPM
from ..physics.ball_law import contact_angle_at_ball_load
from ..physics.film import FLOODED, asperity_share, neighbour_drag_power, replenishment_factor, supply_factor
from ..physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ..physics.kinematics import (
    ContactMotion,
    contact_motion,
    entrainment_speed,
    neighbour_sliding,
    rolling_motion,
)
from ..physics.load import nut_loads
from ..physics.lubricant import ambient_density, eta0, viscosity
from ..runtime.constants import DRAG_SHARPNESS
from ..runtime.nut_law import ARRAYS, smooth_lesser
from .ball_equilibrium import Traction, ball_equilibria, radial_nodes
from .film_shear import UNLOADED, TorqueParts, UnfittedTorques, check_motion, hysteresis_sum, sum_of_nuts

#: SKF's geometry constant of single-row angular contact, and ball diameter over D - d of such bearings
K_Z, BALL_OVER_SECTION = 4.4, 0.3
#: exponents of the ball load with which shear power follows that of the mean ball: pressure Q^(1/3), slip Q^(1/3)
SHEAR_EXPONENT = 4.0 / 3.0
#: sharpness of the bend with which the half-width of the core stays below R_x: of cores below R_x/4 it takes 0.1 %
BLUNT = 4.0
#: constants in the table friction of a screw file that the motion of a ball follows from, and others of the law
SHEAR_CONSTANTS = "limiting_shear_coefficient", "boundary_friction", "asperity_film_ratio"
OTHER_CONSTANTS = (
    "hysteresis_coefficient", "ball_thrust", "supply_length", "replenishment_constant", "neighbour_oil",
)  # fmt: skip
#: semi-axes (s, t, c, 2) [m] and traction (s, t, c) of the c contacts of a mean ball at all points
_Sheared = tuple[Array, Traction]


class ContactValues(Protocol):
    """Contacts of the balls: from the atlas, or solved at each call."""

    def values(self, raceway: str, load: Array, speed: Array, temperature: Array) -> Mapping[str, Array]:
        """Quantities (n, s, t) [SI] at ball loads (n,) [N], speeds (s, 1) [rad/s], temperatures (t,) [K].

        The law takes rolling_loss, central_film, core_pressure, core_area and mean_rise of atlas.groups.QUANTITIES.
        """
        ...


class Nut(NamedTuple):
    """Loads (n,) [N] of the load-carrying balls of a nut."""

    loads: Array
    opposed: Array | None = None  # of oversize balls on the other flanks; None: as on these
    times: int = 1  # how often the nut counts


class _LoadedNut(NamedTuple):
    """What does not depend on the constants of the law."""

    loads: Array  # (n,) > 0 [N]
    means: list[float]  # mean_load [N] of each loaded diagonal of a ball
    contacts: Sequence[Mapping[str, Mapping[str, Array]]]  # of each of them, by raceway
    lost: Mapping[str, Array]  # flooded rolling loss of all balls by raceway (s, t) [W]
    motion: ContactMotion  # of the mean ball
    driven: float  # load [N] on all contacts of the balls with one raceway


def roughness_of(friction: FrictionTable) -> float:
    """Composite rms roughness [m] of the law: the height of the screw file, or that of BOUNDED."""
    height = friction.roughness_height
    return BOUNDED["roughness_height"].value if height is None else height


def thrust_factor(friction: FrictionTable, share: Any) -> Any:
    """Ball-to-ball contact force with a fraction f of the load on asperities, over that in a full film.

    Balls whose contact angles differ would run at different speeds. Their neighbours retain them, and both contacts
    creep, as the angles give it; where a contact can transmit more, less of it slides. So the force hardly rises with
    friction: 1.10 times where asperities carry all. It is (2 - y)/(2 - x) with y = x Lambda/mu up to 1, mu = (1-f)
    Lambda + f mu_b, x the creep over that at which a contact slides as a whole at Lambda: two contacts transmit 2
    Lambda Q x (2 - x) = kappa Lambda Q. Beyond y = 1 all slides: mu/(Lambda x (2 - x)). Assumption: spin and slip of
    the same contacts are left out; with them it would rise more (docs/theory.md). Carter, Proc Roy Soc A 112 (1926)
    151; Johnson, Contact Mechanics (1985), Eq. 8.48: of a creep xi a contact transmits mu Q y (2 - y), y = xi R/(mu
    b), up to 1. kappa: ball_thrust, or its value in BOUNDED.
    """
    limit, kappa = friction.limiting_shear_coefficient, friction.ball_thrust
    x = 1.0 - math.sqrt(max(1.0 - 0.5 * (BOUNDED["ball_thrust"].value if kappa is None else kappa), 0.0))
    y = x * limit / (limit + share * (friction.boundary_friction - limit))
    return (2.0 - np.minimum(y, 1.0)) / ((2.0 - x) * np.maximum(y, 1.0))


def breakaway_factor(friction: FrictionTable) -> float:
    """thrust_factor where asperities carry all of the load, at least 1."""
    return max(float(thrust_factor(friction, 1.0)), 1.0)


def law_constants(parameters: Parameters) -> dict[str, float | None]:
    """Everything but screw and contacts that the arrays of a map depend on, by name; None: flooded, as in JSON."""
    friction = parameters.friction
    stated = {name: getattr(friction, name) for name in SHEAR_CONSTANTS + OTHER_CONSTANTS}
    own = {"roughness_height": roughness_of(friction), "eyring_stress": parameters.lubricant.eyring_stress}
    return {name: None if value == FLOODED else value for name, value in (own | stated).items()}


def mean_load(loads: Array) -> float:
    """Ball load [N] that represents those of a nut: ln(load) averaged with weights load^(2/3), like viscous force.

    With film = film(mean) (load/mean)^slope the sum over the balls has no error of first order in the slope; what is
    left is half of the square of its error times the variance of ln(load), below 1e-5 up to 9000 N on 40 mm.
    """
    weights = loads ** (2.0 / 3.0)
    return float(np.exp(np.sum(weights * np.log(loads)) / weights.sum()))


def loaded_nuts(parameters: Parameters, forces: Sequence[float]) -> list[Nut]:
    """Nuts, halves or sets of flanks that carry load, under the forces of both or of one alone [N]."""
    loads = [nut_loads(parameters.screw, force, parameters.screw.loaded_ball_count) for force in forces]
    counts = Counter(force for force in forces if force > 0.0)
    at = {forces.index(force): times for force, times in counts.items()}
    return [Nut(loads[k], loads[1 - k] if n < len(forces) else None, n) for k, n in at.items()]


def nut_powers(
    parameters: Parameters, loads: Array, speed: Any, temperature: Any, contacts: ContactValues
) -> UnfittedTorques:
    """Power balance of one nut with ball loads (n,) [N] on two flanks; other arguments as powers_of_nuts."""
    ((result,),) = powers_of_nuts([parameters], [Nut(loads)], speed, temperature, contacts)
    return result


def nuts_powers(
    parameters: Parameters, forces: Sequence[float], contacts: ContactValues, speed: Any, temperature: Any
) -> list[tuple[int, UnfittedTorques]]:
    """Power balance of the nuts that carry load, as torques before fitted numbers.

    Parameters
    ----------
    parameters : Parameters
        Screw, oil and constants of the law.
    forces : sequence of float
        Forces of both nuts, or of one alone [N].
    contacts : ContactValues
        Contacts of the balls.
    speed : float or (s, 1) array
        Speed of the screw [rad/s], > 0.
    temperature : float or (t,) array
        Temperature of the oil [K].

    Returns
    -------
    list of (int, UnfittedTorques)
        How many times a nut counts, and its parts, floats or (s, t) [N.m].

    Raises
    ------
    ValueError
        Load or speed out of range.
    ArithmeticError
        The equilibrium of a ball did not converge.

    Notes
    -----
    Parts, assumptions and sources: head of this module.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> from ballscrew_tehl.refinement.contacts import contacts_of
    >>> screw = load_screw("gd4008_vg100.toml")
    >>> ((times, nut),) = nuts_powers(screw, [2000.0, 2000.0], contacts_of(screw), 104.7, 303.15)
    >>> times, f"{nut.hysteresis:.4f} N.m"
    (2, '0.0020 N.m')
    """
    nuts = loaded_nuts(parameters, forces)
    (powers,) = powers_of_nuts([parameters], nuts, speed, temperature, contacts)
    return [(nut.times, own) for nut, own in zip(nuts, powers, strict=True)]


def powers_of_nuts(
    variants: Sequence[Parameters], nuts: Sequence[Nut], speed: Any, temperature: Any, contacts: ContactValues,
    on_the_way: Callable[[], None] = lambda: None,
) -> list[list[UnfittedTorques]]:  # fmt: skip
    """Power balance of several nuts for each of the variants, parts (s, t) or floats for a single point.

    Variants are parameters of one screw and oil with other constants of the law. The balls of all are brought into
    equilibrium side by side, those of variants with the same shear once. speed: of the screw, (s, 1) or float [rad/s],
    > 0; temperature: (t,) or float [K]. ValueError: load or speed out of range; ArithmeticError: the equilibrium of a
    ball did not converge. on_the_way: called often; what it raises ends the work.
    """
    speed, temperature = np.broadcast_arrays(
        np.atleast_2d(np.asarray(speed, float)), np.atleast_2d(np.asarray(temperature, float))
    )
    loaded: dict[int, _LoadedNut] = {}
    for k, nut in enumerate(nuts):
        check_motion(nut.loads if nut.opposed is None else np.append(nut.loads, nut.opposed), speed)
        if np.any(nut.loads > 0.0):
            on_the_way()
            loaded[k] = _loaded_nut(variants[0], nut, speed, temperature, contacts)
    keys = []
    for parameters in variants:
        of = law_constants(parameters)
        keys.append(tuple(of[name] for name in ("roughness_height", "eyring_stress", *SHEAR_CONSTANTS)))
    balls = {
        (key, k): _mean_ball(parameters, own, temperature)
        for key, parameters in dict(zip(keys, variants, strict=True)).items()
        for k, own in loaded.items()
    }
    of_balls = [loaded[k] for _, k in balls]
    found = _shear(variants[0].screw, of_balls, list(balls.values()), speed, on_the_way)
    shears = dict(zip(balls, found, strict=True))
    result = [[UNLOADED] * len(nuts) for _ in variants]
    for parameters, key, torques in zip(variants, keys, result, strict=True):
        for k, own in loaded.items():
            asperities = balls[key, k][1].asperities
            torques[k] = _torques(parameters, own, asperities, shears[key, k], speed, temperature)
    return result


def _loaded_nut(
    parameters: Parameters, nut: Nut, speed: Array, temperature: Array, contacts: ContactValues
) -> _LoadedNut:
    screw, loads = parameters.screw, nut.loads[nut.loads > 0.0]
    means, others = [mean_load(loads)], nut.loads if nut.opposed is None else nut.opposed
    driven = float(loads.sum())
    if screw.preload_kind == FOUR_POINT and np.any(others > 0.0):
        means.append(mean_load(others[others > 0.0]))
        driven += float(others.sum())
    at = speed[:, :1], temperature[0]
    of_means = [{name: contacts.values(name, np.array([load]), *at) for name in RACEWAYS} for load in means]
    lost = {name: contacts.values(name, loads, *at)["rolling_loss"].sum(axis=0) for name in RACEWAYS}
    motion = contact_motion(screw, [float(contact_angle_at_ball_load(screw, load)) for load in means])
    return _LoadedNut(loads, means, of_means, lost, motion, driven)


def _mean_ball(parameters: Parameters, nut: _LoadedNut, temperature: Array) -> _Sheared:
    screw, oil, friction = parameters.screw, parameters.lubricant, parameters.friction
    radius, contacts = radial_nodes()[0], []
    for raceway in RACEWAYS:
        for load, result in zip(nut.means, nut.contacts, strict=True):
            pressure, film, area, rise = (
                np.broadcast_to(result[raceway][name][0], temperature.shape)
                for name in ("core_pressure", "central_film", "core_area", "mean_rise")
            )
            # as long across rolling as the Hertz ellipse, the core loses its width in front. A film of some percent of
            # the radius has no core: its pressure reaches as far as the wedge. Smooth, since a map interpolates what
            # follows from it: the lesser of the width and R_x had a kink that moved a torque by 3.6 %
            R_x, R_y = reduced_radii(screw, float(contact_angle_at_ball_load(screw, load)), raceway)
            a = float(ellipse(load, R_x, R_y, E_prime(screw)).a)
            width = area / (math.pi * a)
            b = width / (1.0 + (width / R_x) ** BLUNT) ** (1.0 / BLUNT)
            local_pressure = pressure[..., None] * np.sqrt(1.0 - radius**2)
            contacts.append(
                (
                    np.stack([np.full(b.shape, a), b], axis=-1),
                    viscosity(oil, local_pressure, (temperature + rise)[..., None]),
                    pressure,
                    film,
                    asperity_share(film, roughness_of(friction), friction.asperity_film_ratio),
                )
            )
    axes, *of_contacts = (np.stack(parts, axis=2) for parts in zip(*contacts, strict=True))
    constants = oil.eyring_stress, friction.limiting_shear_coefficient, friction.boundary_friction
    each = (np.full((len(temperature), 1), value) for value in constants)
    return axes, Traction(*of_contacts, *each)


def _shear(
    screw: ScrewParameters, nuts: Sequence[_LoadedNut], balls: Sequence[_Sheared], speed: Array,
    on_the_way: Callable[[], None],
) -> list[tuple[Array, Array]]:  # fmt: skip
    """Shear power (s, t) [W] of mean balls in the contacts of the first of their loaded diagonals; neighbour_sliding.

    All balls at one temperature side by side, each from its motion at the temperature before. How fast neighbours slide
    is that of the rolling motion for two contacts; for four, of which one pair may hardly hold the ball, that of its
    motion.
    """
    diagonals = {len(nut.means) for nut in nuts}
    if len(diagonals) != 1:
        return [
            _shear(screw, [nut], [ball], speed, on_the_way)[0] for nut, ball in zip(nuts, balls, strict=True)
        ]
    (count,), (speeds, temperatures) = diagonals, speed.shape
    axes, tractions = zip(*balls, strict=True)
    axes, traction = np.concatenate(axes), Traction(*map(np.concatenate, zip(*tractions, strict=True)))
    raceways, *parts = zip(*(nut.motion for nut in nuts), strict=True)
    motion = ContactMotion(raceways[0], *(np.repeat(part, speeds, axis=0) for part in parts))
    each = np.tile(speed[:, 0], len(balls))
    found = ball_equilibria(motion, each, axes, traction, on_the_way)
    if count > 1:
        sliding = neighbour_sliding(screw, found.motion / each[:, None, None])
    else:
        rolling = [float(neighbour_sliding(screw, rolling_motion(nut.motion))) for nut in nuts]
        sliding = np.broadcast_to(np.repeat(rolling, speeds)[:, None], (len(each), temperatures))
    power = found.power[..., ::count].sum(axis=-1)
    return list(zip(*(part.reshape(-1, speeds, temperatures) for part in (power, sliding)), strict=True))


def _torques(
    parameters: Parameters,
    nut: _LoadedNut,
    share: Array,
    motion: tuple[Array, Array],
    speed: Array,
    temperature: Array,
) -> UnfittedTorques:
    """Torques of a nut; share: of the asperities (s, t, c), motion: shear power [W], sliding (s, t) of a mean ball."""
    (shear, sliding), mean, u = motion, nut.means[0], float(entrainment_speed(parameters.screw, 1.0))
    limit = u * sliding * nut.driven * drag_limit(parameters.friction)
    full = sliding**2 * gap_drag(parameters, len(nut.loads), speed, temperature)
    parts = (
        *(
            rolling_torque(parameters, name, mean, nut.contacts[0][name], nut.lost[name], speed, temperature)
            for name in RACEWAYS
        ),
        shear * np.sum((nut.loads / mean) ** SHEAR_EXPONENT) / speed,
        thrust_factor(parameters.friction, share[..., :: len(nut.means)].mean(axis=-1)),
        u * sliding * float(nut.loads.sum()),
        float(nut.loads.sum()) / nut.driven * smooth_lesser(full, limit, DRAG_SHARPNESS, ARRAYS),
    )  # fmt: skip
    screw, nut_raceway, slid, thrust, ball_ball, drag = (
        float(p[0, 0]) if speed.size == 1 else p for p in parts
    )
    hysteresis = u * hysteresis_sum(parameters, nut.loads, rolling=True)
    return UnfittedTorques(
        screw, nut_raceway, hysteresis, ball_ball, shear=slid, thrust_factor=thrust, drag=drag
    )


def rolling_ball_torque(parameters: Parameters, loads: Array) -> float:
    """Torque [N.m] of ball on ball at coefficient 1 of loads (n,) [N] on two flanks, alike on four, that roll."""
    screw = parameters.screw
    motion = contact_motion(screw, float(contact_angle_at_ball_load(screw, mean_load(loads))))
    ratio = float(neighbour_sliding(screw, rolling_motion(motion)))
    return float(entrainment_speed(screw, 1.0)) * ratio * float(loads.sum())


def drag_limit(friction: FrictionTable) -> float:
    """What the oil between balls may drag of the load of their contacts, as a coefficient 2 mu_b Lambda kappa.

    A ball turns by the traction of its contacts, at most Lambda Q each; both neighbours drag on it with twice the force
    of a gap. Friction on neighbours takes mu_b kappa of it (ball_thrust, or its value in BOUNDED).
    """
    return max(
        2.0 * friction.limiting_shear_coefficient - ball_ball_coefficient(friction, friction.ball_thrust), 0.0
    )


def gap_drag(parameters: Parameters, balls: int, speed: Array, temperature: Array) -> Array:
    """Torque (s, t) [N.m] of the oil in the gaps between the balls of a nut that slide on each other at 2 u_e."""
    screw = parameters.screw
    sliding = 2.0 * entrainment_speed(screw, speed)
    pair = neighbour_drag_power(0.5 * screw.ball_diameter, sliding, eta0(parameters.lubricant, temperature))
    filled = 0.0 if screw.spacer_balls else parameters.friction.neighbour_oil
    return np.asarray(filled * balls * replenished(parameters, speed, temperature) * pair / speed)


def replenished(parameters: Parameters, speed: Array, temperature: Array) -> Any:
    """SKF's replenishment factor (s, t).

    d, D of the angular contact bearing with this ball and pitch diameter, whose section D - d is the ball diameter over
    0.3 (assumption: geometry of bearings).
    """
    screw, oil = parameters.screw, parameters.lubricant
    nu = 1e6 * eta0(oil, temperature) / ambient_density(oil, temperature)
    pitch, half = 2e3 * screw.nominal_radius, 0.5e3 * screw.ball_diameter / BALL_OVER_SECTION
    K_rs = parameters.friction.replenishment_constant
    return replenishment_factor(K_rs, K_Z, speed / RPM, nu, pitch - half, pitch + half)


def rolling_torque(
    parameters: Parameters,
    raceway: str,
    load: float,
    found: Mapping[str, Array],
    lost: Array,
    speed: Array,
    temperature: Array,
) -> Array:
    """Rolling torque (s, t) [N.m] of a raceway with the oil supply of the file, from the flooded loss of all balls [W].

    load, found: of the mean ball [N], and its contact. film.supply_factor, times the factor replenished.
    """
    friction, screw, inlet = parameters.friction, parameters.screw, eta0(parameters.lubricant, temperature)
    R_x, R_y = reduced_radii(screw, float(contact_angle_at_ball_load(screw, load)), raceway)
    b, u_e = ellipse(load, R_x, R_y, E_prime(screw)).b, entrainment_speed(screw, speed)
    loss, film = found["rolling_loss"][0], found["central_film"][0]
    supplied = supply_factor(friction.supply_length, load, loss, u_e, inlet, film, b, R_x, R_y)
    return np.asarray(replenished(parameters, speed, temperature) * supplied * lost / speed)


def torque_line(nuts: Sequence[tuple[int, UnfittedTorques]], ratio: float = 1.0) -> tuple[Any, Any]:
    """Torque of nuts_powers without ball on ball, and what it rises by per coefficient 2 mu_b Lambda kappa [N.m]."""
    remainder = sum(times * nut.torque(ratio, 0.0) for times, nut in nuts)
    return remainder, sum(times * nut.thrust_factor * nut.sliding for times, nut in nuts)


def double_nut_parts(
    parameters: Parameters,
    forces: Sequence[float],
    contacts: ContactValues,
    speed: float,
    temperature: float,
    ratio: float,
    coefficient: float,
) -> TorqueParts:
    """Parts of the torque of the nuts under their forces.

    Parameters
    ----------
    parameters : Parameters
        Screw, oil and constants of the law.
    forces : sequence of float
        Forces of both nuts, or of one alone [N].
    contacts : ContactValues
        Contacts of the balls.
    speed : float
        Speed of the screw [rad/s], > 0.
    temperature : float
        Temperature of the oil [K].
    ratio : float
        Factor of the rolling part.
    coefficient : float
        Coefficient 2 mu_b Lambda kappa of ball on ball.

    Returns
    -------
    TorqueParts
        Viscous (rolling), hysteresis and sliding part [N.m], with their total.

    Raises
    ------
    ValueError
        Load or speed out of range.
    ArithmeticError
        The equilibrium of a ball did not converge.

    Notes
    -----
    Parts, assumptions and sources: head of this module.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> from ballscrew_tehl.refinement.contacts import contacts_of
    >>> screw = load_screw("gd4008_vg100.toml")
    >>> parts = double_nut_parts(screw, [2000.0, 2000.0], contacts_of(screw), 104.7, 303.15, 1.0, 0.0056)
    >>> f"{parts.total:.2f} N.m"
    '0.80 N.m'
    """
    nuts = nuts_powers(parameters, forces, contacts, speed, temperature)
    return sum_of_nuts(nut.parts(ratio, coefficient) for times, nut in nuts for _ in range(times))
