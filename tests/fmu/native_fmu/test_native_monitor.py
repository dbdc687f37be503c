"""The native preload monitor: model against Python, model exchange, descriptions, bytes, C hosts under sanitizers."""

import math
import re
import subprocess
import tomllib
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from fmu_checks import capability_findings, findings, variables_of
from native_host import c_host, sanitized_c_host
from native_library import compiled
from native_model import NativeModel, compiled_model, compiler
from native_reference import VALIDATION
from paths import ROOT
from synthetic_map import LAWS, make_map

from ballscrew_fmu.checks.reference import monitor_outputs
from ballscrew_fmu.models import FRICTION, MONITOR
from ballscrew_fmu.native_fmu.experiments import Reference
from ballscrew_fmu.native_fmu.package import build_native_fmu, native_file_name
from ballscrew_fmu.native_fmu.sources import native_sources
from ballscrew_tehl.runtime.packed import FrictionParameters
from ballscrew_tehl.runtime.preload import estimate_preload

pytestmark = pytest.mark.slow

VERSIONS = pytest.mark.parametrize("version", [2, 3])
PLATFORMS = ("x86_64-linux", "aarch64-linux")
INPUTS = [{"torque": 0.2 * n, "speed": 10.0 * n, "temperature": 303.15, "axial_load": 0.0} for n in range(5)]
STEPS = 400_000
CALLS = 400_000
ON = "-DMONITOR"


@pytest.fixture(scope="module")
def library(tmp_path_factory, synthetic_nut_map):
    return compiled_model(tmp_path_factory.mktemp("monitor_model"), synthetic_nut_map, MONITOR)


@pytest.fixture
def model(library, synthetic_nut_map):
    return NativeModel(library, synthetic_nut_map, model=MONITOR)


def build(nut_map, version, path):
    reference = Reference(1e-3, INPUTS, monitor_outputs(nut_map, INPUTS))
    return build_native_fmu(nut_map, version, path, reference, VALIDATION, PLATFORMS, model=MONITOR)


@pytest.fixture(scope="module")
def fmus(tmp_path_factory, synthetic_nut_map):
    folder = tmp_path_factory.mktemp("native_monitor")
    return {v: build(synthetic_nut_map, v, folder / native_file_name(v, MONITOR)) for v in (2, 3)}


def members(path):
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


# --- packing ---


@VERSIONS
def test_no_checker_finds_anything(fmus, tmp_path, version):
    path = fmus[version].path
    assert path.name == f"BallScrewPreloadMonitorNative_fmi{version}.fmu"
    assert validate_fmu(str(path)) == []
    assert findings(members(path)) == []
    assert capability_findings(fmpy.extract(str(path), unzipdir=str(tmp_path / "fmu"))) == []


def test_the_bytes_are_the_same_again(fmus, synthetic_nut_map, tmp_path):
    version = 2
    again = build(synthetic_nut_map, version, tmp_path / "again.fmu")
    assert again.path.read_bytes() == fmus[version].path.read_bytes()


@VERSIONS
def test_all_but_the_model_layer_is_shared_with_friction(synthetic_nut_map, version):
    monitor, friction = (
        native_sources(synthetic_nut_map.header, version, "t", m) for m in (MONITOR, FRICTION)
    )
    own = {"model.c", "variables.c", "variables.h", "constants.h"}  # names in constants.h
    assert {name for name in set(monitor) & set(friction) if monitor[name] != friction[name]} == own
    assert set(monitor) - set(friction) == {"search.c", "search.h", "monitor_state.h"}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert "native/*/*/*" in project["tool"]["setuptools"]["package-data"]["ballscrew_fmu"]


def test_description(fmus, synthetic_nut_map):
    for version in (2, 3):
        files = members(fmus[version].path)
        root = ElementTree.fromstring(files["modelDescription.xml"])
        names = [name for name, *_ in variables_of(root) if name != "time"]
        assert names == [v.name for v in MONITOR.native_variables(synthetic_nut_map.header)]
        assert root.get("modelName") == "BallScrewPreloadMonitorNative"
        derivatives = [
            v for k, v in root.find("CoSimulation").attrib.items() if "Derivative" in k and "provides" in k
        ]
        assert set(derivatives) == {"true"}
        page = files["documentation/index.html"].decode()
        assert "speed_min" in page
        assert "<p>Table</p>" in page
        assert "{" not in page.partition("</head>")[2]


