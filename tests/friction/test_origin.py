"""Where friction numbers were measured: the note for other screws, sets of a screw, overrides of a file."""

import dataclasses

import pytest
from reference_screw import GD4008

from ballscrew_tehl.friction.origin import (
    carried_over,
    other_sets,
    refuse_other_fit,
    with_set,
    without_overrides,
)
from ballscrew_tehl.friction.sets import default_friction_set, load_friction_sets
from ballscrew_tehl.parameters.file import changed, graded_oil, load_parameters
from ballscrew_tehl.parameters.packaged_data import PACKAGED_DATA
from ballscrew_tehl.runtime.packed import MapError

LAW = load_parameters(PACKAGED_DATA / "gd4008_vg100.toml")
OTHER = load_parameters(PACKAGED_DATA / "example_25x10.toml")


def test_no_note_on_the_screw_of_the_measurement():
    for parameters in [GD4008, LAW, changed(GD4008, friction={"set": "two_parameter"})]:
        assert carried_over(default_friction_set(parameters), parameters) == ""


def test_another_screw_or_oil_is_named():
    for parameters in [
        OTHER,
        GD4008.model_copy(update={"lubricant": graded_oil(68, 95.0)}),
    ]:
        note = carried_over(default_friction_set(parameters), parameters)
        assert "measured on GD4008-3, not on " + parameters.name in note
        assert "JIS B 1192 / ISO 3408-3" in note
        assert "\n" not in note


def test_numbers_of_the_screw_file_are_those_of_its_user():
    for friction in [
        {"net_sliding_coefficient": 0.01},
        {"ball_thrust": 1.2},
    ]:
        parameters = changed(OTHER, friction=friction)
        assert carried_over(default_friction_set(parameters), parameters) == ""


def test_other_sets_were_measured_on_the_same_screw():
    chosen = default_friction_set(GD4008)
    assert [entry.name for entry in other_sets(chosen, GD4008)] == ["two_parameter"]
    assert other_sets(default_friction_set(OTHER), OTHER) == []


def test_overrides_belong_to_the_set_of_the_file():
    stated = changed(GD4008, friction={"apparent_viscosity_ratio": 7.0, "roughness_height": 2e-8})
    assert with_set(stated, "three_parameter") is stated
    other = with_set(stated, "two_parameter").friction
    assert (other.set, other.apparent_viscosity_ratio, other.roughness_height) == (
        "two_parameter",
        None,
        None,
    )
    assert without_overrides(GD4008, "three_parameter") is GD4008
    surfaces = changed(GD4008, friction={"raceway_rq": 3e-8, "ball_rq": 4e-8})
    assert with_set(surfaces, "two_parameter").friction.roughness_height == pytest.approx(5e-8, rel=1e-12)


def test_fit_to_another_screw_or_kinematics_is_refused():
    entry = load_friction_sets()["published", "three_parameter"]
    refuse_other_fit(entry, GD4008)
    refuse_other_fit(dataclasses.replace(entry, parameters_hash=""), GD4008)
    with pytest.raises(
        MapError, match=r"three_parameter is fitted for the screw GD4008-3 \(.*expected GD4008-3"
    ):
        refuse_other_fit(entry, GD4008.model_copy(update={"lubricant": graded_oil(68, 95.0)}))
    with pytest.raises(MapError, match="kinematics = published; expected rolling_frame"):
        refuse_other_fit(entry, OTHER)
