"""BallScrewPreloadMonitor: preload from torque by the map: round trip, limits, separated nuts, interval."""

import math

import numpy as np
import pytest
from native_model import NativeModel
from synthetic_map import LAWS, Law, closed_form

from ballscrew_fmu.models import MONITOR
from ballscrew_tehl.runtime.constants import LEAST_ELASTICITY
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import FrictionParameters, sealed

REGULARIZATION = 0.1
SETS = tuple(
    FrictionParameters(*values)
    for values in (
        (7.6, 0.0051, 24e-9, 1.0), (1.0, 0.0, 0.0, 3.0), (40.0, 0.0, 200e-9, 1.0), (0.0, 0.01, 0.0, 2.0),
    )
)  # fmt: skip
MAPS = {law: closed_form(law) for law in LAWS} | {"oversize balls": closed_form(Law.MECHANISTIC, 0.3)}
OUTPUTS = ("preload", "torque_sensitivity", "in_range", "preload_half_width", "preload_low", "preload_high")


@pytest.fixture(params=MAPS)
def nut_map(request):
    return MAPS[request.param]


@pytest.fixture
def monitor(nut_map):
    """Outputs by name after a step with the torque of a moving screw."""
    model = NativeModel(nut_map, model=MONITOR)

    def step(torque, speed, temperature=303.15, axial_load=0.0, friction=SETS[0], **others):
        given = {"torque": torque, "speed": speed, "temperature": temperature, "axial_load": axial_load}
        given |= friction._asdict() | {"regularization_speed": REGULARIZATION, "speed_min": 0.0}
        model.reset()
        model.step(1e-3, **given | others)
        return dict(zip(OUTPUTS, model.values(OUTPUTS).tolist(), strict=True))

    return step


def torque_of(nut_map, preload, speed, temperature=303.15, axial_load=0.0, friction=SETS[0], **others):
    """Friction torque as BallScrewFriction signs it; floats or arrays."""
    state = nut_map.evaluate(preload, speed, temperature, axial_load, *friction, **others)
    coulomb = state.coulomb_torque
    return np.sign(speed) * (state.viscous_torque + np.tanh(np.abs(speed) / REGULARIZATION) * coulomb)


def random_points(count, seed=7):
    """Preload, speed, temperature, axial load, index of the friction set: inside the map, slow, outside."""
    rng = np.random.default_rng(seed)
    preload = 10.0 ** rng.uniform(1.5, 4.08, count)
    speed = rng.choice([-1.0, 1.0], count) * 10.0 ** rng.uniform(-2.0, 2.6, count)
    axial = 1.5 * rng.normal(size=count) * preload
    axial[::3] = 0.0
    columns = preload, speed, rng.uniform(280.0, 356.0, count), axial, rng.integers(0, len(SETS), count)
    return list(zip(*(column.tolist() for column in columns), strict=True))


def parting(nut_map, axial_load):
    """Preload at or below which an axial load parts the nuts: where the relieved one has no force, by bisection."""
    low, high = 0.0, abs(axial_load)
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if nut_map._forces_point(middle, axial_load)[0] == 0.0 else (low, middle)
    return high


def test_the_preload_is_that_at_one_temperature_of_screw_and_nut(nut_map, monitor):
    for difference in (-9.0, -2.0, 3.0, 8.0):
        warm = {"temperature_difference": difference}
        for axial in (0.0, 400.0):
            torque = float(torque_of(nut_map, 1700.0, 60.0, axial_load=axial, **warm))
            found = monitor(torque, 60.0, axial_load=axial, **warm)
            assert (found["preload"], found["in_range"]) == (pytest.approx(1700.0, rel=1e-8), True)
            assert monitor(torque, 60.0, axial_load=axial)["preload"] != pytest.approx(1700.0, rel=0.02)
    assert not monitor(torque, 60.0, temperature_difference=21.0)["in_range"]


def test_the_range_of_a_nominal_preload_is_that_of_its_true_force(nut_map):
    """A drag torque that implies half of the preload: the map begins at 50 N of force."""
    half = NutMap(sealed({**nut_map.header, "preload_factor": 0.5}, nut_map.arrays), nut_map.arrays)
    model = NativeModel(half, model=MONITOR)
    friction = SETS[0]._asdict() | {"regularization_speed": REGULARIZATION, "speed_min": 0.0}
    for preload, inside in ((1700.0, True), (120.0, True), (90.0, False)):
        torque = float(torque_of(half, preload, 60.0))
        assert torque == pytest.approx(float(torque_of(nut_map, 0.5 * preload, 60.0)), rel=1e-12)
        model.reset()
        model.step(1e-3, torque=torque, speed=60.0, temperature=303.15, axial_load=0.0, **friction)
        assert model.get("preload") == pytest.approx(preload, rel=1e-8)
        assert (model.get("in_range"), half.evaluate(preload, 60.0, 303.15).in_range) == (inside, inside)


