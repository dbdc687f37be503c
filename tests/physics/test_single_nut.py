"""Single nuts: offset lead as a double nut in one piece; oversize balls between four flanks, with their limits."""

import json
import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
from closed_film import HamrockDowsonFilm
from hypothesis import given, settings
from hypothesis import strategies as st
from reference_screw import GD4008
from synthetic_contacts import GRID, closed_build, nut_map_of

from ballscrew_tehl.cli import main as cli
from ballscrew_tehl.friction.parts import spin_moment
from ballscrew_tehl.friction.sets import FrictionSet, default_friction_set
from ballscrew_tehl.friction.torque import double_nut_torque, four_point_spin_bound
from ballscrew_tehl.nut_map.contact_map import SolvedFilm
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.parameters.template import example_parameters, screw_template
from ballscrew_tehl.physics.ball_chain import ball_oversize
from ballscrew_tehl.physics.ball_law import (
    contact_angle_at_ball_load,
    contact_compliance,
    flank_law,
    flank_travel,
    groove_distance,
    loaded_contact_angle,
)
from ballscrew_tehl.physics.hertz import E_prime, ellipse, reduced_radii
from ballscrew_tehl.physics.kinematics import cage_speed, entrainment_speed, slip_field, spin_share
from ballscrew_tehl.physics.load import double_nut_loads, nut_loads, separation_load
from ballscrew_tehl.runtime.packed import FILM_SHEAR, MECHANISTIC

FOUR = changed(GD4008, screw={"preload_kind": "single_nut_oversize_ball"})
OFFSET = changed(GD4008, screw={"preload_kind": "single_nut_offset"})
ROLLING = {"friction": {"kinematics": "rolling_frame"}}
SCREW, BETA = FOUR.screw, FOUR.screw.contact_angle
SB = math.sin(BETA) * math.cos(SCREW.lead_angle)
FRICTION = FrictionSet("test", "published", "hamrock_dowson", 7.0, 0.005, 3e-8)


def stiffer(screw, factor):
    """The screw with bodies of sections that many times as large."""
    names = ("screw_section_area", "nut_section_area", "spacer_section_area")
    return screw.model_copy(update={name: factor * getattr(screw, name) for name in names})


# --- offset lead ---


@pytest.mark.parametrize("axial_load", [0.0, 1500.0, -4000.0, 9000.0])
def test_offset_lead_is_the_double_nut_of_the_same_turns_per_side(axial_load):
    same = changed(OFFSET, screw={"spacer_length": GD4008.screw.spacer_length})
    found, expected = (double_nut_loads(p.screw, 2000.0, axial_load, 86) for p in (same, GD4008))
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, other)
    for sign in (1, -1):
        assert separation_load(same.screw, 2000.0, 86, sign) == separation_load(
            GD4008.screw, 2000.0, 86, sign
        )
    film = [HamrockDowsonFilm(p) for p in (same, GD4008)]
    torques = [
        double_nut_torque(p, FRICTION, f, 2000.0, 50.0, 303.0, axial_load)
        for p, f in zip((same, GD4008), film, strict=True)
    ]
    assert torques[0] == torques[1]


def test_from_half_to_half_is_one_lead():
    assert OFFSET.screw.spacer_length == OFFSET.screw.lead
    assert GD4008.screw.spacer_length == GD4008.screw.nominal_radius
    # shorter sections between the balls are stiffer
    rigid = 2.0**1.5
    offset, double = (separation_load(s, 2000.0, 86, 1, BETA) / 2000.0 for s in (OFFSET.screw, GD4008.screw))
    assert rigid < offset < double


# --- oversize balls: one ball ---


@pytest.mark.parametrize("preload", [500.0, 2000.0])
def test_relieved_flanks_separate_at_2_to_the_3_halves_of_the_preload(preload):
    """Equal springs Q ~ delta^1.5 on both sides: the other side then has twice the approach."""
    oversize = ball_oversize(SCREW, preload, 86)
    law = flank_law(SCREW, oversize, BETA)
    d = flank_travel(SCREW, oversize, BETA)
    assert 86 * float(law(np.array([0.0]))[0][0]) == pytest.approx(preload, rel=1e-12)
    assert 86 * float(law(np.array([d]))[0][0]) == pytest.approx(2.0**1.5 * preload, rel=1e-12)
    assert float(law(np.array([-d]))[2][0]) == pytest.approx(0.0, abs=1e-9)
    assert float(law(np.array([-1.01 * d]))[2][0]) == 0.0


