"""The screw file that `init` writes is complete, commented and gives the same screw when read."""

import json

import pytest
from reference_screw import GD4008

from ballscrew_tehl.cli import main as cli
from ballscrew_tehl.parameters.file import TABLES, _dimensions, changed, load_parameters
from ballscrew_tehl.parameters.identity import map_parameters_json
from ballscrew_tehl.parameters.screw import Parameters
from ballscrew_tehl.parameters.template import example_parameters, screw_template
from ballscrew_tehl.parameters.toml import key_forms


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


@pytest.mark.parametrize(
    "parameters",
    [example_parameters(), example_parameters("iso_vg"), GD4008, OWN],
    ids=["example", "iso_vg", "gd4008", "own"],
)
def test_template_gives_the_same_screw_again(tmp_path, parameters):
    path = tmp_path / "screw.toml"
    path.write_text(screw_template(parameters))
    assert_same(load_parameters(path), parameters)


def test_every_field_is_explained_on_its_line():
    lines = screw_template(GD4008).splitlines()
    for table in TABLES:
        values = getattr(GD4008, table)
        for field, info in type(values).model_fields.items():
            starts = tuple(f"{key} =" for key in key_forms(field, _dimensions(type(values))[field]))
            found = [text for text in lines if text.removeprefix("# ").startswith(starts)]
            assert any(str(info.description) in text for text in found), field
    assert any("ball_diameter_mm = 4.763" in line and "> 0, <= 500" in line for line in lines)
    assert any("viscosity_law" in line and "astm_d341 | constant" in line for line in lines)
    assert any("preload_kind" in line and "double_nut | single_nut_offset" in line for line in lines)
    assert any("iso_vg =" in line and "46 | 68 | 100" in line for line in lines)
    assert any("raceway_rq_um =" in line and "<= 100" in line for line in lines)


@pytest.mark.parametrize("oil", ["viscosities", "iso_vg"])
@pytest.mark.parametrize("table", ["screw", "lubricant", "friction"])
def test_uncommented_defaults_change_nothing(tmp_path, table, oil):
    """The commented keys are valid: with their # away the file describes the same screw."""
    path = tmp_path / "screw.toml"
    parameters = example_parameters(oil)
    text, inside = [], False
    for line in screw_template(parameters).splitlines():
        inside = line == f"[{table}]" if line.startswith("[") else inside
        key, _, value = line.removeprefix("# ").partition("#")[0].partition("=")
        # derived values may not be given as well
        given = inside and line.startswith("# ") and value.strip() and key.strip() != "viscosity_Pas"
        text.append(line.removeprefix("# ") if given else line)
    path.write_text("\n".join(text))
    found, expected = getattr(load_parameters(path), table), getattr(parameters, table)
    assert len(found.model_fields_set) > len(expected.model_fields_set)
    for field in type(expected).model_fields:
        value = getattr(expected, field)
        assert getattr(found, field) == (
            pytest.approx(value, rel=1e-11) if isinstance(value, float) else value
        )


def test_values_derived_from_the_grade_are_not_written():
    lines = screw_template(example_parameters("iso_vg")).splitlines()
    oil = lines[lines.index("[lubricant]") : lines.index("[friction]")]
    given = [line.split(" =")[0] for line in oil if line and line[0] not in "#["]
    assert given == ["name", "iso_vg", "viscosity_index"]
    # values that follow from the grade alone are not written and not accepted
    assert not any("astm_" in line or "viscosity_law" in line or "viscosity_Pas" in line for line in oil)
    with pytest.raises(ValueError, match="allowed: viscosities, iso_vg"):
        example_parameters("iso")


def test_init_writes_the_requested_oil(tmp_path, capsys):
    path = tmp_path / "mine.toml"
    assert cli.main(["init", str(path), "--oil", "iso_vg"]) == 0
    assert_same(load_parameters(path), example_parameters("iso_vg"))
    assert "enter the values" in capsys.readouterr().out


def test_init_writes_a_grease(tmp_path):
    """Base oil by its grade; NLGI grade and the replenishment of a grease stated; the map depends on the oil only."""
    path = tmp_path / "greased.toml"
    assert cli.main(["init", str(path), "--lubricant", "grease"]) == 0
    greased, oiled = load_parameters(path), example_parameters("iso_vg")
    assert_same(greased, example_parameters(lubricant="grease"))
    assert (greased.lubricant.nlgi, oiled.lubricant.nlgi) == ("2", None)
    assert greased.friction.replenishment_constant == 6e-8
    assert "thickener are not modelled" in path.read_text()
    same_name = oiled.model_copy(
        update={"lubricant": oiled.lubricant.model_copy(update={"name": greased.lubricant.name})}
    )
    assert map_parameters_json(greased) == map_parameters_json(same_name)
    with pytest.raises(ValueError, match="allowed: oil, grease"):
        example_parameters(lubricant="wax")


def test_init_writes_a_file_but_never_replaces_one(tmp_path, capsys):
    path = tmp_path / "mine.toml"
    assert cli.main(["init", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"file": str(path)}
    assert_same(load_parameters(path), example_parameters())
    path.write_text("name = 'filled in'")
    assert cli.main(["init", str(path)]) == 2
    assert "exists already" in capsys.readouterr().err
    assert path.read_text() == "name = 'filled in'"
    assert cli.main(["init", str(tmp_path / "none" / "x.toml")]) == 2
    assert "no such folder; allowed: a new file *.toml in a folder that exists" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [path]
