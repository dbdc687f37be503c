"""The map against the closed forms of the synthetic map: torques, films, limits, standstill law, refusals."""

import math

import numpy as np
import pytest
import synthetic_map
from synthetic_map import DEFAULTS, LAWS, closed_form, make_map

from ballscrew_tehl import load_map, load_screw
from ballscrew_tehl.parameters.file import PACKAGED_VG100
from ballscrew_tehl.runtime.constants import LEAST_HALF, REST
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import Law, MapError, npz_bytes, sealed

MAPS = {law: closed_form(law) for law in LAWS}
NUT_MAP = MAPS[Law.THREE_PARAMETER]
FREE = 0.3
OVERSIZE = closed_form(Law.MECHANISTIC, FREE)
T = 303.15
LOWEST = synthetic_map.AXIS["speed"][0]


@pytest.fixture(params=LAWS)
def nut_map(request):
    return MAPS[request.param]


def nut_torques(law, force, speed, temperature, ratio, net, roughness, breakaway):
    """Torques of one nut from the closed formulas of the synthetic map, at a speed of its axis."""
    g = synthetic_map.surfaces(force, speed, temperature, law)
    c = synthetic_map.force_curves(force)
    if law == Law.MECHANISTIC:
        oil = smooth_least(synthetic_map.gap_drag(speed, temperature) * c[5], c[6])
        return np.array([ratio * np.sum(g[0:2]) + oil, c[0], g[2] + net * c[1] * g[3]])
    share = 1.0 / (1.0 + (roughness / g[2:4]) ** 2)
    return np.array([ratio * np.sum(g[0:2] * share), c[0], net * c[1]])


def smooth_least(drag, limit):
    """Drag of the oil between balls [N.m] that contacts transmit up to a limit."""
    return (drag**-4.0 + limit**-4.0) ** -0.25


def forces(preload, axial_load):
    side = 0 if axial_load > 0 else 1
    s = abs(axial_load) / (preload * synthetic_map.separation_ratio(preload)[side])
    relieved = preload * synthetic_map.relieved_share(preload, s)[side] ** 1.5 if s < 1 else 0.0
    return relieved, relieved + abs(axial_load)


def test_torques_are_the_sum_of_two_nuts_of_the_closed_formulas(nut_map):
    friction = 8.8, 0.0037, 15e-9, 3.0
    for axial_load in (0.0, 900.0, -2500.0):
        state = nut_map.evaluate(1700.0, 47.0, 311.0, axial_load, *friction)
        nuts = [nut_torques(nut_map.law, f, 47.0, 311.0, *friction) for f in forces(1700.0, axial_load)]
        assert state[:3] == pytest.approx(sum(nuts), rel=1e-9)
        relieved = state.relieved_viscous_torque, state.relieved_coulomb_torque
        assert relieved == pytest.approx((nuts[0][0], sum(nuts[0][1:])), rel=1e-9)
        assert (state.in_range, state.clamped) == (True, ())
        assert nut_map.evaluate(1700.0, -47.0, 311.0, axial_load, *friction) == state
    defaults = nut_map.header["defaults"]
    assert nut_map.evaluate(2000.0, 0.1, T) == nut_map.evaluate(2000.0, 0.1, T, **defaults)


def test_extremes_come_from_the_nut_and_the_raceway_that_carry_them(nut_map):
    relieved, loaded = forces(1700.0, 1500.0)
    g, c = synthetic_map.surfaces(loaded, 47.0, 311.0), synthetic_map.force_curves(loaded)
    assert loaded > 1700.0 > relieved
    state = nut_map.evaluate(1700.0, 47.0, 311.0, 1500.0)
    assert state[3:9] == pytest.approx((g[5], *g[6:9], *c[-2:]), rel=1e-9)
    height = nut_map.header["defaults"]["roughness_height"]
    assert state.lambda_ratio == pytest.approx(g[5] / height, rel=1e-9)


