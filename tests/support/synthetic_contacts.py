"""Contacts in closed form instead of solved ones, for fast tests of maps and of what is corrected by solves."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from reference_screw import GD4008

from atlas_builder.published import published_map
from ballscrew_tehl.atlas.ball_contacts import BallContacts
from ballscrew_tehl.atlas.groups import QUANTITIES, closed_forms, unmodelled
from ballscrew_tehl.nut_map import build, load
from ballscrew_tehl.nut_map.build import build_map
from ballscrew_tehl.nut_map.grid import BuiltMap, MapGrid
from ballscrew_tehl.parameters.file import PACKAGED_VG100, Law, load_screw
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.film import film_formula, thermal_load_parameter, wilson_sheu
from ballscrew_tehl.physics.kinematics import surface_speeds
from ballscrew_tehl.runtime.evaluate import NutMap

LAW = load_screw(PACKAGED_VG100)
GRID = MapGrid(
    force=(400.0, 12000.0, 7), speed=(100.0 * RPM, 1000.0 * RPM, 6), temperature=(293.15, 313.15, 4),
    preload=(400.0, 9000.0, 7), share_nodes=21,
)  # fmt: skip
CERTIFICATE = {"points": 3, "what": "closed forms", "torque_error_max": 5e-4}
#: exponents of load over the closed forms of film and rise: one falls and the other rises with load, by raceway
FILM_EXPONENT = {"screw": -0.02, "nut": 0.12}
RISE_EXPONENT = {"screw": 0.3, "nut": -0.2}


class ClosedContacts(BallContacts):
    """The contacts of a screw in pure rolling; `at` takes points (n,)."""

    def __init__(self, parameters, table=None):
        super().__init__(parameters)

    def at(self, raceway, load, speed, temperature):
        x = np.log(load / 30.0)
        over = {name: np.zeros_like(x) for name in QUANTITIES} | {
            "central_film": FILM_EXPONENT[raceway] * x, "minimum_film": -0.5 + 0.01 * x,
            "temperature_rise": 3.0 + RISE_EXPONENT[raceway] * x, "mean_rise": 0.5 + 0.0 * x,
        }  # fmt: skip
        return unmodelled(over, closed_forms(self.contacts(raceway, load, speed, temperature)).values)


class ClosedFilm:
    """Film of sliding balls by the law of the paper (friction.film_shear.FilmModel)."""

    def __init__(self, parameters):
        self.parameters = parameters

    def central_film(self, raceway, load, speed, temperature):
        load = np.reshape(load, (-1, *np.ones(np.broadcast(speed, temperature).ndim, int)))
        cold = film_formula(self.parameters, raceway, load, speed, temperature)
        u_e = surface_speeds(self.parameters, raceway, speed).u_e
        heat = wilson_sheu(thermal_load_parameter(self.parameters.lubricant, u_e, temperature), 0.0)
        return cold * (load / 30.0) ** FILM_EXPONENT[raceway] * 0.8 * heat


contacts_of = cache(ClosedContacts)


def closed_ball(parameters, raceway, load, speed, temperature, thermal):
    """In place of solve_ball in refinement.direct: rolling balls as ClosedContacts, others as ClosedFilm."""
    at = np.array([load]), np.array([speed]), np.array([temperature])
    found = {name: float(v[0]) for name, v in contacts_of(parameters).at(raceway, *at).items()}
    if parameters.friction.law is Law.THREE_PARAMETER:
        film = ClosedFilm(parameters).central_film(raceway, at[0], speed, temperature)
        found["central_film"] = float(film[0])
    return SimpleNamespace(
        **{name: found[name] for name in ("rolling_loss", "core_pressure", "core_area")},
        h_c=found["central_film"], h_m=found["minimum_film"], temperature_rise_mean=found["temperature_rise"],
        mean_temperature=temperature + found["mean_rise"], conditions=SimpleNamespace(temperature=temperature),
    )  # fmt: skip


@cache
def law_map(parameters=LAW) -> BuiltMap:
    """The map of a screw by the mechanistic law over GRID."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(build, "BallContacts", ClosedContacts)
        return build_map(parameters, GRID)


@cache
def small_map() -> BuiltMap:
    """The map of GD4008 over GRID: the law of the paper."""
    return published_map(GD4008, ClosedFilm(GD4008), ClosedContacts(GD4008), GRID, CERTIFICATE)


def nut_map_of(built: BuiltMap) -> NutMap:
    """Nut map without a file."""
    return load.nut_map_of(built)
