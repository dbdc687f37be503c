"""refine in the FMU for Python hosts: corrections, state, errors that leave the map in use, cache, the real solver."""

import json
import math

import fmpy
import pytest
import stub_solver
from processes import output

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_fmu.python_fmu.slave_base import CHECKSUM
from ballscrew_fmu.python_fmu.solver_cache import installed, solver_name
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters.file import load_screw

pytestmark = pytest.mark.slow

OK, WARNING, ERROR = 0, 1, 3
FILM = "film_thickness_min"


def of_status(instance, status):
    return [text for found, text in instance.messages if found == status]


def refinement_of(instance):
    return json.loads(instance.slave.serializeFMUstate(instance.slave.getFMUstate())[CHECKSUM:])["refinement"]


def run(instance, speeds):
    return [(instance.step(speed=speed), instance.outputs()) for speed in speeds]


def of_process(script, cache, *arguments):
    folders = dict.fromkeys(("XDG_CACHE_HOME", "LOCALAPPDATA", "HOME"), str(cache))
    return json.loads(output("-c", script, *arguments, **folders).splitlines()[-1])


def test_refine_corrects_the_map_and_can_be_switched_between_steps(unpacked):
    with FmuInstance(unpacked) as one, FmuInstance(unpacked, speed=30.0, refine=True) as from_start:
        one.step(speed=30.0)
        plain = one.outputs()
        for on, factor in ((True, stub_solver.factor(1)), (False, 1.0), (True, stub_solver.factor(1))):
            assert one.step(speed=30.0, refine=on)
            assert one.get("refine") is on
            assert one.get(FILM) == pytest.approx(factor * plain[FILM], rel=1e-12)
        assert from_start.get(FILM) == one.get(FILM)
        one.step(refine_tolerance=0.05)
        assert one.get(FILM) == pytest.approx(stub_solver.factor(1, 0.05) * plain[FILM], rel=1e-12)
        assert one.get("contact_pressure_max") == plain["contact_pressure_max"]
        assert one.messages == [(OK, "refine: contact at 30.0 rad/s solved")]
        for speed in (0.0, 0.01, -0.02):  # with presliding
            assert one.step(speed=speed)
            assert all(map(math.isfinite, one.outputs().values()))


def test_the_state_includes_the_solved_contacts_and_reset_discards_them(unpacked):
    later = (30.0, 40.0, 10.0, 50.0)
    with FmuInstance(unpacked, refine=True) as one, FmuInstance(unpacked, refine=True) as other:
        run(one, (10.0, 20.0, 30.0))
        state = one.slave.getFMUstate()
        content = one.slave.serializeFMUstate(state)
        first = run(one, later)
        one.slave.setFMUstate(state)
        assert run(one, later) == first
        other.slave.setFMUstate(other.slave.deSerializeFMUstate(content))
        assert other.slave.serializeFMUstate(other.slave.getFMUstate()) == content  # before it is used
        other.time = one.time
        assert run(other, later) == first
        one.slave.reset()
        one.initialize(refine=True)
        with FmuInstance(unpacked, refine=True) as fresh:
            assert run(one, (5.0, 6.0)) == run(fresh, (5.0, 6.0))


def test_an_unsolved_contact_is_reported_once_and_an_error_leaves_the_map_in_use(unpacked):
    with FmuInstance(unpacked, refine=True) as one, FmuInstance(unpacked) as plain:
        run(one, (20.0,))
        for _ in range(2):
            assert one.step(preload=stub_solver.UNSOLVED)
        assert of_status(one, WARNING) == ["refine: no convergence (logged once)"]
        kept = refinement_of(one)
        for _ in range(2):
            assert one.step(preload=stub_solver.BROKEN)
            assert plain.step(preload=stub_solver.BROKEN, speed=20.0)
        (message,) = of_status(one, ERROR)
        assert message == "refine: RuntimeError: broken; results are those of the map"
        assert one.get(FILM) == plain.get(FILM)
        assert refinement_of(one) == kept


REFINED_RUN = """
import json, sys
missing, folder = sys.argv[2], sys.argv[1]
if missing:
    sys.modules[missing] = None
from ballscrew_fmu.checks.replay import FmuInstance

with FmuInstance(folder, preload=1500.0) as one:
    one.step(speed=40.0)
    plain = one.get("friction_torque")
    assert missing or {"numba", "scipy", "pydantic"}.isdisjoint(sys.modules)
    assert one.step(speed=40.0, refine=True)
    print(json.dumps([plain, one.get("friction_torque"), one.messages]))
"""
IMPORT_ALL = """
import importlib, json, sys
from pathlib import Path
from ballscrew_fmu.python_fmu.slave_base import CHECKSUM
from ballscrew_fmu.python_fmu.solver_cache import installed, solver_name
from ballscrew_fmu.python_fmu.solver_cache import load_solver
from ballscrew_tehl.runtime.evaluate import NutMap

package = next(Path(sys.argv[1]).glob("resources/_ballscrew_*"))
solver, remark = load_solver(package)
root = Path(solver.__file__).parents[1]
for file in root.rglob("*.py"):
    name = ".".join([root.name, *file.relative_to(root).with_suffix("").parts])
    importlib.import_module(name.removesuffix(".__init__"))
nut_map = NutMap.from_npz(package.parent / "nut_map.npz")
refinement = solver.Refinement(nut_map, report=print)
refinement.restore(refinement.state())
own = [name for name in sys.modules if name.startswith("ballscrew_tehl") and ".runtime" not in name]
print(json.dumps([remark, str(root), refinement.state() is not None, sorted(own)]))
"""


def test_a_solver_in_the_cache_that_is_cut_short_or_changed_is_replaced(tmp_path):
    files = {"__init__.py": b"", "refinement/refine.py": b"WHOLE = True\n"}
    shipped = tmp_path / "fmu" / solver_name(files)
    for name, content in files.items():
        (shipped / name).parent.mkdir(parents=True, exist_ok=True)
        (shipped / name).write_bytes(content)
    for damage in (b"", b"WHOLE = False\n"):
        kept = installed(shipped, tmp_path / "cache")
        (kept / "refinement/refine.py").write_bytes(damage)
        assert installed(shipped, tmp_path / "cache") == kept
        assert {name: (kept / name).read_bytes() for name in files} == files


def test_the_packaged_solver_is_complete_and_its_packages_are_named_when_missing(tmp_path):
    fmu = build_fmu(load_map(None, load_screw()), tmp_path / "BallScrewFriction.fmu").path
    folder = fmpy.extract(str(fmu), unzipdir=str(tmp_path / "unpacked"))
    plain, refined, ((status, message),) = of_process(REFINED_RUN, tmp_path, folder, "scipy")
    assert (refined, status) == (plain, ERROR)
    assert message.startswith("refine: scipy is missing in the Python of the host")
    assert "python -m pip install scipy; results are those of the map" in message
    remark, root, has_state, own = of_process(IMPORT_ALL, tmp_path, folder)
    assert (remark, has_state) == ("", True)
    assert root.startswith(str(tmp_path / "ballscrew_tehl"))
    assert set(own) <= {"ballscrew_tehl", "ballscrew_tehl._version"}  # nothing of the installed solver
