"""From the log of a drive to inertia, offset, friction and preload of its axis, with what is stated of them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ballscrew_tehl.nut_map.grid import Progress
from ballscrew_tehl.parameters.units import CELSIUS
from ballscrew_tehl.runtime.packed import Law

from ..axis.parts import weight_along_axis
from ..quantities import DIFFERENCE, FRICTIONS, IDENTIFY_OPTIONS, TEMPERATURE
from ..quantities import OFFSETS as OFFSETS_OF
from ..screw_model import ScrewModel
from ..tables.csv_file import naming, open_table
from ..tables.headings import LOG
from ..torque_curve import interval_ratios
from . import known_parts, output, preload
from .directions import Bidirectional, option
from .dynamics import Identified, identify
from .known_parts import KnownParts
from .log.log_file import read_log, stated_columns
from .log.plausible import check_units
from .log.signals import Drive, signals_of
from .motion import TRAVEL, TRAVEL_ANGLE
from .preload import LawCurve

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: of the screw, and the same of a linear axis
INERTIAS, OFFSETS = ("inertia_kgm2", "mass_kg"), ("offset_nm", "offset_n")
LEAD_ALONE = "no --temperature-c: the lead of the screw is used, no preload is computed"
#: speeds of the curve of the law
CURVE = 60


#: numbers with the ranges of their options; those with a standard error
NUMBERS, PAIRS = (*IDENTIFY_OPTIONS, TEMPERATURE, DIFFERENCE), (*OFFSETS_OF, *FRICTIONS)


class StatedAxis(NamedTuple):
    """What is stated of an axis and its logs, under names and units of the options of `identify`; None: not stated.

    Attributes
    ----------
    torque_constant_nm_a, gain_n_v : float or None
        Torque of the motor over its current; force of the drive over its voltage.
    ratio : float or None
        Turns of the motor for one of the screw.
    lead_mm : float or None
        Negative: left-hand.
    inertia_kgm2, mass_kg : float or None
        At the screw, axis included; of a linear axis, screw and motor included.
    offset_nm, offset_n : tuple of float or None
        Of gravity or tilt, with its standard error.
    guide_force_n, seal_torque_nm : tuple of float or None
        Friction that is subtracted, with its standard error.
    temperature_c, temperature_difference_k : float or None
        Of the oil; of the screw over the nut.
    preload_n : float or None
        For measurements, or with that of the log before.
    before : path or str or None
        Earlier log of the axis.
    before_preload_n, before_temperature_c : float or None
        Of it.
    without_nut : path or str or None
        Log of the axis without the nut.
    column : sequence of str
        Columns by heading, as "current=Iq_act [A]".
    delay_ms : float or None
        Of the drive's signal.
    cutoff_hz : float or None
        Of the filter.
    bins : int or None
        Of speed in each direction.
    """

    torque_constant_nm_a: float | None = None
    gain_n_v: float | None = None
    ratio: float | None = None
    lead_mm: float | None = None
    inertia_kgm2: float | None = None
    mass_kg: float | None = None
    offset_nm: tuple[float, float] | None = None
    offset_n: tuple[float, float] | None = None
    guide_force_n: tuple[float, float] | None = None
    seal_torque_nm: tuple[float, float] | None = None
    temperature_c: float | None = None
    temperature_difference_k: float | None = None
    preload_n: float | None = None
    before: Path | str | None = None
    before_preload_n: float | None = None
    before_temperature_c: float | None = None
    without_nut: Path | str | None = None
    column: Sequence[str] = ()
    delay_ms: float | None = None
    cutoff_hz: float | None = None
    bins: int | None = None

    def checked(self) -> "StatedAxis":
        """With pairs for all that have a standard error, 0 where none is stated.

        ValueError: what cannot be stated together, a value out of the range of its option
        """
        values: dict[str, Any] = {}
        for number in NUMBERS:
            if (value := getattr(self, number.name)) is not None:
                values[number.name] = number.checked(value)
        for number in PAIRS:
            if (value := getattr(self, number.name)) is not None:
                value, error = value if isinstance(value, Sequence) and len(value) == 2 else (value, 0.0)
                values[number.name] = number.checked(value), number._replace(min_=0.0).checked(error)
        stated_columns(self.column)
        for one, other in (INERTIAS, OFFSETS):
            if getattr(self, one) is not None and getattr(self, other) is not None:
                raise ValueError(f"{option(one)} and {option(other)}; allowed: one of them")
        for name in ("before_preload_n", "before_temperature_c"):
            if getattr(self, name) is not None and not self.before:
                raise ValueError(f"{option(name)}, no --before; allowed: with the log that it is of")
        return self._replace(**values)


class _Axis(NamedTuple):
    """An axis by what is stated; lead of the screw [m/rad]; turns of the motor for one of the screw."""

    stated: StatedAxis
    lead: float | None
    ratio: float
    law: preload.ScrewMap | None = None

    @property
    def stated_parts(self) -> dict[str, tuple[float, float]]:
        """Torques at the screw with their standard errors [N.m] that are stated, by part."""
        force, parts = self.stated.guide_force_n, {}
        if force is not None:
            if any(force) and self.lead is None:
                raise ValueError("--lead-mm or --screw (missing); needed with --guide-force-n")
            parts["guide"] = force[0] * abs(self.lead or 0.0), force[1] * abs(self.lead or 0.0)
        if self.stated.seal_torque_nm is not None:
            parts["bearings_and_seals"] = self.stated.seal_torque_nm
        return parts

    def numbers(self, rotary: bool, names: tuple[str, str], power: int) -> list[float]:
        """Numbers for the side of the log, empty: none; power: of the lead, from axis to screw."""
        own, other = names if rotary else names[::-1]
        direct, value = getattr(self.stated, own), getattr(self.stated, other)
        if direct is not None or value is None:
            return [] if direct is None else np.atleast_1d(direct).tolist()
        if self.lead is None:
            needed = f"needs --lead-mm or --screw with this log; or give {option(own)}"
            raise ValueError(f"{option(other)} {needed}")
        factor = self.lead ** (power if rotary else -power)
        return [factor * number for number in np.atleast_1d(value).tolist()]

    def fit(self, path: Path | str) -> Identified:
        """Of a log."""
        stated = self.stated
        drive = Drive(stated.torque_constant_nm_a, stated.gain_n_v, self.ratio, self.lead)
        # a log may have both: the one whose number is stated is meant
        drives = {"current": drive.torque_constant, "voltage": drive.gain}
        requested = [name for name, value in drives.items() if value is not None]
        travel = TRAVEL / abs(self.lead) if self.lead else TRAVEL_ANGLE
        delay = None if stated.delay_ms is None else 1e-3 * stated.delay_ms
        with naming(path):
            log = read_log(path, requested, stated_columns(stated.column))
            signals = signals_of(log, drive)
            check_units(log, signals, self.law and self.law.nut_map)
            inertia = next(iter(self.numbers(signals.rotary, INERTIAS, 2)), None)
            offset = self.numbers(signals.rotary, OFFSETS, 1)
            travel = travel if signals.rotary else TRAVEL
            known = (offset[0], abs(offset[1])) if offset else None
            return identify(signals, inertia, travel, delay, stated.cutoff_hz, stated.bins, known)

    def nut(
        self, fit: Identified, other: Bidirectional | None, temperature: float
    ) -> tuple[Bidirectional, KnownParts]:
        """Friction at the screw without the known parts, or without that of a log without the nut; these parts."""
        whole = preload.screw_friction(fit, self.lead)
        parameters = self.law and self.law.parameters
        if other is not None:
            stated = sum(torque for torque, _ in self.stated_parts.values())
            known = known_parts.of_log(other, parameters, self.stated_parts)
            return preload.without(whole, stated, other), known
        known = known_parts.known_parts(parameters, self.stated_parts, whole.speed, temperature)
        return preload.without(whole, known.at(whole.speed).torque), known

    def temperature(self, fit: Identified) -> float:
        """Of the oil [K], as stated, else of the log."""
        if self.stated.temperature_c is not None:
            return float(self.stated.temperature_c + CELSIUS)
        if fit.temperature is None:
            raise ValueError("--temperature-c (missing); needed of the oil, or a column temperature [degC]")
        return fit.temperature


@dataclass(frozen=True)
class IdentifiedLog:
    """Result of a log, with its text, figure, and points for a calibration."""

    fit: Identified
    data: dict[str, Any]  # what `identify --json` prints
    axis: _Axis
    nut: Bidirectional | None  # friction at the screw without the known parts; None: nothing is subtracted
    known: KnownParts | None  # what was subtracted
    remark: str  # why no preload is computed although a screw is given; "": it is

    @property
    def text(self) -> str:
        """The result for readers."""
        return output.identified_text(self.fit, self.data)

    @cached_property
    def curve(self) -> LawCurve | None:
        """The law at the preload over the speeds of the log, with what was subtracted from the friction."""
        axis, fit, friction, law = self.axis, self.fit, self.nut, self.axis.law
        if law is None or friction is None:
            return None
        force, kelvin = self.data["preload_n"], axis.temperature(fit)
        whole, axes = preload.screw_friction(fit, axis.lead), law.nut_map.header["axes"]
        low, high = axes["speed"][:2]
        speed = np.linspace(max(float(whole.speed.min()), low), min(float(whole.speed.max()), high), CURVE)
        other = np.interp(speed, whole.speed, whole.mean) - np.interp(speed, friction.speed, friction.mean)
        ends = np.ones((2, CURVE))
        if law.nut_map.law == Law.MECHANISTIC:
            point = np.array([force]), speed, np.array([kelvin])
            ends = interval_ratios(law.parameters, axes, law.friction_set, *point)[:, :, 0, 0]
        scale, unit = (1.0, "N m") if fit.rotary else (abs(axis.lead or 1.0), "N")
        known = f" and {other.mean() / scale:.3g} {unit} of other parts" if np.any(other > 1e-9) else ""
        torque = law.torque(force, speed, kelvin)
        value, lower, upper = ((torque * end + other) / scale for end in (1.0, *ends))
        return speed * scale, value, lower, upper, f"law at a preload of {force:.4g} N{known}"

    def figure(self) -> "Figure":
        """Friction over speed with the law, residual over position."""
        from .plot import identification_figure

        return identification_figure(self.fit, self.curve)

    def measurements(self) -> tuple[str, str]:
        """Text of a file for `calibrate`; what its errors are without, "": nothing."""
        axis, fit, nut = self.axis, self.fit, self.nut
        nut = axis.nut(fit, None, math.nan)[0] if nut is None else nut
        force = fit.preload if axis.stated.preload_n is None else axis.stated.preload_n
        if force is None:
            raise ValueError("--preload-n (missing); needed with --measurements, or a column preload [N]")
        parts = bool(self.known and self.known.parts)
        note = "its errors are those of the log, without the subtracted parts'" * parts
        return output.measurements_text(nut, force, axis.temperature(fit)), note


def identify_log(
    log: Path | str, stated: StatedAxis | None = None, screw: ScrewModel | None = None, *,
    lead_alone: bool = True, progress: Progress | None = None,
) -> IdentifiedLog:  # fmt: skip
    """Inertia, offset and friction of an axis from the log of its drive; with a screw the preload of its nut.

    Parameters
    ----------
    log : path or str
        CSV file of an axis that moves both ways, headings with units: time [s], position [mm], current [A], ...
    stated : StatedAxis, optional
        What the log does not say.
    screw : ScrewModel, optional
        Screw whose law turns friction into preload.
    lead_alone : bool, optional
        Without a temperature of the oil the lead of the screw is used alone; else this is refused.
    progress : callable, optional
        Called while the map of the screw is made.

    Returns
    -------
    IdentifiedLog
        Result with its text, figure and points for a calibration.

    Raises
    ------
    ValueError
        A log that is damaged or does not determine the values; what is missing or cannot be stated together.

    Examples
    --------
    A rigid axis of 3 g m2 with a friction of 0.5 N.m:

    >>> import tempfile
    >>> time = np.arange(0.0, 10.0, 4e-3)
    >>> angle, speed = 60.0 * np.sin(np.pi * time), 60.0 * np.pi * np.cos(np.pi * time)
    >>> rows = np.column_stack([time, angle, 3e-3 * -(np.pi**2) * angle + 0.5 * np.tanh(speed)])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     np.savetxt(f"{folder}/log.csv", rows, "%.9g", ",", header="time [s],position [rad],torque [N.m]")
    ...     found = identify_log(f"{folder}/log.csv")
    >>> f"{found.data['inertia_kgm2']:.4f} kg m2"
    '0.0030 kg m2'
    """
    stated = (stated or StatedAxis()).checked()
    if stated.before and screw is None:
        raise ValueError("--before, no --screw, --map; allowed: with both, which turn friction into preload")
    axis = _axis(log, stated, screw, lead_alone, progress)
    fit = axis.fit(log)
    data = output.identified_data(fit) | {
        "log": Path(log).name,
        # for export
        "lead_mm": None if axis.lead is None else 2e3 * math.pi * axis.lead,
        "torque_constant_nm_a": stated.torque_constant_nm_a,
        "ratio": axis.ratio,
    }
    nut, known, other, law = None, None, None, axis.law
    if stated.without_nut:
        other = preload.screw_friction(axis.fit(stated.without_nut), axis.lead)
    if law is not None or other or axis.stated_parts:
        nut, known = axis.nut(fit, other, math.nan if law is None else axis.temperature(fit))
        data["notes"] += known.notes
        if law is not None:
            if fit.offset_limits is not None:
                scale = 1.0 if fit.rotary else abs(axis.lead or 1.0)
                low, high = (scale * end for end in fit.offset_limits)
                weight = known_parts.other_weight(law.parameters, scale * fit.offset, 0.25 * (high - low))
                data["notes"] += filter(None, [weight])
            nut = _with_law(axis, law, fit, nut, known, other, data)
            speed = preload.typical_speed(nut, law)
            data |= known_parts.subtracted_data(known, preload.screw_friction(fit, axis.lead), nut, speed)
    if "without_nut_nm" not in data:
        data |= _unseparated(data, bool(known and known.parts))
    remark = LEAD_ALONE if screw is not None and law is None else ""
    return IdentifiedLog(fit, data, axis, nut, known, remark)


def _unseparated(data: Mapping[str, Any], subtracted: bool) -> dict[str, Any]:
    """Keys of a log whose nut was not told from other parts by a second one."""
    keys: dict[str, Any] = {} if subtracted else {"contains": output.CONTAINS}
    if data.get("not_stated"):
        # these parts count as the nut's, and then no shape over speed tests the law
        keys |= {"preload_is_upper_bound": True, "shape_fits": None}
        keys |= {"preload_low_n": 0.0, "preload_log_low_n": 0.0}
        if "preload_ratio" in data:
            # what is common to both logs hides a part of the change
            end, value = ("low", 0.0) if data["preload_ratio"] < 1.0 else ("high", math.inf)
            keys[f"preload_ratio_{end}"] = value
    return keys


def _axis(
    log: Path | str, stated: StatedAxis, screw: ScrewModel | None, lead_alone: bool, progress: Progress | None
) -> _Axis:
    """With the law where a screw and the temperature of its oil are given, and the lead of the screw."""
    lead = None if stated.lead_mm is None else stated.lead_mm * 1e-3 / (2.0 * math.pi)
    if screw is None:
        return _Axis(stated, lead, stated.ratio or 1.0)
    own = screw.parameters.screw.signed_lead / (2.0 * math.pi)
    if lead is not None and not math.isclose(abs(lead), abs(own), rel_tol=1e-3):
        allowed = f"that of the screw file, {2e3 * math.pi * own:.6g} (with either sign)"
        raise ValueError(f"--lead-mm = {stated.lead_mm:g}; allowed: {allowed}")
    own = math.copysign(own, lead or own)
    parameters, ratio = known_parts.with_ratio(screw.parameters, stated.ratio)
    optional = lead_alone and stated.temperature_c is None and not stated.before
    if optional and "temperature" not in open_table(log, LOG, stated_columns(stated.column)).columns:
        return _Axis(stated, own, ratio)
    law = preload.ScrewMap(
        parameters, screw.nut_map(progress), screw.friction_set, stated.temperature_difference_k or 0.0,
        weight_along_axis(parameters),
    )  # fmt: skip
    return _Axis(stated, own, ratio, law)


def _with_law(
    axis: _Axis, law: preload.ScrewMap, fit: Identified, friction: Bidirectional, known: KnownParts,
    other: Bidirectional | None, data: dict[str, Any],
) -> Bidirectional:  # fmt: skip
    """Friction of the nut, without that of the log without it; preload, change and parts are added to the answer."""
    stated, temperature = axis.stated, axis.temperature(fit)
    before, then, known_before = friction, temperature, known
    if stated.before:
        earlier = axis.fit(stated.before)
        celsius, force = stated.before_temperature_c, stated.before_preload_n
        then = (earlier.temperature or temperature) if celsius is None else celsius + CELSIUS
        before, known_before = axis.nut(earlier, other, then)
        now = fit.preload if stated.preload_n is None else stated.preload_n
        past = earlier.preload if force is None else force
        if force is not None and now is None:
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
        for nut, kelvin, of in islice(nuts, 2 if stated.before else 1)
    ]
    data |= logs[0].result._asdict()
    if stated.before:
        data |= preload.change_of_preload(logs[0], logs[1], law)._asdict()
    used = {"oil_temperature_c": temperature - CELSIUS}
    data |= used | {"screw": law.parameters.name, "friction_set": law.friction_set.name}
    return friction
