import math

import numpy as np
import pytest
import synthetic_map
from synthetic_map import DEFAULTS, LAWS, make_map

from ballscrew_tehl.runtime.constants import LEAST_HALF, REST
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import FILM_SHEAR, MECHANISTIC, MapError, sealed

MAPS = {law: make_map(law=law) for law in LAWS}
NUT_MAP = MAPS[FILM_SHEAR]
T = 303.15


@pytest.fixture(params=LAWS)
def nut_map(request):
    return MAPS[request.param]


def nut_torques(law, force, speed, temperature, ratio, net, roughness, breakaway):
    """Torques of one nut from the closed formulas of the synthetic map, at a speed of its axis."""
    g = synthetic_map.surfaces(force, speed, temperature, law)
    c = synthetic_map.force_curves(force)
    if law == MECHANISTIC:
        return np.array([ratio * np.sum(g[0:2]), c[0], g[2] + net * c[1] * g[3]])
    share = 1.0 / (1.0 + (roughness / g[2:4]) ** 2)
    return np.array([ratio * np.sum(g[0:2] * share), c[0], net * c[1]])


def forces(preload, axial_load):
    side = 0 if axial_load > 0 else 1
    s = abs(axial_load) / (preload * synthetic_map.separation_ratio(preload)[side])
    relieved = preload * synthetic_map.relieved_share(preload, s)[side] ** 1.5 if s < 1 else 0.0
    return relieved, relieved + abs(axial_load)


@pytest.mark.parametrize("axial_load", [0.0, 900.0, -2500.0])
def test_torques_are_the_sum_of_two_nuts_of_the_closed_formulas(axial_load, nut_map):
    friction = 8.8, 0.0037, 15e-9, 3.0
    state = nut_map.evaluate(1700.0, 47.0, 311.0, axial_load, *friction)
    nuts = [nut_torques(nut_map.law, f, 47.0, 311.0, *friction) for f in forces(1700.0, axial_load)]
    assert state[:3] == pytest.approx(sum(nuts), rel=1e-9)
    assert state.in_range
    assert state.clamped == ()


def test_extremes_come_from_the_nut_and_the_raceway_that_carry_them():
    relieved, loaded = forces(1700.0, 1500.0)
    g, c = synthetic_map.surfaces(loaded, 47.0, 311.0), synthetic_map.force_curves(loaded)
    assert loaded > 1700.0 > relieved
    state = NUT_MAP.evaluate(1700.0, 47.0, 311.0, 1500.0)
    assert state.film_thickness_min == pytest.approx(g[5], rel=1e-9)
    assert state.film_thickness_central_screw == pytest.approx(g[6], rel=1e-9)
    assert state.film_thickness_central_nut == pytest.approx(g[7], rel=1e-9)
    assert state.film_temperature_rise == pytest.approx(g[8], rel=1e-9)
    assert (state.contact_pressure_max, state.ball_load_max) == pytest.approx((c[2], c[3]), rel=1e-9)
    assert state.lambda_ratio == pytest.approx(g[5] / DEFAULTS["roughness_height"], rel=1e-9)


def test_defaults_come_from_the_header(nut_map):
    defaults = nut_map.header["defaults"]
    assert nut_map.evaluate(2000.0, 0.1, T) == nut_map.evaluate(2000.0, 0.1, T, 0.0, *defaults.values())
    assert nut_map.evaluate(2000.0, 0.1, T) == nut_map.evaluate(2000.0, 0.1, T, **defaults)


def test_scalars_and_arrays_give_the_same_numbers(nut_map):
    rng = np.random.default_rng(3)
    n = 200
    preload = rng.uniform(-10.0, 14000.0, n)
    speed = rng.uniform(-400.0, 400.0, n) * rng.choice([1.0, 1e-3], n)
    temperature = rng.uniform(270.0, 370.0, n)
    axial = rng.uniform(-20000.0, 20000.0, n) * rng.choice([0.0, 1.0], n)
    other = {"roughness_height": 1e-8, "breakaway_factor": 1.7}
    many = nut_map.evaluate(preload, speed, temperature, axial, **other)
    seen = set()
    for m in range(n):
        one = nut_map.evaluate(
            float(preload[m]), float(speed[m]), float(temperature[m]), float(axial[m]), **other
        )
        assert [x[m] for x in many[:10]] == pytest.approx(one[:10], rel=1e-12)
        assert many.in_range[m] == one.in_range
        seen.update(one.clamped)
    assert set(many.clamped) == seen == {"preload", "speed", "temperature", "axial_load"}


