"""What BallScrewPreloadMonitor must answer: from the map for a sequence of inputs, and from the paper's Table 3."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ballscrew_fmu.variables.monitor import monitor_variables
from ballscrew_tehl.calibration.measurements import PACKAGED_PRELOAD, RPM, read_rows
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.preload import OverPreload, estimate_preload
from ballscrew_tehl.validation.tables import ASSUMED_TEMPERATURE, ValidationRow


def monitor_outputs(
    nut_map: NutMap, inputs: Iterable[Mapping[str, float]], **parameters: float
) -> list[dict[str, Any]]:
    """Outputs after each step of an input sequence, from a fresh instance.

    Parameters   inputs : torque [N.m], speed [rad/s], temperature [K], axial_load [N]
                 parameters : by name; the others have their start values
    """
    table = monitor_variables(nut_map.header)
    starts = {v.name: v.start for v in table if v.causality == "parameter"} | parameters
    names = ("apparent_viscosity_ratio", "net_sliding_coefficient", "roughness_height")
    friction = [starts[name] for name in names]
    slowest, uncertainty = starts["speed_min"], starts["torque_uncertainty"]
    held, highest, results = starts["initial_preload"], nut_map.force.hi, []
    for row in inputs:
        speed, point = row["speed"], (row["temperature"], row["axial_load"], *friction)
        moving = abs(speed) >= slowest and speed != 0.0
        if moving:
            found = estimate_preload(nut_map, row["torque"], speed, *point, starts["regularization_speed"])
            preload, slope, in_range = found.preload, found.torque_sensitivity, found.in_range
            held = preload if in_range else held
        else:
            over = OverPreload(nut_map, max(abs(speed), slowest), *point, starts["regularization_speed"])
            preload, slope, in_range = held, over.torque(min(held, highest))[1], False
        results.append({
            "preload": preload,
            "preload_half_width": uncertainty / slope if uncertainty < slope * highest else highest,
            "torque_sensitivity": slope,
            "lambda_ratio": nut_map.evaluate_point(preload, speed, *point).lambda_ratio,
            "in_range": in_range,
        })  # fmt: skip
    return results


def lost_preload(true: Sequence[float], outputs: Sequence[Mapping[str, Any]]) -> float:
    """Largest relative difference of preload from the true one [N] among the outputs in range; nan without any."""
    found = [abs(o["preload"] / p - 1.0) for p, o in zip(true, outputs, strict=True) if o["in_range"]]
    return max(found) if found else float("nan")


def table3(instance: Any) -> list[ValidationRow]:
    """Table 3 of Zhao et al. (2023) through an FMU: preload from the measured torque at 100 r/min.

    Parameters   instance : of replay.FmuInstance or replay_fmi3.Fmu3Instance
    Raises       RuntimeError: it discards a step, or a point is not in range
    """
    rows, speed = [], 100.0 * RPM
    for line in read_rows(PACKAGED_PRELOAD):
        inputs = {"torque": float(line["torque_Nm"]), "speed": speed, "temperature": ASSUMED_TEMPERATURE}
        if not (instance.step(1e-3, **inputs) and instance.get("in_range")):
            raise RuntimeError(f"no preload in range for {inputs}: {instance.messages[-1:]}")
        others = tuple(float(line[key]) for key in ("zhao_N", "zhou_N", "nsk_N"))
        measured = float(line["preload_N"])
        rows.append(ValidationRow(measured, speed, measured, (instance.get("preload"), *others)))
    return rows