def test_oversize_of_a_ball():
    # 2000 N on 86 balls: Q = 32.955 N, C Q^(2/3) = 2.70387e-7 * 32.955^(2/3)
    assert ball_oversize(SCREW, 2000.0, 86) == pytest.approx(2.70387e-7 * 32.955 ** (2 / 3), rel=1e-5)
    assert ball_oversize(SCREW, 0.0, 86) == 0.0
    # preload rises with the 3/2 power of oversize
    ratio = ball_oversize(SCREW, 8000.0, 86) / ball_oversize(SCREW, 1000.0, 86)
    assert ratio == pytest.approx(4.0, rel=1e-12)


@pytest.mark.parametrize("angle", [None, BETA])
@pytest.mark.parametrize("way", [-2e-6, 0.0, 1e-6, 5e-6])
def test_slope_of_the_flank_law_is_its_derivative(angle, way):
    law = flank_law(SCREW, 3e-6, angle)
    f, slope, Q = (float(x[0]) for x in law(np.array([way])))
    step = 1e-10
    difference = float((law(np.array([way + step]))[0] - law(np.array([way - step]))[0])[0]) / (2.0 * step)
    assert slope == pytest.approx(difference, rel=1e-5)
    assert f == pytest.approx(SB * Q, rel=0.03)


def test_flank_law_without_oversize_is_the_ball_of_a_double_nut():
    from ballscrew_tehl.physics.ball_law import fixed_angle_law, loaded_angle_law

    d = np.array([-1e-6, 0.0, 1e-6, 4e-6])
    for ours, theirs in (
        (flank_law(SCREW, 0.0), loaded_angle_law(GD4008.screw)),
        (flank_law(SCREW, 0.0, BETA), fixed_angle_law(GD4008.screw, BETA)),
    ):
        for one, other in zip(ours(d), theirs(d), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-15)


def test_the_line_of_contact_turns_with_axial_displacement():
    """Geometry by hand: groove centres A0 + oversize apart, one moved along the axis."""
    oversize, way = 3e-6, 4e-6
    length = groove_distance(SCREW) + oversize
    u = way * math.cos(SCREW.lead_angle)
    x, y = length * math.cos(BETA), length * math.sin(BETA) + u
    approach = math.hypot(x, y) - groove_distance(SCREW)
    Q = (approach / contact_compliance(SCREW, BETA)) ** 1.5
    f, _, found = flank_law(SCREW, oversize)(np.array([way]))
    assert float(found[0]) == pytest.approx(Q, rel=1e-9)
    assert float(f[0]) == pytest.approx(Q * math.cos(SCREW.lead_angle) * y / math.hypot(x, y), rel=1e-9)


def test_a_ball_between_four_flanks_keeps_its_angle():
    assert contact_angle_at_ball_load(SCREW, 40.0) == BETA
    assert list(loaded_contact_angle(SCREW, np.array([0.0, 6000.0]), 86)) == [BETA, BETA]
    assert contact_angle_at_ball_load(GD4008.screw, 40.0) > BETA


# --- oversize balls: the nut ---


def test_under_preload_every_ball_carries_alike_on_four_flanks():
    state = double_nut_loads(SCREW, 2000.0, 0.0, 86)
    equal = 2000.0 / (86 * SB)
    np.testing.assert_allclose([state.Q_a, state.Q_b], np.full((2, 86), equal), rtol=1e-12)
    assert (state.force_a, state.force_b) == pytest.approx((2000.0, 2000.0), rel=1e-12)
    assert state.spacer_force == 0.0
    np.testing.assert_allclose(nut_loads(SCREW, 2000.0, 86), equal, rtol=1e-12)


@pytest.mark.parametrize("angle", [BETA, None])
@given(preload=st.floats(1.0, 12000.0), share=st.floats(-5.0, 5.0))
@settings(deadline=None, max_examples=60)
def test_balance_of_both_sets_of_flanks(angle, preload, share):
    load = share * preload
    state = double_nut_loads(SCREW, preload, load, 86, angle)
    assert state.force_b - state.force_a == pytest.approx(load, abs=1e-8 * (preload + abs(load)))
    assert min(state.Q_a.min(), state.Q_b.min()) >= 0.0
    mirrored = double_nut_loads(SCREW, preload, -load, 86, angle)
    assert (mirrored.force_a, mirrored.force_b) == (state.force_b, state.force_a)
    np.testing.assert_array_equal(mirrored.Q_a, state.Q_b)
    if angle is not None:
        assert SB * state.Q_a.sum() == pytest.approx(state.force_a, rel=1e-9, abs=1e-9)


