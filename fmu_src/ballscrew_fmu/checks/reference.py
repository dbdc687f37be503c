"""Reference inputs of the models and the outputs of the map for them, which a built FMU must reproduce."""

import math
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ballscrew_fmu.checks.axis_motion import axis_motion, contact_constant, contact_forces
from ballscrew_fmu.checks.replay import CheckError, replay
from ballscrew_fmu.models import FRICTION, MONITOR, TRANSMISSION, FmuModel
from ballscrew_fmu.native_fmu.compile import this_platform
from ballscrew_fmu.native_fmu.package import build_native_fmu
from ballscrew_fmu.native_fmu.validation import Reference
from ballscrew_fmu.variables.axis import PLACES
from ballscrew_fmu.variables.friction import fmu_variables
from ballscrew_tehl.runtime import standstill
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import DEFAULTS, POINT, FrictionParameters
from ballscrew_tehl.runtime.standstill import RELAXED, Elements, StandstillLaw

STEP = 1e-3  # [s] communication step of the replay
STEPS = 240
RECOVERY = 1e-6  # relative error of the preload of the monitor for a torque computed from a known preload
DIFFERENCE, QUOTIENT = 1e-5, 1e-4  # part of the preload over which a slope is taken; relative error of that
MOTION = 1e-3  # of the range of a quantity: difference of both integrations, from the error_bound of the FMU
BALANCE = 1e-9  # of the throughput: error of the energies of the axis over its reference input
Row = dict[str, Any]


def reference_of(nut_map: NutMap, model: FmuModel = FRICTION) -> Reference:
    """Reference input and outputs for it, with the start values of the parameters.

    Friction has those of the map in Python. The other models record those of their own native FMU, which are checked
    here against the map and laws in Python (check_monitor, check_transmission, check_axis: CheckError).
    """
    rows = list(REFERENCE_INPUTS[model.layer](nut_map.header))
    if model is FRICTION:
        return Reference(STEP, rows, friction_results(nut_map, rows))
    inputs = rows
    if model is MONITOR:
        torques = [row["friction_torque"] for row in friction_results(nut_map, rows, presliding=False)]
        inputs = [
            {"torque": torque}
            | {name: row[name] for name in ("speed", "temperature", "axial_load", "temperature_difference")}
            for row, torque in zip(rows, torques, strict=True)
        ]
    with tempfile.TemporaryDirectory(prefix="ballscrew_reference_") as scratch:
        fmu = Path(scratch) / f"{model.layer}.fmu"
        build_native_fmu(nut_map, 2, fmu, platforms=(this_platform(),), model=model)
        results = replay(fmu, inputs, STEP)
    CHECKS[model.layer](nut_map, rows, results)
    return Reference(STEP, inputs, results)


def _starts(nut_map: NutMap, model: FmuModel) -> dict[str, float]:
    """Start values of inputs and parameters."""
    table = fmu_variables(nut_map.header) if model is FRICTION else model.variables(nut_map.header)
    return {v.name: float(v.start or 0.0) for v in table if v.causality in ("input", "parameter")}


def reference_input(header: Mapping[str, Any]) -> Iterator[dict[str, float]]:
    """Motion in both directions through standstill at varying load and temperature, partly outside the map."""
    axes = header["axes"]
    force_hi, fastest = axes["force"][1], axes["speed"][1]
    cold, hot = axes["temperature"][:2]
    for n in range(STEPS):
        phase = n / STEPS
        swing = math.sin(6.0 * math.pi * phase)
        yield {
            "preload": force_hi * (0.02 + 0.5 * phase),
            "speed": 1.05 * fastest * swing**3,
            "temperature": cold + (hot - cold) * (1.1 * phase - 0.05),
            "axial_load": 0.3 * force_hi * math.sin(20.0 * math.pi * phase) if n % 4 else 0.0,
            "temperature_difference": 4.0 * swing if n % 3 else 0.0,
        }


def friction_step(
    nut_map: NutMap, given: Mapping[str, float], step: float, before: Elements, heat: float = 0.0
) -> tuple[dict[str, Any], Elements]:
    """Outputs of BallScrewFriction and elements at the end of a step [s]; given: inputs and parameters by name."""
    point = [given[name] for name in (*POINT, *DEFAULTS)]
    difference = given["temperature_difference"]
    actual, nut = nut_map.point_at_difference(point, difference, given["seal_torque"])
    law = StandstillLaw(*(given[name] for name in StandstillLaw._fields))  # type: ignore[arg-type]
    margin = nut_map.range_margin(point[:4], difference)
    result, coulomb = standstill.friction_step(nut_map, nut, actual, law, step, before, heat, margin)
    return result, coulomb.elements


