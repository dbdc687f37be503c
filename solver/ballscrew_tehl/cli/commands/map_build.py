"""The commands `map build` and `paper atlas`."""

from __future__ import annotations

import dataclasses
import os
import shlex
from argparse import Namespace
from collections.abc import Mapping
from concurrent.futures import Executor
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ...friction.sets import default_friction_set
from ...nut_map.atlas_contacts import build_atlas
from ...nut_map.certificate import claim, deviation_from_direct, points_of
from ...nut_map.file import is_map_file
from ...nut_map.grid import MapGrid, largest_pressure, map_grid
from ...nut_map.journal import Journal
from ...nut_map.left_out import left_out_deviations
from ...nut_map.workers import build_executor, compile_kernels
from ...parameters.file import Parameters
from ...parameters.units import CELSIUS, RPM
from ...runtime.packed import certificate_totals
from ..shared.chosen import screw_of
from ..shared.files import check_output, new_folder, try_folder, written
from ..shared.progress import progress_bar
from ..shared.quantities import whole_number
from ..shared.results import print_results, say, table

if TYPE_CHECKING:
    from ...nut_map.workers import Progress


#: errors that 99 % of a map are to keep, three times those of the packaged maps; which of them are printed
TARGETS, ERRORS = {"torque": 0.02, "film": 0.05, "temperature_rise": 0.45}, ("mean", "99", "max")


class _Wanted(NamedTuple):
    """A map to build; the lock of its open journal keeps other builds from the file."""

    parameters: Parameters
    path: Path
    grid: MapGrid
    journal: Journal


def _build_one(wanted: _Wanted, args: Namespace, executor: Executor, progress: Progress) -> dict[str, Any]:
    """Build, certify and write one map; contacts solved by an interrupted build are not solved again.

    Raises       ArithmeticError: too few contacts converged for a map
    """
    from ...nut_map.build import build_map
    from ...nut_map.file import load_map, save_map

    parameters, path, grid, journal = wanted
    say(_plan(parameters, grid, args.count))
    built = build_map(parameters, args.workers, progress, grid, executor, journal)
    unsolved = built.header["contacts_not_solved"]
    if unsolved:
        say(
            f"{unsolved} of {built.header['contacts']} contacts did not converge and are interpolated from the others: "
            "see contacts_not_solved in ballscrew map info"
        )
    if built.header["range_cut"]:
        say(
            f"range cut where contacts that did not converge leave the friction uncertain: {built.header['range_cut']}"
        )
    # a map replaces an older one only with its certificate
    trial = path.with_name(path.name + ".trial")
    try:
        save_map(trial, built, {})
        certificate = left_out_deviations(built.contact_map, default_friction_set(parameters))
        certificate |= deviation_from_direct(
            load_map(trial, parameters), parameters, args.count, executor, progress
        )
    finally:
        trial.unlink(missing_ok=True)
    file_hash = save_map(path, built, certificate)
    say(claim(certificate["points"], certificate["unphysical_trend_points"]))
    say(f"{path}: {_verdict(certificate)}")
    journal.discard()
    return {"file": str(path), "file_hash": file_hash, **certificate_totals(certificate)}


def _verdict(certificate: Mapping[str, Any]) -> str:
    """Whether the errors of a map are within TARGETS, or which are not, with the remedy."""
    errors = {name: certificate[f"{name}_error_99"] for name in TARGETS}
    missed = [name for name, target in TARGETS.items() if not errors[name] <= target]
    parts = ", ".join(
        f"{name.replace('_', ' ')} {100.0 * errors[name]:.2g} % (target {100.0 * TARGETS[name]:.2g} %)"
        for name in missed or TARGETS
    )
    if missed:
        return f"a poor map, 99 % of its errors are up to: {parts}; remedy: a narrower range, or a smaller --tolerance"
    return f"the certificate holds, 99 % of the errors are up to: {parts}"


def _ending(result: Mapping[str, Any]) -> str:
    """Errors of one map in per cent, and what to do with it."""
    rows = [["error [%]", "mean", "99 %", "largest"]]
    for name in TARGETS:
        values = (100.0 * result[f"{name}_error_{key}"] for key in ERRORS)
        rows.append([name.replace("_", " "), *(f"{value:.2g}" for value in values)])
    path = Path(result["file"])
    file, page, fmus = (
        shlex.quote(str(name))
        for name in (path, path.with_suffix(".html"), path.with_name(f"{path.stem}_fmus"))
    )
    return (
        f"{table(rows)}\nmore of it: ballscrew map info {file}\nnext: ballscrew page --map {file} --output {page}\n"
        f"      ballscrew build --map {file} --output {fmus}"
    )


def _grid(parameters: Parameters, args: Namespace) -> MapGrid:
    """Range and contacts of a build: by options, else the table [map] of the screw file, else what the screw allows."""
    base = MapGrid()
    if args.tolerance is not None:
        base = dataclasses.replace(base, contact_tolerance=args.tolerance)
    given = parameters.map

    def ends(
        option: list[float] | None, low: float | None, high: float | None, scale: float, shift: float
    ) -> Any:
        if option is not None:
            return tuple(scale * value + shift for value in option)
        return (low, high) if low is not None and high is not None else None

    return map_grid(
        parameters,
        ends(args.preload_n, given.preload_min, given.preload_max, 1.0, 0.0),
        ends(args.speed_rpm, given.speed_min, given.speed_max, RPM, 0.0),
        ends(args.temperature_c, given.temperature_min, given.temperature_max, 1.0, CELSIUS),
        base,
    )


