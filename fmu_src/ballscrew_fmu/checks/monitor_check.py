"""Expected results of BallScrewPreloadMonitor: from the map for an input sequence, and from Table 3 of the paper."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ballscrew_fmu.variables.monitor import monitor_variables
from ballscrew_tehl.calibration.csv_table import read_rows
from ballscrew_tehl.calibration.measurements import PACKAGED_PRELOAD, RPM
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.monitor import MonitorInputs, MonitorParameters, monitor_step
from ballscrew_tehl.validation.tables import ASSUMED_TEMPERATURE, ValidationRow


def monitor_outputs(
    nut_map: NutMap, inputs: Iterable[Mapping[str, float]], **parameters: float
) -> list[dict[str, Any]]:
    """Outputs after each step of an input sequence, from a new instance.

    Parameters   inputs : torque [N.m], speed [rad/s], temperature [K], axial_load [N]
                 parameters : by name; the others keep their start values
    """
    table = monitor_variables(nut_map.header)
    starts = {v.name: v.start for v in table if v.causality == "parameter"} | parameters
    names = [v.name for v in table if v.causality == "output"]
    law = MonitorParameters(*(float(starts[name] or 0.0) for name in MonitorParameters._fields))
    held, results = None, []
    for row in inputs:
        done = monitor_step(nut_map, MonitorInputs(**row), law, held)
        results.append({name: done.outputs[name] for name in names})
        held = done.preload
    return results


def preload_error(true: Sequence[float], outputs: Sequence[Mapping[str, Any]]) -> float:
    """Largest relative error of the preload, over the outputs in range. NaN if none is in range."""
    found = [abs(o["preload"] / p - 1.0) for p, o in zip(true, outputs, strict=True) if o["in_range"]]
    return max(found) if found else float("nan")


def table3(instance: Any) -> list[ValidationRow]:
    """Table 3 of Zhao et al. (2023) with an FMU: preload from the measured torque at 100 r/min.

    Parameters   instance : of replay.FmuInstance or replay_fmi3.Fmu3Instance
    Raises       RuntimeError: a step is discarded, or a point is not in range
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