def friction_results(
    nut_map: NutMap, inputs: Iterable[Mapping[str, float]], step: float = STEP, **parameters: float
) -> list[Row]:
    """Outputs of BallScrewFriction after each step [s] of an input sequence; parameters off their start values."""
    given = _starts(nut_map, FRICTION) | parameters
    elements, heat, results = RELAXED, 0.0, []
    for row in inputs:
        result, elements = friction_step(nut_map, {**given, **row}, step, elements, heat)
        heat = result["heat"]
        results.append(result)
    names = [v.name for v in fmu_variables(nut_map.header) if v.causality == "output"]
    return [{name: row[name] for name in names} for row in results]


def check_monitor(
    nut_map: NutMap, points: Sequence[Mapping[str, float]], results: Sequence[Mapping[str, Any]]
) -> None:
    """The preload that each torque is computed from is recovered, its sensitivity and film are those of the map.

    CheckError above RECOVERY, or QUOTIENT for the sensitivity, against a difference quotient; or if none is in range
    """
    found = 0
    for n, (row, result) in enumerate(zip(points, results, strict=True)):
        if not result["in_range"]:
            continue
        found += 1
        at = [row[name] for name in ("speed", "temperature", "axial_load")]
        preload, part = row["preload"], DIFFERENCE * row["preload"]
        difference = {"temperature_difference": row["temperature_difference"]}
        low, mid, high = (nut_map.evaluate(preload + x, *at, **difference) for x in (-part, 0.0, part))
        slope = (high.friction_torque - low.friction_torque) / (2.0 * part)
        for name, value, allowed in (
            ("preload", preload, RECOVERY), ("lambda_ratio", mid.lambda_ratio, RECOVERY),
            ("torque_sensitivity", slope, QUOTIENT),
        ):  # fmt: skip
            if not abs(result[name] - value) <= allowed * abs(value):
                raise CheckError(f"monitor, step {n}: {name} = {result[name]!r}; by the map {value!r}")
    if not found:
        raise CheckError("monitor: no step of the reference is in range")


def transmission_input(header: Mapping[str, Any]) -> Iterator[dict[str, float]]:
    """Motion from rest, in both directions, under a load that changes its sign, partly outside the map."""
    axes = header["axes"]
    force_hi, fastest = axes["force"][1], axes["speed"][1]
    cold, hot = axes["temperature"][:2]
    screw = header["screw"]
    ratio = screw["lead"] / (2.0 * math.pi)
    # way at which one nut comes free at the middle preload
    way = (0.3 * force_hi * screw["stiffness_preload"] ** 0.5) ** (2.0 / 3.0) * 3.0 / screw["nut_stiffness"]
    angle = 0.0
    for n in range(STEPS):
        phase = n / STEPS
        # from rest: else an importer that sets the first inputs before initialization begins with other elements;
        # later nowhere at rest, where a power is a difference of equal numbers
        speed = 1.05 * fastest * math.sin(6.0 * math.pi * phase + 0.05) ** 3 if n > 0 else 0.0
        x, x_next = (1.3 * way * math.sin(10.0 * math.pi * at + 0.1) for at in (phase, phase + 1.0 / STEPS))
        yield {
            "angle": angle,
            "speed": speed,
            "position": ratio * angle - x,
            "velocity": ratio * speed - (x_next - x) / STEP,
            "temperature": cold + (hot - cold) * (1.1 * phase - 0.05),
            "preload": force_hi * (0.02 + 0.5 * phase),
        }
        angle += speed * STEP


