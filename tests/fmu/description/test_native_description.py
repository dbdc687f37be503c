"""modelDescription.xml of the native FMUs: checkers, errors they miss, behaviour of the libraries."""

import io
import math
import re
import zipfile
from xml.etree import ElementTree

import fmpy
import pytest
from fmpy.validation import validate_fmu
from fmu_checks import capability_findings, findings, variables_of
from native_host import native_folder
from synthetic_map import LAWS, make_map

from ballscrew_fmu.archive import write_fmu
from ballscrew_fmu.checks.replay_fmi3 import Fmu3Instance
from ballscrew_fmu.description.native import CAPABILITIES
from ballscrew_fmu.variables.friction import fmu_variables, native_variables
from ballscrew_tehl.runtime.packed import FILM_SHEAR, MECHANISTIC

VERSIONS = pytest.mark.parametrize("version", [2, 3])
LOCALS = ["presliding_deflection", "presliding_deflection_rate", "in_range_indicator", "slip_indicator"]


@pytest.fixture(scope="module")
def members(native_fmus):
    found = {}
    for version, path in native_fmus.items():
        with zipfile.ZipFile(path) as archive:
            found[version] = {name: archive.read(name) for name in archive.namelist()}
    return found


@pytest.fixture(scope="module")
def folder_by_law(native_unpacked, tmp_path_factory):
    """Unpacked FMUs of FMI 3.0."""
    mechanistic = native_folder(tmp_path_factory.mktemp("mechanistic") / "fmu", make_map(law=MECHANISTIC), 3)
    return {FILM_SHEAR: native_unpacked[3], MECHANISTIC: str(mechanistic)}


@pytest.fixture(scope="module")
def roots(members):
    return {
        v: ElementTree.parse(io.BytesIO(files["modelDescription.xml"])).getroot()
        for v, files in members.items()
    }


@pytest.mark.slow
@VERSIONS
def test_no_checker_finds_anything(native_fmus, native_unpacked, members, version):
    assert validate_fmu(str(native_fmus[version])) == []
    assert findings(members[version]) == []
    assert capability_findings(native_unpacked[version]) == []


@VERSIONS
def test_variables_are_those_of_the_python_fmu_then_the_bristle(roots, synthetic_nut_map, version):
    names = [name for name, *_ in variables_of(roots[version])]
    shared = [v.name for v in fmu_variables(synthetic_nut_map.header) if not v.python_only]
    assert names == [*shared, *LOCALS, *(["time"] if version == 3 else [])]


def test_variables_of_the_python_fmu_only_are_left_out(synthetic_nut_map):
    table = fmu_variables(synthetic_nut_map.header)
    refined = {"refine", "refine_tolerance"}
    assert {v.name for v in table if v.python_only} == refined
    native = native_variables(synthetic_nut_map.header)
    assert [v.name for v in native] == [*(v.name for v in table if not v.python_only), *LOCALS]
    assert refined <= set(table[4].initially_depends_on)
    assert not refined & {name for v in native for name in v.initially_depends_on}
    assert "presliding_damping" in native[4].initially_depends_on


@VERSIONS
def test_both_versions_describe_a_variable_alike(roots, version):
    """Causality, variability, initial and numbers, written down for the bristle and compared for the rest."""
    root = roots[version]
    nodes = {n.get("name"): n for n in root.find("ModelVariables")}
    kinds = {n: tuple(nodes[n].get(k) for k in ("causality", "variability", "initial")) for n in LOCALS}
    assert kinds == {
        "presliding_deflection": ("local", "continuous", "exact"),
        "presliding_deflection_rate": ("local", "continuous", "calculated"),
        "in_range_indicator": ("local", "continuous", "calculated"),
        "slip_indicator": ("local", "continuous", "calculated"),
    }
    numbers = {name: node for name, _, node in variables_of(root)}
    state, rate = numbers["presliding_deflection"], numbers["presliding_deflection_rate"]
    assert (state.get("unit"), state.get("start"), state.get("reinit")) == ("rad", "0.0", "true")
    assert float(state.get("nominal")) == 1e-3
    place = list(numbers).index("presliding_deflection")
    assert rate.get("derivative") == str(place + 1)  # index in FMI 2, value reference in FMI 3
    assert (nodes["preload"].get("initial") is None) == (version == 2)  # FMI 2.0 forbids it on inputs
    other = {name: node for name, _, node in variables_of(roots[5 - version])}
    for name in other.keys() & numbers.keys():
        for key in ("unit", "displayUnit", "min", "max", "nominal", "start", "quantity", "relativeQuantity"):
            assert numbers[name].get(key) == other[name].get(key), (name, key)


