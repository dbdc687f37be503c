"""Writes FMUs, their connections and parameter files as one archive after SSP 1.0, and checks such an archive.

SSP: System Structure and Parameterization 1.0, Modelica Association 2019. Units, kinds and types of all connectors come
from the descriptions of the FMUs. The archive has only what its importers read: no
connectors of the system itself (rejected by ecos 0.7), parameters bound to the components, one file for each.
"""

import zipfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import fmpy
from fmpy.ssp.ssd import Component as SsdComponent
from fmpy.ssp.ssd import ParameterSet, read_ssd

from ballscrew_fmu.archive import write_fmu

SPACES = {
    name: f"http://ssp-standard.org/SSP1/SystemStructure{long}"
    for name, long in {"ssd": "Description", "ssc": "Common", "ssv": "ParameterValues"}.items()
}
VERSION = "1.0"
BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


class Component(NamedTuple):
    """An FMU of the system: its name there, its parameters and start values, outputs to show unconnected."""

    name: str
    fmu: Path
    values: Mapping[str, float]
    shown: Sequence[str] = ()


class Connection(NamedTuple):
    """From an output to an input, each (component, variable)."""

    source: tuple[str, str]
    sink: tuple[str, str]


def write_archive(
    path: Path | str,
    name: str,
    components: Sequence[Component],
    connections: Sequence[Connection],
    stop_time: float,
    parameter_set: str,
) -> Path:
    """SystemStructure.ssd, resources/*.fmu and resources/*.ssv; same input, same bytes.

    name: of the system; stop_time: of its default experiment [s]; parameter_set: name of the parameter sets of all
    components. ValueError: a variable that an FMU does not have, or a connection of different units; OSError: cannot
    be written.
    """
    for space, address in SPACES.items():
        ElementTree.register_namespace(space, address)
    described = {part.name: fmpy.read_model_description(str(part.fmu)) for part in components}
    for part in components:
        if not described[part.name].fmiVersion.startswith("2"):
            raise ValueError(
                f"{part.fmu}: FMI {described[part.name].fmiVersion}; SSP 1.0 needs an FMU of FMI 2.0"
            )
    root = _element("ssd", "SystemStructureDescription", version=VERSION, name=name)
    system = _sub(root, "ssd", "System", name=name)
    elements = _sub(system, "ssd", "Elements")
    files = {}
    used = set()
    for part in components:
        fmu = f"resources/{part.fmu.name}"
        files[fmu] = part.fmu.read_bytes()
        kind = {"type": "application/x-fmu-sharedlibrary", "implementation": "CoSimulation"}
        node = _sub(elements, "ssd", "Component", name=part.name, source=fmu, **kind)
        connectors = _sub(node, "ssd", "Connectors")
        ends = [end for connection in connections for end in connection if end[0] == part.name]
        for variable in dict.fromkeys([name for _, name in ends] + list(part.shown)):
            result = _variable(described, part.name, variable)
            connector = _sub(connectors, "ssd", "Connector", name=variable, kind=result.causality)
            _typed(connector, result)
            used |= {result.unit} - {None}
        source = f"resources/{part.name}.ssv"
        _sub(_sub(node, "ssd", "ParameterBindings"), "ssd", "ParameterBinding", source=source)
        files[source] = _parameter_file(part, described, parameter_set)
    _connect(_sub(system, "ssd", "Connections"), connections, described)
    _units(_sub(root, "ssd", "Units"), used, described.values())
    _sub(root, "ssd", "DefaultExperiment", startTime="0.0", stopTime=repr(stop_time))
    files["SystemStructure.ssd"] = _text(root)
    write_fmu(path, files)  # also a zip
    return Path(path)


def _element(space: str, tag: str, **attributes: str) -> Element:
    return Element(f"{{{SPACES[space]}}}{tag}", attributes)


def _sub(parent: Element, space: str, tag: str, **attributes: str) -> Element:
    return SubElement(parent, f"{{{SPACES[space]}}}{tag}", attributes)


def _text(root: Element) -> bytes:
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def _variable(described: Mapping[str, Any], component: str, name: str) -> Any:
    if component not in described:
        raise ValueError(f"component {component!r} is not in the system; needs one of {', '.join(described)}")
    for variable in described[component].modelVariables:
        if variable.name == name:
            return variable
    raise ValueError(f"the FMU of {component} has no variable {name}")


def _typed(parent: Element, variable: Any) -> None:
    _sub(parent, "ssc", variable.type, **({"unit": variable.unit} if variable.unit else {}))


def _connect(parent: Element, connections: Sequence[Connection], described: Mapping[str, Any]) -> None:
    for source, sink in connections:
        a, b = _variable(described, *source), _variable(described, *sink)
        if (a.causality, b.causality) != ("output", "input") or (a.type, a.unit) != (b.type, b.unit):
            ends = (
                f"{'.'.join(source)} ({a.causality}, {a.unit}) to {'.'.join(sink)} ({b.causality}, {b.unit})"
            )
            raise ValueError(f"connection {ends}; needs an output and an input of one type and unit")
        start, end = dict(zip(("startElement", "startConnector"), source, strict=True)), sink
        _sub(parent, "ssd", "Connection", **start, endElement=end[0], endConnector=end[1])


