"""The command identify: inertia, offset, friction over speed and preload from a log of a drive."""

import json
import math
from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...exchange.friction_table import friction_table
from ...identification import output
from ...identification.dynamics import Identified, identify
from ...identification.log_file import read_log, stated_columns
from ...identification.motion import TRAVEL, TRAVEL_ANGLE
from ...identification.plausible import check_units
from ...identification.plot import LawCurve, identification_figure
from ...identification.preload import (
    FoundPreload,
    Law,
    ScrewFriction,
    change_of_preload,
    found_preload,
    screw_friction,
    separated_parts,
    without,
)
from ...identification.signals import Drive, signals_of
from ...nut_map.file import packaged_map_of
from ...parameters.units import CELSIUS
from ...runtime.packed import MECHANISTIC
from ...tables.csv_file import Progress
from ..shared.inputs import chosen_of
from ..shared.output import QUIET, Answer, check_output, progress_bar, say, to_builtin, write_text, written
from ..shared.quantities import IDENTIFY_OPTIONS

#: a number of the screw, and the same of a linear axis
INERTIAS, OFFSETS = ("inertia_kgm2", "mass_kg"), ("offset_nm", "offset_n")


class _Axis(NamedTuple):
    """What the options state of an axis; given: numbers of IDENTIFY_OPTIONS, None = not given, and offset_error."""

    given: dict[str, float | None]
    lead: float | None  # of the screw [m/rad]
    law: Law | None
    progress: Progress
    columns: Mapping[str, str] = {}  # headings by signal

    @property
    def known(self) -> float:
        """Torque at the screw of the known parts [N.m]."""
        guide, seal = self.given["guide_force_n"] or 0.0, self.given["seal_torque_nm"] or 0.0
        if guide and self.lead is None:
            raise ValueError("--lead-mm or --screw (missing); needed with --guide-force-n")
        return seal + guide * abs(self.lead or 0.0)

    def user_value(self, name: str, of_log: float | None) -> float | None:
        """Of an option, else of the log."""
        return of_log if self.given[name] is None else self.given[name]

    def stated(self, rotary: bool, names: tuple[str, str], power: int) -> tuple[float, float] | None:
        """A number that is given for the screw or for the linear axis, for the one of the log; factor to it.

        Parameters   names : for the screw, for the linear axis;  power : of the lead that turns the second to the first
        """
        own, other = names if rotary else names[::-1]
        direct, value = self.given[own], self.given[other]
        if direct is not None or value is None:
            return None if direct is None else (direct, 1.0)
        if self.lead is None:
            own, other = _option(own), _option(other)
            kind = "torque or current" if rotary else "force or voltage"
            raise ValueError(f"{other} with a {kind}; allowed: with --lead-mm or --screw, or {own}")
        factor = self.lead ** (power if rotary else -power)
        return value * factor, factor


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def run_identify(args: Namespace) -> Answer:
    """Fit of a log, its friction and preload, and the files that are requested."""
    columns, given = stated_columns(args.column), _given(args)
    _check(args, given)
    with progress_bar(QUIET) as progress:
        axis = _axis(args, given, progress)._replace(columns=columns)
        fit = _identified(args.log, axis)
        data = output.identified_data(fit) | {
            "log": Path(args.log).name,
            # for export
            "lead_mm": None if axis.lead is None else 2e3 * math.pi * axis.lead,
            "torque_constant_nm_a": given["torque_constant_nm_a"],
            "ratio": given["ratio"] or 1.0,
        }
        friction, curve, other = None, None, None
        if args.without_nut:
            other = screw_friction(_identified(args.without_nut, axis), axis.lead)
        if axis.law is not None or args.measurements or other or axis.known:
            friction = _nut(fit, axis, other)
        if axis.law is not None and friction is not None:
            result = _with_law(args, axis, axis.law, fit, (friction, other), data)
            curve = _curve(axis.law, axis.lead, fit, _temperature(fit, args), *result) if args.plot else None
        if not (other or axis.known or "without_nut_nm" in data):
            data["contains"] = output.CONTAINS
    if args.measurements and friction is not None:
        if (preload := axis.user_value("preload_n", fit.preload)) is None:
            raise ValueError(
                "--preload-n (missing); needed with --measurements, or a column preload [N] in the log"
            )
        text = output.measurements_text(friction, preload, _temperature(fit, args))
        write_text("--measurements", args.measurements, text)
    if args.plot:
        from ...calibration.plot import save_figure

        figure = identification_figure(fit, curve)
        with written("--plot", args.plot):
            save_figure(figure, Path(args.plot))
        say(f"written: {args.plot}")
    if args.output:
        write_text("--output", args.output, json.dumps(to_builtin(data), indent=1) + "\n")
    return Answer([data], text=output.identified_text(fit, data))