def test_a_temperature_difference_acts_by_the_preload_that_it_leaves(nut_map):
    """By the closed form of the synthetic map; 0 changes no bit; what it takes away is 0 and flagged."""
    for difference in (-30.0, -7.0, 4.0, 12.0):
        stretched = math.asinh(difference * math.sinh(3.0) / 20.0) / 3.0
        power = 1700.0 ** (2.0 / 3.0) + synthetic_map.shift(1700.0, max(stretched, -1.0))
        state = nut_map.evaluate(1700.0, 47.0, T, 300.0, temperature_difference=difference)
        assert state.preload_actual == pytest.approx(power**1.5, rel=1e-9)
        assert state[:10] == nut_map.evaluate(state.preload_actual, 47.0, T, 300.0)[:10]
        assert state.in_range == (difference > -20.0)
        assert (nut_map.range_margin((1700.0, 47.0, T, 300.0), difference) >= 0.0) == state.in_range
    lost = nut_map.evaluate(60.0, 47.0, T, np.array([0.0, 900.0]), temperature_difference=18.0)
    assert (lost.preload_actual == 0.0).all()
    assert not lost.in_range.any()
    assert lost.clamped == ("preload", "temperature_difference")
    assert nut_map.range_margin((60.0, 47.0, T, 900.0), 18.0) < 0.0
    same = nut_map.evaluate(1700.0, 47.0, T, 300.0, temperature_difference=0.0)
    assert same == nut_map.evaluate(1700.0, 47.0, T, 300.0)
    with pytest.raises(ValueError, match="temperature_difference = nan"):
        nut_map.evaluate(1700.0, 47.0, T, temperature_difference=math.nan)


def test_scalars_and_arrays_give_the_same_numbers(nut_map):
    rng, n, seen = np.random.default_rng(3), 200, set()
    preload = rng.uniform(-10.0, 14000.0, n)
    speed = rng.uniform(-400.0, 400.0, n) * rng.choice([1.0, 1e-3], n)
    temperature = rng.uniform(270.0, 370.0, n)
    axial = rng.uniform(-20000.0, 20000.0, n) * rng.choice([0.0, 1.0], n)
    other = {"roughness_height": 1e-8, "breakaway_factor": 1.7}
    many = nut_map.evaluate(preload, speed, temperature, axial, **other)
    for m, point in enumerate(np.transpose([preload, speed, temperature, axial]).tolist()):
        one = nut_map.evaluate(*point, **other)
        assert [x[m] for x in many[:10]] == pytest.approx(one[:10], rel=1e-10)
        assert many.in_range[m] == one.in_range
        seen.update(one.clamped)
    assert set(many.clamped) == seen == {"preload", "speed", "temperature", "axial_load"}
    assert nut_map.evaluate(1000, 50, 303) == nut_map.evaluate(1000.0, 50.0, 303.0)
    state = nut_map.evaluate(np.array([[1000.0], [2000.0]]), np.array([1.0, 10.0, 100.0]), T)
    assert state.viscous_torque.shape == (2, 3)
    assert state.viscous_torque[1, 2] == pytest.approx(nut_map.evaluate(2000.0, 100.0, T).viscous_torque)


def test_beyond_the_map_is_clamped_and_flagged():
    for point, name, same_as in (
        ((13000.0, 30.0, T), "preload", (12000.0, 30.0, T)), ((2000.0, 400.0, T), "speed", (2000.0, 320.0, T)),
        ((2000.0, 30.0, 0.0), "temperature", (2000.0, 30.0, 283.15)), ((-1.0, 30.0, T), "preload", (0.0, 30.0, T)),
        ((2000.0, 30.0, 400.0), "temperature", (2000.0, 30.0, 353.15)),
    ):  # fmt: skip
        state = NUT_MAP.evaluate(*point)
        assert (state.clamped, state.in_range) == ((name,), False)
        assert state[:10] == NUT_MAP.evaluate(*same_as)[:10]
    state = NUT_MAP.evaluate(2000.0, 30.0, T, 15000.0)
    assert (state.in_range, state.clamped) == (False, ("axial_load",))
    assert state.ball_load_max == pytest.approx(synthetic_map.force_curves(12000.0)[-1], rel=1e-9)
    free, light = (NUT_MAP.evaluate(preload, 30.0, T, -3000.0) for preload in (0.0, 1e-3))
    assert (free.in_range, light.in_range, free[:10]) == (True, False, pytest.approx(light[:10], rel=1e-9))


