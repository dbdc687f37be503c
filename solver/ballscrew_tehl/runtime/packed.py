"""Format of a nut map: what its arrays hold, how they are checked, and its .npz form inside the FMU.

Numpy and the standard library only.
"""

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

FORMAT_VERSION = 3
FILM_SHEAR, MECHANISTIC = "film_shear", "mechanistic"  # friction laws, header["law"]
_EXTREMES = (
    "minimum_film_screw",  # [m] thermal
    "minimum_film_nut",
    "central_film_screw",
    "central_film_nut",
    "temperature_rise_screw",  # [K]
    "temperature_rise_nut",
)
SURFACES = {  # by law: logarithms over (ln force, ln speed, temperature) of one nut, raceway screw before nut
    FILM_SHEAR: (
        "viscous_torque_screw",  # [N.m] at apparent viscosity ratio 1 and full viscous share
        "viscous_torque_nut",
        "effective_film_screw",  # [m] isothermal, for the viscous share at a roughness height
        "effective_film_nut",
        *_EXTREMES,
    ),
    MECHANISTIC: (
        "rolling_torque_screw",  # [N.m] hydrodynamic rolling loss
        "rolling_torque_nut",
        "shear_torque",  # [N.m] spin, differential and helix slip
        "thrust_factor",  # [1] >= 1, by which asperities raise the thrust of balls on each other
        *_EXTREMES,
    ),
}
FORCE_CURVES = (  # logarithms over ln force of one nut
    "hysteresis_torque",  # [N.m]
    "sliding_torque",  # [N.m] at net sliding coefficient 1; mechanistic: ball on ball at thrust factor 1 too
    "free_shear_share",  # [1] shear of a ball that only two flanks hold over that of four; 1: no oversize balls
    "contact_pressure_max",  # [Pa]
    "ball_load_max",  # [N]
)
COLUMNS = len(SURFACES[FILM_SHEAR])  # the same in each law
TORQUE_SURFACES, TORQUE_CURVES = 4, 3  # columns that a torque needs; they come first
AXES = ("force", "speed", "temperature", "preload", "share")  # [N], [rad/s], [K], [N], 1; each lo, hi, nodes
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


def array_shapes(header: Mapping[str, Any]) -> dict[str, tuple[int, ...]]:
    """Shape of each array, from the axes of the header."""
    force, speed, temperature, preload, share = (int(header["axes"][name][2]) + 2 for name in AXES)
    return {
        "coefficients": (force, speed, temperature, COLUMNS),
        "force_coefficients": (force, len(FORCE_CURVES)),
        "separation_coefficients": (preload, 2),
        "sharing_coefficients": (preload, share, 2),
    }


#: totals of the regions of a certificate that are shown
REGION_TOTALS = (
    "points",
    "torque_error_99",
    "torque_error_max",
    "film_error_99",
    "temperature_rise_error_99",
)


def certificate_totals(certificate: Mapping[str, Any]) -> dict[str, Any]:
    """Certificate without its points ("each": columns POINT and the errors there).

    Of its regions, the keys REGION_TOTALS with the name of the region before them.
    """
    totals = {name: value for name, value in certificate.items() if name not in ("each", "regions")}
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
    """Hash that a map is named by everywhere: of its file, whatever friction set it is used with.

    Of its content, if it has not been read from a file.
    """
    return str(header.get("file_hash", header["content_hash"]))


def sealed(header: Mapping[str, Any], arrays: Mapping[str, NDArray[np.float64]]) -> dict[str, Any]:
    """Header with format_version and the content_hash that belongs to it and to the arrays."""
    complete = {**header, "format_version": FORMAT_VERSION}
    return {**complete, "content_hash": content_hash(complete, arrays)}


def check(header: Mapping[str, Any], arrays: Mapping[str, NDArray[np.float64]]) -> None:
    """Refuse a map of another format, with missing, misshaped or non-finite arrays, or with changed content.

    Raises       MapError, one line
    """
    found = header.get("format_version")
    if found != FORMAT_VERSION:
        raise MapError(f"map format version {found}; expected {FORMAT_VERSION}: build the map again")
    law = header.get("law")
    if law not in SURFACES:
        raise MapError(f"map header: law {law}; expected one of {', '.join(SURFACES)}")
    for group, names in (("axes", AXES), ("defaults", DEFAULTS)):
        missing = [name for name in names if name not in header.get(group, {})]
        if missing:
            raise MapError(f"map header: {group} {', '.join(missing)} missing; expected {', '.join(names)}")
    angle = header.get("presliding_angle")
    if not (isinstance(angle, float) and 0.0 < angle < np.inf):
        raise MapError(f"map header: presliding_angle {angle}; expected a positive number [rad/N^(1/3)]")
    for name in AXES:
        lo, hi, nodes = header["axes"][name]
        logarithmic = name in ("force", "speed", "preload")
        if not (nodes >= 4 and lo < hi and np.isfinite(hi) and (lo > 0.0 or not logarithmic)):
            raise MapError(
                f"map axis {name} = {lo}, {hi}, {nodes} nodes; expected lo < hi and 4 nodes at least"
            )
    for name, shape in array_shapes(header).items():
        if name not in arrays:
            raise MapError(f"map array {name} missing; found {', '.join(sorted(arrays)) or 'none'}")
        if arrays[name].shape != shape:
            raise MapError(f"map array {name} has shape {arrays[name].shape}; expected {shape}")
        if not np.isfinite(arrays[name]).all():
            raise MapError(f"map array {name} holds values that are not finite")
    expected = header.get("content_hash")
    actual = content_hash(header, arrays)
    if expected != actual:
        raise MapError(
            f"map content hash {actual[:12]}; expected {str(expected)[:12]}: the map was changed or damaged"
        )


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
    """Header and arrays of an .npz map; nothing is unpickled.

    Raises       MapError: not readable as a map; OSError: no such file
    """
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
