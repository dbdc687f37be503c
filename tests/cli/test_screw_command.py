"""Commands screw and catalogue: against the functions behind them, balances between their keys, bad input."""

import json
import math

import command_line
from command_line import refused
from paths import ROOT
from reference_screw import GD4008

from ballscrew_tehl.friction.baselines import nsk_torque
from ballscrew_tehl.physics.load import double_nut_loads
from ballscrew_tehl.physics.rating import dynamic_rating

SCREW = GD4008.screw
LOADED = ("--preload-n", "2000", "--axial-load-n", "1500")


def run(capsys, *arguments):
    code, out, err = command_line.run(capsys, *arguments, "--json")
    assert code == 0, err
    return json.loads(out)


def test_screw_agrees_with_itself_and_with_the_loads(capsys):
    found = run(capsys, "screw", *LOADED)
    loads = double_nut_loads(SCREW, 2000.0, 1500.0, SCREW.loaded_ball_count)
    assert abs(found["nut_force_a_n"] - found["nut_force_b_n"] - 1500.0) <= 1e-6
    assert abs(found["ball_load_max_n"] / float(loads.Q_b.max()) - 1.0) <= 1e-12
    assert 2.0**1.5 * 2000.0 <= found["separation_load_n"] <= 4.0 * 2000.0
    step = 1.0
    near = run(capsys, "screw", "--preload-n", "2000", "--axial-load-n", str(1500.0 + step))
    slope = step / (near["axial_deflection_m"] - found["axial_deflection_m"])
    assert abs(slope / found["axial_stiffness_n_per_m"] - 1.0) <= 1e-3
    assert abs(found["lost_motion_m"] / found["axial_deflection_m"] - 2.0) <= 1e-12


def test_efficiency_and_hours_need_speed_and_temperature(capsys):
    found = run(capsys, "screw", *LOADED, "--speed-rpm", "-1000", "--temperature-c", "30")
    torque = run(capsys, "torque", *LOADED, "--speed-rpm", "1000", "--temperature-c", "30")
    assert abs(found["friction_torque_nm"] / torque["friction_torque_nm"] - 1.0) <= 1e-12
    useful = 1500.0 * SCREW.lead / (2.0 * math.pi)
    driven = useful / (useful + found["friction_torque_nm"])
    assert abs(found["efficiency"] / driven - 1.0) <= 1e-12
    assert abs(found["efficiency_backdriving"] / (1.0 - found["friction_torque_nm"] / useful) - 1.0) <= 1e-12
    assert abs(found["life_hours"] * 60.0 * 1000.0 / found["life_turns"] - 1.0) <= 1e-12
    assert "efficiency" not in run(capsys, "screw", "--preload-n", "2000")
    assert "give both" in refused(capsys, "screw", *LOADED, "--speed-rpm", "100")


def test_a_screw_that_cannot_be_driven_backwards_says_zero(capsys):
    light = ("--preload-n", "4000", "--axial-load-n", "50", "--speed-rpm", "1000", "--temperature-c", "30")
    assert run(capsys, "screw", *light)["efficiency_backdriving"] == 0.0


def test_catalogue_takes_five_percent_of_the_rating(capsys):
    found = run(capsys, "catalogue")
    assert abs(found["preload_n"] / (0.05 * dynamic_rating(SCREW)) - 1.0) <= 1e-12
    assert abs(found["catalogue_torque_nm"] / float(nsk_torque(SCREW, found["preload_n"])) - 1.0) <= 1e-12
    assert "JIS B 1192" in found["conditions"]
    assert run(capsys, "catalogue", "--preload-n", "0")["catalogue_torque_nm"] == 0.0


def test_every_example_screw_has_its_numbers(capsys):
    files = sorted((ROOT / "tests/data/screws").glob("*.toml"))
    assert len(files) >= 10
    for file in files:
        found = run(capsys, "screw", "--screw", file, "--preload-n", "200", "--axial-load-n", "100")
        assert 0.0 < found["pressure_over_static"] < 1.0
        assert 2.0 < found["separation_load_n"] / 200.0 < 6.0


def test_bad_numbers_are_one_line(capsys):
    assert "--preload-n = -1" in refused(capsys, "screw", "--preload-n", "-1")
    assert "--preload-n = nan" in refused(capsys, "catalogue", "--preload-n", "nan")
    assert "--speed-rpm = nan" in refused(
        capsys, "screw", *LOADED, "--speed-rpm", "nan", "--temperature-c", "30"
    )
