"""A nut map with the friction parameters of its screw: from a file, the package, the cache, or made now."""

import math
from functools import lru_cache
from pathlib import Path
from typing import Any

from ..friction.drag_torque import screw_friction_set
from ..friction.mechanistic import breakaway_factor, law_constants, roughness_of
from ..friction.sets import FrictionSet, carried_over, refuse_other_fit, with_supply
from ..numerics import Array
from ..parameters import identity
from ..parameters.file import Parameters, load_screw
from ..parameters.screw import ScrewParameters
from ..physics.ball_law import loaded_contact_angle
from ..physics.rating import nsk_torque
from ..physics.stiffness import axial_stiffness, nut_stiffness_constant, presliding_angle
from ..runtime.evaluate import NutMap
from ..runtime.packed import DEFAULTS, Law, MapError, sealed
from .build import LAW_CONSTANTS
from .file import VG100, header_of, packaged_map, read_map
from .grid import BuiltMap, Progress, grid_of, screw_grid
from .interval import BAND, band, band_point
from .kept import map_of_screw


def _provenance(friction: FrictionSet, parameters: Parameters, preload: float) -> dict[str, Any]:
    """Entry of the header about the friction parameters; infinite limits become None, for JSON has no infinity."""
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
    """Screw and oil that a map file was built for; MapError: missing, damaged or of another format."""
    header, _ = read_map(Path(path))
    try:
        return identity.map_parameters(header)
    except ValueError as error:
        raise MapError(f"{path}: {error}") from error


def parameters_for(path: Path | str | None, parameters: Parameters | None) -> Parameters:
    """The parameters given, else those of the map file, else the packaged ones; ValueError for anything else."""
    if parameters is None:
        return load_screw() if path is None else screw_of_map(path)
    if not isinstance(parameters, Parameters):
        raise ValueError(f"parameters = {parameters!r}; needs what load_screw(FILE) returns")
    return parameters


def load_map(
    path: Path | str | None = None,
    parameters: Parameters | None = None,
    friction_set: FrictionSet | None = None,
    progress: Progress | None = None,
) -> NutMap:
    """Nut map of a screw, with the default friction parameters of its friction set.

    Parameters
    ----------
    path : path or str, optional
        Map file, or a screw file *.toml, whose map is made in memory in some seconds; None: the packaged map of the
        parameters, else one made in memory.
    parameters : Parameters, optional
        Screw and oil, with which those of a map file are compared; None: those of the file, and without a file the
        packaged GD4008-3.
    friction_set : FrictionSet, optional
        None: by the drag torque of the screw file, else the packaged set of its law, with its overrides.
    progress : callable, optional
        Called while a map is made.

    Returns
    -------
    NutMap
        Its evaluate(preload [N], speed [rad/s], temperature [K]) gives torque, films and extremes.

    Raises
    ------
    MapError
        A ValueError: missing, damaged, of another format or of other parameters.
    OutsideAtlasError
        A ValueError: a screw or oil that the atlas does not include.

    Examples
    --------
    The packaged screw at 2000 N, 1000 r/min, 30 C:

    >>> state = load_map().evaluate(preload=2000.0, speed=104.7, temperature=303.15)
    >>> f"{state.friction_torque:.2f} N m"
    '1.32 N m'
    """
    if path is not None and Path(path).suffix == ".toml":
        path, parameters = None, load_screw(path) if parameters is None else parameters
    parameters = with_supply(parameters_for(path, parameters), friction_set)
    if path is not None:
        header, arrays = read_map(Path(path))
        if header["law"] != parameters.friction.law:
            raise MapError(
                f"{path}: this map is of the law {header['law']}; expected {parameters.friction.law}"
            )
        if other := _differences(header["parameters_json"], parameters):
            raise MapError(
                f"{path}: this map is of {other[0]}; the screw file is of {other[1]}: without --map a map of the screw "
                "file is made"
            )
    elif (packaged := packaged_map_of(parameters)) is not None:
        header, arrays = packaged
    else:
        header, arrays = map_of_screw(parameters, screw_grid(parameters), progress)
    header[identity.SCREW_FILE] = identity.screw_file_json(parameters)
    if friction_set is not None:
        refuse_other_fit(friction_set, parameters)
    numbers = friction_set or screw_friction_set(parameters)
    return _with_friction(header, arrays, parameters, numbers, progress)


def refuse_other_map(nut_map: NutMap, parameters: Parameters) -> None:
    """Refuse a map of another screw or oil: MapError."""
    if other := _differences(nut_map.header["parameters_json"], parameters):
        raise MapError(f"this map is of {other[0]}; the screw is of {other[1]}: take the map of this screw")


@lru_cache(maxsize=64)
def _differences(of_map: str, parameters: Parameters) -> tuple[str, str] | None:
    """What tells the screw and oil of a map from these."""
    return identity.differences(of_map, identity.map_parameters_json(parameters))


def packaged_map_of(parameters: Parameters) -> tuple[dict[str, Any], dict[str, Array]] | None:
    """Header and arrays of the packaged map of a screw; None: there is none, or its file asks for another range."""
    rolling = parameters.friction.law is Law.MECHANISTIC
    header, arrays = read_map(packaged_map(VG100 if rolling else "published"))
    other = _differences(header["parameters_json"], parameters)
    return None if other or parameters.map != type(parameters.map)() else (header, arrays)


def nut_map_of(built: BuiltMap) -> NutMap:
    """A map that was built, with the default friction parameters of its screw, without a file."""
    return _with_friction(
        header_of(built), dict(built.arrays), built.parameters, screw_friction_set(built.parameters)
    )


def _with_friction(
    header: dict[str, Any],
    arrays: dict[str, Array],
    parameters: Parameters,
    friction: FrictionSet,
    progress: Progress | None = None,
) -> NutMap:
    """The map of a file with the numbers of a friction set."""
    defaults = (*friction.values, 1.0)
    if friction.law is Law.MECHANISTIC:
        if header[LAW_CONSTANTS] != law_constants(parameters):
            # of other constants: the law is summed anew, once, in seconds
            header, arrays = map_of_screw(parameters, grid_of(header["axes"]), progress)
        header[BAND] = band(parameters, header["axes"], friction)
        law = parameters.friction
        defaults = (*friction.values[:2], roughness_of(law), breakaway_factor(law))
    preload = band_point(header["axes"], parameters.screw)[0]
    header |= {
        "defaults": dict(zip(DEFAULTS, defaults, strict=True)),
        "friction": _provenance(friction, parameters, preload),
        "presliding_angle": presliding_angle(parameters.screw, 1.0),
        "preload_factor": friction.preload_factor,
        "screw": screw_numbers(parameters.screw, preload),
    }
    return NutMap(sealed(header, arrays), arrays)


def screw_numbers(screw: ScrewParameters, preload: float) -> dict[str, float]:
    """Numbers of a screw for its FMUs (SI), stiffness of the nut at the angle of its contacts under a preload [N]."""
    angle = float(loaded_contact_angle(screw, preload, screw.loaded_ball_count))
    stiffness = axial_stiffness(nut_stiffness_constant(screw, angle), preload)
    return {
        "lead": screw.signed_lead,
        "diameter": 2.0 * screw.nominal_radius,
        "nut_stiffness": stiffness,
        "stiffness_preload": preload,
        **({"seal_torque": screw.seal_torque} if screw.seal_torque else {}),
    }
