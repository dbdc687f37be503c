"""The commands `map check` and `map info`: what a map file holds, in a terminal of 80 columns."""

from __future__ import annotations

import textwrap
from argparse import Namespace
from collections.abc import Mapping
from typing import Any

from ...nut_map.certificate import STAGE, claim, deviation_from_direct, points_of
from ...nut_map.workers import worker_pool
from ...parameters.units import SHOWN
from ...runtime.packed import certificate_totals
from ..shared.chosen import screw_of
from ..shared.progress import progress_bar
from ..shared.quantities import whole_number
from ..shared.results import listing, print_results, say, table, width

#: unit of a row, if it has one
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
QUANTITIES = ("torque_error", "film_error", "minimum_film_error", "temperature_rise_error")
#: further parts of a certificate, with their names
PARTS = {
    "against_direct_solves": "against direct solves on their own grid",
    "of_direct_solves": "of these direct solves",
}
COLUMNS = ("mean", "50", "99", "999", "max")
CERTIFICATE = (
    "certificate: relative errors against direct solves at points of {what}, mean, quantiles, largest"
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
    certificate = header["certificate"]
    print(f"\n{textwrap.fill(CERTIFICATE.format(**certificate), width())}\n{_certificate_text(certificate)}")
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
    parts = {name: certificate[key] for key, name in PARTS.items() if key in certificate}
    for region, errors in {"": certificate, **certificate.get("regions", {}), **parts}.items():
        if region:
            lines.append([region, *[""] * (1 + len(COLUMNS))])
        for name in QUANTITIES:
            if f"{name}_mean" not in errors:
                continue
            values = (errors.get(f"{name}_{column}") for column in COLUMNS)
            cells = ["-" if value is None else f"{value:.2g}" for value in values]
            lines.append([f"  {name}" if region else name, str(errors.get("points", "-")), *cells])
    text = claim(certificate["points"])
    return f"{table(lines)}\n{textwrap.fill(text, width())}"


def run_map_check(args: Namespace) -> int:
    """Load a map, which verifies hash and parameters, and compare it with direct solves at random points.

    Exit code 1 if its error is larger than the certificate states.
    """
    from ...nut_map.file import load_map

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
    good = result["torque_error_max"] <= allowed + 1e-6
    result |= {"certificate": allowed, "within_certificate": good, "file_hash": nut_map.header["file_hash"]}
    print_results([result], args.json, False)
    if not good:
        say(
            f"map differs from direct solves by {result['torque_error_max']:.2e}; its certificate states {allowed:.2e}"
        )
    return 0 if good else 1
