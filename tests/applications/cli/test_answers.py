"""Answers of the commands: keys and numbers as recorded, equal to the API, consistent with each other."""

import dataclasses
import json
import math
import re
import subprocess
import sys
from pathlib import Path
from pkgutil import resolve_name

import pytest
from command_line import answer, refused, run
from reference_screw import GD4008

from ballscrew_tehl.applications.calibration.written_sets import write_friction_sets
from ballscrew_tehl.applications.cli import parser
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.nut_map.file import VG100, packaged_map
from ballscrew_tehl.nut_map.interval import map_interval
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters.file import PACKAGED_DATA, PACKAGED_VG100, load_screw
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.load import double_nut_loads

GOLDEN = json.loads(Path(__file__).with_name("golden.json").read_text(encoding="ascii"))
POINT = ("--preload-n", "2000", "--speed-rpm", "1000", "--temperature-c", "30")
SI = (2000.0, 1000.0 * RPM, 30.0 + CELSIUS)
LAW = load_screw(PACKAGED_VG100)
MECHANISTIC = ("--friction", "mechanistic")
PARTS = {f"{name}_torque_nm": f"{name}_torque" for name in ("viscous", "hysteresis", "sliding", "friction")}


def at(found, path):
    for key in path.split("."):
        found = found[int(key)] if isinstance(found, list) else found[key]
    return found


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if "contact" in name else ()) for name in GOLDEN]
)
def test_keys_and_numbers_are_those_recorded(capsys, name):
    """Tolerances: films and contacts 1 %, as another solver of the same equations may differ; the mechanistic law by
    another atlas 3 %, rises half a kelvin, deviations from measured torques 1 %; all else 1e-4."""
    recorded = GOLDEN[name]
    found, _ = answer(capsys, *(word.format(data=PACKAGED_DATA) for word in recorded["words"]))
    assert set(recorded["keys"]) <= set(found)
    for key, expected in recorded["numbers"].items():
        solved = "contact" in name or re.search("film|lambda", key)
        near = 0.03 if "mechanistic" in name else 0.01 if solved else 1e-4
        wide = 0.5 if "film_temperature_rise" in key else 0.01 if "mechanistic" in key else 1e-12
        assert at(found, key) == pytest.approx(expected, rel=near, abs=wide), key


@pytest.mark.parametrize("friction", ["three_parameter", "mechanistic"])
def test_seals_of_the_screw_file_are_a_constant_part_of_the_torque(capsys, tmp_path, friction):
    source = {"three_parameter": PACKAGED_DATA / "gd4008.toml", "mechanistic": PACKAGED_VG100}[friction]
    screw = tmp_path / "sealed.toml"
    screw.write_text(source.read_text().replace("poisson_ratio", "seal_torque_Nm = 0.05\npoisson_ratio", 1))
    place = "--temperature-c", "30", "--speed-rpm"
    for speed, part in ((1000, 0.05), (-1000, -0.05), (0, 0.0)):
        words = "torque", "--preload-n", "2000", *place, speed, "--screw"
        bare, sealed = (answer(capsys, *words, file)[0] for file in (source, screw))
        parts = {k: part for k in ("friction_torque_nm", "torque_low_nm", "torque_high_nm") if k in bare}
        parts |= {"breakaway_torque_nm": 0.05} if speed == 0 else {}
        for key, value in parts.items():
            assert sealed[key] - bare[key] == pytest.approx(value, rel=1e-9)
        assert sealed.pop("seal_torque_nm", 0.0) == part
        differ = {*parts, "map_hash"}
        alike = [{key: one[key] for key in one.keys() - differ} for one in (sealed, bare)]
        assert alike[0] == alike[1]
    found, _ = answer(capsys, "torque", "--preload-n", "2000", *place, 1000, "--screw", screw)
    torque = found["friction_torque_nm"]
    found, _ = answer(capsys, "preload", "--torque-nm", torque, *place, 1000, "--screw", screw)
    assert found["preload_n"] == pytest.approx(2000.0, rel=1e-6)
    if friction == "mechanistic":
        words = "calibrate", "--preload-n", 2000, *place, 1000, "--torque-nm"
        first, second = (
            next(iter(answer(capsys, *words, nm, "--screw", file)[0].values()))["net_sliding_coefficient"]
            for nm, file in ((torque - 0.05, source), (torque, screw))
        )
        assert first == pytest.approx(second, rel=1e-9)
        assert "seal_torque" in refused(capsys, *words, 0.04, "--screw", screw)


