"""Texts of tables of friction for controllers and tools; each states its units and signs.

TwinCAT CNC and ISG kernel: compensation list of an axis, P-COMP-00041 to 00047. Source: Beckhoff TF5200, axis
compensation parameters: table[i].in velocity [um/s], ascending; table[i].out motor current in the unit of the drive.
Modelica: text of CombiTable1Ds, `#1`, `double name(rows, columns)`.
"""

import json
import math
from collections.abc import Callable, Iterable

from ballscrew_tehl.parameters.units import CELSIUS

from .friction_table import FrictionTable
from .piecewise import Points


def _comment(table: FrictionTable, mark: str) -> list[str]:
    """Lines of comment at the head of a file."""
    # one line each, whatever a name has
    about = (f"{name}: {' '.join(text.split())}" for name, text in table.about.items())
    return [f"{mark} {line}" for line in (*table.head, *about)]


def _numbers(values: Iterable[float], separator: str = " ") -> str:
    return separator.join(f"{value:.10g}" for value in values)


def point_text(point: Iterable[float]) -> str:
    """Preload [N] and temperature [degC]."""
    return "preload {:.6g} N, oil {:.6g} degC".format(*point)


def csv_text(table: FrictionTable, _: str = "") -> str:
    """One row for each preload, temperature and speed, both directions."""
    units, (_, speed, name), (_, effort) = table.units, table.units.names, table.units.si
    headings = ["preload [N]", "temperature [degC]"] * bool(table.preload.size)
    headings += [f"{speed} [{units.shown[2]}]"]
    headings += [f"{name} {key}".strip() + f" [{effort}]" for key in table.values]
    rows = [
        _numbers((*point, row[0] / units.one, *row[1:]), ",")
        for point, curve in table.curves()
        for row in curve
    ]
    return "\n".join([*_comment(table, "#"), ",".join(headings), *rows]) + "\n"


def json_text(table: FrictionTable, _: str = "") -> str:
    """Axes and arrays, units in the keys."""
    about = {**table.about, "content": table.head[0], "sign": table.head[1]}
    arrays = {table.units.speed: table.speed / table.units.one}
    if table.preload.size:
        about["order"] = "torque_nm[speed][preload][temperature]"
        arrays |= {"preload_n": table.preload, "temperature_c": table.temperature - CELSIUS}
    arrays |= {table.units.effort_key(key): values for key, values in table.values.items()}
    lists = {key: array.tolist() for key, array in arrays.items()}
    return json.dumps({"about": about} | lists, indent=1) + "\n"


def modelica_text(table: FrictionTable, _: str = "") -> str:
    """A table for each preload and temperature over the signed speed: columns speed, torque, low, high; 0 at rest."""
    (_, speed, name), (per_second, effort) = table.units.names, table.units.si
    columns = f"{speed} [{per_second}], " + ", ".join(f"{key or name} [{effort}]" for key in table.values)
    lines = ["#1", *_comment(table, "#")]
    lines.append(f"# columns: {columns}. At rest 0; between the lowest speeds straight through 0")
    for number, (point, curve) in enumerate(table.curves(at_rest=True), start=1):
        lines += [f"# {point_text(point)}"] if point else []
        lines += [f"double friction_{number}({curve.shape[0]},{curve.shape[1]})", *map(_numbers, curve)]
    return "\n".join(lines) + "\n"


def matlab_text(table: FrictionTable, function: str) -> str:
    """A function of the name of the file: friction by interpolation, or the breakpoints for a Lookup Table."""
    (_, speed, name), (per_second, effort) = table.units.names, table.units.si
    if not table.preload.size:
        (_, curve), *_ = table.curves(at_rest=True)
        axes, used = {"speed": curve[:, 0]}, ["speed"]
        arrays = {key or "value": values for key, values in zip(table.values, curve[:, 1:].T, strict=True)}
        usage = f"{speed} [{per_second}]"
        look_up = "interp1(t.speed, t.value, max(min(speed, t.speed(end)), t.speed(1)))"
    else:
        axes = {"speed": table.speed, "preload": table.preload, "temperature": table.temperature - CELSIUS}
        arrays = {f"{name}_{key}".rstrip("_"): values for key, values in table.values.items()}
        usage = "speed [rad/s], preload [N], temperature [degC]"
        used = [key for key, values in axes.items() if len(values) > 1]
        grid = ", ".join(f"t.{key}" for key in used)
        inside = ", ".join(f"max(min({key}, t.{key}(end)), t.{key}(1))" for key in used)
        inside = inside.replace("min(speed,", "min(abs(speed),")
        rule = "interp1" if len(used) == 1 else "interpn"
        look_up = (
            f"sign(speed) .* min(abs(speed) / t.speed(1), 1) .* {rule}({grid}, squeeze(t.{name}), {inside})"
        )
    lines = [
        f"function [{name}, t] = {function}({', '.join(axes)})",
        *_comment(table, "%"),
        f"% {name} [{effort}] = {function}({usage}); [~, t] = {function}() gives the breakpoints, for a Simulink "
        f"{len(axes)}-D Lookup Table",
        *["% Below the lowest speed straight to 0"] * (len(axes) > 1),
        *(f"t.{key} = [{_numbers(values)}];" for key, values in axes.items()),
    ]
    for key, values in arrays.items():
        lines.append(f"t.{key} = [{_numbers(values.ravel(order='F'))}];")
        if len(axes) > 1:
            lines.append(f"t.{key} = reshape(t.{key}, [{' '.join(map(str, values.shape))}]);")
    lines += [
        f"if nargin == 0, {name} = []; return, end",
        *(f"{key} = {key} + zeros(size(speed));" for key in used if key != "speed"),
        f"{name} = {look_up};",
        "end",
    ]
    return "\n".join(lines) + "\n"


#: text of a table and name of the file by format; a compensation list is one of points
FORMATS: dict[str, Callable[[FrictionTable, str], str]] = {
    "csv": csv_text,
    "json": json_text,
    "modelica": modelica_text,
    "matlab": matlab_text,
}


def twincat_text(
    table: FrictionTable, lead: float, points: Points, current_per_torque: float, unit: float, where: str
) -> str:
    """Compensation list: motor current over velocity, from 0 at rest.

    lead [m]; points: speed of the screw [rad/s], torque [N.m]; current_per_torque [A/(N.m)]; unit: of the current
    [A]; where: preload and temperature, or directions
    """
    per_turn = 1e6 * lead / (2.0 * math.pi)  # um for one radian
    lines = [
        *_comment(table, "#"),
        f"# {where}",
        f"# in: velocity of the axis [um/s]; out: motor current, 1 = {unit:.6g} A (the unit of the drive, "
        "P-COMP-00047)",
        "# builds before V3.1.3132 and V4.29 read whole numbers only: round both there",
        f"# torque over current at the screw {1.0 / current_per_torque:.6g} N.m/A",
        f"# largest error {points.error * current_per_torque:.3g} A = {points.error:.3g} N.m from the first point on; "
        f"no list of as many points has less than {points.bound:.3g} N.m",
        f"{'frict_comp.mode':<32}3",
        f"{'frict_comp.table_entries':<32}{len(points.x) + 1}",
    ]
    entries = [(0.0, 0.0), *zip(points.x * per_turn, points.y * current_per_torque / unit, strict=True)]
    for number, (velocity, current) in enumerate(entries):
        lines.append(f"{f'frict_comp.table[{number}].in':<32}{velocity:.10g}")
        lines.append(f"{f'frict_comp.table[{number}].out':<32}{current:.10g}")
    return "\n".join(lines) + "\n"
