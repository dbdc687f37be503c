"""The screw as an element of a drive train: torque of the screw, force on the nut, friction of both nuts, heat.

Twin of the native model BallScrewTransmission (native/models/transmission). Standard library only besides the map.

The screw leads the nut by x = lead angle/(2 pi) - position. Screw and nut bodies are rigid, the contacts are Hertz's
(physics/axial_stiffness.py, there the displacement is -x): with d_0 = (preload/k)^(2/3)

    F_A = k max(d_0 + x, 0)^(3/2),  F_B = k max(d_0 - x, 0)^(3/2),  nut force F = F_A - F_B + c x',
    c = damping time * dF/dx,       screw torque = lead/(2 pi) F + friction torque.

A positive nut force pushes the nut along +position and loads nut A. Damping in proportion to the stiffness is an
assumption: it vanishes with the contact and dissipates c x'^2 >= 0. Its time is that of rolling bearings, Kraemer,
Dynamics of Rotors and Foundations 1993: 2.5e-6 to 2.5e-5 s. Each nut has the friction of the map at its own force,
with the one motion of oversize balls between both sets of flanks (nut_law.freed_shear), so load raises it, and the
screw is driven back where lead/(2 pi) F exceeds the friction.

A step: angle and position are those at its start and move on with their speeds. Powers are means of the step, so that

    shaft power - nut power - power loss = change of stored energy over the step,

exactly, if the next step starts where this one ends and the preload stays. A change of preload is work of the preload.
"""

import math
from typing import Any, NamedTuple

from ballscrew_tehl.runtime.constants import FORCE_ROUNDING, TOO_LARGE
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import DEFAULTS, FrictionParameters
from ballscrew_tehl.runtime.standstill import Elements, friction_outputs, standstill_friction

CONTACT_DAMPING_TIME = 1e-5  # [s] start value of contact_damping_time: Kraemer 1993, see above


class TransmissionInputs(NamedTuple):
    """Inputs of the FMU, under their names."""

    angle: float  # [rad] of the screw
    speed: float  # [rad/s]
    position: float  # [m] of the nut
    velocity: float  # [m/s]
    temperature: float  # [K] oil
    preload: float  # [N]


class TransmissionParameters(NamedTuple):
    """Parameters of the FMU, under their names."""

    lead: float  # [m/rev] negative: left-hand thread
    nut_stiffness: float  # [N/m] of the nut without load at stiffness_preload
    stiffness_preload: float  # [N]
    axial_play: float  # [m] free way of the nut without preload
    contact_damping_time: float  # [s] damping of the contacts over their stiffness
    apparent_viscosity_ratio: float
    net_sliding_coefficient: float
    roughness_height: float  # [m]
    breakaway_factor: float
    regularization_speed: float  # [rad/s]
    presliding: bool
    presliding_stiffness: float  # [N.m/rad] 0: from the screw
    presliding_damping: float  # [N.m.s/rad] 0: from the stiffness
    presliding_side: float  # travel from rest at the start over that at which all slides; 0: from the speed
    seal_torque: float = 0.0  # [N.m]


class TransmissionStep(NamedTuple):
    """Outputs of a step, and what the next one needs."""

    outputs: dict[str, Any]
    elements: Elements
    clamped: tuple[str, ...]  # inputs beyond the map


def contact_stiffness(nut_stiffness: float, stiffness_preload: float) -> float:
    """k [N/m^1.5] of one nut from that of both at a preload, 3 k^(2/3) preload^(1/3); 0 to TOO_LARGE: forces finite."""
    if not (nut_stiffness > 0.0 and stiffness_preload > 0.0):
        return 0.0
    one = nut_stiffness / 3.0
    stiffness = one * math.sqrt(one / stiffness_preload)
    return min(stiffness, TOO_LARGE) if stiffness * TOO_LARGE > 1.0 else 0.0


def contact_law(stiffness: float, approach: float) -> tuple[float, float]:
    """Force [N] and its slope [N/m] of one nut over its approach [m]; 0 where it is free."""
    if approach <= 0.0:
        return 0.0, 0.0
    slope = stiffness * math.sqrt(approach)
    return slope * approach, 1.5 * slope


def mean_contact_force(stiffness: float, first: float, last: float) -> float:
    """Mean force [N] of one nut while its approach moves from first to last [m]: integral of k d^(3/2) over the way."""
    if first == last:
        return contact_law(stiffness, last)[0]
    # the quotient of fifth powers of roots is divided out: a short way loses no digits
    a, b = math.sqrt(max(first, 0.0)), math.sqrt(max(last, 0.0))
    aa, bb, ab = a * a, b * b, a * b
    if a > 0.0 and b > 0.0:
        work, way = aa * aa + bb * bb + ab * (aa + ab + bb), a + b
    else:
        work, way = bb * bb * b - aa * aa * a, last - first
    return 0.4 * (stiffness * work) / way