def test_chain_of_balls_obeys_the_recurrence():
    """d(k+1) - 2 d(k) + d(k-1) = K f(d(k)) with the net force of all balls, from the loads alone."""
    state = double_nut_loads(SCREW, 2000.0, 3000.0, 86, BETA)
    c = contact_compliance(SCREW, BETA)
    d = (c * state.Q_b ** (2 / 3) - ball_oversize(SCREW, 2000.0, 86)) / SB
    from ballscrew_tehl.physics.ball_chain import ball_pitch

    areas = 1.0 / SCREW.screw_section_area + 1.0 / SCREW.nut_section_area
    K = ball_pitch(SCREW, 86) / SCREW.youngs_modulus * areas
    net = SB * (state.Q_b - state.Q_a)
    np.testing.assert_allclose(np.diff(d, 2), K * net[1:-1], rtol=1e-5)
    # the load enters both bodies at the right end: nothing is left at the other
    assert d[1] - d[0] == pytest.approx(K * net[0], rel=1e-4)
    assert d[-1] - d[-2] == pytest.approx(K * (3000.0 - net[-1]), rel=1e-5)


@pytest.mark.parametrize("preload", [100.0, 2000.0, 9000.0])
def test_stiff_bodies_separate_at_2_to_the_3_halves_of_the_preload(preload):
    def excess(factor):
        return separation_load(stiffer(SCREW, factor), preload, 86, 1, BETA) / preload - 2.0**1.5

    # the part of the elongation of the bodies is proportional to their compliance
    assert excess(1.0) > 0.0
    assert excess(10.0) == pytest.approx(0.1 * excess(1.0), rel=0.05)


@pytest.mark.parametrize("angle", [BETA, None])
@pytest.mark.parametrize("sign", [1, -1])
def test_relieved_flanks_are_free_beyond_the_separation_load(sign, angle):
    limit = separation_load(SCREW, 2000.0, 86, sign, angle)
    before, after = (double_nut_loads(SCREW, 2000.0, sign * f * limit, 86, angle) for f in (0.999, 1.001))
    assert 0.0 < min(before.force_a, before.force_b) < 2.0
    assert min(after.force_a, after.force_b) == 0.0


@pytest.mark.parametrize("axial_load", [20.0, 3000.0])
def test_shares_an_axial_load_like_a_double_nut_with_as_many_balls_per_nut(axial_load):
    """The difference of the two kinds is proportional to the compliance of the bodies."""

    def difference(factor):
        four, double = stiffer(SCREW, factor), stiffer(GD4008.screw, factor)
        double = double.model_copy(update={"spacer_length": 0.0})
        relieved = [double_nut_loads(s, 2000.0, axial_load, 86, BETA).force_a for s in (double, four)]
        return relieved[0] - relieved[1]

    assert abs(difference(1.0)) > 1e-3 * axial_load
    assert difference(10.0) == pytest.approx(0.1 * difference(1.0), rel=0.1)


def test_no_preload_leaves_two_contacts():
    state = double_nut_loads(SCREW, 0.0, 500.0, 86)
    assert (state.force_a, state.force_b) == (0.0, pytest.approx(500.0, rel=1e-9))
    assert separation_load(SCREW, 0.0, 86) == 0.0


def test_bad_input():
    for bad in (-1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match="preload = "):
            double_nut_loads(SCREW, bad, 0.0, 86)
        with pytest.raises(ValueError, match="preload = "):
            ball_oversize(SCREW, bad, 86)
        with pytest.raises(ValueError, match="force = "):
            nut_loads(SCREW, bad, 86)
    with pytest.raises(ValueError, match="ball_count"):
        nut_loads(SCREW, 100.0, 1)
    with pytest.raises(ValueError, match="outer_nut_force"):
        nut_loads(SCREW, 100.0, 86, outer_nut_force=100.0)
    with pytest.raises(ValueError, match="beyond these grooves"):
        flank_travel(SCREW, groove_distance(SCREW))


# --- kinematics and friction ---


