"""--friction of the commands, interval and catalogue torque of the command torque."""

import dataclasses
import json

import command_line
import pytest
from command_line import refused
from synthetic_contacts import closed_build

from ballscrew_tehl.cli.main import main
from ballscrew_tehl.friction.baselines import nsk_torque
from ballscrew_tehl.friction.sets import default_friction_set, load_friction_sets, write_friction_sets
from ballscrew_tehl.nut_map.file import load_contact_map, load_map, save_map
from ballscrew_tehl.nut_map.interval import map_interval
from ballscrew_tehl.parameters.file import changed, load_parameters
from ballscrew_tehl.parameters.identity import parameters_hash
from ballscrew_tehl.parameters.packaged_data import PACKAGED_DATA
from ballscrew_tehl.parameters.units import CELSIUS, RPM

LAW_FILE, OTHER_FILE = PACKAGED_DATA / "gd4008_vg100.toml", PACKAGED_DATA / "example_25x10.toml"
LAW = load_parameters(LAW_FILE)
POINT = ("--preload-n", "2000", "--speed-rpm", "300", "--temperature-c", "30")
SI = (2000.0, 300.0 * RPM, 30.0 + CELSIUS)


def run(capsys, *arguments):
    """Exit code, parsed JSON, stderr."""
    code, out, err = command_line.run(capsys, *arguments, "--json")
    return code, json.loads(out) if out else None, err


@pytest.fixture(scope="module")
def law_map(tmp_path_factory):
    path = tmp_path_factory.mktemp("map") / "law.nc"
    save_map(path, closed_build(LAW), {})
    return str(path)


@pytest.fixture(scope="module")
def other_map(tmp_path_factory):
    path = tmp_path_factory.mktemp("map") / "other.nc"
    save_map(path, closed_build(load_parameters(OTHER_FILE)), {})
    return str(path)


@pytest.fixture
def own_fit(tmp_path):
    """What calibrate --output writes for the packaged screw with VG 100."""
    path = tmp_path / "friction.toml"
    entry = dataclasses.replace(
        default_friction_set(LAW), net_sliding_coefficient=0.0142, screw="my screw", provenance="own"
    )
    write_friction_sets(path, {(entry.kinematics, entry.name): entry})
    return str(path)


def test_named_law_takes_its_own_screw_file(capsys, law_map):
    code, found, err = run(capsys, "torque", *POINT, "--friction", "mechanistic", "--map", law_map)
    assert code == 0
    assert found["friction_torque_nm"] == pytest.approx(
        float(load_map(law_map, LAW).evaluate(*SI).friction_torque), rel=1e-12
    )
    assert (found["screw"], found["friction_set"], found["kinematics"], found["friction_screw"]) == (
        "GD4008-3", "mechanistic", "rolling_frame", "GD4008-3",
    )  # fmt: skip
    assert found["film_kinematics"] == "rolling_frame"
    assert "friction_note" not in found
    assert err == ""


def test_interval_is_that_of_the_law(capsys, law_map):
    _, found, _ = run(capsys, "torque", *POINT, "--friction", "mechanistic", "--map", law_map)
    axes, friction_set = load_map(law_map, LAW).header["axes"], default_friction_set(LAW)
    interval = map_interval(LAW, load_contact_map(law_map, LAW), axes, friction_set, *SI)
    low, high = interval.relative
    torque = found["friction_torque_nm"]
    assert found["torque_low_nm"] == pytest.approx(low * torque, rel=1e-12)
    assert found["torque_high_nm"] == pytest.approx(high * torque, rel=1e-12)
    assert found["torque_low_nm"] < torque < found["torque_high_nm"]
    assert "about 80 %" in found["torque_interval"]
    assert next(iter(interval.shares)) in found["torque_interval"]
    _, back, _ = run(
        capsys, "torque", *POINT[:2], "--speed-rpm", "-300", *POINT[4:], "--friction", "mechanistic", "--map", law_map
    )  # fmt: skip
    assert back["torque_low_nm"] == -found["torque_high_nm"]
    assert back["torque_high_nm"] == -found["torque_low_nm"]
    _, rest, _ = run(
        capsys, "torque", *POINT[:2], "--speed-rpm", "0", *POINT[4:], "--friction", "mechanistic", "--map", law_map
    )  # fmt: skip
    assert rest["torque_low_nm"] == rest["torque_high_nm"] == 0.0


def test_unloaded_nut_and_fitted_sets_have_no_interval(capsys, law_map):
    law = ("--screw", LAW_FILE, "--map", law_map)
    _, found, _ = run(capsys, "torque", "--preload-n", "0", *POINT[2:], *law)
    assert (found["friction_torque_nm"], found["catalogue_torque_nm"]) == (0.0, 0.0)
    assert "torque_low_nm" not in found
    _, found, _ = run(capsys, "torque", *POINT)
    assert "torque_low_nm" not in found
    assert (found["friction_set"], found["friction_screw"]) == ("three_parameter", "GD4008-3")


def test_another_screw_says_so_once_with_the_catalogue_torque(capsys, other_map, tmp_path):
    other = load_parameters(OTHER_FILE)
    points = tmp_path / "points.csv"
    points.write_text("preload_n,speed_rpm,temperature_c\n1000,300,30\n2000,300,30\n")
    code, found, err = run(
        capsys, "torque", "--points", str(points), "--screw", str(OTHER_FILE), "--map", other_map
    )
    assert code == 0
    assert err.count("were measured on GD4008-3, not on example 25x10") == 1
    for entry, preload in zip(found, (1000.0, 2000.0), strict=True):
        assert entry["friction_note"] == err.strip()
        assert entry["catalogue_torque_nm"] == pytest.approx(
            float(nsk_torque(other.screw, preload)), rel=1e-12
        )
        assert entry["friction_set"] == "mechanistic"
    narrow, wide = found[0], run(capsys, "torque", *POINT, "--screw", LAW_FILE, "--friction", "mechanistic")
    assert wide[0] in (0, 2)
    assert narrow["torque_high_nm"] / narrow["torque_low_nm"] > 1.3


