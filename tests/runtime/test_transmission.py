"""The Python twin of the transmission: balance of power, laws of the contacts, friction of the map, both directions."""

import math

import numpy as np
import pytest
from synthetic_map import LAWS, make_map

from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.physics import axial_stiffness as closed
from ballscrew_tehl.runtime.standstill import Bristle
from ballscrew_tehl.runtime.transmission import (
    TransmissionInputs,
    TransmissionParameters,
    contact_law,
    contact_stiffness,
    efficiency,
    mean_contact_force,
    preload_approach,
    transmission_step,
)

SCREW = load_parameters().screw
K = closed.contact_stiffness(SCREW)
RATIO = SCREW.lead / (2.0 * math.pi)
S_REF = closed.axial_stiffness(K, 1500.0)
PARAMETERS = TransmissionParameters(
    SCREW.lead, S_REF, 1500.0, 0.0, 1e-5, 7.6, 0.0051, 24e-9, 1.0, 0.1, True, 150.0, 0.5, 0.0
)
AT_REST = TransmissionInputs(0.0, 0.0, 0.0, 0.0, 303.15, 2000.0)


def at(nut_map, parameters=PARAMETERS, step=None, before=None, **inputs):
    return transmission_step(nut_map, AT_REST._replace(**inputs), parameters, step, before)


def reversal(time):
    """Speed of the screw [rad/s] and way by which it leads the nut [m]: two turns of an axis under a swinging load."""
    omega = 40.0 * math.sin(2.0 * math.pi * time / 0.4)
    lead_over = 4e-6 * math.sin(2.0 * math.pi * time / 0.4 + 0.7) + 3e-6 * math.sin(
        2.0 * math.pi * time / 0.13
    )
    return omega, lead_over


def cycle(nut_map, parameters, step, preload=2000.0):
    """Energies [J] of a cycle with two reversals: shaft, nut, heat, stored, throughput. Each step has one speed."""
    angle, x, position = 0.0, reversal(0.0)[1], -reversal(0.0)[1]
    start = transmission_step(
        nut_map, AT_REST._replace(position=position, preload=preload), parameters, None, None
    )
    first = stored = start.outputs["stored_energy"]
    z = start.bristle
    sums = np.zeros(4)
    for n in range(round(0.4 / step)):
        omega, x_next = reversal((n + 1) * step)
        velocity = RATIO * omega - (x_next - x) / step
        inputs = AT_REST._replace(
            angle=angle, speed=omega, position=position, velocity=velocity, preload=preload
        )
        found = transmission_step(nut_map, inputs, parameters, step, z)
        out, z = found.outputs, found.bristle
        assert found.clamped == ()
        assert out["power_loss"] >= 0.0
        sums += step * np.array(
            [out["shaft_power"], out["nut_power"], out["power_loss"], abs(out["shaft_power"])]
        )
        stored, x = out["stored_energy"], x_next
        angle, position = angle + omega * step, position + velocity * step
    return sums[0], sums[1], sums[2], stored - first, sums[3]


@pytest.mark.parametrize("step", [1e-4, 1e-3])
@pytest.mark.parametrize(
    "standstill",
    [
        {"presliding": False},
        {"presliding_stiffness": 150.0},
        {"presliding_stiffness": 0.0, "presliding_damping": 0.0},
        {"presliding_stiffness": 0.0, "presliding_side": 0.7},
    ],
)
def test_power_balance_over_a_cycle_with_reversal(synthetic_nut_map, step, standstill):
    """Shaft, nut, heat and stored energy: to rounding, with a stiffness of the bristle that follows the load."""
    parameters = PARAMETERS._replace(**standstill)
    shaft, nut, heat, stored, throughput = cycle(synthetic_nut_map, parameters, step)
    assert throughput > 10.0
    assert heat > 1.0
    assert abs(shaft - nut - heat - stored) <= 1e-12 * throughput


def test_balance_holds_where_a_nut_comes_free(synthetic_nut_map):
    shaft, nut, heat, stored, throughput = cycle(synthetic_nut_map, PARAMETERS, 1e-4, preload=400.0)
    lifted = closed.preload_approach(K, 400.0)
    assert lifted < 4e-6
    assert abs(shaft - nut - heat - stored) <= 1e-12 * throughput


