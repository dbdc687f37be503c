"""The command axis: friction of a whole axis at the screw, by part."""

import math
from argparse import Namespace
from collections.abc import Mapping
from typing import Any

import numpy as np

from ballscrew_tehl._version import __version__
from ballscrew_tehl.applications.axis.budget import PART_NAMES, AxisBudget, axis_budget, budget_rows
from ballscrew_tehl.applications.report.data import default_point
from ballscrew_tehl.parameters.axis import AXIS_TABLES
from ballscrew_tehl.parameters.units import CELSIUS, RPM

from ..shared.inputs import chosen_of, map_of
from ..shared.output import Answer, check_output, filled, table, write_file

#: speeds of the table [r/min]; of the picture, evenly spaced in ln
TABLE_RPM, POINTS = (1.0, 10.0, 100.0, 300.0, 1000.0, 3000.0), 41


def run_axis(args: Namespace) -> Answer:
    """Budget of the axis at a point and over speed; its picture."""
    if args.plot:
        check_output("--plot", args.plot, "a file *.png, *.svg, *.pdf", inputs=(args.screw,))
    chosen = chosen_of(args)
    parameters, nut_map = chosen.parameters, map_of(chosen)
    usual = default_point(parameters)
    point = {
        "preload_n": usual.preload if args.preload_n is None else args.preload_n,
        "speed_rpm": usual.speed / RPM if args.speed_rpm is None else args.speed_rpm,
        "temperature_c": usual.temperature - CELSIUS if args.temperature_c is None else args.temperature_c,
        "axial_load_n": args.axial_load_n or 0.0,
    }

    def at(rpm: Any) -> AxisBudget:
        difference = args.temperature_difference_k or 0.0
        where = point["temperature_c"] + CELSIUS, point["axial_load_n"], difference
        return axis_budget(parameters, nut_map, chosen.friction_set, point["preload_n"], rpm * RPM, *where)

    rpm, highest = point["speed_rpm"], nut_map.header["axes"]["speed"][1] / RPM
    budget = at(abs(rpm))
    row = _signed(budget_rows(budget, parameters.screw)[0], math.copysign(1.0, rpm))
    row |= {"nut_axial_load_n": budget.axial_load}
    speeds = np.array([one for one in TABLE_RPM if one <= highest])
    over_speed = at(speeds)
    rows = [
        {"speed_rpm": float(one)} | row
        for one, row in zip(speeds, budget_rows(over_speed, parameters.screw), strict=True)
    ]
    missing = [name for name in AXIS_TABLES if name != "axis" and getattr(parameters, name) is None]
    if parameters.screw.seal_torque and "wipers" in missing:
        missing.remove("wipers")
    notes = [f"without a table, and not in the sum: {', '.join(missing)} (ballscrew init --axis)"] * bool(
        missing
    )
    notes += dict.fromkeys((*budget.notes, *over_speed.notes))
    result = {**point, **row, "not_stated": missing, "notes": notes, "over_speed": rows, **chosen.described}
    result["version"] = __version__
    if args.plot:
        from ballscrew_tehl.applications.axis.plot import budget_figure
        from ballscrew_tehl.applications.calibration.plot import png_of

        title = "{}, {preload_n:.5g} N, {temperature_c:.4g} C".format(parameters.name, **point)
        figure = budget_figure(at(np.geomspace(TABLE_RPM[0], highest, POINTS)), title)
        write_file("--plot", args.plot, png_of(figure))
    return Answer([result], text=_text(result, parameters.name))


def _signed(row: dict[str, Any], sign: float) -> dict[str, Any]:
    """Torques with the sign of the speed."""
    if sign > 0.0:
        return row
    ends = {"torque_low_nm": "torque_high_nm", "torque_high_nm": "torque_low_nm"}
    parts = {"parts": "parts", "parts_low": "parts_high", "parts_high": "parts_low"}
    row = row | {key: {name: -value for name, value in row[of].items()} for key, of in parts.items()}
    return row | {key: -row[of] for key, of in {"friction_torque_nm": "friction_torque_nm", **ends}.items()}


def _text(result: Mapping[str, Any], name: str) -> str:
    """Budget at the point, sums over speed."""
    head = "{}: preload {preload_n:.5g} N, {speed_rpm:g} r/min, oil {temperature_c:.4g} C, process {axial_load_n:g} N"
    if weight := result["nut_axial_load_n"] - result["axial_load_n"]:
        head += f", weight {weight:.4g} N"
    parts, low, high = (result[key] for key in ("parts", "parts_low", "parts_high"))
    whole = result["friction_torque_nm"]
    lines = [
        [PART_NAMES[part], f"{parts[part]:.4g}", f"{low[part]:.4g} to {high[part]:.4g}",
         f"{parts[part] / whole:.0%}" if whole else "-", f"{result['power_w'][part]:.4g}"]
        for part in parts
    ]  # fmt: skip
    lines.append(["sum", f"{whole:.4g}", "{torque_low_nm:.4g} to {torque_high_nm:.4g}".format(**result), "100%",
                  f"{result['power_loss_w']:.4g}"])  # fmt: skip
    over = [
        [f"{row['speed_rpm']:g}{'' if row['in_range'] else ' *'}", *(f"{row['parts'][part]:.4g}" for part in parts),
         *(f"{row[key]:.4g}" for key in ("friction_torque_nm", "torque_low_nm", "torque_high_nm"))]
        for row in result["over_speed"]
    ]  # fmt: skip
    texts = [
        head.format(name, **result), "",
        table(["friction at the screw", "N m", "80 % interval", "share", "W"], lines), "",
        table(["r/min", *(part.replace("_", " ") for part in parts), "sum", "low", "high"], over),
    ]  # fmt: skip
    if "efficiency" in result:
        texts += [
            "",
            "efficiency {efficiency:.1%}, table drives {efficiency_backdriving:.1%}".format(**result),
        ]
    if not all(row["in_range"] for row in (result, *result["over_speed"])):
        texts.append("* out of range")
    return "\n".join([*texts, *(filled(note, "note: ") for note in result["notes"])])
