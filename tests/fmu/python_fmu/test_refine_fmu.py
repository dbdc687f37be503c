"""refine in the FMU: imports, packaged solver, cache, state, and errors that leave the map in use."""

import json
import math
import os
import subprocess
import sys

import fmpy
import pytest
import stub_solver

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.python_fmu import package, solver_cache
from ballscrew_fmu.python_fmu.package import PackageError, build_fmu, solver_sources
from ballscrew_fmu.python_fmu.solver_cache import SolverError, installed, load_solver, solver_name, user_cache
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters

WARNING, DISCARD, ERROR = 1, 2, 3
FILM = "film_thickness_min"


def of_status(instance, status):
    return [text for found, text in instance.messages if found == status]


WITH_AND_WITHOUT_REFINE = """
import json, os, sys
from pathlib import Path
from ballscrew_fmu.checks.replay import FmuInstance

cache = Path(os.environ["XDG_CACHE_HOME"])
def trace(instance):
    return {
        "solvers": [n for n in sys.modules if n.startswith("_ballscrew_solver_") and "." not in n],
        "cache": [p.name for p in cache.glob("**/_ballscrew_solver_*")],
        "messages": list(instance.messages),
    }

with FmuInstance(sys.argv[1]) as one, FmuInstance(sys.argv[2]) as plain:
    for each in (one, plain):
        each.step(speed=30.0)
    result = {"outputs": [one.outputs(), plain.outputs()], "without": trace(one)}
    one.step(speed=31.0, refine=True)
    result["with"] = trace(one)
print(json.dumps(result))
"""


def of_process(script, cache, *arguments):
    """JSON in the last line that a script prints, with a separate cache folder."""
    environment = os.environ | {name: str(cache) for name in ("XDG_CACHE_HOME", "LOCALAPPDATA", "HOME")}
    command = [sys.executable, "-c", script, *map(str, arguments)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout.splitlines()[-1])


# behaviour of the slave, with the stub


def test_without_refine_no_solver_is_imported(refinable, unpacked, tmp_path):
    """In a separate process without the modules of other tests."""
    found = of_process(WITH_AND_WITHOUT_REFINE, tmp_path, refinable, unpacked)
    assert found["outputs"][0] == found["outputs"][1]
    assert found["without"] == {"solvers": [], "cache": [], "messages": []}
    assert len(found["with"]["solvers"]) == len(found["with"]["cache"]) == 1  # with refine it is
    assert [text for _, text in found["with"]["messages"]] == ["refine: contact at 31.0 rad/s solved"]


def test_refine_corrects_the_map_and_can_be_switched_between_steps(refinable, unpacked):
    with FmuInstance(refinable) as one, FmuInstance(unpacked) as plain:
        plain.step(speed=30.0)
        for on, factor in (
            (False, 1.0),
            (True, stub_solver.factor(1)),
            (False, 1.0),
            (True, stub_solver.factor(1)),
        ):
            assert one.step(speed=30.0, refine=on)
            assert one.get("refine") is on
            assert one.get(FILM) == pytest.approx(factor * plain.get(FILM), rel=1e-12)
        one.step(refine_tolerance=0.05)
        assert one.get(FILM) == pytest.approx(stub_solver.factor(1, 0.05) * plain.get(FILM), rel=1e-12)
        assert one.get("contact_pressure_max") == plain.get("contact_pressure_max")
        assert of_status(one, 0) == ["refine: contact at 30.0 rad/s solved"]


def test_values_right_after_initialization_are_refined(refinable, unpacked):
    with FmuInstance(refinable, speed=30.0, refine=True) as one, FmuInstance(unpacked, speed=30.0) as plain:
        assert one.get(FILM) == pytest.approx(stub_solver.factor(1) * plain.get(FILM), rel=1e-12)


def test_presliding_takes_its_coulomb_part_from_the_refined_map(refinable):
    with FmuInstance(refinable, refine=True, presliding_stiffness=400.0) as one:
        for speed in (0.0, 0.01, -0.02):
            assert one.step(speed=speed)
            assert all(math.isfinite(value) for value in one.outputs().values())