def unknowns(root, kind):
    """Names of the unknowns of a group with the names they depend on, in order."""
    names = [name for name, *_ in variables_of(root)]
    if root.get("fmiVersion") == "2.0":
        groups = {
            "Output": "Outputs",
            "ContinuousStateDerivative": "Derivatives",
            "InitialUnknown": "InitialUnknowns",
        }
        nodes, key, first = root.findall(f"ModelStructure/{groups[kind]}/Unknown"), "index", 1
    else:
        nodes, key, first = root.findall(f"ModelStructure/{kind}"), "valueReference", 1
    found = {}
    for node in nodes:
        places = [int(d) - first for d in node.get("dependencies").split()]
        assert places == sorted(set(places))
        assert node.get("dependenciesKind").split() == ["dependent"] * len(places)
        found[names[int(node.get(key)) - first]] = [names[place] for place in places]
    assert len(found) == len(nodes)
    return found


@VERSIONS
def test_structure_is_complete_and_in_order(roots, version):
    root = roots[version]
    outputs = [n.get("name") for n in root.find("ModelVariables") if n.get("causality") == "output"]
    assert list(unknowns(root, "Output")) == outputs
    assert list(unknowns(root, "ContinuousStateDerivative")) == ["presliding_deflection_rate"]
    assert list(unknowns(root, "InitialUnknown")) == [*outputs, "presliding_deflection_rate"]
    if version == 3:
        assert list(unknowns(root, "EventIndicator")) == LOCALS[2:]
    for kind in ("Output", "ContinuousStateDerivative", "InitialUnknown"):
        assert unknowns(root, kind) == unknowns(roots[5 - version], kind)


BASE = {"preload": 1500.0, "speed": 0.13, "temperature": 300.0, "axial_load": 900.0}
WOUND = {**BASE, "presliding_stiffness": 400.0, "presliding_deflection": 3e-4}
REGULARISED = {**BASE, "presliding": False}
YIELDING = {FILM_SHEAR: 9e-4, MECHANISTIC: 2e-3}  # [rad] between 0.7 and 1 of the sliding deflection
CHANGED = {
    "preload": 90000.0, "speed": -400.0, "temperature": 500.0, "axial_load": 14000.0,
    "apparent_viscosity_ratio": 2.0, "net_sliding_coefficient": 0.004, "roughness_height": 1e-7,
    "breakaway_factor": 3.0, "regularization_speed": 3.0, "presliding_stiffness": 350.0, "presliding_damping": 9.0,
    "presliding_deflection": 2e-4, "presliding": False, "presliding_side": -0.9,
}  # fmt: skip


def initial_values(folder, names, **start):
    """Values of an FMI 3.0 model-exchange instance in initialization mode."""
    description = fmpy.read_model_description(folder)
    reference = {v.name: v.valueReference for v in description.modelVariables}
    fmu = fmpy.fmi3.FMU3Model(
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier="BallScrewFrictionNative",
        instanceName="one",
    )
    fmu.instantiate(logMessage=lambda *_: None)
    try:
        fmu.enterInitializationMode()
        presliding = start.pop("presliding", True)
        fmu.setBoolean([reference["presliding"]], [presliding])
        fmu.setFloat64([reference[name] for name in start], list(start.values()))
        numbers = [name for name in names if name != "in_range"]
        values = dict(zip(numbers, fmu.getFloat64([reference[n] for n in numbers]), strict=True))
        if "in_range" in names:
            values["in_range"] = fmu.getBoolean([reference["in_range"]])[0]
        return values
    finally:
        fmu.freeInstance()


def heat_follows(folder, deflection):
    """Names of what the heat of a step of co-simulation depends on."""
    found = set()
    base = WOUND | {"presliding_deflection": deflection}
    for changed, value in CHANGED.items():
        results = []
        for start in (base, base | {changed: value}):
            with Fmu3Instance(folder, **start) as one:
                one.step(1e-5)
                results.append(one.get("heat"))
        if results[0] != results[1]:
            found.add(changed)
    return found


@pytest.mark.parametrize("law", LAWS)
def test_dependencies_are_those_that_a_change_of_the_value_shows(folder_by_law, law):
    folder = folder_by_law[law]
    root = ElementTree.parse(f"{folder}/modelDescription.xml").getroot()
    initially = unknowns(root, "InitialUnknown")
    running = unknowns(root, "Output") | unknowns(root, "ContinuousStateDerivative")
    indicators = unknowns(root, "EventIndicator")
    names = [name for name in (*initially, *indicators) if name != "in_range"]
    seen = {name: set() for name in names}
    for base in (REGULARISED, BASE, WOUND, WOUND | {"presliding_deflection": YIELDING[law]}):
        before = initial_values(folder, names, **base)
        for changed, value in CHANGED.items():
            after = initial_values(folder, names, **(base | {changed: value}))
            for name in names:
                if not math.isclose(after[name], before[name], rel_tol=1e-12):
                    seen[name].add(changed)
    assert {n: seen[n] for n in names if n in initially} == {
        n: set(initially[n]) for n in names if n in initially
    }
    changing = {"preload", "speed", "temperature", "axial_load", "presliding_deflection"}
    seen["heat"] = heat_follows(folder, YIELDING[law])
    for name in names:
        assert seen[name] & changing == set((running | indicators)[name]), name


