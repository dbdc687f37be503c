#!/usr/bin/env python3
"""Assembles the Modelica package BallScrewFriction: package.mo, the map of a screw and its C library.

    python examples/modelica_package.py [--screw my.toml] [--output dist/modelica]

The package has a rotational friction component with flanges of the Modelica Standard Library 4.0 (ScrewFriction), the
screw between shaft and nut (ScrewTransmission), and an axis with each (Examples). Torques come from the C functions of
the native FMUs through an external object; the law at standstill, that of the FMUs in model exchange, and the contacts
of the nut are written as equations. Load dist/modelica/BallScrewFriction in a Modelica tool. The library is built for
x86_64 Linux and, for MinGW, x86_64 Windows; Resources/Source has the sources.

What was checked, and what not: no Modelica tool with external functions and the standard library was at hand. The
package was parsed; the law and the axis were compiled and run by rumoca with stand-ins for the map and for the
classes of the standard library; the external functions were compiled and run from C. OpenModelica, Dymola and the like
have not seen it.
"""

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from rich.console import Console

from ballscrew_fmu.models import FRICTION
from ballscrew_fmu.native_fmu.compile import COMPILER_OPTIONS, PLATFORMS, WARNINGS, BuildError, find_compiler
from ballscrew_fmu.native_fmu.resource_files import MAP_FILE, map_bytes
from ballscrew_fmu.native_fmu.sources import is_fmi_header, native_sources
from ballscrew_tehl import load_map, load_screw

NAME = "BallScrewFriction"
SOURCE = Path(__file__).resolve().parent / "modelica" / NAME
OUTPUT = Path(__file__).resolve().parents[1] / "dist" / "modelica"
FOLDERS = {"x86_64-linux": "linux64", "x86_64-windows": "win64"}  # of Resources/Library
INCLUDED = ("file.c", "map.c", "model.c")  # of the runtime, without FMI, by BallScrewFriction.c
UNITS = (f"{NAME}.c", FRICTION.dual)  # that are compiled


def assemble(nut_map: Any, folder: Path, platforms: Sequence[str] = tuple(FOLDERS)) -> Path:
    """The package of a map in a folder; an existing one is replaced when the new one is complete.

    Parameters   platforms : of FOLDERS
    Returns      path of the package
    Raises       BuildError: the library cannot be compiled;  OSError: cannot be written
    """
    folder.mkdir(parents=True, exist_ok=True)
    runtime = native_sources(nut_map.header, ())
    with tempfile.TemporaryDirectory(prefix=f".{NAME}_", dir=folder) as scratch:
        package = Path(scratch) / NAME
        shutil.copytree(SOURCE, package)
        _set_screw(package / "package.mo", nut_map.header["screw"])
        resources = package / "Resources"
        headers = (name for name in runtime if name.endswith(".h") and not is_fmi_header(name))
        for name in (*INCLUDED, FRICTION.dual, *headers):
            (resources / "Source" / name).write_bytes(runtime[name])
        (resources / "Data").mkdir()
        (resources / "Data" / MAP_FILE).write_bytes(map_bytes(nut_map))
        for platform in platforms:
            place = resources / "Library" / FOLDERS[platform]
            place.mkdir(parents=True)
            _build(resources, place / f"lib{NAME}.a", PLATFORMS[platform].target)
        target = folder / NAME
        shutil.rmtree(target, ignore_errors=True)
        package.rename(target)
    return target


def _set_screw(path: Path, numbers: Mapping[str, float]) -> None:
    """Defaults of ScrewTransmission: lead and stiffness of this screw."""
    text = path.read_text()
    names = {"lead": "lead", "nutStiffness": "nut_stiffness", "nutStiffnessPreload": "stiffness_preload"}
    for name, number in names.items():
        pattern = rf"(parameter SI\.\w+ {name}\(min=\S+\) = )\S+"
        text, found = re.subn(pattern, rf"\g<1>{numbers[number]!r}", text)
        if found != 1:
            raise BuildError(
                f"{path}: parameter {name} of ScrewTransmission found {found} times; expected once"
            )
    path.write_text(text)


def _build(resources: Path, library: Path, target: str) -> None:
    """Static library of all C files in Resources/Source."""
    if not find_compiler().crosses:
        raise BuildError("the libraries are compiled for other machines too: python -m pip install ziglang")
    zig = [sys.executable, "-m", "ziglang"]
    with tempfile.TemporaryDirectory() as scratch:
        objects = []
        for unit in (resources / "Source" / name for name in UNITS):
            made = Path(scratch) / f"{unit.stem}.o"
            options = [o for o in COMPILER_OPTIONS if not o.startswith("-fvisibility")]
            pic = ["-fPIC"] if "linux" in target else []
            command = [*zig, "cc", "-target", target, "-c", "-g0", *pic, *options]
            _run([*command, *WARNINGS, "-I", str(resources / "Include"), "-o", str(made), str(unit)])
            objects.append(str(made))
        _run([*zig, "ar", "rcsD", str(library), *objects])


def _run(command: Sequence[str]) -> None:
    run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)
    if run.returncode:
        lines = [line for line in run.stderr.splitlines() if "error" in line] or [
            run.stderr.strip() or "no message"
        ]
        raise BuildError(f"{command[-1]}: {lines[0]}")


class Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        self.exit(2, f"modelica_package.py: {message} (see --help)\n")


def main(arguments: list[str] | None = None) -> int:
    parser = Parser(
        prog="modelica_package.py", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument(
        "--screw", metavar="FILE.toml", help="screw file; default: that in the map, or the packaged GD4008-3"
    )
    parser.add_argument("--map", metavar="FILE", help="map of this screw; default: made from the screw file")
    parser.add_argument(
        "--output", type=Path, default=OUTPUT, help="folder to write to; default: %(default)s"
    )
    options = parser.parse_args(arguments)
    try:
        nut_map = load_map(options.map, load_screw(options.screw) if options.screw else None)
        with Console(stderr=True).status("compiling the library"):
            package = assemble(nut_map, options.output)
    except (OSError, ValueError, BuildError) as error:
        print(f"modelica_package.py: {' '.join(str(error).split())}", file=sys.stderr)
        return 1 if isinstance(error, BuildError) else 2
    for path in sorted(package.rglob("*")):
        if path.is_file():
            print(f"{path.relative_to(options.output)}  {path.stat().st_size / 1024:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