def run(instance, speeds):
    return [(instance.step(speed=speed), instance.outputs()) for speed in speeds]


def test_the_state_includes_the_solved_contacts(refinable):
    later = (30.0, 40.0, 10.0, 50.0)
    with FmuInstance(refinable, refine=True) as one, FmuInstance(refinable, refine=True) as other:
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
        one.slave.setFMUstate(other.slave.deSerializeFMUstate(content))
        assert one.slave.serializeFMUstate(one.slave.getFMUstate()) == content


def test_reset_discards_the_solved_contacts(refinable):
    with FmuInstance(refinable, refine=True) as used, FmuInstance(refinable, refine=True, speed=5.0) as fresh:
        run(used, (10.0, 20.0))
        used.slave.reset()
        used.slave.setupExperiment(startTime=0.0)
        used.set(refine=True, speed=5.0)
        used.slave.enterInitializationMode()
        used.slave.exitInitializationMode()
        assert used.outputs() == fresh.outputs()


def test_a_contact_without_solution_is_reported_once(refinable):
    with FmuInstance(refinable, refine=True) as one:
        run(one, (10.0,))
        for _ in range(3):
            assert one.step(preload=stub_solver.UNSOLVED)
        assert of_status(one, WARNING) == ["refine: no convergence (logged once)"]


def test_an_error_of_the_refinement_leaves_the_map_in_use(refinable, unpacked):
    """Without presliding, which would depend on the steps before."""
    with (
        FmuInstance(refinable, refine=True, presliding=False) as one,
        FmuInstance(unpacked, presliding=False) as plain,
    ):
        run(one, (10.0, 20.0))
        for _ in range(3):
            assert one.step(preload=stub_solver.BROKEN, speed=20.0)
        plain.step(preload=stub_solver.BROKEN, speed=20.0)
        now, wanted = one.outputs(), plain.outputs()
        assert now.pop("heat") > wanted.pop("heat")  # of more steps
        assert now == wanted
        assert of_status(one, ERROR) == ["refine: RuntimeError: broken; results are those of the map"]


def test_a_map_without_screw_parameters_is_not_refined(unpacked):
    """The closed-form map contains no parameters and no solved film."""
    with FmuInstance(unpacked, speed=30.0) as plain, FmuInstance(unpacked, speed=30.0, refine=True) as one:
        assert one.step()
        plain.step()
        assert one.get(FILM) == plain.get(FILM)
        (message,) = of_status(one, ERROR)
        assert (
            "film model of the map = synthetic; refinement needs solved, solved_thermal or mechanistic"
            in message
        )


def test_only_the_boolean_parameter_can_be_set_as_boolean(instance):
    place = instance._references
    instance.slave.setBoolean([place["in_range"], place["speed"], 999], [True, True, True])
    instance.slave.setReal([place["refine"]], [1.0])
    assert [text.split()[0] for text in of_status(instance, ERROR)] == [
        "in_range",
        "speed",
        "value",
        "refine",
    ]
    assert instance.get("refine") is False


# the cache


FILES = {"__init__.py": b"", "part/__init__.py": b"", "part/a.py": b"VALUE = 1\n"}


