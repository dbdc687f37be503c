"""modelDescription.xml: validation by fmpy, and properties that no checker tests."""

import io
import math
import uuid
import zipfile
from xml.etree import ElementTree

import fmpy
import pytest
import stub_solver
from fmpy.validation import validate_fmu
from synthetic_map import LAWS, make_map

from ballscrew_fmu.archive import NAMESPACE
from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.description.fmi2 import CAPABILITIES
from ballscrew_fmu.models import FRICTION
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_fmu.python_fmu.solver_cache import digest
from ballscrew_tehl.runtime.packed import FILM_SHEAR, MECHANISTIC

INPUTS = {
    "preload": ("N", None),
    "speed": ("rad/s", "rev/min"),
    "temperature": ("K", "degC"),
    "axial_load": ("N", None),
}
OUTPUTS = {
    "friction_torque": "N.m", "viscous_torque": "N.m", "hysteresis_torque": "N.m", "sliding_torque": "N.m",
    "power_loss": "W", "film_thickness_min": "m", "film_thickness_central_screw": "m",
    "film_thickness_central_nut": "m", "film_temperature_rise": "K", "contact_pressure_max": "Pa",
    "ball_load_max": "N", "lambda_ratio": "1", "in_range": None,
    "range_margin": "1", "heat": "J", "friction_torque_nut_a": "N.m", "friction_torque_nut_b": "N.m",
}  # fmt: skip
PARAMETERS = {
    "apparent_viscosity_ratio": "1", "net_sliding_coefficient": "1", "roughness_height": "m",
    "breakaway_factor": "1",
    "regularization_speed": "rad/s", "presliding": None, "presliding_stiffness": "N.m/rad",
    "presliding_damping": "N.m.s/rad", "presliding_side": "1", "refine": None, "refine_tolerance": "1",
}  # fmt: skip
BOOLEANS = ("in_range", "presliding", "refine")
DIMENSIONS = {  # exponents of kg, m, s, K, rad written down independently of the table
    "N": (1, 1, -2, 0, 0), "rad/s": (0, 0, -1, 0, 1), "K": (0, 0, 0, 1, 0), "N.m": (1, 2, -2, 0, 0),
    "W": (1, 2, -3, 0, 0), "J": (1, 2, -2, 0, 0), "m": (0, 1, 0, 0, 0), "Pa": (1, -1, -2, 0, 0), "1": (0, 0, 0, 0, 0),
    "N.m/rad": (1, 2, -2, 0, -1), "N.m.s/rad": (1, 2, -1, 0, -1),
}  # fmt: skip


@pytest.fixture(scope="module")
def files(fmu):
    with zipfile.ZipFile(fmu) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.fixture(scope="module")
def refinable_by_law(tmp_path_factory, refinable):
    """Unpacked FMUs of both laws that refine with the stub."""
    folder = tmp_path_factory.mktemp("mechanistic")
    path = folder / "BallScrewFriction.fmu"
    fmu = build_fmu(make_map(law=MECHANISTIC), path, solver=stub_solver.SOURCES).path
    return {FILM_SHEAR: refinable, MECHANISTIC: fmpy.extract(str(fmu), unzipdir=str(folder / "unpacked"))}


@pytest.fixture(scope="module")
def root(files):
    return ElementTree.parse(io.BytesIO(files["modelDescription.xml"])).getroot()


@pytest.fixture(scope="module")
def scalars(root):
    return {node.get("name"): node for node in root.find("ModelVariables")}


def test_fmpy_finds_nothing(fmu):
    assert validate_fmu(str(fmu)) == []


def test_variables_are_those_of_the_interface(scalars):
    assert list(scalars) == [*INPUTS, *OUTPUTS, *PARAMETERS]
    for name, node in scalars.items():
        causality = "input" if name in INPUTS else "output" if name in OUTPUTS else "parameter"
        variability = "discrete" if name == "in_range" else "tunable" if name in PARAMETERS else "continuous"
        variability = "fixed" if name == "presliding_side" else variability
        initial = {"input": None, "output": "calculated", "parameter": "exact"}[causality]
        assert (node.get("causality"), node.get("variability"), node.get("initial")) == (
            causality,
            variability,
            initial,
        )
        assert len(node.get("description")) > 15
        assert node[0].tag == ("Boolean" if name in BOOLEANS else "Real")
        unit = {**{n: u for n, (u, _) in INPUTS.items()}, **OUTPUTS, **PARAMETERS}[name]
        assert node[0].get("unit") == unit
    assert [node.get("valueReference") for node in scalars.values()] == [
        str(n + 1) for n in range(len(scalars))
    ]


