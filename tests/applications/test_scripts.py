"""Functions for scripts refuse what the commands refuse, in one line each."""

import math
import time
from importlib import resources

import numpy as np
import pytest

from ballscrew_tehl.applications.catalogue import CatalogueSizes, catalogue_parameters
from ballscrew_tehl.applications.export.files import TableOptions
from ballscrew_tehl.applications.identification.axis_log import StatedAxis
from ballscrew_tehl.applications.report.data import report_data
from ballscrew_tehl.applications.screw_model import screw_model
from ballscrew_tehl.applications.torque_point import torque_at_point
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters.entries import changed_text
from ballscrew_tehl.parameters.file import load_screw

EXAMPLE = load_screw("example_25x10.toml")


@pytest.mark.parametrize(
    "stated",
    [{"cutoff_hz": 0.0}, {"ratio": math.nan}, {"ratio": 0.0}, {"lead_mm": 0}, {"bins": 10.5}, {"bins": -3},
     {"torque_constant_nm_a": 0.0}, {"temperature_c": "warm"}, {"preload_n": -1.0}, {"guide_force_n": (8.0, -1.0)},
     {"guide_force_n": (1.0, 2.0, 3.0)}],
)  # fmt: skip
def test_numbers_of_a_log_are_those_of_its_options(stated):
    name = f"--{next(iter(stated)).replace('_', '-')}"
    with pytest.raises(ValueError, match=f"^{name} = .*; allowed: "):
        StatedAxis(**stated).checked()


def test_a_number_without_its_error_is_exact():
    stated = StatedAxis(seal_torque_nm=np.float64(0.05), offset_nm=-0.1, guide_force_n=[80.0, 10.0]).checked()
    assert (stated.seal_torque_nm, stated.offset_nm, stated.guide_force_n) == (
        (0.05, 0.0),
        (-0.1, 0.0),
        (80.0, 10.0),
    )


@pytest.mark.parametrize(
    "stated",
    [{"torque_constant_nm_a": math.nan}, {"torque_constant_nm_a": -1.0}, {"torque_constant_nm_a": 0.0}, {"ratio": 0},
     {"current_unit_a": -1.0}, {"points": 1}, {"preload_n": ["much"]}, {"speed_rpm": math.inf}],
)  # fmt: skip
def test_numbers_of_a_table_are_those_of_its_options(stated):
    with pytest.raises(ValueError, match="; allowed: "):
        TableOptions(**stated).checked()


@pytest.mark.parametrize(
    "sizes",
    [{"lead_mm": 0.0}, {"starts": 0}, {"rating_n": 0.0}, {"turns": math.nan}, {"ball_mm": -3.0}],
)
def test_sizes_of_a_catalogue_are_positive(sizes):
    name, value = next(iter(sizes.items()))
    with pytest.raises(ValueError, match=f"{name} = {value}; allowed: "):
        catalogue_parameters(CatalogueSizes(**{"diameter_mm": 25.0, "lead_mm": 10.0, **sizes}), EXAMPLE)


def test_a_map_of_another_screw_is_refused():
    screw = screw_model("gd4008_vg100.toml")
    with pytest.raises(
        ValueError, match=r"this map is of .*; the screw is of .*: take the map of this screw"
    ):
        torque_at_point(screw, load_map(None, EXAMPLE), 1600.0, 104.7, 303.15)


def test_names_are_checked():
    with pytest.raises(ValueError, match="preload_n; allowed: preload, speed, temperature, in SI units"):
        report_data(EXAMPLE, None, load_map(None, EXAMPLE), {"preload_n": 1600.0})
    with pytest.raises(ValueError, match=r"\[nope\]; allowed: "):
        changed_text('name = "x"\n', "nope", "lead_mm", 1.0)


def test_a_long_line_of_a_screw_file_takes_no_time():
    text = (resources.files("ballscrew_tehl") / "data" / "example_25x10.toml").read_text(encoding="utf-8")
    text = text.replace("lead_mm = ", f"lead_mm ={' ' * 200_000}", 1)
    begin = time.process_time()
    assert "lead_mm = 12.0" in changed_text(text, "screw", "lead_mm", 12.0)
    # quadratic time would be minutes
    assert time.process_time() - begin <= 5.0
