"""Quadrant glitch of the circular test: its height against the step response of the loop, its angles."""

import circular_test
import numpy as np
import pytest

from ballscrew_fmu.python_fmu.package import build_fmu

pytestmark = pytest.mark.slow

FEEDS = (0.01, 0.02)


@pytest.fixture(scope="module")
def result(native_fmu):
    return circular_test.main(native_fmu, feeds=FEEDS)


def test_only_friction_makes_the_peak_and_it_is_outward(result):
    assert np.abs(result["peak_um_without"]).max() < 0.05
    for case in ("with", "presliding"):
        assert np.min(result[f"peak_um_{case}"]) > 4.0
        angle, outward = result["curves"][case, 0.02]
        # outside the neighbourhood of the reversal nothing is larger
        quarter = angle < 0.5 * np.pi - circular_test.BEFORE
        assert 0.0 < angle[quarter][np.argmax(outward[quarter])] < np.radians(10.0)
    assert result["in_range"]


def test_python_fmu_gives_the_same_run(result, synthetic_nut_map, tmp_path):
    fmu = build_fmu(synthetic_nut_map, tmp_path / "BallScrewFriction.fmu").path
    axis = result["axis"]
    with circular_test.FrictionFmu(fmu, axis, presliding=True) as friction:
        motion, _ = circular_test.circle(axis, 10e-3, 0.02, cutting_force=0.0, after=0.1)
        run = circular_test.simulate(axis, motion, friction)
    expected = result["runs"]["presliding", 0.02].friction_torque[: run.friction_torque.size]
    assert run.friction_torque == pytest.approx(expected, abs=1e-10)


def test_picture_and_command_line(result, native_fmu, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(circular_test, "main", lambda path: result)
    picture = tmp_path / "picture.png"
    assert circular_test.command_line(["--fmu", str(native_fmu), "--plot", str(picture)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert f"{result['peak_um_presliding'][1]:.2f}" in capsys.readouterr().out
    assert circular_test.command_line(["--fmu", str(tmp_path / "none.fmu")]) == 2
    assert "none.fmu not found; run build_fmu.py first" in capsys.readouterr().err