def test_start_values_bounds_and_display_units(scalars):
    start = {name: float(scalars[name][0].get("start")) for name in INPUTS}
    assert start == {"preload": 2000.0, "speed": 0.0, "temperature": 303.15, "axial_load": 0.0}
    for name, (_, display) in INPUTS.items():
        assert scalars[name][0].get("displayUnit") == display
    for name, node in scalars.items():
        real = node[0]
        assert (real.get("start") is not None) == (name not in OUTPUTS)
        if name in BOOLEANS:
            assert real.get("start") == {"in_range": None, "presliding": "true", "refine": "false"}[name]
            continue
        assert float(real.get("nominal")) > 0.0
        if real.get("start") is not None:
            low, high = float(real.get("min", -math.inf)), float(real.get("max", math.inf))
            assert low <= float(real.get("start")) <= high
    assert scalars["film_temperature_rise"][0].get("relativeQuantity") == "true"
    assert scalars["film_temperature_rise"][0].get("displayUnit") is None


def test_start_values_are_exact(scalars, synthetic_nut_map):
    for name, value in synthetic_nut_map.header["defaults"].items():
        assert float(scalars[name][0].get("start")) == value


def test_units_have_the_right_dimensions_and_display_factors(root):
    units = {node.get("name"): node for node in root.find("UnitDefinitions")}
    assert set(units) == set(DIMENSIONS)
    for name, node in units.items():
        base = node.find("BaseUnit")
        assert tuple(int(base.get(b, "0")) for b in ("kg", "m", "s", "K", "rad")) == DIMENSIONS[name]
        assert set(base.keys()) <= {"kg", "m", "s", "K", "rad"}
    displays = {d.get("name"): d for node in units.values() for d in node.findall("DisplayUnit")}

    def shown(unit, value):
        return float(displays[unit].get("factor")) * value + float(displays[unit].get("offset"))

    assert shown("rev/min", 100.0 * math.pi / 30.0) == pytest.approx(100.0, rel=1e-15)
    assert displays["rev/min"].get("factor") == "9.549296585513721"
    assert shown("degC", 303.15) == pytest.approx(30.0)
    assert shown("um", 2.5e-7) == pytest.approx(0.25)
    assert shown("nm", 2.4e-8) == pytest.approx(24.0)
    assert shown("GPa", 1.5e9) == pytest.approx(1.5)


def test_structure_lists_each_output_once_in_order(root, scalars):
    expected = [
        str(place) for place, node in enumerate(scalars.values(), 1) if node.get("causality") == "output"
    ]
    for kind in ("Outputs", "InitialUnknowns"):
        unknowns = root.findall(f"ModelStructure/{kind}/Unknown")
        assert [node.get("index") for node in unknowns] == expected
        for node in unknowns:
            dependencies = [int(d) for d in node.get("dependencies").split()]
            assert dependencies == sorted(set(dependencies))
            assert node.get("dependenciesKind").split() == ["dependent"] * len(dependencies)
    assert root.find("ModelStructure/Derivatives") is None


BASE = {"preload": 1500.0, "speed": 0.13, "temperature": 300.0, "axial_load": 900.0}
OTHER = {
    "preload": 90000.0, "speed": -400.0, "temperature": 500.0, "axial_load": 14000.0,
    "apparent_viscosity_ratio": 2.0, "net_sliding_coefficient": 0.1, "roughness_height": 1e-7,
    "breakaway_factor": 3.0, "regularization_speed": 3.0, "presliding_stiffness": 50.0, "presliding_damping": 9.0,
    "presliding": False, "presliding_side": -0.5, "refine": True, "refine_tolerance": 0.05,
}  # fmt: skip


