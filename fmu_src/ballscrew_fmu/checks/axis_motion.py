"""Motion of BallScrewAxis integrated in Python, apart from the C code: the equations of variables/axis.py.

Friction of the nuts by the Python law of the map, Hertz contacts by runtime.transmission. Midpoint rule in short equal
parts; elements of screw and guide that stick or slide by return mapping (an elastic predictor, cut at the limit), which
needs no event. Both speeds of a part by Newton's method. For an axis without support_stiffness and inclination.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ballscrew_fmu.variables.axis import axis_variables
from ballscrew_tehl.runtime.constants import AXIS_DAMPING_TIME, ELEMENTS
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import FrictionParameters
from ballscrew_tehl.runtime.standstill import element_limits
from ballscrew_tehl.runtime.transmission import contact_law, contact_stiffness, preload_approach

PARTS = 40  # of a communication step; 20 put the nut force four times as far off, 1e-3 of its range
STEEL_DENSITY = 7850.0  # [kg/m3]
NEWTON_STEPS, CONVERGED_AT = 20, 1e-11  # [1] of a change of both speeds over the speeds


def _cut(x: float, limit: float) -> float:
    return min(max(x, -limit), limit)


def axis_motion(
    nut_map: NutMap, inputs: Sequence[Mapping[str, float]], step: float, parts: int = PARTS
) -> Iterator[dict[str, Any]]:
    """angle, speed, position, velocity and nut_force after each step, with the start values of the parameters."""
    p = {v.name: float(v.start or 0.0) for v in axis_variables(nut_map.header) if v.causality == "parameter"}
    friction = FrictionParameters(*(p[name] for name in FrictionParameters._fields))
    cylinder = 0.25 * math.pi * STEEL_DENSITY * p["screw_diameter"] ** 2 * p["screw_length"]
    inertia = p["motor_inertia"] + (p["screw_inertia"] or 0.125 * cylinder * p["screw_diameter"] ** 2)
    mass, ratio, late = p["table_mass"], p["lead"] / (2.0 * math.pi), p["contact_damping_time"]
    k = contact_stiffness(p["nut_stiffness"], p["stiffness_preload"])
    guide_root = math.sqrt(p["guide_coulomb"] / p["guide_presliding_travel"])
    guide_limit = p["guide_presliding_travel"] * guide_root
    seals = nut_map.seal_stiffness(p["seal_torque"])
    h = step / parts
    angle = speed = position = velocity = guide = 0.0
    turned = moved = 0.0  # rates of both speeds in the part before
    elements, stiffness = (0.0,) * ELEMENTS, 0.0
    for row in inputs:
        d_0 = preload_approach(k, row["preload"], p["axial_play"])

        def contacts(deflection: float, d_0: float = d_0) -> tuple[float, float, float]:
            (a, slope_a), (b, slope_b) = contact_law(k, d_0 + deflection), contact_law(k, d_0 - deflection)
            return a, b, slope_a + slope_b

        for _ in range(parts):
            deflection = ratio * angle - position
            w, v = speed + 0.5 * h * turned, velocity + 0.5 * h * moved  # in the middle
            a, b, _slope = contacts(deflection + 0.5 * h * (ratio * w - v))
            low, high = sorted(min(force, nut_map.force.hi) for force in (a, b))
            slow = max(abs(w), 1e-9)
            nut = nut_map.evaluate_forces(low, high, slow, row["temperature"], friction)
            drag, coulomb = nut.viscous_torque / slow, nut.coulomb_torque + p["seal_torque"]
            present = seals + nut_map.stiffness_at_forces(
                low, high, friction.net_sliding_coefficient, friction.breakaway_factor
            )
            if not any(elements) or not stiffness:
                stiffness = present
            limits = element_limits(coulomb, stiffness)
            if all(
                abs(y) >= m for y, m in zip(elements, limits, strict=True)
            ):  # all slide: it follows the loads
                elements = tuple(y * math.sqrt(stiffness / present) for y in elements)
                stiffness, limits = present, element_limits(coulomb, present)
            root, damping = math.sqrt(stiffness / ELEMENTS), AXIS_DAMPING_TIME * stiffness
            start = [_cut(y, m) for y, m in zip(elements, limits, strict=True)]
            for _ in range(NEWTON_STEPS):
                a, b, slope = contacts(deflection + 0.5 * h * (ratio * w - v))
                force = a - b + late * slope * (ratio * w - v)
                ends = [_cut(y + root * h * w, m) for y, m in zip(start, limits, strict=True)]
                held = sum(abs(y) < m for y, m in zip(ends, limits, strict=True))
                lag = damping / (root * ELEMENTS * h) * (sum(ends) - sum(start))
                torque = 0.5 * root * (sum(ends) + sum(start)) + lag
                stiff = held * (0.5 * root * root * h + damping / ELEMENTS)
                if abs(torque) > coulomb:
                    torque, stiff = math.copysign(coulomb, torque), 0.0
                end = _cut(guide + guide_root * h * v, guide_limit)
                resisting = 0.5 * guide_root * (guide + end) + p["guide_viscous"] * v
                stiff_guide = p["guide_viscous"] + (
                    0.5 * guide_root**2 * h if abs(end) < guide_limit else 0.0
                )
                first = (
                    2.0 * inertia * (w - speed) / h - row["motor_torque"] + ratio * force + torque + drag * w
                )
                second = 2.0 * mass * (v - velocity) / h - force - row["external_force"] + resisting
                c = slope * (0.5 * h + late)
                j11 = 2.0 * inertia / h + ratio * ratio * c + stiff + drag
                j22, j12 = 2.0 * mass / h + c + stiff_guide, -ratio * c
                determinant = j11 * j22 - j12 * j12
                dw, dv = (
                    (first * j22 - second * j12) / determinant,
                    (second * j11 - first * j12) / determinant,
                )
                w, v = w - dw, v - dv
                if abs(dw) <= CONVERGED_AT * (1.0 + abs(w)) and ratio * abs(dv) <= CONVERGED_AT * (
                    1.0 + abs(v)
                ):
                    break
            turned, moved = 2.0 * (w - speed) / h, 2.0 * (v - velocity) / h
            angle, position = angle + h * w, position + h * v
            speed, velocity = speed + h * turned, velocity + h * moved
            elements, guide = tuple(ends), end
        a, b, slope = contacts(ratio * angle - position)
        drift = ratio * speed - velocity
        yield {
            "angle": angle, "speed": speed, "position": position, "velocity": velocity,
            "nut_force": a - b + late * slope * drift,
        }  # fmt: skip
