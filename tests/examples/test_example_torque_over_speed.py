"""The example that draws the picture of the README."""

import numpy as np
import pytest
import torque_over_speed


@pytest.mark.slow
def test_torque_rises_with_preload_and_speed_and_passes_the_measured_points(tmp_path):
    result = torque_over_speed.main()
    torque = result["torque"]
    assert np.all(np.diff(torque, axis=0) > 0.0)
    assert np.all(np.diff(torque, axis=1) > 0.0)
    for preload, rpm, measured in result["measured"]:
        if preload in torque_over_speed.PRELOADS:
            row = torque[torque_over_speed.PRELOADS.index(preload)]
            # the largest deviation of a fitted point is 4 %
            assert abs(np.interp(rpm, result["rpm"], row) / measured - 1.0) < 0.05
    torque_over_speed.plot(result, tmp_path / "picture.png")
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
