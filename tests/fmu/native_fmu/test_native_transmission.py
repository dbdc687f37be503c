"""BallScrewTransmission: balance of power, laws of the contacts, friction of the map, both directions."""

import math

import numpy as np
import pytest
from native_model import NativeModel
from synthetic_map import LAWS, make_map

from ballscrew_fmu.models import TRANSMISSION
from ballscrew_tehl.parameters.file import load_screw
from ballscrew_tehl.physics import stiffness as closed

SCREW = load_screw().screw
K = closed.nut_stiffness_constant(SCREW)
RATIO = SCREW.lead / (2.0 * math.pi)
START = {
    "lead": SCREW.lead, "nut_stiffness": closed.axial_stiffness(K, 1500.0), "stiffness_preload": 1500.0,
    "axial_play": 0.0, "contact_damping_time": 1e-5, "apparent_viscosity_ratio": 7.6, "net_sliding_coefficient": 0.0051,
    "roughness_height": 24e-9, "breakaway_factor": 1.0, "regularization_speed": 0.1, "presliding": 1.0,
    "presliding_stiffness": 150.0, "presliding_damping": 0.5, "presliding_side": 0.0, "seal_torque": 0.0,
    "angle": 0.0, "speed": 0.0, "position": 0.0, "velocity": 0.0, "temperature": 303.15, "preload": 2000.0,
}  # fmt: skip
SLIDING = {"presliding": 0.0}
OUTPUTS = [
    "nut_force", "force_nut_a", "force_nut_b", "damping_force", "axial_deflection", "axial_stiffness", "efficiency",
    "shaft_power", "nut_power", "power_loss", "stored_energy", "friction_torque", "viscous_torque",
    "friction_torque_nut_a", "friction_torque_nut_b", "in_range", "range_margin",
]  # fmt: skip


@pytest.fixture
def model(synthetic_nut_map):
    return NativeModel(synthetic_nut_map, model=TRANSMISSION)


def outputs(model):
    return dict(zip(OUTPUTS, model.values(OUTPUTS).tolist(), strict=True))


def at(model, step=0.0, **given):
    """Outputs at an instant, or at the end of the first step [s]."""
    model.reset()
    model.latch(**{**START, **given})
    if step:
        model.step(step)
    return outputs(model)


def reversal(time):
    """Speed of the screw [rad/s] and way by which it leads the nut [m]: two turns of an axis under a swinging load."""
    phase = 2.0 * math.pi * time
    return 40.0 * math.sin(phase / 0.4), 4e-6 * math.sin(phase / 0.4 + 0.7) + 3e-6 * math.sin(phase / 0.13)


@pytest.mark.parametrize("step", [4e-4, 1e-3])
def test_power_balance_over_a_cycle_with_reversal(model, step):
    for preload, standstill in (
        (2000.0, SLIDING), (2000.0, {"presliding_stiffness": 150.0}), (400.0, {}),
        (2000.0, {"presliding_stiffness": 0.0, "presliding_damping": 0.0, "presliding_side": 0.7}),
    ):  # fmt: skip
        energy, throughput, heat = np.zeros(3), 0.0, 0.0
        angle, x = 0.0, reversal(0.0)[1]
        position = -x
        start = at(model, **standstill, position=position, preload=preload)
        for n in range(round(0.4 / step)):  # each step has one speed
            omega, x_next = reversal((n + 1) * step)
            velocity, x = RATIO * omega - (x_next - x) / step, x_next
            model.step(step, angle=angle, speed=omega, position=position, velocity=velocity)
            out = outputs(model)
            assert out["in_range"]
            assert out["power_loss"] >= 0.0
            energy += step * np.array([out["shaft_power"], out["nut_power"], out["power_loss"]])
            heat += step * out["power_loss"]
            throughput += step * abs(out["shaft_power"])
            angle, position = angle + omega * step, position + velocity * step
        stored = out["stored_energy"] - start["stored_energy"]
        assert min(throughput / 10.0, energy[2]) > 1.0 or preload < 2000.0
        assert abs(energy[0] - energy[1] - energy[2] - stored) <= 1e-12 * throughput
        assert model.get("heat") == pytest.approx(heat, rel=1e-12)