def test_below_the_force_axis_the_power_laws_of_hertz_hold(nut_map):
    end, low = nut_map.evaluate(50.0, 30.0, T), nut_map.evaluate(50.0 / 8.0, 30.0, T)
    rolling = []
    for state, factor in ((end, 1.0), (low, 1.0 / 8.0)):
        _, _, _, _, _, gaps, limit, *_ = synthetic_map.force_curves(50.0)
        oil = smooth_least(synthetic_map.gap_drag(30.0, T) * gaps, factor * limit)
        rolling.append(state.viscous_torque - 2.0 * oil * (nut_map.law == Law.MECHANISTIC))
    assert rolling[1] == pytest.approx(rolling[0] / 4.0, rel=1e-9)
    for name, ratio in (
        ("sliding_torque", 8.0), ("hysteresis_torque", 16.0), ("contact_pressure_max", 2.0),
        ("film_temperature_rise", 2.0), ("ball_load_max", 8.0), ("film_thickness_min", 1.0),
    ):  # fmt: skip
        assert getattr(low, name) == pytest.approx(getattr(end, name) / ratio, rel=1e-12)
    assert low.clamped == ("preload",)
    none = nut_map.evaluate(0.0, 30.0, T)
    assert none[:3] == (0.0, 0.0, 0.0)
    assert (none.contact_pressure_max, none.ball_load_max, none.film_temperature_rise) == (0.0, 0.0, 0.0)
    assert all(math.isfinite(x) for x in none[:10])


def test_range_margin_is_the_least_distance_from_the_limits(nut_map):
    """Against the closed form of the forces; its sign is in_range."""
    axes, rng = nut_map.header["axes"], np.random.default_rng(7)
    (low, _), (_, highest) = axes["preload"][:2], axes["force"][:2]
    cold, hot, fastest = *axes["temperature"][:2], axes["speed"][1]
    signs = set()
    for n in range(400):
        preload, speed = rng.uniform(0.5 * low, 1.05 * highest), rng.uniform(-1.05, 1.05) * fastest
        preload *= n % 10 > 0
        temperature = rng.uniform(cold - 3.0, hot + 3.0)
        axial_load = 0.0 if n % 3 == 0 or preload > highest else rng.normal() * 0.5 * highest
        held = preload or abs(axial_load)
        expected = [
            (held - low) / (highest - low), (highest - held) / (highest - low),
            (temperature - cold) / (hot - cold), (hot - temperature) / (hot - cold), 1.0 - abs(speed) / fastest,
        ]  # fmt: skip
        if axial_load:
            expected.append(1.0 - (forces(preload, axial_load)[1] if preload else held) / highest)
        margin = nut_map.range_margin((preload, speed, temperature, axial_load))
        assert margin == pytest.approx(min(expected), rel=2e-3, abs=1e-6)  # splines of the forces
        assert (margin >= 0.0) == nut_map.evaluate(preload, speed, temperature, axial_load).in_range
        signs.add(margin >= 0.0)
    assert signs == {True, False}


def slopes_at(function, x):
    """One-sided differences of second order."""
    h = 1e-4 * x
    return [
        sign * (4.0 * function(x + sign * h) - function(x + 2.0 * sign * h) - 3.0 * function(x)) / (2.0 * h)
        for sign in (-1.0, 1.0)
    ]


def test_viscous_torque_and_films_towards_rest(nut_map):
    for roughness in (0.0, 24e-9, 200e-9):

        def torque(speed, roughness=roughness):
            return nut_map.evaluate(2000.0, speed, T, 700.0, roughness_height=roughness).viscous_torque

        below, above = slopes_at(torque, LOWEST)
        assert below == pytest.approx(above, rel=1e-5)  # truncation of the one-sided differences
        assert torque(0.0) == 0.0
        # linear at rest
        assert torque(1e-9 * LOWEST) == pytest.approx(1e-6 * torque(1e-3 * LOWEST), rel=1e-3)
        assert (np.diff([torque(s) for s in np.linspace(0.0, 1.2 * LOWEST, 200)]) > 0.0).all()
    rest, half, lowest = (nut_map.evaluate(2000.0, speed, T) for speed in (0.0, 0.5 * LOWEST, LOWEST))
    assert (rest.film_thickness_min, rest.film_temperature_rise, rest.lambda_ratio) == (0.0, 0.0, 0.0)
    assert half.film_thickness_min == pytest.approx(lowest.film_thickness_min * 0.5**0.67)
    assert half.film_temperature_rise == pytest.approx(lowest.film_temperature_rise * 0.5)
    assert rest.in_range
    assert rest.contact_pressure_max == lowest.contact_pressure_max > 0.0
    assert nut_map.evaluate(2000.0, 30.0, T, roughness_height=0.0).lambda_ratio == 1000.0


