"""Documentation page of an FMU: its map, its friction parameters, the parts of its model, its variables."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from ballscrew_fmu.variables.friction import Variable
from ballscrew_tehl.report.page import Html, bullets, element, page, paragraph, section, table
from ballscrew_tehl.report.tables import certificate_table
from ballscrew_tehl.runtime.packed import map_hash


class Part(NamedTuple):
    """A part of the page: heading and content."""

    title: str
    content: Sequence[Html]


def part(title: str, *content: str) -> Part:
    """A part of the page from texts (one paragraph each) and Html."""
    return Part(title, [entry if isinstance(entry, Html) else paragraph(entry) for entry in content])


def documentation_page(
    name: str,
    lead: Sequence[Html],
    header: Mapping[str, Any],
    parts: Iterable[Part],
    variables: Sequence[Variable],
) -> str:
    """The page of the FMU with this name.

    Parameters   lead : introduction;  header : of its map;  variables : rows of the last part
    """
    shown = (
        Part("Map", map_provenance(header)),
        Part("Friction parameters", friction_provenance(header)),
        *parts,
        Part("Variables", [_variable_table(variables)]),
    )
    sections = []
    for title, content in shown:
        key = title.lower().replace(" ", "_")
        sections.append((key, title, section(key, title, *content)))
    return page(name, lead, sections, element("span", f"map {map_hash(header)}"))


def map_provenance(header: Mapping[str, Any]) -> list[Html]:
    """Source, range and certificate of the map."""
    axes = header["axes"]
    text = (
        f"{header['kinematics']} kinematics, film model {header['film_model']}, map {map_hash(header)} "
        f"of version {header['version']}, parameters {header['parameters_hash']}. "
        f"Range: force of a nut up to {axes['force'][1]:g} N, speed up to {axes['speed'][1]:g} rad/s, "
        f"{axes['temperature'][0]:g} to {axes['temperature'][1]:g} K."
    )
    return [paragraph(text), certificate_table(header["certificate"])]


def friction_provenance(header: Mapping[str, Any]) -> list[Html]:
    """Start values of the friction parameters with their source, errors and limits."""
    found, values = header.get("friction"), header["defaults"]
    if not found:
        return [paragraph(", ".join(f"{name} = {value:.6g}" for name, value in values.items()))]
    text = f"{found['set']}, {found['loss'] or 'not fitted'}: {found['provenance']}"
    content = [paragraph(text)]
    if other := found.get("carried_over"):
        content.append(paragraph(f"{other[0].upper()}{other[1:]}."))
    if found["errors"]:
        errors = ", ".join(f"{name} {100.0 * value:.2f} %" for name, value in found["errors"].items())
        content.append(paragraph(f"Relative deviations from the measured torque: {errors}"))
    content.append(
        bullets(*(_parameter_text(name, value, found["limits"]) for name, value in values.items()))
    )
    if found["not_identified"]:
        content.append(paragraph("Not identified by the measured torques:"))
        content.append(bullets(*(f"{name}: {why}" for name, why in found["not_identified"].items())))
    elif found["not_identified"] is not None:
        content.append(paragraph("The measured torques identify all parameters."))
    return content


def _parameter_text(name: str, value: float, limits: Mapping[str, Any]) -> str:
    unit = " m" if name == "roughness_height" else ""
    text = f"{name} = {value:.6g}{unit}"
    if name in limits:
        low, high = limits[name]
        text += f", 95 % limits {low:.4g} to {'no bound' if high is None else f'{high:.4g}{unit}'}"
    return text


def _variable_table(variables: Sequence[Variable]) -> Html:
    rows = []
    for v in variables:
        unit = "Boolean" if v.unit is None else v.unit
        if v.display_unit:
            unit += f" ({v.display_unit})"
        values = (v.start, v.minimum, v.maximum)
        numbers = ("" if x is None else str(x).lower() if isinstance(x, bool) else f"{x:g}" for x in values)
        rows.append((v.name, v.causality, unit, *numbers, v.description))
    head = ("name", "kind", "unit", "start", "min", "max", "meaning")
    return table("variable_table", "Names, units (display units) and bounds", head, rows, text=True)
