"""The commands `map check`, `map info` and `map plot`: what a map file holds, in a terminal of 80 columns."""

from __future__ import annotations

import textwrap
from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ... import __version__
from ...friction.sets import default_friction_set
from ...nut_map.certificate import STAGE, claim, deviation_from_direct, points_of
from ...parameters.units import SHOWN
from ...runtime.packed import certificate_totals
from ..shared.chosen import screw_of
from ..shared.files import check_output, written
from ..shared.progress import progress_bar
from ..shared.quantities import whole_number
from ..shared.results import listing, print_results, say, table, width

#: unit of a row, if it has one
UNITS = {
    "contacts": "both raceways",
    "contact_range.load": "N",
    "contact_range.preloaded": "N",
    "contact_range.speed": "rad/s",
    "contact_range.temperature": "K",
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
QUANTITIES = ("torque_error", "film_error", "temperature_rise_error")
LEFT_OUT = ("torque_left_out", "film_left_out", "temperature_rise_left_out")
COLUMNS = ("mean", "50", "99", "999", "max")
CERTIFICATE = (
    "certificate: relative errors against direct solves, and of contacts left out (points: how many), mean, quantiles, "
    "largest"
)


def run_map_info(args: Namespace) -> int:
    """Axes, film model, friction defaults, version, hashes and certificate of a map."""
    from ...nut_map.file import load_map

    header = load_map(args.map, screw_of(args)).header
    if args.json:
        print_results([header], True, False)
        return 0
    rows = _rows(header)
    print(listing(rows, {key: UNITS[key] for key in rows if key in UNITS}))
    if header["certificate"]:
        print(f"\n{textwrap.fill(CERTIFICATE, width())}\n{_certificate_text(header['certificate'])}")
    return 0


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
    shown = SHOWN[name]
    return f"{shown.of(low):.6g} to {shown.of(high):.6g} {shown.unit}, {nodes} nodes"


def _certificate_text(certificate: Mapping[str, Any]) -> str:
    """Errors of the whole and of its regions; the names of --json are those of row and column, torque_error_99."""
    lines = [["", "points", *COLUMNS]]
    for region, errors in {"": certificate, **certificate.get("regions", {})}.items():
        if region:
            lines.append([region, *[""] * (1 + len(COLUMNS))])
        known = "" if region else str(errors.get("left_out_contacts", ""))
        for name in (*QUANTITIES, *(LEFT_OUT if known else ())):
            values = (errors.get(f"{name}_{column}") for column in COLUMNS)
            cells = ["-" if value is None else f"{value:.2g}" for value in values]
            points = known if name in LEFT_OUT else str(errors.get("points", "-"))
            lines.append([f"  {name}" if region else name, points, *cells])
    if "points" not in certificate:
        return table(lines)
    text = claim(certificate["points"], certificate.get("unphysical_trend_points", 0))
    return f"{table(lines)}\n{textwrap.fill(text, width())}"


def run_map_check(args: Namespace) -> int:
    """Load a map, which verifies hash and parameters, and compare it with direct solves.

    Exit code 1 if its error is larger than its certificate states. The points are the first ones of the certificate.
    """
    from ...nut_map.file import load_map

    parameters = screw_of(args)
    whole_number("--count", args.count)
    nut_map = load_map(args.map, parameters)
    with progress_bar() as progress:
        # the first point may take as long as compiling the solver
        progress(0, points_of(args.count), STAGE)
        deviation = deviation_from_direct(nut_map, parameters, args.count, progress=progress)
    result = certificate_totals(deviation)
    allowed = float(nut_map.header["certificate"].get("torque_error_max", 0.0))
    good = result["torque_error_max"] <= allowed + 1e-6
    result |= {"certificate": allowed, "within_certificate": good, "file_hash": nut_map.header["file_hash"]}
    print_results([result], args.json, False)
    if not good:
        say(
            f"map differs from direct solves by {result['torque_error_max']:.2e}; its certificate states {allowed:.2e}"
        )
    return 0 if good else 1


def run_map_plot(args: Namespace) -> int:
    """Draw a map: torque, film and temperature rise over speed, its samples and the points of its certificate."""
    path = Path(args.output)
    check_output("--output", path, "a file *.png")
    parameters = screw_of(args)
    from ...nut_map.file import load_contact_map, load_map
    from ...nut_map.plot import map_figure, map_picture, save_figure

    nut_map = load_map(args.map, parameters)
    say(f"drawing {path}")
    picture = map_picture(nut_map, load_contact_map(args.map, parameters))
    file_hash = picture.nut_map.header["file_hash"]
    figure = map_figure(picture, args.error)
    with written("--output", path):
        save_figure(figure, path, file_hash)
    friction_set = default_friction_set(parameters)
    result = {
        "file": str(path),
        "screw": parameters.name,
        "kinematics": friction_set.kinematics,
        "friction_set": friction_set.name,
        "map_hash": file_hash,
        "version": __version__,
    }
    print_results([result], args.json, False)
    return 0
