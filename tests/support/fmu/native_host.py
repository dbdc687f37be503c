"""Native FMUs as folders and C hosts for them, compiled for this machine; for tests and benchmarks."""

import subprocess
from pathlib import Path

from native_model import compiler, write_sources
from paths import NATIVE_HOSTS

from ballscrew_fmu.description.native import native_description
from ballscrew_fmu.models import FRICTION, FmuModel
from ballscrew_fmu.native_fmu.compile import COMPILER_OPTIONS, WARNINGS
from ballscrew_fmu.native_fmu.map_file import map_bytes
from ballscrew_fmu.native_fmu.sources import is_fmi_header, native_sources

TOKEN = "{test}"  # as write_sources has it
BINARIES = {2: "binaries/linux64", 3: "binaries/x86_64-linux"}


def fmi_sources(folder: Path, nut_map, versions=(2, 3), model: FmuModel = FRICTION) -> list[str]:
    """Sources of the runtime in a folder, FMI headers in fmi/; returns the units."""
    (folder / "fmi").mkdir(parents=True, exist_ok=True)
    for version in versions:
        write_sources(folder, nut_map, version, model)
    for file in folder.iterdir():
        if is_fmi_header(file.name):
            file.replace(folder / "fmi" / file.name)
    return sorted(file.name for file in folder.glob("*.c"))


def native_folder(folder: Path, nut_map, version: int, model: FmuModel = FRICTION) -> Path:
    """An unpacked FMU with the library of this machine by its own compiler, as fmpy takes it."""
    units = fmi_sources(folder / "build", nut_map, (version,), model)
    library = folder / BINARIES[version] / f"{model.native_name}.so"
    library.parent.mkdir(parents=True)
    (folder / "resources").mkdir()
    (folder / "resources" / "nut_map.bin").write_bytes(map_bytes(nut_map))
    sources = native_sources(nut_map.header, version, TOKEN, model)
    description = native_description(
        nut_map.header, version, TOKEN, "test", sorted(n for n in sources if n[-2:] == ".c"), model
    )
    (folder / "modelDescription.xml").write_bytes(description)
    build(folder / "build", [*COMPILER_OPTIONS, *WARNINGS, "-shared", "-fPIC"], library, units)
    return folder


def c_host(
    folder: Path, nut_map, name: str, *options: str, runtime: bool = True, model: FmuModel = FRICTION
) -> Path:
    """Program of a C file of this folder, linked with the runtime of both versions if `runtime`."""
    units = fmi_sources(folder, nut_map, model=model)
    program = folder / name
    build(
        folder,
        ["-std=c99", *WARNINGS, *options],
        program,
        [str(NATIVE_HOSTS / f"{name}.c"), *(units if runtime else ())],
    )
    return program


def sanitized_c_host(folder: Path, nut_map, name: str, *options: str, model: FmuModel = FRICTION) -> Path:
    """The same under sanitizers.

    Raises       FileNotFoundError: no compiler of the system, whose sanitizers it needs
    """
    if len(compiler()) > 1:
        raise FileNotFoundError("no C compiler of the system: sanitizers not run")
    return c_host(folder, nut_map, name, "-g", "-O1", "-fno-sanitize-recover=all", *options, model=model)


def build(folder: Path, options: list[str], target: Path, units: list[str]) -> None:
    """Program or library of C units with the compiler of the system."""
    command = [
        *compiler(),
        *options,
        "-I.",
        "-isystem",
        "fmi",
        "-o",
        str(target),
        *units,
        "-lm",
        "-lpthread",
        "-ldl",
    ]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)
    if run.returncode:
        raise RuntimeError(run.stderr)