def test_sliding_torque_of_film_shear_rises_to_breakaway():
    def sliding(speed, breakaway):
        return NUT_MAP.evaluate(2000.0, speed, T, breakaway_factor=breakaway).sliding_torque

    for s in (0.0, 0.25, 0.5, 0.9):
        t = (1.0 + REST) * s**2 / (s + REST)
        expected = (3.0 - 2.0 * (1.0 + LEAST_HALF) * t / (t + LEAST_HALF)) * sliding(LOWEST, 1.0)
        assert sliding(s * LOWEST, 3.0) == pytest.approx(expected, rel=1e-12)
        assert sliding(s * LOWEST, 1.0) == pytest.approx(sliding(LOWEST, 3.0), rel=1e-12)


@pytest.mark.parametrize("breakaway", [1.5, 2.0, 5.0])
def test_ball_friction_rises_smoothly_to_breakaway_at_standstill(breakaway):
    nut_map = MAPS[Law.MECHANISTIC]
    one, none = (nut_map.evaluate(2e3, 320.0, T, net_sliding_coefficient=k).sliding_torque for k in (1, 0))
    thick = (one - none) / synthetic_map.surfaces(2000.0, 320.0, T, Law.MECHANISTIC)[3]

    def factor(speed):  # 1e9: without the shear of the raceways
        state = nut_map.evaluate(2000.0, speed, T, net_sliding_coefficient=1e9, breakaway_factor=breakaway)
        return state.sliding_torque / (1e9 * thick)

    assert factor(0.0) == pytest.approx(breakaway, rel=1e-8)
    slowest = synthetic_map.surfaces(2000.0, LOWEST, T, Law.MECHANISTIC)[3]
    assert factor(LOWEST) == pytest.approx(slowest, rel=1e-8)
    if breakaway > 1.5:  # where the slope of the map is not above the steepest of the law
        below, above = slopes_at(factor, LOWEST)
        assert below == pytest.approx(above, rel=1e-5)
    assert np.max(np.diff([factor(s) for s in np.linspace(0.0, 1.2 * LOWEST, 200)])) < 0.0
    # no cusp at rest
    fall = [breakaway - factor(share * LOWEST) for share in (2e-5, 1e-5)]
    assert fall[0] / fall[1] == pytest.approx(4.0, rel=0.01)
    alone = {"net_sliding_coefficient": 1e9, "breakaway_factor": 1.2}
    slow, low = (nut_map.evaluate(2000.0, speed, T, **alone).sliding_torque for speed in (LOWEST, 0.0))
    assert low == pytest.approx(slow, rel=1e-8)  # below the friction of the slowest node: no effect


def test_shear_of_raceways_rises_to_that_of_asperities_at_standstill():
    """From the slope of the map at its lowest speed, here upwards with speed, through a dip; off with breakaway 1."""
    nut_map, shear = MAPS[Law.MECHANISTIC], {"net_sliding_coefficient": 0.0}

    def torque(speed):
        return nut_map.evaluate(2000.0, speed, T, **shear).sliding_torque

    # twice the shear of the asperities of a nut, as the lowest speed of a map is too high to be without a film
    assert torque(0.0) == pytest.approx(2.0 * synthetic_map.force_curves(2000.0)[4], rel=1e-9)
    below, above = slopes_at(torque, LOWEST)
    assert below == pytest.approx(above, rel=1e-3)
    assert above > 0.0
    assert min(torque(s * LOWEST) for s in (0.5, 0.7, 0.9)) < torque(LOWEST) < torque(0.0)
    off = nut_map.evaluate(2000.0, 0.0, T, breakaway_factor=1.0, **shear).sliding_torque
    assert off == pytest.approx(torque(LOWEST), rel=1e-9)


def test_an_axial_load_that_leaves_oversize_balls_half_held_is_out_of_range():
    loads = np.linspace(10.0, 6000.0, 200)
    held = [load for load in loads if OVERSIZE.evaluate(1700.0, 47.0, T, load).in_range]
    assert held == list(loads[: len(held)])
    relieved, loaded = forces(1700.0, held[-1])
    assert relieved / loaded == pytest.approx(0.4, abs=0.01)
    for load in (held[-1], held[-1] + 60.0, 9000.0, 0.0):
        state = OVERSIZE.evaluate(1700.0, 47.0, T, load)
        many = OVERSIZE.evaluate(1700.0, 47.0, T, np.array([load]))
        margin = OVERSIZE.range_margin((1700.0, 47.0, T, load))
        assert state.in_range == many.in_range[0] == (margin >= 0.0)
        assert state.clamped == (() if state.in_range else ("axial_load",))
    assert MAPS[Law.MECHANISTIC].evaluate(1700.0, 47.0, T, 9000.0).in_range


