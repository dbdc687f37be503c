"""Model exchange in CVode: modes of the bristle at the reversals, and co-simulation converges to it."""

from itertools import pairwise

import model_exchange
import numpy as np
import pytest

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def result(native_fmu):
    return model_exchange.main(native_fmu)


def test_each_reversal_has_its_two_events(result):
    assert result["reversals"] == 3
    assert [event.kind for event in result["events"]] == ["slip", "stick"] * 3 + ["slip"]
    assert (result["slips"], result["sticks"]) == (4, 3)
    for event in result["events"]:
        if event.kind == "stick":  # the hysteresis of the FMU
            assert abs(event.speed) == pytest.approx(1e-6, rel=0.1)
        else:
            assert abs(event.speed) > 0.1
    assert all(a.time < b.time for a, b in pairwise(result["events"]))


def test_transition_from_stick_to_slip_is_that_of_the_law(result, synthetic_nut_map):
    """From -1 to 0.7 of the sliding deflection one to one, then exponentially to 0.999 of it."""
    state = synthetic_nut_map.evaluate(2000.0, 0.0, 303.15)
    deflection = state.coulomb_torque / 100.0
    tail = 0.3 * np.log(0.3 / 0.001)
    first, *rest = (b for b in result["events"] if b.kind == "slip")
    assert abs(first.angle) == pytest.approx((0.7 + tail) * deflection, rel=1e-3)
    sticks = [event for event in result["events"] if event.kind == "stick"]
    for stick, slip in zip(sticks, rest, strict=True):
        assert abs(slip.angle - stick.angle) == pytest.approx((1.7 + tail) * deflection, rel=1e-3)


def test_torque_in_slip_is_that_of_the_map(result, synthetic_nut_map):
    slips = [event.time for event in result["events"] if event.kind == "slip"]
    sticks = [event.time for event in result["events"] if event.kind == "stick"]
    time, speed, _, torque = result["exchange"].T
    for begin, end in zip(slips, [*sticks, time[-1]], strict=True):
        inside = (time > begin) & (time < end)
        state = synthetic_nut_map.evaluate(2000.0, speed[inside], 303.15)
        expected = state.friction_torque
        assert inside.sum() > 50
        assert np.abs(torque[inside]) == pytest.approx(expected, rel=1e-9)


def test_co_simulation_converges_to_it_in_first_order(result):
    assert result["tolerance_error"] < 1e-5
    assert 0.95 < result["order"] < 1.05
    assert result["errors"] == sorted(result["errors"], reverse=True)
    assert result["errors"][0] < 0.02
    # the bound in the docstring of the example
    follows = max(
        slip.time - stick.time
        for stick, slip in pairwise(result["events"])
        if (stick.kind, slip.kind) == ("stick", "slip")
    )
    coulomb = float(np.abs(result["exchange"][:, 3]).max())
    assert 0.0 < result["remaining"] < 0.001 * coulomb * follows / 0.01
    assert np.abs(result["exchange"][:, 1]).max() > 1000.0 * result["errors"][-1]


def test_picture_and_command_line(result, native_fmu, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(model_exchange, "main", lambda path: result)
    assert model_exchange.command_line(["--fmu", str(native_fmu), "--plot", str(tmp_path / "a.png")]) == 0
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert "3 reversals" in capsys.readouterr().out
    assert model_exchange.command_line(["--fmu", "none.fmu"]) == 2
