"""The Python twin of the transmission: balance of power, laws of the contacts, friction of the map, both directions."""

import math

import numpy as np
import pytest
from synthetic_map import LAWS, make_map

from ballscrew_tehl.parameters.file import load_screw
from ballscrew_tehl.physics import axial_stiffness as closed
from ballscrew_tehl.runtime.transmission import (
    TransmissionInputs,
    TransmissionParameters,
    efficiency,
    preload_approach,
    transmission_step,
)

SCREW = load_screw().screw
K = closed.nut_stiffness_constant(SCREW)
RATIO = SCREW.lead / (2.0 * math.pi)
S_REF = closed.axial_stiffness(K, 1500.0)
PARAMETERS = TransmissionParameters(
    SCREW.lead, S_REF, 1500.0, 0.0, 1e-5, 7.6, 0.0051, 24e-9, 1.0, 0.1, True, 150.0, 0.5, 0.0
)
SLIDING = PARAMETERS._replace(presliding=False)
AT_REST = TransmissionInputs(0.0, 0.0, 0.0, 0.0, 303.15, 2000.0)


def at(nut_map, parameters=PARAMETERS, step=None, before=None, **inputs):
    return transmission_step(nut_map, AT_REST._replace(**inputs), parameters, step, before)


def reversal(time):
    """Speed of the screw [rad/s] and way by which it leads the nut [m]: two turns of an axis under a swinging load."""
    phase = 2.0 * math.pi * time
    return 40.0 * math.sin(phase / 0.4), 4e-6 * math.sin(phase / 0.4 + 0.7) + 3e-6 * math.sin(phase / 0.13)


@pytest.mark.parametrize("step", [4e-4, 1e-3])
def test_power_balance_over_a_cycle_with_reversal(synthetic_nut_map, step):
    for preload, standstill in (
        (2000.0, {"presliding": False}), (2000.0, {"presliding_stiffness": 150.0}), (400.0, {}),
        (2000.0, {"presliding_stiffness": 0.0, "presliding_damping": 0.0, "presliding_side": 0.7}),
    ):  # fmt: skip
        parameters, energy, z, throughput = PARAMETERS._replace(**standstill), [0.0] * 3, None, 0.0
        angle, x = 0.0, reversal(0.0)[1]
        position = -x
        start = at(synthetic_nut_map, parameters, position=position, preload=preload)
        z = start.elements
        for n in range(round(0.4 / step)):  # each step has one speed
            omega, x_next = reversal((n + 1) * step)
            velocity, x = RATIO * omega - (x_next - x) / step, x_next
            inputs = {"angle": angle, "speed": omega, "position": position, "velocity": velocity}
            found = at(synthetic_nut_map, parameters, step, z, preload=preload, **inputs)
            out, z = found.outputs, found.elements
            assert found.clamped == ()
            assert out["power_loss"] >= 0.0
            energy += step * np.array([out["shaft_power"], out["nut_power"], out["power_loss"]])
            throughput += step * abs(out["shaft_power"])
            angle, position = angle + omega * step, position + velocity * step
        stored = out["stored_energy"] - start.outputs["stored_energy"]
        assert min(throughput / 10.0, energy[2]) > 1.0 or preload < 2000.0
        assert abs(energy[0] - energy[1] - energy[2] - stored) <= 1e-12 * throughput


def test_forces_are_those_of_the_closed_form(synthetic_nut_map):
    """The displacement of physics.axial_stiffness is that of the nut against the screw, the opposite sign."""
    for x in (-9e-6, -3e-6, 0.0, 1e-6, 4.4e-6, 8e-6):
        for velocity in (0.01, -0.01):
            out = at(synthetic_nut_map, position=-x, velocity=velocity).outputs
            b, a = closed.forces_of_displacement(K, 2000.0, x)
            stiffness, damping = closed.axial_stiffness(K, 2000.0, x), out["damping_force"]
            assert (out["force_nut_a"], out["force_nut_b"]) == pytest.approx((a, b), rel=1e-13)
            assert out["nut_force"] == pytest.approx(a - b + damping, rel=1e-12, abs=1e-9)
            assert out["axial_stiffness"] == pytest.approx(stiffness, rel=1e-13)
            assert damping == pytest.approx(-1e-5 * stiffness * velocity, rel=1e-13)
            assert out["power_loss"] == pytest.approx(-damping * velocity, rel=1e-12)
    moved = {"angle": 3.0, "speed": 50.0, "position": 3.0 * RATIO - 1e-6, "velocity": 50.0 * RATIO - 0.01}
    out = at(synthetic_nut_map, step=1e-4, **moved).outputs  # a step ends where its speeds lead
    assert out["axial_deflection"] == pytest.approx(2e-6, rel=1e-9)
    assert preload_approach(K, 2000.0, 1e-5) == pytest.approx(closed.preload_approach(K, 2000.0), rel=1e-14)
    assert preload_approach(K, 0.0, 1e-5) == -5e-6