OUTPUTS = ("preload", "preload_half_width", "torque_sensitivity", "lambda_ratio")
ALONG = {  # inputs and parameters with the width of their difference quotients
    "torque": 1e-4, "speed": 1e-3, "temperature": 1e-2, "axial_load": 0.1, "apparent_viscosity_ratio": 1e-4,
    "net_sliding_coefficient": 1e-7, "roughness_height": 1e-12, "breakaway_factor": 1e-4,
    "regularization_speed": 1e-3, "speed_min": 1e-4, "torque_uncertainty": 1e-5, "initial_preload": 0.1,
}  # fmt: skip


@pytest.mark.parametrize(
    "point",
    [
        {"torque": 0.9, "speed": 20.0, "temperature": 310.0, "axial_load": 300.0},
        {"torque": -0.7, "speed": -60.0, "temperature": 305.0, "axial_load": -800.0},
        {"torque": 0.6, "speed": 1.5, "temperature": 310.0, "axial_load": 0.0},
        {
            "torque": 0.6,
            "speed": 0.2,
            "temperature": 310.0,
            "axial_load": 300.0,
        },  # at rest: the initial preload
    ],
)
def test_derivatives_are_those_of_the_outputs(model, point):
    """Against difference quotients of two widths; their difference is the error that is allowed."""
    base = point | {"apparent_viscosity_ratio": 1.3, "breakaway_factor": 2.0, "roughness_height": 3e-8}

    def outputs(**change):
        model.latch(**base, **{name: value for name, value in start.items() if name not in base})
        model.latch(**change)
        return np.array([model.get(name) for name in OUTPUTS])

    model.reset()
    start = {name: model.get(name) for name in ALONG}
    values = base | {name: value for name, value in start.items() if name not in base}
    largest = np.abs(outputs())
    compared = 0
    for name, width in ALONG.items():
        if name == "axial_load" and point["axial_load"] == 0.0:
            continue  # a kink
        outputs()
        found = np.array(model.derivative(OUTPUTS, **{name: 1.0}))
        wide, narrow = (
            (outputs(**{name: values[name] + w}) - outputs(**{name: values[name] - w})) / (2.0 * w)
            for w in (2.0 * width, width)
        )
        allowed = 3.0 * np.abs(wide - narrow) + 1e-5 * np.abs(narrow) + 1e-9 * largest / width
        assert np.max(np.abs(found - narrow) / np.maximum(allowed, 1e-300)) <= 1.0, (name, found, narrow)
        compared += int(np.count_nonzero(narrow))
    assert compared >= (8 if point["speed"] < 1.0 else 20)
    together = np.array(model.derivative(OUTPUTS, torque=0.1, temperature=2.0))
    apart = 0.1 * np.array(model.derivative(OUTPUTS, torque=1.0)) + 2.0 * np.array(
        model.derivative(OUTPUTS, temperature=1.0)
    )
    assert together == pytest.approx(apart, rel=1e-5)


CHANGED = {
    "torque": 1.0, "speed": 30.0, "temperature": 310.0, "axial_load": 900.0, "apparent_viscosity_ratio": 5.0,
    "net_sliding_coefficient": 0.004, "roughness_height": 5e-8, "breakaway_factor": 3.0,
    "regularization_speed": 30.0, "speed_min": 50.0,
    "torque_uncertainty": 0.1, "initial_preload": 1000.0,
}  # fmt: skip
BEYOND = {"torque": 500.0, "speed": 500.0, "temperature": 500.0, "axial_load": 2e5}
BASES = (
    {"torque": 0.8, "speed": 20.0, "axial_load": 300.0},
    {"torque": 0.8, "speed": 0.0, "axial_load": 300.0},
    {"torque": 0.8, "speed": 20.0, "axial_load": 300.0, "speed_min": 20.1},
    {"torque": 0.8, "speed": 0.2, "axial_load": 300.0, "speed_min": 0.1},  # below the slowest node: breakaway
)


def initial_values(folder, names, **start):
    """Values of an FMI 3.0 model-exchange instance in initialization mode; fmpy gives the description."""
    description = fmpy.read_model_description(folder)
    reference = {v.name: v.valueReference for v in description.modelVariables}
    fmu = fmpy.fmi3.FMU3Model(
        guid=description.guid, unzipDirectory=folder, modelIdentifier=MONITOR.native_name, instanceName="one"
    )
    fmu.instantiate(logMessage=lambda *_: None)
    try:
        fmu.enterInitializationMode()
        fmu.setFloat64([reference[name] for name in start], list(start.values()))
        numbers = [name for name in names if name != "in_range"]
        values = dict(zip(numbers, fmu.getFloat64([reference[n] for n in numbers]), strict=True))
        values["in_range"] = fmu.getBoolean([reference["in_range"]])[0]
        return values
    finally:
        fmu.freeInstance()


