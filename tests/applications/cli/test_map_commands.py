"""The command `map build`: its range, what it says, a family of screws; screws without a map and outside the atlas."""

import pytest
from command_line import answer, refused, run
from synthetic_contacts import GRID, LAW

from ballscrew_tehl.atlas.contact_atlas import load_atlas
from ballscrew_tehl.nut_map import grid as limits
from ballscrew_tehl.nut_map.grid import map_grid
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters.file import PACKAGED_DATA, PACKAGED_VG100
from ballscrew_tehl.parameters.identity import map_parameters_json
from ballscrew_tehl.parameters.units import CELSIUS, RPM

SCREW = PACKAGED_VG100.read_text(encoding="utf-8")
POINT = ("--preload-n", "2000", "--speed-rpm", "300", "--temperature-c", "30")
TABLE = "preload_min_N = 300.0\npreload_max_N = 9000.0\nspeed_min_rpm = 50.0\nspeed_max_rpm = 800.0"


@pytest.fixture(autouse=True)
def few_nodes(monkeypatch):
    """Few nodes; the range is that of the command."""
    monkeypatch.setattr(limits, "MapGrid", lambda: GRID)


def screw_file(path, *tables, old="", new=""):
    assert old in SCREW
    path.write_text("\n".join([SCREW.replace(old, new, 1), *tables]), encoding="utf-8")
    return path


def ends(nut_map, name):
    return pytest.approx(nut_map.header["axes"][name][:2], rel=1e-12)


def test_range_of_the_screw_its_table_and_the_options(tmp_path, capsys):
    path = tmp_path / "a" / "map.npz"
    code, out, err = run(capsys, "map", "build", "--screw", PACKAGED_VG100, "--output", path)
    assert code == 0
    assert out.endswith(f"ballscrew build --map {path} --output {path.with_name('map_fmus')}\n")
    said = "law mechanistic: preload 120 to 12000 N (up to 2.1 GPa), speed 5 to 6000 r/min"
    assert f"GD4008-3, {said}" in err
    whole, grid = load_map(path, LAW), map_grid(LAW)
    for name in ("preload", "speed", "temperature"):
        assert getattr(grid, name)[:2] == ends(whole, name), name
    screw = screw_file(tmp_path / "own.toml", "[map]", TABLE)
    words = "--screw", screw, "--output", path, "--speed-rpm", "100", "1000", "--temperature-c", "20", "40"
    said, _ = answer(capsys, "map", "build", *words)
    own = load_map(path, LAW)
    assert ends(own, "preload") == (300.0, 9000.0)
    assert ends(own, "speed") == (100.0 * RPM, 1000.0 * RPM)
    assert ends(own, "temperature") == (20.0 + CELSIUS, 40.0 + CELSIUS)
    # another range belongs to the same screw
    assert own.header["parameters_json"] == map_parameters_json(LAW)
    assert (said["file"], said["file_hash"]) == (str(path), own.header["file_hash"])
    assert said["atlas_fraction"] == own.header["atlas_fraction"]
    assert said["torque_error_max"] == load_atlas().header["certificate"]["torque_error_max"]


def test_family_gets_a_map_for_every_screw(tmp_path, capsys):
    for name in "ab":
        screw_file(tmp_path / f"{name}.toml")
    found, _ = answer(capsys, "map", "build", "--family", tmp_path)
    assert [one["file"] for one in found] == [str(tmp_path / name) for name in ("a.npz", "b.npz")]
    assert load_map(tmp_path / "a.npz").header == load_map(tmp_path / "b.npz").header
    assert run(capsys, "map", "build", "--family", tmp_path, "--output", tmp_path / "maps")[0] == 0
    assert sorted(path.name for path in (tmp_path / "maps").iterdir()) == ["a.npz", "b.npz"]


def test_a_screw_without_a_map_answers_as_with_one(tmp_path, capsys):
    screw = screw_file(tmp_path / "own.toml", old="lead_mm = 8.0", new="lead_mm = 10.0")
    path = tmp_path / "own.npz"
    screw.write_text(screw.read_text().replace("lead_angle", "# lead_angle"))
    assert run(capsys, "map", "build", "--screw", screw, "--output", path)[0] == 0
    for words in (("torque", *POINT), ("preload", "--torque-nm", "0.8", *POINT[2:])):
        found, _ = answer(capsys, *words, "--screw", screw)
        assert found == answer(capsys, *words, "--map", path)[0]
        assert found["torque_low_nm" if words[0] == "torque" else "preload_low_n"] > 0.0


def test_a_screw_outside_the_atlas_is_refused_with_its_number(tmp_path, capsys):
    wide = ("screw_raceway_radius_mm = 2.477", "screw_raceway_radius_mm = 7.0")
    screw = screw_file(tmp_path / "own.toml", old=wide[0], new=wide[1])
    for command in (("map", "build", "--output", tmp_path / "x.npz"), ("torque", *POINT)):
        line = refused(capsys, *command, "--screw", screw)
        assert "radius_ratio = " in line
        assert "the groove over the ball" in line
        assert line.endswith("remedy: ballscrew torque --direct, which solves the contacts")
    assert [path.name for path in tmp_path.iterdir()] == ["own.toml"]
    # the law of the paper is that of the packaged screw alone
    other = PACKAGED_DATA.joinpath("gd4008.toml").read_text(encoding="utf-8")
    screw.write_text(other.replace("ball_diameter_mm = 4.763", "ball_diameter_mm = 4.7"), encoding="utf-8")
    line = refused(capsys, "torque", *POINT, "--screw", screw)
    assert "law = three_parameter; the atlas holds contacts of mechanistic" in line
