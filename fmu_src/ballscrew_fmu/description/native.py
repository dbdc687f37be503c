"""modelDescription.xml, buildDescription.xml and terminalsAndIcons.xml of the native FMUs, FMI 2.0 and 3.0."""

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ballscrew_fmu.description.fmi2 import LOG_CATEGORIES as PYTHON_CATEGORIES
from ballscrew_fmu.description.fmi2 import _scalar_variable, _unit_definitions
from ballscrew_fmu.models import FRICTION, FmuModel
from ballscrew_fmu.variables.friction import FIRST_REFERENCE, TIME, Variable, band_text, law_name
from ballscrew_tehl.runtime.packed import map_hash

LOG_CATEGORIES = {
    "logStatusWarning": PYTHON_CATEGORIES["logStatusWarning"],
    "logStatusDiscard": "An invalid value, which is not stored",
    "logStatusError": "A call that is illegal in the current state or has invalid arguments, with the reason",
    "logStatusFatal": "Failures that end the simulation (not used)",
    "logAll": PYTHON_CATEGORIES["logAll"],
}
_ALWAYS = {"modelIdentifier": FRICTION.native_name, "needsExecutionTool": "false"}
_ONCE = {"canBeInstantiatedOnlyOncePerProcess": "false"}
_FMI2 = {
    **_ALWAYS,
    **_ONCE,
    "canNotUseMemoryManagementFunctions": "false",  # instances are in memory of the importer
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "providesDirectionalDerivative": "true",
}
_FMI3 = {
    **_ALWAYS,
    **_ONCE,
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
    "providesDirectionalDerivatives": "true",
    "providesAdjointDerivatives": "true",
    "providesPerElementDependencies": "false",
}
CAPABILITIES: Mapping[int, Mapping[str, Mapping[str, str]]] = {  # by FMI version and interface
    2: {
        "ModelExchange": {**_FMI2, "completedIntegratorStepNotNeeded": "true"},
        "CoSimulation": {
            **_FMI2,
            "canHandleVariableCommunicationStepSize": "true",
            "canInterpolateInputs": "false",
            "maxOutputDerivativeOrder": "0",
            "canRunAsynchronuously": "false",
        },
    },
    3: {
        "ModelExchange": {
            **_FMI3,
            "needsCompletedIntegratorStep": "false",
            "providesEvaluateDiscreteStates": "false",
        },
        "CoSimulation": {
            **_FMI3,
            "canHandleVariableCommunicationStepSize": "true",
            "maxOutputDerivativeOrder": "0",
            "providesIntermediateUpdate": "true",
            "mightReturnEarlyFromDoStep": "true",
            "canReturnEarlyAfterIntermediateUpdate": "true",
            "hasEventMode": "true",
            "providesEvaluateDiscreteStates": "false",
        },
    },
}
_PARTS = (
    "providesIntermediateUpdate",
    "mightReturnEarlyFromDoStep",
    "canReturnEarlyAfterIntermediateUpdate",
    "hasEventMode",
)
TERMINALS = """\
<?xml version="1.0" encoding="UTF-8"?>
<fmiTerminalsAndIcons fmiVersion="3.0">
  <GraphicalRepresentation>
    <CoordinateSystem x1="-100" y1="-100" x2="100" y2="100" suggestedScalingFactorTo_mm="0.1" />
    <Icon x1="-100" y1="-100" x2="100" y2="100" />
  </GraphicalRepresentation>
{terminals}</fmiTerminalsAndIcons>
"""
TERMINAL = """\
    <Terminal name="{name}" matchingRule="plug" terminalKind="org.ballscrew-tehl.{kind}" description="{description}">
{members}
    </Terminal>
"""
MEMBER = '      <TerminalMemberVariable variableName="{0}" memberName="{1}" variableKind="{2}" />'


def capabilities(model: FmuModel, fmi_version: int) -> dict[str, dict[str, str]]:
    """CAPABILITIES of a model, by interface."""
    own = {"modelIdentifier": model.native_name}
    if not model.parts:
        own |= dict.fromkeys(_PARTS, "false")
    return {
        interface: {flag: own.get(flag, value) for flag, value in flags.items()}
        for interface, flags in CAPABILITIES[fmi_version].items()
    }


def native_description(
    header: Mapping[str, Any],
    fmi_version: int,
    token: str,
    generation_tool: str,
    sources: Sequence[str],
    model: FmuModel = FRICTION,
) -> bytes:
    """modelDescription.xml in UTF-8. Same arguments give the same bytes (no date).

    Parameters   header : of the map;  fmi_version : 2 or 3;  token : guid or instantiationToken
                 sources : names of the C files in the sources folder
    """
    variables = model.native_variables(header)
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": f"{fmi_version}.0",
            "modelName": model.native_name,
            "guid" if fmi_version == 2 else "instantiationToken": token,
            "description": (
                f"{model.summary}, thermal elastohydrodynamic lubrication; {law_name(header)} friction law, "
                f"{header['kinematics']} kinematics, map {map_hash(header)[:12]}"
                f"{'; ' if band_text(header) else ''}{band_text(header)}"
            ),
            "version": str(header["version"]),
            "license": "MIT",
            "generationTool": generation_tool,
            "variableNamingConvention": "flat",
        },
    )
    for interface, flags in capabilities(model, fmi_version).items():
        node = SubElement(root, interface, flags)
        if fmi_version == 2:
            files = SubElement(node, "SourceFiles")
            for name in sources:
                SubElement(files, "File", name=name)
    listed = variables if fmi_version == 2 else (*variables, TIME)
    _unit_definitions(SubElement(root, "UnitDefinitions"), listed)
    categories = SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=text)
    SubElement(root, "DefaultExperiment", startTime="0.0", stopTime="1.0", stepSize="0.001")
    if fmi_version == 2:
        root.set("numberOfEventIndicators", str(sum(v.indicates for v in variables)))
        _fmi2_variables(SubElement(root, "ModelVariables"), variables)
        _fmi2_structure(SubElement(root, "ModelStructure"), variables)
    else:
        _fmi3_variables(SubElement(root, "ModelVariables"), listed, model.parts)
        _fmi3_structure(SubElement(root, "ModelStructure"), variables)
    return _serialized(root)


