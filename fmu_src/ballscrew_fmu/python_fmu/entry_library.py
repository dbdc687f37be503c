"""Entry libraries of the FMU for Python hosts: compiled from native/python_host, they call those of pythonfmu."""

import functools
import importlib.resources
import importlib.util
from collections.abc import Sequence
from pathlib import Path

from ballscrew_fmu.native_fmu.compile import BuildError, build_libraries, find_compiler
from ballscrew_fmu.native_fmu.sources import fmi_headers
from ballscrew_fmu.variables.friction import FIRST_REFERENCE, Variable

TOKEN_FILE = "guid.txt"  # in the resources: the GUID that fmi2Instantiate accepts; as in entry.c
PLATFORMS = {  # of pythonfmu: platform, library of pythonfmu in a folder of binaries, suffix of the entry library
    "x86_64-linux": ("linux64", "libpythonfmu-export.so", ".so"),
    "x86_64-windows": ("win64", "pythonfmu-export.dll", ".dll"),
}
_NATIVE = importlib.resources.files("ballscrew_fmu") / "native"


_TABLE = """\
/* GENERATED from the table of variables: do not edit. */
#define FIRST_REFERENCE {first}U

static const Variable variables[] = {{
{rows}
}};
"""


def _table(variables: Sequence[Variable]) -> str:
    """entry_table.h: which references are of which type and can be set when."""

    def row(v: Variable) -> str:
        settable = "NEVER" if v.causality == "output" else "INITIALLY" if v.fixed else "ALWAYS"
        return f'    {{"{v.name}", {str(v.unit is None).lower()}, {settable}}},'

    return _TABLE.format(first=FIRST_REFERENCE, rows="\n".join(map(row, variables)))


@functools.cache
def _compiled(table: str) -> dict[str, bytes]:
    sources = {
        "entry_table.h": table.encode(),
        "entry.c": (_NATIVE / "python_host" / "entry.c").read_bytes(),
        "uri.h": (_NATIVE / "runtime" / "uri.h").read_bytes(),
    }
    compiler = find_compiler()
    platforms = [name for name in PLATFORMS if name in compiler.platforms]
    if not platforms:
        raise BuildError(
            f"{compiler.name} compiles for {', '.join(compiler.platforms)}, pythonfmu runs on {', '.join(PLATFORMS)}: "
            "python -m pip install ziglang, which compiles for these too"
        )
    return build_libraries(sources | fmi_headers(2), "entry", platforms)


def binaries(name: str, variables: Sequence[Variable]) -> dict[str, bytes]:
    """Libraries by path in the FMU: the entry libraries with the name of the model, and beside them pythonfmu's.

    For the platforms of pythonfmu that the compiler builds for.

    Parameters   name : of the model;  variables : its table
    Raises       BuildError: there is no compiler for them, or it fails;  ImportError: pythonfmu is missing
    """
    specification = importlib.util.find_spec("pythonfmu")
    if specification is None or specification.origin is None:
        raise ImportError("module pythonfmu not found; python -m pip install pythonfmu")
    theirs = Path(specification.origin).parent / "resources" / "binaries"
    files = {}
    for platform, content in _compiled(_table(variables)).items():
        folder, library, suffix = PLATFORMS[platform]
        files[f"binaries/{folder}/{name}{suffix}"] = content
        files[f"binaries/{folder}/{library}"] = (theirs / folder / library).read_bytes()
    return files
