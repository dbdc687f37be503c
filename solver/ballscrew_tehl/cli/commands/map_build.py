"""The command `map build`."""

from __future__ import annotations

import shlex
from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...nut_map.build import build_map
from ...nut_map.file import is_map_file, save_map
from ...nut_map.grid import MapGrid, largest_pressure, screw_grid
from ...parameters.file import Parameters
from ...parameters.units import CELSIUS, RPM
from ...runtime.packed import certificate_totals
from ..shared.chosen import screw_of
from ..shared.files import check_output, new_folder, try_folder, written
from ..shared.progress import QUIET, progress_bar
from ..shared.results import print_results, say, table

#: errors of a certificate that are printed, and which of them
QUANTITIES, ERRORS = ("torque", "film", "temperature_rise"), ("mean", "99", "max")


def run_map_build(args: Namespace) -> int:
    """Sum the contacts of the atlas over the nut of a screw, or of every screw file of a folder, and write the maps."""
    wanted = [(parameters, _checked(path)) for parameters, path in _screws(args)]
    grids = [_grid(parameters, args) for parameters, _ in wanted]
    results = []
    with progress_bar(QUIET) as progress:
        for (parameters, path), grid in zip(wanted, grids, strict=True):
            say(_plan(parameters, grid))
            built = build_map(parameters, grid, progress)
            fraction = built.header["atlas_fraction"]
            if fraction < 1.0:
                say(
                    f"{100.0 * (1.0 - fraction):.2g} % of its contacts lie beyond the range of the atlas: there they "
                    "keep their ratio to the closed forms at its end"
                )
            with new_folder(path.parent), written("--output", path):
                file_hash = save_map(path, built)
            totals = certificate_totals(built.header["certificate"])
            results.append({"file": str(path), "file_hash": file_hash, "atlas_fraction": fraction, **totals})
    if not args.json and args.family is None:
        print(_ending(results[0]))
        return 0
    columns = ("file", "atlas_fraction", *(f"{name}_error_{key}" for name in QUANTITIES for key in ERRORS))
    print_results(results, args.json, args.family is not None, columns=columns)
    return 0


def _ending(result: Mapping[str, Any]) -> str:
    """Errors of the atlas in per cent, and what to do with the map."""
    rows = [["error of the contacts [%]", "mean", "99 %", "largest"]]
    for name in QUANTITIES:
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
    """Range of a map: by options, else the table [map] of the screw file, else what the screw allows."""
    given: dict[str, float] = {}
    for name, option, scale, shift in (
        ("preload", args.preload_n, 1.0, 0.0), ("speed", args.speed_rpm, RPM, 0.0),
        ("temperature", args.temperature_c, 1.0, CELSIUS),
    ):  # fmt: skip
        if option is not None:
            given |= {
                f"{name}_{end}": scale * value + shift
                for end, value in zip(("min", "max"), option, strict=True)
            }
    return screw_grid(parameters, given)


def _plan(parameters: Parameters, grid: MapGrid) -> str:
    """The range of a map."""
    pressure = largest_pressure(parameters.screw, grid.preload[1])
    return (
        f"{parameters.name}, kinematics {parameters.friction.kinematics}: preload {grid.preload[0]:g} to "
        f"{grid.preload[1]:g} N (up to {1e-9 * pressure:.3g} GPa), speed {grid.speed[0] / RPM:.4g} to "
        f"{grid.speed[1] / RPM:.4g} r/min, oil {grid.temperature[0] - CELSIUS:.4g} to "
        f"{grid.temperature[1] - CELSIUS:.4g} C"
    )


def _screws(args: Namespace) -> list[tuple[Parameters, Path]]:
    """Parameters and map file of every map that is asked for."""
    if args.family is not None:
        return _family(args)
    if args.output is None:
        raise ValueError("--output (missing); allowed: a file *.npz for the map")
    return [(_screw(args, args.screw), Path(args.output))]


def _checked(path: Path) -> Path:
    check_output("--output", path, "a file *.npz")
    if path.exists() and not is_map_file(path):
        raise ValueError(f"--output = {path}; allowed: a new file *.npz, or a map to replace")
    return path


def _family(args: Namespace) -> list[tuple[Parameters, Path]]:
    """Parameters and map file of every screw file of a folder; all are read before the first map is made."""
    folder = Path(args.family)
    if args.screw is not None:
        raise ValueError("--family and --screw; allowed: one of them")
    files = sorted(folder.glob("*.toml"))
    if not files:
        raise ValueError(f"--family = {folder}; allowed: a folder with screw files *.toml")
    target = Path(args.output) if args.output else folder
    try_folder(f"--output = {target}", target)
    return [(_screw(args, str(file)), target / f"{file.stem}.npz") for file in files]


def _screw(args: Namespace, file: str | None) -> Parameters:
    return screw_of(Namespace(screw=file, map=None, kinematics=args.kinematics))