@pytest.mark.parametrize("kind", ["Outputs", "InitialUnknowns"])
@pytest.mark.parametrize("law", LAWS)
def test_dependencies_are_those_that_a_change_of_the_value_shows(law, refinable_by_law, kind):
    refinable = refinable_by_law[law]
    root = ElementTree.parse(f"{refinable}/modelDescription.xml").getroot()
    names = [node.get("name") for node in root.find("ModelVariables")]
    declared = {
        names[int(node.get("index")) - 1]: {names[int(d) - 1] for d in node.get("dependencies").split()}
        for node in root.findall(f"ModelStructure/{kind}/Unknown")
    }
    changes = OTHER if kind == "InitialUnknowns" else {name: OTHER[name] for name in INPUTS}
    seen = {name: set() for name in declared}

    def outputs(**start):
        with FmuInstance(refinable, **(BASE | start)) as one:
            found = one.outputs()
            if kind == "Outputs":  # of a step
                one.step(1e-5)
                found["heat"] = one.get("heat")
            return found

    for changed, value in changes.items():
        switch = {"refine_tolerance": {"refine": True}, "regularization_speed": {"presliding": False}}
        switch = switch.get(changed, {})
        base = outputs(**switch)
        for name, output in outputs(**switch, **{changed: value}).items():
            if not math.isclose(output, base[name], rel_tol=1e-12):
                seen[name].add(changed)
    if law == MECHANISTIC:  # with a deflected bristle, whose Coulomb torque depends on it
        seen["hysteresis_torque"].add("temperature")
    assert seen == declared


def test_the_law_is_named(refinable_by_law):
    texts = {}
    for law, folder in refinable_by_law.items():
        root = ElementTree.parse(f"{folder}/modelDescription.xml").getroot()
        assert f"{law.replace('_', ' ')} friction law" in root.get("description")
        texts[law] = {node.get("name"): node.get("description") for node in root.find("ModelVariables")}
        with open(f"{folder}/documentation/index.html", encoding="utf-8") as file:
            assert f"Friction law: {law.replace('_', ' ')}, that is" in file.read()
    differ = {name for name in texts[MECHANISTIC] if texts[MECHANISTIC][name] != texts[FILM_SHEAR][name]}
    ours = {"apparent_viscosity_ratio", "net_sliding_coefficient", "roughness_height"}
    assert differ == {"viscous_torque", "sliding_torque", *ours}


def test_guid_depends_on_the_content(root, files):
    guid = root.get("guid")
    blank = files["modelDescription.xml"].replace(guid.encode(), b"")
    others = {name: content for name, content in files.items() if name != "resources/guid.txt"}
    assert str(uuid.uuid5(NAMESPACE, digest({**others, "modelDescription.xml": blank}))) == guid
    assert files["resources/guid.txt"] == guid.encode()


def test_the_file_contains_no_date_and_names_its_generator(root):
    assert root.get("generationDateAndTime") is None
    assert "pythonfmu" in root.get("generationTool")
    assert root.get("fmiVersion") == "2.0"


def test_capability_flags(root, files, fmu):
    node = root.find("CoSimulation")
    assert node.get("modelIdentifier") == FRICTION.name
    assert f"binaries/linux64/{FRICTION.name}.so" in files
    assert f"binaries/win64/{FRICTION.name}.dll" in files
    flags = {name: node.get(name) for name in CAPABILITIES}
    assert flags["needsExecutionTool"] == "false"
    # true flags are tested elsewhere (state, variable steps, many instances); functions of false flags must
    # not work
    assert flags["canGetAndSetFMUstate"] == flags["canSerializeFMUstate"] == "true"
    assert flags["canHandleVariableCommunicationStepSize"] == "true"
    assert flags["canBeInstantiatedOnlyOncePerProcess"] == "false"
    with FmuInstance(fmu) as one:
        for claimed, call in (
            ("providesDirectionalDerivative", lambda: one.slave.getDirectionalDerivative([4], [1], [1.0])),
            ("canInterpolateInputs", lambda: one.slave.setRealInputDerivatives([1], [1], [0.0])),
        ):
            assert flags[claimed] == "false"
            with pytest.raises(fmpy.fmi1.FMICallException):
                call()
    assert flags["maxOutputDerivativeOrder"] == "0"


def test_documentation(files):
    page = files["documentation/index.html"].decode()
    assert "{" not in page.partition("</head>")[2]
    for name in (*INPUTS, *OUTPUTS, *PARAMETERS):
        assert f"<td>{name}</td>" in page
    assert "numpy" in files["documentation/externalDependencies.txt"].decode()
    assert "Permission is hereby granted" in files["documentation/licenses/pythonfmu.txt"].decode()
