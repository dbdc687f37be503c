"""Friction sets: file, selection, overrides, refusals."""

import math

import pytest
from reference_screw import GD4008

from ballscrew_tehl.friction.sets import (
    SETS,
    FrictionSet,
    default_friction_set,
    load_friction_sets,
    write_friction_sets,
)
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.parameters.screw import LAW_SETS

FULL = FrictionSet(
    "three_parameter", "published", "hamrock_dowson", 7.5, 0.005, 25e-9,
    loss="least_squares",
    provenance="somewhere, 11 points",
    intervals={"apparent_viscosity_ratio": 0.5, "net_sliding_coefficient": 7e-4, "roughness_height": math.inf},
    correlations={"apparent_viscosity_ratio, net_sliding_coefficient": -0.87},
    errors={"mean": 0.012, "leave_one_out_mean": 0.02},
    leave_one_table_out={"table2": {"mean": 0.1, "max": 0.2}},
    other_losses={"least_squares": {"apparent_viscosity_ratio": 7.4, "roughness_height": 3e-8}},
    limits={"net_sliding_coefficient": {"low": 4e-3, "high": 6e-3}, "roughness_height": {"low": 0.0, "high": math.inf}},
    not_identified={"split into \"two\"": "back\\slash, 95 %"},
    screw="mine",
    parameters_hash="0123456789ab",
)  # fmt: skip


def test_a_set_is_the_same_after_writing_and_reading(tmp_path):
    path = tmp_path / "sets.toml"
    bare = FrictionSet("two_parameter", "published", "solved", 8.0, 0.004)
    sets = {("published", "three_parameter"): FULL, ("published", "two_parameter"): bare}
    write_friction_sets(path, sets, "first line\nsecond line")
    found = load_friction_sets(path)
    # the file carries the unit of the roughness height in the key
    expected = {"least_squares": {"apparent_viscosity_ratio": 7.4, "roughness_height_m": 3e-8}}
    assert found["published", "three_parameter"].other_losses == expected
    for key in sets:
        for name in ("values", "film_model", "loss", "provenance", "intervals", "correlations", "errors", "limits",
                     "not_identified", "screw", "parameters_hash"):  # fmt: skip
            assert getattr(found[key], name) == getattr(sets[key], name)
        assert found[key].leave_one_table_out == sets[key].leave_one_table_out
    text = path.read_text()
    assert text.startswith("# first line\n# second line\n")
    assert "roughness_height_m = 2.5e-08" in text
    write_friction_sets(path, dict(reversed(sets.items())), "first line\nsecond line")
    assert path.read_text() == text


def test_packaged_sets_are_complete():
    sets = load_friction_sets()
    assert set(sets) == {(kinematics, name) for kinematics, names in LAW_SETS.items() for name in names}
    for (_, name), entry in sets.items():
        assert set(entry.intervals) == set(SETS[name])
        assert len(entry.correlations) == {"mechanistic": 0, "two_parameter": 1, "three_parameter": 3}[name]
        assert set(entry.leave_one_table_out) == {"table2", "table4"}
        assert {"mean", "table2", "table4", "leave_one_out_mean", "leave_one_out_max"} <= set(entry.errors)
        assert "Tables 2 and 4, 11 distinct points" in entry.provenance
        assert entry.loss
        assert (entry.roughness_height > 0.0) == (name == "three_parameter")


def test_overrides_replace_values_and_drop_the_data_of_the_fit():
    found = default_friction_set(
        changed(GD4008, friction={"net_sliding_coefficient": 0.0, "roughness_height": 1e-9})
    )
    packaged = load_friction_sets()["published", "three_parameter"]
    assert found.values == (packaged.apparent_viscosity_ratio, 0.0, 1e-9)
    assert found.provenance == (
        "three_parameter, overridden in the screw file: net_sliding_coefficient, roughness_height"
    )
    assert not found.intervals
    assert not found.errors


def test_limits_that_are_none_are_refused_in_one_line(tmp_path):
    for low, high in [("nan", "0.02"), ("0.01", "nan"), ("inf", "inf"), ("0.02", "0.01")]:
        path = tmp_path / "sets.toml"
        write_friction_sets(path, {("published", "three_parameter"): FULL})
        text = path.read_text(encoding="utf-8")
        place = text.index("limits.net_sliding_coefficient]")
        numbers = (
            text[place:]
            .replace("low = 0.004", f"low = {low}", 1)
            .replace("high = 0.006", f"high = {high}", 1)
        )
        path.write_text(text[:place] + numbers, encoding="utf-8")
        with pytest.raises(
            ValueError, match=r"limits of net_sliding_coefficient = .* allowed: 0 <= low <= high"
        ) as refused:
            load_friction_sets(path)
        assert "\n" not in str(refused.value)
