"""The servo axis with its screw as a transmission: script and SSP archive."""

import numpy as np
import pytest
import servo_axis_transmission
import servo_transmission_ssp
from rotor_fmu import RUNS_HERE
from servo_drive import TransmissionAxis

from ballscrew_fmu.models import TRANSMISSION
from ballscrew_fmu.native_fmu.package import build_native_fmu

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not RUNS_HERE, reason="the FMU of the test is for x86_64 Linux"),
]


@pytest.fixture(scope="module")
def transmission_fmu(tmp_path_factory, synthetic_nut_map):
    path = tmp_path_factory.mktemp("transmission") / "BallScrewTransmission_fmi2.fmu"
    return build_native_fmu(synthetic_nut_map, 2, path, platforms=("x86_64-linux",), model=TRANSMISSION).path


@pytest.fixture(scope="module")
def result(transmission_fmu, native_fmu):
    return servo_axis_transmission.main(transmission_fmu, native_fmu)


def test_it_agrees_with_spring_and_friction_torque(result):
    """The same stiffness and nearly the same friction: the load of the nuts is small against the preload."""
    assert result["in_range"]
    for name in (
        "circle_error_max_um",
        "circle_spike_um",
        "circle_motor_torque_peak_Nm",
        "circle_friction_torque_peak_Nm",
    ):
        assert result[f"{name}_transmission"] == pytest.approx(result[f"{name}_spring"], rel=0.1)


def test_the_nut_is_as_elastic_as_its_stiffness(result):
    screw, axis = result["runs"]["transmission"].screw, result["axis"]
    steady = (np.abs(np.diff(screw["nut_force"])) <= 0.5) & (np.abs(screw["nut_force"][1:]) > 100.0)
    assert steady.sum() > 1000
    ratio = screw["nut_force"][1:][steady] / screw["axial_deflection"][1:][steady]
    assert np.median(ratio) == pytest.approx(1.35e9, rel=0.01)  # of the map, at 2 kN
    assert axis.support_stiffness > axis.axial_stiffness


def test_power_of_the_screw(result):
    """Shaft less nut is heat and stored energy; the axis moves on with other speeds than the step assumes."""
    screw, step = result["runs"]["transmission"].screw, result["axis"].exchange_step
    shaft, nut, loss = (step * screw[name].sum() for name in ("shaft_power", "nut_power", "power_loss"))
    throughput = step * np.abs(screw["shaft_power"]).sum()
    assert loss > 1.0
    assert abs(shaft - nut - loss - screw["stored_energy"][-1]) <= 1e-3 * throughput


def test_table_and_plot(result, tmp_path):
    assert "circle_spike_um" in servo_axis_transmission.table(result)
    servo_axis_transmission.plot(result, tmp_path / "plot.png")
    assert (tmp_path / "plot.png").read_bytes()[:4] == b"\x89PNG"


def test_archive_agrees_with_the_script(transmission_fmu, tmp_path):
    """The order of the exchange is all that differs: of first order in the step."""
    found = servo_transmission_ssp.main(transmission_fmu, tmp_path / "axis.ssp", feed=0.1)
    assert found["in_range"]
    assert found["error_max_um_script"] > 1.0
    assert found["difference_max_nm"] <= 0.01 * 1e3 * found["error_max_um_script"]


def test_the_archive_meets_the_condition_of_its_coupling():
    """The condition in the head of the SSP example: b > 0.65 a, where both sides step with the last values."""
    axis = TransmissionAxis()
    a = axis.exchange_step**2 * axis.nut_stiffness / axis.screw_mass
    b = a * servo_transmission_ssp.CONTACT_DAMPING_TIME / axis.exchange_step
    assert a <= 0.1
    assert 0.65 * a <= b <= 0.8


@pytest.mark.parametrize("module", [servo_axis_transmission, servo_transmission_ssp])
def test_a_missing_fmu_is_one_line(module, capsys):
    assert module.command_line(["--fmu", "nowhere.fmu"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