def test_file_of_a_fit(capsys, law_map, own_fit):
    _, packaged, _ = run(capsys, "torque", *POINT, "--friction", "mechanistic", "--map", law_map)
    code, found, _ = run(capsys, "torque", *POINT, "--friction", own_fit, "--map", law_map)
    assert code == 0
    assert found["friction_screw"] == "my screw"
    share = found["sliding_torque_nm"] / packaged["sliding_torque_nm"]
    assert 1.05 < share < 0.0142 / packaged_coefficient()
    torque = str(found["friction_torque_nm"])
    _, preload, _ = run(
        capsys, "preload", "--torque-nm", torque, *POINT[2:], "--friction", own_fit, "--map", law_map
    )
    assert preload["preload_n"] == pytest.approx(2000.0, rel=1e-9)
    assert preload["friction_screw"] == "my screw"


def packaged_coefficient():
    return load_friction_sets()["rolling_frame", "mechanistic"].net_sliding_coefficient


def test_file_of_another_screw_is_refused(capsys, own_fit, other_map):
    line = refused(
        capsys, "torque", *POINT, "--friction", own_fit, "--screw", str(OTHER_FILE), "--map", other_map
    )
    assert f"fitted for the screw my screw ({parameters_hash(LAW)})" in line
    assert "expected example 25x10" in line
    line = refused(capsys, "torque", *POINT, "--friction", own_fit, "--screw", str(OTHER_FILE), "--direct")
    assert "fitted for the screw my screw" in line


@pytest.mark.parametrize("command", ["torque", "preload", "report", "validate"])
def test_unknown_name_and_kinematics_are_one_line(capsys, tmp_path, command):
    own = {
        "torque": POINT, "preload": ("--torque-nm", "1", *POINT[2:]),
        "report": ("--output", str(tmp_path / "page.html")), "validate": (),
    }[command]  # fmt: skip
    line = refused(capsys, command, *own, "--friction", "four_parameter")
    assert "--friction = four_parameter; allowed: " in line
    assert "three_parameter" in line
    line = refused(capsys, command, *own, "--friction", "mechanistic", "--kinematics", "published")
    assert "--kinematics = published; allowed: rolling_frame" in line


def test_unphysical_trend_is_out_of_range(capsys, law_map, monkeypatch):
    from ballscrew_tehl.nut_map import trend

    given = ("torque", *POINT, "--screw", str(LAW_FILE), "--map", law_map)
    _, found, _ = run(capsys, *given)
    assert found["in_range"] is True
    assert "unphysical_trend" not in found
    monkeypatch.setattr(trend, "unphysical_trend", lambda *point: trend.Trend(True, False))
    _, found, _ = run(capsys, *given)
    assert found["in_range"] is False
    assert found["clamped"] == []
    assert found["unphysical_trend"] == "torque rises with temperature in a thick film (lambda > 3)"


def test_reservations_about_points_of_a_table(capsys, law_map, monkeypatch, tmp_path):
    """A table has no column for them: one line says how many and where the first is."""
    from ballscrew_tehl.nut_map import trend

    points = tmp_path / "points.csv"
    points.write_text(
        "preload_n,speed_rpm,temperature_c\n900,200,30\n950,300,40\n990,300,40\n", encoding="ascii"
    )

    def heavy(nut_map, preload, *others):
        return trend.Trend(preload > 940.0, False)

    monkeypatch.setattr(trend, "unphysical_trend", heavy)
    given = ["torque", "--points", str(points), "--screw", str(LAW_FILE), "--map", law_map]
    assert main(given) == 0
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("unphysical_trend: ")]
    assert len(lines) == 1
    where = "2 of 3 points, the first: preload_n 950, speed_rpm 300, temperature_c 40, axial_load_n 0: torque rises"
    assert lines[0].startswith(f"unphysical_trend: {where}")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["double_nut", "single_nut_oversize_ball"])
def test_direct_torque_of_the_law(capsys, tmp_path, kind):
    """Sum of the parts, interval around it; the spin of oversize balls is in the torque of this law alone."""
    screw = tmp_path / "own.toml"
    text = LAW_FILE.read_text(encoding="utf-8")
    screw.write_text(text.replace("[screw]", f'[screw]\npreload_kind = "{kind}"', 1))
    given = ("torque", *POINT, "--screw", str(screw), "--direct", "--friction")
    code, found, _ = run(capsys, *given, "mechanistic")
    assert code == 0
    parts = sum(found[f"{name}_torque_nm"] for name in ("viscous", "hysteresis", "sliding"))
    assert found["friction_torque_nm"] == pytest.approx(parts, rel=1e-12)
    assert found["torque_low_nm"] < parts < found["torque_high_nm"]
    assert "spin_torque_not_included_at_most_nm" not in found
    own = changed(load_parameters(screw), friction={"set": "mechanistic"})
    from ballscrew_tehl.refinement.direct import direct_state

    state = direct_state(own, default_friction_set(own), *SI)
    # loads that differ by rounding, solved to 1e-4
    assert state.friction_torque == pytest.approx(parts, rel=2e-4)
    if kind != "double_nut":
        _, fitted, _ = run(capsys, *given, "three_parameter")
        assert fitted["spin_torque_not_included_at_most_nm"] > 0.0