def _units(parent: Element, used: set[str], descriptions: Any) -> None:
    known = {unit.name: unit for description in descriptions for unit in description.unitDefinitions}
    for name in sorted(used):
        base = known[name].baseUnit
        exponents = {key: str(getattr(base, key)) for key in BASE_UNITS if int(getattr(base, key) or 0)}
        _sub(_sub(parent, "ssc", "Unit", name=name), "ssc", "BaseUnit", **exponents)


def _parameter_file(part: Component, described: Mapping[str, Any], parameter_set: str) -> bytes:
    root = _element("ssv", "ParameterSet", version=VERSION, name=parameter_set)
    parameters = _sub(root, "ssv", "Parameters")
    used = set()
    for name, value in part.values.items():
        unit = _variable(described, part.name, name).unit
        parameter = _sub(parameters, "ssv", "Parameter", name=name)
        _sub(parameter, "ssv", "Real", value=repr(float(value)), **({"unit": unit} if unit else {}))
        used |= {unit} - {None}
    _units(_sub(root, "ssv", "Units"), used, [described[part.name]])
    return _text(root)


# --- reading ---


def bound_parameters(path: Path | str) -> ParameterSet:
    """Values of all parameter files of an archive as one set, each name after that of its component: fmpy's
    simulate_ssp takes such a set and does not read the bindings itself."""
    joined = ParameterSet(name=None)
    for component in read_ssd(str(path)).system.elements:
        for binding in component.parameterBindings:
            for values in binding.parameterValues:
                for parameter in values.parameters:
                    parameter.name = f"{component.name}.{parameter.name}"
                    joined.parameters.append(parameter)
    return joined


def findings(path: Path | str) -> list[str]:
    """Errors of an archive: schema of all its files, connectors, units and values against the FMUs.

    Exception: of fmpy, if a file does not follow its schema.
    """
    structure = read_ssd(str(path))  # checks .ssd and .ssv against the schemas of SSP 1.0
    with zipfile.ZipFile(path) as archive:
        components = structure.system.elements
        described = {
            part.name: fmpy.read_model_description(archive.open(part.source), validate=True)
            for part in components
        }
        units = _declared_units(archive.read("SystemStructure.ssd"), "ssd")
        connectors = _declared_connectors(archive.read("SystemStructure.ssd"))
        result = [text for part in components for text in _wrong_values(part, described[part.name])]
    for (part, name), (kind, unit) in connectors.items():
        variable = {v.name: v for v in described[part].modelVariables}.get(name)
        if variable is None or (variable.causality, variable.unit) != (kind, unit):
            result.append(f"connector {part}.{name}: {kind} in {unit}, the FMU has another")
        if unit is not None and units.get(unit) != _exponents(described[part], unit):
            result.append(f"unit {unit} is declared as {units.get(unit)}, not as in the FMU of {part}")
    sinks = [(link.endElement, link.endConnector) for link in structure.system.connections]
    sources = [(link.startElement, link.startConnector) for link in structure.system.connections]
    result += [f"input {a}.{b} is fed {sinks.count((a, b))} times" for (a, b), (kind, _) in connectors.items()
              if kind == "input" and sinks.count((a, b)) != 1]  # fmt: skip
    for source, sink in zip(sources, sinks, strict=True):
        if connectors.get(source, ("", ""))[1] != connectors.get(sink, ("", None))[1]:
            result.append(f"connection {'.'.join(source)} to {'.'.join(sink)} joins different units")
    return result


def _wrong_values(part: SsdComponent, description: Any) -> Iterator[str]:
    known = {v.name: v for v in description.modelVariables}
    for parameter in (p for b in part.parameterBindings for s in b.parameterValues for p in s.parameters):
        variable = known.get(parameter.name)
        if variable is None or variable.causality not in ("parameter", "input"):
            yield f"value of {part.name}.{parameter.name}: the FMU has no such parameter or input"
            continue
        low, high = float(variable.min or "-inf"), float(variable.max or "inf")
        if parameter.unit != variable.unit or not low <= float(parameter.value) <= high:
            yield f"value of {part.name}.{parameter.name} = {parameter.value} {parameter.unit}; needs {low} to {high}"


def _exponents(description: Any, unit: str) -> dict[str, int] | None:
    for known in description.unitDefinitions:
        if known.name == unit:
            return {key: int(getattr(known.baseUnit, key) or 0) for key in BASE_UNITS}
    return None


def _declared_units(xml: bytes, space: str) -> dict[str, dict[str, int]]:
    root = ElementTree.fromstring(xml)
    return {
        unit.get("name", ""): {key: int(base.get(key, "0")) for key in BASE_UNITS}
        for unit in root.findall(f"{space}:Units/ssc:Unit", SPACES)
        for base in unit.findall("ssc:BaseUnit", SPACES)
    }


def _declared_connectors(xml: bytes) -> dict[tuple[str, str], tuple[str, str | None]]:
    """Kind and unit by component and name."""
    return {
        (part.get("name", ""), connector.get("name", "")): (
            connector.get("kind", ""),
            connector[0].get("unit"),
        )
        for part in ElementTree.fromstring(xml).iterfind("ssd:System/ssd:Elements/ssd:Component", SPACES)
        for connector in part.iterfind("ssd:Connectors/ssd:Connector", SPACES)
    }
