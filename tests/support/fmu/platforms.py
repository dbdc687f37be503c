"""Runs the libraries of FMUs on other platforms: Windows under wine, aarch64 Linux under qemu."""

import os
import shutil
import struct
import subprocess
from pathlib import Path
from typing import NamedTuple

import fmpy
import numpy as np
from paths import NATIVE_HOSTS

from ballscrew_fmu.native_fmu.compile import PLATFORMS, TARGETS, Platform, build_libraries
from ballscrew_fmu.native_fmu.package import FMI2_FOLDERS
from ballscrew_fmu.native_fmu.sources import fmi_headers

HERE = "x86_64-linux"
AARCH64_ROOT = Path("/usr/aarch64-linux-gnu")  # of the package libc6-arm64-cross
TIME_LIMIT = 300.0  # [s]; the first start of wine makes its prefix


def _first(*programs):
    return next(filter(None, map(shutil.which, programs)), None)


def emulator(platform):
    """Command that runs programs of a platform; None: it is not installed."""
    if platform == "x86_64-windows":
        return [found] if (found := _first("wine64", "/usr/lib/wine/wine64", "wine")) else None
    found = _first("qemu-aarch64", "qemu-aarch64-static")
    return [found, "-L", str(AARCH64_ROOT)] if found and AARCH64_ROOT.is_dir() else None


def host(platform):
    """Bytes of the program native/host_platform.c for a platform."""
    target = PLATFORMS[platform]
    if platform == "x86_64-windows":
        more = {"kernel32": "LoadLibraryA", "api-ms-win-crt-runtime-l1-1-0": "exit",
                "api-ms-win-crt-stdio-l1-1-0": "fputc fwrite"}  # fmt: skip
        imports = tuple((name, f"{functions} {more.get(name, '')}") for name, functions in target.imports)
        linker = [option for option in target.linker if option not in ("/dll", "/noentry")]
        linker += ["/entry:start", "/subsystem:console"]
        target = target._replace(suffix=".exe", linker=tuple(linker), imports=imports)
    else:
        target = Platform(target.target, "", ("-ldl",))
    source = {"host_platform.c": (NATIVE_HOSTS / "host_platform.c").read_bytes(), **fmi_headers(2)}
    TARGETS["host"] = target
    try:
        return build_libraries(source, ("host_platform.c",), "host", ("host",))["host"]
    finally:
        del TARGETS["host"]


class Run(NamedTuple):
    outputs: np.ndarray  # by row and name; of fewer rows if it has failed
    names: list
    log: str


def run_on(platform, unpacked, folder, step, rows):
    """Outputs of the library for a platform in an unpacked FMU 2.0, stepped from inputs by name; with its messages."""
    description = fmpy.read_model_description(str(unpacked))
    references = {v.name: v.valueReference for v in description.modelVariables}
    names = [v.name for v in description.modelVariables if v.causality == "output" and v.type == "Real"]
    library = unpacked / "binaries" / FMI2_FOLDERS[platform]
    library = library / f"{description.coSimulation.modelIdentifier}{PLATFORMS[platform].suffix}"
    path, place = str(library), (unpacked / "resources").as_uri()
    if platform == "x86_64-windows":
        path, place = f"Z:{path}".replace("/", "\\"), place.replace("file://", "file:///Z:")
    head = "".join(f"{text}\n" for text in (path, place, description.guid)).encode()
    inputs = list(rows[0])
    head += struct.pack("<3i", len(inputs), len(names), len(rows))
    head += np.array([references[name] for name in [*inputs, *names]], "<u4").tobytes()
    values = [step, *(row[name] for row in rows for name in inputs)]
    folder.mkdir(exist_ok=True)
    (folder / "host.in").write_bytes(head + np.array(values, "<f8").tobytes())
    (folder / "host.out").unlink(missing_ok=True)
    (folder / "host.log").write_text("")
    program = folder / f"host_{platform}{'.exe' if platform == 'x86_64-windows' else ''}"
    if not program.exists():
        program.write_bytes(host(platform))
        program.chmod(0o755)
    command = [*(emulator(platform) if platform != HERE else []), str(program)]
    quiet = {"WINEPREFIX": str(folder / "wine"), "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree,mshtml="}
    environment = {key: value for key, value in os.environ.items() if key != "DISPLAY"} | quiet
    # no pipes: the servers of wine inherit them and keep them open
    subprocess.run(command, cwd=folder, env=environment, timeout=TIME_LIMIT, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL, check=False)  # fmt: skip
    found = (
        np.frombuffer((folder / "host.out").read_bytes(), "<f8")
        if (folder / "host.out").exists()
        else np.array([])
    )
    return Run(found.reshape(-1, len(names)), names, (folder / "host.log").read_text(errors="replace"))


def end_wine(folder):
    """End the server of this prefix, which would go on writing to it."""
    server = _first("wineserver", "/usr/lib/wine/wineserver64", "/usr/lib/wine/wineserver")
    if server and (folder / "wine").exists():
        subprocess.run([server, "-k"], env={**os.environ, "WINEPREFIX": str(folder / "wine")}, check=False)
