"""Packs the FMU for Python hosts reproducibly: isolated Python code, map, binaries of pythonfmu, description.

All pythonfmu FMUs of a process share one interpreter and one sys.modules. Module names must therefore differ between
FMUs and between versions of this one: all code, with the few modules of pythonfmu that it needs, is in one package
named by the hash of its files, and the name of the entry script has the same hash. Modules that are copied into the
FMU are said to travel. The sources of the contact solver, for refinement at run time, are in a folder of that package
(solver_cache.py).
"""

import ast
import importlib.util
import re
import sys
import uuid
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

from ballscrew_fmu.archive import NAMESPACE, BuiltFmu, built
from ballscrew_fmu.description.model_description import python_description
from ballscrew_fmu.models import FRICTION, FmuModel
from ballscrew_fmu.pages.page import documentation_files
from ballscrew_fmu.python_fmu.entry_library import TOKEN_FILE, binaries
from ballscrew_fmu.python_fmu.shared_map import MAP_FILE, PAGE_FILE
from ballscrew_fmu.python_fmu.solver_cache import SOLVER_FOLDER, digest, solver_name
from ballscrew_tehl import __version__
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import npz_bytes

#: packages whose modules travel if the slave of a model imports them, directly or indirectly
TRAVELLING = ("ballscrew_fmu.python_fmu", "ballscrew_fmu.variables", "ballscrew_tehl.runtime", "pythonfmu")
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


class PackageError(RuntimeError):
    """The FMU cannot be packed from these sources."""


def runtime_sources(model: FmuModel = FRICTION) -> dict[str, str]:
    """Sources of the modules that travel, by their names inside the package, with relative imports.

    Raises       PackageError: a module imports one that does not travel
    """
    found: dict[str, str] = {}
    wanted = [model.slave]
    while wanted:
        module = wanted.pop()
        if _inner_name(module) not in found:
            source = _file_of(module).read_text(encoding="utf-8")
            found[_inner_name(module)], imported = _relocated(source, module)
            wanted += imported
    return found


def _inner_name(module: str) -> str:
    """Name of a module inside the package of the FMU."""
    return module.partition(".")[2].replace(".", "_")


def _file_of(module: str) -> Path:
    spec = importlib.util.find_spec(module)
    if spec is None or spec.origin is None:
        raise PackageError(f"module {module} not found; install the project and pythonfmu")
    return Path(spec.origin)


def _relocated(source: str, module: str) -> tuple[str, list[str]]:
    """The source with imports of modules that travel made relative to the package of the FMU, and these modules."""
    parent = module.rpartition(".")[0]
    imported = []

    def relative(match: re.Match[str]) -> str:
        indent, target = match.groups()
        absolute = f"{parent}{target}" if target.startswith(".") else target
        if absolute.endswith(".") or not absolute.startswith(tuple(f"{name}." for name in TRAVELLING)):
            return match.group(0)
        imported.append(absolute)
        return f"{indent}from .{_inner_name(absolute)} import "

    moved = _IMPORT.sub(relative, source)
    names = {_inner_name(name) for name in imported}
    for node in ast.walk(ast.parse(moved)):
        if isinstance(node, ast.Import):
            targets = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            inside = node.level == 1 and node.module in names
            targets = [] if inside else ["." * node.level + (node.module or "")]
        else:
            continue
        for target in targets:
            if target.partition(".")[0] not in {"numpy", *sys.stdlib_module_names}:
                raise PackageError(f"{module} imports {target}, which does not travel with the FMU")
    return moved, imported


def solver_sources() -> dict[str, str]:
    """Sources of the modules that refinement needs, by their paths below the package `ballscrew_tehl`.

    Raises       PackageError: an import is neither relative, nor of the standard library, nor in SOLVER_NEEDS
    """
    root = SOLVER_MODULE.partition(".")[0]
    found: dict[str, str] = {}
    wanted = [SOLVER_MODULE]
    while wanted:
        module = wanted.pop()
        file = _file_of(module)
        package = module if file.name == "__init__.py" else module.rpartition(".")[0]
        place = module.replace(".", "/") + ("/__init__.py" if package == module else ".py")
        place = place.removeprefix(f"{root}/")
        if place in found:
            continue
        found[place] = file.read_text(encoding="utf-8")
        if "." in module:
            wanted.append(module.rpartition(".")[0])
        wanted += _imported(ast.parse(found[place]), module, package)
    return found


