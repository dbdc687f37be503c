"""What an FMU file says of itself (`ballscrew_fmu info`), and its checks without the map that it was built from
(`ballscrew_fmu check`): validation in fmpy, and the reference experiments that a native FMU carries."""

import shutil
import tempfile
import zipfile
import zlib
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import fmpy
from fmpy.model_description import ModelDescription

from ballscrew_fmu.checks.check import refuse_findings
from ballscrew_fmu.checks.experiments import experiments_in
from ballscrew_fmu.checks.reference import reference_of
from ballscrew_fmu.checks.replay import AGREEMENT, CheckError, check_replay, replay
from ballscrew_fmu.models import MODELS
from ballscrew_fmu.native_fmu.resource_files import MAP_FILE, hash_in
from ballscrew_fmu.python_fmu.shared_map import MAP_FILE as PYTHON_MAP_FILE
from ballscrew_fmu.python_fmu.shared_map import map_in
from ballscrew_tehl.runtime.packed import MapError


def fmu_info(fmu: Path) -> dict[str, Any]:
    """Names, kinds, platforms and variables of an FMU; JSON-able.

    Raises       ValueError: not an FMU that fmpy can read
    """
    description = read_description(fmu)
    kinds = {"co-simulation": description.coSimulation, "model exchange": description.modelExchange}
    return {
        "file": str(fmu),
        "model": description.modelName,
        "description": description.description,
        "fmi_version": description.fmiVersion,
        "kinds": [name for name, kind in kinds.items() if kind is not None],
        "platforms": _platforms(fmu),
        "token": description.guid,
        "map": _map_note(fmu, description.description or ""),
        "tool": description.generationTool,
        "variables": [
            {
                "name": v.name,
                "causality": v.causality,
                "unit": v.unit or (v.declaredType.unit if v.declaredType is not None else None),
                "start": v.start,
                "min": v.min,
                "max": v.max,
                "description": v.description,
            }
            for v in description.modelVariables
            if v.causality in ("input", "output", "parameter")
        ],
    }


def check_file(fmu: Path) -> list[str]:
    """Checks of an FMU file, a line each.

    Raises       ValueError: not an FMU; CheckError: what is wrong, one line
    """
    description = read_description(fmu)
    refuse_findings(fmu)
    lines = ["fmpy validation: no finding"]
    if (note := _map_note(fmu, description.description or "")) is not None:
        lines.append(note)
    if fmpy.platform not in fmpy.supported_platforms(str(fmu)):
        return [*lines, f"not run: no library for this machine ({fmpy.platform})"]
    folder = tempfile.mkdtemp(prefix="ballscrew_fmu_")
    try:
        try:
            fmpy.extract(str(fmu), unzipdir=folder)
        except (zipfile.BadZipFile, zlib.error, OSError) as error:
            raise CheckError(f"damaged archive: {error}") from error
        with ProcessPoolExecutor(1, get_context("spawn")) as process:
            run = process.submit(_run_checks, Path(folder), description.modelName)
            return [*lines, *run.result()]
    except BrokenProcessPool as error:
        # a library that is cut short ends the process that loads it
        raise CheckError("its library for this machine ends the process: damaged") from error
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _run_checks(folder: Path, model: str) -> list[str]:
    """The checks that run the FMU in a folder, a line each.

    Raises       CheckError: what is wrong, one line
    """
    own = next((one for one in MODELS if one.name == model), None)
    resources = folder / "resources"
    found, source = experiments_in(folder), "the reference in the FMU is"
    if own is not None and (resources / PYTHON_MAP_FILE).exists():
        try:
            found, source = {"map": reference_of(map_in(str(resources)), own)}, "the map gives"
        except MapError as error:
            raise CheckError(f"made by another version of this package: {error}") from error
    if not found:
        (outputs,) = replay(folder, [{}])
        if wrong := [name for name, value in outputs.items() if value != value]:
            raise CheckError(f"not a number after a step with the start values: {', '.join(wrong)}")
        return [f"a step with the start values: {len(outputs)} outputs; the FMU carries no reference results"]
    lines = []
    for name, reference in found.items():
        try:
            worst = check_replay(folder, reference, source)
        except CheckError as error:
            raise CheckError(f"{name}: {error}") from error
        lines.append(
            f"replay against {name} in the FMU, {len(reference.inputs)} steps: largest difference {worst:.1e} "
            f"(limit {AGREEMENT:g})"
        )
    return lines


def read_description(fmu: Path) -> ModelDescription:
    """Model description of an FMU file.

    Raises       ValueError: it cannot be read, with the reason
    """
    if not fmu.is_file():
        raise ValueError(f"{fmu}: {'a folder; give an FMU file' if fmu.is_dir() else 'no such file'}")
    try:
        return fmpy.read_model_description(str(fmu))
    except zipfile.BadZipFile as error:
        raise ValueError(
            f"{fmu}: not an FMU, or a damaged one; give a file *.fmu of ballscrew build"
        ) from error
    except Exception as error:  # what fmpy raises on a model description that breaks the standard
        with zipfile.ZipFile(fmu) as archive:
            if "modelDescription.xml" not in archive.namelist():
                raise ValueError(f"{fmu}: not an FMU: no modelDescription.xml") from error
        what = " ".join(str(error).split())
        if isinstance(error, KeyError):
            what = f"references do not fit, unknown or given twice: {what}"
        raise ValueError(f"{fmu}: model description: {what}") from error


def _map_note(fmu: Path, text: str) -> str | None:
    """Which map a native FMU holds, and whether it is that of its description; None: no map in a file."""
    with zipfile.ZipFile(fmu) as archive:
        if f"resources/{MAP_FILE}" not in archive.namelist():
            return None
        found = hash_in(archive.read(f"resources/{MAP_FILE}"))
    if not found:
        return f"{MAP_FILE} is damaged or of another format"
    same = f"map {found[:12]}" in text
    return f"map {found}" + (
        "" if same else ", not that of the description: start values belong to another map"
    )


def _platforms(fmu: Path) -> list[str]:
    with zipfile.ZipFile(fmu) as archive:
        parts = [name.split("/") for name in archive.namelist()]
    return sorted({part[1] for part in parts if part[0] == "binaries" and len(part) > 2})
