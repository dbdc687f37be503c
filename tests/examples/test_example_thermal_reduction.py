"""The thermal solve over sliding compared with the formula of Wilson & Sheu."""

import numpy as np
import pytest
import thermal_reduction

from ballscrew_tehl.physics.film import wilson_sheu

pytestmark = pytest.mark.slow

RATIOS = (0.0, 0.02, 0.05, 0.5, 1.0, 1.5, 2.0)


@pytest.fixture(scope="module")
def result():
    return thermal_reduction.main((1000.0,), RATIOS)


def test_film_is_nearly_isothermal_in_pure_rolling_and_falls_with_sliding(result):
    film, flow = result["film"][0], result["flow"][0]
    # inlet heating alone: formula 2.8 %, solve 2.0 %
    assert film[0] == pytest.approx(result["formula"][0, 0], abs=0.015)
    assert 0.97 < film[0] < 1.0
    # from some sliding on; before, the oil of the hot contact expands a little more than the inlet loses
    assert np.all(np.diff(film[2:]) < 0.0)
    assert np.all(np.abs(film[:3] - film[0]) < 0.006)
    # the oil moves with the faster, colder surface: film thickness falls more than flow
    assert flow[0] == pytest.approx(film[0], rel=1e-6)
    assert np.all(np.diff(flow - film)[2:] > 0.0)
    # its speed is at most that of this surface
    assert np.all(flow < film * (1.0 + 0.5 * result["srr"]) * (1.0 + 1e-12))


def test_traction_vanishes_without_sliding_rises_and_falls_as_the_oil_heats(result):
    traction, rise = result["traction"][0], result["rise"][0]
    assert abs(traction[0]) < 1e-6
    assert 0.0 < traction[1] < traction[2]
    assert np.all(np.diff(traction[2:]) < 0.0)
    assert np.all(np.diff(rise) > 0.0)
    # forty times the sliding, a fifth of the traction
    assert traction[-1] < 0.25 * traction[2]


def test_deviation_of_the_formula_is_the_one_that_was_found(result):
    deviation = result["deviation"][0]
    assert result["formula"] == pytest.approx(wilson_sheu(result["N"][0], result["srr"])[None, :], rel=1e-12)
    assert deviation == pytest.approx(result["formula"][0] / result["film"][0] - 1.0, rel=1e-12)
    # reduction too large at moderate sliding, too small where one surface is at rest
    moderate = np.array(RATIOS) <= 1.5
    assert np.all((deviation[moderate] > -0.12) & (deviation[moderate] < 0.02))
    assert 0.30 < deviation[-1] < 0.40
    assert result["mean_deviation"][0] == pytest.approx(np.abs(deviation).mean(), rel=1e-12)
    assert result["largest_deviation"][0] == deviation[-1]
    assert f"largest {100.0 * deviation[-1]:+.1f} % at srr 2" in thermal_reduction.report(result)


def test_picture(result, tmp_path):
    thermal_reduction.plot(result, tmp_path / "picture.png")
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
