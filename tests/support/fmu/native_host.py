"""Native FMUs as folders and C hosts for them, compiled for this machine; for tests and benchmarks."""

from pathlib import Path

from native_model import compile_once, compiler, runtime_sources
from paths import NATIVE_HOSTS

from ballscrew_fmu.models import FRICTION, FmuModel
from ballscrew_fmu.native_fmu.map_file import MAP_FILE, map_bytes

BINARIES = {2: "binaries/linux64", 3: "binaries/x86_64-linux"}


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