def test_spin_of_a_ball_that_rolls_on_four_flanks():
    """The ball turns about an axis parallel to the screw: speeds of its four points by hand."""
    w, r_b, r_m = 100.0, 0.5 * SCREW.ball_diameter, SCREW.nominal_radius
    cage = cage_speed(SCREW, w)
    ball = (w - cage) * (r_m - r_b * math.cos(BETA)) / (r_b * math.cos(BETA))
    # the same turning rate rolls on the nut as well: no contact slides in its middle
    assert ball == pytest.approx(cage * (r_m + r_b * math.cos(BETA)) / (r_b * math.cos(BETA)), rel=1e-12)
    assert ball * r_b * math.cos(BETA) == pytest.approx(entrainment_speed(SCREW, w), rel=1e-12)
    spins = {}
    for raceway in ("screw", "nut"):
        field = slip_field(changed(FOUR, **ROLLING), raceway, w, BETA)
        spins[raceway] = float(field.spin_2 - field.spin_1)
    assert spins["screw"] == pytest.approx((ball + w - cage) * math.sin(BETA), rel=1e-12)
    assert spins["nut"] == pytest.approx(-(ball - cage) * math.sin(BETA), rel=1e-12)
    assert spins["screw"] + spins["nut"] == pytest.approx(w * math.sin(BETA), rel=1e-12)
    # more than ten times the spin of a ball on two flanks
    two = slip_field(changed(GD4008, **ROLLING), "screw", w, BETA)
    assert spins["screw"] > 10.0 * float(two.spin_2 - two.spin_1)


def test_share_of_two_flanks_is_the_parameter():
    assert spin_share(changed(GD4008, friction={"spin_split": 0.2}), BETA) == 0.2
    assert spin_share(FOUR, BETA) == pytest.approx(6.44, abs=0.005)


def test_spin_moment_of_a_circle_and_of_a_line():
    assert spin_moment(10.0, 2e-4, 2e-4, 0.1) == pytest.approx(
        3.0 * math.pi / 16.0 * 0.1 * 10.0 * 2e-4, rel=1e-12
    )
    # Hertz pressure along a line: mu (3 Q/(4 a)) int |t| (1 - t^2) a dt over -1..1 = 3/8 mu Q a
    assert spin_moment(10.0, 2e-4, 1e-9, 0.1) == pytest.approx(0.375 * 0.1 * 10.0 * 2e-4, rel=1e-6)


def test_bound_of_the_spin_is_power_over_speed():
    Q = 1000.0 / (86 * SB)
    power = 0.0
    for raceway in ("screw", "nut"):
        contact = ellipse(Q, *reduced_radii(SCREW, BETA, raceway), E_prime(SCREW))
        field = slip_field(changed(FOUR, **ROLLING), raceway, 30.0, BETA)
        moment = float(spin_moment(Q, contact.a, contact.b, 0.05))
        power += 2 * 86 * moment * abs(float(field.spin_2 - field.spin_1))
    assert four_point_spin_bound(FOUR, 1000.0, 0.0, 0.05) == pytest.approx(power / 30.0, rel=1e-9)
    assert four_point_spin_bound(GD4008, 1000.0) == four_point_spin_bound(OFFSET, 1000.0) == 0.0
    # no preload, or so much axial load that every ball rolls on two flanks
    assert four_point_spin_bound(FOUR, 0.0) == 0.0
    free = separation_load(SCREW, 1000.0, 86)
    assert (
        four_point_spin_bound(FOUR, 1000.0, 1.001 * free)
        == 0.0
        < four_point_spin_bound(FOUR, 1000.0, 0.9 * free)
    )
    # Q a ~ Q^(4/3)
    ratio = four_point_spin_bound(FOUR, 8000.0) / four_point_spin_bound(FOUR, 1000.0)
    assert ratio == pytest.approx(16.0, rel=1e-9)


def test_torque_is_that_of_both_sets_of_flanks():
    """Equal loads instead of those of a stretched double nut, angle without load: within 1 % of the double nut."""
    four, double = (
        double_nut_torque(p, FRICTION, HamrockDowsonFilm(p), 2000.0, 50.0, 303.0) for p in (FOUR, GD4008)
    )
    assert four.total == pytest.approx(double.total, rel=0.015)
    assert four != double


# --- map, file, command line ---


@pytest.fixture(scope="module")
def four_point_map():
    return closed_build(FOUR)


def test_map_of_oversize_balls_follows_the_sum_over_the_balls(four_point_map):
    nut_map = nut_map_of(four_point_map)
    friction = FrictionSet("test", "published", "solved", 7.0, 0.005, 3e-8)
    film = SolvedFilm(four_point_map.contact_map, False)
    for preload, load in ((1000.0, 0.0), (2000.0, 1500.0), (2000.0, -3000.0), (3000.0, 9500.0)):
        state = nut_map.evaluate(preload, 40.0, 300.0, load)
        direct = double_nut_torque(FOUR, friction, film, preload, 40.0, 300.0, load)
        total = state.friction_torque
        assert total == pytest.approx(direct.total, rel=5e-4)
    # both directions alike
    there, back = (nut_map.evaluate(2000.0, 40.0, 300.0, sign * 2500.0) for sign in (1.0, -1.0))
    assert there.viscous_torque == pytest.approx(back.viscous_torque, rel=1e-12)
    assert GRID.force[0] < 2000.0 < GRID.force[1]


