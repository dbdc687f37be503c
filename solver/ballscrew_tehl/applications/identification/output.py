"""Results of an identification: keys of JSON, text, the file of measurements."""

from collections.abc import Sequence
from itertools import zip_longest
from typing import Any

import numpy as np

from ballscrew_tehl._version import __version__
from ballscrew_tehl.numerics import Array
from ballscrew_tehl.parameters.units import CELSIUS, RPM

from .directions import LIMIT, UNITS, Bidirectional, option, varies, weights
from .dynamics import Identified

#: what friction from one log is of
CONTAINS = (
    "the friction is that of the whole axis: screw, guides, seals and bearings of screw and motor together; one log "
    "does not tell them apart: give --guide-force-n, --seal-torque-nm or --without-nut LOG.csv"
)
HEAD = """# friction torque of the nut from a log, mean of both directions; torque error: one standard error
preload [N],speed [r/min],temperature [degC],torque [N.m],torque error [N.m]"""
#: most rows of a file of measurements, about those of the text in each direction
MAX_ROWS, TEXT_ROWS = 12, 6
#: of a preload whose torque contains more than that of the nut
TOO_HIGH = (
    ", too high by the friction of {missing}, which counts as the nut's: state it in the screw file (0 if there is "
    "none), by --guide-force-n, --seal-torque-nm or --without-nut LOG.csv"
)
#: lines of the text on the preload, by a key that they need
PRELOAD_LINES = {
    "preload_is_upper_bound": "preload   at most {preload_high_n:.5g} N at {oil_temperature_c:.4g} C, an upper bound"
    + TOO_HIGH,
    "shape_fits": "preload   {preload_n:.5g} N at {oil_temperature_c:.4g} C, {preload_low_n:.5g} to "
    "{preload_high_n:.5g} N ({preload_interval})\n"
    "shape     over speed: law {fits} within the errors, deviation {shape_deviation:.2%}, exponent of speed "
    "{shape_exponent_difference:+.2g}",
    "preload_ratio": "change    preload over that of the log before {preload_ratio:.4f}, {preload_ratio_low:.4f} to "
    "{preload_ratio_high:.4f} (from {preload_before_n:.5g} N)",
    "without_nut_nm": "other     part that does not depend on the preload {without_nut_nm:.3g} N m, "
    "{without_nut_low_nm:.3g} to {without_nut_high_nm:.3g}; law times {law_factor:.3g}, {law_factor_low:.3g} to "
    "{law_factor_high:.3g}",
}


def identified_data(result: Identified) -> dict[str, Any]:
    """Keys of --json."""
    units, friction, both = UNITS[result.rotary], result.friction, result.both

    def limits(key: str, value: float | None, bounds: tuple[float, float] | None) -> dict[str, float | None]:
        low, high = bounds or (None, None)
        return {key.format(""): value, key.format("low_"): low, key.format("high_"): high}

    def rows(first: str, *columns: Array, parts: Sequence[str] = ("", "error")) -> list[dict[str, float]]:
        names = first, *map(units.effort_key, parts)
        return [dict(zip(names, row, strict=True)) for row in np.column_stack(columns).tolist()]

    bins = rows(
        units.speed, friction.speed / units.one, friction.value, friction.low, friction.high, friction.error,
        parts=("", "low", "high", "error"),
    )  # fmt: skip
    error = np.hypot(both.error, result.offset_error or 0.0)
    return {
        "kind": "rotary" if result.rotary else "linear",
        "model": (
            f"{units.names[2]} = {units.inertia.format('')} * {'angular ' * result.rotary}acceleration + "
            f"{units.offset.format('')} + friction(speed); friction is without the offset and has the sign of the speed"
        ),
        **limits(units.inertia, result.inertia, result.inertia_limits),
        **limits(units.offset, None if result.offset_limits is None else result.offset, result.offset_limits),
        "offset_given": result.offset_error is not None,
        "friction": [row | {"samples": int(n)} for row, n in zip(bins, friction.samples, strict=True)],
        "direction_difference": rows(units.speed, both.speed / units.one, both.difference, error),
        "direction_difference_varies": varies(both),
        **limits("delay_{}s", result.delay, result.delay_limits),
        "cutoff_hz": result.cutoff,
        units.effort_key("residual"): result.residual,
        "explained": result.explained,
        "residual_over_position": rows(units.place, *result.places),
        "samples": result.samples,
        "left_out": {reason: count for reason, count in result.left_out.items() if count},
        "temperature_c": None if result.temperature is None else result.temperature - CELSIUS,
        "findings": [one._asdict() for one in result.findings],
        "notes": result.notes,
        "version": __version__,
    }