def test_dependencies_are_those_that_a_change_of_the_value_shows(fmus, synthetic_nut_map, tmp_path):
    folder = fmpy.extract(str(fmus[3].path), unzipdir=str(tmp_path / "fmu"))
    table = {v.name: v for v in MONITOR.native_variables(synthetic_nut_map.header)}
    names = [v.name for v in table.values() if v.causality in ("output", "local")]
    seen = {name: set() for name in names}
    for base in BASES:
        before = initial_values(folder, names, **base)
        for changed, value in (*CHANGED.items(), *BEYOND.items()):
            after = initial_values(folder, names, **(base | {changed: value}))
            for name in names:
                if after[name] != before[name]:
                    seen[name].add(changed)
    for name in names:
        assert seen[name] <= {*table[name].depends_on, *table[name].initially_depends_on}, name
        if name != "in_range":
            assert seen[name] == {*table[name].depends_on, *table[name].initially_depends_on}, name


# --- model ---


@pytest.mark.parametrize("law", LAWS)
def test_model_is_that_of_python(tmp_path, law):
    """Slow, fast, separated, outside; every friction parameter off its default; to 1e-9 where in range."""
    nut_map = make_map(law=law)
    model = NativeModel(compiled_model(tmp_path, nut_map, MONITOR), nut_map, model=MONITOR)
    rng = np.random.default_rng(4)
    estimated = 0
    for n in range(4000):
        parameters = {
            "apparent_viscosity_ratio": 7.6 if n % 2 else 20.0,
            "net_sliding_coefficient": 0.0051 if n % 3 else 0.0,
            "roughness_height": 24e-9 if n % 5 else 150e-9,
            "breakaway_factor": 1.0 if n % 13 else 2.5,
        }
        regularization_speed = 0.1 if n % 7 else 2.0
        torque = float(rng.choice([-1.0, 1.0])) * 10.0 ** rng.uniform(-3.0, 1.0)
        speed = math.copysign(10.0 ** rng.uniform(-2.0, 2.6), torque if n % 11 else -torque)
        temperature, axial = rng.uniform(280.0, 356.0), rng.normal() * 3000.0 * (n % 4 > 0)
        inputs = {"torque": torque, "speed": speed, "temperature": temperature, "axial_load": axial}
        others = {"speed_min": 0.0, "regularization_speed": regularization_speed}
        model.step(1e-3, **others, **inputs, **parameters)
        friction = FrictionParameters(**parameters)
        found = estimate_preload(nut_map, torque, speed, temperature, axial, friction, regularization_speed)
        assert model.get("preload") == pytest.approx(found.preload, rel=1e-9)
        assert model.get("in_range") == found.in_range
        if found.in_range:
            estimated += 1
            assert model.get("torque_sensitivity") == pytest.approx(found.torque_sensitivity, rel=1e-9)
    assert estimated > 500


# --- model exchange ---


def test_rest_and_range_change_at_events_only(model, synthetic_nut_map):
    model.reset(True)
    model.latch(torque=0.8, speed=30.0, speed_min=2.0)
    model.initial_event()
    estimated = model.get("preload")
    assert model.get("in_range") == 1.0
    model.latch(torque=0.5)
    lower = model.get("preload")
    assert lower < estimated  # continuous while it moves
    model.latch(speed=1.9)
    assert model.get("motion_indicator") < 0.0
    assert model.get("in_range") == 1.0
    before_event = model.get("preload")
    assert not model.event()
    assert model.get("in_range") == 0.0
    assert model.get("motion_indicator") < 0.0
    assert model.get("preload") == before_event  # the last estimate is held
    for torque in (0.0, 3.0, -2.0):
        model.latch(torque=torque, speed=0.0)
        assert model.get("preload") == before_event
    model.latch(torque=0.8, speed=30.0)
    assert model.get("motion_indicator") > 0.0
    assert model.get("preload") == before_event
    for _ in range(3):
        model.event()
    assert model.get("preload") == estimated
    assert model.get("in_range") == 1.0


