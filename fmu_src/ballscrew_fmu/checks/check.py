"""Checks of a built FMU: validation in fmpy, replay against the map, torque compared with measurement."""

from pathlib import Path

from fmpy import validation

from ballscrew_fmu.checks.replay import AGREEMENT, CheckError, FmuInstance, check_replay, running
from ballscrew_fmu.models import AXIS, FRICTION, FmuModel
from ballscrew_fmu.native_fmu.experiments import Reference
from ballscrew_tehl.calibration.measured_screw import (
    ASSUMED_TEMPERATURE,
    PACKAGED_PRELOAD,
    ValidationRow,
    is_measured,
    mean_deviations,
    table_text,
    validation_tables,
)
from ballscrew_tehl.friction.baselines import nsk_torque, zhou_torque
from ballscrew_tehl.parameters.file import Parameters
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.tables.csv_file import read_rows

SETTLED = 1.0  # [s] step after which all elements slide at the speeds of the tables


def check(fmu: Path, reference: Reference, model: FmuModel = FRICTION) -> str:
    """Validation and replay of one FMU. Returns one line with the results.

    Raises       CheckError
    """
    refuse_findings(fmu)
    source = "its recorded result is" if model is AXIS else "the map gives"
    try:
        worst = check_replay(fmu, reference, source)
    except CheckError as error:
        raise CheckError(f"{fmu.name}: {error}") from error
    against = "its recorded results" if model is AXIS else "the map"
    return f"fmpy: no finding; replay against {against}: largest difference {worst:.1e} (limit {AGREEMENT:g})"


def refuse_findings(fmu: Path) -> None:
    """Raises CheckError with what the validation of fmpy finds."""
    if findings := validation.validate_fmu(str(fmu)):
        raise CheckError(f"fmpy validation of {fmu.name}: {' | '.join(findings)}")


def torque_tables(fmu: Path, parameters: Parameters, nut_map: NutMap) -> str:
    """Torque of the FMU compared with measurement and published models, for other screws with NSK and Zhou only.

    Raises       CheckError: the FMU discards a step
    """
    with running(fmu) as instance:

        def torque(preload: float, speed: float, temperature: float) -> float:
            if not instance.step(SETTLED, preload=preload, speed=speed, temperature=temperature):
                raise CheckError(f"the FMU discards a step: {instance.messages[-1][1]}")
            return float(instance.get("friction_torque"))

        screw, axes = parameters.screw, nut_map.header["axes"]
        lowest, highest = axes["force"][:2]
        if is_measured(screw, axes):
            tables = validation_tables(torque, preload_range=(lowest, highest))
            return "\n\n".join(table_text(table) for table in tables)
        lines = ["No measurement of this screw in the range of its map is packaged. Torque [N.m] at 303.15 K"]
        lines.append(" preload     r/min  this model   Zhou      NSK")
        for preload in (0.05 * highest, 0.1 * highest, 0.2 * highest, 0.4 * highest):
            for rpm in (100.0, 1000.0):
                ours = torque(preload, rpm * RPM, 303.15)
                values = (ours, float(zhou_torque(screw, preload)), float(nsk_torque(screw, preload)))
                lines.append(f"{preload:8.0f} N{rpm:8.0f}" + "".join(f"{value:10.4f}" for value in values))
        return "\n".join(lines)


def recovered_preload(fmu: Path, parameters: Parameters, nut_map: NutMap) -> str:
    """Mean deviation of the preload of a monitor from Table 3, as text. Empty for other screws and narrower maps.

    Raises       CheckError: a torque of the table is outside the range of the map
    """
    if not is_measured(parameters.screw, nut_map.header["axes"]):
        return ""
    try:
        with running(fmu) as instance:
            deviation = mean_deviations(table3(instance))[0]
    except CheckError as error:
        raise CheckError(f"{fmu.name}: {error}") from error
    return f"; preload of Table 3: {100.0 * deviation:.2f} % mean deviation"


def table3(instance: FmuInstance) -> list[ValidationRow]:
    """Table 3 of Zhao et al. (2023) with an FMU: preload from the measured torque at 100 r/min.

    Parameters   instance : of replay
    Raises       CheckError: a step is discarded, or a point is not in range
    """
    rows, speed = [], 100.0 * RPM
    for line in read_rows(PACKAGED_PRELOAD):
        inputs = {"torque": float(line["torque_Nm"]), "speed": speed, "temperature": ASSUMED_TEMPERATURE}
        if not (instance.step(1e-3, **inputs) and instance.get("in_range")):
            raise CheckError(f"no preload in range for {inputs}: {instance.messages[-1:]}")
        others = tuple(float(line[key]) for key in ("zhao_N", "zhou_N", "nsk_N"))
        measured = float(line["preload_N"])
        rows.append(ValidationRow(measured, speed, measured, (instance.get("preload"), *others)))
    return rows