@pytest.mark.parametrize("friction", ["three_parameter", "mechanistic"])
def test_torque_is_that_of_the_map_and_opposes_the_motion(capsys, friction):
    words = "torque", *POINT, "--axial-load-n", "-300", "--friction", friction
    parameters = LAW if friction == "mechanistic" else GD4008
    nut_map, friction_set = load_map(None, parameters), default_friction_set(parameters)
    state = nut_map.evaluate(*SI, -300.0)
    found, err = answer(capsys, *words)
    assert err == ""
    for key, name in PARTS.items():
        assert found[key] == pytest.approx(float(getattr(state, name)), rel=1e-12)
    back, _ = answer(capsys, *words, "--speed-rpm", "-1e3")
    for key in PARTS:
        assert back[key] == -found[key]
    if friction == "mechanistic":
        interval = map_interval(parameters, nut_map.header["axes"], friction_set, *SI, -300.0)
        torque = found["friction_torque_nm"]
        ends = [share * torque for share in interval.relative]
        assert [found["torque_low_nm"], found["torque_high_nm"]] == pytest.approx(ends, rel=1e-12)
        assert ends[0] < torque < ends[1]
        assert [-back["torque_high_nm"], -back["torque_low_nm"]] == pytest.approx(ends, rel=1e-12)


@pytest.mark.parametrize("friction", ["three_parameter", "mechanistic"])
def test_at_rest_and_without_load(capsys, friction):
    words = "torque", *POINT[:2], *POINT[4:], "--friction", friction, "--speed-rpm"
    found, err = answer(capsys, *words, "0")
    state = load_map(None, LAW if friction == "mechanistic" else GD4008).evaluate(2000.0, 0.0, SI[2])
    assert found["friction_torque_nm"] == 0.0
    assert found["breakaway_torque_nm"] == pytest.approx(float(state.coulomb_torque), rel=1e-9)
    assert "breakaway_torque_nm" in err
    assert found.get("torque_low_nm", 0.0) == found.get("torque_high_nm", 0.0) == 0.0
    free, _ = answer(capsys, *words, "300", "--preload-n", "0")
    assert (free["friction_torque_nm"], free["catalogue_torque_nm"]) == (0.0, 0.0)
    assert "torque_low_nm" not in free
    held, _ = answer(capsys, *words, "300", "--preload-n", "0", "--axial-load-n", "3000")
    assert held["catalogue_note"].startswith("of the preload alone")
    assert (held["in_range"], "torque_low_nm" in held) == (True, friction == "mechanistic")


OUTSIDE = (
    (("--preload-n", "5e9"), "preload", "preload_n 5e+09 is outside the map"),
    (("--preload-n", "50"), "preload", "the numbers are extrapolated from its lowest preload"),
    (("--speed-rpm", "90000"), "speed", "speed_rpm 90000 is outside"),
    (("--temperature-c", "120"), "temperature", "temperature_c 120 is outside"),
)


def test_outside_the_map_is_flagged_and_said_once(capsys):
    for change, clamped, note in OUTSIDE:
        found, err = answer(capsys, "torque", *POINT, *change)
        assert (found["in_range"], found["clamped"], err.count("\n")) == (False, [clamped], 1)
        assert note in err
        # the torque of the edge does not stand beside a catalogue torque at another preload
        assert ("catalogue_torque_nm" in found) == (found["preload_n"] <= 12000.0)


def test_a_warmer_screw_has_another_preload(capsys):
    cold, _ = answer(capsys, "torque", *POINT)
    same, _ = answer(capsys, "torque", *POINT, "--temperature-difference-k", "0")
    warm, _ = answer(capsys, "torque", *POINT, "--temperature-difference-k", "-5")
    assert same == cold
    assert warm["preload_actual_n"] == pytest.approx(2160.54, abs=0.01)
    other, _ = answer(capsys, "torque", "--preload-n", repr(warm["preload_actual_n"]), *POINT[2:])
    for key in ("friction_torque_nm", "film_thickness_min_m", "ball_load_max_n"):
        assert warm[key] == other[key]


