"""The three FMUs of the preload monitor as folders, the native ones compiled for this machine."""

from pathlib import Path
from typing import Any

import fmpy
from native_host import native_folder

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.checks.replay_fmi3 import Fmu3Instance
from ballscrew_fmu.models import MONITOR
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_tehl.runtime.evaluate import NutMap

SUBJECTS = ("python", "native 2", "native 3")


def monitor_folders(folder: Path, nut_map: NutMap) -> dict[str, Path]:
    """Unpacked FMUs by subject."""
    packed = build_fmu(nut_map, folder / "BallScrewPreloadMonitor.fmu", model=MONITOR).path
    return {
        "python": Path(fmpy.extract(str(packed), unzipdir=str(folder / "python"))),
        "native 2": native_folder(folder / "native_2", nut_map, 2, MONITOR),
        "native 3": native_folder(folder / "native_3", nut_map, 3, MONITOR),
    }


def opened(folders: dict[str, Path], subject: str, **start: float) -> Any:
    """An instance; arguments as FmuInstance."""
    return (Fmu3Instance if subject == "native 3" else FmuInstance)(folders[subject], **start)