@pytest.fixture
def shipped(tmp_path):
    folder = tmp_path / "shipped" / solver_name(FILES)
    for name, content in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def contents(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_the_solver_is_copied_once(shipped, tmp_path):
    cache = tmp_path / "new" / "cache"
    first = installed(shipped, cache)
    assert contents(first) == FILES
    (first / "part" / "__pycache__").mkdir()
    (first / "part" / "__pycache__" / "a.nbc").write_bytes(b"compiled")
    times = {p: p.stat().st_mtime_ns for p in first.rglob("*.py")}
    assert installed(shipped, cache) == first == cache / shipped.name
    assert {p: p.stat().st_mtime_ns for p in first.rglob("*.py")} == times
    assert (first / "part" / "__pycache__" / "a.nbc").exists()
    assert [p.name for p in cache.iterdir()] == [shipped.name]


def test_a_damaged_copy_is_replaced(shipped, tmp_path):
    copy = installed(shipped, tmp_path / "cache")
    (copy / "part" / "a.py").write_text("VALUE = 2\n")
    assert contents(installed(shipped, tmp_path / "cache")) == FILES
    (copy / "part" / "a.py").unlink()
    assert contents(installed(shipped, tmp_path / "cache")) == FILES


def test_a_cache_written_by_another_process_is_used(shipped, tmp_path, monkeypatch):
    cache = tmp_path / "cache"
    original = solver_cache.shutil.copytree

    def slow(source, target, **options):
        monkeypatch.setattr(solver_cache.shutil, "copytree", original)
        installed(shipped, cache)  # the other process
        return original(source, target, **options)

    monkeypatch.setattr(solver_cache.shutil, "copytree", slow)
    assert contents(installed(shipped, cache)) == FILES
    assert [p.name for p in cache.iterdir()] == [shipped.name]


def test_other_sources_have_another_name():
    names = {
        solver_name(FILES),
        solver_name(FILES | {"b.py": b""}),
        solver_name(FILES | {"__init__.py": b" "}),
    }
    assert len(names) == 3


def test_the_cache_folder_is_that_of_the_system(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "local"))
    monkeypatch.setenv("HOME", str(tmp_path))
    for platform, root in (("linux", "xdg"), ("win32", "local"), ("darwin", "Library/Caches")):
        monkeypatch.setattr(solver_cache.sys, "platform", platform)
        assert user_cache() == tmp_path / root / "ballscrew_tehl"
    monkeypatch.setattr(solver_cache.sys, "platform", "linux")
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert user_cache() == tmp_path / ".cache" / "ballscrew_tehl"


def test_a_cache_that_cannot_be_written_is_reported_and_not_needed(synthetic_nut_map, tmp_path, monkeypatch):
    sources = stub_solver.SOURCES | {"nut_map/__init__.py": "# another\n"}
    fmu = build_fmu(synthetic_nut_map, tmp_path / "other.fmu", solver=sources).path
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    with FmuInstance(fmu, refine=True) as one:
        run(one, (10.0, 20.0))
        (message,) = of_status(one, WARNING)
        assert message.startswith("refine: compiled code of the solver is not kept")
        assert of_status(one, ERROR) == []


def test_an_fmu_without_solver_reports_it(tmp_path):
    with pytest.raises(SolverError, match=r"0 solvers .*; needs one: build the FMU again"):
        load_solver(tmp_path, tmp_path / "cache")


def test_a_missing_package_is_named(tmp_path):
    files = {
        "__init__.py": b"",
        "nut_map/__init__.py": b"",
        "refinement/refine.py": b"import no_such_package.part\n",
    }
    for name, content in files.items():
        path = tmp_path / "solver" / solver_name(files) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    with pytest.raises(
        SolverError, match=r"no_such_package is missing .*: python -m pip install no_such_package"
    ):
        load_solver(tmp_path, tmp_path / "cache")


# the solver in the FMU


def test_the_packaged_solver_is_complete():
    sources = solver_sources()
    assert {
        "refinement/refine.py",
        "contact/film/kernels.py",
        "friction/torque.py",
        "__init__.py",
    } <= sources.keys()
    assert not any("evaluate" in name or "xarray" in text for name, text in sources.items())


def test_a_solver_with_other_imports_is_refused(tmp_path):
    for line in (
        "import xarray",
        "from ballscrew_tehl.physics.hertz import ellipse",
        "from matplotlib import pyplot",
    ):
        with pytest.raises(PackageError, match="does not travel with the FMU"):
            package._imported(
                package.ast.parse(f"def f():\n    {line}"), "ballscrew_tehl.friction.torque", "ballscrew_tehl"
            )


