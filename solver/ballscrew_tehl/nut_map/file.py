"""The map file: netCDF, self-describing, with the parameters it was built for and a hash of its content.

Written through xarray; read by scipy's netCDF reader, which is imported faster. Nothing is unpickled.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..friction.baselines import nsk_torque
from ..friction.mechanistic import breakaway_factor, law_constants, roughness_of
from ..friction.origin import carried_over, refuse_other_fit
from ..friction.presliding import presliding_angle
from ..friction.sets import FrictionSet, default_friction_set
from ..parameters.file import Parameters, ScrewParameters, load_screw
from ..parameters.identity import (
    SCREW_FILE,
    differences,
    map_parameters,
    map_parameters_json,
    parameters_hash,
    screw_file_json,
)
from ..parameters.packaged_data import PACKAGED_DATA
from ..physics.axial_stiffness import axial_stiffness, contact_stiffness
from ..physics.ball_law import loaded_contact_angle
from ..physics.hertz import RACEWAYS
from ..runtime.evaluate import NutMap
from ..runtime.packed import (
    DEFAULTS,
    FILM_SHEAR,
    FORCE_CURVES,
    MECHANISTIC,
    SURFACES,
    TORQUE_CURVES,
    TORQUE_SURFACES,
    MapError,
    sealed,
)
from ..whole_file import whole_file
from .contacts import (
    BUILD_MAP,
    POINTS,
    QUANTITIES,
    ROLLING_FRAME,
    VISCOUS,
    Array,
    ContactRange,
    SolvedContacts,
)
from .interval import BAND, band, band_numbers, band_point

if TYPE_CHECKING:
    from .contact_map import ContactMap
    from .grid import BuiltMap

#: dimensions, values and attributes of a variable of the file
Variable = tuple[tuple[str, ...], Array, dict[str, str]]

#: another one also if the coordinates and formulas change that the kriging of a header holds for (contact_map)
FILE_FORMAT = 8
#: first bytes of a netCDF file that scipy writes
MAGIC = b"CDF"
#: name of the packaged map of the mechanistic set
VG100 = "vg100"
#: dimensions of the arrays of a file, but for VISCOUS, and what they hold
KNOTS = ("force_knot", "speed_knot", "temperature_knot")
STORED = {
    "extreme_coefficients": (
        (*KNOTS, "extreme_column"),
        "the same for the load-carrying balls: " + ", ".join(SURFACES[FILM_SHEAR][TORQUE_SURFACES:]),
    ),
    "force_coefficients": (
        ("force_knot", "force_column"),
        "the same over force alone: " + ", ".join(FORCE_CURVES),
    ),
    "separation_coefficients": (
        ("preload_knot", "side"),
        "the same: ln of separation load over preload, axial load > 0 and < 0",
    ),
    "sharing_coefficients": (
        ("preload_knot", "share_knot", "side"),
        "the same: (force of the relieved nut over preload)^(2/3) over axial load/separation load",
    ),
}


def packaged_map(name: str) -> Path:
    """File of a packaged map of the GD4008-3: "published", or VG100 with the oil of the mechanistic set."""
    return PACKAGED_DATA / f"map_gd4008_{name}.nc"


def _file_hash(header: str, variables: Mapping[str, Array]) -> str:
    digest = hashlib.sha256(header.encode())
    for name in sorted(variables):
        array = np.ascontiguousarray(variables[name], dtype="<f8")
        digest.update(f"{name}{array.shape}".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def is_map_file(path: Path) -> bool:
    """Whether a file begins like a map of any format, which a new map may replace."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(len(MAGIC)) == MAGIC


def save_map(path: Path | str, built: BuiltMap, certificate: Mapping[str, Any]) -> str:
    """Write a map to a temporary file next to `path` and rename it; returns the content hash.

    certificate: deviation of the map from direct solves (certificate.deviation_from_direct), stored unchanged
    """
    import xarray as xr

    contact_map = built.contact_map
    text = json.dumps(_header(built, certificate), sort_keys=True)
    variables = _spline_variables(built.arrays) | _contact_variables(contact_map)
    digest = _file_hash(text, {name: array for name, (_, array, _) in variables.items()})
    attributes = {
        "title": f"Nut map of {contact_map.parameters.name}, kinematics {built.header['kinematics']}",
        "source": f"ballscrew_tehl {built.header['version']}, thermal EHL solves of single balls",
        "format_version": FILE_FORMAT, "content_hash": digest, "header": text,
    }  # fmt: skip
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with whole_file(path) as temporary:
            xr.Dataset(variables, attrs=attributes).to_netcdf(
                temporary, engine="scipy", format="NETCDF3_64BIT"
            )
    except OSError as error:
        # a failed write, as on a full disk, names no file
        raise OSError(error.errno, error.strerror, str(path)) from error
    return digest