def test_a_map_of_another_kind_of_preload_is_refused(four_point_map, tmp_path):
    from ballscrew_tehl.nut_map.file import load_map, save_map
    from ballscrew_tehl.parameters.identity import map_parameters_json
    from ballscrew_tehl.runtime.packed import MapError

    save_map(tmp_path / "four.nc", four_point_map, {"points": 0})
    assert load_map(tmp_path / "four.nc", FOUR).header["parameters_json"] == map_parameters_json(FOUR)
    with pytest.raises(MapError, match=r"screw\.preload_kind = single_nut_oversize_ball; expected None"):
        load_map(tmp_path / "four.nc", GD4008)


def test_command_line_prints_the_bound_of_the_spin_torque(tmp_path, capsys, four_point_map):
    from ballscrew_tehl.nut_map.file import save_map

    save_map(tmp_path / "four.nc", four_point_map, {"points": 0})
    (tmp_path / "four.toml").write_text(screw_template(FOUR))
    point = ["--preload-n", "2000", "--speed-rpm", "400", "--temperature-c", "25", "--axial-load-n", "500"]
    files = ["--screw", str(tmp_path / "four.toml"), "--map", str(tmp_path / "four.nc")]
    assert cli.main(["torque", *point, *files, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["preload_kind"] == "single_nut_oversize_ball"
    bound = four_point_spin_bound(FOUR, 2000.0, 500.0)
    assert found["spin_torque_not_included_at_most_nm"] == pytest.approx(bound, rel=1e-9)
    assert bound > 0.1


@pytest.mark.parametrize(
    ("parameters", "words", "not_said"),
    [
        (GD4008, ["Ball loads of the double nut", "next to the spacer", "relieved nut"], "flanks"),
        (OFFSET, ["Ball loads of the single nut", "Each half", "relieved half"], "spacer"),
        (
            FOUR,
            [
                "Ball loads of the single nut",
                "between four flanks",
                "relieved set of flanks",
                "the spin of such a ball",
            ],
            "spacer",
        ),
    ],
    ids=["double", "offset", "oversize"],
)
def test_report_names_the_kind_of_preload(parameters, words, not_said):
    from ballscrew_tehl.report import material, sections

    balls = material.ball_loads(parameters, 2000.0)
    chosen = SimpleNamespace(nut_map=SimpleNamespace(law=FILM_SHEAR))
    shown = SimpleNamespace(parameters=parameters, balls=balls, chosen=chosen, measured=True)
    (part,) = [part for part in sections.parts_of_page(shown, [], []) if part.name == "balls"]
    text = part.title + str(sections.balls(shown))
    # text inside pictures is not counted
    text = re.sub(r"src=\S+", "", text)
    for word in words:
        assert word in text
    assert not_said not in text
    assert f"unloaded at {balls.separation:.0f} N" in text
    # the equilibrium of the ball includes it
    chosen.nut_map.law = MECHANISTIC
    assert "spin of such a ball" not in str(sections.balls(shown))


def test_output_for_a_double_nut_does_not_mention_spin(capsys):
    assert (
        cli.main(["torque", "--preload-n", "2000", "--speed-rpm", "400", "--temperature-c", "25", "--json"])
        == 0
    )
    found = json.loads(capsys.readouterr().out)
    assert not {"preload_kind", "spin_torque_not_included_at_most_nm"} & set(found)


@pytest.mark.slow
def test_direct_solve_of_a_user_screw_with_graded_oil(tmp_path, capsys):
    """The whole chain without a map: single nut, ISO VG 68, measured roughness."""
    parameters = changed(
        example_parameters("iso_vg"),
        screw={"preload_kind": "single_nut_oversize_ball"},
        friction={"raceway_rq": 8e-8, "ball_rq": 1e-8, "set": "two_parameter"},
    )
    (tmp_path / "mine.toml").write_text(screw_template(parameters))
    point = ["--preload-n", "800", "--speed-rpm", "500", "--temperature-c", "40"]
    assert cli.main(["torque", *point, "--screw", str(tmp_path / "mine.toml"), "--direct", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["friction_torque_nm"] > 0.0
    height = math.hypot(8e-8, 1e-8)
    assert default_friction_set(parameters).roughness_height == pytest.approx(height, rel=1e-12)
    assert found["lambda_ratio"] == pytest.approx(found["film_thickness_min_m"] / height, rel=1e-9)
