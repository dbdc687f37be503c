"""Texts of tables of friction for controllers and tools; each states its units and signs.

TwinCAT CNC and ISG kernel: compensation list of an axis, P-COMP-00041 to 00047. Source: Beckhoff TF5200, axis
compensation parameters: table[i].in velocity [um/s], ascending; table[i].out motor current in the unit of the drive.
Modelica: text of CombiTable1Ds, `#1`, `double name(rows, columns)`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Protocol

import numpy as np

from ..parameters.units import CELSIUS, RPM
from .piecewise import Points
from .tables import FrictionTable


class Described(Protocol):
    """What the comments of a file say: content and sign, names with texts."""

    @property
    def head(self) -> tuple[str, str]: ...
    @property
    def about(self) -> dict[str, str]: ...


def comment(table: Described, mark: str) -> list[str]:
    """Lines of comment at the head of a file."""
    return [
        f"{mark} {line}" for line in (*table.head, *(f"{name}: {text}" for name, text in table.about.items()))
    ]


def _points(table: FrictionTable) -> Iterator[tuple[int, int, str]]:
    """Index of each preload and temperature, and both as text."""
    for j, preload in enumerate(table.preload):
        for k, kelvin in enumerate(table.temperature):
            yield j, k, f"preload {preload:.6g} N, oil {kelvin - CELSIUS:.6g} degC"


def csv_text(table: FrictionTable) -> str:
    """One row for each preload, temperature and speed, both directions."""
    limits = table.low is not None and table.high is not None
    lines = [*comment(table, "#"), "preload [N],temperature [degC],speed [r/min],torque [N.m]"
             + (",torque low [N.m],torque high [N.m]" if limits else "")]  # fmt: skip
    for j, k, _ in _points(table):
        both = [(-1.0, i) for i in reversed(range(len(table.speed)))] + [
            (1.0, i) for i in range(len(table.speed))
        ]
        for sign, i in both:
            values = [
                table.preload[j],
                table.temperature[k] - CELSIUS,
                sign * table.speed[i] / RPM,
                sign * table.torque[i, j, k],
            ]
            if table.low is not None and table.high is not None:
                values += [sign * table.low[i, j, k], sign * table.high[i, j, k]]
            lines.append(",".join(f"{value:.10g}" for value in values))
    return "\n".join(lines) + "\n"


def json_text(table: FrictionTable) -> str:
    """Axes and arrays, units in the keys."""
    data = {
        "about": {**table.about, "sign": table.head[1], "order": "torque_nm[speed][preload][temperature]"},
        "speed_rpm": (table.speed / RPM).tolist(),
        "preload_n": table.preload.tolist(),
        "temperature_c": (table.temperature - CELSIUS).tolist(),
        "torque_nm": table.torque.tolist(),
    }
    if table.low is not None and table.high is not None:
        data |= {"torque_low_nm": table.low.tolist(), "torque_high_nm": table.high.tolist()}
    return json.dumps(data, indent=1) + "\n"


def modelica_text(table: FrictionTable) -> str:
    """A table for each preload and temperature, odd in speed: columns speed, torque, low, high."""
    lines = ["#1", *comment(table, "#")]
    limits = table.low is not None and table.high is not None
    lines.append(
        "# columns: speed [rad/s], torque [N.m]" + (", low [N.m], high [N.m]" if limits else "")
        + ". At rest 0; between the lowest speeds straight through 0"
    )  # fmt: skip
    for number, (j, k, text) in enumerate(_points(table), start=1):
        columns = [table.speed, table.torque[:, j, k]]
        if table.low is not None and table.high is not None:
            columns += [table.low[:, j, k], table.high[:, j, k]]
        half = np.column_stack(columns)
        whole = np.vstack([-half[::-1], np.zeros((1, half.shape[1])), half])
        lines += [f"# {text}", f"double friction_{number}({whole.shape[0]},{whole.shape[1]})"]
        lines += [" ".join(f"{value:.10g}" for value in row) for row in whole]
    return "\n".join(lines) + "\n"


def matlab_row(name: str, values: np.ndarray) -> str:
    return f"t.{name} = [{' '.join(f'{value:.10g}' for value in values)}];"


def matlab_text(table: FrictionTable, name: str) -> str:
    """A function of the name of the file: torque by interpn over its breakpoints, or the breakpoints themselves."""
    size = f"[{len(table.speed)} {len(table.preload)} {len(table.temperature)}]"
    lines = [
        f"function [torque, t] = {name}(speed, preload, temperature)",
        *comment(table, "%"),
        f"% torque [N.m] = {name}(speed [rad/s], preload [N], temperature [degC]); [~, t] = {name}() gives the "
        "breakpoints",
        "% t.torque(speed, preload, temperature), for a Simulink n-D Lookup Table. Below the lowest speed "
        "straight to 0",
        matlab_row("speed", table.speed),
        matlab_row("preload", table.preload),
        matlab_row("temperature", table.temperature - CELSIUS),
    ]
    for key, values in (("torque", table.torque), ("torque_low", table.low), ("torque_high", table.high)):
        if values is not None:
            lines += [matlab_row(key, values.ravel(order="F")), f"t.{key} = reshape(t.{key}, {size});"]
    axes = [key for key in ("speed", "preload", "temperature") if len(getattr(table, key)) > 1]
    inside = ", ".join(
        f"max(min({'abs(speed)' if key == 'speed' else key}, t.{key}(end)), t.{key}(1))" for key in axes
    )
    grid = ", ".join(f"t.{key}" for key in axes)
    look_up = (
        f"interp1(t.speed, squeeze(t.torque), {inside})"
        if len(axes) == 1
        else f"interpn({grid}, squeeze(t.torque), {inside})"
    )
    lines += [
        "if nargin == 0, torque = []; return, end",
        *(f"{key} = {key} + zeros(size(speed));" for key in axes if key != "speed"),
        f"torque = sign(speed) .* min(abs(speed) / t.speed(1), 1) .* {look_up};",
        "end",
    ]
    return "\n".join(lines) + "\n"


def twincat_text(
    table: Described, lead: float, points: Points, current_per_torque: float, unit: float, where: str
) -> str:
    """Compensation list: motor current over velocity, from 0 at rest.

    Parameters   points : speed of the screw [rad/s], torque [N.m];  current_per_torque : [A/(N.m)]
                 lead [m];  unit : one of the drive's current [A];  where : preload and temperature, or directions
    """
    per_turn = 1e6 * lead / (2.0 * math.pi)  # um for one radian
    entries = [
        (0.0, 0.0),
        *((w * per_turn, t * current_per_torque / unit) for w, t in zip(points.x, points.y, strict=True)),
    ]
    lines = [
        *comment(table, "#"),
        f"# {where}",
        f"# in: velocity of the axis [um/s]; out: motor current, 1 = {unit:.6g} A (the unit of the drive, "
        "P-COMP-00047)",
        "# builds before V3.1.3132 and V4.29 read whole numbers only: round both there",
        f"# torque over current at the screw {1.0 / current_per_torque:.6g} N.m/A",
        f"# largest error {points.error * current_per_torque:.3g} A = {points.error:.3g} N.m from the first point "
        "on; no list "
        f"of as many points has less than {points.bound:.3g} N.m",
        f"{'frict_comp.mode':<32}3",
        f"{'frict_comp.table_entries':<32}{len(entries)}",
    ]
    for number, (speed, current) in enumerate(entries):
        lines += [
            f"{f'frict_comp.table[{number}].in':<32}{speed:.10g}",
            f"{f'frict_comp.table[{number}].out':<32}{current:.10g}",
        ]
    return "\n".join(lines) + "\n"
