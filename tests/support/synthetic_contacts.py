"""Contacts in closed form instead of solved ones, for fast tests of the map build and of its file.

Ratios to the closed formulas and the temperature rise are cubic polynomials or less in (ln load, ln speed,
temperature), in logarithms: smooth, but kriging does not hold them exactly. They can be sent to other processes.
"""

import math
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from reference_screw import GD4008

from ballscrew_tehl.friction.presliding import presliding_angle
from ballscrew_tehl.nut_map import build
from ballscrew_tehl.nut_map.build import build_map, map_journal
from ballscrew_tehl.nut_map.contact_map import core_formula, thick_rolling_formula
from ballscrew_tehl.nut_map.contacts import CORE, FILMS, MAPPED, QUANTITIES, RISES, VISCOUS
from ballscrew_tehl.nut_map.file import STORED
from ballscrew_tehl.nut_map.grid import BuiltMap, MapGrid
from ballscrew_tehl.parameters.file import load_screw
from ballscrew_tehl.parameters.packaged_data import PACKAGED_VG100
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.ball_formula import film_formula
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import FILM_SHEAR, sealed

LAW = load_screw(PACKAGED_VG100)
# without the atlas, which is that of solved contacts
GRID = MapGrid(
    force=(400.0, 12000.0, 7), speed=(100.0 * RPM, 1000.0 * RPM, 6), temperature=(293.15, 313.15, 4),
    preload=(400.0, 9000.0, 7), share_nodes=21, contact_first=96, contact_batch=16, contact_max=96, atlas=False,
)  # fmt: skip
#: the same with fewer contacts: faster, errors of some percent
FEW = replace(GRID, contact_first=32, contact_max=32)
#: largest error of a film and of a temperature rise of the contact map over GRID against the closed contacts; found at
#: 2000 random points (mean): 96 contacts 6.2e-4 (3e-5) and 1.2e-2 (3e-4, in a corner); 64: 1.8e-3 and 1.4e-2; 128:
#: 6.0e-4 and 1.1e-2
CLOSED_FILM, CLOSED_RISE = 1e-3, 1.5e-2
SHARE = {FILMS[0]: 1.0, FILMS[1]: 0.8, FILMS[2]: 0.5, "rolling_loss": 0.7, CORE[0]: 1.0, CORE[1]: 0.9}
#: exponent of load in the ratio to the closed formula: the film falls with load on the screw and rises on the nut
LOAD_EXPONENT = {"screw": -0.02, "nut": 0.12}


def _coordinates(load, speed, temperature):
    return np.log(load / 30.0), np.log(speed / 30.0), (temperature - 303.15) / 10.0


def ratio(raceway, name, load, speed, temperature):
    """Film or rolling loss over closed formula."""
    x, y, z = _coordinates(load, speed, temperature)
    cooling = 0.0 if name == FILMS[0] else 0.1 * y + 0.02 * y**2 - 0.03 * z * y
    bend = 0.001 * x**3 + 0.01 * y * x - 0.01 * z**2
    return SHARE[name] * np.exp(LOAD_EXPONENT[raceway] * x + bend - cooling)


def temperature_rise(raceway, load, speed, temperature):
    """Rise [K]; it rises with load on the screw and falls on the nut."""
    x, y, z = _coordinates(load, speed, temperature)
    exponent = 0.3 if raceway == "screw" else -0.2
    return 20.0 * np.exp(exponent * x + 0.9 * y - 0.05 * y**3 - 0.1 * z + 0.01 * x * y * z)


def values(parameters, raceway, name, load, speed, temperature):
    """Any interpolated quantity for ball loads (n,) at one speed and temperature."""
    if name in RISES:
        share = 1.0 if name == "temperature_rise" else 0.5
        return share * temperature_rise(raceway, load, speed, temperature)
    at = parameters, raceway, np.asarray(load), speed, temperature
    over = ratio(raceway, name, load, speed, temperature)
    if name in CORE:
        return core_formula(*at)[CORE.index(name)] * over**0.1
    return (thick_rolling_formula if name == "rolling_loss" else film_formula)(*at) * over


