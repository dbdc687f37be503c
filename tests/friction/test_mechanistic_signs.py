"""Signs of the mechanistic torque over the packaged map: film, temperature and speed move it as they should."""

import numpy as np
import pytest

from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import changed, load_parameters
from ballscrew_tehl.parameters.packaged_data import PACKAGED_VG100
from ballscrew_tehl.parameters.units import RPM

SCREW = load_parameters(PACKAGED_VG100)
#: film [m] above which light balls of cold oil at high speed hardly flatten: their rolling loss falls with the film
THICKEST = 5e-6
#: relative error of the map's torque where films are thick: neighbouring points may differ by it against the sign
MAP_ERROR = 5e-3


def flooded():
    """State over 7 preloads, 13 speeds and 6 temperatures; sums the flooded law anew, some ten seconds."""
    parameters = changed(SCREW, friction={"replenishment_constant": 0.0})
    nut_map = load_map(None, parameters)
    axes = nut_map.header["axes"]
    preload, speed = (
        np.geomspace(1.02 * axes[name][0], 0.98 * axes[name][1], n)
        for name, n in (("preload", 7), ("speed", 13))
    )
    temperature = np.linspace(axes["temperature"][0] + 0.5, axes["temperature"][1] - 0.5, 6)
    return nut_map.evaluate(preload[:, None, None], speed[None, :, None], temperature)


@pytest.mark.slow
def test_in_a_full_flooded_film_torque_falls_with_temperature_and_rises_with_speed():
    state = flooded()
    assert np.all(state.in_range)
    full = (state.lambda_ratio > 3.0) & (state.film_thickness_central_nut < THICKEST)
    assert full.sum() >= 40
    torque = state.friction_torque
    over_temperature = np.diff(torque, axis=2) / torque[:, :, 1:]
    assert np.max(over_temperature[full[:, :, 1:] & full[:, :, :-1]]) <= MAP_ERROR
    over_speed = np.diff(torque, axis=1) / torque[:, 1:]
    assert np.min(over_speed[full[:, 1:] & full[:, :-1]]) >= -MAP_ERROR


@pytest.mark.slow
def test_torque_has_a_minimum_over_speed_in_mixed_lubrication():
    """sigma 0.2 um: at a film ratio of 0.1 to 1, with the starvation of the default."""
    for preload in [500.0, 2000.0, 6000.0]:
        for temperature in [293.15, 303.15, 333.15]:
            nut_map = load_map(None, SCREW)
            speed = np.geomspace(0.01 * nut_map.header["axes"]["speed"][0], 600.0 * RPM, 300)
            state = nut_map.evaluate(preload, speed, temperature)
            least = int(np.argmin(state.friction_torque))
            assert 0 < least < speed.size - 1
            assert 0.1 <= state.lambda_ratio[least] <= 1.0
            # breakaway above running torque, and no jump on the way
            assert state.friction_torque[0] >= 1.5 * state.friction_torque[least]
            assert np.max(np.abs(np.diff(np.log(state.friction_torque)))) <= 0.05
