"""Many FMUs in one process: copies, versions, a foreign FMU, deleted folders, a hundred instances.

The scenario runs in a process of its own, so that its modules cannot affect other tests.
"""

import json
import subprocess
import sys
import textwrap

import pytest
from synthetic_map import make_map

from ballscrew_fmu.python_fmu.package import build_fmu, runtime_sources

pytestmark = pytest.mark.slow

FOREIGN = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real

import runtime_evaluate as evaluate
import lubricant
import python_fmu_slave as slave


class Foreign(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.speed = 0.0
        self.friction_torque = 0.0
        self.register_variable(Real("speed", causality=Fmi2Causality.input))
        self.register_variable(Real("friction_torque", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        self.friction_torque = lubricant.VALUE + slave.VALUE + evaluate.VALUE
        return True
"""

SCENARIO = """
import gc, json, shutil, sys
from pathlib import Path
import fmpy
from ballscrew_fmu.checks.replay import FmuInstance

folder = Path(sys.argv[1])
def unpack(fmu, copy):
    return fmpy.extract(str(folder / f"{fmu}.fmu"), unzipdir=str(folder / copy))
def torque(instance, speed=30.0):
    assert instance.step(speed=speed), instance.messages
    return instance.get("friction_torque")
result = {}

first_folder, second_folder = unpack("one", "copy a"), unpack("one", "copy_b")
first, second = FmuInstance(first_folder), FmuInstance(second_folder)
foreign = FmuInstance(unpack("foreign", "foreign"))
version, other_map = FmuInstance(unpack("doubled", "doubled")), FmuInstance(unpack("map", "map"))
result["together"] = [torque(x) for x in (first, second, foreign, version, other_map)]
result["again"] = [torque(x) for x in (other_map, version, foreign, second, first)][::-1]

first.close()
shutil.rmtree(first_folder)
gc.collect()
result["second after the first is gone"] = torque(second)
result["state after the first is gone"] = len(second.slave.serializeFMUstate(second.slave.getFMUstate())) > 0
third = FmuInstance(second_folder)
result["third from the second folder"] = torque(third)
fourth = FmuInstance(unpack("one", "copy_c"))
result["fourth from a new folder"] = torque(fourth)

many = [FmuInstance(second_folder, preload=100.0 * (n + 1)) for n in range(100)]
result["hundred"] = [torque(x) for x in many]
for n, instance in enumerate(many):
    instance.close()
    if n % 25 == 0:
        gc.collect()
result["survivors"] = [torque(x) for x in (second, third, fourth, foreign, version, other_map)]
for x in (second, third, fourth, foreign, version, other_map):
    x.close()
for n in range(100):
    with FmuInstance(second_folder) as one:
        last = torque(one)
gc.collect()
result["one after the other"] = last
result["stale paths"] = [p for p in sys.path if "copy" in p]
print(json.dumps(result))
"""


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    folder = tmp_path_factory.mktemp("isolation")
    build_fmu(make_map(), folder / "one.fmu")
    build_fmu(make_map(viscous_scale=3.0), folder / "map.fmu")
    sources = runtime_sources()
    whole = "= viscous + hysteresis + sliding"
    changed = sources["runtime_outputs"].replace(whole, "= 2.0 * (viscous + hysteresis + sliding)")
    assert changed != sources["runtime_outputs"]
    build_fmu(make_map(), folder / "doubled.fmu", sources | {"runtime_outputs": changed})
    foreign = folder / "source"
    foreign.mkdir()
    (foreign / "foreign.py").write_text(textwrap.dedent(FOREIGN))
    for name, value in (("lubricant", 202.0), ("python_fmu_slave", 0.0), ("runtime_evaluate", 0.0)):
        (foreign / f"{name}.py").write_text(f"VALUE = {value}\n")
    helpers = [str(foreign / f"{name}.py") for name in ("lubricant", "python_fmu_slave", "runtime_evaluate")]
    command = [
        sys.executable,
        "-m",
        "pythonfmu",
        "build",
        "-f",
        str(foreign / "foreign.py"),
        "-d",
        str(folder),
    ]
    subprocess.run([*command, *helpers], check=True, capture_output=True, cwd=foreign)
    (folder / "Foreign.fmu").rename(folder / "foreign.fmu")
    run = subprocess.run([sys.executable, "-c", SCENARIO, str(folder)], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr[-2000:]
    return json.loads(run.stdout.splitlines()[-1])


def torque(preload=2000.0, scale=1.0):
    state = make_map(scale).evaluate(preload, 30.0, 303.15)
    return pytest.approx(state.friction_torque, rel=1e-12)


@pytest.fixture(scope="module")
def doubled():
    return 2.0 * torque().expected


def test_copies_versions_maps_and_a_foreign_fmu_side_by_side(scenario, doubled):
    for results in (scenario["together"], scenario["again"]):
        assert results == [torque(), torque(), 202.0, pytest.approx(doubled), torque(scale=3.0)]


def test_the_second_copy_works_after_the_first_is_freed_and_deleted(scenario):
    assert scenario["second after the first is gone"] == torque()
    assert scenario["state after the first is gone"] is True


def test_new_instances_after_the_first_copy_is_deleted(scenario):
    assert scenario["third from the second folder"] == torque()
    assert scenario["fourth from a new folder"] == torque()


def test_a_hundred_instances_at_a_time_and_one_after_the_other(scenario):
    assert scenario["hundred"] == [torque(100.0 * (n + 1)) for n in range(100)]
    assert scenario["one after the other"] == torque()


def test_the_others_are_not_disturbed(scenario, doubled):
    assert scenario["survivors"] == [
        torque(),
        torque(),
        torque(),
        202.0,
        pytest.approx(doubled),
        torque(scale=3.0),
    ]


def test_no_folder_remains_on_the_search_path(scenario):
    assert scenario["stale paths"] == []
