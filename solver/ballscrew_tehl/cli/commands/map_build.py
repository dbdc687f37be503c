"""The command `map build`."""

import shlex
from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...nut_map.build import build_map
from ...nut_map.file import is_map_file, save_map
from ...nut_map.grid import MapGrid, largest_pressure, screw_grid
from ...parameters.file import Parameters
from ...parameters.units import SHOWN
from ...runtime.packed import certificate_totals
from ..shared.chosen import screw_of
from ..shared.files import check_output, new_folder, try_folder, written
from ..shared.progress import QUIET, progress_bar
from ..shared.quantities import REPORT_POINT
from ..shared.results import Answer, say, table

#: errors of a certificate that are printed, and which of them
QUANTITIES, ERRORS = ("torque", "film", "temperature_rise"), ("mean", "99", "max")


def run_map_build(args: Namespace) -> Answer:
    """Sum the contacts of the atlas over the nut of a screw, or of every screw file of a folder, and write the maps."""
    requested = [(parameters, _checked(path)) for parameters, path in _screws(args)]
    grids = [_grid(parameters, args) for parameters, _ in requested]
    results = []
    with progress_bar(QUIET) as progress:
        for (parameters, path), grid in zip(requested, grids, strict=True):
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
    if args.family is None:
        return Answer(results, text=_ending(results[0]))
    columns = ("file", "atlas_fraction", *(f"{name}_error_{key}" for name in QUANTITIES for key in ERRORS))
    return Answer(results, many=True, columns=columns)


def _ending(result: Mapping[str, Any]) -> str:
    """Errors of the atlas in per cent, and what to do with the map."""
    rows = []
    for name in QUANTITIES:
        values = (100.0 * result[f"{name}_error_{key}"] for key in ERRORS)
        rows.append([name.replace("_", " "), *(f"{value:.2g}" for value in values)])
    path = Path(result["file"])
    file, page, fmus = (
        shlex.quote(str(name))
        for name in (path, path.with_suffix(".html"), path.with_name(f"{path.stem}_fmus"))
    )
    return (
        f"{table(('error of the contacts [%]', 'mean', '99 %', 'largest'), rows)}\n"
        f"more of it: ballscrew map info {file}\nnext: ballscrew page --map {file} --output {page}\n"
        f"      ballscrew build --map {file} --output {fmus}"
    )


def _grid(parameters: Parameters, args: Namespace) -> MapGrid:
    """Range of a map: by options, else the table [map] of the screw file, else what the screw allows."""
    given: dict[str, float] = {}
    for quantity in REPORT_POINT:
        if (ends := getattr(args, quantity.name)) is not None:
            low, high = (SHOWN[quantity.axis].si(end) for end in ends)
            given |= {f"{quantity.axis}_min": low, f"{quantity.axis}_max": high}
    return screw_grid(parameters, given)


def _plan(parameters: Parameters, grid: MapGrid) -> str:
    """The range of a map."""
    low, high = grid.preload[:2]
    pressure = largest_pressure(parameters.screw, high)
    speed, oil = (
        " to ".join(f"{SHOWN[axis].of(end):.4g}" for end in getattr(grid, axis)[:2])
        for axis in ("speed", "temperature")
    )
    return (
        f"{parameters.name}, kinematics {parameters.friction.kinematics}: preload {low:g} to {high:g} N "
        f"(up to {1e-9 * pressure:.3g} GPa), speed {speed} r/min, oil {oil} C"
    )


def _screws(args: Namespace) -> list[tuple[Parameters, Path]]:
    """Parameters and map file of every map that is requested; all are read before the first map is made."""

    def screw(file: str | None) -> Parameters:
        return screw_of(Namespace(screw=file, map=None, kinematics=args.kinematics))

    if args.family is None:
        if args.output is None:
            raise ValueError("--output (missing); allowed: a file *.npz for the map")
        return [(screw(args.screw), Path(args.output))]
    folder = Path(args.family)
    if args.screw is not None:
        raise ValueError("--family and --screw; allowed: one of them")
    files = sorted(folder.glob("*.toml"))
    if not files:
        raise ValueError(f"--family = {folder}; allowed: a folder with screw files *.toml")
    target = Path(args.output) if args.output else folder
    try_folder(f"--output = {target}", target)
    return [(screw(str(file)), target / f"{file.stem}.npz") for file in files]


def _checked(path: Path) -> Path:
    check_output("--output", path, "a file *.npz")
    if path.exists() and not is_map_file(path):
        raise ValueError(f"--output = {path}; allowed: a new file *.npz, or a map to replace")
    return path
