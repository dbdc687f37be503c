"""The map file: .npz with a header, the parameters it was built for and a hash of its content."""

import json
import zipfile
from pathlib import Path
from typing import Any

from ..numerics import Array
from ..parameters import identity
from ..parameters.file import PACKAGED_DATA
from ..runtime.packed import MapError, content_hash, npz_bytes, read_npz
from ..whole_file import whole_file
from .grid import BuiltMap

FILE_FORMAT = 11
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
    header = header_of(built)
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with whole_file(path) as temporary:
            temporary.write_bytes(npz_bytes(header, built.arrays))
    except OSError as error:
        # a failed write, as on a full disk, names no file
        raise OSError(error.errno, error.strerror, str(path)) from error
    return str(header["file_hash"])


def header_of(built: BuiltMap) -> dict[str, Any]:
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


def read_map(path: Path) -> tuple[dict[str, Any], dict[str, Array]]:
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