def preload_approach(stiffness: float, preload: float, play: float) -> float:
    """Approach d_0 of both nuts without load [m]; without preload half the play, negative."""
    if not preload > 0.0:
        return -0.5 * play
    return (preload / stiffness) ** (2.0 / 3.0) if stiffness > 0.0 else 0.0


def transmission_step(
    nut_map: NutMap,
    inputs: TransmissionInputs,
    parameters: TransmissionParameters,
    step: float | None,
    before: Elements | None,
    heat: float = 0.0,
) -> TransmissionStep:
    """Outputs at the end of a step [s], None or 0: at an instant, where powers are those of the instant.

    before : elements at the start of the step, None: at the start of the simulation;  heat : dissipated before it [J].
    The caller has checked that all are finite numbers, parameters >= 0 but lead.
    """
    p, h = parameters, step or 0.0
    k = contact_stiffness(p.nut_stiffness, p.stiffness_preload)
    ratio = p.lead / (2.0 * math.pi)
    drift = ratio * inputs.speed - inputs.velocity  # x'
    first = ratio * inputs.angle - inputs.position
    x = first + h * drift
    d_0 = preload_approach(k, inputs.preload, p.axial_play)
    force_a, slope_a = contact_law(k, d_0 + x)
    force_b, slope_b = contact_law(k, d_0 - x)
    damping = p.contact_damping_time * (slope_a + slope_b) * drift
    force = force_a - force_b + damping

    highest = nut_map.force.hi
    beyond = {"force_nut_a": force_a, "force_nut_b": force_b}
    clamped = [name for name, one in beyond.items() if one > highest * (1.0 + FORCE_ROUNDING)]
    held = inputs.preload or max(force_a, force_b)  # without preload the loaded nut holds the force
    if not nut_map.preload.lo <= held <= highest:
        clamped.insert(0, "preload")
    clamped += nut_map.outside(inputs.speed, inputs.temperature)
    low, high = sorted(min(one, highest) for one in beyond.values())
    friction = FrictionParameters._make(getattr(p, name) for name in DEFAULTS)
    nut = nut_map.evaluate_forces(low, high, inputs.speed, inputs.temperature, friction, clamped)
    nut = nut._replace(seal_torque=p.seal_torque)

    def stiffness_of_screw() -> float:
        present = nut_map.stiffness_at_forces(low, high, p.net_sliding_coefficient, p.breakaway_factor)
        return present + nut_map.seal_stiffness(p.seal_torque)

    coulomb = standstill_friction(nut.coulomb_torque, inputs.speed, step, before, p, stiffness_of_screw)
    outputs = friction_outputs(nut, inputs.speed, coulomb, force_a >= force_b)
    friction = outputs["friction_torque"]
    contact_energy = x * (mean_contact_force(k, d_0, d_0 + x) - mean_contact_force(k, d_0, d_0 - x))
    if h > 0.0:
        # the damping force over a step is the time over the step times the change of the elastic force
        elastic = mean_contact_force(k, d_0 + first, d_0 + x) - mean_contact_force(k, d_0 - first, d_0 - x)
        at_start = contact_law(k, d_0 + first)[0] - contact_law(k, d_0 - first)[0]
        mean_damping = p.contact_damping_time * (force_a - force_b - at_start) / h
    else:
        elastic, mean_damping = force_a - force_b, damping
    mean = elastic + mean_damping
    ideal = ratio * force
    power_loss = outputs["power_loss"] + mean_damping * drift
    margin = nut_map.range_margin(held, inputs.speed, inputs.temperature, 0.0)
    outputs |= {
        "screw_torque": ideal + friction,
        "nut_force": force,
        "force_nut_a": force_a,
        "force_nut_b": force_b,
        "damping_force": damping,
        "axial_deflection": x,
        "axial_stiffness": slope_a + slope_b,
        "efficiency": efficiency(ideal, nut.friction_torque, inputs.speed),
        "shaft_power": mean * ratio * inputs.speed + nut.viscous_torque * abs(inputs.speed) + coulomb.supply,
        "nut_power": mean * inputs.velocity,
        "power_loss": power_loss,
        "stored_energy": contact_energy + coulomb.elements.energy,
        "heat": heat + h * power_loss,
        "range_margin": min(margin, (highest * (1.0 + FORCE_ROUNDING) - max(force_a, force_b)) / highest),
    }
    return TransmissionStep(outputs, coulomb.elements, nut.clamped)


def efficiency(ideal_torque: float, friction_torque: float, speed: float) -> float:
    """Share of the power that arrives in steady motion, 0 to 1; 0 where friction (magnitude at motion [N.m]) holds.

    ideal_torque : lead/(2 pi) times the nut force [N.m]; with the sign of the speed the screw drives the nut
    """
    ideal = abs(ideal_torque)
    if ideal == 0.0:
        return 0.0
    if ideal_torque * speed >= 0.0:
        return ideal / (ideal + friction_torque)
    return max(ideal - friction_torque, 0.0) / ideal
