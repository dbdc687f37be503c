"""The budget of an axis: parts by hand, their sum, the weight of an inclined axis; the tables of the screw file."""

import math
import re

import pytest
from command_line import answer, refused, run

from ballscrew_tehl.applications.axis.parts import STANDARD_GRAVITY, guide_force
from ballscrew_tehl.parameters.file import AXIS_TABLES, changed, load_screw
from ballscrew_tehl.parameters.identity import parameters_hash
from ballscrew_tehl.parameters.template import AXIS_EXAMPLE, example_parameters, screw_template

pytestmark = pytest.mark.slow
TABLES = """
[guide]
carriages = 4
seal_resistance_N = 11.8
friction_coefficient = [0.002, 0.003]
preload_N = 2200
viscous_Ns_m = 30
[wipers]
friction_torque_Nm = [0.1, 0.3]
[motor]
friction_torque_Nm = 0.15
ratio = 2
[axis]
moved_mass_kg = 100
inclination_deg = 30
"""
POINT = "--preload-n", "800", "--speed-rpm", "500", "--temperature-c", "30"


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("axis") / "axis.toml"
    path.write_text(screw_template(example_parameters()) + TABLES)
    return path


def test_parts_of_an_inclined_axis(file, capsys):
    found, _ = answer(capsys, "axis", file, *POINT)
    weight = 100.0 * STANDARD_GRAVITY
    lever = load_screw(file).screw.lead / (2.0 * math.pi)
    normal = weight * math.cos(math.radians(30.0)) + 4 * 2200.0
    viscous = 30.0 * lever * 500.0 * math.pi / 30.0
    force = 4 * 11.8 + 0.0025 * normal + viscous
    # of the nut: as the command torque under the weight along the axis
    load = weight * math.sin(math.radians(30.0))
    nut, _ = answer(capsys, "torque", "--screw", file, *POINT, "--axial-load-n", repr(load))
    expected = {
        "nut": nut["friction_torque_nm"], "guide": lever * force, "wipers": 0.2, "motor": 2 * 0.15,
    }  # fmt: skip
    assert found["parts"] == pytest.approx(expected, rel=1e-9)
    assert (found["parts_low"]["wipers"], found["parts_high"]["wipers"]) == (0.1, 0.3)
    assert abs(sum(found["parts"].values()) / found["friction_torque_nm"] - 1.0) <= 1e-12
    assert abs(sum(found["power_w"].values()) / found["power_loss_w"] - 1.0) <= 1e-12
    above = [found["parts_high"][name] - value for name, value in found["parts"].items()]
    assert found["torque_high_nm"] == pytest.approx(
        found["friction_torque_nm"] + math.hypot(*above), rel=1e-9
    )
    for end in ("low", "high"):
        assert found[f"parts_{end}"]["nut"] == pytest.approx(nut[f"torque_{end}_nm"], rel=1e-3)
    useful = load * lever
    assert found["efficiency"] == pytest.approx(useful / (useful + found["friction_torque_nm"]), rel=1e-9)
    assert found["not_stated"] == ["support_bearings"]


def test_other_direction_text_and_picture(file, capsys, tmp_path):
    ahead, _ = answer(capsys, "axis", file, *POINT)
    back, _ = answer(capsys, "axis", file, *POINT[:3], "-500", *POINT[4:])
    for key, other in (("friction_torque_nm",) * 2, ("torque_low_nm", "torque_high_nm")):
        assert back[key] == -ahead[other]
    assert back["parts_low"]["guide"] == -ahead["parts_high"]["guide"]
    code, out, _ = run(capsys, "axis", file, *POINT, "--plot", tmp_path / "axis.png")
    assert code == 0
    assert (tmp_path / "axis.png").stat().st_size > 10_000
    assert re.search(r"(?m)^sum +[\d.]+ +[\d.]+ to [\d.]+ +100%", out)


def test_interval_of_the_guide_by_its_parts():
    axis = {"moved_mass": 100.0}
    guide = {"seal_resistance": (10.0, 10.0), "friction_coefficient": (0.002, 0.004)}
    value, low, high = guide_force(changed(example_parameters(), guide=guide, axis=axis))
    weight = 100.0 * STANDARD_GRAVITY
    seals, rolling = 40.0, 0.003 * weight
    assert value == pytest.approx(seals + rolling, rel=1e-12)
    assert value - low == pytest.approx(math.hypot(seals / 3.0, rolling - 0.002 * weight), rel=1e-12)
    assert high - value == pytest.approx(math.hypot(seals / 2.0, 0.004 * weight - rolling), rel=1e-12)