def _imported(tree: ast.AST, module: str, package: str) -> list[str]:
    """Modules of the same package that a module imports at run time (not under TYPE_CHECKING)."""
    found = []
    nodes: list[ast.AST] = [tree]
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            nodes += node.orelse
            continue
        nodes += ast.iter_child_nodes(node)
        if isinstance(node, ast.ImportFrom) and node.level:
            target = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
            found.append(target)
            specification = importlib.util.find_spec(target)
            if specification is not None and specification.submodule_search_locations is not None:
                below = (f"{target}.{alias.name}" for alias in node.names)
                found += [name for name in below if importlib.util.find_spec(name)]
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else [a.name for a in node.names]
            for name in names:
                if name.partition(".")[0] not in {*SOLVER_NEEDS, *sys.stdlib_module_names}:
                    raise PackageError(f"{module} imports {name}, which does not travel with the FMU")
    return found


def fmu_files(
    nut_map: NutMap,
    sources: Mapping[str, str] | None = None,
    solver: Mapping[str, str] | None = None,
    model: FmuModel = FRICTION,
    live_page: str = "",
) -> dict[str, bytes]:
    """Files of the FMU by path, with its GUID.

    Parameters   sources, solver : None: runtime_sources(), solver_sources()
                 live_page : a page with the map, which then is in it alone; "": none
    """
    code = {f"{name}.py": text.encode() for name, text in (sources or runtime_sources(model)).items()}
    code["__init__.py"] = b'"""Code of one FMU, named by its content."""\n'
    if model.refines:
        solver_code = {name: text.encode() for name, text in (solver or solver_sources()).items()}
        folder = f"{SOLVER_FOLDER}/{solver_name(solver_code)}"
        code |= {f"{folder}/{name}": content for name, content in solver_code.items()}
    mark = digest(code)[:12]
    package, script = f"_ballscrew_{mark}", f"{model.name}_{mark}"
    files = {f"resources/{package}/{name}": content for name, content in code.items()}
    entry = SCRIPT.format(package=package, slave=_inner_name(model.slave), model=model.name)
    files[f"resources/{script}.py"] = entry.encode()
    files["resources/slavemodule.txt"] = script.encode()
    if live_page:
        files[f"resources/{PAGE_FILE}"] = live_page.encode()
    files[f"resources/{MAP_FILE}"] = npz_bytes(nut_map.header, {} if live_page else nut_map.arrays)
    files |= binaries(nut_map.header, model)
    documentation = documentation_files(nut_map.header, model, REDIRECTION if live_page else "")
    files |= {f"documentation/{name}": content for name, content in documentation.items()}
    tool = f"ballscrew-tehl {__version__} with pythonfmu {version('pythonfmu')}"
    blank = python_description(nut_map.header, "", tool, model)
    guid = str(uuid.uuid5(NAMESPACE, digest({**files, "modelDescription.xml": blank})))
    files[f"resources/{TOKEN_FILE}"] = guid.encode()
    return {"modelDescription.xml": python_description(nut_map.header, guid, tool, model), **files}


def build_fmu(
    nut_map: NutMap,
    path: Path | str,
    sources: Mapping[str, str] | None = None,
    solver: Mapping[str, str] | None = None,
    model: FmuModel = FRICTION,
    live_page: str = "",
) -> BuiltFmu:
    """Build the FMU of a map. Same map and same code give the same bytes and GUID.

    Parameters   path : of the FMU; an existing file is replaced;  others as in fmu_files
    Returns      BuiltFmu
    """
    return built(path, fmu_files(nut_map, sources, solver, model, live_page))