def test_power_at_an_instant_is_the_rate_of_the_stored_energy(synthetic_nut_map):
    """shaft - nut - loss = d(stored)/dt, by central differences of the stored energy along the motion."""
    inputs = {"angle": 2e-6 / RATIO, "speed": 30.0, "velocity": 30.0 * RATIO - 2e-3}
    h, z = 1e-6, 5e-4
    out = at(synthetic_nut_map, before=Bristle(z, 150.0), **inputs).outputs
    ends = [
        at(synthetic_nut_map, before=Bristle(z + 30.0 * t, 150.0), **{
            **inputs, "angle": inputs["angle"] + 30.0 * t, "position": inputs["velocity"] * t,
        }).outputs["stored_energy"]
        for t in (-h, h)
    ]  # fmt: skip
    rate = (ends[1] - ends[0]) / (2.0 * h)
    assert out["shaft_power"] - out["nut_power"] - out["power_loss"] == pytest.approx(rate, rel=1e-6)


@pytest.mark.parametrize("x", [-9e-6, -3e-6, 0.0, 1e-6, 4.4e-6, 8e-6])
def test_forces_are_those_of_the_closed_form(synthetic_nut_map, x):
    """The displacement of physics.axial_stiffness is that of the nut against the screw, the opposite sign."""
    out = at(synthetic_nut_map, position=-x).outputs
    wanted_b, wanted_a = closed.nut_forces(K, 2000.0, x)
    assert out["force_nut_a"] == pytest.approx(wanted_a, rel=1e-13)
    assert out["force_nut_b"] == pytest.approx(wanted_b, rel=1e-13)
    assert out["nut_force"] == pytest.approx(wanted_a - wanted_b, rel=1e-13, abs=1e-9)
    assert out["axial_stiffness"] == pytest.approx(closed.axial_stiffness(K, 2000.0, x), rel=1e-13)


def test_each_nut_has_the_friction_of_the_map_at_its_force(synthetic_nut_map):
    inputs = {"position": -2e-6, "speed": 60.0, "velocity": 60.0 * RATIO}
    out = at(synthetic_nut_map, PARAMETERS._replace(presliding=False), **inputs).outputs
    for nut in "ab":
        both = synthetic_nut_map.evaluate(out[f"force_nut_{nut}"], 60.0, 303.15)
        assert out[f"friction_torque_nut_{nut}"] == pytest.approx(0.5 * both.friction_torque, rel=1e-12)
    parts = out["viscous_torque"] + out["hysteresis_torque"] + out["sliding_torque"]
    assert out["friction_torque"] == pytest.approx(parts, rel=1e-13)
    assert out["screw_torque"] == pytest.approx(RATIO * out["nut_force"] + out["friction_torque"], rel=1e-13)


def test_without_load_friction_is_that_of_the_double_nut(synthetic_nut_map):
    inputs = {"speed": 60.0, "velocity": 60.0 * RATIO}
    out = at(synthetic_nut_map, PARAMETERS._replace(presliding=False), **inputs).outputs
    wanted = synthetic_nut_map.evaluate(2000.0, 60.0, 303.15).friction_torque
    assert out["friction_torque"] == pytest.approx(wanted, rel=1e-12)
    assert out["nut_force"] == 0.0


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("axial_load", [1500.0, -5500.0, 9000.0])
def test_friction_is_that_of_the_friction_fmu_at_the_same_forces_with_oversize_balls_too(law, axial_load):
    """A ball between two sets of flanks has one motion; the nuts are apart at 9 kN. Preload by rigid bodies."""
    nut_map = make_map(law=law, free=0.3)
    forces = np.array(nut_map._forces_point(2000.0, axial_load))  # relieved, loaded
    b, a = np.cbrt(forces / K) ** 2  # approaches
    apart = forces[0] == 0.0
    assert apart == (axial_load == 9000.0)
    d_0, x = (0.4 * a, 0.6 * a) if apart else (0.5 * (a + b), 0.5 * (a - b))
    inputs = {"position": -math.copysign(x, axial_load), "speed": 60.0, "velocity": 60.0 * RATIO}
    parameters = PARAMETERS._replace(presliding_stiffness=0.0)
    step = transmission_step(
        nut_map, AT_REST._replace(preload=K * d_0**1.5, **inputs), parameters, None, None
    )
    wanted = nut_map.evaluate(2000.0, 60.0, 303.15, axial_load, 7.6, 0.0051, 24e-9, 1.0)
    assert step.outputs["friction_torque"] == pytest.approx(wanted.friction_torque, rel=1e-9)
    relieved = step.outputs["friction_torque_nut_b" if axial_load > 0.0 else "friction_torque_nut_a"]
    expected = wanted.relieved_viscous_torque + wanted.relieved_coulomb_torque
    assert relieved == pytest.approx(expected, rel=1e-9, abs=1e-15)
    stiffness = nut_map.presliding_stiffness(2000.0, axial_load, 0.0051, 1.0)
    assert step.bristle.stiffness == pytest.approx(stiffness, rel=1e-9)


