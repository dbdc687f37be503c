"""Results of an identification: keys of JSON, text, the file of measurements."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from .._version import __version__
from ..parameters.units import CELSIUS, RPM
from ..physics.ball_law import Array
from .directions import LIMIT, varies
from .dynamics import Identified
from .preload import Apart, Change, FoundPreload, ScrewFriction, measurement_rows

#: what friction from one log is of
CONTAINS = (
    "the friction is that of the whole axis: screw, guides, seals and bearings of screw and motor together; one log "
    "does not tell them apart: give --guide-force-n, --seal-torque-nm or --without-nut LOG.csv"
)
HEADINGS = "preload [N],speed [r/min],temperature [degC],torque [N.m],torque error [N.m]"


def _limits(key: str, value: float, limits: tuple[float, float] | None) -> dict[str, float | None]:
    low, high = limits or (None, None)
    return {key.format(""): value, key.format("low_"): low, key.format("high_"): high}


def identified_data(found: Identified) -> dict[str, Any]:
    """Keys of --json."""
    units, friction, both = found.units, found.friction, found.both
    motion = "acceleration" if not found.rotary else "angular acceleration"

    def rows(first: str, *columns: Array, keys: Sequence[str] = ("", "error")) -> list[dict[str, float]]:
        names = first, *map(units.effort_key, keys)
        return [dict(zip(names, map(float, row), strict=True)) for row in zip(*columns, strict=True)]

    bins = rows(
        units.speed, friction.speed / units.one, friction.value, friction.low, friction.high, friction.error,
        keys=("", "low", "high", "error"),
    )  # fmt: skip
    errors = np.hypot(both.error, found.offset_error or 0.0)
    return {
        "kind": "rotary" if found.rotary else "linear",
        "model": (
            f"{units.names[2]} = {units.inertia.format('')} * {motion} + {units.offset.format('')} + "
            "friction(speed); friction is without the offset and has the sign of the speed"
        ),
        **_limits(units.inertia, found.inertia, found.inertia_limits),
        **_limits(units.offset, found.offset, found.offset_limits),
        "offset_given": found.offset_error is not None,
        "friction": [
            row | {"samples": int(count)} for row, count in zip(bins, friction.samples, strict=True)
        ],
        "direction_difference": rows(units.speed, both.speed / units.one, both.difference, errors),
        "direction_difference_varies": varies(both),
        **_limits("delay_{}s", found.delay, found.delay_limits),
        "cutoff_hz": found.cutoff,
        units.effort_key("residual"): found.residual,
        "explained": found.explained,
        "residual_over_position": rows(units.place, *found.places),
        "samples": found.samples,
        "left_out": {reason: count for reason, count in found.left_out.items() if count},
        "temperature_c": None if found.temperature is None else found.temperature - CELSIUS,
        "notes": found.notes,
        "version": __version__,
    }


def preload_data(found: FoundPreload) -> dict[str, Any]:
    """What a map adds."""
    return {
        "preload_n": found.preload, "preload_low_n": found.low, "preload_high_n": found.high,
        "preload_interval": found.meaning, "preload_log_low_n": found.log_low, "preload_log_high_n": found.log_high,
        "shape_deviation": found.deviation, "shape_exponent_difference": found.slope, "shape_fits": found.within,
    }  # fmt: skip


def change_data(change: Change) -> dict[str, Any]:
    """What a log before adds."""
    keys = "preload_before_n", "preload_ratio", "preload_ratio_low", "preload_ratio_high"
    return dict(zip(keys, change, strict=True))


def apart_data(apart: Apart) -> dict[str, Any]:
    """What two known preloads or temperatures add."""
    keys = (
        *(f"without_nut_{end}nm" for end in ("", "low_", "high_")),
        *(f"law_factor{end}" for end in ("", "_low", "_high")),
    )
    return dict(zip(keys, apart, strict=True))


def identified_text(found: Identified, data: dict[str, Any]) -> str:
    """The result as text: the answer, friction over speed, what was left out, notes."""
    units = found.units
    inertia, effort, _ = units.shown
    if found.offset_error is None:
        key = units.offset.format("").replace("_", "-")
        of_offset = (
            "; by convention what friction alike in both directions leaves: one log cannot tell it from a difference "
            f"of friction between them; if it is known: --{key}"
        )
    else:
        of_offset = f" (given); {_difference(found)}"
    lines = [
        *_preload_lines(data),
        _line(units.names[0], found.inertia, inertia, found.inertia_limits),
        _line("offset", found.offset, effort, found.offset_limits if found.offset_error != 0.0 else ()) + of_offset,
        _line("delay", 1e3 * found.delay, "ms", found.delay_limits and [1e3 * end for end in found.delay_limits])
        + f" of the {units.names[2]} behind the motion: sampling, filters and hold of the "
        "drive; friction that still rises behind reversals adds to it",
        f"{'filter':<10}{found.cutoff:.4g} Hz; {100.0 * found.explained:.2f} % of the variance explained, residual "
        f"{found.residual:.3g} {effort}",
        "",
        *_friction_lines(found),
    ]  # fmt: skip
    mean, error = found.places[1], found.places[2]
    lines += [
        "",
        f"residual over position: {mean.min():.2g} to {mean.max():.2g} {effort} (error "
        f"{max(error, default=0.0):.1g})",
    ]
    lines.append(f"samples used: {found.samples}; left out: " + (
        ", ".join(f"{count} {reason}" for reason, count in data["left_out"].items()) or "none"))  # fmt: skip
    notes = [*found.notes, *([data["contains"]] if "contains" in data else [])]
    return "\n".join([*lines, *(f"note: {note}" for note in notes)])


def _line(name: str, value: float, unit: str, limits: Sequence[float] | None) -> str:
    """A value with its limits, None: it was given, empty: none are shown."""
    ends = " (given)" if limits is None else f", 95 %: {limits[0]:.5g} to {limits[1]:.5g}" if limits else ""
    return f"{name:<10}{value:.6g} {unit}{ends}"


def _difference(found: Identified) -> str:
    """What a known offset leaves to friction."""
    both = found.both
    if not len(both.speed):
        return "no speed that both directions have in common"
    weight = 1.0 / both.error**2
    mean = float(np.average(both.difference, weights=weight))
    half = LIMIT * math.hypot(float(np.sum(weight)) ** -0.5, found.offset_error or 0.0)
    return f"friction's own (f+ - f-)/2 {mean:+.3g} +- {half:.2g} {found.units.shown[1]} in the mean"


def _preload_lines(data: dict[str, Any]) -> list[str]:
    """Preload, its change, the part without the nut."""
    lines = []
    if "preload_n" in data:
        lines += [
            f"{'preload':<10}{data['preload_n']:.5g} N, {data['preload_low_n']:.5g} to {data['preload_high_n']:.5g} N "
            f"({data['preload_interval']})",
            f"{'shape':<10}over speed: law {'fits' if data['shape_fits'] else 'does not fit'} within the errors, "
            f"deviation {100.0 * data['shape_deviation']:.2g} %, exponent of speed "
            f"{data['shape_exponent_difference']:+.2g}",
        ]
    if "preload_ratio" in data:
        change, low, high = (
            100.0 * (data[key] - 1.0) for key in ("preload_ratio", "preload_ratio_low", "preload_ratio_high")
        )
        lines.append(
            f"{'change':<10}{change:+.2f} % of the preload since the log before, {low:+.2f} to {high:+.2f} % (from "
            f"{data['preload_before_n']:.5g} N)"
        )
    if "without_nut_nm" in data:
        lines.append(
            f"{'other':<10}part that does not depend on the preload {data['without_nut_nm']:.3g} N m, "
            f"{data['without_nut_low_nm']:.3g} to {data['without_nut_high_nm']:.3g}; law times "
            f"{data['law_factor']:.3g}, {data['law_factor_low']:.3g} to {data['law_factor_high']:.3g}"
        )
    return lines


def _friction_lines(found: Identified) -> list[str]:
    """Friction over the magnitude of speed, both directions side by side."""
    units, friction = found.units, found.friction
    _, effort, speed = units.shown
    half = 0.5 * (friction.high - friction.low)
    ahead, back = np.flatnonzero(friction.speed > 0.0), np.flatnonzero(friction.speed < 0.0)[::-1]
    lines = [
        f"{speed:>12}{'friction':>12}{'+-':>10}{'samples':>10}  "
        f"|{speed:>12}{'friction':>12}{'+-':>10}{'samples':>10}",
        f"{'':>12}{effort:>12}{effort:>10}{'':>10}  |{'':>12}{effort:>12}{effort:>10}",
    ]
    for number in range(max(len(ahead), len(back))):
        cells = [
            f"{friction.speed[side[number]] / units.one:>12.5g}{friction.value[side[number]]:>12.4g}"
            f"{half[side[number]]:>10.2g}{friction.samples[side[number]]:>10}"
            if number < len(side) else " " * 44
            for side in (ahead, back)
        ]  # fmt: skip
        lines.append("  |".join(cells).rstrip())
    return lines


def measurements_text(friction: ScrewFriction, preload: float, temperature: float) -> str:
    """File of measurements for calibrate: one row for each speed, mean of both directions."""
    rows = measurement_rows(friction)
    lines = [
        "# friction torque of the nut from a log, mean of both directions; torque error: one standard error",
        HEADINGS,
    ]
    for speed, torque, error in zip(rows.speed, rows.torque, rows.error, strict=True):
        floor = max(error, 1e-6 * torque)
        assert math.isfinite(floor)
        lines.append(f"{preload:.6g},{speed / RPM:.6g},{temperature - CELSIUS:.5g},{torque:.6g},{floor:.3g}")
    return "\n".join(lines) + "\n"
