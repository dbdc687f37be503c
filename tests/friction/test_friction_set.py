"""Friction sets: file, selection by law, overrides, numbers of another screw, when a fit counts."""

import dataclasses
import math

import pytest
from reference_screw import GD4008

from ballscrew_tehl.applications.calibration.written_sets import write_friction_sets
from ballscrew_tehl.friction.interval import is_fitted
from ballscrew_tehl.friction.mechanistic import law_constants
from ballscrew_tehl.friction.sets import (
    FITTED,
    FrictionSet,
    carried_over,
    default_friction_set,
    load_friction_sets,
    refuse_other_fit,
    with_law,
    without_overrides,
)
from ballscrew_tehl.parameters.file import PACKAGED_DATA, PACKAGED_VG100, Law, changed, graded_oil, load_screw
from ballscrew_tehl.runtime.packed import MapError

LAW = load_screw(PACKAGED_VG100)
OTHER = load_screw(PACKAGED_DATA / "example_25x10.toml")
OTHER_OIL = GD4008.model_copy(update={"lubricant": graded_oil(68, 95.0)})

FULL = FrictionSet(
    Law.THREE_PARAMETER, 7.5, 0.005, 25e-9,
    loss="least_squares",
    provenance="somewhere, 11 points",
    intervals={"apparent_viscosity_ratio": 0.5, "net_sliding_coefficient": 7e-4, "roughness_height": math.inf},
    errors={"mean": 0.012, "leave_one_out_mean": 0.02},
    leave_one_table_out={"table2": {"mean": 0.1, "max": 0.2}},
    limits={"net_sliding_coefficient": {"low": 4e-3, "high": 6e-3}, "roughness_height": {"low": 0.0, "high": math.inf}},
    not_identified={"split into \"two\"": "back\\slash, 95 %"},
    screw="mine",
    parameters_hash="0123456789ab",
)  # fmt: skip


def test_a_set_is_the_same_after_writing_and_reading(tmp_path):
    path = tmp_path / "sets.toml"
    bare = FrictionSet(Law.MECHANISTIC, 1.0, 0.004)
    write_friction_sets(path, [FULL, bare], "first line\nsecond line")
    found = {entry.law: entry for entry in (FULL, bare)}
    assert load_friction_sets(path) == found
    text = path.read_text()
    assert text.startswith("# first line\n# second line\n")
    path.write_text(text.replace("[mechanistic", "[rolling_frame.mechanistic"))
    with pytest.raises(
        ValueError, match=r"sets.toml: \[rolling_frame\] is no friction law; .* calibrate again"
    ):
        load_friction_sets(path)
    # the file carries the unit of the roughness height in the key
    assert "roughness_height_m = 2.5e-08" in text


def test_overrides_belong_to_the_set_of_the_file_and_drop_the_data_of_the_fit():
    packaged = load_friction_sets()[Law.THREE_PARAMETER]
    found = default_friction_set(
        changed(GD4008, friction={"net_sliding_coefficient": 0.0, "roughness_height": 1e-9})
    )
    assert found.values == (packaged.apparent_viscosity_ratio, 0.0, 1e-9)
    assert found.provenance.endswith(
        "overridden in the screw file: net_sliding_coefficient, roughness_height"
    )
    assert {*found.intervals, *found.errors, *found.limits} == set()
    stated = changed(GD4008, friction={"apparent_viscosity_ratio": 7.0, "roughness_height": 2e-8})
    assert with_law(stated, "three_parameter") is stated
    other = with_law(stated, "mechanistic").friction
    numbers = other.law, other.apparent_viscosity_ratio, other.roughness_height
    assert numbers == ("mechanistic", None, None)
    surfaces = changed(GD4008, friction={"raceway_rq": 3e-8, "ball_rq": 4e-8})
    assert with_law(surfaces, "mechanistic").friction.roughness_height == pytest.approx(5e-8, rel=1e-12)
    # nor is a roughness of surfaces a fitted height
    rough = changed(GD4008, friction={"law": "mechanistic", "roughness_height": 1e-6})
    assert with_law(rough, "three_parameter").friction.roughness_height is None
    # with the mechanistic law the height of the file is that of its surfaces
    rough = changed(LAW, friction={"roughness_height": 1e-6, "net_sliding_coefficient": 0.01})
    kept = without_overrides(rough, "mechanistic").friction
    assert (kept.roughness_height, kept.net_sliding_coefficient) == (1e-6, None)
    assert without_overrides(rough, "three_parameter").friction.roughness_height is None


def test_numbers_of_another_screw_are_named_and_their_fit_is_refused():
    for parameters in (GD4008, LAW):
        assert carried_over(default_friction_set(parameters), parameters) == ""
    for own in ({"net_sliding_coefficient": 0.01}, {"ball_thrust": 1.2}):
        parameters = changed(OTHER, friction=own)
        assert carried_over(default_friction_set(parameters), parameters) == ""
    for parameters in (OTHER, OTHER_OIL):
        note = carried_over(default_friction_set(parameters), parameters)
        assert "measured on GD4008-3, not on " + parameters.name in note
        assert "JIS B 1192" in note
    entry = load_friction_sets()[Law.THREE_PARAMETER]
    refuse_other_fit(entry, GD4008)
    refuse_other_fit(dataclasses.replace(entry, parameters_hash=""), GD4008)
    with pytest.raises(MapError, match=r"fitted for the screw GD4008-3 \(.*expected GD4008-3"):
        refuse_other_fit(entry, OTHER_OIL)
    with pytest.raises(MapError, match="law three_parameter; expected mechanistic"):
        refuse_other_fit(entry, OTHER)
    with pytest.raises(
        ValueError, match=r"law = three_parameter; allowed: mechanistic: .* no table published_speeds"
    ):
        with_law(OTHER, "three_parameter")


def test_no_constant_of_the_law_is_left_out_of_maps_and_fits():
    """Else a map answers as with the default, and a fit counts for constants that it was not made with."""
    fitted, composite = {*FITTED[:2], "law"}, {"raceway_rq", "ball_rq"}
    names = set(type(LAW.friction).model_fields) - fitted - composite | {"eyring_stress"}
    assert set(law_constants(LAW)) == names
    assert is_fitted(load_friction_sets()[Law.MECHANISTIC], LAW)
