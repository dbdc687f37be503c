"""Preload monitoring: inversion, coverage of the interval, false alarms against the formula, detection."""

import numpy as np
import preload_monitoring as monitoring
import pytest

from ballscrew_fmu.models import MONITOR
from ballscrew_fmu.python_fmu.package import build_fmu

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def result(synthetic_nut_map):
    return monitoring.main(synthetic_nut_map, lives=4)


def test_without_noise_the_preload_is_recovered(synthetic_nut_map, monkeypatch):
    monkeypatch.setattr(monitoring, "NOISE", 0.0)
    batch = monitoring.measure(synthetic_nut_map, 1700.0, np.random.default_rng(0))
    assert monitoring.estimate(synthetic_nut_map, batch, 0.0) == pytest.approx((1700.0, 0.0), rel=1e-6)


def test_the_interval_covers_the_true_preload_at_its_level(result):
    # 600 intervals: 95 % +- 0.9 % (one standard deviation)
    assert 0.93 <= result["coverage"] <= 0.97
    # 25 measurements with s of 2 to 3 %, preload about in proportion to torque^1.2
    assert 0.02 < result["scatter"] < 0.03
    assert 0.8 < result["half_width_percent"] < 2.0
    # scatter of the estimates against the interval: 400 batches without loss give it to 3.5 %
    assert 1.96 * result["deviation_N"] == pytest.approx(20.0 * result["half_width_percent"], rel=0.12)


def test_loss_is_found_early_without_false_alarms(result):
    assert result["detected"] == 1.0
    assert result["largest_loss_at_alarm_percent"] < 6.0
    assert result["healthy_batches"] == 4 * 51
    assert result["false_alarms"] == 0  # expected: 204/19000


@pytest.fixture(scope="module")
def fmu(tmp_path_factory, synthetic_nut_map):
    folder = tmp_path_factory.mktemp("monitor")
    return build_fmu(synthetic_nut_map, folder / "BallScrewPreloadMonitor.fmu", model=MONITOR).path


def test_the_fmu_gives_the_same_preload_for_each_measurement(fmu, synthetic_nut_map):
    found = monitoring.compared_with_fmu(fmu, synthetic_nut_map)
    assert found["in_range"] == 1.0
    # both are means of 25 measurements with the same noise, weighted differently
    assert found["difference_percent"] < 0.2
    # the half-widths include the noise of torque, not that of speed and temperature
    assert found["stated_percent"] < found["deviation_percent"] < 1.4 * found["stated_percent"]


def test_without_noise_the_fmu_gives_the_preload(fmu, synthetic_nut_map, monkeypatch):
    monkeypatch.setattr(monitoring, "NOISE", 0.0)
    assert monitoring.compared_with_fmu(fmu, synthetic_nut_map)["deviation_percent"] < 1e-7


def test_a_missing_fmu_is_one_line(capsys):
    assert monitoring.command_line(["--fmu", "none.fmu"]) == 2
    assert (
        capsys.readouterr().err
        == "preload_monitoring.py: none.fmu not found; run build_fmu.py first, or name an FMU with --fmu\n"
    )


def test_picture_and_command_line(result, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(monitoring, "main", lambda: result)
    assert monitoring.command_line(["--plot", str(tmp_path / "a.png")]) == 0
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert "loss_at_alarm_percent" in capsys.readouterr().out