@pytest.mark.parametrize("law", LAWS)
def test_friction_is_that_of_the_friction_fmu_at_the_same_forces_with_oversize_balls_too(law):
    """A ball between two sets of flanks has one motion; the nuts are apart at 9 kN. Preload by rigid bodies."""
    nut_map = make_map(law=law, free=0.3)
    for axial_load in (1500.0, -5500.0, 9000.0):
        forces = np.array(nut_map._forces_point(2000.0, axial_load))  # relieved, loaded
        b, a = np.cbrt(forces / K) ** 2  # approaches
        apart = forces[0] == 0.0
        assert apart == (axial_load == 9000.0)
        d_0, x = (0.4 * a, 0.6 * a) if apart else (0.5 * (a + b), 0.5 * (a - b))
        step = at(nut_map, PARAMETERS._replace(presliding_stiffness=0.0), preload=K * d_0**1.5, speed=60.0,
                  position=-math.copysign(x, axial_load), velocity=60.0 * RATIO)  # fmt: skip
        wanted = nut_map.evaluate(2000.0, 60.0, 303.15, axial_load, 7.6, 0.0051, 24e-9, 1.0)
        assert step.outputs["friction_torque"] == pytest.approx(wanted.friction_torque, rel=1e-9)
        relieved = step.outputs[f"friction_torque_nut_{'b' if axial_load > 0.0 else 'a'}"]
        expected = wanted.relieved_viscous_torque + wanted.relieved_coulomb_torque
        assert relieved == pytest.approx(expected, rel=1e-9, abs=1e-15)
        stiffness = nut_map.presliding_stiffness(2000.0, axial_load, 0.0051, 1.0)
        assert step.elements.stiffness == pytest.approx(stiffness, rel=1e-9)


def test_efficiency_both_ways(synthetic_nut_map):
    """Driving, the screw needs more than lead/(2 pi) F; driven back, the shaft gives less. Steady: powers."""
    for load, speed in ((1500.0, 20.0), (1500.0, -20.0), (-1500.0, 20.0), (-1500.0, -20.0)):
        x = closed.axial_deflection(K, 2000.0, -load)
        out = at(synthetic_nut_map, SLIDING, position=x, speed=speed, velocity=RATIO * speed).outputs
        assert out["nut_force"] == pytest.approx(load, rel=1e-9)
        powers = out["shaft_power"], out["nut_power"]
        given, gained = powers if load * speed > 0.0 else (-powers[1], -powers[0])
        assert out["efficiency"] == pytest.approx(gained / given, rel=1e-9)
        assert 0.0 < out["efficiency"] < 1.0
        assert given - gained == pytest.approx(out["power_loss"], rel=1e-9)
    # friction holds against a small load
    assert [efficiency(*n) for n in ((0.5, 0.6, -1.0), (0.5, 0.5, 1.0), (0.0, 0.5, 1.0))] == [0.0, 0.5, 0.0]


def test_play_counts_without_preload_only_and_damping_ends_with_the_contact(synthetic_nut_map):
    worn = PARAMETERS._replace(axial_play=2e-5)
    for x, touching in ((0.0, False), (0.99e-5, False), (1.01e-5, True), (-1.01e-5, True)):
        out = at(synthetic_nut_map, worn, position=-x, preload=0.0, velocity=0.01).outputs
        for name in ("nut_force", "stored_energy", "damping_force", "power_loss"):
            assert (out[name] != 0.0) == touching, (x, name)
    new, old = (at(synthetic_nut_map, p, position=-1e-6).outputs for p in (PARAMETERS, worn))
    assert new == old
    # a nut with clearance is in range where the load is: as the friction of preload 0 under that load
    loaded = at(synthetic_nut_map, worn, position=-2e-5, speed=20.0, velocity=RATIO * 20.0, preload=0.0)
    assert loaded.clamped == ()
    assert loaded.outputs["range_margin"] > 0.0
    nut = synthetic_nut_map.evaluate(0.0, 20.0, AT_REST.temperature, loaded.outputs["force_nut_a"])
    assert nut.in_range
    assert loaded.outputs["viscous_torque"] == pytest.approx(float(nut.viscous_torque), rel=1e-12)
    assert at(synthetic_nut_map, worn, position=0.0, preload=0.0).clamped == ("preload",)
    for nothing in ({"nut_stiffness": 0.0}, {"stiffness_preload": 0.0}):
        out = at(synthetic_nut_map, PARAMETERS._replace(**nothing), position=-1e-6).outputs
        assert out["nut_force"] == out["friction_torque"] == out["stored_energy"] == 0.0
