"""Tables that the report and the documentation of the FMUs share."""

from collections.abc import Mapping
from typing import Any

from ..nut_map.certificate import claim
from .page import Html, element, table

#: errors of a certificate by name, and their mean and quantiles by the ends of their keys, with their headings
ERRORS = {"torque": "friction torque", "film": "central film", "temperature_rise": "temperature rise"}
COLUMNS = {"mean": "mean", "50": "median", "99": "99 % quantile", "999": "99.9 % quantile", "max": "largest"}


def percent(error: float) -> str:
    """Two digits.

    Example
        >>> percent(0.00448), percent(1.2), percent(3e-6)
        ('0.45 %', '120 %', '0.0003 %')
    """
    return f"{float(f'{100.0 * error:.2g}'):g} %"


def certificate_table(certificate: Mapping[str, Any]) -> Html:
    """Errors of a map against direct solves: mean, quantiles and largest of each quantity."""
    if "points" not in certificate:
        return element("p", "The map has no certificate.", class_="note")
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
