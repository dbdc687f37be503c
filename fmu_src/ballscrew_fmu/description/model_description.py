"""modelDescription.xml of all FMUs; buildDescription.xml and terminalsAndIcons.xml of the native ones."""

import os
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from importlib.metadata import distribution
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ballscrew_fmu.models import FRICTION, FmuModel
from ballscrew_fmu.variables.friction import (
    FIRST_REFERENCE,
    TIME,
    UNITS,
    Variable,
    band_text,
    fmu_variables,
    law_name,
    lead_text,
)
from ballscrew_tehl import __date__, __version__
from ballscrew_tehl.runtime.packed import map_hash

LOG_CATEGORIES = {
    "logStatusWarning": "An input or the force of a nut is outside the map and is clamped",
    "logStatusDiscard": "An invalid value, which is not stored; of an FMU for Python hosts: a step with one",
    "logStatusError": "A call that is illegal in the current state or has invalid arguments, with the reason",
    "logStatusFatal": "Failures that end the simulation",
    "logAll": "All messages",
}


def licence_text() -> str:
    """Text of the licence of this package."""
    files = distribution("ballscrew-tehl").files or ()
    return next(file.read_text(encoding="utf-8") for file in files if file.name == "LICENSE")


def about() -> dict[str, str]:
    """Version, author, copyright, licence and date by attribute of the description, the same in FMI 2.0 and 3.0.

    The date is that of the version, so that the same input gives the same FMU; the variable SOURCE_DATE_EPOCH of
    reproducible builds [s since 1970] replaces it; ValueError: not a number.
    """
    notice = next(line for line in licence_text().splitlines() if line.startswith("Copyright"))
    made = datetime.fromisoformat(__date__).replace(tzinfo=UTC)
    if epoch := os.environ.get("SOURCE_DATE_EPOCH"):
        made = datetime.fromtimestamp(int(epoch), UTC)
    return {
        "author": notice.split(" ", 3)[3],  # Copyright (c) year author
        "version": __version__,
        "copyright": notice,
        "license": distribution("ballscrew-tehl").metadata["License-Expression"],
        "generationDateAndTime": made.strftime("%Y-%m-%dT%H:%M:%SZ"),
    }


def flags(true: str, false: str) -> dict[str, str]:
    """Capability flags from their names."""
    return dict.fromkeys(true.split(), "true") | dict.fromkeys(false.split(), "false")


_PYTHON = flags(
    "canHandleVariableCommunicationStepSize canNotUseMemoryManagementFunctions canGetAndSetFMUstate "
    "canSerializeFMUstate",
    # the code runs in the process of the host, with its Python (documentation/externalDependencies.txt), and PyFMI
    # refuses an FMU that needs a tool
    "needsExecutionTool canInterpolateInputs canRunAsynchronuously canBeInstantiatedOnlyOncePerProcess "
    "providesDirectionalDerivative",
) | {"maxOutputDerivativeOrder": "0"}
# of native FMUs by version of FMI
_DERIVED = {
    2: "providesDirectionalDerivative",
    3: "providesDirectionalDerivatives providesAdjointDerivatives",
}
_COMMON = {
    2: flags(
        f"canGetAndSetFMUstate canSerializeFMUstate canNotUseMemoryManagementFunctions {_DERIVED[2]}",
        "needsExecutionTool canBeInstantiatedOnlyOncePerProcess",
    ),
    3: flags(
        f"canGetAndSetFMUState canSerializeFMUState {_DERIVED[3]}",
        "needsExecutionTool canBeInstantiatedOnlyOncePerProcess providesPerElementDependencies "
        "providesEvaluateDiscreteStates",
    ),
}
_EXCHANGE = {2: flags("completedIntegratorStepNotNeeded", ""), 3: flags("", "needsCompletedIntegratorStep")}
_STEPS = {"canHandleVariableCommunicationStepSize": "true", "maxOutputDerivativeOrder": "0"}
_NO_STEPS = {
    2: "canInterpolateInputs canRunAsynchronuously",
    3: "providesIntermediateUpdate mightReturnEarlyFromDoStep canReturnEarlyAfterIntermediateUpdate hasEventMode",
}


