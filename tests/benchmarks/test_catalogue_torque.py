"""The benchmark of catalogue torques: rating formula, one screw, its table."""

import csv

import catalogue_torque
import pytest

from ballscrew_tehl.friction.baselines import nsk_torque
from ballscrew_tehl.parameters.file import changed, load_parameters

SCREWS = {path.stem: load_parameters(path) for path in sorted(catalogue_torque.SCREWS.glob("*.toml"))}


def test_rating_scales_as_the_standard():
    """Diameters alike: D^1.8 f_c(same); twice the turns with the balls of each kept: 2^0.86."""
    screw = SCREWS["example_32x10"].screw
    rating = catalogue_torque.dynamic_rating(screw)
    sizes = ("nominal_radius", "ball_diameter", "screw_raceway_radius", "nut_raceway_radius", "lead")
    big = changed(SCREWS["example_32x10"], screw={name: 2.0 * getattr(screw, name) for name in sizes}).screw
    assert catalogue_torque.dynamic_rating(big) == pytest.approx(2.0**1.8 * rating, rel=1e-12)
    counts = {
        "turns": 2.0 * screw.turns, "ball_count": 2 * screw.ball_count,
        "return_ball_count": screw.ball_count - screw.loaded_ball_count + screw.ball_count - screw.loaded_ball_count,
    }  # fmt: skip
    long = changed(SCREWS["example_32x10"], screw=counts).screw
    assert catalogue_torque.dynamic_rating(long) == pytest.approx(2.0**0.86 * rating, rel=1e-12)


def test_ratings_are_of_the_order_of_catalogues():
    """As recalled: 8x2 about 2 kN, 16x5 7 to 12, 25x5 12 to 20, 32x10 25 to 45, 63x10 60 to 110 kN."""
    ranges = {
        "example_08x02": (1.5e3, 4e3), "example_16x05": (6e3, 14e3), "example_25x05": (1e4, 2.2e4),
        "example_32x10": (2e4, 5e4), "example_63x10": (5e4, 1.2e5),
    }  # fmt: skip
    for name, (low, high) in ranges.items():
        assert low <= catalogue_torque.dynamic_rating(SCREWS[name].screw) <= high


@pytest.mark.slow
def test_table_of_one_screw(tmp_path, monkeypatch, capsys):
    folder = tmp_path / "screws"
    folder.mkdir()
    source = catalogue_torque.SCREWS / "example_40x20.toml"
    (folder / source.name).write_bytes(source.read_bytes())
    monkeypatch.setattr(catalogue_torque, "SCREWS", folder)
    (row,) = catalogue_torque.main(["--csv", str(tmp_path / "table.csv")])
    assert "1 of 1" in capsys.readouterr().err
    preload = 0.05 * catalogue_torque.dynamic_rating(SCREWS["example_40x20"].screw)
    assert row.preload == pytest.approx(preload, rel=1e-12)
    assert row.catalogue == pytest.approx(
        float(nsk_torque(SCREWS["example_40x20"].screw, preload)), rel=1e-12
    )
    assert row.low < row.torque < row.high
    assert row.inside
    with (tmp_path / "table.csv").open() as file:
        (written,) = csv.DictReader(file)
    assert float(written["torque"]) == row.torque