def _given(args: Namespace) -> dict[str, float | None]:
    """Numbers of IDENTIFY_OPTIONS by name, and offset_error."""
    given: dict[str, Any] = {quantity.name: getattr(args, quantity.name) for quantity in IDENTIFY_OPTIONS}
    given["offset_error"] = 0.0
    for name in OFFSETS:
        given[name], given["offset_error"] = getattr(args, name) or (None, given["offset_error"])
    return given


def _with_map(args: Namespace) -> bool:
    return args.map is not None or args.screw is not None or args.friction is not None


def _check(args: Namespace, given: dict[str, float | None]) -> None:
    """Refuse what cannot be together, before the log is read."""
    for one, other in (INERTIAS, OFFSETS):
        if given[one] is not None and given[other] is not None:
            raise ValueError(f"{_option(one)} and {_option(other)}; allowed: one of them")
    if args.before and not _with_map(args):
        raise ValueError(
            "--before without --screw and --map; allowed: with both, which turn friction into preload"
        )
    logs = [args.log, args.before, args.without_nut]
    for option, path, kind in (
        ("--plot", args.plot, "a file *.png"),
        ("--measurements", args.measurements, "a file *.csv"),
        ("--output", args.output, "a file *.json"),
    ):
        if path:
            check_output(option, path, kind, inputs=(*logs, args.screw, args.map))


def _axis(args: Namespace, given: dict[str, float | None], progress: Progress) -> _Axis:
    lead = None if given["lead_mm"] is None else given["lead_mm"] * 1e-3 / (2.0 * math.pi)
    if not _with_map(args):
        return _Axis(given, lead, None, progress)
    chosen = chosen_of(args)
    own = chosen.parameters.screw.lead / (2.0 * math.pi)
    if lead is not None and not math.isclose(abs(lead), own, rel_tol=1e-3):
        raise ValueError(
            f"--lead-mm = {given['lead_mm']:g}; allowed: that of the screw file, {2e3 * math.pi * own:.6g}"
        )
    own = math.copysign(own, lead or own)
    # the lead alone is requested, unless the packaged map is that of the screw
    lead_alone = args.map is None and args.screw is not None and args.friction is None and not args.before
    if lead_alone and packaged_map_of(chosen.parameters) is None:
        say(
            "no --map: the lead of the screw is used, no preload is computed; map build --screw "
            f"{args.screw} --output MAP.npz makes its map"
        )
        return _Axis(given, own, None, progress)
    nut_map = chosen.nut_map(args)
    return _Axis(given, own, Law(chosen.parameters, nut_map, chosen.friction_set), progress)


