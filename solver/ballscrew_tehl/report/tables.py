"""Tables that the report and the documentation of the FMUs share: validation and certificate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..calibration.measured_screw import MODELS, ValidationTable
from ..nut_map.certificate import claim
from ..nut_map.plot import ERRORS, TOTALS, percent
from ..parameters.units import RPM
from .page import Html, paragraph, table

#: totals of an error by the ends of their keys, as `map info` prints them
COLUMNS = {"mean": "mean", "50": "median", **dict(TOTALS)}


def words(name: str) -> str:
    """A name of the program in words."""
    return name.replace("_", " ")


def percent_of(value: float) -> str:
    return f"{100.0 * value:.2f} %"


def validation_table(
    shown: ValidationTable, label: str = "", others: Mapping[str, ValidationTable] | None = None
) -> Html:
    """One table with a column per friction set and published model; last row: mean deviations.

    Parameters   label : friction set of the table, "" if it is the only one;  others : friction set -> same table
    """
    digits = 4 if shown.unit == "N.m" else 1
    sets = others or {}
    names = [f"this model, {words(name)}" if name else "this model" for name in (label, *sets)]
    head = ["preload [N]", "speed [r/min]", "measured", *names, *MODELS[1:]]
    rows = []
    for i, row in enumerate(shown.rows):
        values = [row.models[0], *(found.rows[i].models[0] for found in sets.values()), *row.models[1:]]
        rows.append(
            [f"{row.preload:.0f}", f"{row.speed / RPM:.0f}", f"{row.measured:.{digits - 1}f}"]
            + [f"{value:.{digits}f}" for value in values]
        )
    means = [shown.deviations[0], *(found.deviations[0] for found in sets.values()), *shown.deviations[1:]]
    total = ["mean deviation", "", "", *map(percent_of, means)]
    return table(shown.name, f"{shown.title} [{shown.unit.replace('.', ' ')}]", head, rows, total)


def certificate_table(certificate: Mapping[str, Any]) -> Html:
    """Errors of a map against direct solves: mean, quantiles and largest of each quantity."""
    if "points" not in certificate:
        return paragraph("The map has no certificate.", class_="note")
    rows = []
    for name, quantity in ERRORS.items():
        errors = (certificate.get(f"{name}_error_{key}") for key in COLUMNS)
        rows.append([quantity, *("-" if error is None else percent(error) for error in errors)])
    caption = (
        f"Certificate: error at {certificate['points']} points of {certificate['what']}, compared with direct solves "
        "of the balls"
    )
    if certificate.get("points_not_solved"):
        caption += f"; {certificate['points_not_solved']} more were not solved"
    caption += f". {claim(certificate['points'])}"
    return table("certificate", caption, ["", *COLUMNS.values()], rows)


#: errors of a region of a certificate by their key, with their headings
REGION_ERRORS = {
    "torque_error_99": "torque, 99 %",
    "torque_error_max": "torque, largest",
    "film_error_99": "film, 99 %",
    "temperature_rise_error_99": "temperature rise, 99 %",
}


def certificate_regions(certificate: Mapping[str, Any]) -> Html:
    """The errors of REGION_ERRORS by region, where the certificate has them."""
    regions = certificate.get("regions", {})
    if not regions:
        return Html()
    rows = [
        [name, str(errors["points"]), *(percent(errors[key]) for key in REGION_ERRORS)]
        for name, errors in regions.items()
    ]
    head = ["region", "points", *REGION_ERRORS.values()]
    return table("certificate_regions", "The same by region", head, rows)
