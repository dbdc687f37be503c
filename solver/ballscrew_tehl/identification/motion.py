"""Speed, acceleration and effort of a log behind one zero-phase low-pass filter, and which samples are used.

The filter is a Butterworth filter run forwards and backwards (scipy.signal.sosfiltfilt), the same for motion and
effort; then central differences. Its cutoff is the highest at which the noise of the measured motion leaves the
acceleration clean enough. The noise is taken as white, of the size seen above ABOVE of the sampling frequency.
Source: Gautier, Janot, Vandanjon, IEEE Trans. Contr. Syst. Technol. 21 (2013) 428 (inverse dynamics, parallel filter)
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, freqz_sos, sosfiltfilt, welch

from ..physics.ball_law import Array
from .signals import Section, Signals, integral

ORDER = 2
#: cutoffs over the sampling frequency, highest first (above, forces that are not measured act on the inertia);
#: lowest cutoff [Hz]
CUTOFFS, MIN_CUTOFF = (0.1, 0.07, 0.05, 0.035, 0.025, 0.0175, 0.0125, 0.009, 0.006), 2.0
#: most noise in the acceleration, as a share of its variance: the mass comes out too small by this share
MAX_NOISE = 5e-4
#: part of the sampling frequency above which motion is noise; samples that the cutoff is chosen from
ABOVE, LOOKED_AT = 0.35, 200_000
#: response of the filter over 1/cutoff: reversals and ends of a piece are felt so long
RESPONSE = 1.5
#: slowest speed over the largest
SLOW = 0.01
#: travel after a reversal in which friction still rises [m], of a screw without lead [rad]
TRAVEL, TRAVEL_ANGLE = 5e-5, 0.04
#: a sample is kept of so many that fit a period of the cutoff
PER_PERIOD = 4
OF_SAMPLES = ("speed", "acceleration", "jerk", "effort", "position", "run", "section", "index")


@dataclass(frozen=True)
class Samples:
    """Filtered samples that are used, equally long.

    speed, acceleration, effort, position (SI of the axis);  run : number of the piece between reversals
    section, index : where each is in the signals
    each : samples of the log for one of these;  rate : independent samples for one of the log
    cutoff [Hz];  noise : variance of that of the acceleration
    left_out : samples of the log by reason, with used
    """

    speed: Array
    acceleration: Array
    jerk: Array
    effort: Array
    position: Array
    run: np.ndarray
    section: np.ndarray
    index: np.ndarray
    each: int
    rate: float
    cutoff: float
    noise: float
    left_out: dict[str, int]


def _filter(cutoff: float, step: float) -> Array:
    return np.asarray(butter(ORDER, cutoff, fs=1.0 / step, output="sos"))


def _noise(signals: Signals) -> tuple[float, Array]:
    """Variance of the noise of the motion, and a piece of it."""
    motion = max((section.motion for section in signals.sections), key=len)[:LOOKED_AT]
    order = 1 if signals.of_speed else 2
    difference = np.diff(motion, order)
    length = min(len(difference), 1024)
    frequency, density = welch(difference, nperseg=length)
    gain = (2.0 - 2.0 * np.cos(2.0 * math.pi * frequency)) ** order
    high = frequency >= ABOVE
    # density over 0 to 1/2, one-sided; quantisation at rest is no less than that in motion
    seen = 0.5 * float(np.median(density[high] / gain[high]))
    return max(seen, signals.quantum**2 / 12.0), motion


def acceleration_noise(variance: float, cutoff: float, signals: Signals) -> float:
    """Variance of the acceleration from white noise of the motion behind the filter."""
    omega, response = freqz_sos(_filter(cutoff, signals.step), worN=2048)
    order = 1 if signals.of_speed else 2
    # a central first difference of a speed, a second one of a position
    gain = np.sin(omega) ** 2 if order == 1 else (2.0 - 2.0 * np.cos(omega)) ** 2
    return float(variance * np.mean(np.abs(response) ** 4 * gain) / signals.step ** (2 * order))


def chosen_cutoff(signals: Signals) -> tuple[float, float]:
    """Cutoff [Hz] and variance of the noise of the motion."""
    variance, motion = _noise(signals)
    piece = Section(motion, motion)
    cutoff = MIN_CUTOFF
    for part in CUTOFFS:
        cutoff = part / signals.step
        if cutoff < MIN_CUTOFF:
            break
        found = _differences(piece, cutoff, signals, with_effort=False)[2]
        if acceleration_noise(variance, cutoff, signals) <= MAX_NOISE * float(np.var(found)):
            break
    return max(cutoff, MIN_CUTOFF), variance


def _differences(
    section: Section, cutoff: float, signals: Signals, with_effort: bool = True
) -> tuple[Array, Array, Array, Array]:
    """Position, speed, acceleration, effort at the inner samples of a section."""
    sos, step = _filter(cutoff, signals.step), signals.step
    pad = min(len(section.motion) - 1, int(3.0 / (cutoff * step)) + 1)

    def smooth(values: Array) -> Array:
        return np.asarray(sosfiltfilt(sos, values, padlen=pad))

    effort = smooth(section.effort)[1:-1] if with_effort else np.empty(0)
    motion = smooth(section.motion)
    slope = (motion[2:] - motion[:-2]) / (2.0 * step)
    if signals.of_speed:
        return integral(motion, step)[1:-1], motion[1:-1], slope, effort
    return motion[1:-1], slope, (motion[2:] - 2.0 * motion[1:-1] + motion[:-2]) / step**2, effort


def filtered(signals: Signals, travel: float, cutoff: float | None = None) -> Samples:
    """Samples that take part in the fit.

    Parameters   travel : after a reversal that is left out, as the position;  cutoff : [Hz], None = chosen
    Raises       ValueError: none is left
    """
    chosen, variance = chosen_cutoff(signals)
    cutoff = chosen if cutoff is None else cutoff
    each = max(int(1.0 / (PER_PERIOD * cutoff * signals.step)), 1)
    reach = math.ceil(RESPONSE / (cutoff * signals.step))
    pieces = [_differences(section, cutoff, signals) for section in signals.sections]
    slow = SLOW * max(float(np.quantile(np.abs(piece[1]), 0.999)) for piece in pieces)
    runs, ends, near, slower, parts = 0, 0, 0, 0, []
    for number, (position, speed, acceleration, effort) in enumerate(pieces):
        count = len(speed)
        inner = np.zeros(count, dtype=bool)
        inner[reach : max(count - reach, reach)] = True
        fast = np.abs(speed) >= slow
        away, run = _away_from_reversals(position, speed, slow, reach, travel)
        ends += int((~inner).sum()) + 2
        slower += int((inner & ~fast).sum())
        near += int((inner & fast & ~away).sum())
        keep = np.flatnonzero(inner & fast & away)
        keep = keep[keep % each == 0]
        jerk, section_of = np.gradient(acceleration, signals.step), np.full(count, number)
        columns = speed, acceleration, jerk, effort, position, run + runs, section_of, np.arange(1, count + 1)
        parts.append([values[keep] for values in columns])
        runs += int(run.max(initial=0)) + 1
    joined: dict[str, Any] = dict(zip(OF_SAMPLES, map(np.concatenate, zip(*parts, strict=True)), strict=True))
    # noise behind the filter, run twice, is independent over about this time
    rate = min(1.0, 2.0 * 0.8 * cutoff * signals.step)
    left_out = {
        "ends of pieces (filter)": ends, "near reversals (filter and presliding)": near,
        "slower than 1 % of the largest speed": slower,
    }  # fmt: skip
    noise = acceleration_noise(variance, cutoff, signals)
    return Samples(**joined, each=each, rate=rate, cutoff=cutoff, noise=noise, left_out=left_out)


def effort_later(signals: Signals, samples: Samples) -> Callable[[float], Array]:
    """Filtered effort at the samples, a delay [s] later."""
    sos = _filter(samples.cutoff, signals.step)
    curves = [
        CubicSpline(np.arange(len(section.effort)), sosfiltfilt(sos, section.effort))
        for section in signals.sections
    ]

    def effort(delay: float) -> Array:
        found = np.empty(len(samples.effort))
        for number, curve in enumerate(curves):
            of_it = samples.section == number
            found[of_it] = curve(samples.index[of_it] + delay / signals.step)
        return found

    return effort


def _away_from_reversals(
    position: Array, speed: Array, slow: float, reach: int, travel: float
) -> tuple[np.ndarray, np.ndarray]:
    """Samples farther from a reversal than the filter's response and behind it than a travel; number of the run."""
    count = len(speed)
    index = np.arange(count)
    moving = np.abs(speed) >= slow
    # direction of the last motion that was not slow
    last = np.maximum.accumulate(np.where(moving, index, 0))
    held = np.where(moving, np.sign(speed), 0.0)[last]
    # motion begins anew behind a standstill as well
    start = np.flatnonzero(moving & ~np.r_[False, moving[:-1] & (held[1:] == held[:-1])])
    run = np.cumsum(np.isin(index, start))
    begin = np.r_[0, start][run]
    end = np.r_[start, count][run]
    stop = np.flatnonzero(~moving)
    behind = np.abs(position - position[begin])
    away = (index - begin >= reach) & (end - index >= reach) & (behind >= travel)
    if stop.size:
        after = np.searchsorted(stop, index)
        upcoming = np.r_[stop, count + reach][after]
        away &= upcoming - index >= reach // 2
    return away, run
