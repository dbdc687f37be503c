"""The friction FMUs in importers: replay, special paths, two FMUs, zero inputs, coupling with a rotor, standstill.

Numbers: rounding of the C library against that of numpy.
"""

import numpy as np
import pytest
from importers import REPLAYS, STEP, Pair, deviation, needs
from rotor_fmu import RUNS_HERE, build_rotor

from ballscrew_fmu.checks.reference import (
    expected_outputs,
    monitor_outputs,
    presliding_outputs,
    reference_input,
)
from ballscrew_fmu.models import FRICTION, MONITOR

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not RUNS_HERE, reason="importers run on x86_64 Linux only"),
]
CASES = [(case, v) for case in REPLAYS for v in case.versions]
CASES += [(case, "python") for case in REPLAYS if case.kind == "CS"]
POINT = {"preload": 2000.0, "temperature": 303.15}
SPECIAL_FOLDER = (
    "a blank, hash#, plus+, umlaut \u00fc"  # no %: ecos 0.7 does not encode it in the URI of the resources
)


@pytest.fixture(scope="session")
def rotor(tmp_path_factory):
    return build_rotor(tmp_path_factory.mktemp("rotor"))


@pytest.mark.parametrize(("case", "kind"), CASES, ids=lambda x: getattr(x, "way", str(x)))
def test_replay_gives_the_numbers_of_the_map(case, kind, built, tmp_path, monkeypatch, synthetic_nut_map):
    """Below a path with special characters, in turns with a second FMU; then with all inputs left at zero."""
    needs(case.tool)
    rows = list(reference_input(synthetic_nut_map.header))
    if case.kind == "CS":
        expected = presliding_outputs(synthetic_nut_map, rows, STEP)
    else:  # without the bristle, which is then a matter of the solver; no event gives off heat
        expected = [expected_outputs(synthetic_nut_map, 0.1, row) | {"heat": 0.0} for row in rows]
    folder = tmp_path / SPECIAL_FOLDER
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    fmu, monitor = (folder / f"{model.name}.fmu" for model in (FRICTION, MONITOR))
    fmu.write_bytes(built(FRICTION, kind).read_bytes())
    if case.kind == "CS":
        monitor.write_bytes(built(MONITOR, kind).read_bytes())
        inputs = [
            {"torque": wanted["friction_torque"], **{name: row[name] for name in row if name != "preload"}}
            for row, wanted in zip(rows, expected, strict=True)
        ]
        found, preloads = zip(*zip(case.run(fmu, rows), case.run(monitor, inputs), strict=True), strict=True)
        assert deviation(preloads, monitor_outputs(synthetic_nut_map, inputs)) <= 1e-9  # of its search
    else:
        found = list(case.run(fmu, rows))
    assert deviation(found, expected) <= 1e-12
    last = list(case.run(fmu, [dict.fromkeys(rows[0], 0.0)] * 4))[-1]
    assert np.isfinite(list(last.values())).all()
    assert (last["friction_torque"], last["power_loss"], last["in_range"]) == (0.0, 0.0, False)


@pytest.mark.parametrize("friction_first", [False, True], ids=["parallel", "sequential"])
def test_a_rotor_stops_is_held_without_drift_and_breaks_away(built, rotor, synthetic_nut_map, friction_first):
    """Stopped under half of the Coulomb torque, held, then moved by 1.1 times it; all FMUs give the same run. The
    friction acts at an earlier speed than the rotor: an error of first order in the energy, less the wound bristle."""
    coulomb = float(synthetic_nut_map.evaluate(speed=0.0, **POINT).coulomb_torque)
    friction = POINT | {"presliding_stiffness": 400.0, "presliding_damping": 2.0}
    rotor_start, half = {"inertia": 0.01, "start_speed": 20.0}, 0.5 * coulomb
    wound, runs, residuals = coulomb**2 / (2.0 * 400.0), [], []
    for kind, step in ((2, 1e-3), (3, 1e-3), ("python", 1e-3), (2, 5e-4)):
        with Pair((built(FRICTION, kind), rotor), friction, rotor_start, friction_first) as pair:
            run = pair.run(round(4.0 / step), step, half)
            moved = pair.run(round(1.0 / step), step, 1.1 * coulomb)[-1, 3] - run[-1, 3]
        torque, power, speed, angle = run.T
        rest = round(2.0 / step)
        assert np.abs(speed[rest:]).max() < 1e-9
        assert np.ptp(angle[rest:]) < 1e-9  # without drift
        assert moved > 0.1  # free: (0.1 Coulomb - viscous) over the inertia, 1.7 rad
        supplied = 0.5 * 0.01 * 20.0**2 + 0.5 * coulomb * angle[-1]
        bristle = torque[-1] ** 2 / (2.0 * 400.0)  # at rest all torque is that of the bristle
        residuals.append(supplied - power.sum() * step - bristle)
        assert abs(residuals[-1]) <= 0.01 * supplied
        runs.append(run)
    assert np.abs(runs[1] - runs[0]).max() <= 1e-12
    assert np.abs(runs[2] - runs[0]).max() <= 1e-11  # NumPy sums the splines in another order
    assert abs(2.0 * residuals[3] - residuals[0]) <= wound
