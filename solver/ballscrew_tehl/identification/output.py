"""Results of an identification: keys of JSON, text, the file of measurements."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .._version import __version__
from ..parameters.units import CELSIUS, RPM
from ..physics.ball_law import Array
from .directions import LIMIT, varies
from .dynamics import Identified
from .preload import ScrewFriction, measurement_rows

#: what friction from one log is of
CONTAINS = (
    "the friction is that of the whole axis: screw, guides, seals and bearings of screw and motor together; one log "
    "does not tell them apart: give --guide-force-n, --seal-torque-nm or --without-nut LOG.csv"
)
HEADINGS = "preload [N],speed [r/min],temperature [degC],torque [N.m],torque error [N.m]"


def identified_data(found: Identified) -> dict[str, Any]:
    """Keys of --json."""
    units, friction, both = found.units, found.friction, found.both

    def limits(key: str, value: float, ends: tuple[float, float] | None) -> dict[str, float | None]:
        low, high = ends or (None, None)
        return {key.format(""): value, key.format("low_"): low, key.format("high_"): high}

    def rows(first: str, *columns: Array, keys: Sequence[str] = ("", "error")) -> list[dict[str, float]]:
        names = first, *map(units.effort_key, keys)
        return [dict(zip(names, map(float, row), strict=True)) for row in zip(*columns, strict=True)]

    bins = rows(
        units.speed, friction.speed / units.one, friction.value, friction.low, friction.high, friction.error,
        keys=("", "low", "high", "error"),
    )  # fmt: skip
    return {
        "kind": "rotary" if found.rotary else "linear",
        "model": (
            f"{units.names[2]} = {units.inertia.format('')} * {'angular ' * found.rotary}acceleration + "
            f"{units.offset.format('')} + friction(speed); friction is without the offset and has the sign of the speed"
        ),
        **limits(units.inertia, found.inertia, found.inertia_limits),
        **limits(units.offset, found.offset, found.offset_limits),
        "offset_given": found.offset_error is not None,
        "friction": [row | {"samples": int(n)} for row, n in zip(bins, friction.samples, strict=True)],
        "direction_difference": rows(
            units.speed, both.speed / units.one, both.difference, np.hypot(both.error, found.offset_error or 0.0)
        ),
        "direction_difference_varies": varies(both),
        **limits("delay_{}s", found.delay, found.delay_limits),
        "cutoff_hz": found.cutoff,
        units.effort_key("residual"): found.residual,
        "explained": found.explained,
        "residual_over_position": rows(units.place, *found.places),
        "samples": found.samples,
        "left_out": {reason: count for reason, count in found.left_out.items() if count},
        "temperature_c": None if found.temperature is None else found.temperature - CELSIUS,
        "notes": found.notes,
        "version": __version__,
    }  # fmt: skip


def identified_text(found: Identified, data: dict[str, Any]) -> str:
    """The result as text: the answer, friction over speed, what was left out, notes."""
    units = found.units
    inertia, effort, _ = units.shown
    if found.offset_error is None:
        of_offset = (
            "; by convention what friction alike in both directions leaves: one log cannot tell it from a difference "
            f"of friction between them; if it is known: --{units.offset.format('').replace('_', '-')}"
        )
    else:
        of_offset = f" (given); {_difference(found)}"
    delay_limits = found.delay_limits and [1e3 * end for end in found.delay_limits]
    mean, error = found.places[1:]
    left_out = ", ".join(f"{count} {reason}" for reason, count in data["left_out"].items()) or "none"
    return "\n".join([
        *_preload_lines(data),
        _line(units.names[0], found.inertia, inertia, found.inertia_limits),
        _line("offset", found.offset, effort, found.offset_limits if found.offset_error != 0.0 else ()) + of_offset,
        _line("delay", 1e3 * found.delay, "ms", delay_limits)
        + f" of the {units.names[2]} behind the motion: sampling, filters and hold of the drive; friction that still "
        "rises behind reversals adds to it",
        f"{'filter':<10}{found.cutoff:.4g} Hz; {100.0 * found.explained:.2f} % of the variance explained, residual "
        f"{found.residual:.3g} {effort}",
        "",
        *_friction_lines(found),
        "",
        f"residual over position: {mean.min():.2g} to {mean.max():.2g} {effort} (error {max(error, default=0.0):.1g})",
        f"samples used: {found.samples}; left out: {left_out}",
        *(f"note: {note}" for note in [*found.notes, *filter(None, [data.get("contains")])]),
    ])  # fmt: skip


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
    half = LIMIT * float(np.hypot(np.sum(weight) ** -0.5, found.offset_error or 0.0))
    return f"friction's own (f+ - f-)/2 {mean:+.3g} +- {half:.2g} {found.units.shown[1]} in the mean"


def _preload_lines(data: dict[str, Any]) -> list[str]:
    """Preload, its change, the part without the nut."""
    lines = []
    if "preload_n" in data:
        fits = "fits" if data["shape_fits"] else "does not fit"
        lines += [
            "preload   {preload_n:.5g} N, {preload_low_n:.5g} to {preload_high_n:.5g} N ({preload_interval})",
            f"shape     over speed: law {fits} within the errors, deviation "
            "{shape_deviation:.2%}, exponent of speed {shape_exponent_difference:+.2g}",
        ]
    if "preload_ratio" in data:
        lines.append(
            "change    preload over that of the log before {preload_ratio:.4f}, {preload_ratio_low:.4f} to "
            "{preload_ratio_high:.4f} (from {preload_before_n:.5g} N)"
        )
    if "without_nut_nm" in data:
        lines.append(
            "other     part that does not depend on the preload {without_nut_nm:.3g} N m, {without_nut_low_nm:.3g} to "
            "{without_nut_high_nm:.3g}; law times {law_factor:.3g}, {law_factor_low:.3g} to {law_factor_high:.3g}"
        )
    return [line.format(**data) for line in lines]


def _friction_lines(found: Identified) -> list[str]:
    """Friction over the magnitude of speed, both directions side by side."""
    units, friction = found.units, found.friction
    _, effort, speed = units.shown
    head = f"{speed:>12}{'friction':>12}{'+-':>10}{'samples':>10}"
    below = f"{'':>12}{effort:>12}{effort:>10}{'':>10}"
    columns = (
        friction.speed / units.one,
        friction.value,
        0.5 * (friction.high - friction.low),
        friction.samples,
    )
    cells = ["{:>12.5g}{:>12.4g}{:>10.2g}{:>10}".format(*row) for row in zip(*columns, strict=True)]
    back, ahead = (int(np.sum(sign * friction.speed > 0.0)) for sign in (-1.0, 1.0))
    rows = max(back, ahead)
    left, right = cells[back:] + [" " * 44] * (rows - ahead), cells[:back][::-1] + [""] * (rows - back)
    return [f"{a}  |{b}".rstrip() for a, b in zip([head, below, *left], [head, below, *right], strict=True)]


def measurements_text(friction: ScrewFriction, preload: float, temperature: float) -> str:
    """File of measurements for calibrate: one row for each speed, mean of both directions."""
    rows = measurement_rows(friction)
    lines = [
        f"{preload:.6g},{speed / RPM:.6g},{temperature - CELSIUS:.5g},{torque:.6g},{max(error, 1e-6 * torque):.3g}"
        for speed, torque, error in zip(rows.speed, rows.torque, rows.error, strict=True)
    ]
    title = (
        "# friction torque of the nut from a log, mean of both directions; torque error: one standard error"
    )
    return "\n".join([title, HEADINGS, *lines]) + "\n"
