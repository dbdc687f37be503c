"""The contact of section 5.1: printed values, solved rows, extrapolation from three grids, the table."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from reference_screw import GD4008, published_rows

from ballscrew_tehl.contact import ball_conditions
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.physics.kinematics import KINEMATICS
from ballscrew_tehl.validation import section5 as contact_validation
from ballscrew_tehl.validation.section5 import (
    COARSE,
    FINE,
    GRIDS,
    LAWS,
    LOAD,
    MIDDLE,
    REFINEMENT,
    SPEED,
    ContactRow,
    extrapolated,
    printed_values,
    section5_contacts,
    section5_text,
)

PRINTED = {row["quantity"]: row for row in published_rows("zhao2023/section5_contact.csv")}
ROW = ContactRow(
    "published", "section_2_3", "nut", 1.54165, -1.94203, 1.09e-7, 8.92e-8, 63.2, -1.5, True,
    (8e-3, 4e-3), (0.02, 0.01), 1.1e-7, math.nan,
)  # fmt: skip


def test_printed_values_are_those_of_the_paper():
    rows = printed_values()
    assert {row["quantity"]: row for row in rows} == PRINTED
    assert [row["quantity"] for row in rows] == [
        "entrainment_speed",
        "slide_roll_ratio",
        "minimum_film",
        "film_temperature_rise_max",
    ]
    assert all(row["screw"] and row["nut"] and row["unit"] for row in rows)


def test_rows_are_the_fine_solution_of_every_variant(monkeypatch):
    """Films on the grids 90, 96, 98 % of a unit, which the solver raises by 2 %; rise 66, 62, 60 K."""
    calls = []

    def solve(conditions, oil, solid, options):
        calls.append((conditions, oil.viscosity_law, solid, options))
        n = GRIDS.index(options)
        film = 1e-7 if oil.viscosity_law == "section_2_3" else 2e-7
        film *= (0.90, 0.96, 0.98)[n]
        return SimpleNamespace(
            conditions=conditions, h_c=1.02 * film, h_m=(0.8, 0.79, 0.8)[n] * film, grid_film=film,
            temperature_rise=(66.0, 62.0, 60.0)[n], traction_force=float(n), converged=True,
        )  # fmt: skip

    monkeypatch.setattr(contact_validation, "solve", solve)
    rows = section5_contacts(GD4008)
    variants = [(k, law, r) for k in KINEMATICS for law in LAWS for r in RACEWAYS]
    assert [row[:3] for row in rows] == variants
    assert len(calls) == 3 * len(variants) == 24
    temperature = GD4008.lubricant.reference_temperature
    for i, (row, (kinematics, law, raceway)) in enumerate(zip(rows, variants, strict=True)):
        parameters = changed(GD4008, friction={"kinematics": kinematics})
        contact = ball_conditions(parameters, raceway, LOAD, SPEED, temperature)
        triple = calls[3 * i : 3 * i + 3]
        assert [call[3] for call in triple] == [COARSE, MIDDLE, FINE]
        assert all(call[:3] == (contact, law, GD4008.solid) for call in triple)
        assert row.entrainment_speed == contact.u_e
        assert row.slide_roll_ratio == (contact.u_1 - contact.u_2) / contact.u_e
        unit = 1e-7 if law == "section_2_3" else 2e-7
        expected = (1.02 * 0.98 * unit, 0.80 * 0.98 * unit, 60.0, 2.0)
        assert row[5:9] == pytest.approx(expected, rel=1e-12)
        assert row.converged
        # the central film changes more at first, the minimum film later
        to_middle, to_fine = 0.96 / 0.90 - 1.0, 0.80 * 0.98 / (0.79 * 0.96) - 1.0
        assert row.film_changes == pytest.approx((to_middle, to_fine), rel=1e-12)
        assert row.rise_changes == pytest.approx((4.0 / 66.0, 2.0 / 62.0), rel=1e-12)
        # the sum of the geometric series of the changes: quotients 1/3 and 1/2
        assert row.film_limit == pytest.approx(0.99 * unit, rel=1e-12)
        assert row.rise_limit == pytest.approx(58.0, rel=1e-12)


@pytest.mark.parametrize("order", [1.0, 2.0, 3.7])
def test_limit_of_a_value_of_known_order(order):
    values = [3.0 - 0.1 * REFINEMENT ** (-order * n) for n in range(3)]
    assert extrapolated(*values) == pytest.approx(3.0, rel=1e-12)
    assert extrapolated(*(-value for value in values)) == pytest.approx(-3.0, rel=1e-12)


@pytest.mark.parametrize(
    "values",
    [(1.0, 1.02, 1.01), (1.0, 1.01, 1.019), (1.0, 1.0, 1.0), (1.0, 1.0, 1.01), (1.0, 1.2, 1.3), (1.0, math.nan, 1.1)],
    ids=["not monotone", "below first order", "constant", "late", "still far", "not a number"],
)  # fmt: skip
def test_value_that_does_not_settle_has_no_limit(values):
    assert math.isnan(extrapolated(*values))


def test_grids_are_refined_by_one_ratio_in_every_direction():
    """As nearly as whole, even numbers of cells allow."""
    for coarser, finer in ((COARSE, MIDDLE), (MIDDLE, FINE)):
        assert (finer.n_x - 1) / (coarser.n_x - 1) == pytest.approx(REFINEMENT, rel=0.01)
        assert (finer.n_y - 1) / (coarser.n_y - 1) == pytest.approx(REFINEMENT, rel=0.04)
        assert finer.n_z / coarser.n_z == pytest.approx(REFINEMENT, rel=0.07)
    assert all(grid.thermal for grid in GRIDS)


@pytest.mark.parametrize("failing", GRIDS, ids=["coarse", "middle", "fine"])
def test_row_counts_as_converged_only_if_all_grids_did(monkeypatch, failing):
    def solve(conditions, oil, solid, options):
        return SimpleNamespace(
            conditions=conditions, h_c=1e-7, h_m=1e-7, temperature_rise=60.0, traction_force=1.0,
            grid_film=math.nan, converged=options != failing,
        )  # fmt: skip

    monkeypatch.setattr(contact_validation, "solve", solve)
    rows = section5_contacts(GD4008)
    assert not any(row.converged for row in rows)
    assert section5_text(rows).count("NO") == len(rows)


def test_text_holds_rows_and_printed_values():
    other = ROW._replace(raceway="screw", converged=False, rise_limit=62.0)
    lines = section5_text([ROW, other, ROW._replace(viscosity_law="roelands_printed")]).splitlines()
    assert "39.5 N, 3000 r/min, oil at 303 K" in lines[0]
    assert "97x17x6, 137x23x8, 193x33x12" in lines[1]
    first = lines.index("published, section_2_3")
    numbers = [
        "1.5416",
        "-1.94203",
        "|",
        "0.1090",
        "0.0892",
        "0.80",
        "0.40",
        "0.1100",
        "|",
        "63.20",
        "2.00",
        "1.00",
    ]
    assert lines[first + 1].split() == ["nut", *numbers, "-", "|", "yes"]
    assert lines[first + 2].split() == ["screw", *numbers, "62.00", "|", "NO"]
    assert lines[first + 3] == "published, roelands_printed"
    # the bars of head and rows are below each other
    bars = [[i for i, sign in enumerate(line) if sign == "|"] for line in lines[first - 1 : first + 3]]
    assert bars[0] == bars[2] == bars[3]
    printed = lines[-len(PRINTED) :]
    for line, row in zip(printed, printed_values(), strict=True):
        assert line.split()[:4] == [row["quantity"], row["screw"], "|", row["nut"]]
        assert row["note"] in line


@pytest.mark.slow
def test_solved_contact_of_the_nut_has_the_printed_speeds(monkeypatch):
    """Published kinematics, law of section 2.3; the surface speeds are known to 0.1 mm/s."""
    for name, only in (("KINEMATICS", ("published",)), ("LAWS", LAWS[:1]), ("RACEWAYS", ("nut",))):
        monkeypatch.setattr(contact_validation, name, only)
    (row,) = section5_contacts(GD4008)
    assert row[:3] == ("published", "section_2_3", "nut")
    assert 1e3 * row.entrainment_speed == pytest.approx(float(PRINTED["entrainment_speed"]["nut"]), abs=0.05)
    # the ball is the faster body: the printed value is the magnitude
    printed = float(PRINTED["slide_roll_ratio"]["nut"])
    assert -row.slide_roll_ratio == pytest.approx(printed, abs=0.1 / (1e3 * row.entrainment_speed))
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
