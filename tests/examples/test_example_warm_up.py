"""Warm-up: time constants against the closed form of the network, end against the steady balance with the map."""

import numpy as np
import pytest
import warm_up
from scipy.optimize import fsolve

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def result(native_fmu):
    return warm_up.main(native_fmu)


def test_time_constants_are_those_of_the_closed_form(result):
    slow, fast = result["closed_slow_s"], result["closed_fast_s"]
    rates, _ = result["drive"].rates()
    assert sorted([slow, fast]) == pytest.approx(sorted(-1.0 / np.linalg.eigvals(rates)), rel=1e-9)
    assert result["slow_constant_heat_s"] == pytest.approx(slow, rel=2e-3)
    assert result["slow_coupled_s"] == pytest.approx(result["closed_slow_coupled_s"], rel=0.02)
    # less heat when warm acts like more convection
    assert result["slow_coupled_s"] < 0.97 * slow


def test_the_end_is_the_steady_balance_with_the_torque_of_the_map(result, synthetic_nut_map):
    drive = result["drive"]

    def loss(nut, screw):
        state = synthetic_nut_map.evaluate(drive.preload_at(nut, screw), drive.speed, float(nut))
        return state.friction_torque * drive.speed

    def balance(over):
        rates, gain = drive.rates()
        return rates @ over + gain * loss(*(drive.ambient + over))

    rises = fsolve(balance, [10.0, 10.0], xtol=1e-12)
    assert (result["nut_rise_K"], result["screw_rise_K"]) == pytest.approx(tuple(rises), rel=1e-4)
    air = drive.nut_to_air * rises[0] + drive.screw_to_air * rises[1]
    assert air == pytest.approx(drive.duty * result["power_warm_W"], rel=1e-4)
    assert result["in_range"]


def test_torque_falls_steadily_and_preload_follows_the_temperatures(result):
    drive, rows = result["drive"], result["coupled"]
    _, nut, screw, preload, torque, power = rows.T
    assert np.all(np.diff(nut) > -1e-6)
    assert result["torque_warm_Nm"] < 0.9 * result["torque_cold_Nm"]
    assert power == pytest.approx(torque * drive.speed, rel=1e-9)
    # 0.5 * 4e8 N/m * 11.5e-6 1/K * (2 * 20 mm * cot 45 deg - 80 mm)
    assert drive.preload_slope == pytest.approx(-92.0)
    assert preload == pytest.approx(2000.0 - 92.0 * (screw - nut), rel=1e-12)
    assert result["preload_extreme_N"] > result["preload_warm_N"] > drive.preload  # the nut is warmer


def test_picture_and_command_line(result, native_fmu, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(warm_up, "main", lambda path: result)
    assert warm_up.command_line(["--fmu", str(native_fmu), "--plot", str(tmp_path / "a.png")]) == 0
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert "slow_coupled_s" in capsys.readouterr().out
    assert warm_up.command_line(["--fmu", "none.fmu"]) == 2