def test_preload_inverts_torque(capsys):
    place = "--speed-rpm", "-140", "--temperature-c", "41"
    torque, _ = answer(capsys, "torque", "--preload-n", "3210", *place)
    magnitude = repr(abs(torque["friction_torque_nm"]))
    found, _ = answer(capsys, "preload", "--torque-nm", magnitude, *place)
    assert found["preload_n"] == pytest.approx(3210.0, rel=1e-9)
    lowest = load_map(None, GD4008).header["axes"]["preload"][0]
    least, _ = answer(capsys, "torque", "--preload-n", lowest, *place)
    low = repr(0.9 * abs(least["friction_torque_nm"]))
    below, _ = answer(capsys, "preload", "--torque-nm", low, *place)
    assert 0.0 < below["preload_n"] < lowest
    assert below["in_range"] is False


def test_one_torque_calibrates_and_the_preload_behind_it_has_an_interval(capsys, tmp_path):
    place, path = ("--speed-rpm", "100", "--temperature-c", "30"), tmp_path / "friction.toml"
    words = "calibrate", "--torque-nm", "0.9", "--preload-n", "2000", *place
    assert run(capsys, *words, "--map", packaged_map(VG100), "--output", path)[0] == 0
    widths = []
    for friction in (MECHANISTIC, ("--friction", path)):
        found, _ = answer(capsys, "preload", "--torque-nm", "0.9", *place, *friction)
        low, high = found["preload_low_n"], found["preload_high_n"]
        assert low < found["preload_n"] < high
        widths.append(high / low)
        for preload, key in ((low, "torque_high_nm"), (high, "torque_low_nm")):
            torque, _ = answer(capsys, "torque", "--preload-n", preload, *place, *friction)
            assert torque[key] == pytest.approx(0.9, rel=2e-3)
    # contacts by the atlas and by the map of the nut: its errors
    assert found["preload_n"] == pytest.approx(2000.0, rel=1e-3)
    assert widths[1] < widths[0]
    cut, err = answer(capsys, "preload", "--torque-nm", "4.5", *place, *MECHANISTIC)
    highest = load_map(None, LAW).header["axes"]["preload"][1]
    assert (cut["preload_high_n"], cut["preload_at_edge"]) == (highest, ["high"])
    assert "preload_at_edge: preload_high_n at 100 r/min and 30 C" in err


def test_points_may_have_units_decimal_commas_and_gaps_that_options_fill(capsys, tmp_path):
    path = tmp_path / "points.csv"
    head = "# comment\npreload [kN];Speed [rad/s];temperature [K];axial_load_n;who"
    path.write_text(f"{head}\n2,0;104,719755;303,15;;me\n")
    (found,), err = answer(capsys, "torque", "--points", path, "--axial-load-n", "7")
    single, _ = answer(capsys, "torque", *POINT, "--axial-load-n", "7")
    assert err == f"{path}: columns not used: who\n"
    for key in ("preload_n", "speed_rpm", "temperature_c", "axial_load_n", "friction_torque_nm"):
        assert found[key] == pytest.approx(single[key], rel=1e-7), key


def test_screw_agrees_with_itself_the_loads_and_torque(capsys, tmp_path):
    loaded = "--preload-n", "2000", "--axial-load-n", "1500"
    found, _ = answer(capsys, "screw", *loaded, "--speed-rpm", "-1000", "--temperature-c", "30")
    screw = GD4008.screw
    loads = double_nut_loads(screw, 2000.0, 1500.0, screw.loaded_ball_count)
    larger, smaller = found["nut_force_a_n"], found["nut_force_b_n"]
    assert larger - smaller == pytest.approx(1500.0, abs=1e-6)
    assert found["static_safety"] == pytest.approx(found["static_load_rating_n"] / larger, rel=1e-12)
    assert found["ball_load_max_n"] == pytest.approx(float(loads.Q_b.max()), rel=1e-12)
    assert found["life_hours"] == pytest.approx(found["life_turns"] / 60e3, rel=1e-12)
    pulled, _ = answer(capsys, "screw", "--preload-n", "2000", "--axial-load-n", "-1500")
    largest = max(pulled["nut_force_a_n"], pulled["nut_force_b_n"])
    assert pulled["static_safety"] == pytest.approx(pulled["static_load_rating_n"] / largest, rel=1e-12)
    torque, _ = answer(capsys, "torque", *loaded, "--speed-rpm", "1000", "--temperature-c", "30")
    friction, useful = torque["friction_torque_nm"], 1500.0 * screw.lead / (2.0 * math.pi)
    assert found["friction_torque_nm"] == pytest.approx(friction, rel=1e-12)
    assert found["efficiency"] == pytest.approx(useful / (useful + friction), rel=1e-12)
    assert found["efficiency_backdriving"] == pytest.approx(1.0 - friction / useful, rel=1e-12)
    assert "efficiency" not in pulled
    # a column of preloads takes the place of the default
    points = tmp_path / "points.csv"
    points.write_text("axial_load_n,preload [kN]\n-1500,2\n")
    assert answer(capsys, "screw", "--points", points)[0] == [pulled]


