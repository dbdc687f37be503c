"""Reference inputs of the models and the outputs of the map for them, which a built FMU must reproduce."""

import math
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ballscrew_fmu.checks.axis_motion import axis_motion
from ballscrew_fmu.checks.replay import CheckError, replay
from ballscrew_fmu.models import AXIS, FRICTION, MONITOR, TRANSMISSION, FmuModel
from ballscrew_fmu.native_fmu.compile import this_platform
from ballscrew_fmu.native_fmu.experiments import Reference
from ballscrew_fmu.native_fmu.package import build_native_fmu
from ballscrew_tehl.runtime import standstill
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.monitor import MonitorInputs, MonitorParameters, monitor_step
from ballscrew_tehl.runtime.packed import DEFAULTS, POINT, FrictionParameters
from ballscrew_tehl.runtime.standstill import RELAXED, Elements, StandstillLaw
from ballscrew_tehl.runtime.transmission import TransmissionInputs, TransmissionParameters, transmission_step

STEP = 1e-3  # [s] communication step of the replay
STEPS = 240
RECOVERY = 1e-6  # relative error of the preload of the monitor for a torque computed from a known preload
MOTION = 1e-3  # of the range of a quantity: difference of both integrations, from the error_bound of the FMU
BALANCE = 1e-9  # of the throughput: error of the energies of the axis over its reference input
Row = dict[str, Any]


def reference_of(nut_map: NutMap, model: FmuModel = FRICTION) -> Reference:
    """Reference input and the outputs of the map for it, with the start values of the parameters.

    CheckError: the monitor does not recover the preload that its torque is computed from; as check_axis
    """
    header = nut_map.header
    if model is AXIS:
        rows = list(axis_input(header))
        with tempfile.TemporaryDirectory(prefix="ballscrew_axis_") as scratch:
            fmu = Path(scratch) / "axis.fmu"
            build_native_fmu(nut_map, 2, fmu, platforms=(this_platform(),), model=AXIS)
            results = replay(fmu, rows, STEP)
        check_axis(nut_map, rows, results)
        return Reference(STEP, rows, results)
    if model is TRANSMISSION:
        rows = list(_transmission_input(header))
        return Reference(STEP, rows, _transmission_outputs(nut_map, rows))
    rows = list(reference_input(header))
    if model is FRICTION:
        return Reference(STEP, rows, friction_results(nut_map, rows))
    torques = [row["friction_torque"] for row in friction_results(nut_map, rows, presliding=False)]
    inputs = [
        {"torque": torque} | {name: row[name] for name in ("speed", "temperature", "axial_load")}
        for row, torque in zip(rows, torques, strict=True)
    ]
    results = monitor_outputs(nut_map, inputs)
    pairs = zip(rows, results, strict=True)
    errors = [abs(found["preload"] / row["preload"] - 1.0) for row, found in pairs if found["in_range"]]
    if not (errors and all(error <= RECOVERY for error in errors)):
        raise CheckError(f"preload from torque: relative errors {errors}; allowed {RECOVERY:g}")
    return Reference(STEP, inputs, results)


def _starts(nut_map: NutMap, model: FmuModel) -> dict[str, float]:
    """Start values of the parameters."""
    table = model.variables(nut_map.header)
    return {v.name: float(v.start or 0.0) for v in table if v.causality == "parameter"}


def _outputs(nut_map: NutMap, model: FmuModel, results: Iterable[Mapping[str, Any]]) -> list[Row]:
    """The outputs among these results, in the order of the table."""
    names = [v.name for v in model.variables(nut_map.header) if v.causality == "output"]
    return [{name: row[name] for name in names} for row in results]


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
        }


def friction_step(
    nut_map: NutMap, given: Mapping[str, float], step: float, before: Elements, heat: float = 0.0
) -> tuple[dict[str, Any], Elements]:
    """Outputs of BallScrewFriction and elements at the end of a step [s]; given: inputs and parameters by name."""
    point = [given[name] for name in (*POINT, *DEFAULTS)]
    nut = nut_map.evaluate(*point)._replace(seal_torque=given["seal_torque"])
    law = StandstillLaw(*(given[name] for name in StandstillLaw._fields))  # type: ignore[arg-type]
    result, coulomb = standstill.friction_step(nut_map, nut, point, law, step, before, heat)
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
    return _outputs(nut_map, FRICTION, results)


def monitor_outputs(nut_map: NutMap, inputs: Iterable[Mapping[str, float]]) -> list[Row]:
    """Outputs of BallScrewPreloadMonitor after each step of an input sequence."""
    starts, held, results = _starts(nut_map, MONITOR), None, []
    parameters = MonitorParameters(*(starts[name] for name in MonitorParameters._fields))
    for row in inputs:
        done = monitor_step(nut_map, MonitorInputs(**row), parameters, held)
        results.append(done.outputs)
        held = done.preload
    return _outputs(nut_map, MONITOR, results)


def _transmission_input(header: Mapping[str, Any]) -> Iterator[dict[str, float]]:
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


def _transmission_outputs(nut_map: NutMap, inputs: Iterable[Mapping[str, float]]) -> list[Row]:
    starts = _starts(nut_map, TRANSMISSION)
    parameters = TransmissionParameters(*(starts[name] for name in TransmissionParameters._fields))  # type: ignore[arg-type]
    before, heat, results = RELAXED, 0.0, []  # at rest before the first step
    for row in inputs:
        done = transmission_step(nut_map, TransmissionInputs(**row), parameters, STEP, before, heat)
        results.append(done.outputs)
        before, heat = done.elements, done.outputs["heat"]
    return _outputs(nut_map, TRANSMISSION, results)


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
    defaults = FrictionParameters(*nut_map.defaults)
    for n, (row, result) in enumerate(zip(inputs, results, strict=True)):
        kept = [result[name] for name in ("heat", "kinetic_energy", "potential_energy", "stored_energy")]
        supplied = result["supplied_energy"]
        if not abs(supplied - sum(kept)) <= BALANCE * sum(map(abs, kept)):
            raise CheckError(f"axis, step {n}: {supplied!r} J supplied, {sum(kept)!r} J kept")
        low, high = sorted(min(result[f"force_nut_{nut}"], nut_map.force.hi) for nut in "ab")
        nut = nut_map.evaluate_forces(low, high, result["speed"], row["temperature"], defaults)
        viscous = result["viscous_torque"]
        if not math.isclose(abs(viscous), nut.viscous_torque, rel_tol=BALANCE):
            raise CheckError(f"axis, step {n}: viscous_torque = {viscous!r}; the map {nut.viscous_torque!r}")
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