def _identified(path: str, axis: _Axis) -> Identified:
    """Fit of one log.

    Raises       ValueError: names the log
    """
    given = axis.given
    drive = Drive(given["torque_constant_nm_a"], given["gain_n_v"], given["ratio"] or 1.0, axis.lead)
    # a log may have both: the one whose option is given is meant
    options = {"current": drive.torque_constant, "voltage": drive.gain}
    requested = [name for name, value in options.items() if value is not None]
    log = read_log(path, axis.progress, requested, axis.columns)
    signals = signals_of(log, drive)
    check_units(log, signals, None if axis.law is None else axis.law.nut_map)
    inertia, offset = axis.stated(signals.rotary, INERTIAS, 2), axis.stated(signals.rotary, OFFSETS, 1)
    if offset is not None:
        offset = offset[0], abs(offset[1]) * (given["offset_error"] or 0.0)
    travel = TRAVEL if not signals.rotary else TRAVEL / abs(axis.lead) if axis.lead else TRAVEL_ANGLE
    delay = None if given["delay_ms"] is None else 1e-3 * given["delay_ms"]
    bins = None if given["bins"] is None else int(given["bins"])
    try:
        return identify(signals, inertia and inertia[0], travel, delay, given["cutoff_hz"], bins, offset)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _nut(fit: Identified, axis: _Axis, other: ScrewFriction | None) -> ScrewFriction:
    """Friction torque at the screw without the known parts, or without all that is in the log without the nut."""
    return without(screw_friction(fit, axis.lead), 0.0 if other is not None else axis.known, other)


def _temperature(fit: Identified, args: Namespace) -> float:
    """[K]

    Raises       ValueError: neither an option nor a column
    """
    if args.temperature_c is not None:
        return float(args.temperature_c + CELSIUS)
    if fit.temperature is None:
        raise ValueError(
            "--temperature-c (missing); needed of the oil, or a column temperature [degC] in the log"
        )
    return fit.temperature


def _with_law(
    args: Namespace, axis: _Axis, law: Law, fit: Identified, parts: tuple[ScrewFriction, ScrewFriction | None],
    data: dict[str, Any],
) -> tuple[ScrewFriction, FoundPreload]:  # fmt: skip
    """Preload, its change and what two known preloads separate, added to the answer.

    Parameters   parts : friction at the screw, and that of the log without the nut
    Returns      friction of the nut, preload behind it
    """
    temperature, (friction, other) = _temperature(fit, args), parts
    before, then = friction, temperature
    if args.before:
        earlier = _identified(args.before, axis)
        stated = axis.given["before_temperature_c"]
        then = (earlier.temperature or temperature) if stated is None else stated + CELSIUS
        before = _nut(earlier, axis, other)
        now = axis.user_value("preload_n", fit.preload)
        past = axis.user_value("before_preload_n", earlier.preload)
        if now is not None and past is not None:
            apart = separated_parts([(friction, now, temperature), (before, past, then)], law)
            data |= apart._asdict()
            friction, before = (without(part, max(apart.without_nut_nm, 0.0)) for part in (friction, before))
    result = found_preload(friction, law, temperature)
    data |= result._asdict()
    if args.before:
        past_log = before, found_preload(before, law, then), then
        data |= change_of_preload((friction, result, temperature), past_log, law)._asdict()
    data |= {"screw": law.parameters.name, "friction_set": law.friction_set.name}
    return friction, result


def _curve(
    law: Law,
    lead: float | None,
    fit: Identified,
    kelvin: float,
    friction: ScrewFriction,
    result: FoundPreload,
) -> LawCurve:
    """The law over the speeds of the log, with what was subtracted from the friction."""
    whole = screw_friction(fit, lead)
    low, high = law.nut_map.header["axes"]["speed"][:2]
    speed = np.linspace(max(float(whole.speed.min()), low), min(float(whole.speed.max()), high), 60)
    other = np.interp(speed, whole.speed, whole.torque) - np.interp(speed, friction.speed, friction.torque)
    table = friction_table(
        law.nut_map, law.parameters, law.friction_set, law.nut_map.law == MECHANISTIC, speed,
        np.array([result.preload_n]), np.array([kelvin]),
    )  # fmt: skip
    scale, unit = (1.0, "N m") if fit.rotary else (abs(lead or 1.0), "N")
    known = f" and {other.mean() / scale:.3g} {unit} of other parts" if np.any(other > 1e-9) else ""
    bounds = [table.torque if values is None else values for values in (table.low, table.high)]
    value, lower, upper = ((torque[:, 0, 0] + other) / scale for torque in (table.torque, *bounds))
    return LawCurve(
        speed * scale, value, lower, upper, f"law at a preload of {result.preload_n:.4g} N{known}"
    )