@pytest.mark.parametrize(
    ("outside", "good"),
    [
        ({"torque": 80.0}, {"torque": 0.8}),
        ({"torque": 1e-3}, {"torque": 0.8}),
        ({"torque": -0.1}, {"torque": 0.8}),
        ({"speed": 330.0}, {"speed": 30.0}),
        ({"temperature": 360.0}, {"temperature": 303.15}),
        ({"axial_load": 5000.0}, {"axial_load": 0.0}),  # separates a nut at this torque
        ({"axial_load": 11900.0, "torque": 4.0}, {"axial_load": 0.0, "torque": 0.8}),
    ],
)
def test_in_range_follows_its_indicator_without_event_storm(model, outside, good):
    model.reset(True)
    model.latch(torque=0.8, speed=30.0)
    model.initial_event()
    assert model.get("in_range_indicator") > 0.0
    model.latch(**outside)
    assert model.get("in_range_indicator") < 0.0
    assert model.get("in_range") == 1.0
    model.event()
    assert model.get("in_range") == 0.0
    assert model.get("in_range_indicator") < 0.0  # no event is repeated at once
    model.event()
    assert model.get("in_range") == 0.0
    model.latch(**good)
    assert model.get("in_range_indicator") > 0.0
    model.event()
    assert model.get("in_range") == 1.0


@VERSIONS
def test_model_exchange_in_fmpy_holds_at_rest(fmus, version):
    time = np.linspace(0.0, 1.0, 201)
    signal = np.zeros(len(time), dtype=[("time", float), ("speed", float), ("torque", float)])
    signal["time"], signal["speed"] = time, 30.0 * np.cos(2.0 * math.pi * time)
    signal["torque"] = 0.7 * np.sign(signal["speed"])
    result = fmpy.simulate_fmu(
        str(fmus[version].path), fmi_type="ModelExchange", input=signal, stop_time=1.0, output_interval=0.01,
        start_values={"speed_min": 10.0, "torque": 0.7, "speed": 30.0}, output=["preload", "in_range"],
    )  # fmt: skip
    speed = np.abs(30.0 * np.cos(2.0 * math.pi * result["time"]))
    slow, fast = speed < 9.5, speed > 10.5
    assert not result["in_range"][slow].any()
    assert result["in_range"][fast].all()
    assert np.ptp(result["preload"][slow]) < 1e-3 * result["preload"][slow][0]
    assert np.ptp(result["preload"][fast]) > 0.1 * result["preload"][slow][0]


# --- C hosts ---


def run(program, *arguments, **options):
    done = subprocess.run(
        [str(program), str(Path(program).parent), *map(str, arguments)], capture_output=True, text=True, timeout=600,
        **options,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Sanitizer" not in done.stderr, done.stderr
    return done.stdout


def sanitized(folder, nut_map, name, *options):
    try:
        return sanitized_c_host(folder, nut_map, name, ON, *options, model=MONITOR)
    except FileNotFoundError as error:
        pytest.skip(str(error))


def test_millions_of_steps_allocate_nothing_and_change_no_result(tmp_path, synthetic_nut_map):
    wrapped = ("-Wl,--wrap=malloc", "-Wl,--wrap=calloc", "-Wl,--wrap=realloc")
    soak = c_host(tmp_path, synthetic_nut_map, "soak", "-O2", ON, *wrapped, model=MONITOR)
    report = run(soak, STEPS)
    assert report.count("random steps: 0 allocations, heap +0 bytes") == 2
    assert report.count("equal to the bit") == 2


def test_threads_under_sanitizer(tmp_path, synthetic_nut_map):
    program = sanitized(tmp_path, synthetic_nut_map, "threads", "-fsanitize=thread")
    assert ": 0 differ" in run(program, 10, 500)


def test_random_calls_give_no_sanitizer_report(tmp_path, synthetic_nut_map):
    program = sanitized(tmp_path, synthetic_nut_map, "walk", "-fsanitize=address,undefined")
    *never, summary = run(program, CALLS, env={"ASAN_OPTIONS": "detect_leaks=1"}).splitlines()
    assert not any(line.endswith(("DirectionalDerivative", "AdjointDerivative")) for line in never)
    assert len(never) == 14
    # a model without continuous states: most calls of the walk must still succeed
    assert int(re.match(r"\d+ calls, (\d+) succeeded", summary)[1]) > CALLS // 2


@pytest.mark.skipif(len(compiler()) > 1, reason="sanitizers need a compiler of the system")
@VERSIONS
def test_a_host_with_damaged_states_under_sanitizers(version):
    program = compiled(version, sanitize=True, model=MONITOR)
    assert 500 < int(run(program).split()[0]) < 100000
