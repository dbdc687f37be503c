"""Runs the libraries of the native FMUs on other platforms: Windows under wine, aarch64 Linux under qemu."""

import os
import re
import shutil
import struct
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import fmpy
import numpy as np
from native_model import compiler

from ballscrew_fmu.native_fmu.compile import PLATFORMS
from ballscrew_fmu.native_fmu.package import FMI2_FOLDERS
from ballscrew_fmu.native_fmu.sources import NATIVE_NAME

SOURCE = Path(__file__).parent / "native" / "host_platform.c"
HEADERS = Path(fmpy.__file__).parent / "c-code"
AARCH64_ROOT = Path("/usr/aarch64-linux-gnu")
HERE = "x86_64-linux"
TIME_LIMIT = 600.0  # [s]; the first use of a target builds its C library, the first start of wine its prefix


class Emulated(NamedTuple):
    tool: str
    platform: str

    def problem(self) -> str | None:
        """Why it does not run here; None if it does."""
        if sys.platform != "linux":
            return f"{self.tool} is used on Linux only"
        if shutil.which(self.tool) is None:
            return f"{self.tool} is not installed, which runs libraries for {self.platform}"
        if self.tool.startswith("qemu") and not AARCH64_ROOT.is_dir():
            return f"{AARCH64_ROOT} is missing, the C library of aarch64 (libc6-arm64-cross)"
        return None

    def version(self) -> str:
        run = subprocess.run([self.tool, "--version"], capture_output=True, text=True, timeout=TIME_LIMIT)
        found = re.search(r"\d[\d.]*\d", run.stdout.removeprefix(self.tool))
        return found.group() if found else "-"


EMULATED = (Emulated("wine", "x86_64-windows"), Emulated("qemu-aarch64", "aarch64-linux"))


def outputs_on(platform: str, unpacked: Path, fmi_version: int, folder: Path) -> tuple[list[str], np.ndarray]:
    """Names and values, one row per point, that the library of a platform gives for the points of the host.

    Parameters   platform : HERE, or one of EMULATED;  unpacked : folder of the native FMU
                 folder : for the host and the prefix of wine, which is filled at the first use
    """
    description = fmpy.read_model_description(str(unpacked))
    names = [
        v.name
        for v in description.modelVariables
        if v.causality in ("output", "local") and "indic" not in v.name
    ]
    references = {v.name: v.valueReference for v in description.modelVariables}
    names.remove("in_range")
    place = FMI2_FOLDERS[platform] if fmi_version == 2 else platform
    library = unpacked / "binaries" / place / f"{NATIVE_NAME}{PLATFORMS[platform].suffix}"
    resources = unpacked / "resources"
    windows = platform.endswith("windows")
    host = folder / f"host_{platform}_{fmi_version}{'.exe' if windows else ''}"
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", PLATFORMS[platform].target]
    subprocess.run(
        [*(compiler() if platform == HERE else zig), "-std=c99", "-O1", f"-DFMI_VERSION={fmi_version}",
         f"-DOUTPUTS={','.join(str(references[name]) for name in names)}", f"-DFLAG={references['in_range']}",
         f"-DSTIFFNESS={references['presliding_stiffness']}", "-isystem", str(HEADERS), str(SOURCE),
         "-o", str(host), *(() if windows else ("-ldl",))],
        check=True, capture_output=True, timeout=TIME_LIMIT,
    )  # fmt: skip
    where = resources.as_uri() if fmi_version == 2 else f"{resources}/"
    command = [str(host), str(library), where, description.guid]
    environment: Mapping[str, str] = os.environ
    if platform == "aarch64-linux":
        command = ["qemu-aarch64", "-L", str(AARCH64_ROOT), *command]
    if windows:
        dos = [f"Z:{path}".replace("/", "\\") for path in (str(library), f"{resources}/")]
        where = f"file:///Z:{resources.as_uri().removeprefix('file://')}" if fmi_version == 2 else dos[1]
        command = ["wine", str(host), dos[0], where, description.guid]
        environment = wine_environment(folder / "wine")
    # files, no pipes: the servers of wine inherit them and would keep a pipe open
    out, errors = folder / f"{host.stem}.out", folder / f"{host.stem}.err"
    try:
        with out.open("wb") as stdout, errors.open("wb") as stderr:
            run = subprocess.run(command, stdout=stdout, stderr=stderr, timeout=TIME_LIMIT, env=environment)
    finally:
        if windows:
            stop_wine(environment)
    printed, messages = (file.read_text(errors="replace") for file in (out, errors))
    assert run.returncode == 0, f"{' '.join(command)}: exit code {run.returncode}: {messages.strip()[-500:]}"
    rows = [line.split() for line in printed.splitlines() if line.strip()]
    values = [[*(struct.unpack(">d", bytes.fromhex(x))[0] for x in row[:-1]), float(row[-1])] for row in rows]
    return [*names, "in_range"], np.array(values)


def wine_environment(prefix: Path) -> dict[str, str]:
    """A new prefix without display, log output and add-ons."""
    others = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
    return {**others, "WINEPREFIX": str(prefix), "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree,mshtml="}


def stop_wine(environment: Mapping[str, str]) -> None:
    """Stop the server of this prefix, which would still write to it."""
    server = shutil.which("wineserver") or "/usr/lib/wine/wineserver"
    if Path(server).exists():
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "timeout": TIME_LIMIT}
        subprocess.run([server, "-k"], env=environment, **quiet)
        subprocess.run([server, "-w"], env=environment, **quiet)
