"""Packs the FMU for Python hosts reproducibly: isolated Python code, map, binaries of pythonfmu, description.

All pythonfmu FMUs of a process share one interpreter and one sys.modules. Module names must therefore differ between
FMUs and between versions of this one: all code that travels, with the few modules of pythonfmu that it needs, is in one
package named by the hash of its files, as is the entry script. The sources of the contact solver, for refinement at run
time, are in a folder of that package (solver_cache.py).
"""

import ast
import importlib.resources
import importlib.util
import re
import sys
import uuid
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ballscrew_fmu.archive import NAMESPACE, BuiltFmu, built
from ballscrew_fmu.description.model_description import python_description
from ballscrew_fmu.models import FRICTION
from ballscrew_fmu.native_fmu.compile import INSTALL, BuildError
from ballscrew_fmu.native_fmu.libraries import contents, entry_library, provider
from ballscrew_fmu.pages.page import documentation_files
from ballscrew_fmu.python_fmu.shared_map import MAP_FILE, PAGE_FILE
from ballscrew_fmu.python_fmu.solver_cache import SOLVER_FOLDER, solver_name
from ballscrew_tehl import __version__
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import npz_bytes
from ballscrew_tehl.runtime.user_cache import digest

TOKEN_FILE = "guid.txt"  # in the resources: the GUID that fmi2Instantiate accepts; as in entry.c
PLATFORMS = {  # of pythonfmu: platform, library of pythonfmu in a folder of binaries, suffix of the entry library
    "x86_64-linux": ("linux64", "libpythonfmu-export.so", ".so"),
    "x86_64-windows": ("win64", "pythonfmu-export.dll", ".dll"),
}
#: of the class of the FMU
SLAVE_MODULE = "ballscrew_fmu.python_fmu.slave"
#: prefixes of modules that travel if it imports them, directly or indirectly
TRAVELLING = (
    "ballscrew_fmu.python_fmu.",
    "ballscrew_fmu.variables.",
    "ballscrew_tehl.runtime.",
    "pythonfmu.",
)
#: refinement needs this module and all that it imports from its package
SOLVER_MODULE = "ballscrew_tehl.refinement.refine"
#: packages that it needs in the host, in addition to the standard library
SOLVER_NEEDS = ("numba", "numpy", "pydantic", "scipy", "threadpoolctl")
SCRIPT = '''"""Entry script of the FMU: pythonfmu needs a class that is defined here and has a method of its own."""

from {package}.{slave} import {model}Base


class {model}({model}Base):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
'''
#: the live page is in the resources: its map is that of the FMU
REDIRECTION = f"""<!DOCTYPE html>
<meta charset="utf-8"><title>Live page</title><meta http-equiv="refresh" content="0; url=../resources/{PAGE_FILE}">
<a href="../resources/{PAGE_FILE}">Live page</a>
"""
_IMPORT = re.compile(r"^(\s*)from\s+([\w.]+)\s+import\s", re.MULTILINE)


def runtime_sources() -> dict[str, str]:
    """Sources of the modules that travel, by their names inside the package, with relative imports."""
    files = _imported_files(SLAVE_MODULE, _is_of_runtime, ("numpy",))

    def relocated(module: str) -> str:
        def relative(match: re.Match[str]) -> str:
            target = importlib.util.resolve_name(match[2], module.rpartition(".")[0])
            return f"{match[1]}from .{_inner_name(target)} import " if target in files else match[0]

        return _IMPORT.sub(relative, files[module].read_text(encoding="utf-8"))

    return {_inner_name(module): relocated(module) for module in files}


def _inner_name(module: str) -> str:
    """Name of a module inside the package of the FMU."""
    return module.partition(".")[2].replace(".", "_")


def solver_sources() -> dict[str, str]:
    """Sources of the modules that refinement needs, by their paths below the package `ballscrew_tehl`."""
    files = _imported_files(SOLVER_MODULE, _is_relative, SOLVER_NEEDS)
    root = files[SOLVER_MODULE.partition(".")[0]].parent
    return {file.relative_to(root).as_posix(): file.read_text(encoding="utf-8") for file in files.values()}


def _file(module: str) -> Path | None:
    """Source of a module, without an import of its packages: those of the solver need numba."""
    root, *names = module.split(".")
    folders = getattr(importlib.util.find_spec(root), "submodule_search_locations", None) or ()
    places = [Path(folder, *names) for folder in folders]
    files = [file for place in places for file in (place / "__init__.py", place.with_suffix(".py"))]
    return next(filter(Path.is_file, files), None)


def _is_relative(_name: str, relative: bool) -> bool:
    return relative


def _is_of_runtime(name: str, _relative: bool) -> bool:
    return name.startswith(TRAVELLING)


