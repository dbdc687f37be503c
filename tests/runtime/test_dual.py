"""Dual numbers compared with finite differences, alone and in the friction law of the nut."""

import math

import pytest

from ballscrew_tehl.runtime.constants import FREE_PUSH
from ballscrew_tehl.runtime.dual import DUALS, Dual
from ballscrew_tehl.runtime.nut_law import FLOATS, NUT_TORQUES, Spin, freed_shear, nut_forces
from ballscrew_tehl.runtime.packed import FILM_SHEAR, MECHANISTIC, FrictionParameters

WIDTH = 1e-6
AGREEMENT = 1e-8  # of central differences: WIDTH^2 and rounding over WIDTH


def slope_of(function, x):
    return (function(x + WIDTH) - function(x - WIDTH)) / (2.0 * WIDTH)


@pytest.mark.parametrize(
    "function",
    [
        lambda x: x + 2.0 * x - x * x,
        lambda x: 3.0 - x / 2.0 + 1.0 / x,
        lambda x: (x * x + 1.0) / (2.0 + x),
        lambda x: x**1.5 + x**2 + (1.0 + x) ** (1.0 / 3.0),
        lambda x: 1.0 - x - (x - 1.0),
    ],
)
def test_value_and_slope_of_an_expression(function):
    for x in (0.3, 1.0, 2.7):
        found = function(Dual(x, 1.0))
        assert found.value == function(x)
        assert found.slope == pytest.approx(slope_of(function, x), rel=AGREEMENT, abs=AGREEMENT)


def test_a_power_at_zero_has_no_slope():
    assert (Dual(0.0, 1.0) ** 1.5).slope == 0.0
    assert (Dual(0.0, 1.0) ** (1.0 / 3.0)).slope == 0.0


SURFACES = {FILM_SHEAR: (-3.0, -2.5, -17.0, -17.2), MECHANISTIC: (-3.0, -2.5, -3.5, 0.2)}
SLOPES = {FILM_SHEAR: (0.4, 0.5, 0.65, 0.66), MECHANISTIC: (0.4, 0.5, 0.05, -0.3)}


@pytest.mark.parametrize("law", SURFACES)
@pytest.mark.parametrize("breakaway", [1.0, 2.0])
@pytest.mark.parametrize("s", [0.3, 1.0])
@pytest.mark.parametrize("f", [0.2, 1.0])
def test_torques_of_a_nut_with_their_slopes(s, f, breakaway, law):
    """Surfaces that are linear in x; below the axis the force over its low end changes as well."""
    surfaces, rates = SURFACES[law], (0.9, 0.7, -0.06, -0.05)
    slopes, curves = SLOPES[law], (-5.0, 4.0, -1.0)
    friction = FrictionParameters(7.6, 0.0051, 24e-9, breakaway)

    def along(x, number):
        at = [number(v + r * x, r) for v, r in zip(surfaces, rates, strict=True)]
        over_speed = None if s == 1.0 else [number(v + 0.1 * x, 0.1) for v in slopes]
        force = f if f == 1.0 else number(f * math.exp(x), f * math.exp(x))
        lines = [number(v + 1.2 * x, 1.2) for v in curves]
        ops = DUALS if number is Dual else FLOATS
        *torques, spin = NUT_TORQUES[law](at, over_speed, lines, force, s, friction, ops)
        return [*torques, *(spin or ())]

    found = along(0.0, Dual)
    for n, part in enumerate(found):
        assert part.value == along(0.0, lambda v, _: v)[n]
        expected = slope_of(lambda x, n=n: along(x, lambda v, _: v)[n], 0.0)
        assert part.slope == pytest.approx(expected, rel=AGREEMENT)


@pytest.mark.parametrize("load", [100.0, 5000.0])
def test_forces_of_the_nuts_with_their_slopes(load):
    """At 5000 N one nut has separated: the other carries the load, independent of the preload."""

    def forces(preload, ops):
        separation = Dual(0.7, 0.0) if ops is DUALS else 0.7
        return nut_forces(preload, load, separation, lambda share: 1.0 - share, ops)

    relieved, loaded = forces(Dual(1000.0, 1.0), DUALS)
    for n, found in enumerate((relieved, loaded)):
        assert found.value == forces(1000.0, FLOATS)[n]
        expected = (forces(1000.1, FLOATS)[n] - forces(999.9, FLOATS)[n]) / 0.2
        assert found.slope == pytest.approx(expected, rel=1e-7)
    assert (relieved.value == 0.0) == (load == 5000.0)


@pytest.mark.parametrize("push", [0.001, 0.3, 20.0])
@pytest.mark.parametrize("free", [0.2, 0.9, 1.0])
def test_shear_of_oversize_balls_with_its_slope(free, push):
    """From free to held by all flanks; without oversize balls nothing is taken off."""

    def freed(x, number):
        relieved = Spin(number(0.01 + 0.02 * x, 0.02), number(free, 0.0), number(push + 0.1 * x, 0.1))
        loaded = Spin(number(0.05 - 0.01 * x, -0.01), number(free, 0.0), number(9.0, 0.0))
        return freed_shear(relieved, loaded, DUALS if number is Dual else FLOATS)

    found, plain = freed(0.0, Dual), lambda x: freed(x, lambda v, _: v)
    assert found.value == plain(0.0)
    assert found.slope == pytest.approx(slope_of(plain, 0.0), rel=AGREEMENT, abs=1e-9)
    held, loose = 0.06, free * 0.05 + FREE_PUSH * push
    assert (
        found.value == 0.0
        if free == 1.0
        else min(held, loose) * 0.9 <= held + found.value <= min(held, loose)
    )
