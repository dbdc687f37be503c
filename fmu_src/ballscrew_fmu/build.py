"""Builds all FMUs of a screw: reads screw, map and friction parameters, then packs, checks and delivers the FMUs."""

import os
import tempfile
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path

from ballscrew_fmu.checks.check import check, recovered_preload, torque_tables
from ballscrew_fmu.checks.experiments import check_experiments
from ballscrew_fmu.checks.reference import STEP, reference_results
from ballscrew_fmu.models import FRICTION, MODELS, MONITOR, NATIVE_MODELS, FmuModel
from ballscrew_fmu.native_fmu import compile as native_compile
from ballscrew_fmu.native_fmu.experiments import Reference
from ballscrew_fmu.native_fmu.package import build_native_fmu, native_file_name
from ballscrew_fmu.pages.validation import validation_report
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_tehl.cli.shared.chosen import chosen_of
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import Parameters
from ballscrew_tehl.runtime.evaluate import NutMap

Advance = Callable[[str], None]  # called with the name of the next step


def read_inputs(
    screw: str | None, map_file: str | None, kinematics: str | None, friction: str | None = None
) -> tuple[Parameters, NutMap]:
    """Parameters and their nut map. Its header has start values and provenance of the friction parameters.

    Parameters   friction : name of a packaged set or file of ballscrew calibrate --output; mechanistic without
                 a screw and a map takes the GD4008-3 with an oil ISO VG 100
    Raises       ValueError or OSError: invalid input, with a message of one line
    """
    chosen = chosen_of(Namespace(screw=screw, map=map_file, kinematics=kinematics, friction=friction))
    return chosen.parameters, load_map(map_file, chosen.parameters, chosen.of_file)


def build(
    parameters: Parameters,
    nut_map: NutMap,
    folder: Path,
    advance: Advance = lambda text: None,
    python_only: bool = False,
    embed_map: bool = False,
) -> tuple[list[Path], str]:
    """Pack, check and deliver the FMUs. Returns their paths and the text of tables and checks.

    Parameters   embed_map : compile the map into the native FMUs, which then open no file
    Raises       CheckError, BuildError, SourceError: no FMU is delivered; OSError: the folder cannot be written
    """
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder, prefix=".build_") as scratch:
        built, text = [], ""
        for model in MODELS:
            advance(f"packing {model.name}")
            fmu = build_fmu(nut_map, Path(scratch) / f"{model.name}.fmu", model=model).path
            advance(f"checking {model.name}")
            built.append((fmu, _checked(fmu, parameters, nut_map, model)))
            if model is FRICTION:
                text = torque_tables(fmu, parameters, nut_map)
        note = ""
        if not python_only:
            compiler = native_compile.find_compiler()
            for model in NATIVE_MODELS:
                built += _build_native(
                    parameters, nut_map, Path(scratch), advance, model, compiler.platforms, embed_map
                )
            if not compiler.crosses:
                note = (
                    f"\nnative FMUs with {compiler.name} for {', '.join(compiler.platforms)} only; for Linux, "
                    "Windows and macOS: python -m pip install ziglang"
                )
        text += "\n\n" + "\n".join(f"{made.name}: {line}" for made, line in built) + note
        for made, _ in built:
            os.replace(made, folder / made.name)
    return [folder / made.name for made, _ in built], text


def _build_native(
    parameters: Parameters,
    nut_map: NutMap,
    folder: Path,
    advance: Advance,
    model: FmuModel,
    platforms: tuple[str, ...],
    embed_map: bool,
) -> list[tuple[Path, str]]:
    """The native FMUs of a model in a folder, each with the result of its checks."""
    reference = Reference(STEP, *reference_results(nut_map, model))
    report = validation_report(parameters, nut_map)
    built = []
    for version in (2, 3):
        target = folder / native_file_name(version, model)
        advance(f"compiling {model.name}, FMI {version}")
        fmu = build_native_fmu(
            nut_map, version, target, reference, report, platforms, model=model, embed_map=embed_map
        ).path
        advance(f"checking {model.name}, FMI {version}")
        line = _checked(fmu, parameters, nut_map, model)
        worst = max(one.difference for one in check_experiments(fmu).values())
        built.append((fmu, f"{line}; reference experiments: largest difference {worst:.1e}"))
    return built


def _checked(fmu: Path, parameters: Parameters, nut_map: NutMap, model: FmuModel) -> str:
    """Result of the checks of one FMU, one line."""
    line = check(fmu, nut_map, model)
    return line + (recovered_preload(fmu, parameters) if model is MONITOR else "")
