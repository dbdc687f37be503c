"""The command identify: inertia, offset, friction over speed and preload from a log of a drive."""

import json
import math
from argparse import Namespace
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ballscrew_tehl.applications.axis.parts import weight_along_axis
from ballscrew_tehl.applications.export.friction_table import friction_table
from ballscrew_tehl.applications.identification import known_parts, output, preload
from ballscrew_tehl.applications.identification.directions import Bidirectional, option
from ballscrew_tehl.applications.identification.dynamics import Identified, identify
from ballscrew_tehl.applications.identification.known_parts import KnownParts
from ballscrew_tehl.applications.identification.log_file import read_log, stated_columns
from ballscrew_tehl.applications.identification.motion import TRAVEL, TRAVEL_ANGLE
from ballscrew_tehl.applications.identification.plausible import check_units
from ballscrew_tehl.applications.identification.preload import LawCurve
from ballscrew_tehl.applications.identification.signals import Drive, signals_of
from ballscrew_tehl.applications.tables.csv_file import naming, open_table
from ballscrew_tehl.applications.tables.headings import LOG
from ballscrew_tehl.parameters.units import CELSIUS
from ballscrew_tehl.runtime.packed import Law

from ..shared.inputs import chosen_of
from ..shared.output import Answer, check_output, say, to_builtin, write_text, written

#: options for the screw, and the same of a linear axis
INERTIAS, OFFSETS = ("inertia_kgm2", "mass_kg"), ("offset_nm", "offset_n")


class _Axis(NamedTuple):
    """What the options state of an axis; lead of the screw [m/rad]; turns of the motor for one of the screw."""

    args: Namespace
    lead: float | None
    ratio: float
    law: preload.ScrewMap | None = None

    @property
    def stated_parts(self) -> dict[str, tuple[float, float]]:
        """Torques at the screw with their standard errors [N.m] that options state, by part."""
        force, parts = self.args.guide_force_n, {}
        if force is not None:
            if any(force) and self.lead is None:
                raise ValueError("--lead-mm or --screw (missing); needed with --guide-force-n")
            parts["guide"] = force[0] * abs(self.lead or 0.0), force[1] * abs(self.lead or 0.0)
        if self.args.seal_torque_nm is not None:
            parts["bearings_and_seals"] = self.args.seal_torque_nm
        return parts

    def stated(self, rotary: bool, names: tuple[str, str], power: int) -> list[float]:
        """Numbers for the side of the log, empty: none; power: of the lead, from axis to screw."""
        own, other = (option(name) for name in names[:: 1 if rotary else -1])
        direct, value = (getattr(self.args, name) for name in names[:: 1 if rotary else -1])
        if direct is not None or value is None:
            return [] if direct is None else np.atleast_1d(direct).tolist()
        if self.lead is None:
            raise ValueError(f"{other} needs --lead-mm or --screw with this log; or give {own}")
        factor = self.lead ** (power if rotary else -power)
        return [factor * number for number in np.atleast_1d(value).tolist()]

    def fit(self, path: str) -> Identified:
        """Of a log."""
        args = self.args
        drive = Drive(args.torque_constant_nm_a, args.gain_n_v, self.ratio, self.lead)
        # a log may have both: the one whose option is given is meant
        options = {"current": drive.torque_constant, "voltage": drive.gain}
        requested = [name for name, value in options.items() if value is not None]
        travel = TRAVEL / abs(self.lead) if self.lead else TRAVEL_ANGLE
        delay = None if args.delay_ms is None else 1e-3 * args.delay_ms
        bins = None if args.bins is None else int(args.bins)
        with naming(path):
            log = read_log(path, requested, stated_columns(args.column))
            signals = signals_of(log, drive)
            check_units(log, signals, self.law and self.law.nut_map)
            inertia = next(iter(self.stated(signals.rotary, INERTIAS, 2)), None)
            offset = self.stated(signals.rotary, OFFSETS, 1)
            travel = travel if signals.rotary else TRAVEL
            known = (offset[0], abs(offset[1])) if offset else None
            return identify(signals, inertia, travel, delay, args.cutoff_hz, bins, known)

    def nut(
        self, fit: Identified, other: Bidirectional | None, temperature: float
    ) -> tuple[Bidirectional, KnownParts]:
        """Friction at the screw without the known parts, or without that of a log without the nut; these parts."""
        whole = preload.screw_friction(fit, self.lead)
        parameters = self.law and self.law.parameters
        if other is not None:
            options = sum(torque for torque, _ in self.stated_parts.values())
            known = known_parts.of_log(other, parameters, self.stated_parts)
            return preload.without(whole, options, other), known
        known = known_parts.known_parts(parameters, self.stated_parts, whole.speed, temperature)
        return preload.without(whole, known.at(whole.speed).torque), known

    def temperature(self, fit: Identified) -> float:
        """Of the oil [K], by the option, else of the log."""
        if self.args.temperature_c is not None:
            return float(self.args.temperature_c + CELSIUS)
        if fit.temperature is None:
            raise ValueError("--temperature-c (missing); needed of the oil, or a column temperature [degC]")
        return fit.temperature


