"""modelDescription.xml of all FMUs: checkers, the interface as a table, structure, dependencies seen in the values.

interface.csv is the contract with users: a variable that is added or changed is a row there.
"""

import csv
import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import synthetic_map
from fmu_checks import findings, members, unit_findings, variables_of
from native_library import CS, ME, OK
from synthetic_map import LAWS, closed_form

from ballscrew_fmu.description.model_description import (
    about,
    native_description,
    python_description,
    terminals,
)
from ballscrew_fmu.models import AXIS, FRICTION, MODELS
from ballscrew_fmu.variables.friction import ELEMENT_STATES
from ballscrew_tehl.runtime.packed import Law

pytestmark = pytest.mark.slow

CASES = [(m, k) for m in MODELS for k in ("python", 2, 3) if m is FRICTION or k != "python"]
EACH = pytest.mark.parametrize(("model", "kind"), CASES, ids=lambda x: getattr(x, "name", str(x)))
with open(Path(__file__).with_name("interface.csv"), encoding="utf-8") as file:
    INTERFACE = list(csv.DictReader(file))
AXIS_STATES = ("angle", "speed", "position", "velocity", "screw_displacement", "screw_velocity", *ELEMENT_STATES,
               "guide_element", "shaft_element")  # fmt: skip
STATES_OF = dict.fromkeys(("BallScrewFriction", "BallScrewTransmission"), ELEMENT_STATES)
STATES_OF["BallScrewAxis"] = AXIS_STATES
RATES = {f"{name}_rate": name for name in AXIS_STATES}


def described(model, kind, law=Law.THREE_PARAMETER):
    header = closed_form(law).header
    if kind == "python":
        return ElementTree.fromstring(python_description(header, "", ""))
    return ElementTree.fromstring(native_description(header, kind, "", "", ["a.c"], model))


def unknowns(root):
    """Unknowns of each group as names with the names that they depend on, in order, for both versions."""
    names = [name for name, *_ in variables_of(root)]
    found = {}
    structure = root.find("ModelStructure")
    groups = [(g.tag, n) for g in structure for n in (g if root.get("fmiVersion") == "2.0" else [g])]
    for tag, node in groups:
        tag = tag.removesuffix("s").replace("ContinuousState", "")
        places = [int(d) for d in node.get("dependencies").split()]
        assert places == sorted(set(places))
        assert node.get("dependenciesKind").split() == ["dependent"] * len(places)
        own = names[int(node.get("index") or node.get("valueReference")) - 1]
        assert own not in found.setdefault(tag, {})
        found[tag][own] = [names[place - 1] for place in places]
    return found


STATES = {"canGetAndSetFMUstate", "canSerializeFMUstate"}
STATES_3 = {"canGetAndSetFMUState", "canSerializeFMUState"}
UNEVEN, DERIVATIVES = "canHandleVariableCommunicationStepSize", "providesDirectionalDerivative"
FMI3 = {*STATES_3, "providesDirectionalDerivatives", "providesAdjointDerivatives"}
DERIVED = {DERIVATIVES, "providesDirectionalDerivatives", "providesAdjointDerivatives"}
TRUE = {  # flags by kind of FMU and interface; tests/fmu/native_fmu calls what they promise
    ("python", "CoSimulation"): {*STATES, UNEVEN, "canNotUseMemoryManagementFunctions"},
    (2, "CoSimulation"): {*STATES, UNEVEN, DERIVATIVES, "canNotUseMemoryManagementFunctions"},
    (2, "ModelExchange"): {
        *STATES,
        DERIVATIVES,
        "canNotUseMemoryManagementFunctions",
        "completedIntegratorStepNotNeeded",
    },
    (3, "CoSimulation"): {*FMI3, UNEVEN},
    (3, "ModelExchange"): FMI3,
}


