"""Packs the FMU in reproducible bytes: isolated Python code, map, binaries of pythonfmu, description.

Every pythonfmu FMU of a process shares one interpreter and one sys.modules. Nothing in this FMU has a name
that another FMU, or another version of this one, could have: all code, with the few modules of pythonfmu that
it needs, stands in one package named by the hash of its files, and the entry script carries the same hash.
"""

import ast
import hashlib
import importlib.util
import io
import os
import re
import sys
import tempfile
import uuid
import zipfile
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from ballscrew_fmu.description import MODEL_NAME, model_description
from ballscrew_fmu.documentation import documentation_files
from ballscrew_fmu.slave import MAP_FILE
from ballscrew_tehl import __version__
from ballscrew_tehl.nut_map.evaluate import NutMap

# What travels: module -> name inside the package of the FMU. They import each other, numpy and the standard
# library.
RUNTIME_MODULES = {
    "ballscrew_fmu.slave": "slave",
    "ballscrew_fmu.variables": "variables",
    "ballscrew_tehl.nut_map.bspline": "bspline",
    "ballscrew_tehl.nut_map.evaluate": "evaluate",
    "ballscrew_tehl.nut_map.packed": "packed",
    "ballscrew_tehl.standstill": "standstill",
    "pythonfmu._version": "pythonfmu_version",
    "pythonfmu.default_experiment": "default_experiment",
    "pythonfmu.enums": "enums",
    "pythonfmu.fmi2slave": "fmi2slave",
    "pythonfmu.logmsg": "logmsg",
    "pythonfmu.variables": "pythonfmu_variables",
}
BINARIES = {
    "linux64/libpythonfmu-export.so": f"linux64/{MODEL_NAME}.so",
    "win64/pythonfmu-export.dll": f"win64/{MODEL_NAME}.dll",
}
NAMESPACE = uuid.uuid5(uuid.NAMESPACE_URL, "https://fmi-standard.org/ballscrew-tehl")
SCRIPT = '''"""Entry of the FMU; the class must be defined here and own a method (see slave.py of the
package)."""

from {package}.slave import BallScrewFrictionBase


class {model}(BallScrewFrictionBase):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
'''
_EPOCH = (1980, 1, 1, 0, 0, 0)
_IMPORT = re.compile(r"^(\s*)from\s+([\w.]+)\s+import\s", re.MULTILINE)


class PackageError(RuntimeError):
    """The FMU cannot be packed from these sources."""


class BuiltFmu(NamedTuple):
    path: Path
    guid: str
    sha256: str
    size: int  # [bytes]


def runtime_sources() -> dict[str, str]:
    """Source of each module that travels, by its name inside the package, with imports made relative.

    Raises       PackageError: a module imports something that does not travel
    """
    files = {name: (module, _file_of(module)) for module, name in RUNTIME_MODULES.items()}
    return {
        name: _relocated(file.read_text(encoding="utf-8"), module) for name, (module, file) in files.items()
    }


def _file_of(module: str) -> Path:
    spec = importlib.util.find_spec(module)
    if spec is None or spec.origin is None:
        raise PackageError(f"module {module} not found; install the project and pythonfmu")
    return Path(spec.origin)


def _relocated(source: str, module: str) -> str:
    """The source with every import of a travelling module made relative to the one package of the FMU."""
    parent = module.rpartition(".")[0]

    def relative(match: re.Match[str]) -> str:
        indent, target = match.groups()
        absolute = f"{parent}{target}" if target.startswith(".") else target
        name = RUNTIME_MODULES.get(absolute)
        return match.group(0) if name is None else f"{indent}from .{name} import "

    moved = _IMPORT.sub(relative, source)
    for node in ast.walk(ast.parse(moved)):
        if isinstance(node, ast.Import):
            targets = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            inside = node.level == 1 and node.module in RUNTIME_MODULES.values()
            targets = [] if inside else ["." * node.level + (node.module or "")]
        else:
            continue
        for target in targets:
            if target.partition(".")[0] not in {"numpy", *sys.stdlib_module_names}:
                raise PackageError(f"{module} imports {target}, which does not travel with the FMU")
    return moved


def fmu_files(nut_map: NutMap, sources: Mapping[str, str] | None = None) -> dict[str, bytes]:
    """Members of the FMU by path, complete with GUID.

    Parameters   sources : as runtime_sources(); None takes these
    """
    code = {f"{name}.py": text.encode() for name, text in (sources or runtime_sources()).items()}
    code["__init__.py"] = b'"""Code of one FMU, named by its content."""\n'
    mark = _digest(code)[:12]
    package, script = f"_ballscrew_{mark}", f"{MODEL_NAME}_{mark}"
    files = {f"resources/{package}/{name}": content for name, content in code.items()}
    files[f"resources/{script}.py"] = SCRIPT.format(package=package, model=MODEL_NAME).encode()
    files["resources/slavemodule.txt"] = script.encode()
    files[f"resources/{MAP_FILE}"] = nut_map.to_npz()
    library = _file_of("pythonfmu").parent / "resources" / "binaries"
    for built, placed in BINARIES.items():
        files[f"binaries/{placed}"] = (library / built).read_bytes()
    files |= {
        f"documentation/{name}": text.encode() for name, text in documentation_files(nut_map.header).items()
    }
    tool = f"ballscrew-tehl {__version__} with pythonfmu {version('pythonfmu')}"
    blank = model_description(nut_map.header, "", tool)
    guid = str(uuid.uuid5(NAMESPACE, _digest({**files, "modelDescription.xml": blank})))
    return {"modelDescription.xml": model_description(nut_map.header, guid, tool), **files}


def write_fmu(path: Path | str, files: Mapping[str, bytes]) -> None:
    """One zip with fixed dates and order; the file appears complete or not at all.

    Raises       OSError: the folder cannot be written
    """
    path = Path(path)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files, key=lambda n: (n != "modelDescription.xml", n)):
            member = zipfile.ZipInfo(name, _EPOCH)
            member.create_system = 3  # unix on every builder
            member.external_attr = 0o644 << 16
            archive.writestr(member, files[name], zipfile.ZIP_DEFLATED, 9)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(out.getvalue())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def build_fmu(nut_map: NutMap, path: Path | str, sources: Mapping[str, str] | None = None) -> BuiltFmu:
    """Build the FMU of a map: same map and same code, same bytes and same GUID.

    Parameters   path : of the FMU to write; an existing one is replaced
    Returns      BuiltFmu
    """
    files = fmu_files(nut_map, sources)
    write_fmu(path, files)
    content = Path(path).read_bytes()
    guid = ElementTree.fromstring(files["modelDescription.xml"]).attrib["guid"]
    return BuiltFmu(Path(path), guid, hashlib.sha256(content).hexdigest(), len(content))


def _digest(files: Mapping[str, bytes]) -> str:
    digest = hashlib.sha256()
    for name in sorted(files):
        digest.update(f"{name}\0{len(files[name])}\0".encode())
        digest.update(files[name])
    return digest.hexdigest()