def test_arrays_broadcast(nut_map):
    state = nut_map.evaluate(np.array([[1000.0], [2000.0]]), np.array([1.0, 10.0, 100.0]), T)
    assert state.viscous_torque.shape == (2, 3)
    assert state.viscous_torque[1, 2] == pytest.approx(nut_map.evaluate(2000.0, 100.0, T).viscous_torque)


def test_friction_is_even_in_speed(nut_map):
    assert nut_map.evaluate(2000.0, -30.0, T, 500.0) == nut_map.evaluate(2000.0, 30.0, T, 500.0)


@pytest.mark.parametrize(
    ("point", "name", "same_as"),
    [
        ((13000.0, 30.0, T), "preload", (12000.0, 30.0, T)),
        ((2000.0, 400.0, T), "speed", (2000.0, 320.0, T)),
        ((2000.0, 30.0, 0.0), "temperature", (2000.0, 30.0, 283.15)),
        ((2000.0, 30.0, 400.0), "temperature", (2000.0, 30.0, 353.15)),
        ((-1.0, 30.0, T), "preload", (0.0, 30.0, T)),
    ],
)
def test_beyond_the_map_is_clamped_and_flagged(point, name, same_as):
    state = NUT_MAP.evaluate(*point)
    assert state.clamped == (name,)
    assert not state.in_range
    assert state[:10] == NUT_MAP.evaluate(*same_as)[:10]


def test_an_axial_load_that_overloads_one_nut_is_flagged():
    state = NUT_MAP.evaluate(2000.0, 30.0, T, 15000.0)
    assert (state.in_range, state.clamped) == (False, ("axial_load",))
    assert state.ball_load_max == pytest.approx(synthetic_map.force_curves(12000.0)[3], rel=1e-9)


def test_torque_is_zero_without_preload(nut_map):
    state = nut_map.evaluate(0.0, 30.0, T)
    assert state[:3] == (0.0, 0.0, 0.0)
    assert (state.contact_pressure_max, state.ball_load_max, state.film_temperature_rise) == (0.0, 0.0, 0.0)
    assert not state.in_range
    assert all(math.isfinite(x) for x in state[:10])


def test_below_the_force_axis_the_power_laws_of_hertz_hold(nut_map):
    end, low = nut_map.evaluate(50.0, 30.0, T), nut_map.evaluate(50.0 / 8.0, 30.0, T)
    assert low.viscous_torque == pytest.approx(end.viscous_torque / 4.0, rel=1e-12)
    assert low.sliding_torque == pytest.approx(end.sliding_torque / 8.0, rel=1e-12)
    assert low.hysteresis_torque == pytest.approx(end.hysteresis_torque / 16.0, rel=1e-12)
    assert low.contact_pressure_max == pytest.approx(end.contact_pressure_max / 2.0, rel=1e-12)
    assert low.ball_load_max == pytest.approx(end.ball_load_max / 8.0, rel=1e-12)
    assert low.clamped == ("preload",)


def test_torque_is_in_range_and_continuous_where_a_nut_separates(nut_map):
    separation = 2000.0 * float(synthetic_map.separation_ratio(2000.0)[0])
    before, after = (nut_map.evaluate(2000.0, 30.0, T, separation * (1.0 + e)) for e in (-1e-9, 1e-9))
    assert before.in_range
    assert after.in_range
    assert before[:3] == pytest.approx(after[:3], rel=1e-6)
    alone = nut_torques(nut_map.law, separation, 30.0, T, *nut_map.defaults)
    assert after[:3] == pytest.approx(alone, rel=1e-6)


@pytest.mark.parametrize("roughness", [0.0, 24e-9, 200e-9])
def test_standstill_law_is_smooth_and_rises_with_speed(roughness, nut_map):
    lo = synthetic_map.AXIS["speed"][0]

    def torque(speed):
        return nut_map.evaluate(2000.0, speed, T, 700.0, roughness_height=roughness).viscous_torque

    below, above = slopes_at(torque, lo)
    assert below == pytest.approx(above, rel=1e-5)  # truncation of the one-sided differences
    assert torque(0.0) == 0.0
    assert torque(1e-9 * lo) == pytest.approx(1e-6 * torque(1e-3 * lo), rel=1e-3)  # linear at rest
    assert (np.diff([torque(s) for s in np.linspace(0.0, 1.2 * lo, 200)]) > 0.0).all()