def capabilities(model: FmuModel, fmi_version: int) -> dict[str, dict[str, str]]:
    """Capability flags of a native FMU, by interface."""
    common, missing = _COMMON[fmi_version], _NO_STEPS[fmi_version]
    if not model.step_derivatives:
        missing = f"{missing} {_DERIVED[fmi_version]}"
    steps = common | _STEPS | flags("", missing)
    return {"ModelExchange": common | _EXCHANGE[fmi_version], "CoSimulation": steps}


def native_description(
    header: Mapping[str, Any],
    fmi_version: int,
    token: str,
    generation_tool: str,
    sources: Sequence[str],
    model: FmuModel = FRICTION,
) -> bytes:
    """modelDescription.xml in UTF-8, the same bytes for the same arguments.

    header: of the map; fmi_version: 2 or 3; token: guid or instantiationToken
    sources: names of the C files in the sources folder; none: of an FMU for Python hosts
    """
    name, variables, interfaces = model.name, fmu_variables(header), {"CoSimulation": _PYTHON}
    if sources:
        name, variables = model.native_name, model.variables(header)
        interfaces = capabilities(model, fmi_version)
    of_map = f"law {header['law']}, map {map_hash(header)[:12]}"
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": f"{fmi_version}.0",
            "modelName": name,
            "guid" if fmi_version == 2 else "instantiationToken": token,
            "description": f"{model.summary}, thermal elastohydrodynamic lubrication; {law_name(header)} friction law, "
            + "; ".join(text for text in (of_map, lead_text(header), band_text(header)) if text),
            **about(),
            "generationTool": generation_tool,
            "variableNamingConvention": "flat",
        },
    )
    for interface, claimed in interfaces.items():
        node = SubElement(root, interface, {"modelIdentifier": name, **claimed})
        if fmi_version == 2 and sources:
            files = SubElement(node, "SourceFiles")
            for source in sources:
                SubElement(files, "File", name=source)
    listed = variables if fmi_version == 2 else (*variables, TIME)
    units = SubElement(root, "UnitDefinitions")
    for unit_name, unit in UNITS.items():
        if any(v.unit == unit_name for v in listed):
            node = SubElement(units, "Unit", name=unit_name)
            if unit.base or unit_name == "1":
                SubElement(node, "BaseUnit", {base: str(exponent) for base, exponent in unit.base.items()})
            for display, factor, offset in unit.displays:
                SubElement(node, "DisplayUnit", name=display, factor=repr(factor), offset=repr(offset))
    logged = SubElement(root, "LogCategories")
    for category, text in LOG_CATEGORIES.items():
        SubElement(logged, "Category", name=category, description=text)
    SubElement(root, "DefaultExperiment", startTime="0.0", stopTime="1.0", stepSize=repr(model.step))
    if fmi_version == 2:
        root.set("numberOfEventIndicators", str(sum(v.indicates for v in variables)))
    _variables(SubElement(root, "ModelVariables"), listed, fmi_version)
    _structure(SubElement(root, "ModelStructure"), variables, fmi_version)
    return _serialized(root)


def python_description(header: Mapping[str, Any], guid: str, generation_tool: str) -> bytes:
    """modelDescription.xml of the FMU for Python hosts."""
    return native_description(header, 2, guid, generation_tool, ())


