"""Speed, acceleration and effort of a log behind one zero-phase low-pass filter, and which samples are used.

The filter is a Butterworth filter run forwards and backwards (scipy.signal.sosfiltfilt), the same for motion and
effort; then central differences. Its cutoff is the highest at which the noise of the measured motion leaves the
acceleration clean enough. The noise is taken as white, of the size seen above ABOVE of the sampling frequency.
Source: Gautier, Janot, Vandanjon, IEEE Trans. Contr. Syst. Technol. 21 (2013) 428 (inverse dynamics, parallel filter)
"""

import math
from typing import NamedTuple

import numpy as np
import scipy

from ballscrew_tehl.numerics import Array

from .log.signals import Signals

ORDER = 2
#: cutoffs over the sampling frequency, highest first (above, forces that are not measured act on the inertia);
#: lowest cutoff [Hz]
CUTOFFS, MIN_CUTOFF = (0.1, 0.07, 0.05, 0.035, 0.025, 0.0175, 0.0125, 0.009, 0.006), 2.0
#: most noise in the acceleration, as a share of its variance: the mass comes out too small by this share
MAX_NOISE = 5e-4
#: part of the sampling frequency above which motion is noise; samples that the cutoff is chosen from
ABOVE, LOOKED_AT = 0.35, 200_000
#: response of the filter over 1/cutoff: reversals and ends of a piece are felt so long; slowest speed over the largest;
#: a sample is kept of so many that fit a period of the cutoff
RESPONSE, SLOW, PER_PERIOD = 1.5, 0.01, 4
#: travel after a reversal in which friction still rises [m], of a screw without lead [rad]
TRAVEL, TRAVEL_ANGLE = 5e-5, 0.04
#: samples of the log that are not used, by reason
LEFT_OUT = (
    "ends of pieces (filter)", "near reversals (filter and presliding)", "slower than 1 % of the largest speed"
)  # fmt: skip


class Samples(NamedTuple):
    """Filtered samples that are used (SI of the axis), arrays equally long; left_out: samples of the log by reason.

    run: number of the piece between reversals; section, row: where each is in the signals
    each: samples of the log for one of these; rate: independent samples for one of the log
    noise: variance of that of the acceleration; curves: filtered effort of each section over its rows
    rate_noise: variance of that of the derivative of the effort
    """

    speed: Array
    acceleration: Array
    jerk: Array
    position: Array
    run: np.ndarray
    section: np.ndarray
    row: np.ndarray
    each: int
    rate: float
    cutoff: float
    noise: float
    left_out: dict[str, int]
    curves: list["scipy.interpolate.CubicSpline"]
    step: float
    rate_noise: float

    def where(self, use: np.ndarray) -> "Samples":
        """A part of the samples."""
        arrays = self._fields[:7]
        return self._replace(**{name: getattr(self, name)[use] for name in arrays})

    def effort(self, delay: float, order: int = 0) -> Array:
        """Filtered effort a delay [s] later, or its derivative by time."""
        result = np.empty(len(self.speed))
        for number, curve in enumerate(self.curves):
            of_it = self.section == number
            result[of_it] = curve(self.row[of_it] + delay / self.step, order) / self.step**order
        return result


def _filter(cutoff: float, step: float) -> Array:
    return np.asarray(scipy.signal.butter(ORDER, cutoff, fs=1.0 / step, output="sos"))


def noise_of(variance: float, cutoff: float, step: float, order: int) -> float:
    """Variance of a central difference of an order, from white noise of a signal behind the filter."""
    omega, response = scipy.signal.freqz_sos(_filter(cutoff, step), worN=2048)
    gain = np.sin(omega) ** 2 if order == 1 else (2.0 - 2.0 * np.cos(omega)) ** 2
    return float(variance * np.mean(np.abs(response) ** 4 * gain) / step ** (2 * order))


def white_noise(pieces: list[Array], order: int, quantum: float) -> float:
    """Variance of the white noise of a signal, by its differences of an order, where they have no more than noise."""
    difference = np.diff(max(pieces, key=len)[:LOOKED_AT], order)
    frequency, density = scipy.signal.welch(difference, nperseg=min(len(difference), 1024))
    gain = (2.0 - 2.0 * np.cos(2.0 * math.pi * frequency)) ** order
    high = frequency >= ABOVE
    # density over 0 to 1/2, one-sided; quantisation at rest is no less than that in motion
    return max(0.5 * float(np.median(density[high] / gain[high])), quantum**2 / 12.0)


