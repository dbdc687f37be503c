"""Builds all FMUs of a screw: reads screw, map and friction parameters, then packs, checks and delivers the FMUs."""

import os
import tempfile
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from ballscrew_fmu.checks.check import check, recovered_preload, torque_tables
from ballscrew_fmu.checks.experiments import check_experiments
from ballscrew_fmu.checks.reference import STEP, reference_results
from ballscrew_fmu.live_page.page import live_page
from ballscrew_fmu.models import FRICTION, MODELS, MONITOR, NATIVE_MODELS, FmuModel
from ballscrew_fmu.native_fmu import libraries
from ballscrew_fmu.native_fmu.compile import INSTALL
from ballscrew_fmu.native_fmu.experiments import Reference
from ballscrew_fmu.native_fmu.package import build_native_fmu, native_file_name
from ballscrew_fmu.pages.validation import validation_report
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_tehl.cli.shared.chosen import chosen_of
from ballscrew_tehl.friction.sets import FrictionSet
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.nut_map.interval import interval_table
from ballscrew_tehl.parameters.file import Parameters
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import MECHANISTIC

Advance = Callable[[str], None]  # called with the name of the next step


class Inputs(NamedTuple):
    """What FMUs and live page are made of; friction_set: that of the interval, None = without."""

    parameters: Parameters
    nut_map: NutMap
    friction_set: FrictionSet | None = None

    def live_page(self) -> str:
        """The live page; with the interval of the mechanistic law, some seconds.

        Raises       BuildError: no ziglang, or it fails;  SourceError: a file is missing
        """
        ends = None
        if self.friction_set is not None and self.nut_map.law == MECHANISTIC:
            ends = interval_table(self.parameters, self.nut_map.header["axes"], self.friction_set)
        return live_page(self.parameters, self.nut_map, ends)


def read_inputs(
    screw: str | None, map_file: str | None, kinematics: str | None, friction: str | None = None
) -> Inputs:
    """Parameters and their nut map. Its header has start values and provenance of the friction parameters.

    Parameters   friction : name of a packaged set or file of ballscrew calibrate --output; mechanistic without
                 a screw and a map takes the GD4008-3 with an oil ISO VG 100
    Raises       ValueError or OSError: invalid input, with a message of one line
    """
    chosen = chosen_of(Namespace(screw=screw, map=map_file, kinematics=kinematics, friction=friction))
    nut_map = load_map(map_file, chosen.parameters, chosen.of_file)
    return Inputs(chosen.parameters, nut_map, chosen.friction_set)


def to_compile(
    inputs: Inputs, python_only: bool = False, embed_map: bool = False
) -> list[tuple[libraries.Library, str]]:
    """Libraries that a build has to compile first; none from a wheel, and once from a clone.

    Raises       BuildError: there is no compiler;  SourceError: a file is missing
    """
    header = inputs.nut_map.header
    platforms = libraries.provider(header, embed_map).platforms
    return libraries.missing(header, platforms, native=not (python_only or embed_map))


def build(
    inputs: Inputs,
    folder: Path,
    advance: Advance = lambda text: None,
    python_only: bool = False,
    embed_map: bool = False,
) -> tuple[dict[Path, str], str, str]:
    """Pack, check and deliver the FMUs.

    Parameters   embed_map : compile the map into the native FMUs, which then open no file
    Returns      results of the checks by FMU; tables of torques; what a missing compiler left out
    Raises       CheckError, BuildError, SourceError: no FMU is delivered; OSError: the folder cannot be written
    """
    parameters, nut_map = inputs.parameters, inputs.nut_map
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder, prefix=".build_") as scratch:
        built, text, note = [], "", ""
        compiler = libraries.provider(nut_map.header, embed_map)
        libraries.compile_all(to_compile(inputs, python_only, embed_map), advance)
        advance("live page")
        page = inputs.live_page() if compiler.crosses else ""
        for model in MODELS:
            advance(f"packing {model.name}")
            fmu = build_fmu(nut_map, Path(scratch) / f"{model.name}.fmu", model=model, live_page=page).path
            advance(f"checking {model.name}")
            built.append((fmu, _checked(fmu, parameters, nut_map, model)))
            if model is FRICTION:
                text = torque_tables(fmu, parameters, nut_map)
        if not python_only:
            for model in NATIVE_MODELS:
                built += _build_native(
                    inputs, Path(scratch), advance, model, compiler.platforms, embed_map, page
                )
        if not compiler.crosses:
            note = (
                f"{compiler.name}: native FMUs for {', '.join(compiler.platforms)} only, no live page; for Linux, "
                f"Windows and macOS, and the page: {INSTALL}"
            )
        for made, _ in built:
            os.replace(made, folder / made.name)
    return {folder / made.name: line for made, line in built}, text, note


def _build_native(
    inputs: Inputs,
    folder: Path,
    advance: Advance,
    model: FmuModel,
    platforms: tuple[str, ...],
    embed_map: bool,
    page: str,
) -> list[tuple[Path, str]]:
    """The native FMUs of a model in a folder, each with the result of its checks."""
    parameters, nut_map = inputs.parameters, inputs.nut_map
    reference = Reference(STEP, *reference_results(nut_map, model))
    report = validation_report(parameters, nut_map)
    built = []
    for version in (2, 3):
        target = folder / native_file_name(version, model)
        advance(f"packing {model.name}, FMI {version}")
        fmu = build_native_fmu(
            nut_map,
            version,
            target,
            reference,
            report,
            platforms,
            model=model,
            embed_map=embed_map,
            live_page=page,
        ).path
        advance(f"checking {model.name}, FMI {version}")
        line = _checked(fmu, parameters, nut_map, model)
        worst = max(one.difference for one in check_experiments(fmu).values())
        built.append((fmu, f"{line}; reference experiments: largest difference {worst:.1e}"))
    return built


def _checked(fmu: Path, parameters: Parameters, nut_map: NutMap, model: FmuModel) -> str:
    """Result of the checks of one FMU, one line."""
    line = check(fmu, nut_map, model)
    return line + (recovered_preload(fmu, parameters, nut_map) if model is MONITOR else "")
