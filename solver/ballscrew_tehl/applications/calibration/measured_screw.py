"""Torques measured on the packaged screw, Tables 2, 3 and 4 of Zhao et al. (2023), and a model compared with them.

The packaged set three_parameter is fitted to them; every FMU of this screw is compared with them when it is built.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ballscrew_tehl.parameters.file import PACKAGED_DATA, ScrewParameters, load_screw
from ballscrew_tehl.parameters.units import RPM

from ..preload import preload_from_torque
from ..tables.csv_file import read_rows
from .measurements import Measurement, merged

PACKAGED_TORQUE, PACKAGED_PRELOAD = (PACKAGED_DATA / f"zhao2023_{name}.csv" for name in ("torque", "preload"))

#: preload [N], speed [rad/s], oil temperature [K] -> friction torque [N.m]
Evaluate = Callable[[float, float, float], float]

#: oil temperature of the measurements [K]; not printed, the reference temperature of Table 1 is assumed
ASSUMED_TEMPERATURE = 303.0
MODELS = ("this model", "Zhao", "Zhou", "NSK")
#: and unit
TITLES = {
    "table2": ("Table 2: torque over preload at 100 r/min", "N.m"),
    "table4": ("Table 4: torque over speed at 1000 N", "N.m"),
    "table3": ("Table 3: preload recovered from the measured torque at 100 r/min", "N"),
}
#: range of a map that the tables need, SI; force: 1000 to 6000 N and a quarter more, for the preload of Table 3
NEEDED = {
    "force": (800.0, 7500.0),
    "speed": (100.0 * RPM, 2500.0 * RPM),
    "temperature": (ASSUMED_TEMPERATURE, ASSUMED_TEMPERATURE),
}


class ValidationRow(NamedTuple):
    """One operating point: measured value and values of the models (N.m, in Table 3 N), in the order of MODELS."""

    preload: float
    speed: float
    measured: float
    models: tuple[float, ...]


class ValidationTable(NamedTuple):
    """A table of the paper.

    Attributes
    ----------
    name, title, unit : str
        Its names, and the unit of its values.
    rows : list of ValidationRow
        Operating points.
    """

    name: str
    title: str
    unit: str
    rows: list[ValidationRow]

    @property
    def deviations(self) -> list[float]:
        """Means of |model/measured - 1|, in the order of MODELS."""
        errors = [[abs(value / row.measured - 1.0) for value in row.models] for row in self.rows]
        return [sum(column) / len(errors) for column in zip(*errors, strict=True)]


def packaged_measurements(temperature: float = ASSUMED_TEMPERATURE) -> list[Measurement]:
    """Distinct measured torques of Tables 2 and 4 of the paper, 11 points, tables "table2" and "table4".

    Parameters
    ----------
    temperature : float, optional
        Temperature of the oil [K], which is not printed.

    Returns
    -------
    list of Measurement
        The points.

    Notes
    -----
    Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231.

    Examples
    --------
    >>> len(packaged_measurements())
    11
    """
    return merged(
        Measurement(
            float(row["preload_N"]), float(row["speed_rpm"]) * RPM, temperature, float(row["measured_Nm"]),
            (row["table"],),
        )
        for row in read_rows(PACKAGED_TORQUE)
    )  # fmt: skip


def is_measured(screw: ScrewParameters, axes: Mapping[str, Any]) -> bool:
    """Whether the measured torques are of this screw and in the range of a map with these axes."""
    inside = (axes[name][0] <= low and high <= axes[name][1] for name, (low, high) in NEEDED.items())
    return screw == load_screw().screw and all(inside)


def validation_tables(
    evaluate: Evaluate, preload_range: tuple[float, float] = (100.0, 12000.0)
) -> list[ValidationTable]:
    """Tables 2, 4 and 3 (preload from the measured torque) of the paper with a model and the printed columns.

    Parameters
    ----------
    evaluate : callable
        Torque [N.m] at preload [N], speed [rad/s], temperature [K], rising with the preload (map, direct solve, FMU).
    preload_range : pair of float, optional
        Range of the search for the preload of Table 3 [N].

    Returns
    -------
    list of ValidationTable
        The tables.

    Notes
    -----
    Measured, Zhao, Zhou, NSK: Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231, as printed.

    Examples
    --------
    >>> from ballscrew_tehl import load_map
    >>> nut_map = load_map()
    >>> tables = validation_tables(lambda *point: nut_map.evaluate(*point).friction_torque)
    >>> [f"{table.name}: {100.0 * table.deviations[0]:.0f} %" for table in tables]
    ['table2: 1 %', 'table4: 1 %', 'table3: 2 %']
    """
    tables = {name: ValidationTable(name, *heads, []) for name, heads in TITLES.items()}
    for line in read_rows(PACKAGED_TORQUE):
        preload, rpm, measured, *others = (
            float(line[key])
            for key in ("preload_N", "speed_rpm", "measured_Nm", "zhao_Nm", "zhou_Nm", "nsk_Nm")
        )
        ours = float(evaluate(preload, rpm * RPM, ASSUMED_TEMPERATURE))
        tables[line["table"]].rows.append(ValidationRow(preload, rpm * RPM, measured, (ours, *others)))
    speed = 100.0 * RPM
    for line in read_rows(PACKAGED_PRELOAD):
        preload, torque, *others = (
            float(line[key]) for key in ("preload_N", "torque_Nm", "zhao_N", "zhou_N", "nsk_N")
        )
        ours = preload_from_torque(
            lambda force: evaluate(force, speed, ASSUMED_TEMPERATURE), torque, *preload_range
        )
        tables["table3"].rows.append(ValidationRow(preload, speed, preload, (ours, *others)))
    return list(tables.values())


def table_text(shown: ValidationTable) -> str:
    """One table as text, with the mean deviations below."""
    digits = 4 if shown.unit == "N.m" else 1
    lines = [f"{shown.title} [{shown.unit}]"]
    lines.append(f"{'preload':>9}{'speed':>7}{'measured':>10}" + "".join(f"{name:>12}" for name in MODELS))
    for row in shown.rows:
        head = f"{row.preload:7.0f} N{row.speed / RPM:7.0f}{row.measured:10.{digits - 1}f}"
        lines.append(head + "".join(f"{value:12.{digits}f}" for value in row.models))
    means = "".join(f"{100.0 * value:10.2f} %" for value in shown.deviations)
    return "\n".join([*lines, f"{'mean deviation':<26}{means}"])
