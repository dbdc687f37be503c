"""Making the atlas: contacts of steel balls and oils of all kinds, solved at the points of Sobol sequences.

The first sequence covers geometry, pressure, speed and oil of all screws for the isothermal film; its first contacts
are solved with heat as well. The second has the oils of catalogues where they heat: most of the first do not. The third
is the transition from rigid to flattened contacts, where the film over its closed formula changes most, the fourth its
hot contacts.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, as_completed
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from .. import __version__
from ..contact import ContactConditions, ContactResult, Scales, scales_of, solve_for_map
from ..parameters.file import LubricantParameters
from ..parameters.mineral_oil import D341_SHIFT
from ..parameters.oil import ROELANDS_LN, ROELANDS_PRESSURE
from ..parameters.units import CELSIUS
from ..physics.hertz import ellipse
from ..physics.lubricant import eta0
from ..physics.rolling_resistance import biboulet_houpert_point, rolling_power
from ..whole_file import whole_file
from .atlas import (
    ATLAS_FORMAT,
    GROUPS,
    HELD,
    STEEL,
    STEEL_MODULUS,
    Atlas,
    content_hash,
    coordinates,
    oil_groups,
)
from .contact_map import THICKEST, core_of, interpolated_over, modelled, thick_film_loss, unmodelled
from .contacts import CORE, FILMS, MEAN_RISE, MIN_FILM, RISE, Array
from .journal import Contact, Journal
from .kriging import Interpolant, Kriging
from .workers import Progress

#: rows of an array
Rows = NDArray[np.intp]
#: density [kg/m3], heat capacity and conductivity of the oils, density over temperature: a mineral oil at 40 C. They
#: move with the grade by 4 %
DENSITY, SPECIFIC_HEAT, CONDUCTIVITY, EXPANSION = 860.0, 1950.0, 0.135, 6.5e-4


class Axis(NamedTuple):
    """Least and largest value of what a contact is drawn by, and whether in the logarithm."""

    low: float
    high: float
    logarithmic: bool = True


#: what a contact is drawn by: R_x [m], R_x/R_y, p_max [Pa], u_e [m/s], eta0 [Pa s], temperature [K], slope of
#: ln(ln(nu)) over ln(T) as in ASTM D341 (3.4 to 3.9 for mineral oils, 6 and more for the law of Zhao et al. 2023), Z
AXES = {
    "R_x": Axis(0.55e-3, 9.5e-3), "radius_ratio": Axis(0.022, 0.1), "pressure": Axis(0.14e9, 2.25e9),
    "u_e": Axis(4e-3, 7.0), "eta0": Axis(1.9e-3, 2.1), "temperature": Axis(CELSIUS, 90.0 + CELSIUS, False),
    "d341": Axis(2.9, 6.3), "z": Axis(0.4, 0.75, False),
}  # fmt: skip
CATALOGUE = AXES | {
    "pressure": Axis(0.3e9, 2.2e9), "u_e": Axis(0.05, 7.0), "temperature": Axis(10.0 + CELSIUS, 80.0 + CELSIUS, False),
    "d341": Axis(3.2, 4.2),
}  # fmt: skip


class Points(NamedTuple):
    """A Sobol sequence: axes, seed, how many of its points, and those of them that are solved.

    M, L: range;  N: the least;  heated: whether the contact of an index and of an N is solved with heat as well
    """

    axes: Mapping[str, Axis]
    seed: int
    drawn: int
    M: tuple[float, float]
    L: tuple[float, float]
    N: float
    heated: Callable[[int, float], bool]


#: M ends where films are below those of any map, or as thick as the balls. Of 775 contacts left out, the error of the
#: thermal film was 0.04 % in the mean below N = 0.01, 0.8 % from 1 to 4; of 1368, that of the isothermal film 0.02 %
#: above M = 100, 0.3 % from 10 to 100
SEQUENCES = {
    "all": Points(AXES, 1, 1500, (0.5, 3e5), (0.0, 1e3), 0.0, lambda k, N: k < 700 or (k < 1000 and N > 3e-3)),
    "fast": Points(CATALOGUE, 5, 342, (1.0, 1e5), (0.0, 110.0), 0.03, lambda k, N: True),
    "transition": Points(CATALOGUE, 7, 1638, (8.0, 130.0), (8.0, 110.0), 0.0, lambda k, N: True),
    "hot": Points(CATALOGUE, 9, 872, (8.0, 150.0), (15.0, 110.0), 0.3, lambda k, N: True),
}  # fmt: skip
#: points of a sequence to draw from, as a power of two, and seed of the random points of the errors
POWER, CHECK_SEED = 13, 11
#: contacts by which lengths and noise are found; all together take the weights
HYPER_FROM = 600


class AtlasPoint(NamedTuple):
    """A contact to solve: name in the journal, values of the axes, whether with heat."""

    name: str
    values: tuple[float, ...]
    heated: bool


def oil_of(eta0: float, temperature: float, d341: float, z: float) -> LubricantParameters:
    """An oil with a viscosity [Pa s] at a temperature [K], slope of ASTM D341 there and pressure exponent."""
    shift, step = D341_SHIFT, 20.0
    nu = 1e6 * eta0 / DENSITY
    other = math.log10(math.log10(nu + shift)) - d341 * math.log10(1.0 + step / temperature)
    return LubricantParameters(
        name="atlas", viscosity_law="astm_d341", density=DENSITY, reference_temperature=temperature,
        density_temperature=EXPANSION, specific_heat=SPECIFIC_HEAT, thermal_conductivity=CONDUCTIVITY,
        astm_viscosity_1=1e-6 * nu, astm_temperature_1=temperature,
        astm_viscosity_2=1e-6 * (10.0 ** 10.0**other - shift), astm_temperature_2=temperature + step,
        pressure_viscosity=z * (math.log(eta0) + ROELANDS_LN) / ROELANDS_PRESSURE, z_roelands=z,
    )  # fmt: skip


def contact_of(values: tuple[float, ...]) -> tuple[ContactConditions, LubricantParameters]:
    """Conditions and oil of a point of the axes."""
    R_x, ratio, pressure, u_e, viscosity, temperature, d341, z = values
    unit = float(ellipse(1.0, R_x, R_x / ratio, STEEL_MODULUS).p_max)
    load = (pressure / unit) ** 3
    conditions = ContactConditions(load, R_x, R_x / ratio, u_e, u_e, temperature, STEEL_MODULUS)
    return conditions, oil_of(viscosity, temperature, d341, z)


def contact_groups(values: tuple[float, ...]) -> tuple[Array, Scales]:
    """Groups (8,) of a point of the axes, and its scales."""
    conditions, oil = contact_of(values)
    scales = scales_of(conditions, oil)
    N, slope = oil_groups(oil, conditions.u_e, conditions.temperature)
    ratio, pressure, z = values[1], values[2], values[7]
    return np.array(
        [scales.M, scales.L, ratio, z, pressure, N, slope, conditions.temperature], dtype=float
    ), scales


def _drawn(unit: Array, axes: Mapping[str, Axis]) -> Iterator[tuple[float, ...]]:
    for row in unit:
        yield tuple(
            axis.low * (axis.high / axis.low) ** u
            if axis.logarithmic
            else axis.low + (axis.high - axis.low) * u
            for u, axis in zip(row.tolist(), axes.values(), strict=True)
        )


def _usable(values: tuple[float, ...], of: Points) -> tuple[bool, float]:
    """Whether a contact of a sequence is solved, and its N."""
    groups, scales = contact_groups(values)
    M, L, N = (float(groups[GROUPS.index(name)]) for name in ("M", "L", "N"))
    thick = scales.film_estimate * scales.h_unit >= MIN_FILM
    return bool(thick and of.M[0] <= M <= of.M[1] and of.L[0] <= L <= of.L[1] and N >= of.N), N


def atlas_points() -> list[AtlasPoint]:
    """The contacts of the atlas."""
    found = []
    for name, of in SEQUENCES.items():
        unit = qmc.Sobol(len(of.axes), seed=of.seed).random_base2(POWER)[: of.drawn]
        for k, values in enumerate(_drawn(unit, of.axes)):
            usable, N = _usable(values, of)
            if usable:
                found.append(AtlasPoint(f"{name} {k}", values, of.heated(k, N)))
    return found


def check_points(count: int) -> list[AtlasPoint]:
    """Random contacts of screws and oils of catalogues at any speed."""
    generator = np.random.default_rng(CHECK_SEED)
    of = SEQUENCES["all"]._replace(axes=CATALOGUE | {"u_e": AXES["u_e"]}, L=SEQUENCES["fast"].L)
    found: list[AtlasPoint] = []
    while len(found) < count:
        values = next(_drawn(generator.random((1, len(of.axes))), of.axes))
        if _usable(values, of)[0]:
            found.append(AtlasPoint(f"check {len(found)}", values, True))
    return found


def solve_point(values: tuple[float, ...], heated: bool) -> Contact:
    """What is interpolated of the quantities of a point (HELD), NaN where it was not solved."""
    conditions, oil = contact_of(values)
    groups, scales = contact_groups(values)
    result = dict.fromkeys(HELD, math.nan)
    cold = solve_for_map(conditions, oil, STEEL, thermal=False)
    if cold.converged:
        result[FILMS[0]] = math.log(cold.h_c / (scales.film_estimate * scales.h_unit))
    if cold.converged and heated:
        hot = solve_for_map(conditions, oil, STEEL, thermal=True)
        if hot.converged:
            result |= thermal_values(groups, oil, scales, cold, hot)
    return result


def thermal_values(
    groups: Array, oil: LubricantParameters, scales: Scales, cold: ContactResult, hot: ContactResult
) -> dict[str, float]:
    """What is interpolated of a contact with heat, solved without and with it; a film above THICKEST has no loss."""
    columns = dict(zip(GROUPS, groups.tolist(), strict=True))
    c, own = hot.conditions, hot
    force = biboulet_houpert_point(c.load, c.u_e, c.R_x, c.R_y, c.E_prime, eta0(oil, c.temperature))
    film = scales.film_estimate * scales.h_unit
    core = core_of(scales.M, scales.L, scales.hertz)
    closed = {
        "rolling_loss": thick_film_loss(rolling_power(force, c.u_e), film, c.R_x),
        **dict.fromkeys(CORE, core),
    }
    rise = max(own.temperature_rise_mean, 1e-12)
    values = {
        FILMS[0]: cold.h_c, FILMS[1]: hot.h_c, FILMS[2]: hot.h_m, RISE: rise,
        MEAN_RISE: own.mean_temperature - c.temperature, CORE[0]: own.core_pressure, CORE[1]: own.core_area,
    }  # fmt: skip
    if hot.h_c <= THICKEST * c.R_x:
        values["rolling_loss"] = own.rolling_loss
    result = {
        name: float(
            modelled(name, value / interpolated_over(name, values.__getitem__, partial(closed.get, name)))
        )
        for name, value in values.items()
        if name not in (FILMS[0], RISE)
    }
    result[RISE] = math.log(rise * columns["slope"] / columns["N"])
    return result


def solve_points(
    points: list[AtlasPoint], journal: Journal, executor: Executor, progress: Progress | None, what: str
) -> None:
    """Solve those points that are not in the journal."""
    jobs = {
        executor.submit(solve_point, point.values, point.heated): point.name
        for point in points
        if (point.name,) not in journal
    }
    done = len(points) - len(jobs)
    try:
        for job in as_completed(jobs):
            journal.add((jobs[job],), job.result())
            done += 1
            if progress is not None:
                progress(done, len(points), what)
    except BaseException:
        for job in jobs:
            job.cancel()
        raise


def fitted(groups: Array, values: Array) -> tuple[dict[str, Interpolant], dict[str, Rows]]:
    """Interpolants by quantity of contacts with groups (n, 8) and a value of each of HELD, and the rows they take."""
    interpolants: dict[str, Interpolant] = {}
    rows: dict[str, Rows] = {}
    for name, column in zip(HELD, values.T, strict=True):
        rows[name] = np.flatnonzero(np.isfinite(column))
        at = coordinates(name, groups[rows[name]])
        # spread over both sequences
        some = np.linspace(0, len(at) - 1, min(HYPER_FROM, len(at))).astype(int)
        hyper = Kriging(at[some], column[rows[name]][some]).hyper
        interpolants[name] = Kriging(at, column[rows[name]], hyper).interpolant
    return interpolants, rows


def _single(rows: list[Any]) -> Array:
    """Rows in single precision, as they are stored."""
    return np.array(rows, dtype=np.float32).astype(np.float64)


def errors_at(atlas: Atlas, groups: Array, values: Array) -> dict[str, dict[str, float]]:
    """Errors by quantity at contacts that were not used: number, mean, 99 % quantile, largest.

    Relative; of the mean rise as a share of that of the hottest level.
    """
    found = {}
    for name, column in zip(HELD, values.T, strict=True):
        known = np.isfinite(column)
        if known.any():
            predicted, found_there = (
                unmodelled(name, of) for of in (atlas.modelled(name, groups[known]), column[known])
            )
            # the mean rise is a share, which may be none
            error = np.abs(predicted - found_there) / (1.0 if name == MEAN_RISE else found_there)
            if name == "temperature_rise":
                columns = dict(zip(GROUPS, groups[known].T, strict=True))
                # of 1 K where the rise is less, as in the certificate of a map
                error *= np.minimum(np.exp(column[known]) * columns["N"] / columns["slope"], 1.0)
            found[name] = {
                "points": int(known.sum()), "mean": float(error.mean()),
                "99": float(np.quantile(error, 0.99)), "max": float(error.max()),
            }  # fmt: skip
    return found


def build_atlas(
    path: Path, executor: Executor, count: int, progress: Progress | None = None,
    points: Callable[[], list[AtlasPoint]] = atlas_points,
) -> dict[str, Any]:  # fmt: skip
    """Solve the contacts of the atlas, fit it, certify it and write it.

    Parameters   path: of the file, next to which is the journal;  count: random points of its errors
    Returns      header
    """
    wanted, checks = points(), check_points(count)
    beside = path.with_name(path.name + ".contacts")
    with Journal(HELD, beside, {"atlas format": ATLAS_FORMAT, "version": __version__}) as journal:
        solve_points(wanted, journal, executor, progress, "contacts solved")
        solve_points(checks, journal, executor, progress, "points of its errors")
        solved = {key: [contact[name] for name in HELD] for (key,), contact in journal.contacts.items()}
    groups = _single([contact_groups(point.values)[0] for point in wanted])
    values = _single([solved[point.name] for point in wanted])
    interpolants, rows = fitted(groups, values)
    known = np.isfinite(values[:, 0])
    atlas = Atlas(interpolants, np.array([groups[known].min(axis=0), groups[known].max(axis=0)]), {})
    held = np.array([contact_groups(point.values)[0] for point in checks])
    header = {
        "format": ATLAS_FORMAT, "version": __version__, "contacts": int(known.sum()),
        "contacts_heated": int(np.isfinite(values[:, 1]).sum()), "contacts_not_solved": int((~known).sum()),
        "errors": errors_at(atlas, held, np.array([solved[point.name] for point in checks])),
    }  # fmt: skip
    save_atlas(path, groups, interpolants, rows, header)
    return header


def save_atlas(
    path: Path, groups: Array, interpolants: Mapping[str, Interpolant], rows: Mapping[str, Rows],
    header: Mapping[str, Any],
) -> None:  # fmt: skip
    """Write an atlas to a temporary file next to `path` and rename it."""
    arrays: dict[str, Any] = {"groups": groups.astype(np.float32)}
    for name, interpolant in interpolants.items():
        arrays[f"{name}_rows"] = rows[name].astype(np.int32)
        arrays[f"{name}_hyper"], arrays[f"{name}_slopes"] = interpolant.hyper, interpolant.slopes
        arrays[f"{name}_weights"] = interpolant.weights
    text = json.dumps(dict(header, hash=content_hash(arrays)), sort_keys=True)
    # a name without .npz would be changed
    with whole_file(path) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, header=np.array(text), **arrays)
