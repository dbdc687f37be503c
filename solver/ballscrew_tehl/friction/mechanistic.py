"""Friction that follows the film: power balance of one nut from the solved contacts of its balls.

T w = sum over balls and raceways (P_roll + P_shear + P_hysteresis) + sum over balls P_ball_ball, every part >= 0.

P_roll        loss of the contact in pure rolling (contact.ContactResult.rolling_loss), times the factor of oil supply
P_shear       spin, differential and helix slip with the shear stress of an Eyring oil limited at Lambda p, and of the
              asperities: the equilibrium of the ball gives its motion (ball_equilibrium)
P_hysteresis  3/16 mu_hs Q b times the angular speed of rolling, u_e/R_x (Zhao 2023, Eq. 18; differs from paper:
              u_e/r_b)
P_neighbour   oil sheared in the gap between neighbouring balls, part of the rolling torque, half for each raceway;
              neighbour_oil is the filled share of the gap, times the replenishment of a starved nut
P_ball_ball   neighbours slide on each other with twice the speed of their surfaces (physics.ball_motion) and have no
              entrainment, so that no film parts them: mu_b N times that speed. N = kappa Lambda Q times thrust_factor

Fitted: kappa, as the one number 2 mu_b Lambda kappa that multiplies Q u_e (net_sliding_coefficient of the set).

Assumptions: only the load-carrying balls cost power, not those in the returns; balls touch each other, or smaller ones
between them roll on both and cost nothing (spacer_balls); seals, grease churning and the returns are not modelled. The
shear stress acts on the core of the pressure (contact.integrals.pressure_core) with the central film and the mean
temperature of the film.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..parameters.file import FOUR_POINT, FrictionTable, Parameters, ScrewParameters
from ..parameters.friction_constants import BOUNDED
from ..parameters.units import RPM
from ..physics.ball_law import Array, contact_angle_at_ball_load
from ..physics.ball_motion import ContactMotion, contact_motion, neighbour_sliding
from ..physics.film import asperity_share
from ..physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ..physics.kinematics import entrainment_speed
from ..physics.load import nut_loads
from ..physics.lubricant import ambient_density, eta0, viscosity
from ..physics.rolling_resistance import neighbour_drag_power, replenishment_factor
from ..physics.supply import FLOODED, supply_factor
from .ball_equilibrium import Traction, ball_equilibrium, radial_nodes
from .torque import TorqueParts, check_motion, hysteresis_sum

#: SKF's geometry constant of single-row angular contact, and ball diameter over D - d of such bearings
K_Z, BALL_OVER_SECTION = 4.4, 0.3
#: exponents of the ball load with which shear power follows that of the mean ball: pressure Q^(1/3), slip Q^(1/3)
SHEAR_EXPONENT = 4.0 / 3.0
#: sharpness of the bend with which the half-width of the core stays below R_x: of cores below R_x/4 it takes 0.1 %
BLUNT = 4.0
#: those of law_constants that the motion of a ball follows from
SHEAR_CONSTANTS = (
    "roughness_height", "eyring_stress", "limiting_shear_coefficient", "boundary_friction", "asperity_film_ratio",
)  # fmt: skip


class ContactValues(Protocol):
    """Contacts of the balls: from the atlas, or solved at each call."""

    name: str

    def values(self, raceway: str, load: Array, speed: Array, temperature: Array) -> Mapping[str, Array]:
        """Quantities (n, s, t) [SI] at ball loads (n,) [N], speeds (s, 1) [rad/s], temperatures (t,) [K].

        The law takes rolling_loss, central_film, core_pressure, core_area and mean_rise of atlas.groups.QUANTITIES.
        """
        ...


#: ball loads (n,) of a nut on its own and on the other flanks [N]; None: as on its own
NutLoads = tuple[Array, Array | None]
#: a nut and how many times it counts
CountedNut = tuple[int, NutLoads]


class NutPowers(NamedTuple):
    """Torque of one nut by part [N.m]; (s, t) or floats.

    rolling_screw, rolling_nut; shear: both raceways; thrust_factor: see the head; hysteresis; ball_ball: at coefficient
    and thrust factor 1; share: of the load on asperities, mean of both raceways.
    """

    rolling_screw: Any
    rolling_nut: Any
    shear: Any
    thrust_factor: Any
    hysteresis: float
    ball_ball: float
    share: Any

    def torque(self, factor: float, coefficient: float) -> Any:
        """Sum of the parts for a factor of the rolling part and a ball-ball coefficient 2 mu_b Lambda kappa."""
        rolling = factor * (self.rolling_screw + self.rolling_nut)
        return rolling + self.shear + self.hysteresis + coefficient * self.thrust_factor * self.ball_ball


UNLOADED_POWERS = NutPowers(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def roughness_of(friction: FrictionTable) -> float:
    """Composite rms roughness [m] of the law: the height of the screw file, or that of BOUNDED."""
    height = friction.roughness_height
    return BOUNDED["roughness_height"].value if height is None else height


def thrust_factor(friction: FrictionTable, share: Any) -> Any:
    """Thrust of a ball on its neighbours with a share f of the load on asperities, over that in a full film.

    Balls whose contact angles differ would run at different speeds. Their neighbours hold them, and both contacts
    creep: elastically, sliding over a part of the contact. The creep is given by the angles; where the contact can
    transmit more, less of it slides. So the thrust hardly rises with friction: 1.10 times where asperities carry all.
    Assumption: spin and slip of the same contacts are left out; with them it would rise more (docs/theory.md).

    Parameters   share : f, float or array, 0 to 1
    Returns      (2 - y)/(2 - x) with y = x Lambda/mu up to 1, mu = (1-f) Lambda + f mu_b, x the creep over that at
                 which a contact slides as a whole at Lambda: two contacts transmit 2 Lambda Q x (2 - x) = kappa Lambda
                 Q. Beyond y = 1 all slides: mu/(Lambda x (2 - x))
    Source       Carter, Proc Roy Soc A 112 (1926) 151; Johnson, Contact Mechanics (1985), Eq. 8.48: of a creep xi a
                 contact transmits mu Q y (2 - y), y = xi R/(mu b), up to 1. kappa: ball_thrust, or its value in BOUNDED
    """
    limit, kappa = friction.limiting_shear_coefficient, friction.ball_thrust
    x = 1.0 - math.sqrt(max(1.0 - 0.5 * (BOUNDED["ball_thrust"].value if kappa is None else kappa), 0.0))
    y = x * limit / (limit + share * (friction.boundary_friction - limit))
    return (2.0 - np.minimum(y, 1.0)) / ((2.0 - x) * np.maximum(y, 1.0))


def breakaway_factor(friction: FrictionTable) -> float:
    """thrust_factor where asperities carry all of the load, at least 1."""
    return max(float(thrust_factor(friction, 1.0)), 1.0)


def _replenished(parameters: Parameters, speed: Array, temperature: Array) -> Any:
    """Factor (s, t) of SKF's replenishment, of the losses of the oil that the supply of the file leaves.

    Source       d, D of the angular contact bearing with this ball and pitch diameter, whose section D - d is the ball
                 diameter over 0.3 (assumption: geometry of bearings)
    """
    screw, oil = parameters.screw, parameters.lubricant
    nu = eta0(oil, temperature) / ambient_density(oil, temperature)
    pitch, section = 2e3 * screw.nominal_radius, 1e3 * screw.ball_diameter / BALL_OVER_SECTION
    bore, outer = pitch - 0.5 * section, pitch + 0.5 * section
    constant = parameters.friction.replenishment_constant
    return replenishment_factor(constant, K_Z, speed / RPM, 1e6 * nu, bore, outer)


def _supplied(
    parameters: Parameters,
    raceway: str,
    load: float,
    speed: Array,
    temperature: Array,
    mean: Mapping[str, Array],
) -> Any:
    """Rolling loss of a ball with oil from the supply length on over the flooded one (s, t); mean: its contacts."""
    friction, screw = parameters.friction, parameters.screw
    R_x, R_y = reduced_radii(screw, float(contact_angle_at_ball_load(screw, load)), raceway)
    b = ellipse(load, R_x, R_y, E_prime(screw)).b
    loss, film = mean["rolling_loss"][0], mean["central_film"][0]
    u_e, inlet = entrainment_speed(screw, speed), eta0(parameters.lubricant, temperature)
    return supply_factor(friction.supply_length, load, loss, u_e, inlet, film, b, R_x, R_y)


def law_constants(parameters: Parameters) -> dict[str, float | None]:
    """Everything but screw and contacts that the arrays of a map depend on, by name; None: flooded, as in JSON."""
    friction = parameters.friction
    constants = {
        "roughness_height": roughness_of(friction),
        "eyring_stress": parameters.lubricant.eyring_stress,
        **{
            name: getattr(friction, name)
            for name in (
                "limiting_shear_coefficient", "boundary_friction", "asperity_film_ratio", "hysteresis_coefficient",
                "ball_thrust", "supply_length", "replenishment_constant", "neighbour_oil",
            )
        },
    }  # fmt: skip
    return {name: None if value == FLOODED else value for name, value in constants.items()}


def mean_load(loads: Array) -> float:
    """Ball load [N] that represents those of a nut: ln(load) averaged as viscous force grows, load^(2/3).

    With film = film(mean) (load/mean)^slope the sum over the balls has no error of first order in the slope; what is
    left is half of the square of its error times the variance of ln(load), below 1e-5 up to 9000 N on 40 mm.
    """
    weights = loads ** (2.0 / 3.0)
    return float(np.exp(np.sum(weights * np.log(loads)) / weights.sum()))


def nut_powers(
    parameters: Parameters,
    loads: Array,
    speed: Any,
    temperature: Any,
    contacts: ContactValues,
    opposed: Array | None = None,
) -> NutPowers:
    """Power balance of one nut, as torques.

    Parameters   loads : (n,) of the load-carrying balls [N], >= 0;  speed : of the screw, (s, 1) or float [rad/s], > 0;
                 temperature : (t,) or float [K];  contacts : of the balls, flooded
                 opposed : oversize balls: (n,) on the other flanks [N], >= 0; None: as on these
    Returns      NutPowers with parts (s, t), floats for a single point
    Raises       ValueError: load or speed out of range;  ArithmeticError: equilibrium of a ball not found
    Source       head of this module; the shear of the mean ball stands for all, with the power 4/3 of the load, and so
                 does its oil supply: the loads of one nut differ by some percent. Oversize balls: a ball has one motion
                 between all its flanks, and of its shear those of this nut count
    """
    ((result,),) = powers_of_nuts([parameters], [(loads, opposed)], speed, temperature, contacts)
    return result


class _LoadedNut(NamedTuple):
    """A nut that carries load: what does not depend on the constants of the law.

    loads (n,) > 0 [N];  means, contacts : mean_load of each loaded diagonal of a ball [N], and its contacts by raceway;
    lost : flooded rolling losses of all balls by raceway (s, t) [W];  motion : of the contacts of the mean ball
    """

    loads: Array
    means: list[float]
    contacts: Sequence[Mapping[str, Mapping[str, Array]]]
    lost: Mapping[str, Array]
    motion: ContactMotion


class _MeanBall(NamedTuple):
    """The c contacts of a mean ball at all points: motion, semi-axes (s, t, c, 2) [m], traction (s, t, c)."""

    motion: ContactMotion
    axes: Array
    traction: Traction


def powers_of_nuts(
    variants: Sequence[Parameters],
    nuts: Sequence[NutLoads],
    speed: Any,
    temperature: Any,
    contacts: ContactValues,
) -> list[list[NutPowers]]:
    """nut_powers of several nuts, loads and opposed of each, for each of the variants.

    Variants are parameters of one screw and oil with other constants of the law. The balls of all are brought into
    equilibrium side by side, those of variants with the same SHEAR_CONSTANTS once.
    """
    speed, temperature = np.broadcast_arrays(
        np.atleast_2d(np.asarray(speed, float)), np.atleast_2d(np.asarray(temperature, float))
    )
    loaded: dict[int, _LoadedNut] = {}
    for k, (loads, opposed) in enumerate(nuts):
        loads = np.asarray(loads, dtype=float)
        others = loads if opposed is None else np.asarray(opposed, dtype=float)
        check_motion(np.append(loads, others), speed)
        if np.any(loads > 0.0):
            screw = variants[0].screw
            loaded[k] = _loaded_nut(screw, loads[loads > 0.0], others, speed, temperature, contacts)
    constants = [law_constants(parameters) for parameters in variants]
    keys = [tuple(of[name] for name in SHEAR_CONSTANTS) for of in constants]
    balls = {
        (key, k): _mean_ball(parameters, nut, temperature)
        for key, parameters in dict(zip(keys, variants, strict=True)).items()
        for k, nut in loaded.items()
    }
    shears = dict(zip(balls, _shear(list(balls.values()), speed), strict=True)) if balls else {}
    result = [[UNLOADED_POWERS] * len(nuts) for _ in variants]
    for parameters, key, powers in zip(variants, keys, result, strict=True):
        for k, nut in loaded.items():
            powers[k] = _powers(parameters, nut, balls[key, k], shears[key, k], speed, temperature)
    return result


def _loaded_nut(
    screw: ScrewParameters,
    loads: Array,
    others: Array,
    speed: Array,
    temperature: Array,
    contacts: ContactValues,
) -> _LoadedNut:
    means = [mean_load(loads)]
    if screw.preload_kind == FOUR_POINT and np.any(others > 0.0):
        means.append(mean_load(others[others > 0.0]))
    at = speed[:, :1], temperature[0]
    of_means = [{name: contacts.values(name, np.array([load]), *at) for name in RACEWAYS} for load in means]
    lost = {name: contacts.values(name, loads, *at)["rolling_loss"].sum(axis=0) for name in RACEWAYS}
    motion = contact_motion(screw, [float(contact_angle_at_ball_load(screw, load)) for load in means])
    return _LoadedNut(loads, means, of_means, lost, motion)


def _mean_ball(parameters: Parameters, nut: _LoadedNut, temperature: Array) -> _MeanBall:
    contacts = [
        _sheared_contact(parameters, raceway, load, of[raceway], temperature)
        for raceway in RACEWAYS
        for load, of in zip(nut.means, nut.contacts, strict=True)
    ]
    axes, *of_contacts = (np.stack(parts, axis=2) for parts in zip(*contacts, strict=True))
    friction = parameters.friction
    constants = (
        parameters.lubricant.eyring_stress, friction.limiting_shear_coefficient, friction.boundary_friction,
    )  # fmt: skip
    each = (np.full((len(temperature), 1), value) for value in constants)
    return _MeanBall(nut.motion, axes, Traction(*of_contacts, *each))


def _sheared_contact(
    parameters: Parameters, raceway: str, load: float, found: Mapping[str, Array], temperature: Array
) -> tuple[Array, ...]:
    """What the shear of a contact follows from at points (s, t): semi-axes (s, t, 2) [m], fields of Traction."""
    screw, friction, radius = parameters.screw, parameters.friction, radial_nodes()[0]
    pressure, film, area, rise = (
        np.broadcast_to(found[name][0], temperature.shape)
        for name in ("core_pressure", "central_film", "core_area", "mean_rise")
    )
    # as long across rolling as the Hertz ellipse, the core loses its width in front
    angle = float(contact_angle_at_ball_load(screw, load))
    R_x, R_y = (float(R) for R in reduced_radii(screw, angle, raceway))
    a = float(ellipse(load, R_x, R_y, E_prime(screw)).a)
    b = core_half_width(area / (math.pi * a), R_x)
    local_pressure = pressure[..., None] * np.sqrt(1.0 - radius**2)
    return (
        np.stack([np.full(b.shape, a), b], axis=-1),
        viscosity(parameters.lubricant, local_pressure, (temperature + rise)[..., None]),
        pressure,
        film,
        asperity_share(film, roughness_of(friction), friction.asperity_film_ratio),
    )


def core_half_width(of_area: Array, R_x: float) -> Array:
    """Half-width along rolling of the core [m], below R_x: of_area as its area gives it [m].

    A film of some percent of the radius has no core: its pressure reaches as far as the wedge. Smooth, since a map
    interpolates what follows from it: the lesser of the two had a kink that moved a torque by 3.6 %.
    """
    return of_area / (1.0 + (of_area / R_x) ** BLUNT) ** (1.0 / BLUNT)


def _shear(balls: Sequence[_MeanBall], speed: Array) -> list[Array]:
    """Shear power (s, t) [W] of mean balls in the contacts of the first of their loaded diagonals.

    All balls at one temperature side by side, each from its motion at the temperature before.
    """
    diagonals = {len(ball.motion.raceways) // len(RACEWAYS) for ball in balls}
    if len(diagonals) > 1:
        return [_shear([ball], speed)[0] for ball in balls]
    (count,), (speeds, temperatures) = diagonals, speed.shape
    axes = np.concatenate([ball.axes for ball in balls])
    traction = Traction(*map(np.concatenate, zip(*(ball.traction for ball in balls), strict=True)))
    motion = ContactMotion(
        balls[0].motion.raceways,
        *(np.repeat([ball.motion[k] for ball in balls], speeds, axis=0) for k in (1, 2, 3)),
    )
    each, near, before = np.tile(speed[:, 0], len(balls)), None, None
    power = np.empty((len(each), temperatures))
    for t in range(temperatures):
        result = ball_equilibrium(motion, each, axes[:, t], traction.take(np.s_[:, t]), near)
        power[:, t] = result.power[:, ::count].sum(axis=1)
        near, before = result.motion if before is None else 2.0 * result.motion - before, result.motion
    return list(power.reshape(len(balls), speeds, temperatures))


def _powers(
    parameters: Parameters,
    nut: _LoadedNut,
    ball: _MeanBall,
    shear: Array,
    speed: Array,
    temperature: Array,
) -> NutPowers:
    """Powers of a nut with the shear power of its mean ball [W] (s, t)."""
    mean, u = nut.means[0], float(entrainment_speed(parameters.screw, 1.0))
    rolling = [
        rolling_torque(
            parameters, name, nut.loads, speed, temperature, nut.lost[name], nut.contacts[0][name], nut.motion
        )
        for name in RACEWAYS
    ]
    share = ball.traction.asperities[..., :: len(nut.means)].mean(axis=-1)
    parts = (
        *rolling,
        shear * np.sum((nut.loads / mean) ** SHEAR_EXPONENT) / speed,
        thrust_factor(parameters.friction, share),
        share,
    )
    rolling_screw, rolling_nut, slid, thrust, share = (
        float(part[0, 0]) if speed.size == 1 else part for part in parts
    )
    hysteresis = u * hysteresis_sum(parameters, nut.loads, rolling=True)
    touching = 0.0 if parameters.screw.spacer_balls else 1.0
    ball_ball = touching * u * neighbour_sliding(parameters.screw, nut.motion) * float(nut.loads.sum())
    return NutPowers(rolling_screw, rolling_nut, slid, thrust, hysteresis, ball_ball, share)


def rolling_torque(
    parameters: Parameters,
    raceway: str,
    loads: Array,
    speed: Array,
    temperature: Array,
    lost: Array,
    mean: Mapping[str, Array],
    motion: ContactMotion,
) -> Array:
    """Rolling torque of one raceway of a nut, with half of the oil between neighbours (s, t) [N.m].

    Of oversize balls it is that of one pair of flanks, which has half of that if the other pair carries load, too. So
    does a map where the other pair is free.

    Parameters   loads (n,) > 0 [N];  speed, temperature (s, t);  lost : flooded rolling loss of all balls (s, t) [W]
                 mean : contacts of the ball with their mean_load;  motion : of its contacts
    """
    screw = parameters.screw
    lost = _supplied(parameters, raceway, mean_load(loads), speed, temperature, mean) * lost
    if not screw.spacer_balls:
        gaps = parameters.friction.neighbour_oil * len(loads) / len(motion.raceways)
        sliding = 2.0 * neighbour_sliding(screw, motion) * entrainment_speed(screw, speed)
        oil = eta0(parameters.lubricant, temperature)
        lost = lost + gaps * neighbour_drag_power(0.5 * screw.ball_diameter, sliding, oil)
    return np.asarray(_replenished(parameters, speed, temperature) * lost / speed)


def loaded_nuts(parameters: Parameters, forces: Sequence[float]) -> list[CountedNut]:
    """Nuts, halves or sets of flanks that carry load, under the forces of both or of one alone [N], and their count."""
    screw = parameters.screw
    loads = [nut_loads(screw, force, screw.loaded_ball_count) for force in forces]
    nuts = []
    for force, times in Counter(force for force in forces if force > 0.0).items():
        own = forces.index(force)
        nuts.append((times, (loads[own], loads[1 - own] if times < len(forces) else None)))
    return nuts


def nuts_powers(
    parameters: Parameters, forces: Sequence[float], contacts: ContactValues, speed: Any, temperature: Any
) -> list[tuple[int, NutPowers]]:
    """Power balance of the loaded_nuts, and how many times each counts; arguments as there and as nut_powers."""
    nuts = loaded_nuts(parameters, forces)
    (powers,) = powers_of_nuts([parameters], [nut for _, nut in nuts], speed, temperature, contacts)
    return [(times, nut) for (times, _), nut in zip(nuts, powers, strict=True)]


def torque_line(nuts: Sequence[tuple[int, NutPowers]], ratio: float = 1.0) -> tuple[Any, Any]:
    """Torque of nuts_powers without ball on ball, and what it rises by per coefficient 2 mu_b Lambda kappa [N.m]."""
    return (
        sum(times * nut.torque(ratio, 0.0) for times, nut in nuts),
        sum(times * nut.thrust_factor * nut.ball_ball for times, nut in nuts),
    )


def double_nut_parts(
    parameters: Parameters,
    forces: Sequence[float],
    contacts: ContactValues,
    speed: float,
    temperature: float,
    ratio: float,
    coefficient: float,
) -> TorqueParts:
    """Torque of the nuts, rolling as viscous and shear with ball on ball as sliding, as runtime.nut_law names them.

    Arguments as nuts_powers;  ratio, coefficient : factor of the rolling part, 2 mu_b Lambda kappa.
    """
    rolling = hysteresis = sliding = 0.0
    for times, nut in nuts_powers(parameters, forces, contacts, speed, temperature):
        rolling += times * ratio * (nut.rolling_screw + nut.rolling_nut)
        hysteresis += times * nut.hysteresis
        sliding += times * (nut.shear + coefficient * nut.thrust_factor * nut.ball_ball)
    return TorqueParts(rolling, hysteresis, sliding)
