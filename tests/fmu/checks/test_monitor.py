"""BallScrewPreloadMonitor for Python hosts: interval, rest, range, saved state.

The preload of a torque: tests/runtime. The native one is the same in all of this: tests/fmu/native_fmu.
"""

import math

import pytest

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.models import MONITOR

pytestmark = pytest.mark.slow


@pytest.fixture
def monitor(folder_of):
    return lambda **start: FmuInstance(folder_of(MONITOR, "python"), **start)


def test_sensitivity_and_interval(monitor):
    with monitor(torque_uncertainty=0.01) as one:
        preloads = []
        for torque in (0.799, 0.801, 0.8):
            one.step(torque=torque, speed=30.0)
            preloads.append(one.get("preload"))
        slope = 0.002 / (preloads[1] - preloads[0])
        assert one.get("torque_sensitivity") == pytest.approx(slope, rel=1e-5)
        assert one.get("preload_half_width") == pytest.approx(0.01 / slope, rel=1e-5)
        one.step(law_uncertainty=0.03)
        assert one.get("preload_half_width") == pytest.approx(math.hypot(0.01, 0.024) / slope, rel=1e-5)
        preload, half = one.get("preload", "preload_half_width")
        assert one.get("preload_low", "preload_high") == [preload - half, preload + half]
        one.step(torque_uncertainty=1e6)
        assert one.get("preload_half_width", "preload_low", "preload_high") == [12000.0, 0.0, 12000.0]


def test_the_last_preload_in_range_is_held_at_rest_and_in_a_saved_state(monitor):
    with monitor(initial_preload=1700.0, speed_min=2.0) as one, monitor() as other:
        for step, torque, speed, preload in (
            (1e-3, 5.0, 1.99, 1700.0),  # below speed_min
            (1e-3, 0.8, -2.0, 0.0),  # against the motion: estimated, but not in range
            (0.0, 1.6, 30.0, None),  # a step of size 0 holds nothing
            (1e-3, 0.8, 0.0, 1700.0), (1e-3, -0.8, -2.0, None),
        ):  # fmt: skip
            one.step(step, torque=torque, speed=speed)
            assert one.get("in_range") is (preload is None)
            assert preload is None or one.get("preload") == preload
        stored, content = one.get("preload"), one.slave.serializeFMUstate(one.slave.getFMUstate())
        one.step(torque=500.0, speed=30.0)
        assert one.get("preload", "in_range") == [12000.0, False]
        for torque, speed in ((0.0, 0.0), (-0.7, 1.9), (3.0, -1e-9)):
            one.step(torque=torque, speed=speed)
            assert one.get("preload", "in_range") == [stored, False]
            assert one.get("torque_sensitivity") > 0.0
        one.step(torque=-1.0, speed=-30.0)
        for each in (one, other):
            each.slave.setFMUstate(each.slave.deSerializeFMUstate(content))
            each.step(torque=1.0, speed=0.0)
            assert each.get("preload") == stored