def run_identify(args: Namespace) -> Answer:
    """Fit of a log, its friction and preload, and the files that are requested."""
    axis = _axis(args)
    fit = axis.fit(args.log)
    data = output.identified_data(fit) | {
        "log": Path(args.log).name,
        # for export
        "lead_mm": None if axis.lead is None else 2e3 * math.pi * axis.lead,
        "torque_constant_nm_a": args.torque_constant_nm_a,
        "ratio": axis.ratio,
    }
    friction, known, curve, other = None, None, None, None
    if args.without_nut:
        other = preload.screw_friction(axis.fit(args.without_nut), axis.lead)
    if axis.law is not None or args.measurements or other or axis.stated_parts:
        friction, known = axis.nut(fit, other, math.nan if axis.law is None else axis.temperature(fit))
        data["notes"] += known.notes
        if axis.law is not None and fit.offset_limits is not None:
            scale = 1.0 if fit.rotary else abs(axis.lead or 1.0)
            low, high = (scale * end for end in fit.offset_limits)
            weight = known_parts.other_weight(axis.law.parameters, scale * fit.offset, 0.25 * (high - low))
            data["notes"] += filter(None, [weight])
    if axis.law is not None and friction is not None and known is not None:
        friction = _with_law(axis, axis.law, fit, friction, known, other, data)
        speed = preload.typical_speed(friction, axis.law)
        data |= known_parts.subtracted_data(known, preload.screw_friction(fit, axis.lead), friction, speed)
        curve = _curve(axis, axis.law, fit, friction, data["preload_n"]) if args.plot else None
    if "without_nut_nm" not in data:
        if not (known and known.parts):
            data["contains"] = output.CONTAINS
        if data.get("not_stated"):
            # these parts count as the nut's, and then no shape over speed tests the law
            data |= {"preload_is_upper_bound": True, "shape_fits": None}
            data |= {"preload_low_n": 0.0, "preload_log_low_n": 0.0}
            if "preload_ratio" in data:
                # what is common to both logs hides a part of the change
                falls = data["preload_ratio"] < 1.0
                data |= {"preload_ratio_low": 0.0} if falls else {"preload_ratio_high": math.inf}
    if args.measurements and friction is not None:
        force = fit.preload if args.preload_n is None else args.preload_n
        if force is None:
            raise ValueError("--preload-n (missing); needed with --measurements, or a column preload [N]")
        if known and known.parts:
            data["notes"].append(
                f"{args.measurements}: its errors are those of the log, without the subtracted parts'"
            )
        text = output.measurements_text(friction, force, axis.temperature(fit))
        write_text("--measurements", args.measurements, text)
    if args.plot:
        from ballscrew_tehl.applications.calibration.plot import save_figure
        from ballscrew_tehl.applications.identification.plot import identification_figure

        with written("--plot", args.plot):
            save_figure(identification_figure(fit, curve), Path(args.plot))
        say(f"written: {args.plot}")
    if args.output:
        write_text("--output", args.output, json.dumps(to_builtin(data), indent=1) + "\n")
    return Answer([data], text=output.identified_text(fit, data))


