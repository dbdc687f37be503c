"""Atlas: films and rise of rolling contacts of steel in dimensionless numbers, solved once, packaged.

An isothermal contact is given by M, L, R_x/R_y and the pressure law of its oil: by Z and, for steel, the Hertz
pressure over p_r. Its heating in pure rolling adds N = beta eta0 u_e^2/k and weakly beta and the temperature itself.
Thousands of such contacts (atlas_contacts.py) are interpolated by kriging, in the same quantities as the contacts of a
map (contact_map.py), in pure rolling also rolling loss, core of the pressure and mean rise.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import NdBSpline, make_interp_spline
from scipy.spatial import KDTree

from ..parameters.file import LubricantParameters, Parameters, SolidParameters
from ..parameters.oil import ROELANDS_PRESSURE
from ..parameters.packaged_data import PACKAGED_DATA
from ..physics.ball_formula import moes_groups_of
from ..physics.film import thermal_load_parameter
from ..physics.hertz import RACEWAYS, E_prime, ball_ellipse
from ..physics.kinematics import surface_speeds
from ..physics.lubricant import eta0, temperature_slope
from .contacts import CORE, FILMS, MEAN_RISE, Array, ContactRange
from .kriging import Interpolant

ATLAS_FORMAT = 3
#: steel of the atlas: E' [Pa] and its walls
STEEL_MODULUS = 226e9
STEEL = SolidParameters(density=7800.0, specific_heat=460.0, thermal_conductivity=46.0)
#: relative differences of E' and of the walls' sqrt(k rho c) from those of the atlas, up to which it is used
NEAR_MODULUS, NEAR_EFFUSIVITY = 0.05, 0.2
#: groups of a contact, columns of the atlas; slope: beta [1/K], temperature [K], pressure: p_max [Pa]
GROUPS = ("M", "L", "radius_ratio", "z", "pressure", "N", "slope", "temperature")
#: transition from rigid to flattened contacts: at M (L/12)^0.45 (ratio/0.047)^0.5 = TURN, over WIDTH; the coordinate
#: stretches it. 760 contacts that were left out: mean error of the film 1.1e-3, with a transition at M = 33 2.4e-3
TURN, WIDTH, STRETCH = 25.0, 0.9, 2.7
#: coordinates by quantity; without temperature and slope the mean error of 775 thermal films left out is twice as large
COORDINATES: dict[str, tuple[str, ...]] = {
    FILMS[0]: ("transition", "L", "radius_ratio", "z", "pressure"),
    FILMS[1]: ("M", "N", "L", "radius_ratio", "z", "pressure", "slope", "temperature"),
    FILMS[2]: ("transition", "N", "L", "radius_ratio", "z", "pressure"),
    "temperature_rise": ("transition", "N", "L", "radius_ratio", "z", "pressure", "slope"),
    MEAN_RISE: ("transition", "N", "L", "radius_ratio", "z", "pressure", "slope"),
    "rolling_loss": ("M", "N", "L", "radius_ratio", "z", "pressure", "slope"),
    CORE[0]: ("transition", "N", "L", "radius_ratio", "z", "pressure"),
    CORE[1]: ("transition", "N", "L", "radius_ratio", "z", "pressure"),
}
#: quantities that the atlas holds
HELD = tuple(COORDINATES)
#: ranges by which the coordinates are divided
SPANS = {
    "transition": 12.7, "M": 12.0, "L": 3.0, "radius_ratio": 1.5, "z": 0.35, "pressure": 2.8, "N": 15.0,
    "slope": 0.1, "temperature": 90.0,
}  # fmt: skip
LINEAR = ("z", "slope", "temperature")
#: core of flattened contacts: pressure and area over those of Hertz lack c M^m L^l (R_x/R_y)^r of one, in logarithms;
#: c, m, l, r by least squares over 655 contacts of the atlas above M = 1,000: rms 9e-4 and 14e-4, where the
#: interpolated ones have 3e-3 at M = 3,000 and, few and toward the empty corners, 6e-2 above 1e5
FLATTENED = {CORE[0]: (1.71, -0.780, -0.116, -0.429), CORE[1]: (5.31, -0.790, -0.176, -0.454)}
#: M around which they take over
FLATTENED_M = 1500.0
#: nodes over ln(load), ln(speed eta0) and temperature, between which the atlas is read by cubic splines for one screw:
#: M depends on the first two alone
TABLE_NODES = (33, 41, 7)
#: relative distance beyond the contacts of the atlas that counts as inside
ROUNDING = 1e-6


class AtlasError(ValueError):
    """The atlas file is missing, damaged or of another format."""


def coordinates(name: str, groups: Array) -> Array:
    """Coordinates (n, d) in which a quantity of groups (n, 8) is interpolated."""
    columns = dict(zip(GROUPS, groups.T, strict=True))
    ln = {key: column if key in LINEAR else np.log(column) for key, column in columns.items()}
    at = ln["M"] + 0.45 * (ln["L"] - np.log(12.0)) + 0.5 * (ln["radius_ratio"] - np.log(0.047))
    ln["transition"] = at + STRETCH * np.tanh((at - np.log(TURN)) / WIDTH)
    return np.stack([ln[key] / SPANS[key] for key in COORDINATES[name]], axis=1)


def core_of_flattened(name: str, columns: Mapping[str, Array]) -> Array:
    """What is interpolated of the pressure or area of the core where M is high, by groups, see FLATTENED."""
    lack, m, of_l, r = FLATTENED[name]
    return np.asarray(-lack * columns["M"] ** m * columns["L"] ** of_l * columns["radius_ratio"] ** r)


def oil_groups(oil: LubricantParameters, u_e: Any, temperature: Any) -> tuple[Array, Array]:
    """N and beta [1/K] of an oil at entrainment speeds [m/s] and temperatures [K]."""
    return thermal_load_parameter(oil, u_e, temperature), -temperature_slope(oil, temperature)


def ball_groups(parameters: Parameters, raceway: str, points: Array) -> Array:
    """Groups (n, 8) of the contacts of a ball at points (n, 3) of load [N], speed [rad/s] and temperature [K]."""
    load, speed, temperature = points.T
    groups, R_x, R_y = moes_groups_of(parameters, raceway, load, speed, temperature)
    screw = parameters.screw
    # as in film_formula: the pressure varies little with the angle
    p_max = ball_ellipse(screw, screw.contact_angle, raceway, load).p_max
    u_e = surface_speeds(parameters, raceway, speed).u_e
    N, slope = oil_groups(parameters.lubricant, u_e, temperature)
    z = np.full_like(load, parameters.lubricant.z_roelands)
    ratio = np.broadcast_to(R_x / R_y, load.shape)
    return np.stack([groups.M, groups.L, ratio, z, p_max, N, slope, temperature], axis=1)


def atlas_quantities(parameters: Parameters) -> tuple[str, ...]:
    """Quantities of the contacts of a screw that the atlas holds: none, the isothermal film, or all in pure rolling."""
    oil, solid = parameters.lubricant, parameters.solid
    effusivity = [(s.thermal_conductivity * s.density * s.specific_heat) ** 0.5 for s in (solid, STEEL)]
    if not (
        oil.rheology == "newtonian"
        and oil.pressure_law == "roelands"
        and oil.density_law == "dowson_higginson"
        and abs(oil.roelands_pressure / ROELANDS_PRESSURE - 1.0) <= NEAR_MODULUS
        and abs(E_prime(parameters.screw) / STEEL_MODULUS - 1.0) <= NEAR_MODULUS
    ):
        return ()
    rolling = all(surface_speeds(parameters, raceway, 1.0).srr == 0.0 for raceway in RACEWAYS)
    near = abs(effusivity[0] / effusivity[1] - 1.0) <= NEAR_EFFUSIVITY
    return HELD if rolling and near and oil.viscosity_law != "constant" else FILMS[:1]


class Atlas:
    """The table, read.

    interpolants by quantity; ends (2, 8): least and largest groups of its contacts; header: counts, errors at contacts
    that were not used, version; hash: of the content
    """

    def __init__(
        self, interpolants: Mapping[str, Interpolant], ends: Array, header: Mapping[str, Any]
    ) -> None:
        self.interpolants, self.ends, self.header = dict(interpolants), ends, dict(header)

    def modelled(self, name: str, groups: Array) -> Array:
        """What is interpolated of a quantity at groups (n, 8); of the core what it tends to as well, see FLATTENED."""
        values = self.interpolants[name](coordinates(name, groups))
        if name not in FLATTENED:
            return values
        columns = dict(zip(GROUPS, groups.T, strict=True))
        flattened = 1.0 / (1.0 + (FLATTENED_M / columns["M"]) ** 2)
        return np.asarray(values + flattened * (core_of_flattened(name, columns) - values))

    def of_ball(self, name: str, groups: Array) -> Array:
        """What a map interpolates of a quantity at groups (n, 8): the rise in kelvin, the others as modelled."""
        values = self.modelled(name, groups)
        if name != "temperature_rise":
            return values
        columns = dict(zip(GROUPS, groups.T, strict=True))
        return np.asarray(values + np.log(columns["N"] / columns["slope"]))

    def inside(self, groups: Array) -> Array:
        """Which of some groups (n, 8) lie within those of the contacts of the atlas (n,)."""
        return np.asarray(
            ((groups >= self.ends[0] * (1.0 - ROUNDING)) & (groups <= self.ends[1] * (1.0 + ROUNDING))).all(
                axis=1
            )
        )

    @property
    def hash(self) -> str:
        """Of its arrays."""
        return str(self.header["hash"])


def content_hash(arrays: Mapping[str, Array]) -> str:
    """Hash of the arrays of an atlas."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        digest.update(f"{name}{arrays[name].shape}{arrays[name].dtype.str}".encode())
        digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return digest.hexdigest()


