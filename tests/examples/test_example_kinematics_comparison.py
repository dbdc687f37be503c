"""One contact with the two kinematics."""

import kinematics_comparison
import numpy as np
import pytest

from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.physics.kinematics import surface_speeds

pytestmark = pytest.mark.slow

RPM = (200.0, 2000.0)
PUBLISHED, ROLLING = range(2)
SCREW, NUT = range(2)


@pytest.fixture(scope="module")
def result():
    return kinematics_comparison.main(RPM)


def test_rolling_frame_rolls_alike_on_both_raceways_published_does_not(result):
    film = result["film"]
    assert list(kinematics_comparison.CASES) == ["published", "rolling"]
    assert np.all(np.diff(film, axis=-1) > 0.0)
    # equal entrainment, the nut side conforms better: a little more film
    assert np.all(
        (film[ROLLING, NUT] > film[ROLLING, SCREW]) & (film[ROLLING, NUT] < 1.1 * film[ROLLING, SCREW])
    )
    assert np.all(film[PUBLISHED, NUT] < 0.5 * film[PUBLISHED, SCREW])


def test_heat_and_traction_come_from_sliding(result):
    heat, traction, rise = result["heat"], result["traction"], result["rise"]
    assert np.all(np.abs(heat[ROLLING]) < 1e-12)
    assert np.all(np.abs(traction[ROLLING]) < 1e-4)
    # uniform speeds: heat is traction times sliding speed
    for j, raceway in enumerate(("screw", "nut")):
        speeds = surface_speeds(load_parameters(), raceway, np.pi / 30.0 * np.array(RPM), "published")
        assert heat[PUBLISHED, j] == pytest.approx(
            traction[PUBLISHED, j] * (speeds.u_1 - speeds.u_2), rel=1e-9
        )
    assert np.all(rise[ROLLING] < 0.3 * rise[PUBLISHED])


def test_table_and_picture(result, tmp_path):
    lines = kinematics_comparison.report(result).splitlines()
    assert len(lines) == 1 + 2 * 2 * len(RPM)
    assert lines[1].split()[:4] == ["published", "screw", "200", f"{1e9 * result['film'][0, 0, 0]:.1f}"]
    assert lines[-1].startswith("rolling        nut")
    kinematics_comparison.plot(result, tmp_path / "picture.png")
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