def slopes_at(function, x):
    """One-sided differences of second order."""
    h = 1e-4 * x
    below, above = (
        sign * (4.0 * function(x + sign * h) - function(x + 2.0 * sign * h) - 3.0 * function(x)) / (2.0 * h)
        for sign in (-1.0, 1.0)
    )
    return below, above


@pytest.mark.parametrize("breakaway", [1.5, 2.0, 5.0])
def test_ball_friction_rises_smoothly_to_breakaway_at_standstill(breakaway):
    """Mechanistic: by the formula of the law, whose factor of the map is 1 in the thickest film."""
    nut_map, lo = MAPS[MECHANISTIC], synthetic_map.AXIS["speed"][0]
    ball = nut_map.evaluate(2000.0, 320.0, T, net_sliding_coefficient=1.0)
    thick = (
        ball.sliding_torque - nut_map.evaluate(2000.0, 320.0, T, net_sliding_coefficient=0.0).sliding_torque
    )
    thick /= synthetic_map.surfaces(2000.0, 320.0, T, MECHANISTIC)[3]

    def factor(speed):  # 1e9: without the shear of the raceways
        state = nut_map.evaluate(2000.0, speed, T, net_sliding_coefficient=1e9, breakaway_factor=breakaway)
        return state.sliding_torque / (1e9 * thick)

    assert factor(0.0) == pytest.approx(breakaway, rel=1e-8)
    assert factor(lo) == pytest.approx(synthetic_map.surfaces(2000.0, lo, T, MECHANISTIC)[3], rel=1e-8)
    if breakaway > 1.5:  # where the slope of the map is not above the steepest of the law
        below, above = slopes_at(factor, lo)
        assert below == pytest.approx(above, rel=1e-5)
    assert np.max(np.diff([factor(s) for s in np.linspace(0.0, 1.2 * lo, 200)])) < 0.0
    assert factor(-0.3 * lo) == factor(0.3 * lo)
    # no cusp at rest
    assert (breakaway - factor(2e-5 * lo)) / (breakaway - factor(1e-5 * lo)) == pytest.approx(4.0, rel=0.01)


def test_sliding_torque_of_the_fitted_sets_rises_to_breakaway_where_switched_on():
    lo = synthetic_map.AXIS["speed"][0]

    def sliding(speed, breakaway):
        return NUT_MAP.evaluate(2000.0, speed, T, breakaway_factor=breakaway).sliding_torque

    for s in (0.0, 0.25, 0.5, 0.9):
        t = (1.0 + REST) * s**2 / (s + REST)
        expected = (3.0 - 2.0 * (1.0 + LEAST_HALF) * t / (t + LEAST_HALF)) * sliding(lo, 1.0)
        assert sliding(s * lo, 3.0) == pytest.approx(expected, rel=1e-13)
        assert sliding(s * lo, 1.0) == sliding(s * lo, 0.0) == sliding(lo, 3.0) == sliding(30.0, 3.0)


def test_breakaway_below_the_friction_of_the_slowest_node_has_no_effect():
    nut_map = MAPS[MECHANISTIC]
    slow = nut_map.evaluate(2000.0, 0.5, T).sliding_torque
    for breakaway in (0.0, 1.0, 1.2):
        assert nut_map.evaluate(2000.0, 0.0, T, breakaway_factor=breakaway).sliding_torque == pytest.approx(
            slow, rel=1e-14
        )


def test_roughness_height_of_the_mechanistic_law_divides_the_film_only():
    one, two = (MAPS[MECHANISTIC].evaluate(2000.0, 0.3, T, roughness_height=h) for h in (1e-7, 2e-7))
    assert one.lambda_ratio == pytest.approx(2.0 * two.lambda_ratio, rel=1e-15)
    assert one._replace(lambda_ratio=0.0) == two._replace(lambda_ratio=0.0)


def test_film_and_temperature_rise_vanish_at_rest():
    rest, lowest = NUT_MAP.evaluate(2000.0, 0.0, T), NUT_MAP.evaluate(2000.0, 0.5, T)
    half = NUT_MAP.evaluate(2000.0, 0.25, T)
    assert (rest.film_thickness_min, rest.film_temperature_rise, rest.lambda_ratio) == (0.0, 0.0, 0.0)
    assert half.film_thickness_min == pytest.approx(lowest.film_thickness_min * 0.5**0.67)
    assert half.film_temperature_rise == pytest.approx(lowest.film_temperature_rise * 0.5)
    assert rest.in_range
    assert rest.contact_pressure_max == lowest.contact_pressure_max > 0.0