class ClosedFilm:
    """Film model of the closed form, without a map."""

    def __init__(self, parameters, thermal):
        self.parameters = parameters
        self.name = "solved_thermal" if thermal else "solved"
        self._quantity = FILMS[1] if thermal else FILMS[0]

    def central_film(self, raceway, load, speed, temperature):
        return values(self.parameters, raceway, self._quantity, load, speed, temperature)


def closed_ball(parameters, raceway, load, speed, temperature, thermal):
    """In place of solve_ball in refinement.direct: the same numbers."""
    at = parameters, raceway
    found = {name: float(values(*at, name, np.array([load]), speed, temperature)[0]) for name in MAPPED}
    return SimpleNamespace(
        **{name: found[name] for name in ("rolling_loss", *CORE)},
        h_c=found[FILMS[1] if thermal else FILMS[0]], h_m=found[FILMS[2]], conditions=SimpleNamespace(
            load=load, temperature=temperature),
        temperature_rise_mean=found["temperature_rise"], mean_temperature=temperature + found["mean_rise"],
        hertz=SimpleNamespace(p_max=1e9 * (load / 30.0) ** (1 / 3)),
    )  # fmt: skip


def closed_contact(parameters, raceway, load, speed, temperature):
    """In place of build._solve_contact."""
    at = load, speed, temperature
    contact = {name: float(values(parameters, raceway, name, *at)) for name in MAPPED}
    return contact | {"asymptotic": float(load > 100.0)}


def partly_failed_contact(parameters, raceway, load, speed, temperature):
    """closed_contact without heavy, slow contacts of the nut, as if the solver had not converged."""
    if raceway == "nut" and load > 100.0 and speed < 15.0:
        return dict.fromkeys(QUANTITIES, math.nan)
    return closed_contact(parameters, raceway, load, speed, temperature)


def closed_build(
    parameters=GD4008, grid=GRID, progress=None, solve=closed_contact, executor=None, journal=None
) -> BuiltMap:  # fmt: skip
    """build_map with closed contacts, in one thread unless an executor is given.

    journal: path of the file of contacts
    """
    with pytest.MonkeyPatch.context() as patch, ThreadPoolExecutor(1) as thread, ExitStack() as stack:
        patch.setattr(build, "_solve_contact", solve)
        record = None if journal is None else stack.enter_context(map_journal(journal, parameters))
        return build_map(parameters, None, progress, grid, executor or thread, record)


@cache
def small_map() -> BuiltMap:
    """The map of GD4008 over GRID."""
    return closed_build()


@cache
def law_map() -> BuiltMap:
    """The map of rolling balls over GRID: the mechanistic law."""
    return closed_build(LAW)


def nut_map_of(built: BuiltMap, film="solved", ratio=7.0, net=0.005, roughness=3e-8) -> NutMap:
    """Nut map of one film model of a build, without a file."""
    header = {
        **built.header,
        "contact_cell": list(built.contact_map.cell),
        "law": FILM_SHEAR,
        "film_model": film,
        "defaults": {
            "apparent_viscosity_ratio": ratio, "net_sliding_coefficient": net, "roughness_height": roughness,
            "breakaway_factor": 1.0,
        },
        "presliding_angle": presliding_angle(GD4008.screw, 1.0),
    }  # fmt: skip
    arrays = {name: built.arrays[name] for name in STORED if name != "extreme_coefficients"}
    surfaces = built.arrays[f"{VISCOUS}{film}"], built.arrays["extreme_coefficients"]
    arrays["coefficients"] = np.concatenate(surfaces, axis=-1)
    return NutMap(sealed(header, arrays), arrays)


def same_map(one, two):
    """Header, contacts, kriging and coefficients equal to the last bit."""
    assert one.header == two.header
    same_contacts(one.contact_map, two.contact_map)
    for name, array in one.arrays.items():
        np.testing.assert_array_equal(array, two.arrays[name])


def same_contacts(one, two):
    """Range, contacts and kriging of two contact maps equal to the last bit."""
    assert one.range == two.range
    same = np.testing.assert_array_equal
    for raceway in RACEWAYS:
        own, other = one.contacts[raceway], two.contacts[raceway]
        same(own.points, other.points)
        for name in QUANTITIES:
            same(own.values[name], other.values[name])
        for name in MAPPED:
            same(*(each.models[raceway].kriging(name).hyper for each in (one, two)))
