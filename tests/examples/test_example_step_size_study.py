"""Explicit coupling: first order in the step, stability limits against closed forms."""

import numpy as np
import pytest
import step_size_study as study

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def result(native_fmu):
    return study.main(native_fmu)


def test_all_couplings_are_of_first_order(result):
    assert len(result["orders"]) == 4
    for key, order in result["orders"].items():
        assert 0.9 < order < 1.2, key
        halved = result["errors"][key][1:] / result["errors"][key][:-1]
        assert np.all((halved > 0.4) & (halved < 0.6)), key
    for law in study.LAWS:  # the delayed torque reduces accuracy
        assert np.all(result["errors"][law, "parallel"] > 2.0 * result["errors"][law, "sequential"])


@pytest.mark.parametrize("master", study.MASTERS)
def test_stability_limits_are_the_closed_forms(result, master):
    assert result["limits"]["parallel"] == pytest.approx([0.16, 0.25, 0.16])
    assert result["limits"]["sequential"] == pytest.approx([3.6, 3.0, 2.4])
    assert result["borders"][master] == pytest.approx(result["limits"][master], rel=0.03)


def test_picture_and_command_line(result, native_fmu, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(study, "main", lambda path: result)
    assert study.command_line(["--fmu", str(native_fmu), "--plot", str(tmp_path / "a.png")]) == 0
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert "closed form 0.2500" in capsys.readouterr().out
    assert study.command_line(["--fmu", "none.fmu"]) == 2