@pytest.mark.parametrize("speed", [47.0, 0.1])
def test_oversize_balls_roll_freely_where_the_axial_load_has_freed_two_flanks(speed):
    """Held by all four flanks up to a large axial load; beyond separation their shear is that of two flanks, and balls
    slide on each other as fast as free ones."""
    plain, at = MAPS[Law.MECHANISTIC], (1700.0, speed, 311.0)
    for load in (0.0, 1000.0, -1000.0):
        held, ours = (m.evaluate(*at, load).sliding_torque for m in (plain, OVERSIZE))
        assert held * (1.0 - 5e-4) <= ours <= held * (1.0 + 1e-12)
    relieved, loaded = forces(1700.0, 9000.0)
    assert relieved == 0.0
    # without balls on each other the sliding torque is the shear
    alone = {"net_sliding_coefficient": 0.0}
    shear, found = (m.evaluate(*at, 9e3, **alone).sliding_torque for m in (plain, OVERSIZE))
    free = FREE * (loaded / 1000.0) ** -0.05
    # the two branches are joined smoothly: at 0.3 by 3e-5 of the smaller one
    assert found == pytest.approx(free * shear, rel=1e-4)
    both = OVERSIZE.evaluate(*at, 9000.0).sliding_torque - plain.evaluate(*at, 9000.0).sliding_torque
    on_balls = plain.evaluate(*at, 9e3).sliding_torque - shear
    assert both == pytest.approx((free - 1.0) * shear + (0.72 - 1.0) * on_balls, rel=1e-3)


def test_arguments_that_cannot_be_used_are_named():
    names = ("preload", "speed", "temperature", "axial_load", *DEFAULTS)
    for place, name in enumerate(names):
        for bad in (math.nan, math.inf, *((-0.1,) if place >= 4 else ())):
            arguments = [2000.0, 30.0, T, 0.0, *DEFAULTS.values()]
            arguments[place] = bad
            for given in (arguments, [np.array([a]) for a in arguments]):
                with pytest.raises(ValueError, match=f"{name} = {bad}; needs a finite number"):
                    NUT_MAP.evaluate(*given)
    with pytest.raises(ValueError, match=r"temperature = 30 K; is 303.15 K meant"):
        NUT_MAP.evaluate(2000.0, 30.0, np.array([T, 30.0]))


def test_npz_round_trip_is_exact_and_damage_is_refused(tmp_path, nut_map):
    path = tmp_path / "map.npz"
    whole = npz_bytes(nut_map.header, nut_map.arrays)
    path.write_bytes(whole)
    again = NutMap.from_npz(path)
    assert again.header == nut_map.header
    assert again.evaluate(1234.0, -5.0, 320.0, 99.0) == nut_map.evaluate(1234.0, -5.0, 320.0, 99.0)
    same, other = (make_map(factor, law=nut_map.law) for factor in (1.0, 1.01))
    assert npz_bytes(same.header, same.arrays) == whole != npz_bytes(other.header, other.arrays)
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(MapError, match="not a readable nut map"):
        NutMap.from_npz(path)
    with pytest.raises(FileNotFoundError):
        NutMap.from_npz(tmp_path / "none.npz")
    assert sealed({**nut_map.header, "content_hash": "other"}, nut_map.arrays) == nut_map.header
    other = sealed({**nut_map.header, "version": "other"}, nut_map.arrays)
    assert other["content_hash"] != nut_map.header["content_hash"]
    arrays = nut_map.arrays | {"coefficients": nut_map.arrays["coefficients"] + 1e-12}
    for header, damaged, message in (
        (nut_map.header, arrays, "content hash .*; expected"),
        (nut_map.header | {"format_version": 99}, nut_map.arrays, "format version 99; expected"),
    ):
        with pytest.raises(MapError, match=message):
            NutMap(header, damaged)


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
        # in a film of 60 um the contacts transmit no more drag, and heat and supply take from the rolling loss
        thick = (state.lambda_ratio > 3.0) & (state.lambda_ratio < 300.0)
        assert np.diff(state.friction_torque, axis=1)[thick[:, :-1]].min() > 0.0
        assert np.diff(state.friction_torque, axis=2)[thick[:, :, 1:]].max() < 0.0
