"""FMUs, live page and report of a screw in memory: packed, checked, delivered."""

import functools
import io
import os
import tempfile
import zipfile
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import NamedTuple

from ballscrew_fmu.archive import BuiltFmu
from ballscrew_fmu.checks.check import check
from ballscrew_fmu.checks.reference import reference_of
from ballscrew_fmu.live_page.page import live_page
from ballscrew_fmu.models import FRICTION, MODELS, FmuModel
from ballscrew_fmu.native_fmu import libraries
from ballscrew_fmu.native_fmu.compile import INSTALL, WASM
from ballscrew_fmu.native_fmu.package import build_native_fmu, native_file_name
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_tehl.applications.calibration.measured_screw import is_measured, table_text, validation_tables
from ballscrew_tehl.applications.report.data import OperatingPoint, report_data
from ballscrew_tehl.applications.report.page import report_page
from ballscrew_tehl.friction.drag_torque import screw_friction_set
from ballscrew_tehl.friction.sets import FrictionSet
from ballscrew_tehl.nut_map.grid import Progress
from ballscrew_tehl.nut_map.interval import interval_table
from ballscrew_tehl.nut_map.load import refuse_other_map
from ballscrew_tehl.parameters.file import Parameters
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import Law

Advance = Callable[[str, int], None]  # called with the name of the next step, and how many steps it is


class Inputs(NamedTuple):
    """What FMUs and live page are made of; friction_set: that of the interval, None = without."""

    parameters: Parameters
    nut_map: NutMap
    friction_set: FrictionSet | None = None

    def live_page(
        self, start: OperatingPoint | None = None, on_the_way: Callable[[], None] = lambda: None
    ) -> str:
        """The live page, which starts at an operating point; with the interval of the mechanistic law, some seconds.

        on_the_way: called often; what it raises ends the work.
        BuildError: not in the package, and no ziglang, or it fails; or a file is missing.
        """
        refuse_other_map(self.nut_map, self.parameters)
        ends = None
        if self.friction_set is not None and self.nut_map.law == Law.MECHANISTIC:
            axes = self.nut_map.header["axes"]
            ends = interval_table(self.parameters, axes, self.friction_set, on_the_way)
        return live_page(self.parameters, self.nut_map, ends, start)

    def report(self, point: Mapping[str, float] = {}) -> str:
        """The report in HTML around a point: preload [N], speed [rad/s], temperature [K] as far as they are stated."""
        refuse_other_map(self.nut_map, self.parameters)
        numbers = self.friction_set or screw_friction_set(self.parameters)
        return report_page(report_data(self.parameters, numbers, self.nut_map, point))


#: last line of the list of FMUs in an archive
CONTENTS = "Each holds its documentation: rename a copy to .zip, open documentation/index.html"


class Kind(NamedTuple):
    """An FMU to be built: version of FMI, for Python hosts or native."""

    model: FmuModel
    fmi_version: int
    native: bool

    @property
    def words(self) -> str:
        """What it is of, and for whom."""
        hosts = "simulation tools, without Python" if self.native else "Python hosts, also refines its map"
        return f"{self.model.summary}; FMI {self.fmi_version}, for {hosts}"

    @property
    def file_name(self) -> str:
        return native_file_name(self.fmi_version, self.model) if self.native else f"{self.model.name}.fmu"


def kinds(
    only: Collection[str] = (), fmi_version: int | None = None, python_only: bool = False
) -> list[Kind]:
    """FMUs of the models with these layers (none: all) and this version of FMI, those for Python hosts first.

    ValueError: there are none.
    """
    every = [Kind(FRICTION, 2, False)]
    if not python_only:
        every += [Kind(model, version, True) for model in MODELS for version in (2, 3)]
    of_models = [kind for kind in every if not only or kind.model.layer in only]
    selected = [kind for kind in of_models if fmi_version in (None, kind.fmi_version)]
    if not selected:
        raise ValueError("no FMU to build: that for Python hosts is friction, of FMI 2")
    return selected


def steps(selected: Collection[Kind]) -> int:
    """Steps of a build: two for each FMU, and the live page."""
    return 2 * len(selected) + any(kind.model is FRICTION for kind in selected)


