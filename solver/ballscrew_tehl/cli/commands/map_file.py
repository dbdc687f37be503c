"""The commands `map check` and `map info`: what a map file holds, in a terminal of 80 columns."""

import textwrap
from argparse import Namespace
from collections.abc import Mapping, Sequence
from typing import Any

from ...nut_map.certificate import STAGE, claim, deviation_from_direct, points_of
from ...nut_map.file import load_map
from ...nut_map.workers import worker_pool
from ...parameters.units import SHOWN
from ...runtime.packed import certificate_totals
from ..shared.chosen import screw_of
from ..shared.progress import progress_bar
from ..shared.results import Answer, listing, say, table, width

#: errors of a certificate, with their columns and further parts of a certificate
QUANTITIES = ("torque_error", "film_error", "minimum_film_error", "temperature_rise_error")
COLUMNS = ("mean", "50", "99", "999", "max")
PARTS = {
    "against_direct_solves": "against direct solves on their own grid",
    "of_direct_solves": "of these direct solves",
}
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
        for name in QUANTITIES:
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
    for option, value in {"--count": args.count, "--workers": args.workers}.items():
        if value is not None and value < 1:
            raise ValueError(f"{option} = {value}; allowed: a whole number >= 1")
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