def test_forces_are_those_of_the_closed_form(model):
    """The displacement of physics.stiffness is that of the nut against the screw, the opposite sign."""
    for x in (-9e-6, -3e-6, 0.0, 1e-6, 4.4e-6, 8e-6):
        for velocity in (0.01, -0.01):
            out = at(model, position=-x, velocity=velocity)
            b, a = closed.forces_of_displacement(K, 2000.0, x)
            stiffness, damping = closed.axial_stiffness(K, 2000.0, x), out["damping_force"]
            assert (out["force_nut_a"], out["force_nut_b"]) == pytest.approx((a, b), rel=1e-13)
            assert out["nut_force"] == pytest.approx(a - b + damping, rel=1e-12, abs=1e-9)
            assert out["axial_stiffness"] == pytest.approx(stiffness, rel=1e-13)
            assert damping == pytest.approx(-1e-5 * stiffness * velocity, rel=1e-13)
            assert out["power_loss"] == pytest.approx(-damping * velocity, rel=1e-12)
    moved = {"angle": 3.0, "speed": 50.0, "position": 3.0 * RATIO - 1e-6, "velocity": 50.0 * RATIO - 0.01}
    # a step ends where its speeds lead
    assert at(model, step=1e-4, **moved)["axial_deflection"] == pytest.approx(2e-6, rel=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_friction_is_that_of_the_friction_fmu_at_the_same_forces_with_oversize_balls_too(law):
    """A ball between two sets of flanks has one motion; the nuts are apart at 9 kN. Preload by rigid bodies."""
    nut_map = make_map(law=law, free=0.3)
    model = NativeModel(nut_map, model=TRANSMISSION)
    for axial_load in (1500.0, -5500.0, 9000.0):
        forces = np.array(nut_map._forces_point(2000.0, axial_load))  # relieved, loaded
        b, a = np.cbrt(forces / K) ** 2  # approaches
        apart = forces[0] == 0.0
        assert apart == (axial_load == 9000.0)
        d_0, x = (0.4 * a, 0.6 * a) if apart else (0.5 * (a + b), 0.5 * (a - b))
        out = at(model, presliding_stiffness=0.0, preload=K * d_0**1.5, speed=60.0,
                 position=-math.copysign(x, axial_load), velocity=60.0 * RATIO)  # fmt: skip
        wanted = nut_map.evaluate(2000.0, 60.0, 303.15, axial_load, 7.6, 0.0051, 24e-9, 1.0)
        assert out["friction_torque"] == pytest.approx(wanted.friction_torque, rel=1e-9)
        relieved = out[f"friction_torque_nut_{'b' if axial_load > 0.0 else 'a'}"]
        expected = wanted.relieved_viscous_torque + wanted.relieved_coulomb_torque
        assert relieved == pytest.approx(expected, rel=1e-9, abs=1e-15)


def test_efficiency_both_ways(model):
    """Driving, the screw needs more than lead/(2 pi) F; driven back, the shaft gives less. Steady: powers."""
    for load, speed in ((1500.0, 20.0), (1500.0, -20.0), (-1500.0, 20.0), (-1500.0, -20.0)):
        x = closed.axial_deflection(K, 2000.0, -load)
        out = at(model, **SLIDING, position=x, speed=speed, velocity=RATIO * speed)
        assert out["nut_force"] == pytest.approx(load, rel=1e-9)
        powers = out["shaft_power"], out["nut_power"]
        given, gained = powers if load * speed > 0.0 else (-powers[1], -powers[0])
        assert out["efficiency"] == pytest.approx(gained / given, rel=1e-9)
        assert 0.0 < out["efficiency"] < 1.0
        assert given - gained == pytest.approx(out["power_loss"], rel=1e-9)
    # friction holds against a small load
    small = closed.axial_deflection(K, 2000.0, 1.0)
    assert at(model, **SLIDING, position=-small, speed=-20.0, velocity=-RATIO * 20.0)["efficiency"] == 0.0
    assert at(model, **SLIDING, speed=20.0, velocity=RATIO * 20.0)["efficiency"] == 0.0


def test_play_counts_without_preload_only_and_damping_ends_with_the_contact(model, synthetic_nut_map):
    worn = {"axial_play": 2e-5, "presliding": 0.0}
    for x, touching in ((0.0, False), (0.99e-5, False), (1.01e-5, True), (-1.01e-5, True)):
        out = at(model, **worn, position=-x, preload=0.0, velocity=0.01)
        for name in ("nut_force", "stored_energy", "damping_force", "power_loss"):
            assert (out[name] != 0.0) == touching, (x, name)
    assert at(model, **SLIDING, position=-1e-6) == at(model, **worn, position=-1e-6)
    # a nut with clearance is in range where the load is: as the friction of preload 0 under that load
    loaded = at(model, **worn, position=-2e-5, speed=20.0, velocity=RATIO * 20.0, preload=0.0)
    assert loaded["in_range"]
    assert loaded["range_margin"] > 0.0
    friction = [START[name] for name in synthetic_nut_map.header["defaults"]]
    nut = synthetic_nut_map.evaluate(0.0, 20.0, START["temperature"], loaded["force_nut_a"], *friction)
    assert nut.in_range
    assert loaded["viscous_torque"] == pytest.approx(float(nut.viscous_torque), rel=1e-12)
    free = at(model, **worn, preload=0.0)
    assert (free["in_range"], free["friction_torque"]) == (0.0, 0.0)
    for nothing in ({"nut_stiffness": 0.0}, {"stiffness_preload": 0.0}):
        out = at(model, **nothing, position=-1e-6)
        assert out["nut_force"] == out["friction_torque"] == out["stored_energy"] == 0.0
