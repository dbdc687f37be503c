"""The screw file that `init` writes is complete, commented and gives the same screw when read."""

import math

import pytest
from reference_screw import GD4008

from ballscrew_tehl.cli import main as cli
from ballscrew_tehl.parameters.file import TABLES, changed, load_parameters
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
    for parameters in [example_parameters(), example_parameters("iso_vg"), GD4008, OWN, flooded]:
        path = tmp_path / "screw.toml"
        path.write_text(screw_template(parameters))
        assert_same(load_parameters(path), parameters)


def test_init_writes_a_grease(tmp_path):
    """Base oil by its grade; NLGI grade stated; the map depends on the oil only."""
    path = tmp_path / "greased.toml"
    assert cli.main(["init", str(path), "--lubricant", "grease"]) == 0
    greased, oiled = load_parameters(path), example_parameters("iso_vg")
    assert_same(greased, example_parameters(lubricant="grease"))
    assert (greased.lubricant.nlgi, oiled.lubricant.nlgi) == ("2", None)
    assert "thickener are not modelled" in path.read_text()
    assert parameters_hash(greased) == parameters_hash(oiled)


def test_init_never_replaces_a_file(tmp_path, capsys):
    path = tmp_path / "mine.toml"
    path.write_text("name = 'filled in'")
    assert cli.main(["init", str(path)]) == 2
    assert "exists already" in capsys.readouterr().err
    assert path.read_text() == "name = 'filled in'"
