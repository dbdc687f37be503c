"""The map file: .npz with a header, the parameters it was built for and a hash of its content; and maps in memory."""

import json
import math
import zipfile
from pathlib import Path
from typing import Any

from ..friction.mechanistic import breakaway_factor, law_constants, roughness_of
from ..friction.sets import FrictionSet, carried_over, default_friction_set, refuse_other_fit, with_supply
from ..numerics import Array
from ..parameters import identity
from ..parameters.file import PACKAGED_DATA, Parameters, ScrewParameters, load_screw
from ..physics.ball_law import loaded_contact_angle
from ..physics.rating import nsk_torque
from ..physics.stiffness import axial_stiffness, nut_stiffness_constant, presliding_angle
from ..runtime.evaluate import NutMap
from ..runtime.packed import DEFAULTS, Law, MapError, content_hash, npz_bytes, read_npz, sealed
from ..whole_file import whole_file
from .build import LAW_CONSTANTS, build_map
from .grid import BuiltMap, Progress, grid_of, screw_grid
from .interval import BAND, band, band_point

FILE_FORMAT = 10
#: the command that messages advise
BUILD_MAP = "ballscrew map build --screw FILE.toml --output MAP.npz"
VG100 = "vg100"  # name of the packaged map of the mechanistic set


def packaged_map(name: str) -> Path:
    """File of a packaged map of the GD4008-3: "published", or VG100 with the oil of the mechanistic set."""
    return PACKAGED_DATA / f"map_gd4008_{name}.npz"


def is_map_file(path: Path) -> bool:
    """Whether a file begins like a map of any format, which a new map may replace."""
    return path.is_file() and zipfile.is_zipfile(path)


def save_map(path: Path | str, built: BuiltMap) -> str:
    """Write a map, completely or not at all.

    Parameters
    ----------
    path : path or str
        File *.npz; its folder is made.
    built : BuiltMap
        Of build_map.

    Returns
    -------
    str
        Hash of the file.

    Raises
    ------
    OSError
        The file cannot be written; names it.

    Examples
    --------
    >>> save_map("my_map.npz", build_map(load_screw("my.toml")))  # doctest: +SKIP
    """
    header = _sealed(built)
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with whole_file(path) as temporary:
            temporary.write_bytes(npz_bytes(header, built.arrays))
    except OSError as error:
        # a failed write, as on a full disk, names no file
        raise OSError(error.errno, error.strerror, str(path)) from error
    return str(header["file_hash"])


def _sealed(built: BuiltMap) -> dict[str, Any]:
    """Header of the file of a map, with its hash."""
    header = dict(
        built.header,
        file_format=FILE_FORMAT,
        parameters_json=identity.map_parameters_json(built.parameters),
        parameters_hash=identity.parameters_hash(built.parameters),
        screw_file=identity.screw_file_json(built.parameters),
    )
    # as it is read again
    header = json.loads(json.dumps(header))
    return dict(header, file_hash=content_hash(header, built.arrays))


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Array]]:
    """Header and arrays of a file, checked against its own hash."""
    if not path.exists():
        raise MapError(f"{path}: no such map file: build it with {BUILD_MAP}")
    try:
        header, arrays = read_npz(path)
    except (MapError, OSError) as error:
        what = "a folder" if path.is_dir() else "of another kind, or cut short"
        raise MapError(f"{path}: not a readable map file ({what}): build one with {BUILD_MAP}") from error
    if header.get("file_format") != FILE_FORMAT:
        raise MapError(
            f"{path}: map file format {header.get('file_format')}; expected {FILE_FORMAT}: build it with {BUILD_MAP}"
        )
    digest = str(header.pop("file_hash", ""))
    actual = content_hash(header, arrays)
    if actual != digest:
        raise MapError(
            f"{path}: content hash {actual[:12]}; expected {digest[:12]}: the file was changed or damaged"
        )
    return dict(header, file_hash=digest), arrays


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
    header, _ = _read(Path(path))
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
        None: the packaged set that the parameters select, with their overrides.
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
        header, arrays = _read(Path(path))
        if other := identity.differences(header["parameters_json"], identity.map_parameters_json(parameters)):
            raise MapError(
                f"{path}: this map is of {other[0]}; the screw file is of {other[1]}: without --map a map of the screw "
                "file is made"
            )
    elif (packaged := packaged_map_of(parameters)) is not None:
        header, arrays = packaged
    else:
        built = build_map(parameters, screw_grid(parameters), progress)
        header, arrays = _sealed(built), built.arrays
    header[identity.SCREW_FILE] = identity.screw_file_json(parameters)
    if friction_set is not None:
        refuse_other_fit(friction_set, parameters)
    numbers = friction_set or default_friction_set(parameters)
    return _with_friction(header, arrays, parameters, numbers, progress)


def packaged_map_of(parameters: Parameters) -> tuple[dict[str, Any], dict[str, Array]] | None:
    """Header and arrays of the packaged map of a screw; None: there is none, or its file asks for another range."""
    rolling = parameters.friction.law is Law.MECHANISTIC
    header, arrays = _read(packaged_map(VG100 if rolling else "published"))
    other = identity.differences(header["parameters_json"], identity.map_parameters_json(parameters))
    return None if other or parameters.map != type(parameters.map)() else (header, arrays)


def nut_map_of(built: BuiltMap) -> NutMap:
    """A map that was built, with the default friction parameters of its screw, without a file."""
    return _with_friction(
        _sealed(built), dict(built.arrays), built.parameters, default_friction_set(built.parameters)
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
            # of other constants: the law is summed anew, in seconds
            arrays = build_map(parameters, grid_of(header["axes"]), progress).arrays
            header |= {LAW_CONSTANTS: law_constants(parameters), "file_hash": ""}
            header["file_hash"] = content_hash(header, arrays)
        header[BAND] = band(parameters, header["axes"], friction)
        law = parameters.friction
        defaults = (*friction.values[:2], roughness_of(law), breakaway_factor(law))
    preload = band_point(header["axes"], parameters.screw)[0]
    header |= {
        "defaults": dict(zip(DEFAULTS, defaults, strict=True)),
        "friction": _provenance(friction, parameters, preload),
        "presliding_angle": presliding_angle(parameters.screw, 1.0),
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