def packaged_atlas() -> Path:
    """File of the packaged atlas."""
    return PACKAGED_DATA / "contact_atlas.npz"


@lru_cache(maxsize=2)
def load_atlas(path: Path | None = None) -> Atlas:
    """Read an atlas file.

    Parameters   path : None = the packaged one
    Raises       AtlasError
    """
    path = path or packaged_atlas()
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        text = str(arrays.pop("header"))
        header = json.loads(text)
        found = header["format"]
    except Exception as error:  # a damaged zip fails in many ways
        raise AtlasError(f"{path}: not a readable atlas ({type(error).__name__}: {error})") from error
    if found != ATLAS_FORMAT:
        raise AtlasError(f"{path}: atlas format {found}; expected {ATLAS_FORMAT}: ballscrew paper atlas")
    digest = content_hash(arrays)
    if digest != header["hash"]:
        raise AtlasError(
            f"{path}: content hash {digest[:12]}; expected {header['hash'][:12]}: the file was damaged"
        )
    groups = arrays["groups"].astype(float)
    interpolants = {}
    for name in HELD:
        rows = arrays[f"{name}_rows"]
        interpolants[name] = Interpolant(
            coordinates(name, groups[rows]),
            arrays[f"{name}_hyper"],
            arrays[f"{name}_slopes"],
            arrays[f"{name}_weights"],
        )
    return Atlas(interpolants, np.array([groups.min(axis=0), groups.max(axis=0)]), header)


