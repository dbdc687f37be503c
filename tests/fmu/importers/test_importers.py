"""The FMUs in importers: replay, zero inputs, coupling with a rotor. importer_table.py prints all results."""

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from importer_cases import (
    AGREEMENT,
    HELD,
    MASTER_AGREEMENT,
    MONITOR_AGREEMENT,
    NAMES,
    SMOOTH,
    ZEROS,
    below_special_characters,
    beside_the_monitor,
    coupled,
    reference,
    replayed,
    subject,
    subjects_of,
    zero_findings,
)
from importers import (
    MASTERS,
    REPLAYS,
    STEP,
    problem,
    toolbox_findings,
)
from rotor_fmu import RUNS_HERE

from ballscrew_tehl.runtime.standstill import presliding_step

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not RUNS_HERE, reason="rotor and importers run on x86_64 Linux only"),
]


def cases(table):
    """Test parameters: each case with each FMU that it can read."""
    return [
        pytest.param(case, name, id=f"{case.tool}, {case.way}, {name}")
        for case in table
        for name in subjects_of(case)
    ]


def needs(tool):
    reason = problem(tool)
    if reason:
        pytest.skip(reason)


@pytest.fixture(scope="module")
def reference_rows(synthetic_nut_map):
    return reference(synthetic_nut_map)


@pytest.mark.parametrize("name", ["native FMI 2.0", "native FMI 3.0"])
def test_the_rotor_is_a_valid_fmu_and_integrates_exactly(name):
    rotor = subject(name).rotor
    assert validate_fmu(str(rotor)) == []
    starts = {"inertia": 0.5, "start_speed": 3.0, "motor_torque": 1.0}
    result = fmpy.simulate_fmu(str(rotor), stop_time=64 * STEP, output_interval=STEP, start_values=starts)
    assert np.abs(result["speed"] - (3.0 + 2.0 * result["time"])).max() < 1e-13
    assert np.abs(result["angle"] - (3.0 * result["time"] + result["time"] ** 2)).max() < 1e-13


@pytest.mark.parametrize(("case", "name"), cases(REPLAYS))
def test_replay_gives_the_numbers_of_the_map(case, name, reference_rows):
    needs(case.tool)
    worst = replayed(case, subject(name).friction, *reference_rows)
    assert worst <= AGREEMENT, worst


@pytest.mark.parametrize(("case", "name"), cases(REPLAYS))
def test_replay_below_a_path_with_special_characters(case, name, reference_rows):
    needs(case.tool)
    rows, expected = reference_rows
    expected = {case.kind: expected[case.kind][:8]}
    with below_special_characters(subject(name).friction) as fmu:
        assert replayed(case, fmu, rows[:8], expected) <= AGREEMENT


@pytest.mark.parametrize(("case", "name"), cases([case for case in REPLAYS if case.kind == "CS"]))
def test_two_different_fmus_in_one_process(case, name, synthetic_nut_map, reference_rows):
    needs(case.tool)
    rows, expected = reference_rows[0][:8], reference_rows[1][case.kind][:8]
    friction, monitor = beside_the_monitor(case, name, synthetic_nut_map, rows, expected)
    assert friction <= AGREEMENT
    assert monitor <= MONITOR_AGREEMENT


@pytest.mark.parametrize(("case", "name"), cases(REPLAYS))
def test_inputs_left_at_zero_give_no_torque_and_no_nan(case, name):
    needs(case.tool)
    assert all(value == 0.0 for row in ZEROS for value in row.values())
    assert zero_findings(case, subject(name).friction) == []


@pytest.mark.parametrize("coupling", [pytest.param(SMOOTH, id="sliding"), pytest.param(HELD, id="bristle")])
@pytest.mark.parametrize(("case", "name"), cases(MASTERS))
def test_masters_that_step_all_at_once_agree(case, name, coupling, tmp_path):
    needs(case.tool)
    worst, run = coupled(case, subject(name).friction, subject(name).rotor, coupling, tmp_path)
    assert worst <= MASTER_AGREEMENT, worst
    speed = run[:, 2]
    assert (np.abs(speed[-1]) < 1e-9) if coupling is HELD else (0.0 < speed[-1] < 20.0)
    assert (np.diff(speed[1:]) * np.diff(speed[:-1]) >= 0.0).all() or coupling is HELD, "no ripple"


@pytest.mark.parametrize("name", NAMES)
def test_the_checks_of_the_toolbox_find_nothing(name):
    needs("fmu-manipulation-toolbox")
    assert toolbox_findings(subject(name).friction) == []
    assert toolbox_findings(subject(name).rotor) == []


@pytest.mark.parametrize("name", ["native FMI 2.0", "native FMI 3.0"])
def test_the_bristle_in_cvode_follows_reversals(name, synthetic_nut_map):
    """Model exchange with its events in an importer, against the law in closed form for constant speed. The speed
    changes in input events: CVode of fmpy 0.3.32 does not set continuous inputs within a step."""
    inputs = {"preload": 2000.0, "temperature": 303.15, "axial_load": 0.0}
    pieces, part, points = (0.05, -0.05, 0.02, -0.3, 0.0), 0.125, 64
    corners = [n * part for n in range(len(pieces)) for n in (n, n + 1)]
    signals = np.zeros(len(corners), dtype=[(key, float) for key in ("time", "speed", *inputs)])
    signals["time"], signals["speed"] = corners, np.repeat(pieces, 2)
    for key, value in inputs.items():
        signals[key] = value
    result = fmpy.simulate_fmu(
        str(subject(name).friction), fmi_type="ModelExchange", solver="CVode", relative_tolerance=1e-7,
        start_values={"presliding_stiffness": 400.0, "presliding_damping": 1e-9, "presliding_side": 1e-12},
        input=signals, stop_time=corners[-1], output_interval=part / points, record_events=False,
        output=["hysteresis_torque", "sliding_torque"],
    )  # fmt: skip
    state = synthetic_nut_map.evaluate(**inputs, speed=0.0)
    coulomb = float(state.coulomb_torque)
    deflection, expected = 0.0, [0.0]
    for speed in pieces:
        for _ in range(points):
            step = presliding_step(deflection, speed, part / points, coulomb, 400.0, 0.0)
            deflection = step.deflection
            expected.append(step.torque)
    assert np.max(expected) > 0.999 * coulomb
    assert np.min(expected) < -0.999 * coulomb
    found = result["hysteresis_torque"] + result["sliding_torque"]
    worst = np.abs(found - expected).max() / coulomb
    assert worst <= 2e-3, worst  # the slip mode starts at 0.999 of the Coulomb torque
