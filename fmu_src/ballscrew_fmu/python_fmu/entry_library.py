"""Entry libraries of the FMU for Python hosts, which call those of pythonfmu."""

import importlib.util
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ballscrew_fmu.models import FmuModel
from ballscrew_fmu.native_fmu.compile import INSTALL, BuildError
from ballscrew_fmu.native_fmu.libraries import contents, entry_library, provider

TOKEN_FILE = "guid.txt"  # in the resources: the GUID that fmi2Instantiate accepts; as in entry.c
PLATFORMS = {  # of pythonfmu: platform, library of pythonfmu in a folder of binaries, suffix of the entry library
    "x86_64-linux": ("linux64", "libpythonfmu-export.so", ".so"),
    "x86_64-windows": ("win64", "pythonfmu-export.dll", ".dll"),
}


def binaries(header: Mapping[str, Any], model: FmuModel) -> dict[str, bytes]:
    """Libraries by path in the FMU: the entry libraries with the name of the model, and beside them pythonfmu's.

    Raises       BuildError: there is no compiler for them, or it fails;  ImportError: pythonfmu is missing
    """
    specification = importlib.util.find_spec("pythonfmu")
    if specification is None or specification.origin is None:
        raise ImportError("module pythonfmu not found; python -m pip install pythonfmu")
    theirs = Path(specification.origin).parent / "resources" / "binaries"
    compiler, library = provider(header), entry_library(header, model)
    platforms = [name for name in library.platforms if name in compiler.platforms]
    if not platforms:
        raise BuildError(
            f"{compiler.name} compiles for {', '.join(compiler.platforms)}, pythonfmu runs on {', '.join(PLATFORMS)}: "
            f"{INSTALL}, which compiles for these too"
        )
    files = {}
    for platform, content in contents(library, platforms).items():
        folder, shared, suffix = PLATFORMS[platform]
        files[f"binaries/{folder}/{model.name}{suffix}"] = content
        files[f"binaries/{folder}/{shared}"] = (theirs / folder / shared).read_bytes()
    return files
