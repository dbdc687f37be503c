"""The command `map info`: what a map file holds, in a terminal of 80 columns."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping
from typing import Any

from ..parameters.units import SHOWN
from .common import screw_hint, screw_of
from .points import listing, print_results, table

#: unit of a row, if it has one
UNITS = {
    "contacts": "both raceways, isothermal and thermal",
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
    "screw.nut_stiffness": "N/m",
    "screw.stiffness_preload": "N",
}
QUANTITIES = ("torque_error", "film_error", "temperature_rise_error")
COLUMNS = ("mean", "50", "99", "999", "max")
CERTIFICATE = "certificate: relative errors against direct solves, mean, quantiles, largest"


def run_map_info(args: Namespace) -> int:
    """Axes, film model, friction defaults, version, hashes and certificate of a map."""
    from ..nut_map.file import load_map

    with screw_hint(args, args.file):
        header = load_map(args.file, screw_of(args), own_films=True).header
    if args.json:
        print_results([header], True, False)
        return 0
    rows = _rows(header)
    print(listing(rows, {key: UNITS[key] for key in rows if key in UNITS}))
    if header["certificate"]:
        print(f"\n{CERTIFICATE}\n{_certificate_text(header['certificate'])}")
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
        elif key != "parameters_json":
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
        for name in QUANTITIES:
            values = (errors.get(f"{name}_{column}") for column in COLUMNS)
            cells = ["-" if value is None else f"{value:.2g}" for value in values]
            lines.append([f"  {name}" if region else name, str(errors.get("points", "-")), *cells])
    return table(lines)
