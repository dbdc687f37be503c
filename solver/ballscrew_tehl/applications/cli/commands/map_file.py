"""The commands `map build`, `map check` and `map info`: makes a map file, compares it, states what it holds."""

import shlex
from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ballscrew_tehl.applications.screw_model import read_screw
from ballscrew_tehl.nut_map.build import build_map
from ballscrew_tehl.nut_map.file import is_map_file, save_map
from ballscrew_tehl.nut_map.grid import MapGrid, largest_pressure, screw_grid
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters.file import Parameters
from ballscrew_tehl.parameters.units import SHOWN
from ballscrew_tehl.refinement.certificate import claim, deviation_from_direct
from ballscrew_tehl.refinement.processes import worker_pool
from ballscrew_tehl.runtime.packed import certificate_totals

from ...quantities import REPORT_POINT
from ..shared.output import QUIET, Answer, check_output, filled, listing, progress_bar, say, table, written

#: of a header, in --json only
HIDDEN = ("certificate", "parameters_json", "screw_file", "atlas", "parameters_hash", "content_hash")
#: errors of a certificate, with their columns
QUANTITIES = ("torque_error", "film_error", "minimum_film_error", "temperature_rise_error")
COLUMNS = ("mean", "50", "99", "999", "max")
#: those that are printed with a new map
OF_BUILD = tuple(f"{name}_{key}" for name in QUANTITIES[:2] for key in ("mean", "99", "max"))


def run_map_build(args: Namespace) -> Answer:
    """Sum the contacts of the atlas over the nut of a screw, or of every screw file of a folder, and write the maps."""
    results = []
    with progress_bar(QUIET) as progress:
        for path, parameters, grid in _jobs(args):
            axes = ((quantity.axis, *getattr(grid, quantity.axis)[:2]) for quantity in REPORT_POINT)
            preload, speed, oil = (_range(*ends) for ends in axes)
            pressure = 1e-9 * largest_pressure(parameters.screw, grid.preload[1])
            say(
                f"{path}: {parameters.name}, law {parameters.friction.law}: preload {preload} (up to "
                f"{pressure:.3g} GPa), speed {speed}, oil {oil}"
            )
            built = build_map(parameters, grid, progress)
            fraction = built.header["atlas_fraction"]
            if fraction < 1.0:
                say(
                    f"{100.0 * (1.0 - fraction):.2g} % of its contacts lie beyond the range of the atlas: there they "
                    "keep their ratio to the closed forms at its end"
                )
            with written("--output", path):
                file_hash = save_map(path, built)
            totals = certificate_totals(built.header["certificate"])
            results.append({"file": str(path), "file_hash": file_hash, "atlas_fraction": fraction, **totals})
    if args.family is not None:
        return Answer(results, many=True, columns=("file", "atlas_fraction", *OF_BUILD))
    file, fmus = (shlex.quote(str(name)) for name in (path, path.with_name(f"{path.stem}_fmus")))
    errors = listing({key: results[0][key] for key in OF_BUILD})
    text = f"{errors}\nmore: ballscrew map info {file}\nnext: ballscrew build --map {file} --output {fmus}"
    return Answer(results, text=text)


def _jobs(args: Namespace) -> list[tuple[Path, Parameters, MapGrid]]:
    """File, parameters and range of every map that is requested."""
    if args.family is None:
        if args.output is None:
            raise ValueError("--output (missing); allowed: a file *.npz for the map")
        maps = {args.screw: Path(args.output)}
    else:
        files = sorted(Path(args.family).glob("*.toml"))
        if args.screw is not None:
            raise ValueError("--family and --screw; allowed: one of them")
        if not files:
            raise ValueError(f"--family = {args.family}; allowed: a folder with screw files *.toml")
        maps = {str(file): Path(args.output or args.family, f"{file.stem}.npz") for file in files}
    # without options the table [map] of the screw file, else what the screw allows
    user: dict[str, float] = {}
    for quantity in REPORT_POINT:
        for end, value in zip(("min", "max"), getattr(args, quantity.name) or (), strict=False):
            user[f"{quantity.axis}_{end}"] = SHOWN[quantity.axis].si(value)
    jobs = []
    for file, path in maps.items():
        check_output("--output", path, "a file *.npz")
        if path.exists() and not is_map_file(path):
            raise ValueError(f"--output = {path}; allowed: a new file *.npz, or a map to replace")
        parameters = read_screw(file)
        jobs.append((path, parameters, screw_grid(parameters, user)))
    return jobs


def run_map_info(args: Namespace) -> Answer:
    """Axes, film model, friction defaults, version, hash of the file and certificate of a map."""
    header = load_map(args.map, read_screw(args.screw, args.map)).header
    certificate = header["certificate"]
    about = (
        f"certificate: relative errors against direct solves at points of {certificate['what']}, mean, quantiles, "
        f"largest. {claim(certificate['points'])}"
    )
    # SI, entries of a table behind its name; tables of tables are in --json only
    rows: dict[str, Any] = {}
    for key, value in header.items():
        if key == "axes":
            rows |= {
                f"axes.{name}": f"{_range(name, *ends)}, {n} nodes" for name, (*ends, n) in value.items()
            }
        elif isinstance(value, Mapping) and key != "certificate":
            simple = {name: entry for name, entry in value.items() if not isinstance(entry, Mapping | None)}
            rows |= {f"{key}.{name}": entry for name, entry in simple.items()}
        elif key not in HIDDEN:
            rows[key] = value
    text = f"{listing(rows)}\n\n{filled(about)}\n{_certificate_table(certificate)}"
    return Answer([header], text=text)


def _certificate_table(certificate: Mapping[str, Any]) -> str:
    """Errors of the whole and of its regions; the names of --json are those of row and column, torque_error_99."""
    lines: list[list[str]] = []
    parts = {key: value for key, value in certificate.items() if key.endswith("direct_solves")}
    for region, errors in {"": certificate, **certificate.get("regions", {}), **parts}.items():
        if region:
            lines.append([region, *[""] * (1 + len(COLUMNS))])
        for name in QUANTITIES:
            if f"{name}_mean" in errors:
                cells = (f"{errors[f'{name}_{column}']:.2g}" for column in COLUMNS)
                lines.append([f"  {name}" if region else name, str(errors["points"]), *cells])
    return table(["", "points", *COLUMNS], lines)


def _range(axis: str, low: float, high: float) -> str:
    unit = SHOWN[axis]
    return f"{unit.of(low):.6g} to {unit.of(high):.6g} {unit.unit}"


def run_map_check(args: Namespace) -> Answer:
    """Compare a map with direct solves at random points; exit code 1 if its error is beyond its certificate."""
    parameters = read_screw(args.screw, args.map)
    nut_map = load_map(args.map, parameters)
    with worker_pool(args.workers) as executor, progress_bar() as progress:
        deviation = deviation_from_direct(nut_map, parameters, args.count, executor, progress)
    result, certificate = certificate_totals(deviation), nut_map.header["certificate"]
    allowed = float(certificate.get("against_direct_solves", certificate)["torque_error_max"])
    error = result["torque_error_max"]
    good = error <= allowed + 1e-6
    if not good:
        say(f"map differs from direct solves by {error:.2e}; its certificate states {allowed:.2e}")
    result |= {"certificate": allowed, "within_certificate": good, "file_hash": nut_map.header["file_hash"]}
    return Answer([result], code=0 if good else 1)
