"""Maps that were made for screw files, kept in the cache of the user: a screw is summed once, not at every command.

The name of a file is the hash of all that its map follows from: screw, oil, constants of the law, range, atlas, and the
sources of the chain, so that a change of the model makes new maps.
"""

import hashlib
import json
from contextlib import suppress
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any

from ..atlas.contact_atlas import load_atlas
from ..friction.mechanistic import law_constants
from ..numerics import Array
from ..parameters import identity
from ..parameters.file import Parameters
from ..runtime.packed import MapError
from ..runtime.user_cache import digest, user_cache
from .build import LAW_CONSTANTS, build_map
from .file import header_of, read_map, save_map
from .grid import BuiltMap, MapGrid, Progress

PACKAGE = Path(__file__).parents[1]
#: folders whose sources a map follows from
CHAIN = ".", "parameters", "physics", "atlas", "friction", "nut_map", "runtime"
KEPT = 32  # files, of 2 MB; the least recently used go


@cache
def chain_hash() -> str:
    """Hash of the sources of the chain."""
    sources = (file for folder in CHAIN for file in (PACKAGE / folder).glob("*.py"))
    return digest({file.relative_to(PACKAGE).as_posix(): file.read_bytes() for file in sources})


def map_of_screw(
    parameters: Parameters, grid: MapGrid, progress: Progress | None
) -> tuple[dict[str, Any], dict[str, Array]]:
    """Header and arrays of the map of a screw, from the cache or made now; errors as build_map."""
    what = identity.map_parameters_json(parameters), law_constants(parameters), asdict(grid)
    key = json.dumps([*what, load_atlas().hash, chain_hash()], sort_keys=True)
    file = None
    with suppress(OSError, RuntimeError):  # no home folder, or one that cannot be written
        file = user_cache() / "maps" / f"{hashlib.sha256(key.encode()).hexdigest()[:24]}.npz"
        file.parent.mkdir(parents=True, exist_ok=True)
        with suppress(MapError):
            header, arrays = read_map(file)
            if (header["parameters_json"], header[LAW_CONSTANTS]) == (what[0], what[1]):
                with suppress(OSError):
                    file.touch()
                # entries that no map depends on are those of this screw file
                del header["file_hash"]
                return header_of(BuiltMap(header, arrays, parameters)), arrays
    built = build_map(parameters, grid, progress)
    if file is not None:
        with suppress(OSError):
            save_map(file, built)
            for old in sorted(file.parent.iterdir(), key=lambda path: -path.stat().st_mtime)[KEPT:]:
                old.unlink()
    return header_of(built), built.arrays