def test_in_range_depends_on_each_input_while_initializing(native_unpacked):
    for changed in ("preload", "speed", "temperature", "axial_load"):
        start = REGULARISED | {changed: CHANGED[changed]}
        assert initial_values(native_unpacked[3], ["in_range"], **start) == {"in_range": False}


MUTATIONS = {
    "another guid": (r'(guid|instantiationToken)="[^"]+"', r'\1="00000000-0000-0000-0000-000000000000"'),
    "start below min": (r'(min="0.0" max="12000.0" nominal="1000.0" start=)"2000.0"', r'\1"-1.0"'),
    "start above max": (r'(min="283.15" max="353.15" nominal="300.0" start=)"303.15"', r'\1"500.0"'),
    "min above max": (r'min="283.15" max="353.15"', 'min="353.15" max="283.15"'),
    "start of the binary": (r'start="7.6"', 'start="7.7"'),
    "same value reference twice": (r'valueReference="9"', 'valueReference="8"'),
    "wrong exponent": (r'<BaseUnit kg="1" m="2" s="-3"', '<BaseUnit kg="1" m="2" s="-2"'),
    "ampere in a torque": (r'<BaseUnit kg="1" m="2" s="-2" />', '<BaseUnit kg="1" m="2" s="-2" A="1" />'),
    "factor of rev/min": (r'factor="9.549296585513721"', 'factor="9.55"'),
    "offset of degC": (r'offset="-273.15"', 'offset="273.15"'),
    "nominal of the state": (r'nominal="0.001"', 'nominal="1.0"'),
    "no reason to log": (r'<Category name="logStatusDiscard"', '<Category name="logEvents"'),
    "other identifier": (r'modelIdentifier="BallScrewFrictionNative"', 'modelIdentifier="BallScrewFriction"'),
}  # fmt: skip


def mutated(files, pattern, replacement):
    before = files["modelDescription.xml"].decode()
    after, count = re.subn(pattern, replacement, before, count=1)
    assert count == 1
    return files | {"modelDescription.xml": after.encode()}


@VERSIONS
@pytest.mark.parametrize("name", MUTATIONS)
def test_what_the_checkers_miss_is_found(members, version, name):
    if name == "other identifier":  # both interfaces
        text = members[version]["modelDescription.xml"].replace(b"FrictionNative", b"Friction")
        files = members[version] | {"modelDescription.xml": text}
    else:
        files = mutated(members[version], *MUTATIONS[name])
    assert findings(files) != []


def test_fmpy_misses_them(members, tmp_path):
    """The reason for our own checks. Delete this test when a newer fmpy finds these errors."""
    for name in ("another guid", "start below min", "same value reference twice", "wrong exponent"):
        write_fmu(tmp_path / "mutated.fmu", mutated(members[2], *MUTATIONS[name]))
        assert validate_fmu(str(tmp_path / "mutated.fmu")) == []


def test_number_of_event_indicators(members):
    files = mutated(members[2], r'numberOfEventIndicators="2"', 'numberOfEventIndicators="1"')
    assert any("event indicators" in finding for finding in findings(files))
    files = mutated(members[3], r"<EventIndicator [^>]+/>", "")
    assert any("event indicators" in finding for finding in findings(files))


FLAGS = [(v, i, flag) for v, parts in CAPABILITIES.items() for i, flags in parts.items() for flag in flags]


@pytest.mark.parametrize(("version", "interface", "flag"), [x for x in FLAGS if x[2] != "modelIdentifier"])
def test_a_false_capability_flag_is_found(native_unpacked, tmp_path, version, interface, flag):
    for name in ("binaries", "resources", "sources"):
        (tmp_path / name).symlink_to(f"{native_unpacked[version]}/{name}")
    with open(f"{native_unpacked[version]}/modelDescription.xml", encoding="utf-8") as file:
        text = file.read()
    wrong = {"true": "false", "false": "true", "0": "1"}
    head, tag, tail = text.partition(f"<{interface} ")
    tail, count = re.subn(rf'\b{flag}="(\w+)"', lambda m: f'{flag}="{wrong[m.group(1)]}"', tail, count=1)
    assert count == 1
    (tmp_path / "modelDescription.xml").write_text(head + tag + tail)
    assert [line for line in capability_findings(tmp_path) if f"{interface}: {flag} " in line]


@VERSIONS
def test_the_file_contains_no_date_and_names_its_generator(roots, version):
    assert roots[version].get("generationDateAndTime") is None
    assert "ziglang" in roots[version].get("generationTool")
    assert roots[version].get("fmiVersion") == f"{version}.0"
