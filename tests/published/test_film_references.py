"""Central and minimum film of every row of film_references.csv, on the domain that the row gives.

Bounds: 1 % of Hc up to M = 1000 and 2 % above (uncertainty of the table 0.5 % and 1 to 2 %), 2.5 % and 5 % of Hm
(1.5 % and 2 to 4 %). Hm is compared for radius ratios up to 0.2, where the minimum lies at the outlet of the central
lines. Left out are the 29 rows with ratios 0.5 and 1: there the minimum sits in the side lobes, a few hundredths of
the half-width wide, and the default 25 to 33 lines across hit or miss it by up to 20 %; one of them is followed to a
fine grid instead.
"""

import pytest
from contact_cases import moes
from reference_screw import published_rows

ROWS = published_rows("film_references.csv")
LAWS = {"inc-Barus": "barus", "comp-Roelands": "roelands"}
LOBES = 0.2  # radius ratio above which the minimum lies in the side lobes


def film_of(row, **options):
    x_in, x_out = (float(v) for v in row["domain_x"].split(".."))
    y_max = float(row["domain_y"].removeprefix("+-").removesuffix("b"))
    return moes(
        float(row["M"]), float(row["L"]), float(row["lambda"]), LAWS[row["rheology"]],
        x_in=x_in, x_out=x_out, y_max=y_max, **options,
    )  # fmt: skip


def name(row):
    return "{rheology}-{M}-{L}-{lambda}".format(**row)


def high(row):
    return float(row["M"]) > 1000.0


def test_table_is_complete():
    assert len(ROWS) == 58
    assert {row["rheology"] for row in ROWS} == set(LAWS)


@pytest.mark.parametrize("row", ROWS, ids=name)
def test_central_film(row):
    film = film_of(row)
    assert film.solution.branch == "resolved"
    assert film.Hc == pytest.approx(float(row["Hc"]), rel=0.02 if high(row) else 0.01)


OUTLET = [row for row in ROWS if float(row["lambda"]) <= LOBES]


@pytest.mark.parametrize("row", OUTLET, ids=name)
def test_minimum_film_at_the_outlet(row):
    assert film_of(row).Hm == pytest.approx(float(row["Hm"]), rel=0.05 if high(row) else 0.025)


def test_lines_across_bring_out_the_side_lobes():
    row = next(row for row in ROWS if name(row) == "comp-Roelands-200-10-1.0")
    errors = [abs(film_of(row, n_x=65, n_y=n_y).Hm / float(row["Hm"]) - 1.0) for n_y in (17, 33, 65)]
    assert errors[0] > errors[1] > errors[2]
    assert not errors[2] > 0.01


def test_minimum_is_left_out_for_the_wide_ellipses_only():
    assert len(ROWS) - len(OUTLET) == 29
    assert {row["lambda"] for row in ROWS if row not in OUTLET} == {"0.5", "1.0"}
