"""modelDescription.xml from the table of variables: units, bounds, dependencies, capability flags."""

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ballscrew_fmu.models import FRICTION, FmuModel
from ballscrew_fmu.variables.friction import FIRST_REFERENCE, UNITS, Variable, band_text, law_name
from ballscrew_tehl.runtime.packed import map_hash

LOG_CATEGORIES = {
    "logStatusWarning": "An input is outside the map and is clamped",
    "logStatusDiscard": "A step is discarded, with the variable and the value that are the reason",
    "logStatusError": "A call that has no effect",
    "logStatusFatal": "Failures of the Python interpreter",
    "logAll": "All messages",
}
CAPABILITIES = {
    "needsExecutionTool": "false",  # requirements on the host: documentation/externalDependencies.txt
    "canHandleVariableCommunicationStepSize": "true",
    "canInterpolateInputs": "false",
    "maxOutputDerivativeOrder": "0",
    "canRunAsynchronuously": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "providesDirectionalDerivative": "false",
}


def model_description(
    header: Mapping[str, Any], guid: str, generation_tool: str, model: FmuModel = FRICTION
) -> bytes:
    """The XML in UTF-8. Same arguments give the same bytes (no date).

    Parameters   header : of the map (bounds, start values, screw and kinematics for the description)
    """
    variables = model.variables(header)
    root = Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=model.name,
        guid=guid,
        description=(
            f"{model.summary}, thermal elastohydrodynamic lubrication; "
            f"{law_name(header)} friction law, {header['kinematics']} kinematics, map {map_hash(header)[:12]}"
            f"{'; ' if band_text(header) else ''}{band_text(header)}"
        ),
        version=str(header["version"]),
        license="MIT",
        generationTool=generation_tool,
        variableNamingConvention="flat",
        numberOfEventIndicators="0",
    )
    SubElement(root, "CoSimulation", {"modelIdentifier": model.name, **CAPABILITIES})
    _unit_definitions(SubElement(root, "UnitDefinitions"), variables)
    categories = SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=text)
    SubElement(root, "DefaultExperiment", startTime="0.0", stopTime="1.0", stepSize="0.001")
    listed = SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables, FIRST_REFERENCE):
        _scalar_variable(listed, reference, variable)
    _model_structure(SubElement(root, "ModelStructure"), variables)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def _unit_definitions(parent: Element, variables: Sequence[Variable]) -> None:
    used = {v.unit for v in variables}
    for name, unit in UNITS.items():
        if name not in used:
            continue
        node = SubElement(parent, "Unit", name=name)
        SubElement(node, "BaseUnit", {base: str(exponent) for base, exponent in unit.base.items()})
        for display, factor, offset in unit.displays:
            SubElement(node, "DisplayUnit", name=display, factor=repr(factor), offset=repr(offset))


def _scalar_variable(parent: Element, reference: int, v: Variable) -> None:
    node = SubElement(
        parent,
        "ScalarVariable",
        name=v.name,
        valueReference=str(reference),
        description=v.description,
        causality=v.causality,
        variability=v.variability,
    )
    if v.causality != "input":  # FMI 2.0 forbids `initial` on inputs
        node.set("initial", "exact" if v.causality == "parameter" else "calculated")
    if v.unit is None:
        SubElement(node, "Boolean", {} if v.start is None else {"start": str(bool(v.start)).lower()})
        return
    numbers = (("min", v.minimum), ("max", v.maximum), ("nominal", v.nominal), ("start", v.start))
    attributes = {"quantity": v.quantity, "unit": v.unit, "displayUnit": v.display_unit}
    attributes |= {"relativeQuantity": "true" if v.relative else None}
    attributes |= {name: None if value is None else repr(float(value)) for name, value in numbers}
    SubElement(node, "Real", {name: value for name, value in attributes.items() if value is not None})


def _model_structure(parent: Element, variables: Sequence[Variable]) -> None:
    index = {v.name: str(place) for place, v in enumerate(variables, start=1)}
    outputs, unknowns = SubElement(parent, "Outputs"), SubElement(parent, "InitialUnknowns")
    for v in variables:
        if v.causality != "output":
            continue
        for node, names in ((outputs, v.depends_on), (unknowns, v.initial_dependencies)):
            known = sorted((index[name] for name in names), key=int)
            SubElement(
                node,
                "Unknown",
                index=index[v.name],
                dependencies=" ".join(known),
                dependenciesKind=" ".join(["dependent"] * len(known)),
            )
