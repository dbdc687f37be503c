"""The contact of section 5.1: printed values, solved rows, the table."""

from types import SimpleNamespace

import pytest
from reference_screw import GD4008, published_rows

from ballscrew_tehl import contact_validation
from ballscrew_tehl.contact_validation import (
    COARSE,
    FINE,
    LAWS,
    LOAD,
    SPEED,
    ContactRow,
    printed_values,
    section5_contacts,
    section5_text,
)
from ballscrew_tehl.hertz import RACEWAYS
from ballscrew_tehl.kinematics import KINEMATICS
from ballscrew_tehl.nut_map.operating_contact import ball_contact
from ballscrew_tehl.parameters import changed

PRINTED = {row["quantity"]: row for row in published_rows("zhao2023/section5_contact.csv")}
ROW = ContactRow(
    "published", "section_2_3", "nut", 1.54165, -1.94203, 1.09e-7, 8.92e-8, 63.2, -1.5, True, 4e-3
)


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
    """Film 2 % thinner, minimum 3 % thinner and rise 5 % higher on the coarse grid."""
    calls = []

    def solve(conditions, oil, solid, options):
        calls.append((conditions, oil.viscosity_law, solid, options))
        assert options in (COARSE, FINE)
        fine = 1.0 if options == FINE else 0.0
        film = 1e-7 if oil.viscosity_law == "section_2_3" else 2e-7
        return SimpleNamespace(
            conditions=conditions, h_c=film * (0.98 + 0.02 * fine), h_m=0.8 * film * (0.97 + 0.03 * fine),
            temperature_rise=60.0 * (1.05 - 0.05 * fine), traction_force=1.5 + fine, converged=True,
        )  # fmt: skip

    monkeypatch.setattr(contact_validation, "solve_contact", solve)
    rows = section5_contacts(GD4008)
    variants = [(k, law, r) for k in KINEMATICS for law in LAWS for r in RACEWAYS]
    assert [row[:3] for row in rows] == variants
    assert len(calls) == 2 * len(variants) == 16
    temperature = GD4008.lubricant.reference_temperature
    for i, (row, (kinematics, law, raceway)) in enumerate(zip(rows, variants, strict=True)):
        parameters = changed(GD4008, friction={"kinematics": kinematics})
        contact = ball_contact(parameters, raceway, LOAD, SPEED, temperature)
        pair = calls[2 * i : 2 * i + 2]
        assert [call[3] for call in pair] == [COARSE, FINE]
        assert all(call[:3] == (contact, law, GD4008.solid) for call in pair)
        assert row.entrainment_speed == contact.u_e
        assert row.slide_roll_ratio == (contact.u_1 - contact.u_2) / contact.u_e
        film = 1e-7 if law == "section_2_3" else 2e-7
        assert row[5:9] == pytest.approx((film, 0.8 * film, 60.0, 2.5), rel=1e-12)
        assert row.error == pytest.approx(0.05, rel=1e-12)
        assert row.converged


def test_fine_grid_is_finer_in_every_direction():
    assert FINE.n_x > COARSE.n_x
    assert FINE.n_z > COARSE.n_z
    assert FINE.n_y > 17
    assert COARSE.thermal
    assert FINE.thermal


@pytest.mark.parametrize("failing", [COARSE, FINE], ids=["coarse", "fine"])
def test_row_counts_as_converged_only_if_both_grids_did(monkeypatch, failing):
    def solve(conditions, oil, solid, options):
        return SimpleNamespace(
            conditions=conditions, h_c=1e-7, h_m=1e-7, temperature_rise=60.0, traction_force=1.0,
            converged=options != failing,
        )  # fmt: skip

    monkeypatch.setattr(contact_validation, "solve_contact", solve)
    rows = section5_contacts(GD4008)
    assert not any(row.converged for row in rows)
    assert section5_text(rows).count("NO") == len(rows)


def test_text_holds_rows_and_printed_values():
    lines = section5_text([ROW, ROW._replace(raceway="screw", converged=False)]).splitlines()
    assert "39.5 N, 3000 r/min, oil at 303 K" in lines[0]
    names = ["published", "section_2_3"]
    numbers = ["1.5416", "-1.94203", "0.1090", "0.0892", "63.20", "0.40", "%"]
    assert lines[2].split() == [*names, "nut", *numbers, "yes"]
    assert lines[3].split() == [*names, "screw", *numbers, "NO"]
    assert len(lines) == 5 + len(PRINTED)
    for line, row in zip(lines[5:], printed_values(), strict=True):
        assert line.split()[:4] == [row["quantity"], row["screw"], "|", row["nut"]]
        assert row["note"] in line


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
    assert 0.0 < row.error < 0.03
    assert 0.0 < row.minimum_film < row.central_film
    assert row.temperature_rise > 0.0
    # the ball drags the raceway along
    assert row.traction_force * row.slide_roll_ratio > 0.0
    assert f"{1e6 * row.minimum_film:.4f}" in section5_text([row])