def _header(built: BuiltMap, certificate: Mapping[str, Any]) -> dict[str, Any]:
    contact_map, parameters = built.contact_map, built.contact_map.parameters
    return dict(
        built.header,
        certificate=dict(certificate),
        contact_range=asdict(contact_map.range),
        contact_cell=list(contact_map.cell),
        kriging={
            raceway: {name: model.kriging(name).hyper.tolist() for name in model.interpolated}
            for raceway, model in contact_map.models.items()
        },
        parameters_json=map_parameters_json(parameters),
        parameters_hash=parameters_hash(parameters),
        screw_file=screw_file_json(parameters),
    )


def _spline_variables(arrays: Mapping[str, Array]) -> dict[str, Variable]:
    """B-spline coefficients of the nut."""
    variables: dict[str, Variable] = {}
    for name, array in arrays.items():
        if name in STORED:
            dimensions, text = STORED[name]
        else:
            law = MECHANISTIC if name == f"{VISCOUS}{MECHANISTIC}" else FILM_SHEAR
            dimensions = (*KNOTS, "viscous_column")
            text = "uniform cubic B-spline coefficients of ln values of one nut: " + ", ".join(
                SURFACES[law][:TORQUE_SURFACES]
            )
        variables[name] = dimensions, array, {"long_name": text}
    return variables


def _contact_variables(contact_map: ContactMap) -> dict[str, Variable]:
    """Solved contacts by raceway."""
    variables: dict[str, Variable] = {}
    for raceway in RACEWAYS:
        contacts, dimensions = contact_map.contacts[raceway], (f"{raceway}_contact",)
        columns = dict(zip(POINTS, contacts.points.T, strict=True)) | dict(contacts.values)
        for name, unit in (POINTS | QUANTITIES).items():
            long_name = f"{name.replace('_', ' ')} of a solved contact of one ball on the {raceway} raceway"
            attributes = {"units": unit, "long_name": long_name}
            variables[f"{raceway}_contact_{name}"] = dimensions, columns[name], attributes
    return variables


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Array]]:
    """Header and variables of a file, checked against its own hash."""
    from scipy.io import netcdf_file

    if not path.exists():
        raise MapError(f"{path}: no such map file: build it with {BUILD_MAP}")
    damaged = f"{path}: not a readable map file ({{}}): build one with {BUILD_MAP}"
    try:
        known = is_map_file(path)
    except OSError as error:
        raise MapError(damaged.format(error.strerror)) from error
    if not known:
        raise MapError(damaged.format("a folder" if path.is_dir() else "of another kind"))
    try:
        with netcdf_file(path, "r", mmap=False) as file:
            attributes = {name: getattr(file, name) for name in ("format_version", "content_hash", "header")}
            variables = {
                name: np.array(variable[...], dtype=np.float64) for name, variable in file.variables.items()
            }
        found = int(attributes["format_version"])
        text, digest = attributes["header"].decode(), attributes["content_hash"].decode()
        header = json.loads(text) if found == FILE_FORMAT else {}
    except Exception as error:  # damaged netCDF fails in many ways
        raise MapError(damaged.format("cut short or damaged")) from error
    if found != FILE_FORMAT:
        raise MapError(f"{path}: map file format {found}; expected {FILE_FORMAT}: build it with {BUILD_MAP}")
    actual = _file_hash(text, variables)
    if actual != digest:
        raise MapError(
            f"{path}: content hash {actual[:12]}; expected {digest[:12]}: the file was changed or damaged"
        )
    return dict(header, file_hash=digest), variables


class OtherParametersError(MapError):
    """A map of another screw or oil; reason: which one was tried, and what differs."""

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(reason, remedy)
        self.reason = reason

    def __str__(self) -> str:
        return ": ".join(self.args)