def identified_text(result: Identified, data: dict[str, Any]) -> str:
    """The result as text: the answer, friction over speed, what was left out, notes."""
    units, both, mean, error = UNITS[result.rotary], result.both, *result.places[1:]
    inertia, effort, speed = units.shown
    of_offset = "; by convention what friction alike in both directions leaves: one log cannot tell it from"
    of_offset += f" a difference of friction between them; if it is known: {option(units.offset)}"
    if result.offset_error is not None:
        of_offset = " (given)"
        if len(both.speed):
            weight = weights(both.error)
            own = np.average(both.difference, weights=weight)
            half = LIMIT * np.hypot(np.sum(weight) ** -0.5, result.offset_error)
            of_offset += f"; friction's own (f+ - f-)/2 {own:+.3g} +- {half:.2g} {effort} in the mean"
    of_delay = f" of the {units.names[2]} behind the motion, with friction that still rises behind reversals"
    if data.get("preload_is_upper_bound"):
        data = data | {"missing": ", ".join(data["not_stated"])}
    fits = "fits" if data.get("shape_fits") else "does not fit"
    lines = [
        text.format(fits=fits, **data) for key, text in PRELOAD_LINES.items() if data.get(key) is not None
    ]
    if data.get("subtracted"):
        parts = ", ".join(
            "{} {torque_nm:.3g} ({low_nm:.3g} to {high_nm:.3g})".format(name, **part)
            for name, part in data["subtracted"].items()
        )
        left = "{nut_share:.0%} of {axis_torque_nm:.3g} N m at {typical_speed_rpm:.4g} r/min".format(**data)
        lines.append(f"nut       {left}; subtracted, 80 % [N m]: {parts}")
    contains = [] if lines else filter(None, [data.get("contains")])
    for name, key, factor, unit, remark in (
        (units.names[0], units.inertia, 1.0, inertia, ""),
        ("offset", units.offset, 1.0, effort, of_offset),
        ("delay", "delay_{}s", 1e3, "ms", of_delay),
    ):
        value, low, high = (data[key.format(part)] for part in ("", "low_", "high_"))
        if value is None:
            continue
        limits = " (given)" if low is None else f", 95 %: {factor * low:.5g} to {factor * high:.5g}"
        lines.append(f"{name:<10}{factor * value:.6g} {unit}{limits * (low is None or low < high)}{remark}")
    left_out = ", ".join(f"{count} {reason}" for reason, count in data["left_out"].items()) or "none"
    of_filter = f"{result.explained:.2%} of the variance explained, residual {result.residual:.3g} {effort}"
    lines.append(f"{'filter':<10}{result.cutoff:.4g} Hz; {of_filter}")
    if len(mean):
        position = f"{mean.min():.2g} to {mean.max():.2g} {effort} (error {error.max():.1g})"
        lines.append(f"residual over position: {position}")
    friction = result.friction
    head = f"{speed:>12}{'friction ' + effort:>14}{'+-':>10}{'samples':>10}"
    half = 0.5 * (friction.high - friction.low)
    columns = friction.speed / units.one, friction.value, half, friction.samples
    cells = ["{:>12.5g}{:>14.4g}{:>10.2g}{:>10}".format(*row) for row in zip(*columns, strict=True)]
    back = int(np.sum(friction.speed < 0.0))
    few = [side[:: max(len(side) // TEXT_ROWS, 1)] for side in (cells[back:], cells[:back][::-1])]
    sides = zip_longest(*([head, *side] for side in few), fillvalue="")
    lines += ["", *(f"{ahead:<46}  |{behind}" for ahead, behind in sides)]
    more = sum(map(len, few)) < len(cells)
    lines += [f"{'':>12}some of {len(cells)} bins; all: --json, --output" * more, ""]
    lines.append(f"samples used: {result.samples}; left out: {left_out}")
    lines += [f"note: {note}" for note in [*result.notes, *contains]]
    return "\n".join(lines)


def measurements_text(friction: Bidirectional, preload: float, temperature: float) -> str:
    """File of measurements for calibrate: mean of both directions, neighbouring speeds joined by their weights."""
    lines = [HEAD]
    for piece in np.array_split(np.arange(len(friction.speed)), min(MAX_ROWS, len(friction.speed))):
        # errors of neighbours are hardly independent: their mean, not that over the root of their number
        weight = weights(friction.error[piece])
        speed, torque, _, error = (np.average(values[piece], weights=weight) for values in friction)
        point = f"{preload:.6g},{speed / RPM:.6g},{temperature - CELSIUS:.5g}"
        lines.append(f"{point},{torque:.6g},{max(error, 1e-6 * torque):.3g}")
    return "\n".join(lines) + "\n"
