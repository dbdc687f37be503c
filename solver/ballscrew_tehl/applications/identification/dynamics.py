"""Inertia, offset and friction over speed by least squares on the inverse dynamics of an axis.

    effort = inertia * acceleration + offset + friction(speed)

Friction has a value in each bin of speed, each direction by itself: no shape is assumed. For the inertia it is a
straight line in each, and what an error of the delay would add, the jerk, is taken out; the power of the acceleration
is that without its noise. The offset is the constant of a fit of Coulomb and viscous friction and a constant to the
bins, weighted by their samples, as published identifications have it. Friction is without it.

Standard errors: the sandwich with clusters of time (pieces of a run between reversals), so that the correlation by the
filter and by the position counts; for a bin, shrunk towards what the independent samples of the filtered residual give,
times the mean ratio of both. Intervals: 95 %, Student's t, and in quadrature what follows from the width of a bin and
from half the cutoff: SMEAR times the change of a bin, COARSER times that of the inertia beyond chance, LATER times that
of the delay (added, as a bias), as much by FARTHER times the travel behind reversals, and the delays that the data do
not tell apart. Steps of the effort are added. On plain simulated logs 93 to 98 % of the intervals hold the truth.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from ballscrew_tehl.numerics import Array

from . import directions
from .directions import LIMIT, UNITS, Bidirectional, Friction, option
from .fit import (
    MIN_BINS,
    MIN_INDEPENDENT,
    SIDES,
    Fit,
    Timing,
    bins_of,
    errors_of,
    fit_of,
    offset_weights,
    without_friction,
)
from .log.findings import Finding, of_refusal
from .log.signals import Signals
from .motion import MAX_NOISE, chosen_cutoff, filtered
from .patterns import of_steps, patterns_of
from .timing import timing

#: fewest samples of the log in a bin
MIN_SAMPLES = 10
#: delay [s] that a filter may have made
LATE = 4e-3
#: highest cutoff at which a lag is looked for [Hz], share of the samples that has to be
#: left;  most that taking it out may amplify noise
LAG_CUTOFF, ROUGH_LEFT, LAG_GAIN = 20.0, 0.4, 8.0
#: share by which the noise of the acceleration is unsure
NOISE_UNSURE = 0.2
#: square of a second difference over its variance that is by chance
BY_CHANCE = 4.0
#: change of a bin, of the inertia and of the delay by half the cutoff, as it counts in their intervals; the noise of an
#: encoder that comes back through the controller moves the delay as the cutoff or more, all of it at most twice that,
#: a bias, which adds to the random half
SMEAR, COARSER, LATER = 0.75, 1.5, 2.0
#: travel left out behind a reversal over the usual one, whose effect on inertia and delay counts the same, for friction
#: may still rise; share of the samples that has to be left
FARTHER, FARTHER_LEFT = 4.0, 0.5
#: change of the offset by friction that bends, as it counts;  its chance over the offset's interval from which on the
#: log does not tell both apart
BENT, UNSURE_BEND = 1.5, 4.0
#: pieces of the residual over the position;  mean square of their means over the standard errors from which on friction
#: depends on the position
PLACES, UNEVEN = 24, 3.0
SIGN = (
    "a force, torque or current is positive where it drives towards positive positions: check both signs; a left-hand "
    "thread has a negative --lead-mm, a drive that counts the other way a negative --ratio or torque constant"
)
MAGNITUDE = "a magnitude without its sign? export it with its sign"
#: inertia of one direction over that of the other, at least, where a load pulls one way
ALIKE = 0.3
#: causes of an inertia that is not determined, and remedies
CAUSES = {
    "too little acceleration": "a log with ramps",
    "too much noise of the motion": "a finer encoder, or larger accelerations",
    "the motion does not tell the delay": "--delay-ms with the known one, or a log with ramps",
    "another filter or travel changes it": "a log of unfiltered signals with longer strokes",
}
#: largest standard error of the inertia over its value;  fraction of samples with friction along the motion
VAGUE, MAX_ALONG = 0.2, 0.25


@dataclass(frozen=True)
class Identified:
    """Inertia, offset and friction of an axis from a log, SI: kg, N, m/s, or rotary kg m2, N m, rad/s.

    Attributes
    ----------
    rotary : bool
        Whether the quantities are those of a rotation.
    inertia, inertia_limits : float, pair of float or None
        Mass or inertia with 95 % limits, None of a given one, as of the other quantities.
    offset, offset_limits : float, pair of float or None
        Constant force or torque; limits None: motion in one direction, whose friction includes the offset.
    offset_error : float or None
        Standard error of a given offset; None: the offset is by convention.
    friction : Friction
        Friction over speed.
    delay, delay_limits : float, pair of float or None
        Of the effort behind the motion [s].
    residual : float
        Root mean square, filtered.
    explained : float
        Fraction of the variance that is explained.
    places : tuple of array
        Position, mean residual there, its standard error.
    cutoff : float
        Of the filter [Hz].
    samples : int
        Samples that are used.
    left_out : dict of str to int
        Others, by reason.
    notes : list of str
        What limits the result.
    temperature, preload : float or None
        Means of the log [K], [N]; None: no such column.
    findings : sequence of Finding
        What the rows of the log show.
    """

    rotary: bool
    inertia: float
    inertia_limits: tuple[float, float] | None
    offset: float
    offset_limits: tuple[float, float] | None
    offset_error: float | None
    friction: Friction
    delay: float
    delay_limits: tuple[float, float] | None
    residual: float
    explained: float
    places: tuple[Array, Array, Array]
    cutoff: float
    samples: int
    left_out: dict[str, int]
    notes: list[str]
    temperature: float | None
    preload: float | None
    findings: Sequence[Finding] = ()

    @cached_property
    def both(self) -> Bidirectional:
        """Both directions at common speeds."""
        return directions.bidirectional_friction(self.friction, self.offset_error or 0.0)


def one_sign(pieces: list[Array]) -> bool:
    """Whether a signal is never negative, or never positive."""
    return min(float(x.min()) for x in pieces) >= 0.0 or max(float(x.max()) for x in pieces) <= 0.0


def check_sign(signals: Signals, fit: Fit) -> None:
    """Refuse an effort that is a magnitude: its inertia has another sign in each direction."""
    if one_sign([section.effort for section in signals.sections]):
        sides = [fit.samples.speed > 0.0, fit.samples.speed < 0.0]
        acceleration = without_friction(fit.samples.speed, fit.bins)(fit.samples.acceleration)
        one, other = (float(acceleration[side] @ fit.effort[side]) for side in sides)
        if not one * other >= ALIKE * max(one**2, other**2):
            units = UNITS[signals.rotary]
            raise ValueError(
                f"the {units.names[2]} never changes its sign: {MAGNITUDE}; where a load pulls one way: "
                f"{option(units.offset)} with its {units.names[2]}"
            )


def identify(
    signals: Signals,
    inertia: float | None = None,
    travel: float = 0.0,
    delay: float | None = None,
    cutoff: float | None = None,
    bins_wanted: int | None = None,
    offset: tuple[float, float] | None = None,
) -> Identified:
    """Inertia, offset and friction over speed of an axis by least squares on its inverse dynamics.

    Parameters
    ----------
    signals : Signals
        Motion and effort of a log.
    inertia : float, optional
        Known mass [kg] or inertia [kg m2]; None: fitted.
    travel : float, optional
        Travel left out behind a reversal, in the unit of the position.
    delay : float, optional
        Known delay of the effort [s]; None: estimated.
    cutoff : float, optional
        Of the filter [Hz]; None: by the log.
    bins_wanted : int, optional
        Bins of speed of each direction; None: by the number of samples.
    offset : pair of float, optional
        Known offset and its standard error [N] or [N m]; None: by convention.

    Returns
    -------
    Identified
        Values with 95 % limits.

    Raises
    ------
    ValueError
        Too few samples; inertia not determined, or free with motion in one direction only; with what the rows show.

    Notes
    -----
    effort = inertia * acceleration + offset + friction(speed), friction with a value in each bin of speed. Method and
    intervals: head of this module.

    Examples
    --------
    >>> import numpy as np
    >>> from ballscrew_tehl.applications.identification.log.signals import Section, Signals
    >>> time = np.arange(0.0, 10.0, 4e-3)
    >>> position, speed = 0.1 * np.sin(np.pi * time), 0.1 * np.pi * np.cos(np.pi * time)
    >>> force = 100.0 * -(np.pi**2) * position + 50.0 * np.tanh(speed / 2e-3)
    >>> log = Signals(False, False, 4e-3, 0.0, [Section(position, force)], None, None, {}, [])
    >>> f"{identify(log).inertia:.0f} kg"
    '100 kg'
    """
    try:
        return _identified(signals, inertia, travel, delay, cutoff, bins_wanted, offset)
    except ValueError as error:
        raise ValueError(f"{error}{of_refusal(signals.findings)}") from None


def _identified(
    signals: Signals, inertia: float | None, travel: float, delay: float | None, cutoff: float | None,
    bins_wanted: int | None, offset: tuple[float, float] | None,
) -> Identified:  # fmt: skip
    selection, variance = chosen_cutoff(signals)
    cutoff = selection if cutoff is None else cutoff
    samples = filtered(signals, travel, cutoff, variance)
    usable = {name: int((samples.speed * sign > 0.0).sum()) * samples.each for sign, name in SIDES.items()}
    few, least = min(usable, key=lambda name: usable[name]), MIN_BINS * MIN_SAMPLES
    if usable[few] < least and (inertia is None or max(usable.values()) < least):
        magnitude = signals.of_speed and one_sign([section.motion for section in signals.sections])
        remedy = f"the speed never changes its sign: {MAGNITUDE}" if magnitude else "longer strokes both ways"
        known = option(UNITS[signals.rotary].inertia)
        known = f"; or {known} with its value, for the friction of one direction" * (inertia is None)
        raise ValueError(
            f"samples with {few} speed away from reversals = {usable[few]}, {1.0 / signals.step:.4g} a second; "
            f"allowed: at least {least} in each direction; remedy: {remedy}{known}"
        )
    notes = list(signals.notes)
    free = [name for name, value in (("inertia", inertia), ("delay", delay)) if value is None]
    rough = filtered(signals, travel, min(cutoff, LAG_CUTOFF), variance)
    if not len(rough.speed) * rough.each > ROUGH_LEFT * len(samples.speed) * samples.each:
        rough = samples
    time = timing(signals, samples, rough, delay, inertia)
    if time.lag > 0.0:
        settled = filtered(signals, travel, rough.cutoff, variance, time.lag)
        rough = settled if len(settled.speed) > ROUGH_LEFT * len(rough.speed) else rough
        time = timing(signals, rough, rough, delay, inertia)
        cutoff = min(cutoff, max(rough.cutoff, LAG_GAIN / (2.0 * math.pi * max(time.lag, 1e-3))))
        samples = filtered(signals, travel, cutoff, variance, time.lag)
    size, bins = bins_of(samples, bins_wanted)
    place = bins(samples.speed)
    number = np.bincount(place, minlength=size) * samples.each
    enough = (number >= MIN_SAMPLES) & (number * samples.rate >= MIN_INDEPENDENT)
    use = enough[place]
    reason = f"bins of speed with fewer than {MIN_SAMPLES} samples, {MIN_INDEPENDENT:g} of them independent"
    left_out = signals.left_out | samples.left_out | {reason: int((~use).sum()) * samples.each}
    # what half the cutoff and a farther travel change
    pairs = (travel, 0.5 * cutoff), (FARTHER * travel, cutoff)
    others = [filtered(signals, *pair, variance, time.lag) for pair in pairs]
    if len(others[1].speed) < FARTHER_LEFT * len(samples.speed):
        del others[1]
    sides = set(np.sign(samples.speed[use]))
    if len(sides) < (2 if inertia is None else 1):
        few = f"no bin of speed with {MIN_SAMPLES} samples in both directions"
        raise ValueError(f"{few}; allowed: a longer log, or fewer bins (--bins)")
    fit = fit_of(samples.where(use), time, np.cumsum(enough)[place[use]] - 1, int(enough.sum()), inertia)
    if offset is None and len(sides) == 2:
        check_sign(signals, fit)
    patterns = patterns_of(fit, signals, inertia, notes)
    waves = [one(fit.samples) for one in patterns]
    fit = fit_of(fit.samples, time, fit.bins, len(fit.number), inertia, waves)
    changed = [
        fit_of(other, time, bins(other.speed), size, inertia, [one(other) for one in patterns]) for other in others
    ]  # fmt: skip
    smeared = SMEAR * np.nan_to_num(changed[0].total[enough] - fit.total)
    return _result(signals._replace(left_out=left_out, notes=notes), fit, changed, smeared, offset, free)


def _result(
    signals: Signals, fit: Fit, changed: list[Fit], smeared: Array, user_offset: tuple[float, float] | None,
    free: list[str],
) -> Identified:  # fmt: skip
    """Values with limits that hold what another cutoff and travel change; free: what is fitted."""
    samples, residual, time = fit.samples, fit.residual, fit.timing
    deviation = float(np.sqrt(np.mean(residual**2)))
    explained = 1.0 - deviation**2 / max(float(np.var(fit.effort)), 1e-300)
    speed = np.bincount(fit.bins, samples.speed) / fit.number
    weights = offset_weights(speed, fit.number)
    one_way = user_offset is None and len(set(np.sign(speed))) == 1
    offset, offset_error = user_offset or (0.0 if one_way else float(weights @ fit.total), 0.0)
    weights = weights * (user_offset is None and not one_way)
    friction = fit.total - offset
    errors, wide, halves, offset_wide, usual = errors_of(fit, weights, "inertia" in free)
    noise = samples.noise / max(float(np.var(samples.acceleration)), 1e-300)

    half, change = float(halves[0]), [float(np.nan_to_num(other.inertia - fit.inertia)) for other in changed]
    # of a change, what is no chance
    moved = COARSER * math.hypot(*(math.sqrt(max(one**2 - half**2, 0.0)) for one in change))
    parts = dict(zip(CAUSES, (half, NOISE_UNSURE * noise * fit.inertia, time.inertia, moved), strict=True))
    half = math.hypot(*parts.values())
    along = speed * friction * (not one_way) < 0.0
    _check(signals, fit, "inertia" in free, explained, half, usual, along, parts)
    low, high = time.low, time.high
    if time.told and "delay" in free:
        of_others = [float(np.nan_to_num(other.coefficients[-1] - fit.coefficients[-1])) for other in changed]
        late = float(halves[-1]) + LATER * math.hypot(*of_others)
        low, high = time.delay - late, time.delay + late
    bend = _within_a_bin(speed, friction, errors)
    wide = np.sqrt(wide**2 + bend**2 + smeared**2 + (LIMIT * offset_error) ** 2)
    offset_wide = math.hypot(offset_wide, float(weights @ smeared), LIMIT * offset_error)
    if user_offset is None and not one_way:
        # where the directions have other speeds, friction that bends over the speed is taken for an offset
        bent = offset_weights(speed, fit.number, bent=True) - weights
        by_bend, chance = float(bent @ fit.total), LIMIT * float(np.sqrt(bent**2 @ errors**2))
        moved = BENT * math.sqrt(max(by_bend**2 - chance**2, 0.0))
        if chance > UNSURE_BEND * offset_wide or moved > offset_wide:
            signals.notes.append(
                "the directions have few common speeds: the offset, and with it friction, holds for friction that is a "
                "straight line over the speed; log both directions at the same speeds"
            )
        wide, offset_wide = np.hypot(wide, moved), math.hypot(offset_wide, moved)
    of_bins, of_offset, of_inertia = of_steps(signals, fit, weights)
    steps = f"steps of {signals.effort_quantum:.3g} {UNITS[signals.rotary].si[1]}"
    if np.median(of_bins) > 0.1 * np.median(wide):
        excluded = "rounding, and truncation unless the data exclude it, are in the intervals"
        signals.notes.append(f"{steps}: {excluded}")
    if 0.5 * signals.effort_quantum > 0.5 * offset_wide > 0.0:
        down = "if the drive rounds down, the offset is half a step higher than shown"
        signals.notes.append(f"{steps}: {down}")
    wide, offset_wide, half = wide + of_bins, offset_wide + of_offset, half + of_inertia
    # residual over the position
    first, last = float(samples.position.min()), float(samples.position.max())
    place = np.minimum(((samples.position - first) / (last - first or 1.0) * PLACES).astype(int), PLACES - 1)
    count = np.bincount(place, minlength=PLACES)
    some = count * samples.each * samples.rate >= MIN_INDEPENDENT
    middle = first + (np.flatnonzero(some) + 0.5) * (last - first) / PLACES
    mean = np.bincount(place, residual, PLACES)[some] / count[some]
    places = middle, mean, float(np.std(residual)) / np.sqrt(count[some] * samples.each * samples.rate)
    bins = Friction(
        speed, friction, np.hypot(errors, offset_error), friction - wide, friction + wide,
        (fit.number * samples.each).astype(int),
    )  # fmt: skip
    result = Identified(
        signals.rotary, fit.inertia, (fit.inertia - half, fit.inertia + half) if "inertia" in free else None,
        offset, None if one_way else (offset - offset_wide, offset + offset_wide), user_offset and offset_error, bins,
        time.delay, (low, high) if "delay" in free else None, deviation, explained,
        places, samples.cutoff, len(residual) * samples.each, signals.left_out, signals.notes,
        signals.temperature, signals.preload, signals.findings,
    )  # fmt: skip
    result.notes.extend(_notes(result, noise, time))
    return result


def _check(
    signals: Signals, fit: Fit, free: bool, explained: float, half: float, usual: float, along: np.ndarray,
    parts: dict[str, float],
) -> None:  # fmt: skip
    """Refuse a log that does not determine the values; half: of the inertia's interval, with its parts by cause;
    along: bins of wrong sign.
    """
    units, value = UNITS[signals.rotary], fit.inertia
    what, unit = units.names[0], units.shown[0]
    if not explained >= 0.0:
        time = timing(signals, fit.samples, fit.samples, None, None)
        seen = fit_of(fit.samples, time, fit.bins, len(fit.number), None).inertia
        shown = "" if free else f"; the log shows about {seen:.3g} {unit}"
        raise ValueError(
            f"inertia{' given' * (not free)} = {value:.4g} {unit}{shown}; it explains nothing of the effort; allowed: "
            "motion and effort of one log, with new values in each row; remedy: check columns, units, signs, sampling"
        )
    if free and value < -half:
        raise ValueError(f"{what} = {value:.4g}; allowed: > 0: {SIGN}")
    if free and not half <= usual * VAGUE * value:
        cause, effort, lag = max(parts, key=lambda name: parts[name]), units.names[2], 1e3 * fit.timing.lag
        moves, remainder = float(np.std(value * fit.samples.acceleration)), float(np.std(fit.residual))
        smoothed = f"; the {effort} is smoothed as by a filter of {lag:.3g} ms" * (lag > 0.0)
        sizes = f"the acceleration moves the {effort} by {moves:.2g}, the residual is {remainder:.2g} {units.shown[1]}"
        known = f"{option(units.inertia)} with the known value, or {CAUSES[cause]}"
        error = f"+- {half:.2g}" if half < 1e3 * abs(value) else "without a bound"
        result = f"{what} = {value:.4g} {unit} {error}: {cause} ({sizes})"
        raise ValueError(f"{result}{smoothed}; remedy: {known}")
    wrong = float(np.sum(fit.number * along) / fit.number.sum())
    if wrong > MAX_ALONG:
        along_it = f"friction along the motion in {wrong:.0%} of the samples"
        raise ValueError(f"{along_it}; allowed: at most {MAX_ALONG:.0%}: {SIGN}")


def _notes(result: Identified, noise: float, time: Timing) -> list[str]:
    """What limits the result."""
    notes, units, both, (_, mean, error) = [], UNITS[result.rotary], result.both, result.places
    (inertia, _, effort), unit, ms = units.names, units.shown[1], f"{1e3 * time.delay:.3g} ms"
    if result.offset_limits is None:
        notes.append("motion in one direction: the friction holds the offset (gravity, tilt), not told apart")
    if time.lag > 0.0:
        constant = f"as by a filter with a time constant of {1e3 * time.lag:.3g} ms"
        notes.append(
            f"the {effort} is smoothed {constant}, and a delay of {ms}: taken out; log the unfiltered signal"
        )
    elif result.delay_limits is not None and not time.told:
        notes.append(
            f"the motion does not tell the delay of the {effort}, {1e3 * time.low:.3g} to {1e3 * time.high:.3g} ms; "
            f"the interval of the {inertia} holds that range: state it by --delay-ms, or log ramps"
        )
    elif result.delay_limits is not None and abs(time.delay) > LATE:
        remainder = "what a filter of the drive does besides is in no interval"
        notes.append(f"the {effort} is {ms} behind the motion: {remainder}")
    if noise > 10.0 * MAX_NOISE:
        notes.append(f"noise is {100.0 * noise:.2g} % of the acceleration's variance at the lowest cutoff")
    if directions.varies(both):
        notes.append(
            f"(f+ - f-)/2, half the difference of friction between the directions, varies with speed, "
            f"{both.difference.min():+.3g} to {both.difference.max():+.3g} {unit}"
            + ": it cannot all be an offset, unless load, tilt or temperature changed"
            * (result.offset_error is None)
        )
    if len(mean) and float(np.mean((mean / error) ** 2)) > UNEVEN:
        notes.append(
            f"friction depends on the position: mean residuals there {float(np.sqrt(np.mean(mean**2))):.2g} {unit} "
            "(root mean square); the intervals hold for the positions of this log"
            + ("" if result.delay_limits is None else ", that of the delay leaves out the bias by them")
        )
    return notes


def _within_a_bin(speed: Array, friction: Array, errors: Array) -> Array:
    """Second difference over 8 [effort]: what a kink in a bin moves its mean from the friction at its mean speed."""
    bend = np.zeros(len(speed))
    for side in (speed < 0.0, speed > 0.0):
        if side.sum() >= 3:
            # less what is by chance
            chance = np.convolve(errors[side] ** 2, [1.0, 4.0, 1.0], "valid")
            second = np.sqrt(np.maximum(np.diff(friction[side], 2) ** 2 - BY_CHANCE * chance, 0.0))
            second = np.pad(second, 1, mode="edge")
            bend[side] = scipy.ndimage.maximum_filter1d(second, 3, mode="nearest") / 8.0
    return bend