@pytest.mark.parametrize("load", [1500.0, -1500.0])
def test_efficiency_both_ways(synthetic_nut_map, load):
    """Driving, the screw needs more than lead/(2 pi) F; driven back, the shaft gives less. Steady: powers."""
    x = -closed.axial_deflection(K, 2000.0, -load)
    parameters = PARAMETERS._replace(presliding=False)
    for speed in (20.0, -20.0):
        inputs = {"position": -x, "speed": speed, "velocity": RATIO * speed}
        out = at(synthetic_nut_map, parameters, **inputs).outputs
        assert out["nut_force"] == pytest.approx(load, rel=1e-9)
        into, out_of = out["shaft_power"], out["nut_power"]
        driving = load * speed > 0.0
        if not driving:
            into, out_of = -out_of, -into
        assert out["efficiency"] == pytest.approx(out_of / into, rel=1e-9)
        assert 0.0 < out["efficiency"] < 1.0
        assert into - out_of == pytest.approx(out["power_loss"], rel=1e-9)


def test_friction_holds_against_a_small_load():
    assert efficiency(0.5, 0.6, -1.0) == 0.0
    assert efficiency(0.5, 0.5, 1.0) == 0.5
    assert efficiency(0.0, 0.5, 1.0) == 0.0


def test_play_counts_without_preload_only(synthetic_nut_map):
    worn = PARAMETERS._replace(axial_play=2e-5)
    for x, touching in ((0.0, False), (0.99e-5, False), (1.01e-5, True), (-1.01e-5, True)):
        out = at(synthetic_nut_map, worn, position=-x, preload=0.0).outputs
        assert (out["nut_force"] != 0.0) == touching
        assert (out["stored_energy"] > 0.0) == touching
    assert (
        at(synthetic_nut_map, worn, position=-1e-6).outputs == at(synthetic_nut_map, position=-1e-6).outputs
    )


def test_damping_is_passive_and_ends_with_the_contact(synthetic_nut_map):
    for velocity in (0.01, -0.01):
        out = at(synthetic_nut_map, velocity=velocity).outputs
        assert out["damping_force"] == pytest.approx(-1e-5 * out["axial_stiffness"] * velocity, rel=1e-13)
        assert out["power_loss"] > 0.0
        assert out["power_loss"] == pytest.approx(-out["damping_force"] * velocity, rel=1e-13)
    free = at(synthetic_nut_map, PARAMETERS._replace(axial_play=1e-4), velocity=0.01, preload=0.0).outputs
    assert free["damping_force"] == free["nut_force"] == free["power_loss"] == 0.0


def test_a_step_ends_where_its_speeds_lead(synthetic_nut_map):
    inputs = {"angle": 3.0, "speed": 50.0, "position": 3.0 * RATIO - 1e-6, "velocity": 50.0 * RATIO - 0.01}
    moved = at(synthetic_nut_map, step=1e-4, **inputs).outputs
    assert moved["axial_deflection"] == pytest.approx(2e-6, rel=1e-9)
    resting = at(synthetic_nut_map, step=1e-4, before=Bristle(), **inputs)
    assert 0.0 < resting.bristle.deflection <= 50.0 * 1e-4