def _refuse_other_parameters(
    path: Path, header: Mapping[str, Any], parameters: Parameters, packaged: bool
) -> None:
    """packaged : no map was given, so that the packaged one was tried.

    Raises       OtherParametersError
    """
    found = differences(header["parameters_json"], map_parameters_json(parameters))
    if found is None:
        return
    theirs, ours = found
    if packaged:
        raise OtherParametersError(
            f"no packaged map fits {ours}; {path.name} is of {theirs}",
            f"build one ({BUILD_MAP}) and give it with --map, or solve points with ballscrew torque --direct",
        )
    raise OtherParametersError(
        f"{path}: this map is of {theirs}; the screw file is of {ours}",
        f"{BUILD_MAP} makes its own (about 70 s)",
    )


def _path_for(path: Path | str | None, parameters: Parameters) -> Path:
    rolling = parameters.friction.kinematics == ROLLING_FRAME
    return packaged_map(VG100 if rolling else "published") if path is None else Path(path)


def _provenance(friction: FrictionSet, parameters: Parameters, axes: Mapping[str, Any]) -> dict[str, Any]:
    """Entry of the header about the friction parameters; infinite limits become None, for JSON has no infinity."""
    preload = band_point(axes, parameters.screw)[0]
    return {
        "set": friction.name,
        "loss": friction.loss,
        "provenance": friction.provenance,
        "carried_over": carried_over(friction, parameters),
        "catalogue": {"preload": preload, "torque": float(nsk_torque(parameters.screw, preload))},
        "errors": {name: value for name, value in friction.errors.items() if math.isfinite(value)},
        "limits": {
            name: [ends["low"], ends["high"] if math.isfinite(ends["high"]) else None]
            for name, ends in friction.limits.items()
        },
        "not_identified": None if friction.not_identified is None else dict(friction.not_identified),
    }


def screw_of_map(path: Path | str) -> Parameters:
    """Screw and oil that a map file was built for.

    Raises       ValueError: missing, damaged or of another format
    """
    header, _ = _read(Path(path))
    try:
        return map_parameters(header)
    except ValueError as error:
        raise MapError(f"{path}: {error}") from error


def parameters_for(path: Path | str | None, parameters: Parameters | None) -> Parameters:
    """The parameters given, else those of the map file, else the packaged ones.

    Raises       ValueError: something else is given, such as the name of a screw file; as screw_of_map
    """
    if parameters is None:
        return load_screw() if path is None else screw_of_map(path)
    if not isinstance(parameters, Parameters):
        raise ValueError(f"parameters = {parameters!r}; needs what load_screw(FILE) returns")
    return parameters


def load_map(
    path: Path | str | None = None,
    parameters: Parameters | None = None,
    friction_set: FrictionSet | None = None,
) -> NutMap:
    """Nut map of a screw, with the film model and the default friction parameters of its friction set.

    Parameters   path : map file; None = the packaged map of the parameters' kinematics
                 parameters : screw and oil, with which those of the file are compared; None = those of the file, and
                 without a file the packaged GD4008-3
                 friction_set : None = the packaged set that the parameters select, with their overrides
    Returns      NutMap, whose evaluate(preload [N], speed [rad/s], temperature [K]) gives torque, films and extremes
    Raises       MapError (a ValueError): missing, damaged, of another format or of other parameters
    Example      the packaged screw at 2000 N, 1000 r/min, 30 C
        >>> state = load_map().evaluate(preload=2000.0, speed=104.7, temperature=303.15)
        >>> f"{state.friction_torque:.2f} N m"
        '1.32 N m'
    """
    parameters = parameters_for(path, parameters)
    packaged, path = path is None, _path_for(path, parameters)
    header, variables = _read(path)
    _refuse_other_parameters(path, header, parameters, packaged)
    header[SCREW_FILE] = screw_file_json(parameters)
    if friction_set is not None:
        refuse_other_fit(friction_set, parameters)
    friction = friction_set or default_friction_set(parameters)
    film = friction.film_model
    if f"{VISCOUS}{film}" not in variables:
        known = ", ".join(name.removeprefix(VISCOUS) for name in variables if name.startswith(VISCOUS))
        raise MapError(
            f"{path}: friction set {friction.name} needs the film {film}; the map of the kinematics "
            f"{header['kinematics']} holds {known}: choose another set"
        )
    if film == MECHANISTIC:
        _sum_for_constants(header, variables, parameters)
        header[BAND] = _band(header, variables, parameters, friction)
    viscous = variables[f"{VISCOUS}{film}"], variables["extreme_coefficients"]
    arrays = {"coefficients": np.concatenate(viscous, axis=-1)}
    arrays |= {name: variables[name] for name in STORED if name != "extreme_coefficients"}
    defaults = dict(zip(DEFAULTS, _defaults(friction, parameters), strict=True))
    law = MECHANISTIC if film == MECHANISTIC else FILM_SHEAR
    header = dict(
        header,
        film_model=film,
        law=law,
        defaults=defaults,
        friction=_provenance(friction, parameters, header["axes"]),
        presliding_angle=presliding_angle(parameters.screw, 1.0),
    )
    header["screw"] = screw_numbers(parameters.screw, band_point(header["axes"], parameters.screw)[0])
    return NutMap(sealed(header, arrays), arrays)


