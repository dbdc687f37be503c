"""The screw file that `init` writes is complete, commented and gives the same screw when read."""

import math

import pytest
from reference_screw import GD4008

from ballscrew_tehl.cli import main as cli
from ballscrew_tehl.parameters.file import TABLES, changed, load_screw
from ballscrew_tehl.parameters.identity import parameters_hash
from ballscrew_tehl.parameters.screw import Parameters
from ballscrew_tehl.parameters.template import example_parameters, screw_template


def assert_same(found: Parameters, expected: Parameters) -> None:
    assert found.name == expected.name
    for table in TABLES:
        ours, theirs = getattr(found, table), getattr(expected, table)
        assert (ours is None) == (theirs is None)
        if theirs is None:
            continue
        assert ours.model_fields_set == theirs.model_fields_set
        for field in type(theirs).model_fields:
            value = getattr(theirs, field)
            if isinstance(value, (float, tuple)):
                value = pytest.approx(value, rel=1e-11)
            assert getattr(ours, field) == value, field


#: a screw from the data of a data sheet
OWN = changed(
    example_parameters("iso_vg"),
    screw={"preload_kind": "single_nut_offset"},
    friction={"raceway_rq": 5e-8, "ball_rq": 1e-8},
)


def test_template_gives_the_same_screw_again(tmp_path):
    flooded = changed(GD4008, friction={"supply_length": math.inf})
    hybrid = changed(GD4008, screw={"ball_material": "silicon_nitride"})
    for parameters in [example_parameters(), example_parameters("iso_vg"), GD4008, OWN, flooded, hybrid]:
        path = tmp_path / "screw.toml"
        path.write_text(screw_template(parameters))
        assert_same(load_screw(path), parameters)


def test_init_writes_a_grease(tmp_path):
    path = tmp_path / "greased.toml"
    assert cli.main(["init", str(path), "--lubricant", "grease"]) == 0
    greased, oiled = load_screw(path), example_parameters("iso_vg")
    assert_same(greased, example_parameters(lubricant="grease"))
    assert (greased.lubricant.nlgi, oiled.lubricant.nlgi) == ("2", None)
    assert "thickener are not modelled" in path.read_text()
    assert parameters_hash(greased) == parameters_hash(oiled)


def test_init_fills_in_a_catalogue_screw(tmp_path, capsys):
    path = tmp_path / "mine.toml"
    sizes = ["--diameter-mm", "32", "--lead-mm", "10", "--turns", "2.5"]
    assert cli.main(["init", str(path), *sizes]) == 0
    screw, text = load_screw(path).screw, path.read_text()
    assert (screw.lead, screw.turns, screw.ball_diameter) == (0.010, 2.5, 6.35e-3)
    assert screw.loaded_ball_count == int(
        2.5 * math.hypot(2.0 * math.pi * screw.nominal_radius, 0.010) / 6.35e-3
    )
    for line in text.splitlines():
        if line.startswith(("lead_mm", "turns", "ball_diameter", "contact_angle", "screw_raceway")):
            assert ("# assumed: " in line) == (not line.startswith(("lead_mm", "turns"))), line
    for words, told in (
        (sizes[:2], "--lead-mm (missing)"),
        ((*sizes, "--ball-mm", "20"), "no screw has diameter_mm = 32.0, lead_mm = 10.0, ball_mm = 20.0"),
    ):
        assert cli.main(["init", str(tmp_path / "other.toml"), *words]) == 2
        assert told in capsys.readouterr().err
    assert cli.main(["init", str(path)]) == 2
    assert "exists already" in capsys.readouterr().err
    assert path.read_text() == text