@pytest.mark.slow
def test_the_preload_is_recovered_with_its_sensitivity(nut_map, monitor):
    """The sensitivity by central differences of two widths, where these agree: not over an end of an axis."""
    in_range = compared = 0
    for preload, speed, temperature, axial, n in random_points(600):
        at = speed, temperature, axial, SETS[n]
        state = nut_map.evaluate(preload, *at[:3], *SETS[n])
        torque = float(torque_of(nut_map, preload, *at))
        found = monitor(torque, *at)
        slope = found["torque_sensitivity"]
        if state.in_range and found["in_range"]:
            in_range += 1
            assert found["preload"] == pytest.approx(preload, rel=1e-8), at
            assert slope * preload / abs(torque) >= LEAST_ELASTICITY * (1.0 - 1e-9)
            wide, narrow = (
                abs(float(torque_of(nut_map, preload + w, *at)) - float(torque_of(nut_map, preload - w, *at)))
                / (2.0 * w)
                for w in (1e-4 * preload, 5e-5 * preload)
            )
            if abs(wide - narrow) <= 1e-6 * narrow:
                compared += 1
                assert slope == pytest.approx(narrow, rel=1e-5)
        elif found["in_range"]:
            assert found["preload"] == pytest.approx(nut_map.force.hi)  # the torque of a clamped preload
        else:
            # outside the map, or one nut separated: as in the state of the map
            separated = axial != 0.0 and preload <= parting(nut_map, axial) * (1.0 + 1e-6)
            assert state.clamped or separated, (preload, found)
    assert in_range > (250 if nut_map.oversize else 400)  # of oversize balls half held nothing is said
    assert compared > 300


def test_torque_outside_the_range_of_the_map(nut_map, monitor):
    lowest, highest = nut_map.force.lo, nut_map.force.hi
    for torque in (0.0, -0.5):
        found = monitor(torque, 30.0)
        assert (found["preload"], found["in_range"]) == (0.0, 0.0)
    found = monitor(1e3, 30.0)
    assert (found["preload"], found["in_range"]) == (highest, 0.0)
    # below the axis the map extrapolates by power laws and sets the flag
    found = monitor(float(torque_of(nut_map, 0.3 * lowest, 30.0)), 30.0)
    assert found["preload"] == pytest.approx(0.3 * lowest, rel=1e-9)
    assert found["in_range"] == 0.0
    for at in ((500.0,), (3.0, 400.0), (30.0, 303.15, 6000.0)):
        preload = 9e3 if len(at) == 3 else 2e3
        assert monitor(float(torque_of(nut_map, preload, *at)), *at)["in_range"] == 0.0


def test_preload_is_not_in_range_with_a_separated_nut(nut_map, monitor):
    for axial in (4000.0, -4000.0):
        limit = parting(nut_map, axial)
        assert 0.2 * abs(axial) < limit < 0.5 * abs(axial)
        torques = [float(torque_of(nut_map, x * limit, 30.0, axial_load=axial)) for x in (0.5, 0.999, 1.01)]
        assert torques[0] == pytest.approx(torques[1], rel=1e-6)
        assert torques[2] > torques[0] * (1.0 + 1e-4)
        for torque in (torques[0], 0.7 * torques[0]):
            found = monitor(torque, 30.0, axial_load=axial)
            assert found["preload"] == pytest.approx(limit, rel=1e-8)
            assert (found["torque_sensitivity"], found["in_range"]) == (0.0, 0.0)
        found = monitor(torques[2], 30.0, axial_load=axial)
        assert found["preload"] == pytest.approx(1.01 * limit, rel=1e-8)


def test_the_interval_is_that_of_both_uncertainties_over_the_sensitivity(nut_map, monitor):
    torque = float(torque_of(nut_map, 2000.0, -30.0)) - 0.05
    both = {"torque_uncertainty": 0.02, "law_uncertainty": 0.1, "seal_torque": 0.05}
    found = monitor(torque, -30.0, **both)
    assert found["preload"] == pytest.approx(2000.0, rel=1e-8)  # the seals turn with the motion
    half = math.hypot(0.02, 0.1 * (torque + 0.05)) / found["torque_sensitivity"]
    assert found["preload_half_width"] == pytest.approx(half, rel=1e-9)
    ends = found["preload_low"], found["preload_high"]
    assert ends == pytest.approx((max(2000.0 - half, 0.0), min(2000.0 + half, nut_map.force.hi)), rel=1e-8)
    wide = monitor(torque, -30.0, **both | {"torque_uncertainty": 1e6})
    assert (wide["preload_low"], wide["preload_high"]) == (0.0, nut_map.force.hi)