def test_file_of_a_fit_and_another_screw(capsys, tmp_path):
    path = tmp_path / "friction.toml"
    own = dataclasses.replace(default_friction_set(LAW), net_sliding_coefficient=0.0142, screw="mine")
    write_friction_sets(path, [own])
    found, err = answer(capsys, "torque", *POINT, "--friction", path)
    assert (found["friction_screw"], err) == ("mine", "")
    packaged, _ = answer(capsys, "torque", *POINT, *MECHANISTIC)
    assert found["sliding_torque_nm"] / packaged["sliding_torque_nm"] > 1.05
    words = "--torque-nm", found["friction_torque_nm"], *POINT[2:], "--friction", path
    inverse, _ = answer(capsys, "preload", *words)
    assert inverse["preload_n"] == pytest.approx(2000.0, rel=1e-9)
    screw = tmp_path / "own.toml"
    text = (PACKAGED_DATA / "gd4008.toml").read_text(encoding="utf-8")
    screw.write_text(text.replace('law = "three', 'net_sliding_coefficient = 0.0\nlaw = "three'))
    assert answer(capsys, "torque", *POINT, "--screw", screw)[0]["sliding_torque_nm"] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("friction", ["three_parameter", "mechanistic"])
def test_direct_solve_agrees_with_the_map(capsys, friction):
    """Bounds: the largest errors of the certificate of the map, and of direct solves, whose grid is coarser."""
    words = "torque", *POINT, "--friction", friction
    parameters = LAW if friction == "mechanistic" else GD4008
    certificate = load_map(None, parameters).header["certificate"]
    coarser = certificate.get("of_direct_solves", {})
    by_map, _ = answer(capsys, *words)
    direct, _ = answer(capsys, *words, "--direct")
    for keys, error in (
        (("friction_torque_nm",), certificate["torque_error_max"] + coarser.get("torque_error_max", 0.0)),
        (("film_thickness_central_screw_m", "film_thickness_central_nut_m"), certificate["film_error_max"]),
        (("contact_pressure_max_pa", "ball_load_max_n"), 1e-3),
    ):
        for key in keys:
            assert direct[key] == pytest.approx(by_map[key], rel=error), key
    rise = direct["film_temperature_rise_k"]
    error = certificate["temperature_rise_error_max"] * max(rise, 10.0)
    assert by_map["film_temperature_rise_k"] == pytest.approx(rise, abs=error)
    if friction == "mechanistic":
        assert direct["torque_low_nm"] == pytest.approx(by_map["torque_low_nm"], rel=0.02)


@pytest.mark.parametrize("words", [("torque", *POINT), ("preload", "--torque-nm", "0.8", *POINT[2:])])
def test_quick_commands_import_nothing_slow(words):
    code = (
        "import sys, contextlib\nfrom ballscrew_tehl.applications.cli.main import main\n"
        "with contextlib.suppress(SystemExit): main(sys.argv[1:])\n"
        "slow = 'numba scipy.optimize pandas matplotlib rich jinja2'.split()\n"
        "assert not set(slow) & set(sys.modules), set(slow) & set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_choices_of_the_parser_are_those_of_the_modules():
    """The parser repeats names so that it does not import the modules that define them."""
    for own, place in (
        (parser.DROP_KINDS, "applications.calibration.measured.DROPS"),
        (parser.NUT_KINDS, "physics.rating.CATALOGUE_SHARE"),
        (parser.LUBRICANTS, "parameters.template.LUBRICANTS"), (parser.LAWS, "contact.moes.LAWS"),
        (parser.EXPORT_FORMATS, "applications.export.files.SUFFIXES"),
    ):  # fmt: skip
        assert set(own) == set(resolve_name(f"ballscrew_tehl.{place}")), place
