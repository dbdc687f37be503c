"""Motion of BallScrewAxis integrated in Python, apart from the C code: the equations of variables/axis.py.

Friction of the nuts and its elements by the Python laws of the runtime, Hertz contacts by runtime.transmission.
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
from ballscrew_tehl.runtime.transmission import contact_law, contact_stiffness, preload_approach

PART_ANGLE = 0.03  # [rad] of the vibration of table and motor over the nut in one part


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
    contact = contact_stiffness(p["nut_stiffness"], p["stiffness_preload"])
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
        approach = preload_approach(contact, preload, p["axial_play"])
        deflection = ratio * angle - position
        (a, slope_a), (b, slope_b) = (contact_law(contact, approach + d) for d in (deflection, -deflection))
        return a, b, p["contact_damping_time"] * (slope_a + slope_b) * (ratio * w - v)

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