@cache  # a program that builds many FMUs reads its sources once
def _imported_files(
    first: str, travels: Callable[[str, bool], bool], others: Collection[str]
) -> dict[str, Path]:
    """Files by module: of the first one, and of those that it imports at run time, directly or indirectly.

    travels: whether a module is one of them, from its name and whether the import is relative
    others: packages that may be imported, in addition to the standard library; BuildError for another one
    """
    files: dict[str, Path] = {}
    target = [first]
    while target:
        module = target.pop()
        if module in files:
            continue
        file = _file(module)
        if file is None:
            raise BuildError(f"module {module} not found; install the project and pythonfmu")
        files[module], parent = file, module.rpartition(".")[0]
        if parent and travels(parent, True):
            target.append(parent)
        package = module if file.name == "__init__.py" else parent
        for name, relative in _imports(ast.parse(file.read_bytes()), package):
            if travels(name, relative):
                target.append(name)
            elif name.partition(".")[0] not in {*others, *sys.stdlib_module_names}:
                raise BuildError(f"{module} imports {name}, which does not travel with the FMU")
    return files


def _imports(node: ast.AST, package: str) -> Iterator[tuple[str, bool]]:
    """Modules that are imported at run time (not under TYPE_CHECKING), and whether by relative imports."""
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return
    if isinstance(node, ast.Import):
        yield from ((alias.name, False) for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        module = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
        yield module, node.level > 0
        below = (f"{module}.{alias.name}" for alias in node.names if node.level)
        yield from ((name, True) for name in below if _file(name))
    for child in ast.iter_child_nodes(node):
        yield from _imports(child, package)


def binaries(header: Mapping[str, Any]) -> dict[str, bytes]:
    """Libraries by path in the FMU: entry libraries with the name of the model, and pythonfmu's, which they call."""
    theirs = importlib.resources.files("pythonfmu") / "resources" / "binaries"
    compiler, library = provider(header), entry_library(header)
    platforms = [name for name in library.platforms if name in compiler.platforms]
    if not platforms:
        ours, others = ", ".join(compiler.platforms), ", ".join(PLATFORMS)
        result = f"{compiler.name} compiles for {ours}, pythonfmu runs on {others}"
        raise BuildError(f"{result}: {INSTALL}, which compiles for these too")
    files = {}
    for platform, content in contents(library, platforms).items():
        folder, shared, suffix = PLATFORMS[platform]
        files[f"binaries/{folder}/{FRICTION.name}{suffix}"] = content
        files[f"binaries/{folder}/{shared}"] = (theirs / folder / shared).read_bytes()
    return files


def fmu_files(
    nut_map: NutMap,
    sources: Mapping[str, str] | None = None,
    solver: Mapping[str, str] | None = None,
    live_page: str = "",
) -> dict[str, bytes]:
    """Files of the FMU by path, with its GUID.

    sources, solver: None: runtime_sources(), solver_sources()
    live_page: a page with the map, which then is in it alone; "": none
    """
    code = {f"{name}.py": text.encode() for name, text in (sources or runtime_sources()).items()}
    code["__init__.py"] = b'"""Code of one FMU, named by its content."""\n'
    solver_code = {name: text.encode() for name, text in (solver or solver_sources()).items()}
    folder = f"{SOLVER_FOLDER}/{solver_name(solver_code)}"
    code |= {f"{folder}/{name}": content for name, content in solver_code.items()}
    mark = digest(code)[:12]
    package, script = f"_ballscrew_{mark}", f"{FRICTION.name}_{mark}"
    files = {f"resources/{package}/{name}": content for name, content in code.items()}
    entry = SCRIPT.format(package=package, slave=_inner_name(SLAVE_MODULE), model=FRICTION.name)
    files[f"resources/{script}.py"] = entry.encode()
    files["resources/slavemodule.txt"] = script.encode()
    if live_page:
        files[f"resources/{PAGE_FILE}"] = live_page.encode()
    files[f"resources/{MAP_FILE}"] = npz_bytes(nut_map.header, {} if live_page else nut_map.arrays)
    files |= binaries(nut_map.header)
    documentation = documentation_files(nut_map.header, FRICTION, REDIRECTION if live_page else "")
    files |= {f"documentation/{name}": content for name, content in documentation.items()}
    tool = f"ballscrew-tehl {__version__} with pythonfmu {version('pythonfmu')}"
    blank = python_description(nut_map.header, "", tool)
    guid = str(uuid.uuid5(NAMESPACE, digest({**files, "modelDescription.xml": blank})))
    files[f"resources/{TOKEN_FILE}"] = guid.encode()
    return {"modelDescription.xml": python_description(nut_map.header, guid, tool), **files}


def build_fmu(
    nut_map: NutMap,
    path: Path | str,
    sources: Mapping[str, str] | None = None,
    solver: Mapping[str, str] | None = None,
    live_page: str = "",
) -> BuiltFmu:
    """Build the FMU for Python hosts of a map; same map and same code give the same bytes and GUID.

    Parameters
    ----------
    nut_map : NutMap
        Map of the screw.
    path : path or str
        The file, replaced if it exists.
    sources, solver : mapping of str to str, optional
        Python code by name; None: runtime_sources(), solver_sources().
    live_page : str, optional
        Page with the map, which then is in it alone; "": none.

    Returns
    -------
    BuiltFmu
        Path, GUID, hash and size.

    Raises
    ------
    BuildError
        With a message of one line.
    OSError
        The folder cannot be written.

    Examples
    --------
    >>> from ballscrew_tehl import load_map
    >>> build_fmu(load_map(), "friction.fmu").size  # doctest: +SKIP
    2430947
    """
    return built(path, fmu_files(nut_map, sources, solver, live_page))
