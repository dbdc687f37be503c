"""Motion of BallScrewAxis integrated in Python, apart from the C code: the equations of variables/axis.py.

Friction of the nuts and its elements by the Python laws of the runtime, Hertz contacts as in physics/stiffness.
Leapfrog in short equal parts: half a part of motion, forces in the middle, the other half. Elements are moved from
middle to middle, cut at their limits, which needs no event. For an axis without support_stiffness and inclination.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ballscrew_fmu.variables.axis import STEEL_DENSITY, axis_variables
from ballscrew_tehl.runtime.constants import AXIS_DAMPING_TIME
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import FrictionParameters
from ballscrew_tehl.runtime.standstill import RELAXED, held_stiffness, presliding_friction

PART_ANGLE = 0.03  # [rad] of the vibration of table and motor over the nut in one part


def contact_constant(nut_stiffness: float, preload: float) -> float:
    """k [N/m^1.5] of one nut from the stiffness [N/m] of both at a preload [N], 3 k^(2/3) preload^(1/3)."""
    one = nut_stiffness / 3.0
    return one * math.sqrt(one / preload)


def contact_forces(constant: float, preload: float, deflection: float) -> tuple[float, float, float]:
    """Forces of nut A and B [N] where the screw leads the nut by a deflection [m], and the stiffness of both [N/m]."""
    d_0 = math.cbrt(preload / constant) ** 2
    a, b = max(d_0 + deflection, 0.0), max(d_0 - deflection, 0.0)
    slope_a, slope_b = constant * math.sqrt(a), constant * math.sqrt(b)
    return slope_a * a, slope_b * b, 1.5 * (slope_a + slope_b)


def axis_motion(
    nut_map: NutMap, inputs: Sequence[Mapping[str, float]], step: float
) -> Iterator[dict[str, Any]]:
    """angle, speed, position, velocity and nut_force after each step, with the start values of the parameters."""
    p = {v.name: float(v.start or 0.0) for v in axis_variables(nut_map.header) if v.causality == "parameter"}
    friction = FrictionParameters(*(p[name] for name in FrictionParameters._fields))
    cylinder = 0.25 * math.pi * STEEL_DENSITY * p["screw_diameter"] ** 2 * p["screw_length"]
    coefficients = friction.net_sliding_coefficient, friction.breakaway_factor
    inertia = p["motor_inertia"] + (p["screw_inertia"] or 0.125 * cylinder * p["screw_diameter"] ** 2)
    ratio = p["lead"] / (2.0 * math.pi)
    contact = contact_constant(p["nut_stiffness"], p["stiffness_preload"])
    seals = nut_map.seal_stiffness(p["seal_torque"])
    guide_stiffness = p["guide_coulomb"] / p["guide_presliding_travel"]
    vibration = math.sqrt(p["nut_stiffness"] * (1.0 / p["table_mass"] + ratio**2 / inertia))
    parts = math.ceil(step * vibration / PART_ANGLE)
    h = step / parts
    angle = speed = position = velocity = 0.0
    turned = moved = 0.0  # accelerations of screw and table in the part before
    elements, guide = RELAXED, 0.0  # elements of the screw; deflection of that of the guide [m]

    def contacts(preload: float, w: float, v: float) -> tuple[float, float, float]:
        """Forces of the contacts of both nuts, and that of the damping, at these speeds of screw and table."""
        a, b, stiffness = contact_forces(contact, preload, ratio * angle - position)
        return a, b, p["contact_damping_time"] * stiffness * (ratio * w - v)

    for row in inputs:
        for _ in range(parts):
            angle, position = angle + 0.5 * h * speed, position + 0.5 * h * velocity
            w, v = speed + 0.5 * h * turned, velocity + 0.5 * h * moved
            a, b, damping = contacts(row["preload"], w, v)
            low, high = sorted(min(force, nut_map.force.hi) for force in (a, b))
            nut = nut_map.evaluate_forces(low, high, abs(w), row["temperature"], friction)
            coulomb = nut.coulomb_torque + p["seal_torque"]
            present = seals + nut_map.stiffness_at_forces(low, high, *coefficients)
            stiffness = held_stiffness(elements, present)
            law = presliding_friction(coulomb, speed, h, elements, stiffness, AXIS_DAMPING_TIME * stiffness)
            elements = law.elements
            torque = law.sign * coulomb + math.copysign(nut.viscous_torque, w)
            travel = p["guide_presliding_travel"]
            guide = min(max(guide + h * velocity, -travel), travel)
            resisting = guide_stiffness * guide + p["guide_viscous"] * v
            force = a - b + damping
            turned = (row["motor_torque"] - ratio * force - torque) / inertia
            moved = (force + row["external_force"] - resisting) / p["table_mass"]
            speed, velocity = speed + h * turned, velocity + h * moved
            angle, position = angle + 0.5 * h * speed, position + 0.5 * h * velocity
        a, b, damping = contacts(row["preload"], speed, velocity)
        yield {
            "angle": angle, "speed": speed, "position": position, "velocity": velocity,
            "nut_force": a - b + damping,
        }  # fmt: skip