def build_description(sources: Sequence[str], model: FmuModel = FRICTION) -> bytes:
    """sources/buildDescription.xml of FMI 3.0, used in FMI 2.0 too (from 2.0.4 on)."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=model.native_name)
    files = SubElement(configuration, "SourceFileSet", language="C99")
    for name in sources:
        SubElement(files, "SourceFile", name=name)
    return _serialized(root)


def terminals(model: FmuModel = FRICTION) -> bytes:
    """terminalsAndIcons/terminalsAndIcons.xml of FMI 3.0."""
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    picture = SubElement(root, "GraphicalRepresentation")
    corners = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
    SubElement(picture, "CoordinateSystem", corners, suggestedScalingFactorTo_mm="0.1")
    SubElement(picture, "Icon", corners)
    listed = SubElement(root, "Terminals")
    for name, kind, description, members in model.terminals:
        about = {"name": name, "matchingRule": "plug", "terminalKind": f"org.ballscrew-tehl.{kind}"}
        node = SubElement(listed, "Terminal", about, description=description)
        for member in members.split(","):
            parts = zip(("variableName", "memberName", "variableKind"), member.split(), strict=True)
            SubElement(node, "TerminalMemberVariable", dict(parts))
    return _serialized(root)


def _serialized(root: Element) -> bytes:
    """The XML in UTF-8, indented."""
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def _variables(parent: Element, variables: Sequence[Variable], fmi_version: int) -> None:
    reference = {v.name: str(n) for n, v in enumerate(variables, FIRST_REFERENCE)}
    states = {v.derivative_of for v in variables}
    for v in variables:
        about = {"name": v.name, "valueReference": reference[v.name], "description": v.description}
        about |= {"causality": v.causality, "variability": v.variability}
        # inputs: exact is what they are by default, and CasADi refuses it
        if v.causality == "parameter":
            about["initial"] = "exact"
        elif v.name in states and v.start is not None:
            about["initial"] = "approx"  # set by presliding_side, unless it is set
        elif v.causality not in ("input", "independent"):
            about["initial"] = "calculated"
        attributes = {"quantity": v.quantity, "unit": v.unit, "displayUnit": v.display_unit}
        attributes["relativeQuantity"] = "true" if v.relative else None
        numbers = (("min", v.minimum), ("max", v.maximum), ("nominal", v.nominal), ("start", v.start))
        attributes |= {name: None if value is None else repr(float(value)) for name, value in numbers}
        if v.unit is None:
            attributes = {"start": None if v.start is None else str(bool(v.start)).lower()}
        if v.derivative_of:
            attributes["derivative"] = reference[v.derivative_of]  # FMI 2.0: its index, the same number
        if v.name in states:
            attributes["reinit"] = "true"
        given = {name: value for name, value in attributes.items() if value is not None}
        if fmi_version == 2:
            scalar = SubElement(parent, "ScalarVariable", about)
            SubElement(scalar, "Boolean" if v.unit is None else "Real", given)
        else:
            SubElement(parent, "Boolean" if v.unit is None else "Float64", about | given)


def _structure(parent: Element, variables: Sequence[Variable], fmi_version: int) -> None:
    """Unknowns with their dependencies: in FMI 2.0 in groups, without event indicators."""
    place = {v.name: n for n, v in enumerate(variables, 1 if fmi_version == 2 else FIRST_REFERENCE)}
    states = {v.derivative_of for v in variables}
    initial = [v for v in variables if v.causality == "output" or v.derivative_of or v.name in states]
    kinds = [
        ("Outputs", "Output", [v for v in variables if v.causality == "output"]),
        ("Derivatives", "ContinuousStateDerivative", [v for v in variables if v.derivative_of]),
        ("InitialUnknowns", "InitialUnknown", initial),
        ("", "EventIndicator", [v for v in variables if v.indicates]),
    ]
    for group, kind, unknowns in kinds:
        if not unknowns or (fmi_version == 2 and not group):
            continue  # the schema forbids an empty group
        node = SubElement(parent, group) if fmi_version == 2 else parent
        for v in unknowns:
            names = set(v.initial_dependencies) - states if unknowns is initial else v.depends_on
            known = sorted(place[name] for name in names)
            about = {
                "index" if fmi_version == 2 else "valueReference": str(place[v.name]),
                "dependencies": " ".join(map(str, known)),
                "dependenciesKind": " ".join(["dependent"] * len(known)),
            }
            SubElement(node, "Unknown" if fmi_version == 2 else kind, about)