def _axis(args: Namespace) -> _Axis:
    """With the law where a screw or map is given, and the lead of that; what cannot be together is refused."""
    stated_columns(args.column)
    for one, other in (INERTIAS, OFFSETS):
        if getattr(args, one) is not None and getattr(args, other) is not None:
            raise ValueError(f"{option(one)} and {option(other)}; allowed: one of them")
    for name in ("before_preload_n", "before_temperature_c"):
        if getattr(args, name) is not None and not args.before:
            raise ValueError(f"{option(name)}, no --before; allowed: with the log that it is of")
    with_map = any(value is not None for value in (args.map, args.screw, args.friction))
    if args.before and not with_map:
        raise ValueError("--before, no --screw, --map; allowed: with both, which turn friction into preload")
    inputs = args.log, args.before, args.without_nut, args.screw, args.map
    for name, suffix in (("plot", "png"), ("measurements", "csv"), ("output", "json")):
        if path := getattr(args, name):
            check_output(option(name), path, f"a file *.{suffix}", inputs=inputs)
    lead = None if args.lead_mm is None else args.lead_mm * 1e-3 / (2.0 * math.pi)
    if not with_map:
        return _Axis(args, lead, args.ratio or 1.0)
    selection = chosen_of(args)
    own = selection.parameters.screw.signed_lead / (2.0 * math.pi)
    if lead is not None and not math.isclose(abs(lead), abs(own), rel_tol=1e-3):
        allowed = f"that of the screw file, {2e3 * math.pi * own:.6g} (with either sign)"
        raise ValueError(f"--lead-mm = {args.lead_mm:g}; allowed: {allowed}")
    own = math.copysign(own, lead or own)
    parameters, ratio = known_parts.with_ratio(selection.parameters, args.ratio)
    with_law = any(value is not None for value in (args.map, args.friction, args.before, args.temperature_c))
    if not with_law and "temperature" not in open_table(args.log, LOG, stated_columns(args.column)).columns:
        say("no --temperature-c: the lead of the screw is used, no preload is computed")
        return _Axis(args, own, ratio)
    law = preload.ScrewMap(
        parameters, selection.nut_map(args), selection.friction_set, args.temperature_difference_k or 0.0,
        weight_along_axis(parameters),
    )  # fmt: skip
    return _Axis(args, own, ratio, law)


def _with_law(
    axis: _Axis, law: preload.ScrewMap, fit: Identified, friction: Bidirectional, known: KnownParts,
    other: Bidirectional | None, data: dict[str, Any],
) -> Bidirectional:  # fmt: skip
    """Friction of the nut, without that of the log without it; preload, change and parts are added to the answer."""
    args, temperature = axis.args, axis.temperature(fit)
    before, then, known_before = friction, temperature, known
    if args.before:
        earlier = axis.fit(args.before)
        stated = args.before_temperature_c
        then = (earlier.temperature or temperature) if stated is None else stated + CELSIUS
        before, known_before = axis.nut(earlier, other, then)
        now = fit.preload if args.preload_n is None else args.preload_n
        past = earlier.preload if args.before_preload_n is None else args.before_preload_n
        if args.before_preload_n is not None and now is None:
            raise ValueError("--preload-n (missing); needed with --before-preload-n, or a column preload [N]")
        if now is not None and past is not None:
            apart = preload.separated_parts([(friction, now, temperature), (before, past, then)], law)
            data |= apart._asdict()
            if apart.without_nut_nm < 0.0:
                data["notes"].append(
                    "the part that does not depend on the preload is negative and counts as 0: the torque rises more "
                    "with the preload than the law: check both preloads and temperatures"
                )
            remainder = max(apart.without_nut_nm, 0.0)
            friction, before = (preload.without(part, remainder) for part in (friction, before))
    # the errors of a log without the nut are in those of the friction
    parts = (None, None) if other is not None else (known, known_before)
    nuts = zip((friction, before), (temperature, then), parts, strict=True)
    logs = [
        preload.PreloadedLog(nut, preload.found_preload(nut, law, kelvin, of), kelvin, of)
        for nut, kelvin, of in islice(nuts, 2 if args.before else 1)
    ]
    data |= logs[0].result._asdict()
    if args.before:
        data |= preload.change_of_preload(logs[0], logs[1], law)._asdict()
    used = {"oil_temperature_c": temperature - CELSIUS}
    data |= used | {"screw": law.parameters.name, "friction_set": law.friction_set.name}
    return friction


def _curve(
    axis: _Axis, law: preload.ScrewMap, fit: Identified, friction: Bidirectional, force: float
) -> LawCurve:
    """The law at a preload over the speeds of the log, with what was subtracted from the friction."""
    whole = preload.screw_friction(fit, axis.lead)
    low, high = law.nut_map.header["axes"]["speed"][:2]
    speed = np.linspace(max(float(whole.speed.min()), low), min(float(whole.speed.max()), high), 60)
    other = np.interp(speed, whole.speed, whole.mean) - np.interp(speed, friction.speed, friction.mean)
    table = friction_table(
        law.nut_map, law.parameters, law.friction_set, law.nut_map.law == Law.MECHANISTIC, speed,
        np.array([force]), np.array([axis.temperature(fit)]),
    )  # fmt: skip
    scale, unit = (1.0, "N m") if fit.rotary else (abs(axis.lead or 1.0), "N")
    known = f" and {other.mean() / scale:.3g} {unit} of other parts" if np.any(other > 1e-9) else ""
    torque = law.torque(force, speed, axis.temperature(fit))
    curves = (table.torque if values is None else values for values in (table.torque, table.low, table.high))
    value, lower, upper = ((torque * (end / table.torque)[:, 0, 0] + other) / scale for end in curves)
    return speed * scale, value, lower, upper, f"law at a preload of {force:.4g} N{known}"