def chosen_cutoff(signals: Signals) -> tuple[float, float]:
    """Cutoff [Hz] and variance of the noise of the motion."""
    motion = max((section.motion for section in signals.sections), key=len)[:LOOKED_AT]
    order = 1 if signals.of_speed else 2
    variance = white_noise([motion], order, signals.quantum)
    for cutoff in np.array(CUTOFFS) / signals.step:
        if cutoff < MIN_CUTOFF:
            break
        acceleration = differences(motion, cutoff, signals)[2]
        if noise_of(variance, cutoff, signals.step, order) <= MAX_NOISE * float(np.var(acceleration)):
            break
    return max(float(cutoff), MIN_CUTOFF), variance


def differences(motion: Array, cutoff: float, signals: Signals) -> tuple[Array, Array, Array]:
    """Position, speed and acceleration at the inner samples of a section."""
    step = signals.step
    pad = min(len(motion) - 1, int(3.0 / (cutoff * step)) + 1)
    motion = np.asarray(scipy.signal.sosfiltfilt(_filter(cutoff, step), motion, padlen=pad))
    slope = (motion[2:] - motion[:-2]) / (2.0 * step)
    if signals.of_speed:
        return scipy.integrate.cumulative_trapezoid(motion, dx=step, initial=0.0)[1:-1], motion[1:-1], slope
    return motion[1:-1], slope, (motion[2:] - 2.0 * motion[1:-1] + motion[:-2]) / step**2


def filtered(signals: Signals, travel: float, cutoff: float, variance: float, settle: float = 0.0) -> Samples:
    """Samples farther from reversals than a travel, the response of the filter and a time [s] that the effort settles
    in; variance: noise of the motion.
    """
    step = signals.step
    each = max(int(1.0 / (PER_PERIOD * cutoff * step)), 1)
    reach = math.ceil((RESPONSE / cutoff + settle) / step)
    pieces = [differences(section.motion, cutoff, signals) for section in signals.sections]
    slow = SLOW * max(float(np.quantile(np.abs(speed), 0.999)) for _, speed, _ in pieces)
    runs, left, parts = 0, np.zeros(3, dtype=int), []
    for number, (position, speed, acceleration) in enumerate(pieces):
        index, size = np.arange(len(speed)), len(speed)
        inner, moving = (index >= reach) & (index < size - reach), np.abs(speed) >= slow
        # a run of motion begins behind a reversal or a standstill
        direction = np.sign(speed) * moving
        begins = moving & (direction != np.r_[0.0, direction[:-1]])
        run, start, stop = np.cumsum(begins), np.flatnonzero(begins), np.flatnonzero(~moving)
        begin, end = np.r_[0, start][run], np.r_[start, size][run]
        upcoming = np.r_[stop, size + reach][np.searchsorted(stop, index)]
        away = (index - begin >= reach) & (end - index >= reach) & (upcoming - index >= reach // 2)
        away &= np.abs(position - position[begin]) >= travel
        left += [(~inner).sum() + 2, (inner & moving & ~away).sum(), (inner & ~moving).sum()]
        keep = inner & moving & away & (index % each == 0)
        jerk, section = np.gradient(acceleration, step), np.full(size, number)
        columns = speed, acceleration, jerk, position, run + runs, section, index + 1
        parts.append([values[keep] for values in columns])
        runs += int(run[-1]) + 1
    left_out = dict(zip(LEFT_OUT, left.tolist(), strict=True))
    # noise behind the filter, run twice, is independent over about this time
    rate = min(1.0, 2.0 * 0.8 * cutoff * step)
    curves = effort_curves(signals, cutoff)
    arrays = map(np.concatenate, zip(*parts, strict=True))
    noise = noise_of(variance, cutoff, step, 1 if signals.of_speed else 2)
    of_effort = white_noise([section.effort for section in signals.sections], 1, 0.0)
    rate_noise = noise_of(of_effort, cutoff, step, 1)
    return Samples._make([*arrays, each, rate, cutoff, noise, left_out, curves, step, rate_noise])


def effort_curves(signals: Signals, cutoff: float) -> list["scipy.interpolate.CubicSpline"]:
    """Filtered effort of each section over its rows."""
    efforts = [
        scipy.signal.sosfiltfilt(_filter(cutoff, signals.step), one.effort) for one in signals.sections
    ]
    return [scipy.interpolate.CubicSpline(np.arange(len(effort)), effort) for effort in efforts]