@EACH
def test_no_check_finds_anything_and_flags_are_those_of_the_library(built, folder_of, model, kind):
    folder = folder_of(model, kind)
    root = ElementTree.parse(folder / "modelDescription.xml").getroot()
    assert unit_findings(root) == []
    interfaces = {node.tag: node.attrib for node in root if node.tag in ("CoSimulation", "ModelExchange")}
    assert {(kind, tag) for tag in interfaces} == {key for key in TRUE if key[0] == kind}
    for tag, flags in interfaces.items():
        none = DERIVED if model is AXIS and tag == "CoSimulation" else set()
        assert {name for name, value in flags.items() if value == "true"} == TRUE[kind, tag] - none
        assert flags.get("maxOutputDerivativeOrder", "0") == "0"
        assert flags["modelIdentifier"] == (model.name if kind == "python" else model.native_name)
    keys = ("version", "author", "copyright", "license", "generationDateAndTime")
    assert {key: root.get(key) for key in keys} == about()
    licence = (folder / "documentation" / "licenses" / "license.txt").read_text()
    assert "Permission is hereby granted" in licence
    assert about()["copyright"] in licence
    if kind == "python":
        assert "pythonfmu" in root.get("generationTool")
        return
    assert findings(members(built(model, kind))) == []


@EACH
def test_variables_are_those_of_the_interface(model, kind):
    host = "python" if kind == "python" else "native"
    expected = [row for row in INTERFACE if row["model"] == model.name and row["host"] in ("", host)]
    root = described(model, kind)
    nodes = {node.get("name"): node for node in root.find("ModelVariables")}
    assert list(nodes) == [row["name"] for row in expected] + (["time"] if kind == 3 else [])
    for row, (name, reference, numbers) in zip(expected, variables_of(root), strict=False):
        node = nodes[name]
        keys = ("unit", "displayUnit", "relativeQuantity", "min", "max", "nominal", "start")
        found = {"causality": node.get("causality"), "variability": node.get("variability")}
        found |= {key: numbers.get(key) for key in keys}
        wanted = {key: row[key] or None for key in found}
        for key in ("min", "max", "nominal", "start"):  # 0 and 0.0, 1e-7 and 1e-07
            found[key], wanted[key] = _number(found[key]), _number(wanted[key])
        assert (name, found) == (name, wanted)
        assert len(node.get("description")) > 15
        assert reference == list(nodes).index(name) + 1
        states = STATES_OF.get(model.name, ()) if kind != "python" else ()
        # elements follow from presliding_side unless they are set, states of the axis from parameters
        approx = name in states and model is not AXIS
        initial = {"parameter": "exact", "input": None}.get(
            row["causality"], "approx" if approx else "calculated"
        )
        assert node.get("initial") == initial, name  # FMI 2.0 forbids it on inputs, CasADi refuses it
        derivative = str(list(nodes).index(RATES[name]) + 1) if name in RATES else None
        assert numbers.get("derivative") == derivative
        assert numbers.get("reinit") == ("true" if name in states else None)


def _number(text):
    words = {None: None, "true": True, "false": False}
    return words[text] if text in words else float(text)


@EACH
def test_structure_is_complete_in_order_and_the_same_in_both_versions(model, kind):
    root = described(model, kind)
    found = unknowns(root)
    nodes = list(root.find("ModelVariables"))
    outputs = [n.get("name") for n in nodes if n.get("causality") == "output"]
    rates = [n.get("name") for n in nodes if n.get("name") in RATES]
    states = STATES_OF.get(model.name, ()) if kind != "python" else ()
    indicators = [n.get("name") for n in nodes if "_indicator" in n.get("name")]
    assert list(found["Output"]) == outputs
    assert list(found.get("Derivative", ())) == rates
    assert sorted(found["InitialUnknown"]) == sorted({*outputs, *rates, *states})
    if kind == 3:
        assert list(found["EventIndicator"]) == indicators
        other = unknowns(described(model, 2))
        assert other == {group: found[group] for group in other}
    elif kind == 2:
        assert root.get("numberOfEventIndicators") == str(len(indicators))


@pytest.mark.parametrize("model", MODELS, ids=lambda x: x.name)
def test_terminals_have_variables_of_the_fmu_with_flows_in_their_direction(model):
    """Members named as in Modelica; a flow is an inflow if positive values enter the FMU."""
    causality = {row["name"]: row["causality"] for row in INTERFACE if row["model"] == model.name}
    members = list(ElementTree.fromstring(terminals(model)).iter("TerminalMemberVariable"))
    assert len(members) >= 4
    for member in members:
        name, kind = member.get("variableName"), member.get("variableKind")
        flow = member.get("memberName") in ("f", "Q_flow") or name.endswith("_torque")
        outwards = name in ("nut_force", "power_loss")
        assert kind == ("outflow" if outwards else "inflow" if flow else "signal"), name
        assert causality[name] in ("input", "output")