class ScrewAtlas:
    """The atlas over the range of one raceway of a screw: what is interpolated of the quantities that it holds.

    Parameters   atlas, parameters, raceway;  range_: of the map
    """

    def __init__(self, atlas: Atlas, parameters: Parameters, raceway: str, range_: ContactRange) -> None:
        self.atlas, self.parameters, self.raceway = atlas, parameters, raceway
        self.quantities = atlas_quantities(parameters)
        thick = np.log(eta0(parameters.lubricant, np.array(range_.temperature)))
        speed = np.log(range_.speed) + np.array([thick.min(), thick.max()])
        ends = (np.log(range_.load), speed, np.array(range_.temperature))
        self._nodes = [
            np.linspace(pair[0], pair[1], count) for pair, count in zip(ends, TABLE_NODES, strict=True)
        ]
        self._splines: dict[str, NdBSpline] = {}

    def _spline(self, name: str) -> NdBSpline:
        if name not in self._splines:
            places = np.stack(np.meshgrid(*self._nodes, indexing="ij"), axis=-1).reshape(-1, 3)
            places[:, 1] -= np.log(eta0(self.parameters.lubricant, places[:, 2]))
            places[:, :2] = np.exp(places[:, :2])
            groups = ball_groups(self.parameters, self.raceway, places)
            table = self.atlas.of_ball(name, groups).reshape(TABLE_NODES)
            knots = []
            for axis, nodes in enumerate(self._nodes):
                spline = make_interp_spline(nodes, table, axis=axis)
                knots.append(spline.t)
                table = np.moveaxis(spline.c, 0, axis)
            self._splines[name] = NdBSpline(tuple(knots), table, 3)
        return self._splines[name]

    def __call__(self, name: str, points: Array) -> Array:
        """What is interpolated of a quantity at points (n, 3) of load [N], speed [rad/s] and temperature [K]."""
        load, speed, temperature = points.T
        at = np.stack(
            [np.log(load), np.log(speed * eta0(self.parameters.lubricant, temperature)), temperature], axis=1
        )
        return np.asarray(self._spline(name)(at))

    def distance(self, points: Array) -> Array:
        """Distance (n,) of points to the next heated contact of the atlas, in lengths of its thermal film."""
        table = self.atlas.interpolants[FILMS[1]]
        lengths = np.exp(table.hyper[:-1])
        at = coordinates(FILMS[1], ball_groups(self.parameters, self.raceway, points))
        return np.asarray(KDTree(table.points / lengths).query(at / lengths)[0])

    def inside(self, points: Array) -> Array:
        """Which of the points lie within the contacts of the atlas (n,)."""
        return self.atlas.inside(ball_groups(self.parameters, self.raceway, points))