def test_mean_force_is_the_work_over_the_way():
    def energy(approach):
        return 0.4 * K * max(approach, 0.0) ** 2.5

    rounding = 1e-11  # of the difference of two energies over a way a thousandth as long
    for first, last in (
        (4e-6, 5e-6),
        (5e-6, 4e-6),
        (-1e-6, 2e-6),
        (2e-6, -3e-6),
        (-2e-6, -1e-6),
        (4e-6, 4.004e-6),
    ):
        work = energy(last) - energy(first)
        assert mean_contact_force(K, first, last) == pytest.approx(work / (last - first), rel=rounding)
    assert mean_contact_force(K, 4e-6, 4e-6 * (1.0 + 1e-15)) == pytest.approx(
        contact_law(K, 4e-6)[0], rel=1e-14
    )


def test_a_nut_without_stiffness_has_no_force(synthetic_nut_map):
    assert contact_stiffness(S_REF, 1500.0) == pytest.approx(K, rel=1e-14)
    for parameters in (PARAMETERS._replace(nut_stiffness=0.0), PARAMETERS._replace(stiffness_preload=0.0)):
        out = at(synthetic_nut_map, parameters, position=-1e-6).outputs
        assert out["nut_force"] == out["friction_torque"] == out["stored_energy"] == 0.0


def test_films_are_the_thinner_of_both_nuts(synthetic_nut_map):
    inputs = {"position": -2e-6, "speed": 60.0, "velocity": 60.0 * RATIO}
    out = at(synthetic_nut_map, **inputs).outputs
    both = [synthetic_nut_map.evaluate(out[f"force_nut_{nut}"], 60.0, 303.15) for nut in "ab"]
    assert out["film_thickness_min"] == min(nut.film_thickness_min for nut in both)
    assert out["lambda_ratio"] == min(nut.lambda_ratio for nut in both)
    assert out["ball_load_max"] == max(nut.ball_load_max for nut in both)


def test_start_of_the_bristle(synthetic_nut_map):
    """Without a state it starts from presliding_side, or from the sign of the speed."""
    for side, speed, share in ((0.0, 0.0, 0.0), (0.5, 0.0, 0.5), (-1.0, 3.0, -1.0), (0.0, -3.0, -1.0)):
        parameters = PARAMETERS._replace(presliding_side=side, presliding_stiffness=0.0)
        found = at(synthetic_nut_map, parameters, speed=speed)
        coulomb = found.outputs["hysteresis_torque"] + found.outputs["sliding_torque"]
        assert found.bristle.deflection * found.bristle.stiffness == pytest.approx(coulomb, rel=1e-12)
        level = synthetic_nut_map.evaluate(2000.0, speed, 303.15).coulomb_torque
        assert coulomb == pytest.approx(share * level, rel=1e-12)
        assert found.bristle.stiffness == pytest.approx(
            synthetic_nut_map.presliding_stiffness(2000.0, 0.0, 0.0051, 1.0), rel=1e-12
        )


def test_preload_approach_is_the_closed_form():
    assert preload_approach(K, 2000.0, 1e-5) == pytest.approx(closed.preload_approach(K, 2000.0), rel=1e-14)
    assert preload_approach(K, 0.0, 1e-5) == -5e-6


@pytest.mark.parametrize(
    ("inputs", "name"),
    [
        ({"preload": 12000.0}, ""),
        ({"preload": 12001.0}, "preload force_nut_a force_nut_b"),
        ({"preload": 1.0}, "preload"),
        ({"speed": 400.0, "velocity": 400.0 * RATIO}, "speed"),
        ({"temperature": 400.0}, "temperature"),
        ({"position": -2e-5}, "force_nut_a"),
        ({"position": 2e-5}, "force_nut_b"),
    ],
)
def test_names_what_is_beyond_the_map(synthetic_nut_map, inputs, name):
    found = at(synthetic_nut_map, **inputs)
    assert found.clamped == tuple(name.split())
    assert found.outputs["in_range"] == (name == "")
