"""Load ratings and life against their definitions."""

import math

from ballscrew_tehl.parameters.file import changed, load_screw
from ballscrew_tehl.physics.load import double_nut_loads
from ballscrew_tehl.physics.rating import STATIC_PRESSURE, ball_pressure, dynamic_rating, life, static_rating

SCREW = load_screw().screw


def test_static_rating_is_near_the_pressure_of_dents():
    """By Hertz and the loads of the whole nut without stretch of the bodies, which makes them equal: below ISO 76."""
    stiff = changed(load_screw(), screw={"screw_section_area": 10.0, "nut_section_area": 10.0}).screw
    loads = double_nut_loads(stiff, static_rating(stiff), 0.0, stiff.loaded_ball_count)
    assert 3.5e9 <= ball_pressure(stiff, float(loads.Q_a.max())) <= STATIC_PRESSURE


def test_static_rating_of_a_similar_screw():
    lengths = ("nominal_radius", "ball_diameter", "lead", "screw_raceway_radius", "nut_raceway_radius")
    larger = SCREW.model_copy(update={name: 2.0 * getattr(SCREW, name) for name in lengths})
    assert abs(static_rating(larger) / static_rating(SCREW) - 4.0) <= 1e-12


def test_life_of_one_nut_and_of_two():
    """1e6 turns at the rating, with the cube of the load; two nuts last less than one, by 2^-0.9."""
    rating = dynamic_rating(SCREW)
    for forces, turns in (
        ((rating, 0.0), 1e6), ((0.0, 0.5 * rating), 8e6), ((rating, rating), 1e6 * 2.0**-0.9),
    ):  # fmt: skip
        assert abs(life(SCREW, *forces) / turns - 1.0) <= 1e-12
    assert life(SCREW, 0.0, 0.0) == math.inf