def test_template_of_the_axis_is_read_when_it_is_uncommented(tmp_path, capsys):
    path = tmp_path / "axis.toml"
    assert run(capsys, "init", path, "--axis", "--diameter-mm", "32", "--lead-mm", "10")[0] == 0
    text, plain = path.read_text(), load_screw(path)
    assert all(getattr(plain, table) is None for table in AXIS_TABLES)
    path.write_text(re.sub(r"(?m)^#(?=\S)", "", text))
    stated = load_screw(path)
    for table, example in AXIS_EXAMPLE.items():
        own = getattr(stated, table)
        assert own == example
        assert own.model_fields_set == example.model_fields_set
    assert parameters_hash(stated) == parameters_hash(plain)


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("carriages = 4", "carriages = 0", "guide.carriages = 0; allowed: >= 1"),
        ("[0.002, 0.003]", "[0.003, 0.002]", "guide.friction_coefficient = [0.003, 0.002]; allowed: a number, or"),
        ("[0.002, 0.003]", '"low"', "guide.friction_coefficient = 'low'; allowed: a number, or [low, high]"),
        ("[0.1, 0.3]", "-0.1", "wipers.friction_torque_Nm = -0.1"),
        ("moved_mass_kg = 100", 'moved_mass_kg = 100\ndrive = "gantry"', "axis.drive = 'gantry'; allowed: 'rotating"),
        ("moved_mass_kg = 100", "", "axis.moved_mass_kg = (missing)"),
        ("[motor]", "[engine]", "[engine]"),
        ("[guide]", "[support_bearings]\nbore_mm = 30\nouter_diameter_mm = 62\n[guide]", "axial_stiffness"),
        ("[guide]", "[support_bearings]\nbore_mm = 62\nouter_diameter_mm = 30\npreload_N = 9\n[guide]", "the bore"),
    ],
)  # fmt: skip
def test_tables_that_are_refused(file, capsys, tmp_path, old, new, line):
    path, text = tmp_path / "bad.toml", file.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    assert line in refused(capsys, "axis", path, *POINT)


def test_wipers_are_stated_once(file, capsys, tmp_path):
    path = tmp_path / "twice.toml"
    path.write_text(re.sub(r"(?m)^#? *seal_torque_Nm.*$", "seal_torque_Nm = 0.1", file.read_text()))
    assert "screw.seal_torque = 0.1; allowed: no entry with a table wipers" in refused(capsys, "axis", path)
    assert "speed_rpm" in refused(capsys, "axis", file, "--speed-rpm", "0").replace("-", "_")


def test_budget_of_an_axis_of_catalogue_numbers(tmp_path, capsys):
    """ZKLN3572.2RS, four HSR35, 500 kg: rows of the bearings, their seals and the guide as found before, within 5 %."""
    path = tmp_path / "axis.toml"
    bearing = {"bore": 35e-3, "outer_diameter": 72e-3, "dynamic_rating": 45e3, "axial_stiffness": 900e6,
               "friction_torque": (0.6, 0.6), "seals": "contact"}  # fmt: skip
    guide = {"seal_resistance": (11.8, 11.8), "friction_coefficient": (0.002, 0.003), "preload": 2200.0}
    tables = {"support_bearings": bearing, "guide": guide, "axis": {"moved_mass": 500.0}}
    path.write_text(screw_template(changed(load_screw("gd4008_vg100.toml"), **tables)))
    rows = {10: 0.29, 100: 0.20, 1000: 0.38, 3000: 0.45}  # the last starves
    for rpm, torque in rows.items():
        found, _ = answer(capsys, "axis", path, "--speed-rpm", rpm, "--temperature-c", "30")
        assert found["parts"]["support_bearings"] == pytest.approx(torque, rel=0.05)
        assert found["parts"]["bearing_seals"] == pytest.approx(0.3, rel=1e-9)
        assert found["parts"]["guide"] == pytest.approx(0.26 * 8.0 / 20.0, rel=0.05)
        assert found["in_range"] == (rpm < 3000)
