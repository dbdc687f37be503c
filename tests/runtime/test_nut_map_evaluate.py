import math

import numpy as np
import pytest
import synthetic_map
from synthetic_map import DEFAULTS, make_map

from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import MapError, sealed

NUT_MAP = make_map()
T = 303.15


def nut_torques(force, speed, temperature, ratio, net, roughness):
    """Torques of one nut from the closed formulas of the synthetic map."""
    g = synthetic_map.surfaces(force, speed, temperature)
    c = synthetic_map.force_curves(force)
    share = 1.0 / (1.0 + (roughness / g[2:4]) ** 2)
    return np.array([ratio * np.sum(g[0:2] * share), c[0], net * c[1]])


def forces(preload, axial_load):
    side = 0 if axial_load > 0 else 1
    s = abs(axial_load) / (preload * synthetic_map.separation_ratio(preload)[side])
    relieved = preload * synthetic_map.relieved_share(preload, s)[side] ** 1.5 if s < 1 else 0.0
    return relieved, relieved + abs(axial_load)


@pytest.mark.parametrize("axial_load", [0.0, 900.0, -2500.0])
def test_torques_are_the_sum_of_two_nuts_of_the_closed_formulas(axial_load):
    state = NUT_MAP.evaluate(1700.0, 47.0, 311.0, axial_load, 8.8, 0.0037, 15e-9)
    nuts = [nut_torques(f, 47.0, 311.0, 8.8, 0.0037, 15e-9) for f in forces(1700.0, axial_load)]
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


def test_defaults_come_from_the_header():
    assert NUT_MAP.evaluate(2000.0, 10.0, T) == NUT_MAP.evaluate(2000.0, 10.0, T, 0.0, *DEFAULTS.values())


def test_scalars_and_arrays_give_the_same_numbers():
    rng = np.random.default_rng(3)
    n = 200
    preload = rng.uniform(-10.0, 14000.0, n)
    speed = rng.uniform(-400.0, 400.0, n) * rng.choice([1.0, 1e-3], n)
    temperature = rng.uniform(270.0, 370.0, n)
    axial = rng.uniform(-20000.0, 20000.0, n) * rng.choice([0.0, 1.0], n)
    many = NUT_MAP.evaluate(preload, speed, temperature, axial, roughness_height=1e-8)
    seen = set()
    for m in range(n):
        one = NUT_MAP.evaluate(
            float(preload[m]), float(speed[m]), float(temperature[m]), float(axial[m]), roughness_height=1e-8
        )
        assert [x[m] for x in many[:10]] == pytest.approx(one[:10], rel=1e-12)
        assert many.in_range[m] == one.in_range
        seen.update(one.clamped)
    assert set(many.clamped) == seen == {"preload", "speed", "temperature", "axial_load"}


def test_arrays_broadcast():
    state = NUT_MAP.evaluate(np.array([[1000.0], [2000.0]]), np.array([1.0, 10.0, 100.0]), T)
    assert state.viscous_torque.shape == (2, 3)
    assert state.viscous_torque[1, 2] == pytest.approx(NUT_MAP.evaluate(2000.0, 100.0, T).viscous_torque)


def test_friction_is_even_in_speed():
    assert NUT_MAP.evaluate(2000.0, -30.0, T, 500.0) == NUT_MAP.evaluate(2000.0, 30.0, T, 500.0)


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


def test_torque_is_zero_without_preload():
    state = NUT_MAP.evaluate(0.0, 30.0, T)
    assert state[:3] == (0.0, 0.0, 0.0)
    assert (state.contact_pressure_max, state.ball_load_max, state.film_temperature_rise) == (0.0, 0.0, 0.0)
    assert not state.in_range
    assert all(math.isfinite(x) for x in state[:10])


def test_below_the_force_axis_the_power_laws_of_hertz_hold():
    end, low = NUT_MAP.evaluate(50.0, 30.0, T), NUT_MAP.evaluate(50.0 / 8.0, 30.0, T)
    assert low.viscous_torque == pytest.approx(end.viscous_torque / 4.0, rel=1e-12)
    assert low.sliding_torque == pytest.approx(end.sliding_torque / 8.0, rel=1e-12)
    assert low.hysteresis_torque == pytest.approx(end.hysteresis_torque / 16.0, rel=1e-12)
    assert low.contact_pressure_max == pytest.approx(end.contact_pressure_max / 2.0, rel=1e-12)
    assert low.ball_load_max == pytest.approx(end.ball_load_max / 8.0, rel=1e-12)
    assert low.clamped == ("preload",)


def test_torque_is_in_range_and_continuous_where_a_nut_separates():
    separation = 2000.0 * float(synthetic_map.separation_ratio(2000.0)[0])
    before, after = (NUT_MAP.evaluate(2000.0, 30.0, T, separation * (1.0 + e)) for e in (-1e-9, 1e-9))
    assert before.in_range
    assert after.in_range
    assert before[:3] == pytest.approx(after[:3], rel=1e-6)
    alone = nut_torques(separation, 30.0, T, *DEFAULTS.values())
    assert after[:3] == pytest.approx(alone, rel=1e-6)


@pytest.mark.parametrize("roughness", [0.0, 24e-9, 200e-9])
def test_standstill_law_is_smooth_and_rises_with_speed(roughness):
    lo = synthetic_map.AXIS["speed"][0]

    def torque(speed):
        return NUT_MAP.evaluate(2000.0, speed, T, 700.0, roughness_height=roughness).viscous_torque

    step = 1e-5 * lo
    below, above = (torque(lo) - torque(lo - step)) / step, (torque(lo + step) - torque(lo)) / step
    assert below == pytest.approx(above, rel=2e-4)  # truncation of the one-sided differences
    assert torque(0.0) == 0.0
    assert torque(1e-9 * lo) == pytest.approx(1e-6 * torque(1e-3 * lo), rel=1e-3)  # linear at rest
    assert (np.diff([torque(s) for s in np.linspace(0.0, 1.2 * lo, 200)]) > 0.0).all()


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


@pytest.mark.parametrize("place", range(7))
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


def test_npz_round_trip_is_exact_and_reproducible(tmp_path):
    path = tmp_path / "map.npz"
    path.write_bytes(NUT_MAP.to_npz())
    again = NutMap.from_npz(path)
    assert again.header == NUT_MAP.header
    assert again.evaluate(1234.0, -5.0, 320.0, 99.0) == NUT_MAP.evaluate(1234.0, -5.0, 320.0, 99.0)
    assert again.to_npz() == path.read_bytes() == make_map().to_npz()
    assert make_map(1.01).to_npz() != path.read_bytes()


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
        (lambda h, a: h.update(format_version=99), "format version 99; expected 1"),
        (lambda h, a: h["axes"].pop("share"), "axes share missing"),
        (lambda h, a: h.update(defaults={}), "defaults apparent_viscosity_ratio"),
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
