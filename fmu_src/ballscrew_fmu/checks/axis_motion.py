"""Motion of BallScrewAxis integrated in Python, apart from the C code: the equations of variables/axis.py.

Friction of the nuts and its elements by the Python laws of the runtime, Hertz contacts as in physics/stiffness.
Leapfrog in short equal parts: half a part of motion, forces in the middle, the other half. Elements are moved from
middle to middle, cut at their limits, which needs no event.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ballscrew_fmu.variables.axis import STEEL_DENSITY, axis_variables, bearing_table
from ballscrew_tehl.numerics import Array
from ballscrew_tehl.runtime.constants import AXIS_DAMPING_TIME, BEARING_SPEEDS, BEARING_TEMPERATURES
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import FrictionParameters
from ballscrew_tehl.runtime.standstill import RELAXED, held_stiffness, presliding_friction

LEAST_ROD = 0.01  # [m] of the elastic screw: axis_law.h
PART_ANGLE = 0.06  # [rad] of the vibration of table and motor over the nut in one part


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


def bearing_curve(numbers: Sequence[float], temperature: float) -> tuple[Array, Array]:
    """ln speed and torque of the rows [N.m] of a bearing_table at a temperature [K]."""
    slow, fast, cold, hot = numbers[:4]
    rows = np.reshape(numbers[4:], (BEARING_SPEEDS, BEARING_TEMPERATURES))
    nodes = np.linspace(cold, hot, BEARING_TEMPERATURES)
    return np.linspace(slow, fast, BEARING_SPEEDS), np.array(
        [np.interp(temperature, nodes, row) for row in rows]
    )


def axis_motion(
    nut_map: NutMap,
    inputs: Sequence[Mapping[str, float]],
    step: float,
    numbers: Sequence[float] | None = None,
    part_angle: float = PART_ANGLE,
    **parameters: float,
) -> Iterator[dict[str, Any]]:
    """angle, speed, position, velocity and nut_force after each step, with the start values of other parameters.

    numbers: bearing_table, None: that of the map; part_angle: length of the parts
    """
    p = {v.name: float(v.start or 0.0) for v in axis_variables(nut_map.header) if v.causality == "parameter"}
    p |= parameters
    numbers = bearing_table(nut_map.header) if numbers is None else numbers
    friction = FrictionParameters(*(p[name] for name in FrictionParameters._fields))
    cylinder = 0.25 * math.pi * STEEL_DENSITY * p["screw_diameter"] ** 2 * p["screw_length"]
    coefficients = friction.net_sliding_coefficient, friction.breakaway_factor
    inertia = p["motor_inertia"] + (p["screw_inertia"] or 0.125 * cylinder * p["screw_diameter"] ** 2)
    ratio, mass, screw_mass = p["lead"] / (2.0 * math.pi), p["table_mass"], p["screw_mass"] or cylinder
    gravity = 9.80665 * math.sin(p["inclination"])
    contact = contact_constant(p["nut_stiffness"], p["stiffness_preload"])
    seals = nut_map.seal_stiffness(p["seal_torque"])
    guide_stiffness, travel = p["guide_coulomb"] / p["guide_presliding_travel"], p["guide_presliding_travel"]
    bearing = 1.0 / p["support_stiffness"] if p["support_stiffness"] else 0.0
    rod = 1.0 / p["rod_stiffness"] if p["rod_stiffness"] and p["free_length"] else 0.0
    elastic = 1.0 / screw_mass if bearing or rod else 0.0

    def support() -> float:
        """Stiffness of bearing and screw [N/m]."""
        return 1.0 / (bearing + rod * max(p["free_length"] + position, LEAST_ROD)) if elastic else 0.0

    speed = velocity = displacement = rate = 0.0
    position = p["initial_position"]
    angle = position / ratio
    compliances = 1.0 / mass + ratio**2 / inertia + elastic
    part_angle *= 2.0 if elastic else 1.0  # the fast vibration of the screw is damped
    parts = math.ceil(step * math.sqrt(p["nut_stiffness"] * compliances + support() * elastic) / part_angle)
    h = step / parts
    turned = moved = bent = 0.0  # accelerations of screw, table and screw along its axis in the part before
    elements, guide, shaft = (
        RELAXED,
        0.0,
        0.0,
    )  # those of the screw; deflection of the guide [m]; shaft [sqrt(J)]

    def contacts(preload: float, drift: float) -> tuple[float, float, float]:
        """Forces of the contacts of both nuts, and that of the damping, at a rate of the deflection."""
        a, b, stiffness = contact_forces(contact, preload, ratio * angle - position + displacement)
        return a, b, p["contact_damping_time"] * stiffness * drift

    for row in inputs:
        speeds, torques = bearing_curve(numbers, row["temperature"])
        torques = p["bearing_seal_torque"] + p["motor_coulomb"] + p["bearing_friction_factor"] * torques
        root = math.sqrt(torques[0] / p["shaft_presliding_angle"])
        for _ in range(parts):
            angle, position = angle + 0.5 * h * speed, position + 0.5 * h * velocity
            displacement += 0.5 * h * rate
            w, v, s = speed + 0.5 * h * turned, velocity + 0.5 * h * moved, rate + 0.5 * h * bent
            a, b, damping = contacts(row["preload"], ratio * w - v + s)
            low, high = sorted(min(force, nut_map.force.hi) for force in (a, b))
            nut = nut_map.evaluate_forces(low, high, abs(w), row["temperature"], friction)
            coulomb = nut.coulomb_torque + p["seal_torque"]
            present = seals + nut_map.stiffness_at_forces(low, high, *coefficients)
            stiffness = held_stiffness(elements, present)
            law = presliding_friction(coulomb, speed, h, elements, stiffness, AXIS_DAMPING_TIME * stiffness)
            elements = law.elements
            limit = np.interp(math.log(max(abs(w), 1e-30)), speeds, torques) / root if root else 0.0
            shaft = min(max(shaft + h * root * speed, -limit), limit)
            torque = law.sign * coulomb + math.copysign(nut.viscous_torque, w) + root * shaft
            guide = min(max(guide + h * velocity, -travel), travel)
            resisting = guide_stiffness * guide + p["guide_viscous"] * v + mass * gravity
            force, pull = a - b + damping, support() * displacement
            driving = row["external_force"] + (0.5 * rod * pull**2 if elastic else 0.0)
            turned = (row["motor_torque"] - ratio * force - torque) / inertia
            moved = (force + driving - resisting) / mass
            holding = pull + p["contact_damping_time"] * support() * s + screw_mass * gravity
            bent = -elastic * (force + holding)
            speed, velocity, rate = speed + h * turned, velocity + h * moved, rate + h * bent
            angle, position = angle + 0.5 * h * speed, position + 0.5 * h * velocity
            displacement += 0.5 * h * rate
        a, b, damping = contacts(row["preload"], ratio * speed - velocity + rate)
        yield {
            "angle": angle, "speed": speed, "position": position, "velocity": velocity,
            "nut_force": a - b + damping,
        }  # fmt: skip
