"""The contact of section 5.1: solved rows, extrapolation from three grids, the table."""

import numpy as np
import pytest
from reference_screw import GD4008

from ballscrew_tehl.validation import section5 as contact_validation
from ballscrew_tehl.validation.circle import circle_rows
from ballscrew_tehl.validation.section5 import (
    LAWS,
    REFINEMENT,
    extrapolated,
    section5_contacts,
    section5_text,
)


def test_limit_of_a_value_of_known_order():
    for order in [1.0, 2.0, 3.7]:
        values = [3.0 - 0.1 * REFINEMENT ** (-order * n) for n in range(3)]
        assert extrapolated(*values) == pytest.approx(3.0, rel=1e-12)
        assert extrapolated(*(-value for value in values)) == pytest.approx(-3.0, rel=1e-12)


@pytest.mark.slow
def test_solved_contact_of_the_nut_agrees_on_three_grids(monkeypatch):
    """Published kinematics, law of section 2.3."""
    for name, only in (("KINEMATICS", ("published",)), ("LAWS", LAWS[:1]), ("RACEWAYS", ("nut",))):
        monkeypatch.setattr(contact_validation, name, only)
    (row,) = section5_contacts(GD4008)
    assert row[:3] == ("published", "section_2_3", "nut")
    assert row.converged
    # extrapolated films agree on all three grids
    assert 0.0 < np.max(row.film_changes) <= 0.003
    assert 0.0 < row.rise_changes[1] < row.rise_changes[0] < 0.003
    # two ways to extrapolate: from the fine grid and its half, from three grids whose layers differ too
    assert row.film_limit == pytest.approx(row.central_film, rel=2e-3)
    assert 0.0 < row.minimum_film < row.central_film
    assert row.temperature_rise > 0.0
    # the ball drags the raceway along
    assert row.traction_force * row.slide_roll_ratio > 0.0
    assert f"{1e6 * row.minimum_film:.4f}" in section5_text([row])


@pytest.mark.slow
def test_films_of_a_circle_are_those_of_a_public_multigrid():
    """Bounds of the film references. A domain of the default length has the thicker film: here by 1 %."""
    theirs, same, default = circle_rows()
    for row in (same, default):
        assert row["converged"]
        assert row["central_film"] == pytest.approx(theirs["central_film"], rel=0.01)
        assert row["minimum_film"] == pytest.approx(theirs["minimum_film"], rel=0.025)
    assert [same[name] for name in ("x_in", "x_out", "y_max")] == pytest.approx([-4.0, 2.0, 3.0], rel=1e-12)
    assert 1.005 <= default["central_film"] / same["central_film"] <= 1.015