def _plan(parameters: Parameters, grid: MapGrid, points: int) -> str:
    """What will be solved, before the first solve."""
    from ...nut_map.build import contact_counts
    from ...nut_map.contacts import film_parameters

    films = film_parameters(parameters)
    counts = [
        contact_counts(each, grid) for each in ([parameters] if films is parameters else [parameters, films])
    ]
    first, last = (sum(ends) for ends in zip(*counts, strict=True))
    contacts = f"{_ends(2 * first, 2 * last)} contacts ({_ends(first, last)} of each raceway)"
    pressure = largest_pressure(parameters.screw, grid.preload[1])
    return (
        f"{parameters.name}, kinematics {parameters.friction.kinematics}: preload {grid.preload[0]:g} to "
        f"{grid.preload[1]:g} N (up to {1e-9 * pressure:.3g} GPa), speed {grid.speed[0] / RPM:.4g} to "
        f"{grid.speed[1] / RPM:.4g} r/min, oil {grid.temperature[0] - CELSIUS:.4g} to "
        f"{grid.temperature[1] - CELSIUS:.4g} C; {contacts}, then {points_of(points)} points of a certificate"
    )


def _ends(least: int, most: int) -> str:
    return f"{least} to {most}" if least < most else f"{least}"


def run_map_build(args: Namespace) -> int:
    """Solve the contacts of a screw, or of every screw file of a folder, and write the maps with their certificates."""
    whole_number("--workers", args.workers)
    whole_number("--count", args.count)
    if args.tolerance is not None and not 1e-5 <= args.tolerance <= 0.1:
        raise ValueError(f"--tolerance = {args.tolerance}; allowed: 1e-5 to 0.1, relative error of the film")
    results, failed = [], []
    with ExitStack() as stack:
        # bad input of any map is refused before the first contact is solved
        wanted = [_opened(parameters, path, args, stack) for parameters, path in _screws(args)]
        executor = stack.enter_context(build_executor(args.workers, args.dask))
        progress = stack.enter_context(progress_bar())
        if args.dask is None:
            compile_kernels(executor, progress)
        for one in wanted:
            try:
                results.append(_build_one(one, args, executor, progress))
            except ArithmeticError as error:
                if args.family is None:
                    raise
                failed.append(f"{one.path.name}: {error}")
                say(f"not converged: {failed[-1]}")
    if failed:
        text = f"{len(results)} of {len(wanted)} maps built; not converged: {'; '.join(failed)}"
        if not results:
            raise ArithmeticError(text)
        say(text)
    if not args.json and args.family is None:
        print(_ending(results[0]))
        return 0
    columns = ("file", *(f"{name}_error_{key}" for name in TARGETS for key in ERRORS))
    print_results(results, args.json, args.family is not None, columns=columns)
    return 0


def _screws(args: Namespace) -> list[tuple[Parameters, Path]]:
    """Parameters and map file of every map that is asked for."""
    if args.family is not None:
        return _family(args)
    if args.output is None:
        raise ValueError("--output (missing); allowed: a file *.nc for the map")
    return [(_screw(args, args.screw), Path(args.output))]


def _opened(parameters: Parameters, path: Path, args: Namespace, stack: ExitStack) -> _Wanted:
    """A map to build, with its range and its journal, which is open until the stack is left.

    Raises       ValueError, OSError: no range, or no place for the map
    """
    from ...nut_map.build import map_journal

    grid = _grid(parameters, args)
    check_output("--output", path, "a file *.nc")
    if path.exists() and not is_map_file(path):
        raise ValueError(f"--output = {path}; allowed: a new file *.nc, or a map to replace")
    kept = path.with_name(path.name + ".contacts")
    for beside in (kept, kept.with_name(kept.name + ".lock")):
        # the lock takes a file that it may not open for that of another build
        if beside.exists() and not (beside.is_file() and os.access(beside, os.W_OK)):
            raise ValueError(
                f"--output = {path}: {beside} cannot be written; remedy: remove or rename it, or another --output"
            )
    stack.enter_context(new_folder(path.parent))
    with written("--output", path):
        return _Wanted(parameters, path, grid, stack.enter_context(map_journal(kept, parameters)))


def _family(args: Namespace) -> list[tuple[Parameters, Path]]:
    """Parameters and map file of every screw file of a folder; all are read before the first contact is solved."""
    folder = Path(args.family)
    if args.screw is not None:
        raise ValueError("--family and --screw; allowed: one of them")
    files = sorted(folder.glob("*.toml"))
    if not files:
        raise ValueError(f"--family = {folder}; allowed: a folder with screw files *.toml")
    target = Path(args.output) if args.output else folder
    try_folder(f"--output = {target}", target)
    return [(_screw(args, str(file)), target / f"{file.stem}.nc") for file in files]


def _screw(args: Namespace, file: str | None) -> Parameters:
    return screw_of(Namespace(screw=file, map=None, kinematics=args.kinematics))


def run_map_atlas(args: Namespace) -> int:
    """Solve the contacts of the atlas, compare it with others, and write it; continues an interrupted run."""
    path = Path(args.output)
    check_output("--output", path, "a file *.npz")
    whole_number("--workers", args.workers)
    whole_number("--count", args.count)
    with (
        new_folder(path.parent),
        build_executor(args.workers, args.dask) as executor,
        progress_bar() as progress,
    ):
        header = build_atlas(path, executor, args.count, progress)
    errors = header.pop("errors")
    rows = {f"{name}_error_{key}": value for name, by_key in errors.items() for key, value in by_key.items()}
    print_results([{"file": str(path), **header, **rows}], args.json, False)
    return 0