def build(
    inputs: Inputs,
    folder: Path,
    selected: Collection[Kind],
    advance: Advance = lambda text, steps: None,
    embed_map: bool = False,
) -> tuple[dict[Path, tuple[BuiltFmu, str]], str]:
    """Pack, check and deliver the FMUs. advance is called twice for each, and for the live page.

    selected: of `kinds`; embed_map: compile the map into the native FMUs, which then open no file. Returns FMUs with
    the results of their checks by file; what a missing compiler left out. CheckError, BuildError: no FMU
    is delivered; OSError: the folder cannot be written.
    """
    nut_map = inputs.nut_map
    reference = functools.cache(lambda model: reference_of(nut_map, model))
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder, prefix=".build_") as scratch:
        built: list[tuple[BuiltFmu, str]] = []
        compiler = libraries.provider(nut_map.header, embed_map)
        with_page = compiler.crosses and any(kind.model is FRICTION for kind in selected)
        native = dict.fromkeys(kind.model for kind in selected if kind.native and not embed_map)
        needed = [libraries.native_library(nut_map.header, model) for model in native]
        needed += [libraries.entry_library(nut_map.header) for kind in selected if not kind.native]
        page = ""
        if with_page:
            needed.append(libraries.page_library(nut_map.header))
        libraries.prepare(needed, (*compiler.platforms, WASM), advance)
        if with_page:
            advance("live page", 1)
            page = inputs.live_page(on_the_way=lambda: advance("live page", 0))
        for kind in selected:
            model, path = kind.model, Path(scratch) / kind.file_name
            advance(f"packing {kind.file_name}", 1)
            shown, page = (page, "") if model is FRICTION else ("", page)  # in one file
            if kind.native:
                like = (reference(model), compiler.platforms, model, embed_map, shown)
                fmu = build_native_fmu(nut_map, kind.fmi_version, path, *like)
            else:
                fmu = build_fmu(nut_map, path, live_page=shown)
            advance(f"checking {kind.file_name}", 1)
            built.append((fmu, check(fmu.path, reference(model), model)))
        for fmu, _ in built:
            os.replace(fmu.path, folder / fmu.path.name)
    note = (
        f"{compiler.name}: native FMUs for {', '.join(compiler.platforms)} only, no live page; for Linux, Windows "
        f"and macOS, and the page: {INSTALL}"
    )
    return {folder / fmu.path.name: (fmu, line) for fmu, line in built}, "" if compiler.crosses else note


def fmu_archive(
    inputs: Inputs, files: Mapping[str, str] = {}, progress: Progress = lambda *_: None
) -> tuple[bytes, list[str]]:
    """All FMUs, checked, in an archive (ZIP) with a list of them and further files; results of the checks, what was
    left out.

    CheckError, BuildError: as build
    """
    selected, packed, done = kinds(), io.BytesIO(), 0
    total = steps(selected)

    def advance(what: str, number: int) -> None:
        nonlocal done
        done = min(done + number, total)
        progress(done, total, what)

    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(packed, "w") as archive:
        built, note = build(inputs, Path(folder), selected, advance)
        listed = [f"{kind.file_name}: {kind.words}" for kind in selected]
        for name, text in {"README.txt": "\n".join([*listed, CONTENTS, ""]), **files}.items():
            archive.writestr(name, text)
        for path in built:
            archive.write(path, path.name)
    lines = [f"{path.name}: {line}" for path, (_, line) in built.items()]
    return packed.getvalue(), lines + [note] * bool(note)


def torque_tables(inputs: Inputs) -> str:
    """Torque of the map compared with measurement and published models, as text; "" for other screws."""
    nut_map = inputs.nut_map
    axes = nut_map.header["axes"]
    if not is_measured(inputs.parameters.screw, axes):
        return ""

    def torque(preload: float, speed: float, temperature: float) -> float:
        return nut_map.evaluate(preload, speed, temperature).friction_torque

    tables = validation_tables(torque, preload_range=tuple(axes["force"][:2]))
    return "\n\n".join(map(table_text, tables))
