"""Preload from torque by the map, and the dual numbers beneath: derivative, round trip, limits, separated nuts."""

import numpy as np
import pytest
from synthetic_map import LAWS, MECHANISTIC, closed_form

from ballscrew_tehl import load_map, load_screw
from ballscrew_tehl.parameters.file import PACKAGED_VG100
from ballscrew_tehl.runtime.constants import LEAST_ELASTICITY
from ballscrew_tehl.runtime.packed import FrictionParameters
from ballscrew_tehl.runtime.preload import OverPreload, estimate_preload

REGULARIZATION = 0.1
SETS = tuple(
    FrictionParameters(*values)
    for values in (
        (7.6, 0.0051, 24e-9, 1.0), (1.0, 0.0, 0.0, 3.0), (40.0, 0.0, 200e-9, 1.0), (0.0, 0.01, 0.0, 2.0),
    )
)  # fmt: skip
MAPS = {law: closed_form(law) for law in LAWS} | {"oversize balls": closed_form(MECHANISTIC, 0.3)}


@pytest.fixture(params=MAPS)
def nut_map(request):
    return MAPS[request.param]


def torque_of(nut_map, preload, speed, temperature=303.15, axial_load=0.0, friction=SETS[0]):
    """Friction torque as BallScrewFriction signs it; floats or arrays."""
    state = nut_map.evaluate(preload, speed, temperature, axial_load, *friction)
    coulomb = state.coulomb_torque
    return np.sign(speed) * (state.viscous_torque + np.tanh(np.abs(speed) / REGULARIZATION) * coulomb)


def estimate(nut_map, torque, speed, temperature=303.15, axial_load=0.0, friction=SETS[0]):
    return estimate_preload(nut_map, torque, speed, temperature, axial_load, friction, REGULARIZATION)


def random_points(count, seed=7):
    """Preload, speed, temperature, axial load, index of the friction set: inside the map, slow, outside."""
    rng = np.random.default_rng(seed)
    preload = 10.0 ** rng.uniform(1.5, 4.08, count)
    speed = rng.choice([-1.0, 1.0], count) * 10.0 ** rng.uniform(-2.0, 2.6, count)
    axial = 1.5 * rng.normal(size=count) * preload
    axial[::3] = 0.0
    columns = preload, speed, rng.uniform(280.0, 356.0, count), axial, rng.integers(0, len(SETS), count)
    return list(zip(*(column.tolist() for column in columns), strict=True))


def test_torque_and_derivative_over_preload_are_those_of_the_map(nut_map):
    """The derivative by central differences of two widths, where these agree: not over an end of an axis."""
    compared = 0
    for preload, speed, temperature, axial, n in random_points(800):
        preload = min(preload, 0.999 * nut_map.force.hi)
        model = OverPreload(nut_map, speed, temperature, axial, SETS[n], REGULARIZATION)
        total, slope, _ = model.torque(preload)
        expected = abs(float(torque_of(nut_map, preload, speed, temperature, axial, SETS[n])))
        assert total == pytest.approx(expected, rel=1e-12, abs=1e-300)
        wide, narrow = (
            (model.torque(preload + w)[0] - model.torque(preload - w)[0]) / (2.0 * w)
            for w in (1e-4 * preload, 5e-5 * preload)
        )
        if abs(wide - narrow) <= 1e-6 * abs(narrow) + 1e-10 * total / preload:
            compared += 1
            assert slope == pytest.approx(narrow, rel=1e-5, abs=1e-9 * total / preload)
    assert compared > 700