def check_transmission(
    nut_map: NutMap, inputs: Sequence[Mapping[str, float]], results: Sequence[Mapping[str, Any]]
) -> None:
    """Forces by Hertz's law, friction by the map at these forces, torque and heat as their sums; CheckError."""
    start = _starts(nut_map, TRANSMISSION)
    ratio = start["lead"] / (2.0 * math.pi)
    constant = contact_constant(start["nut_stiffness"], start["stiffness_preload"])
    heat = 0.0
    for n, (row, result) in enumerate(zip(inputs, results, strict=True)):
        force_a, force_b, stiffness = contact_forces(constant, row["preload"], result["axial_deflection"])
        drift = ratio * row["speed"] - row["velocity"]
        damping, heat = start["contact_damping_time"] * stiffness * drift, heat + STEP * result["power_loss"]
        sums = {
            "axial_deflection": ratio * row["angle"] - row["position"] + STEP * drift,
            "nut_force": force_a - force_b + damping,
            "screw_torque": ratio * result["nut_force"] + result["friction_torque"],
            "heat": heat,
        }
        # angle and position are much larger than the way between them
        way = BALANCE * abs(row["position"])
        scales = way, max(force_a, force_b) + way * stiffness, abs(ratio * result["nut_force"]), heat
        for (name, value), scale in zip(sums.items(), scales, strict=True):
            if not abs(result[name] - value) <= BALANCE * (abs(value) + scale) + (
                way if name == "axial_deflection" else 0
            ):
                raise CheckError(f"transmission, step {n}: {name} = {result[name]!r}; by the laws {value!r}")
        check_friction(nut_map, "transmission", n, row, {**result, "speed": row["speed"]})


def check_friction(
    nut_map: NutMap, model: str, n: int, row: Mapping[str, float], result: Mapping[str, Any]
) -> None:
    """The viscous torque of a step is that of the map at the forces of both nuts; CheckError."""
    low, high = sorted(min(result[f"force_nut_{nut}"], nut_map.force.hi) for nut in "ab")
    defaults = FrictionParameters(*nut_map.defaults)
    nut = nut_map.evaluate_forces(low, high, result["speed"], row["temperature"], defaults)
    viscous = result["viscous_torque"]
    if not math.isclose(abs(viscous), nut.viscous_torque, rel_tol=BALANCE):
        raise CheckError(f"{model}, step {n}: viscous_torque = {viscous!r}; the map {nut.viscous_torque!r}")


def axis_input(header: Mapping[str, Any]) -> Iterator[dict[str, float]]:
    """Motion in both directions, with a force on the table that loads the screw and drives it back."""
    ratio, force_hi = header["screw"]["lead"] / (2.0 * math.pi), header["axes"]["force"][1]
    cold, hot = header["axes"]["temperature"][:2]
    for n in range(STEPS):
        phase = n / STEPS
        yield {
            "motor_torque": 0.3 * force_hi * ratio * math.sin(6.0 * math.pi * phase),
            "external_force": 0.1 * force_hi * math.sin(10.0 * math.pi * phase) if phase > 0.4 else 0.0,
            "temperature": cold + (hot - cold) * phase,
            "preload": 0.2 * force_hi,
        }


def check_axis(
    nut_map: NutMap, inputs: Sequence[Mapping[str, float]], results: Sequence[Mapping[str, Any]]
) -> float:
    """Energies of an axis, its friction against the map, its motion against an integration in Python (axis_motion).

    Returns the largest difference of the motion over the range of the quantity; CheckError above MOTION or BALANCE.
    """
    lost = 0.0
    for n, (row, result) in enumerate(zip(inputs, results, strict=True)):
        kept = [result[name] for name in ("heat", "kinetic_energy", "potential_energy", "stored_energy")]
        supplied = result["supplied_energy"]
        if not abs(supplied - sum(kept)) <= BALANCE * sum(map(abs, kept)):
            raise CheckError(f"axis, step {n}: {supplied!r} J supplied, {sum(kept)!r} J kept")
        lost += STEP * sum(result[f"power_{place}"] for place in PLACES)
        if not abs(lost - kept[0]) <= BALANCE * kept[0]:
            raise CheckError(f"axis, step {n}: {lost!r} J of all places, {kept[0]!r} J of heat")
        check_friction(nut_map, "axis", n, row, result)
    motion = list(axis_motion(nut_map, inputs, STEP))
    names = list(motion[0])
    integrated, recorded = (np.array([[row[x] for x in names] for row in of]) for of in (motion, results))
    differences = np.max(np.abs(integrated - recorded), axis=0) / np.ptp(integrated, axis=0)
    n = int(np.argmax(differences))  # a NaN before all
    name, worst = names[n], float(differences[n])
    if not worst <= MOTION:
        raise CheckError(
            f"axis: {name} differs by {worst:.1e} of its range from an integration in Python; allowed {MOTION:g}"
        )
    return worst


#: by layer of a model: its input, and the check of what its native FMU gives
REFERENCE_INPUTS = {
    "friction": reference_input, "monitor": reference_input, "transmission": transmission_input, "axis": axis_input,
}  # fmt: skip
CHECKS: dict[str, Callable[..., object]] = {
    "monitor": check_monitor, "transmission": check_transmission, "axis": check_axis,
}  # fmt: skip