def screw_numbers(screw: ScrewParameters, preload: float) -> dict[str, float]:
    """Numbers that transmission and axis need: lead, diameter [m], stiffness of the nut at a preload [N/m], [N].

    The contacts keep the angle that they have under this preload.
    """
    angle = float(loaded_contact_angle(screw, preload, screw.loaded_ball_count))
    stiffness = float(axial_stiffness(contact_stiffness(screw, angle), preload))
    return {
        "lead": screw.lead,
        "diameter": 2.0 * screw.nominal_radius,
        "nut_stiffness": stiffness,
        "stiffness_preload": preload,
    }


def _defaults(friction: FrictionSet, parameters: Parameters) -> tuple[float, ...]:
    """Start values of packed.DEFAULTS."""
    if friction.film_model != MECHANISTIC:
        return (*friction.values, 1.0)
    ratio, net, _ = friction.values
    return ratio, net, roughness_of(parameters.friction), breakaway_factor(parameters.friction)


def _sum_for_constants(header: dict[str, Any], variables: dict[str, Array], parameters: Parameters) -> None:
    """Sum the law anew (seconds) if the map is of other constants of the mechanistic law than the parameters."""
    constants = law_constants(parameters)
    if header[MECHANISTIC] == constants:
        return
    from .build import mechanistic_coefficients

    surfaces, curves = mechanistic_coefficients(
        parameters, _contact_map(header, variables, parameters), header
    )
    variables[f"{VISCOUS}{MECHANISTIC}"] = surfaces
    # pressure and load of the last two columns do not depend on the law
    stored = variables["force_coefficients"][:, TORQUE_CURVES:]
    variables["force_coefficients"] = np.concatenate([curves, stored], axis=-1)
    header[MECHANISTIC] = constants


def _band(
    header: Mapping[str, Any], variables: Mapping[str, Array], parameters: Parameters, friction: FrictionSet
) -> dict[str, Any]:
    """Band of the torque at the point of the header: of the file if it is for these numbers, or anew (0.1 s)."""
    stored = header[BAND]
    if stored["numbers"] != band_numbers(parameters, friction):
        stored = band(parameters, _contact_map(header, variables, parameters), header["axes"], friction)
    return dict(stored, fitted=stored["numbers"]["fit"] is not None)


def load_contact_map(path: Path | str | None, parameters: Parameters) -> ContactMap:
    """Contact samples of a map file; arguments and errors as load_map."""
    packaged, path = path is None, _path_for(path, parameters)
    header, variables = _read(path)
    _refuse_other_parameters(path, header, parameters, packaged)
    return _contact_map(header, variables, parameters)


def _contact_map(
    header: Mapping[str, Any], variables: Mapping[str, Array], parameters: Parameters
) -> ContactMap:
    from .contact_map import ContactMap

    ends = header["contact_range"]
    load, speed, temperature = (
        (float(low), float(high)) for low, high in (ends[name] for name in ("load", "speed", "temperature"))
    )
    range_ = ContactRange(load, speed, temperature, float(ends["preloaded"]))
    contacts = {
        raceway: SolvedContacts(
            np.stack([variables[f"{raceway}_contact_{name}"] for name in POINTS], axis=1),
            {name: variables[f"{raceway}_contact_{name}"] for name in QUANTITIES},
        )
        for raceway in RACEWAYS
    }
    hyper = {
        raceway: {name: np.array(values) for name, values in by_name.items()}
        for raceway, by_name in header["kriging"].items()
    }
    return ContactMap(parameters, range_, contacts, hyper, header["atlas"])