@pytest.mark.slow
def test_the_preload_is_recovered(nut_map):
    in_range = 0
    for preload, speed, temperature, axial, n in random_points(600):
        state = nut_map.evaluate(preload, speed, temperature, axial, *SETS[n])
        torque = float(torque_of(nut_map, preload, speed, temperature, axial, SETS[n]))
        found = estimate(nut_map, torque, speed, temperature, axial, SETS[n])
        if state.in_range and found.in_range:
            in_range += 1
            assert found.preload == pytest.approx(preload, rel=1e-8), (speed, temperature, axial, n)
            assert found.torque_sensitivity * preload / abs(torque) >= LEAST_ELASTICITY * (1.0 - 1e-9)
        elif found.in_range:
            assert found.preload == pytest.approx(nut_map.force.hi)  # the torque of a clamped preload
        else:
            # outside the map, or one nut separated: as in the state of the map
            model = OverPreload(nut_map, speed, temperature, axial, SETS[n], REGULARIZATION)
            separated = preload <= model.separation_preload() * (1.0 + 1e-6)
            assert state.clamped or separated, (preload, found)
    assert in_range > 400


def test_torque_outside_the_range_of_the_map(nut_map):
    lowest, highest = nut_map.force.lo, nut_map.force.hi
    for torque in (0.0, -0.5):
        found = estimate(nut_map, torque, 30.0)
        assert (found.preload, found.clamped) == (0.0, ("torque",))
    assert estimate(nut_map, 1e3, 30.0)[::2] == (highest, ("torque",))
    # below the axis the map extrapolates by power laws and sets the flag
    found = estimate(nut_map, float(torque_of(nut_map, 0.3 * lowest, 30.0)), 30.0)
    assert found.preload == pytest.approx(0.3 * lowest, rel=1e-9)
    assert found.clamped == ("torque",)
    for name, at in (
        ("speed", (500.0,)), ("temperature", (3.0, 400.0)), ("axial_load", (30.0, 303.15, 6000.0)),
    ):  # fmt: skip
        preload = 9e3 if name == "axial_load" else 2e3
        assert name in estimate(nut_map, float(torque_of(nut_map, preload, *at)), *at).clamped


def test_preload_is_not_in_range_with_a_separated_nut(nut_map):
    for axial in (4000.0, -4000.0):
        model = OverPreload(nut_map, 30.0, 303.15, axial, SETS[0], REGULARIZATION)
        parting = model.separation_preload()
        assert 0.2 * abs(axial) < parting < 0.5 * abs(axial)
        torques = [model.torque(share * parting)[0] for share in (0.0, 0.5, 0.999, 1.0, 1.01)]
        assert torques[:4] == pytest.approx([torques[0]] * 4, rel=1e-6)
        assert torques[4] > torques[0] * (1.0 + 1e-4)
        for torque in (torques[0], 0.7 * torques[0]):
            found = estimate(nut_map, torque, 30.0, axial_load=axial)
            assert found.preload == pytest.approx(parting, rel=1e-10)
            assert (found.torque_sensitivity, found.clamped) == (0.0, ("torque",))
        found = estimate(nut_map, torques[4], 30.0, axial_load=axial)
        assert found.preload == pytest.approx(1.01 * parting, rel=1e-9)


@pytest.mark.parametrize("file", [None, PACKAGED_VG100])
def test_torque_rises_with_preload_and_in_thick_films_with_speed(file):
    """Over the packaged maps, but the lowest cell, where splines swing. In thick films it falls with temperature."""
    nut_map = load_map(None, load_screw(file))
    preload = np.geomspace(4.0 * nut_map.force.lo, nut_map.force.hi, 60)[:, None, None]
    speed = np.geomspace(nut_map.speed.lo, nut_map.speed.hi, 20)[:, None]
    temperature = np.linspace(nut_map.temperature.lo, nut_map.temperature.hi, 8)
    state = nut_map.evaluate(preload, speed, temperature)
    assert np.diff(state.friction_torque, axis=0).min() > 0.0
    if file is not None:
        thick = state.lambda_ratio > 3.0
        assert np.diff(state.friction_torque, axis=1)[thick[:, :-1]].min() > 0.0
        assert np.diff(state.friction_torque, axis=2)[thick[:, :, 1:]].max() < 0.0