def test_lambda_ratio_of_a_smooth_surface_is_capped():
    assert NUT_MAP.evaluate(2000.0, 30.0, T, roughness_height=0.0).lambda_ratio == 1000.0
    assert NUT_MAP.evaluate(2000.0, 0.0, T, roughness_height=0.0).lambda_ratio == 0.0


@pytest.mark.parametrize("place", range(8))
@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_arguments_that_are_not_finite_are_named(place, bad):
    names = ("preload", "speed", "temperature", "axial_load", *DEFAULTS)
    arguments = [2000.0, 30.0, T, 0.0, *DEFAULTS.values()]
    arguments[place] = bad
    with pytest.raises(ValueError, match=f"{names[place]} = {bad}"):
        NUT_MAP.evaluate(*arguments)
    with pytest.raises(ValueError, match=f"{names[place]} = {bad}"):
        NUT_MAP.evaluate(*(np.array([a]) for a in arguments))


def test_a_negative_friction_parameter_is_refused():
    with pytest.raises(ValueError, match=r"net_sliding_coefficient = -0\.1; needs a finite number >= 0"):
        NUT_MAP.evaluate(2000.0, 30.0, T, net_sliding_coefficient=-0.1)


def test_npz_round_trip_is_exact_and_reproducible(tmp_path, nut_map):
    path = tmp_path / "map.npz"
    path.write_bytes(nut_map.to_npz())
    again = NutMap.from_npz(path)
    assert again.header == nut_map.header
    assert again.evaluate(1234.0, -5.0, 320.0, 99.0) == nut_map.evaluate(1234.0, -5.0, 320.0, 99.0)
    assert again.to_npz() == path.read_bytes() == make_map(law=nut_map.law).to_npz()
    assert make_map(1.01, law=nut_map.law).to_npz() != path.read_bytes()


def test_a_damaged_file_is_refused(tmp_path):
    path = tmp_path / "map.npz"
    whole = NUT_MAP.to_npz()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(MapError, match="not a readable nut map"):
        NutMap.from_npz(path)
    with pytest.raises(FileNotFoundError):
        NutMap.from_npz(tmp_path / "none.npz")


def test_changed_content_is_refused():
    arrays = {name: array.copy() for name, array in NUT_MAP.arrays.items()}
    arrays["coefficients"][3, 3, 3, 0] += 1e-12
    with pytest.raises(MapError, match=r"content hash .*; expected"):
        NutMap.from_arrays(NUT_MAP.header, arrays)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda h, a: h.update(format_version=99), "format version 99; expected 3"),
        (lambda h, a: h.pop("presliding_angle"), "presliding_angle None; expected a positive number"),
        (lambda h, a: h.update(presliding_angle=0.0), "presliding_angle 0.0; expected"),
        (lambda h, a: h.pop("law"), "law None; expected one of film_shear, mechanistic"),
        (lambda h, a: h.update(law="sticky"), "law sticky; expected one of"),
        (lambda h, a: h["axes"].pop("share"), "axes share missing"),
        (lambda h, a: h.update(defaults={}), "defaults apparent_viscosity_ratio"),
        (
            lambda h, a: h.update(defaults={n: v for n, v in DEFAULTS.items() if n != "breakaway_factor"}),
            "defaults breakaway_factor missing",
        ),
        (lambda h, a: h["axes"].update(force=[0.0, 10.0, 7]), "map axis force"),
        (lambda h, a: a.pop("force_coefficients"), "force_coefficients missing"),
        (
            lambda h, a: a.update(sharing_coefficients=np.ones((3, 3, 2))),
            r"shape \(3, 3, 2\); expected \(8, 7, 2\)",
        ),
        (lambda h, a: a["separation_coefficients"].fill(np.nan), "not finite"),
    ],
)
def test_a_map_of_another_format_is_refused(change, message):
    arrays = {name: array.copy() for name, array in NUT_MAP.arrays.items()}
    header = {**NUT_MAP.header, "axes": dict(NUT_MAP.header["axes"])}
    change(header, arrays)
    with pytest.raises(MapError, match=message):
        NutMap.from_arrays(header, arrays)


def test_the_content_hash_covers_header_and_arrays_but_not_itself():
    assert sealed({**NUT_MAP.header, "content_hash": "other"}, NUT_MAP.arrays) == NUT_MAP.header
    assert (
        sealed({**NUT_MAP.header, "version": "other"}, NUT_MAP.arrays)["content_hash"]
        != (NUT_MAP.header["content_hash"])
    )
    assert make_map(1.01).header["content_hash"] != NUT_MAP.header["content_hash"]
