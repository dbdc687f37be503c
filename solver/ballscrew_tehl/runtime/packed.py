"""Format of a nut map: what its arrays hold, how they are checked, and its .npz form inside the FMU.

Numpy and the standard library only.
"""

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

FORMAT_VERSION = 5


class Law(StrEnum):
    """Friction law of a nut, which decides surface speeds, films and fitted numbers.

    THREE_PARAMETER: shear of the whole film of balls that slide, of the paper; MECHANISTIC: power balance of balls that
    roll.
    """

    THREE_PARAMETER = "three_parameter"
    MECHANISTIC = "mechanistic"


EXTREMES = (  # surfaces of both laws, after those of torque
    "minimum_film_screw",  # [m] thermal
    "minimum_film_nut",
    "central_film_screw",
    "central_film_nut",
    "temperature_rise_screw",  # [K]
    "temperature_rise_nut",
)
SURFACES = {  # by law: logarithms over (ln force, ln speed, temperature) of one nut, raceway screw before nut
    Law.THREE_PARAMETER: (
        "viscous_torque_screw",  # [N.m] at apparent viscosity ratio 1 and full viscous share
        "viscous_torque_nut",
        "effective_film_screw",  # [m] isothermal, for the viscous share at a roughness height
        "effective_film_nut",
        *EXTREMES,
    ),
    Law.MECHANISTIC: (
        "rolling_torque_screw",  # [N.m] hydrodynamic rolling loss, without the oil between balls
        "rolling_torque_nut",
        "shear_torque",  # [N.m] spin, differential and helix slip
        "thrust_factor",  # [1] by which asperities raise the thrust of balls on each other; < 1: slower oversize balls
        *EXTREMES,
    ),
}
FORCE_CURVES = (  # logarithms over ln force of one nut
    "hysteresis_torque",  # [N.m]
    "sliding_torque",  # [N.m] at net sliding coefficient 1; mechanistic: ball on ball at thrust factor 1 too
    "free_shear_share",  # [1] shear of a ball that only two flanks hold over that of four; 1: no oversize balls
    "free_sliding_share",  # [1] the same of the speed at which neighbours slide on each other
    "boundary_shear",  # [N.m] shear torque where asperities carry all of the load, at any speed; mechanistic
    "neighbour_drag",  # [1] torque of the oil between balls over the surface `drag`; mechanistic, as the next
    "neighbour_limit",  # [N.m] above which the contacts of the balls cannot transmit it
    "contact_pressure_max",  # [Pa]
    "ball_load_max",  # [N]
)
TORQUE_SURFACES, TORQUE_CURVES = 4, 7  # columns that a torque needs; they come first
#: [N], [rad/s], [K], [N], 1, stretched [K]; each lo, hi, nodes
AXES = ("force", "speed", "temperature", "preload", "share", "difference")
POINT = ("preload", "speed", "temperature", "axial_load")  # [N], [rad/s], [K], [N]; of a certificate
_EPOCH = (1980, 1, 1, 0, 0, 0)


class FrictionParameters(NamedTuple):
    """Parameters of the friction law whose start values a map carries; floats, or arrays of one shape."""

    apparent_viscosity_ratio: Any
    net_sliding_coefficient: Any
    roughness_height: Any  # [m]
    breakaway_factor: Any  # Coulomb part at standstill over that in a full film; up to 1: off


DEFAULTS = FrictionParameters._fields


class MapError(ValueError):
    """A map that cannot be used; the message says what was found and what is expected."""


#: totals of the regions of a certificate that are shown
REGION_TOTALS = (
    "points", "torque_error_99", "torque_error_max", "film_error_99", "temperature_rise_error_99",
)  # fmt: skip


def certificate_totals(certificate: Mapping[str, Any]) -> dict[str, Any]:
    """Certificate in one table: of its regions, the keys REGION_TOTALS with the name of the region before them."""
    totals = {name: value for name, value in certificate.items() if not isinstance(value, Mapping)}
    for region, errors in certificate.get("regions", {}).items():
        totals |= {f"{region.replace(' ', '_')}_{name}": errors[name] for name in REGION_TOTALS}
    return totals


def content_hash(header: Mapping[str, Any], arrays: Mapping[str, NDArray[np.float64]]) -> str:
    """sha256 over the header (without its own content_hash) and every array."""
    digest = hashlib.sha256(_header_bytes({k: v for k, v in header.items() if k != "content_hash"}))
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name], dtype="<f8")
        digest.update(f"{name}{array.shape}".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def map_hash(header: Mapping[str, Any]) -> str:
    """Hash that a map is named by: of its file, whatever friction set it is used with; without one of its content."""
    return str(header.get("file_hash", header["content_hash"]))


def sealed(header: Mapping[str, Any], arrays: Mapping[str, NDArray[np.float64]]) -> dict[str, Any]:
    """Header with format_version and the content_hash that belongs to it and to the arrays."""
    complete = {**header, "format_version": FORMAT_VERSION}
    return {**complete, "content_hash": content_hash(complete, arrays)}


def check(header: Mapping[str, Any], arrays: Mapping[str, NDArray[np.float64]]) -> None:
    """Refuse by MapError a map of another format, or one that is not as it was sealed."""
    result = header.get("format_version")
    if result != FORMAT_VERSION:
        raise MapError(f"map format version {result}; expected {FORMAT_VERSION}: build the map again")
    expected, actual = header.get("content_hash"), content_hash(header, arrays)
    if expected != actual:
        raise MapError(f"map content hash {actual[:12]}; expected {str(expected)[:12]}: changed or damaged")


def npz_bytes(header: Mapping[str, Any], arrays: Mapping[str, NDArray[np.float64]]) -> bytes:
    """The map as the bytes of an .npz file: same map, same bytes (fixed dates and order, stored)."""
    members: dict[str, NDArray[Any]] = {"header": np.frombuffer(_header_bytes(header), dtype=np.uint8)}
    members.update({name: np.ascontiguousarray(arrays[name], dtype="<f8") for name in sorted(arrays)})
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, array in members.items():
            data = io.BytesIO()
            np.lib.format.write_array(data, array, version=(1, 0), allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy", _EPOCH), data.getvalue())
    return out.getvalue()


def read_npz(path: Path | str) -> tuple[dict[str, Any], dict[str, NDArray[np.float64]]]:
    """Header and arrays of an .npz map, nothing unpickled; MapError: not readable as a map; OSError: no such file."""
    try:
        with np.load(path, allow_pickle=False) as members:
            arrays = {name: members[name] for name in members.files}
        header = json.loads(arrays.pop("header").tobytes())
    except FileNotFoundError:
        raise
    except Exception as error:  # a damaged zip, array or header fails in many ways; all mean the same
        raise MapError(f"{path}: not a readable nut map (.npz with a header): {error}") from error
    return header, arrays


def _header_bytes(header: Mapping[str, Any]) -> bytes:
    return json.dumps(header, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()
