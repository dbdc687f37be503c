"""Films and temperatures of the contacts of one ball over (ball load, screw speed, oil temperature): by kriging.

What is interpolated, and over what, so that few contacts do. The isothermal film over its closed formula changes with
the Moes load M, most between rigid and flattened contacts: a dip of 15 % from M = 15 to 60, which the first coordinate
stretches. The loss of film by heat, 1/share - 1, is nearly a power of the thermal load parameter beta eta0 u_e^2/k: of
ln(speed) + ln(viscosity)/2. Viscosity: of the oil at ambient pressure. Third coordinate of both: temperature. Rolling
loss: over its closed formula, less what a film that is not thin against the radius lacks of it. Core: its pressure, and
its area times the square of the pressure, which scatters a quarter as much with the nodes as the area; a rigid contact
changes to a Hertzian one at about M L^0.4 = 85. Mean rise: its share of that of the hottest level, which may be
negative. With an atlas, what is interpolated is the difference from it: where it holds all solved contacts, that of
the films alone. Where no isothermal film was solved, that of the atlas is taken, and the thermal one is interpolated
over the closed formula.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..parameters.file import Parameters
from ..physics.ball_formula import (
    LEAST_ROLLING,
    film_formula,
    minimum_rolling_loss,
    moes_groups_of,
    rolling_formula,
)
from ..physics.hertz import RACEWAYS, HertzContact, ball_ellipse
from ..physics.load import load_nodes
from ..physics.lubricant import eta0
from ..runtime.packed import MECHANISTIC
from .atlas import Atlas, AtlasError, ScrewAtlas, load_atlas
from .contacts import CORE, FILMS, MAPPED, MEAN_RISE, RISE, Array, ContactRange, SolvedContacts, film_weight
from .kriging import Kriging

#: quantity that another is interpolated over; the others over closed formulas
OVER = {FILMS[1]: FILMS[0], FILMS[2]: FILMS[1], MEAN_RISE: RISE}
#: what is added to the rise of the hottest level [K], so that a share of none is one. 960 contacts of three screws left
#: out: mean error of the mean rise times beta 0.15 to 0.75 %, 0.3 to 4.5 % if its logarithm is interpolated
MORE_RISE = 1.0


class Stretch(NamedTuple):
    """A coordinate that a transition stretches: x + most tanh((x - ln(turn))/width) with x = ln(M)."""

    most: float
    turn: float
    width: float

    def __call__(self, M: Array) -> Array:
        x = np.log(M)
        return np.asarray(x + self.most * np.tanh((x - np.log(self.turn)) / self.width))


#: of the films, rises and core; 240 contacts that were not used, 256 that were: mean error of the film 2.5e-3 without,
#: 2.8e-4 with it; most 2 or 6, width 0.6 or 1.2, turn 28 or 40: 2.5e-4 to 4.0e-4
FILM_STRETCH = Stretch(4.0, 33.0, 0.9)
#: by quantity; the rolling loss has no dip at the transition
STRETCHES = dict.fromkeys(MAPPED, FILM_STRETCH) | {"rolling_loss": Stretch(0.0, 1.0, 1.0)}
#: M L^CORE_POWER at which core area and pressure of a rigid contact are those of Hertz, which they leave as its cubes
CORE_AREA_TURN, CORE_PRESSURE_TURN, CORE_POWER = 80.0, 95.0, 0.4
#: ln of the share of the rolling loss that films lack over sqrt(2 h/R_x): 4.8 to 5.3 in 1,000 contacts of five screws
#: up to h = 0.1 R_x, where the loss is an eighth of its formula
THICK_FILM = 5.0
#: film over R_x above which a rolling loss is not interpolated from: it falls to nothing there, and below
THICKEST = 0.2
#: loss of film by heat that counts as none; the same contacts: mean error 6e-4 with 0.01 or 0.03, 17e-4 if
#: the share itself is interpolated
NO_LOSS = 0.02
#: power of the viscosity in the second coordinate: 1 what the isothermal film sets, 1/2 what heat sets
THICKENING = {name: 1.0 if name in (FILMS[0], MEAN_RISE, *CORE) else 0.5 for name in MAPPED} | {
    "rolling_loss": 0.75
}
#: degree of the trend of what the atlas leaves; none of the core, whose formula is exact where the load is high
ATLAS_DEGREE, CORE_DEGREE = 0, -1
#: temperature rise [K], and rolling loss over its closed formula, below which they count as that
FLOORS = {RISE: 1e-3, "rolling_loss": LEAST_ROLLING}


class ContactModel:
    """Films, rise and rolling loss of one raceway by kriging of its solved contacts.

    Parameters   hyper: lengths and noise by quantity of an earlier model, None = the most likely ones
                 atlas: whose difference from the contacts is interpolated, None = without
    """

    def __init__(
        self,
        parameters: Parameters,
        raceway: str,
        range_: ContactRange,
        contacts: SolvedContacts,
        hyper: Mapping[str, Array] | None = None,
        atlas: ScrewAtlas | None = None,
    ) -> None:
        self.parameters, self.raceway, self.range, self.atlas = parameters, raceway, range_, atlas
        self.contacts, self._hyper = contacts, hyper or {}
        self.points = contacts.points[contacts.good]
        #: whether thermal contacts alone were solved
        self.heated = not np.isfinite(contacts.values[FILMS[0]][contacts.good]).all()
        self._models: dict[str, Kriging] = {}

    def solved(self, name: str) -> Array:
        """A quantity of the contacts that were solved; the isothermal film of the atlas, if they were not."""
        if name == FILMS[0] and self.heated:
            return self.film(name, self.points)
        return self.contacts.values[name][self.contacts.good]

    def coordinates(self, name: str, points: Array) -> Array:
        """Coordinates (n, 3) in which a quantity is interpolated, each over about the range of the contacts."""
        load, speed, temperature = points.T
        groups = moes_groups_of(self.parameters, self.raceway, load, speed, temperature)[0]
        spans = [np.log(high / low) for low, high in (self.range.load, self.range.speed)]
        cold, hot = self.range.temperature
        thick = np.log(eta0(self.parameters.lubricant, temperature))
        return np.stack(
            [
                STRETCHES[name](groups.M) / sum(spans),
                (np.log(speed) + THICKENING[name] * thick) / spans[1],
                (temperature - cold) / (hot - cold),
            ],
            axis=1,
        )

    @property
    def interpolated(self) -> tuple[str, ...]:
        """Quantities that are interpolated from the solved contacts; the others are those of the atlas.

        Inside the atlas the films alone: of five screws with 48 points each, the mean error of the torque is then 0.04
        to 0.11 %, if all are corrected 0.07 to 0.14 %. A map that was built with others keeps them.
        """
        solved = MAPPED[1:] if self.heated else MAPPED
        return tuple(
            name
            for name in solved
            if name in FILMS or name in self._hyper or not (self._inside and self._in_atlas(name))
        )

    def _form(self, name: str) -> str:
        """Quantity in whose form one is interpolated: the thermal film is no share of an isothermal one if heated."""
        return FILMS[0] if self.heated and name == FILMS[1] else name

    def kriging(self, name: str) -> Kriging:
        """Model of a quantity, of what `modelled` makes of it."""
        if name not in self._models:
            known = self._known(name)
            at, rest = self.coordinates(name, self.points)[known], self._beyond_atlas(name)[known]
            # what the atlas leaves has hardly a trend
            degree = ATLAS_DEGREE if self._in_atlas(name) else CORE_DEGREE if name in CORE else None
            self._models[name] = Kriging(at, rest, self._hyper.get(name), degree)
        return self._models[name]

    def _beyond_atlas(self, name: str) -> Array:
        """What is interpolated of a quantity at the solved contacts (n,), less what the atlas holds of it."""
        ratio = self.solved(name) / self._below(name, self.points, self.solved)
        return modelled(self._form(name), ratio) - self._from_atlas(name, self.points)

    def _known(self, name: str) -> NDArray[np.bool_]:
        """Which of the solved contacts (n,) a quantity is interpolated from."""
        every = np.ones(len(self.points), dtype=bool)
        if name != "rolling_loss":
            return every
        R_x = moes_groups_of(self.parameters, self.raceway, *self.points.T)[1]
        thin = self.solved(FILMS[1]) <= THICKEST * R_x
        return thin if 2 * thin.sum() >= thin.size else every

    def _in_atlas(self, name: str) -> bool:
        return self.atlas is not None and name in self.atlas.quantities

    @cached_property
    def _inside(self) -> bool:
        """Whether the atlas holds every solved contact whose film is not too thick for a rolling loss."""
        if self.atlas is None:
            return False
        return bool(self.atlas.inside(self.points[self._known("rolling_loss")]).all())

    def _from_atlas(self, name: str, points: Array) -> Array:
        """What the atlas holds of what is interpolated of a quantity; without it 0."""
        if self.atlas is None or not self._in_atlas(name):
            return np.zeros(len(points))
        values = self.atlas(name, points)
        if self._form(name) != name:
            return np.asarray(np.log(unmodelled(name, values)) + self.atlas(FILMS[0], points))
        return np.maximum(values, np.log(FLOORS[name])) if name == RISE else values

    def _interpolated(self, name: str, points: Array) -> Array:
        if name not in self.interpolated:
            return self._from_atlas(name, points)
        return self.kriging(name)(self.coordinates(name, points)) + self._from_atlas(name, points)

    @property
    def hyper(self) -> dict[str, Array]:
        """Lengths and noise of the quantities modelled so far."""
        return {name: model.hyper for name, model in self._models.items()}

    def _below(self, name: str, points: Array, quantity: Any) -> Array:
        """What a quantity is interpolated over at points: another quantity, or a closed formula."""
        if name == RISE:
            return np.ones(len(points))
        name = self._form(name)
        others = {"rolling_loss": thick_rolling_formula, **dict.fromkeys(CORE, core_formula)}
        closed = others.get(name, film_formula)
        return interpolated_over(name, quantity, lambda: closed(self.parameters, self.raceway, *points.T))

    def film(self, name: str, points: Array) -> Array:
        """A film [m] at operating points (n, 3), or another quantity."""
        ratio = unmodelled(self._form(name), self._interpolated(name, points))
        return np.asarray(ratio * self._below(name, points, lambda over: self.film(over, points)))

    def covariance(self, name: str, points: Array) -> Array:
        """Covariance (m, m) of the relative errors of a film over what it is interpolated over."""
        at = self.coordinates(name, points)
        model = self.kriging(name)
        slope = _slope(self._form(name), self._interpolated(name, points))
        return np.asarray(model.covariance(at) * slope[:, None] * slope)

    def deviation(self, name: str, points: Array) -> Array:
        """Standard deviation (m,) of these relative errors."""
        at = self.coordinates(name, points)
        model = self.kriging(name)
        return np.asarray(model.deviation(at) * _slope(self._form(name), self._interpolated(name, points)))

    def left_out(self, name: str) -> Array:
        """Relative error (n,) of a quantity, over what it is interpolated over, at each contact when it is left out.

        0 at contacts that it is not interpolated from, and of a film that was not solved; of what is taken from the
        atlas, the error of that; of the mean rise, which may be none, the error of its share.
        """
        errors = np.zeros(len(self.points))
        if name == FILMS[0] and self.heated:
            return errors
        known, form, rest = self._known(name), self._form(name), self._beyond_atlas(name)
        solved = (rest + self._from_atlas(name, self.points))[known]
        missed = self.kriging(name).left_out if name in self.interpolated else rest[known]
        predicted = unmodelled(form, solved - missed)
        errors[known] = (
            predicted - solved if name == MEAN_RISE else predicted / unmodelled(form, solved) - 1.0
        )
        return errors

    def value(self, name: str, points: Array) -> Array:
        """A quantity (SI) at operating points (n, 3)."""
        film = self.film(name, points)
        if name == "rolling_loss":
            return np.maximum(film, minimum_rolling_loss(self.parameters, self.raceway, *points.T))
        # interpolated, the minimum film may exceed the central one
        return film if name != FILMS[2] else np.minimum(film, self.film(FILMS[1], points))


def interpolated_over(name: str, quantity: Callable[[str], Any], closed: Callable[[], Any]) -> Array:
    """What a quantity of a map, and of the atlas, is divided by: another quantity, or a closed formula.

    quantity: by name;  closed: film [m], rolling loss [W], or pressure [Pa] and area [m2] of the core
    """
    over = OVER.get(name)
    if over is not None:
        return np.asarray(quantity(over)) + (MORE_RISE if name == MEAN_RISE else 0.0)
    if name in CORE:
        pressure, area = closed()
        return pressure if name == CORE[0] else area * (pressure / np.asarray(quantity(CORE[0]))) ** 2
    return np.asarray(closed())


def core_formula(
    parameters: Parameters, raceway: str, load: Array, speed: Any, temperature: Any
) -> tuple[Array, Array]:
    """Pressure [Pa] and area [m2] of the core that the solved ones are divided by: rigid, and by Hertz."""
    groups = moes_groups_of(parameters, raceway, load, speed, temperature)[0]
    angle = parameters.screw.contact_angle
    return core_of(groups.M, groups.L, ball_ellipse(parameters.screw, angle, raceway, load))


def core_of(M: Any, L: Any, hertz: HertzContact) -> tuple[Array, Array]:
    """core_formula by the Moes numbers and the Hertz contact."""
    x = M * L**CORE_POWER
    area = np.pi * hertz.a * hertz.b * (1.0 + (CORE_AREA_TURN / x) ** 3)
    return np.asarray(hertz.p_max / (1.0 + (CORE_PRESSURE_TURN / x) ** 3)), np.asarray(area)


def thick_rolling_formula(
    parameters: Parameters, raceway: str, load: Array, speed: Any, temperature: Any
) -> Array:
    """Rolling loss [W] that the solved one is divided by: rolling_formula less what a thick film lacks of it.

    The oil of a contact ends at -R_x, where the gap is R_x/2; the closed formula counts the pressure in front of it.
    """
    at = parameters, raceway, load, speed, temperature
    return thick_film_loss(rolling_formula(*at), film_formula(*at), moes_groups_of(*at)[1])


def thick_film_loss(loss: Any, film: Any, R_x: Any) -> Array:
    """Rolling loss of the closed formula [W] less what a film [m] lacks of it."""
    return np.asarray(loss * np.exp(-THICK_FILM * np.sqrt(2.0 * film / R_x)))


def modelled(name: str, values: Array) -> Array:
    """What is interpolated of a share of the film, a rise or a loss: see the head of this module."""
    if name == MEAN_RISE:
        return values
    if name == FILMS[1]:
        return np.log(np.maximum(1.0 / values - 1.0, -0.5 * NO_LOSS) + NO_LOSS)
    return np.log(np.maximum(values, FLOORS[name]) if name in FLOORS else values)


def unmodelled(name: str, values: Array) -> Array:
    """The share, rise or loss of what is interpolated."""
    if name == MEAN_RISE:
        return values
    if name == FILMS[1]:
        return np.asarray(1.0 / (1.0 - NO_LOSS + np.exp(values)))
    return np.exp(values)


def _slope(name: str, values: Array) -> Array:
    """Relative change of the share with a change of what is interpolated."""
    if name == FILMS[1]:
        return np.asarray(np.exp(values) / (1.0 - NO_LOSS + np.exp(values)))
    return np.ones_like(values)


def screw_atlases(parameters: Parameters, range_: ContactRange, atlas: str) -> dict[str, ScrewAtlas]:
    """The packaged atlas over the range of both raceways; atlas: its hash, empty = none.

    Raises       AtlasError: another atlas is packaged
    """
    if not atlas:
        return {}
    packaged = load_atlas()
    if packaged.hash != atlas:
        raise AtlasError(
            f"contacts over the atlas {atlas[:12]}; packaged: {packaged.hash[:12]}: build the map again with "
            "ballscrew map build"
        )
    return {raceway: _screw_atlas(packaged, parameters, raceway, range_) for raceway in RACEWAYS}


@lru_cache(maxsize=8)
def _screw_atlas(atlas: Atlas, parameters: Parameters, raceway: str, range_: ContactRange) -> ScrewAtlas:
    """Kept: its tables take seconds, and a build, its certificate and its file ask for the same."""
    return ScrewAtlas(atlas, parameters, raceway, range_)


@dataclass(frozen=True)
class ContactMap:
    """Films and rises of the contacts of one ball on both raceways, for one screw with one kinematics.

    contacts: what was solved, by raceway; hyper: lengths and noise of the kriging by raceway and quantity, None = the
    most likely ones; atlas: hash of the one whose difference is interpolated, empty = without.
    """

    parameters: Parameters
    range: ContactRange
    contacts: Mapping[str, SolvedContacts]
    hyper: Mapping[str, Mapping[str, Array]] | None = None
    atlas: str = ""

    @cached_property
    def models(self) -> dict[str, ContactModel]:
        """Model of each raceway."""
        atlases = screw_atlases(self.parameters, self.range, self.atlas)
        return {
            raceway: ContactModel(
                self.parameters,
                raceway,
                self.range,
                contacts,
                (self.hyper or {}).get(raceway),
                atlases.get(raceway),
            )
            for raceway, contacts in self.contacts.items()
        }

    @property
    def cell(self) -> tuple[float, float, float]:
        """Mean distance of the solved contacts in ln(load), ln(speed) and temperature [K]."""
        share = min(map(len, self.contacts.values())) ** (-1.0 / 3.0)
        (q_0, q_1), (w_0, w_1), (t_0, t_1) = self.range.load, self.range.speed, self.range.temperature
        return share * float(np.log(q_1 / q_0)), share * float(np.log(w_1 / w_0)), share * (t_1 - t_0)

    def uncertain_points(self, least: float) -> Array:
        """Contacts (n, 3) that did not converge and whose friction is less certain than a share `least`."""
        found = []
        for raceway, contacts in self.contacts.items():
            points, model = contacts.points[~contacts.good], self.models[raceway]
            if len(points):
                films = [name for name in FILMS[:2] if name in model.interpolated]
                deviation = np.linalg.norm([model.deviation(name, points) for name in films], axis=0)
                weight = film_weight(self.range, points[:, 0], model.film(FILMS[1], points))
                found.append(points[weight * deviation > least])
        return np.concatenate(found) if found else np.empty((0, 3))

    def evaluate(self, raceway: str, name: str, load: Array, speed: float, temperature: float) -> Array:
        """Interpolated quantity for ball loads (n,) [N] at one speed [rad/s] and temperature [K].

        Raises       ValueError: outside the sampled range
        """
        load = np.asarray(load, dtype=float)
        self.range.check(load, speed, temperature)
        points = np.stack(np.broadcast_arrays(load, float(speed), float(temperature)), axis=-1)
        return self.models[raceway].value(name, points)

    def evaluate_grid(self, raceway: str, name: str, load: Array, speed: Array, temperature: Array) -> Array:
        """The same on a grid of ball loads (n,), speeds (s,) and temperatures (t,); returns (n, s, t).

        The loads of one nut lie close together: over them by the polynomial through Chebyshev nodes.
        """
        self.range.check(load, speed, temperature)
        nodes, weights = load_nodes(load)
        points = np.stack(np.meshgrid(nodes, speed, temperature, indexing="ij"), axis=-1).reshape(-1, 3)
        values = self.models[raceway].value(name, points).reshape(nodes.size, -1)
        # a mean rise may be none or negative
        found = weights @ values if name == MEAN_RISE else np.exp(weights @ np.log(values))
        return np.asarray(found.reshape(len(load), len(speed), len(temperature)))


class SolvedFilm:
    """Film model of the contact solver, read from a contact map.

    Parameters   contact_map; thermal: film of the thermal solve ("solved_thermal") or of the isothermal ("solved")
    Validity     loads, speeds and temperatures of the map; ValueError outside
    """

    def __init__(self, contact_map: ContactMap, thermal: bool) -> None:
        self.contact_map = contact_map
        self.name = "solved_thermal" if thermal else "solved"
        self._quantity = FILMS[1] if thermal else FILMS[0]

    def central_film(self, raceway: str, load: Array, speed: float, temperature: float) -> Array:
        """Central film [m] of balls with load (n,) [N] at speed [rad/s] and temperature [K]."""
        return self.contact_map.evaluate(raceway, self._quantity, load, speed, temperature)


class MapContacts:
    """Contacts of the mechanistic friction law, read from a contact map (friction.mechanistic.ContactValues)."""

    name = MECHANISTIC

    def __init__(self, contact_map: ContactMap) -> None:
        self.contact_map = contact_map

    def value(self, raceway: str, name: str, load: Array, speed: Array, temperature: Array) -> Array:
        """A quantity (n, s, t) at ball loads (n,), speeds (s, 1) and temperatures (t,)."""
        return self.contact_map.evaluate_grid(raceway, name, load, speed.ravel(), temperature)