def build_description(sources: Sequence[str], model: FmuModel = FRICTION) -> bytes:
    """sources/buildDescription.xml of FMI 3.0, used in FMI 2.0 too (from 2.0.4 on)."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=model.native_name)
    files = SubElement(configuration, "SourceFileSet", language="C99")
    for name in sources:
        SubElement(files, "SourceFile", name=name)
    return _serialized(root)


def terminals(model: FmuModel = FRICTION) -> bytes:
    """terminalsAndIcons/terminalsAndIcons.xml of FMI 3.0, used in FMI 2.0 too (from 2.0.4 on)."""
    shown = "".join(
        TERMINAL.format(
            name=terminal.name,
            kind=terminal.kind,
            description=terminal.description,
            members="\n".join(MEMBER.format(*member) for member in terminal.members),
        )
        for terminal in model.terminals
    )
    return TERMINALS.format(terminals=f"  <Terminals>\n{shown}  </Terminals>\n" if shown else "").encode()


def _serialized(root: Element) -> bytes:
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def _states(variables: Sequence[Variable]) -> set[str]:
    """Names of the continuous states."""
    return {v.derivative_of for v in variables if v.derivative_of}


def _fmi2_variables(parent: Element, variables: Sequence[Variable]) -> None:
    place = {v.name: n for n, v in enumerate(variables, start=1)}
    for reference, v in enumerate(variables, FIRST_REFERENCE):
        _scalar_variable(parent, reference, v)
        node = parent[-1]
        if v.name in _states(variables):
            node.set("initial", "exact")
            node[0].set("reinit", "true")  # at the start of slip
        if v.derivative_of:
            node[0].set("derivative", str(place[v.derivative_of]))


def _fmi3_variables(parent: Element, variables: Sequence[Variable], parts: bool) -> None:
    reference = {v.name: str(n) for n, v in enumerate(variables, FIRST_REFERENCE)}
    for v in variables:
        node = SubElement(
            parent,
            "Boolean" if v.unit is None else "Float64",
            name=v.name,
            valueReference=reference[v.name],
            description=v.description,
            causality=v.causality,
            variability=v.variability,
        )
        if v.causality in ("parameter", "input") or v.name in _states(variables):
            node.set("initial", "exact")
        elif v.causality != "independent":
            node.set("initial", "calculated")
        if parts and v.causality in ("input", "output"):
            node.set("intermediateUpdate", "true")
        if v.unit is None:
            if v.start is not None:
                node.set("start", str(bool(v.start)).lower())
            continue
        numbers = (("min", v.minimum), ("max", v.maximum), ("nominal", v.nominal), ("start", v.start))
        attributes = {"quantity": v.quantity, "unit": v.unit, "displayUnit": v.display_unit}
        attributes |= {"relativeQuantity": "true" if v.relative else None}
        attributes |= {name: None if value is None else repr(float(value)) for name, value in numbers}
        if v.derivative_of:
            attributes["derivative"] = reference[v.derivative_of]
        if v.name in _states(variables):
            attributes["reinit"] = "true"
        for name, value in attributes.items():
            if value is not None:
                node.set(name, value)


def _unknowns(variables: Sequence[Variable]) -> dict[str, list[tuple[Variable, tuple[str, ...]]]]:
    """Unknowns of the model structure with their dependencies, by kind."""
    groups = {
        "Output": [v for v in variables if v.causality == "output"],
        "Derivative": [v for v in variables if v.derivative_of],
        "Indicator": [v for v in variables if v.indicates],
    }
    unknowns = {kind: [(v, v.depends_on) for v in group] for kind, group in groups.items()}
    initial = [v for v in variables if v in groups["Output"] or v in groups["Derivative"]]
    unknowns["Initial"] = [(v, v.initial_dependencies) for v in initial]
    return unknowns


def _unknown(
    parent: Element, tag: str, key: str, place: Mapping[str, int], v: Variable, names: Sequence[str]
) -> None:
    known = sorted(place[name] for name in names)
    SubElement(
        parent,
        tag,
        {
            key: str(place[v.name]),
            "dependencies": " ".join(str(n) for n in known),
            "dependenciesKind": " ".join(["dependent"] * len(known)),
        },
    )


def _fmi2_structure(parent: Element, variables: Sequence[Variable]) -> None:
    place = {v.name: n for n, v in enumerate(variables, start=1)}
    unknowns = _unknowns(variables)
    for group, kind in (("Outputs", "Output"), ("Derivatives", "Derivative"), ("InitialUnknowns", "Initial")):
        if not unknowns[kind]:
            continue  # the schema forbids an empty group
        node = SubElement(parent, group)
        for v, names in unknowns[kind]:
            _unknown(node, "Unknown", "index", place, v, names)


def _fmi3_structure(parent: Element, variables: Sequence[Variable]) -> None:
    place = {v.name: n for n, v in enumerate(variables, FIRST_REFERENCE)}
    unknowns = _unknowns(variables)
    for tag, kind in (
        ("Output", "Output"),
        ("ContinuousStateDerivative", "Derivative"),
        ("InitialUnknown", "Initial"),
        ("EventIndicator", "Indicator"),
    ):
        for v, names in unknowns[kind]:
            _unknown(parent, tag, "valueReference", place, v, names)
