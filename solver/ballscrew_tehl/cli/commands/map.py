"""The commands `map build`, `map check` and `map info`."""

import shlex
import textwrap
from argparse import Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...nut_map.build import build_map
from ...nut_map.certificate import STAGE, claim, deviation_from_direct, points_of
from ...nut_map.file import is_map_file, load_map, save_map
from ...nut_map.grid import MapGrid, largest_pressure, screw_grid
from ...nut_map.workers import worker_pool
from ...parameters.file import Parameters
from ...parameters.units import SHOWN
from ...runtime.packed import certificate_totals
from ..shared.chosen import screw_of
from ..shared.files import check_output, new_folder, try_folder, written
from ..shared.progress import QUIET, progress_bar
from ..shared.quantities import REPORT_POINT, whole_number
from ..shared.results import Answer, listing, say, table, width

#: errors of a certificate that `map build` prints, and which of them
QUANTITIES, ERRORS = ("torque", "film", "temperature_rise"), ("mean", "99", "max")
#: errors that `map info` prints, with their columns and further parts of a certificate
ALL_QUANTITIES = ("torque_error", "film_error", "minimum_film_error", "temperature_rise_error")
COLUMNS = ("mean", "50", "99", "999", "max")
PARTS = {
    "against_direct_solves": "against direct solves on their own grid",
    "of_direct_solves": "of these direct solves",
}
#: unit of a row of `map info`, if it has one
UNITS = {
    "defaults.roughness_height": "m",
    "mechanistic.eyring_stress": "Pa",
    "mechanistic.roughness_height": "m",
    "mechanistic_interval.high": "times the torque",
    "mechanistic_interval.low": "times the torque",
    "mechanistic_interval.preload": "N",
    "mechanistic_interval.speed": "rad/s",
    "mechanistic_interval.temperature": "K",
    "presliding_angle": "rad at 1 N, grows as force^(1/3)",
    "screw.lead": "m",
    "screw.diameter": "m",
    "screw.nut_stiffness": "N/m",
    "screw.stiffness_preload": "N",
}


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


def run_map_info(args: Namespace) -> Answer:
    """Axes, film model, friction defaults, version, hashes and certificate of a map."""
    header = load_map(args.map, screw_of(args)).header
    certificate = header["certificate"]
    text = (
        f"certificate: relative errors against direct solves at points of {certificate['what']}, mean, quantiles, "
        "largest"
    )
    lines = [
        listing(_rows(header), UNITS), "", textwrap.fill(text, width()), _certificate_table(certificate),
        textwrap.fill(claim(certificate["points"]), width()),
    ]  # fmt: skip
    return Answer([header], text="\n".join(lines))


def _rows(header: Mapping[str, Any]) -> dict[str, Any]:
    """One row per entry, those of a table behind its name; tables of tables are in --json only."""
    rows: dict[str, Any] = {}
    for key, value in header.items():
        if key == "axes":
            rows |= {f"axes.{name}": _axis(name, *ends) for name, ends in value.items()}
        elif key == "certificate":
            # the rest of it has its own table
            rows["certificate.points_not_solved"] = value.get("points_not_solved")
        elif isinstance(value, Mapping):
            simple = {name: entry for name, entry in value.items() if not isinstance(entry, Mapping | None)}
            rows |= {f"{key}.{name}": entry for name, entry in simple.items()}
        elif key not in ("parameters_json", "screw_file"):
            rows[key] = value
    return {key: "-" if value == "" else value for key, value in rows.items()}


def _axis(name: str, low: float, high: float, nodes: int) -> str:
    unit = SHOWN[name]
    return f"{unit.of(low):.6g} to {unit.of(high):.6g} {unit.unit}, {nodes} nodes"


def _certificate_table(certificate: Mapping[str, Any]) -> str:
    """Errors of the whole and of its regions; the names of --json are those of row and column, torque_error_99."""
    lines: list[Sequence[str]] = []
    parts = {name: certificate[key] for key, name in PARTS.items() if key in certificate}
    for region, errors in {"": certificate, **certificate.get("regions", {}), **parts}.items():
        if region:
            lines.append([region, *[""] * (1 + len(COLUMNS))])
        for name in ALL_QUANTITIES:
            if f"{name}_mean" not in errors:
                continue
            values = (errors.get(f"{name}_{column}") for column in COLUMNS)
            cells = ["-" if value is None else f"{value:.2g}" for value in values]
            lines.append([f"  {name}" if region else name, str(errors.get("points", "-")), *cells])
    return table(["", "points", *COLUMNS], lines)


def run_map_check(args: Namespace) -> Answer:
    """Load a map, which verifies hash and parameters, and compare it with direct solves at random points.

    Exit code 1 if its error is larger than the certificate states.
    """
    parameters = screw_of(args)
    whole_number("--count", args.count)
    whole_number("--workers", args.workers)
    nut_map = load_map(args.map, parameters)
    with worker_pool(args.workers) as executor, progress_bar() as progress:
        # the first point may take as long as compiling the solver
        progress(0, points_of(args.count), STAGE)
        deviation = deviation_from_direct(nut_map, parameters, args.count, executor, progress)
    result = certificate_totals(deviation)
    certificate = nut_map.header["certificate"]
    allowed = float(certificate.get("against_direct_solves", certificate)["torque_error_max"])
    error = result["torque_error_max"]
    good = error <= allowed + 1e-6
    if not good:
        say(f"map differs from direct solves by {error:.2e}; its certificate states {allowed:.2e}")
    result |= {"certificate": allowed, "within_certificate": good, "file_hash": nut_map.header["file_hash"]}
    return Answer([result], code=0 if good else 1)
