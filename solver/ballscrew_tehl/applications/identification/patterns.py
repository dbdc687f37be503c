"""What the residual shows beyond inertia and friction over speed, and what steps of the effort may move."""

import math
from collections.abc import Callable

import numpy as np
import scipy

from ballscrew_tehl.numerics import Array

from .directions import UNITS
from .fit import Fit, errors_of, fit_of, without_friction
from .log.signals import Signals
from .motion import Samples, effort_curves, white_noise

#: power of a wave over the usual one, its share of the variance of the residual;  least share of a loss or drift, of
#: samples that brake;  error of a loss that tells none
WAVE, WAVE_SHARE, LEAST_PATTERN, BRAKES, UNSURE_LOSS = 30.0, 0.02, 0.02, 0.03, 0.02
#: share of the error by steps that noise leaves, from which on data do not exclude truncation;  variance of the
#: residual over that of the noise from which on something else acts
KEPT, MORE = 0.05, 2.5


Pattern = Callable[[Samples], Array]


def wave_of(place: Array, residual: Array, shortest: float, whole: bool) -> tuple[float, float]:
    """Wave number over the position that the residual shows most clearly, and its amplitude; 0: none; whole: a whole
    number is meant where it is near.
    """
    place = place - place.min()
    span = float(place.max()) or 1.0
    number = int(np.clip(8.0 * span / shortest, 512, 2**18))
    sums = np.bincount((place / span * (number - 1)).astype(int), residual, number)
    power = np.abs(np.fft.rfft(sums, 2 * number)) ** 2
    # at least two periods in the span, eight pieces of it in one
    low, high = 4, number // 4
    around = np.maximum(scipy.ndimage.median_filter(power, 101, mode="nearest"), 1e-12 * power.max() + 1e-300)
    at = low + int(np.argmax((power / around)[low:high]))
    usual = float(np.median(power[max(at - 50, low) : at + 51]))
    exact = math.pi * np.linspace(at - 1.0, at + 1.0, 41) / span
    if whole and exact[0] < round(exact[20]) < exact[-1]:
        exact = np.array([float(round(exact[20]))])
    sizes = [abs(np.sum(residual * np.exp(-1j * k * place))) for k in exact]
    amplitude = 2.0 * max(sizes) / len(residual)
    clear = power[at] > WAVE * usual and amplitude**2 > WAVE_SHARE * 2.0 * float(np.mean(residual**2))
    return (float(exact[int(np.argmax(sizes))]), amplitude) if clear else (0.0, 0.0)


def patterns_of(fit: Fit, signals: Signals, inertia: float | None, notes: list[str]) -> list[Pattern]:
    """Waves over the position, to be fitted with the rest; what is found besides goes to the notes."""
    units, samples, result = UNITS[signals.rotary], fit.samples, list[Pattern]()
    position, effort = samples.position, units.names[2]
    shortest = 0.5 * math.pi if signals.rotary else float(np.ptp(position)) / 1024.0
    wave, amplitude = wave_of(position, fit.residual, shortest, signals.rotary)
    if wave:
        period = f"{wave:.4g} times a turn" if signals.rotary else f"each {2e3 * math.pi / wave:.4g} mm"
        shown = f"friction varies by +-{amplitude:.2g} {units.si[1]} {period}, over the position"
        notes.append(f"{shown}: fitted as a wave")
        result = [lambda s: np.cos(wave * s.position), lambda s: np.sin(wave * s.position)]
    raw = [section.effort for section in signals.sections]
    noise = white_noise(raw, 1, signals.effort_quantum) * samples.rate + fit.inertia**2 * samples.noise
    deviation = float(np.mean(without_friction(samples.speed, fit.bins)(fit.residual) ** 2))
    if deviation > MORE * max(noise, 1e-12 * float(np.var(fit.effort))):
        times = math.sqrt(deviation / max(noise, 1e-300))
        notes.append(
            f"the residual is {times:.3g} times the noise of the {effort}: a resonance, backlash, a load, a filter, a "
            "drift or friction over the position acts besides inertia and friction, and may be in no interval"
        )
    _losses_and_drifts(fit, effort, inertia, notes)
    return result


def _losses_and_drifts(fit: Fit, effort: str, inertia: float | None, notes: list[str]) -> None:
    """Notes on friction in proportion to the effort, and on friction and offset in proportion to the time."""
    samples, model = fit.samples, fit.effort - fit.residual
    order = np.lexsort((samples.row, samples.section)).argsort()
    time, sign = order / max(len(order) - 1.0, 1.0) - 0.5, np.sign(samples.speed)
    friction = float(np.mean(np.abs(fit.total - fit.total.mean())))
    brakes = np.mean(model * sign < 0.0)
    lost = f"of the transmitted {effort} is lost in friction: bins of speed hold that at the {effort} of this log"
    of_friction = (
        "of the friction is its drift over the log (temperature, running in): a bin is of its own time"
    )
    of_offset = "of the friction is the drift of the offset (load, tilt, temperature), in no interval"
    drifts = (sign * time, friction, of_friction), (time, friction, of_offset)
    for column, size, text in ((sign * np.abs(model), 1.0, lost), *drifts):
        other = fit_of(samples, fit.timing, fit.bins, len(fit.number), inertia, [column])
        slope = other.coefficients[1]
        half = errors_of(other, np.zeros(len(fit.number)), inertia is None)[2][1]
        if size == 1.0 and (half > UNSURE_LOSS or brakes < BRAKES):
            notes.append(
                f"the {effort} brakes too little in this log to tell a loss in proportion to it (motor, "
                "gear, its constant) from inertia and friction: it is in no interval"
            )
        elif abs(slope) > max(LEAST_PATTERN * size, 2.0 * half):
            notes.append(f"{abs(slope) / size:.2g} {text}")


def of_steps(signals: Signals, fit: Fit, weights: Array) -> tuple[Array, float, float]:
    """What steps of the effort may move the bins, the offset and the inertia: rounding as far as noise does not average
    it, and half a step of truncation towards 0 unless the data exclude it.
    """
    step, samples, size = signals.effort_quantum, fit.samples, len(fit.number)
    if not step > 0.0:
        return np.zeros(size), 0.0, 0.0
    variance = white_noise([section.effort for section in signals.sections], 1, 0.0)
    kept = math.exp(-2.0 * math.pi**2 * max(variance / step**2 - 1.0 / 12.0, 0.0))
    rounded = 0.5 * step * kept
    cut = [section._replace(effort=0.5 * step * np.sign(section.effort)) for section in signals.sections]
    curves = effort_curves(signals._replace(sections=cut), samples.cutoff)
    column = samples._replace(curves=curves).effort(fit.timing.delay)
    other = fit_of(samples, fit.timing, fit.bins, size, None, [column])
    half = float(errors_of(other, weights, True)[2][1])
    excluded = kept < KEPT and half < 0.25 and abs(other.coefficients[1] + 1.0) > 2.0 * half + 0.5
    # without noise a ramp may have one error, up to a step
    column = column * (0.0 if excluded else 1.0 + kept)
    means = np.bincount(fit.bins, column) / fit.number
    of_offset = abs(float(weights @ means)) + 0.5 * rounded * float(np.sum(np.abs(weights)))
    return np.abs(means) + rounded, of_offset, abs(float(fit.influence[:, 0] @ column))
