"""Native FMUs as folders and C hosts for them, compiled for this machine; for tests and benchmarks."""

import shutil
from pathlib import Path

from native_model import TOKEN, compile_once, compiler, runtime_sources
from paths import NATIVE_HOSTS

from ballscrew_fmu.description.native import native_description
from ballscrew_fmu.models import FRICTION, FmuModel
from ballscrew_fmu.native_fmu.compile import COMPILER_OPTIONS
from ballscrew_fmu.native_fmu.map_file import MAP_FILE, map_bytes
from ballscrew_fmu.native_fmu.sources import native_sources

BINARIES = {2: "binaries/linux64", 3: "binaries/x86_64-linux"}


def native_folder(folder: Path, nut_map, version: int, model: FmuModel = FRICTION) -> Path:
    """An unpacked FMU with the library of this machine by its own compiler, as fmpy takes it."""
    library = folder / BINARIES[version] / f"{model.native_name}.so"
    library.parent.mkdir(parents=True)
    (folder / "resources").mkdir()
    (folder / "resources" / MAP_FILE).write_bytes(map_bytes(nut_map))
    units = sorted(n for n in native_sources(nut_map.header, version, TOKEN, model) if n.endswith(".c"))
    description = native_description(nut_map.header, version, TOKEN, "test", units, model)
    (folder / "modelDescription.xml").write_bytes(description)
    options = (*COMPILER_OPTIONS, "-shared", "-fPIC")
    shutil.copy(compile_once(runtime_sources(nut_map, model), "model.so", *options), library)
    return folder


def c_host(nut_map, name: str, *options: str, runtime: bool = True, model: FmuModel = FRICTION) -> Path:
    """Program of a C file of native/, linked with the runtime of both versions if `runtime`, beside the map.

    Raises       FileNotFoundError: sanitizers, but no compiler of the system
    """
    if len(compiler()) > 1 and any("sanitize" in option for option in options):
        raise FileNotFoundError("no C compiler of the system: sanitizers not run")
    sources = runtime_sources(nut_map, model)
    if not runtime:
        sources = {file: text for file, text in sources.items() if not file.endswith(".c")}
    sources |= {MAP_FILE: map_bytes(nut_map)}
    sources[f"{name}.c"] = (NATIVE_HOSTS / f"{name}.c").read_bytes()
    return compile_once(sources, name, *options)