def drawn(rng, name, row):
    """A value of a variable in and beyond its range, with all magnitudes."""
    if row["unit"] == "":
        return bool(rng.integers(2))
    if name in ("temperature", "presliding_side"):
        return rng.uniform(280.0, 356.0) if name == "temperature" else rng.uniform(-1.0, 1.0)
    start = float(row["start"] or 0.0)
    if row["causality"] == "parameter" and start > 0.0:
        return start * 10.0 ** rng.uniform(-0.5, 1.0)
    scale = {"axial_play": 1e-5, "torque": 10.0, "position": 4e-6, "velocity": 1e-4,
             "presliding_stiffness": 300.0, "preload": 12600.0, "axial_load": 12600.0, "speed": 336.0}  # fmt: skip
    largest = 0.1 if name in ELEMENT_STATES else scale.get(name) or 1.05 * float(row["nominal"])
    sign = rng.choice([-1.0, 1.0]) if row["causality"] == "input" and name != "preload" else 1.0
    return sign * largest * 10.0 ** -rng.choice([0.0, 0.3, 1.0, 3.0]) * (rng.random() > 0.1)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(
    ("model", "kind"), [case for case in CASES if case[1] != 2], ids=lambda x: getattr(x, "name", str(x))
)
def test_what_a_change_of_a_value_changes_is_declared(opened, model, kind, law):
    """In initialization mode; states of the axis start from inputs, and the heat at 0."""
    structure = unknowns(described(model, kind, law))
    indicators, initially = structure.get("EventIndicator", {}), structure["InitialUnknown"]
    running = structure["Output"] | structure.get("Derivative", {}) | indicators
    hosts = ("", "python" if kind == "python" else "native")
    rows = {r["name"]: r for r in INTERFACE if r["model"] == model.name and r["host"] in hosts}
    settable = [n for n, r in rows.items() if r["causality"] in ("input", "parameter") or n in ELEMENT_STATES]
    inputs = {n for n in settable if rows[n]["causality"] == "input" or n in ELEMENT_STATES}
    names = [*initially, *indicators]
    seen, rng = {name: set() for name in names}, np.random.default_rng(3)
    one = opened(kind, CS if kind == "python" else ME, model, law)
    one.initialize()
    fresh = one.save()

    def values(start):
        one.restore(fresh)
        assert one.set(**{name: value for name, value in start.items() if not isinstance(value, bool)}) == OK
        for name, value in start.items():
            assert not isinstance(value, bool) or one.set_boolean(name, value) == OK
        return dict(zip(names, one.get(*names), strict=True))

    for _ in range(60 if law == Law.THREE_PARAMETER else 15):
        base = {name: drawn(rng, name, rows[name]) for name in settable}
        if "position" in base:  # contacts deflect by micrometres
            ratio = synthetic_map.SCREW["lead"] / (2.0 * math.pi)
            base["position"] += ratio * base["angle"]
            base["velocity"] += ratio * base["speed"]
        if rng.random() < 0.3:  # else presliding_side has no effect
            base |= dict.fromkeys(base.keys() & set(ELEMENT_STATES), 0.0)
        before = values(base)
        for changed in settable:
            value = not base[changed] if rows[changed]["unit"] == "" else drawn(rng, changed, rows[changed])
            after = values(base | {changed: value})
            for name in names:
                if not math.isclose(after[name], before[name], rel_tol=1e-12):
                    seen[name].add(changed)
    for name in names:
        declared = set((initially if name in initially else indicators)[name])
        known = seen[name] - set(ELEMENT_STATES)  # at the start they are unknowns themselves
        if name in RATES or name.startswith("slip_indicator"):  # the others count in initialization mode only
            seen[name] = known
        assert (known if name in initially else seen[name] & inputs) <= declared, name
        if name not in ("heat", *ELEMENT_STATES) and model is not AXIS:
            assert seen[name] & inputs <= set(running[name]), name
