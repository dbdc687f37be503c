"""Checks of FMUs: of one that was built, and of a file without the map that it was built from (`ballscrew check`)."""

import tempfile
import zipfile
import zlib
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import fmpy
from fmpy import validation
from fmpy.model_description import ModelDescription

from ballscrew_fmu.checks.reference import reference_of
from ballscrew_fmu.checks.replay import CheckError, largest_difference, replay
from ballscrew_fmu.models import FRICTION, FmuModel
from ballscrew_fmu.native_fmu.resource_files import MAP_FILE, hash_in
from ballscrew_fmu.native_fmu.validation import Reference, validation_in
from ballscrew_fmu.python_fmu.shared_map import MAP_FILE as PYTHON_MAP_FILE
from ballscrew_fmu.python_fmu.shared_map import map_in
from ballscrew_tehl.runtime.packed import MapError

AGREEMENT = 1e-9  # relative difference between an FMU and its reference
_SHOWN = ("name", "causality", "unit", "start", "min", "max", "description")  # of a variable


def check(fmu: Path, reference: Reference, model: FmuModel = FRICTION) -> str:
    """Validation and replay of a built FMU: a line with the results, or CheckError."""
    _refuse_findings(fmu)
    source = "the map" if model is FRICTION else "its recorded results"
    return f"fmpy: no finding; replay against {source}: {_agreement(fmu, reference, source, fmu.name)}"


def _agreement(fmu: Path, reference: Reference, source: str, name: str) -> str:
    """Result of check_replay as text; CheckError begins with the name of what is checked."""
    try:
        worst = check_replay(fmu, reference, f"{source}:")
    except CheckError as error:
        raise CheckError(f"{name}: {error}") from error
    return f"largest difference {worst:.1e} (limit {AGREEMENT:g})"


def check_replay(fmu: Path | str, reference: Reference, source: str) -> float:
    """Largest relative difference between an FMU and a reference from `source`; CheckError above AGREEMENT."""
    outputs = replay(fmu, reference.inputs, reference.step)
    try:
        worst, n, name, value, target = largest_difference(outputs, reference.outputs)
    except ValueError as error:
        raise CheckError(f"replay: {error}") from error
    if not worst <= AGREEMENT:
        raise CheckError(f"replay step {n}: {name} = {value!r}; {source} {target!r}")
    return worst


def _refuse_findings(fmu: Path) -> None:
    """CheckError with what the validation of fmpy finds."""
    if findings := validation.validate_fmu(str(fmu)):
        raise CheckError(f"fmpy validation of {fmu.name}: {' | '.join(findings)}")


def check_file(fmu: Path) -> list[str]:
    """Checks of an FMU file, a line each: validation, map, replay of the validation or of the map that it contains.

    ValueError: not an FMU; CheckError: what is wrong, one line
    """
    description = read_description(fmu)
    _refuse_findings(fmu)
    note = _map_note(fmu, description.description or "")
    lines = ["fmpy validation: no finding", *filter(None, [note])]
    if fmpy.platform not in fmpy.supported_platforms(str(fmu)):
        return [*lines, f"not run: no library for this machine ({fmpy.platform})"]
    with tempfile.TemporaryDirectory(prefix="ballscrew_fmu_", ignore_cleanup_errors=True) as folder:
        try:
            fmpy.extract(str(fmu), unzipdir=folder)
        except (zipfile.BadZipFile, zlib.error, OSError) as error:
            raise CheckError(f"damaged archive: {error}") from error
        try:
            with ProcessPoolExecutor(1, get_context("spawn")) as process:
                return [*lines, process.submit(_replayed, Path(folder), description.modelName).result()]
        except BrokenProcessPool as error:
            # a library that is cut short ends the process that loads it
            raise CheckError("its library for this machine ends the process: damaged") from error


def _replayed(folder: Path, model: str) -> str:
    """Replay of an unpacked FMU against what it contains, or a step if that is nothing, as a line; or CheckError."""
    resources = folder / "resources"
    python = (resources / PYTHON_MAP_FILE).exists()
    name = "map" if python else "validation"
    try:
        reference = reference_of(map_in(str(resources))) if python else validation_in(folder)
    except MapError as error:
        raise CheckError(f"made by another version of this package: {error}") from error
    except ValueError as error:
        raise CheckError(str(error)) from error
    if reference is None:
        (outputs,) = replay(folder, [{}])
        if wrong := [output for output, value in outputs.items() if value != value]:
            raise CheckError(f"not a number after a step with the start values: {', '.join(wrong)}")
        return f"a step with the start values: {len(outputs)} outputs; not replayed: no reference results in the FMU"
    result = _agreement(folder, reference, f"{name} in the FMU", name)
    return f"replay against {name} in the FMU, {len(reference.inputs)} steps: {result}"


def fmu_info(fmu: Path) -> dict[str, Any]:
    """Names, kinds, platforms and variables of an FMU for JSON; ValueError: not an FMU that fmpy can read."""
    description = read_description(fmu)
    kinds = {"co-simulation": description.coSimulation, "model exchange": description.modelExchange}
    with zipfile.ZipFile(fmu) as archive:
        parts = [name.split("/") for name in archive.namelist()]
    return {
        "file": str(fmu),
        "model": description.modelName,
        "description": description.description,
        "fmi_version": description.fmiVersion,
        "kinds": [name for name, kind in kinds.items() if kind is not None],
        "platforms": sorted({part[1] for part in parts if part[0] == "binaries" and len(part) > 2}),
        "token": description.guid,
        "map": _map_note(fmu, description.description or ""),
        "tool": description.generationTool,
        "variables": [
            {key: getattr(v, key) for key in _SHOWN}
            for v in description.modelVariables
            if v.causality in ("input", "output", "parameter")
        ],
    }


def read_description(fmu: Path) -> ModelDescription:
    """Model description of an FMU file; ValueError: it cannot be read, with the reason."""
    if not fmu.is_file():
        raise ValueError(f"{fmu}: {'a folder; give an FMU file' if fmu.is_dir() else 'no such file'}")
    try:
        return fmpy.read_model_description(str(fmu))
    except Exception as error:  # fmpy raises Exception itself on what breaks the standard
        reason = " ".join(str(error).split())
        raise ValueError(f"{fmu}: not an FMU of ballscrew build, or a damaged one: {reason}") from error


def _map_note(fmu: Path, text: str) -> str | None:
    """Which map a native FMU contains, and whether it is that of its description; None: no map in a file."""
    with zipfile.ZipFile(fmu) as archive:
        if f"resources/{MAP_FILE}" not in archive.namelist():
            return None
        result = hash_in(archive.read(f"resources/{MAP_FILE}"))
    if not result:
        return f"{MAP_FILE} is damaged or of another format"
    other = ", not that of the description: start values belong to another map"
    return f"map {result}{'' if f'map {result[:12]}' in text else other}"
