"""Central and minimum film of film_references.csv at the ends of M, on the domain of the row, default options.

Bounds: 1 % of Hc up to M = 1000 and 2 % above (uncertainty of the table 0.5 % and 1 to 2 %), 2.5 % and 5 % of Hm
(1.5 % and 2 to 4 %).
"""

import pytest
from contact_cases import moes
from reference_screw import published_rows

pytestmark = pytest.mark.slow

TABLE = published_rows("film_references.csv")
LAWS = {"inc-Barus": "barus", "comp-Roelands": "roelands"}


def ends(rows):
    """First and last row by M and L of each law and ellipse; rows between them add no regime."""
    groups = {}
    for row in rows:
        groups.setdefault((row["rheology"], row["lambda"]), []).append(row)
    for group in groups.values():
        group.sort(key=lambda row: (float(row["M"]), float(row["L"])))
        yield from group if len(group) < 3 else (group[0], group[-1])


ROWS = list(ends(TABLE))


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


@pytest.mark.parametrize("row", ROWS, ids=name)
def test_films(row):
    film = film_of(row)
    assert film.result.branch == "resolved"
    assert film.Hc == pytest.approx(float(row["Hc"]), rel=0.02 if high(row) else 0.01)
    assert film.Hm == pytest.approx(float(row["Hm"]), rel=0.05 if high(row) else 0.025)