def test_an_import_for_types_does_not_count():
    tree = package.ast.parse("if TYPE_CHECKING:\n    import xarray\nelse:\n    from . import __version__\n")
    assert package._imported(tree, "ballscrew_tehl.friction.torque", "ballscrew_tehl") == ["ballscrew_tehl"]
    tree = package.ast.parse(
        "from . import physics, __version__\nfrom .physics import hertz\nfrom .contact.solver import solve\n"
    )
    assert set(package._imported(tree, "ballscrew_tehl.friction.torque", "ballscrew_tehl")) == {
        "ballscrew_tehl",
        "ballscrew_tehl.physics",
        "ballscrew_tehl.physics.hertz",
        "ballscrew_tehl.contact.solver",
    }


def test_another_solver_gives_another_fmu(synthetic_nut_map, tmp_path):
    sources = [stub_solver.SOURCES, stub_solver.SOURCES | {"__init__.py": "# changed\n"}]
    built = [build_fmu(synthetic_nut_map, tmp_path / f"{n}.fmu", solver=s) for n, s in enumerate(sources)]
    assert built[0].guid != built[1].guid


# the solver itself


REFINED_RUN = """
import json, sys
from pathlib import Path
missing, folder = sys.argv[2], sys.argv[1]
if missing:
    sys.modules[missing] = None
from ballscrew_fmu.checks.replay import FmuInstance

with FmuInstance(folder, preload=1500.0) as one:
    one.step(speed=40.0)
    plain, lean = one.get("friction_torque"), {"numba", "scipy", "pydantic"}.isdisjoint(sys.modules) or missing
    ok = one.step(speed=40.0, refine=True)
    result = {
        "lean": bool(lean), "plain": plain, "ok": ok, "refined": one.get("friction_torque"),
        "messages": one.messages, "film": one.get("film_thickness_min"),
    }
print(json.dumps(result))
"""


@pytest.fixture(scope="module")
def packaged(tmp_path_factory):
    """Unpacked FMU of the packaged map."""
    folder = tmp_path_factory.mktemp("packaged")
    fmu = build_fmu(load_map(None, load_parameters()), folder / "BallScrewFriction.fmu").path
    return fmpy.extract(str(fmu), unzipdir=str(folder / "unpacked"))


@pytest.mark.slow
@pytest.mark.parametrize("missing", ["numba", "scipy", "pydantic"])
def test_without_the_packages_of_the_solver_the_map_is_used(packaged, tmp_path, missing):
    found = of_process(REFINED_RUN, tmp_path, packaged, missing)
    assert found["ok"]
    assert found["refined"] == found["plain"]
    ((status, message),) = found["messages"]
    assert status == ERROR
    assert message.startswith(f"refine: {missing} is missing in the Python of the host")
    assert f"python -m pip install {missing}; results are those of the map" in message


@pytest.mark.slow
def test_refined_torque_is_the_direct_one_and_the_second_process_does_not_compile(packaged, tmp_path):
    """Tolerance: at the solved point only the error of the mean ball remains, not the scatter of the solver."""
    from ballscrew_tehl.friction.sets import default_friction_set
    from ballscrew_tehl.friction.torque import double_nut_torque
    from ballscrew_tehl.refinement.direct import DirectFilm

    first = of_process(REFINED_RUN, tmp_path, packaged, "")
    compiled = {p: p.stat().st_mtime_ns for p in tmp_path.rglob("*.nbc")}
    assert len(compiled) > 10
    second = of_process(REFINED_RUN, tmp_path, packaged, "")
    assert {p: p.stat().st_mtime_ns for p in tmp_path.rglob("*.nbc")} == compiled
    assert any("compiled in" in text for _, text in first["messages"])
    assert not any("compiled in" in text for _, text in second["messages"])
    assert first["lean"]
    assert second["refined"] == first["refined"]
    assert {status for status, _ in first["messages"]} == {0}
    parameters = load_parameters()
    friction_set = default_friction_set(parameters)
    film = DirectFilm(parameters, friction_set.film_model == "solved_thermal")
    direct = double_nut_torque(parameters, friction_set, film, 1500.0, 40.0, 303.15)
    assert first["refined"] == pytest.approx(direct.total, rel=4e-4)
