"""What the rows of a log show before a fit: held, clipped, lost or slow signals, late stamps, steps, signs.

Each finding has a name, a number of rows with their share, and a remedy. Rows that can be left out or repaired are,
and its text becomes a note; where the fit is refused, the text is part of the refusal.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy

from ballscrew_tehl.numerics import Array
from ballscrew_tehl.parameters.units import CELSIUS

#: fewest equal values in a row that are no chance, with steps far below the noise, and below it; rows left out on
#: both sides of a clipped one: noise takes some of them back below the limit
HELD, HELD_STEPS, BESIDE = 8, 25, 10
#: second difference over that of the noise, and of the noise over the signal, below which a signal is a straight line
LINE = 1e-3
#: median third difference over the signal, at most, of one that was computed
QUIET = 1e-5
#: fewest rows of one value that is a code;  usual changes that a jump exceeds, and steps;  share of rows that may be
#: single jumps;  jump over the largest usual change;  changes that count as usual
CODES, CHANGES, STEPS, SPIKES, JUMP, USUAL = 3, 12.0, 2.5, 0.01, 8.0, 0.999
#: share of the largest speed from which on an axis moves;  rows that the speed is taken over
MOVES, OVER = 0.02, 10
#: fewest rows of a slow channel between its samples (two are smooth behind the filter), fewest samples, share of them
#: at whole numbers of such rows, and at one
SLOW_ROWS, SLOW_SAMPLES, IN_PHASE, FOLLOW = 3, 20, 0.95, 0.4
#: rows over which late stamps return to the even ones;  steps of time uneven by more than this share are looked at;
#: share of repeated stamps that have too few digits
WINDOW, UNEVEN, REPEATS = 200, 1e-3, 0.05
#: temperatures of the oil of an axis [K];  deviations from the median, and least one [K], that are no temperature
OIL, FAR, FAR_LEAST = (CELSIUS - 45.0, CELSIUS + 180.0), 10.0, 5.0
#: filter before the sign is looked at [s];  slowest speed there over the largest;  share of the rest that is clear
SMOOTH, SLOWEST, CLEARLY = 0.01, 0.05, 0.4


class Finding(NamedTuple):
    """What the data show: name, rows with it, their share, remedy."""

    name: str
    rows: int
    share: float
    remedy: str

    def __str__(self) -> str:
        return f"{self.name} in {self.share:.2g} of the rows ({self.rows}): {self.remedy}"


def finding(name: str, mask: np.ndarray, remedy: str) -> Finding:
    """Of the rows of a mask."""
    return Finding(name, int(mask.sum()), float(mask.mean()), remedy)


def quantum(values: Array) -> float:
    """Least step of a signal that has few values; 0: it has many."""
    steps = np.diff(np.unique(values[: 20 * 2048]))
    if len(steps) < 2:
        return 0.0
    least = float(steps[steps > 1e-9 * np.ptp(values)].min(initial=np.ptp(values)))
    # digits that are printed round each
    least = float(np.median(steps[np.round(steps / least) == 1.0]))
    whole = steps / least
    return least if float(np.mean(np.abs(whole - np.round(whole)) < 0.05)) > 0.9 else 0.0


def relative_speed(time: Array, position: Array) -> Array:
    """Speed of each row over the largest, 0 at rest."""
    over = min(OVER, len(time) // 4)
    speed = np.zeros(len(time))
    pieces = (one[2 * over :] - one[: -2 * over] for one in (position, time))
    speed[over:-over] = np.divide(*pieces)
    speed /= max(float(np.quantile(np.abs(speed), 0.99)), 1e-300)
    # not beside rows at rest, which the difference reaches
    return speed * scipy.ndimage.binary_erosion(np.abs(speed) >= MOVES, iterations=over)


def spikes(values: Array) -> np.ndarray:
    """Single samples that jump there and back."""
    limit = min(0.5 * float(np.ptp(values)), JUMP * float(np.quantile(np.abs(np.diff(values)), USUAL)))
    mask = np.abs(values - scipy.ndimage.median_filter(values, 3)) > limit
    return mask & bool(limit > 0.0 and mask.mean() <= SPIKES)


def runs(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First rows of runs of equal values, and their lengths."""
    starts = np.r_[0, np.flatnonzero(np.diff(values)) + 1]
    return starts, np.diff(np.r_[starts, len(values)])


def codes(values: Array) -> tuple[np.ndarray, float]:
    """Rows of one value that the signal jumps to and comes back from, such as 0 or that of a lost sensor; the value."""
    starts, length = runs(values)
    level = values[starts]
    jump = np.abs(np.diff(level))
    if not len(jump):
        return np.zeros(len(values), dtype=bool), 0.0
    usual, step = float(np.quantile(jump, 0.2)), quantum(values)
    limit = max(CHANGES * usual * (usual > 1.01 * step), STEPS * step)
    away = np.zeros(len(level), dtype=bool)
    away[1:-1] = (np.minimum(jump[1:], jump[:-1]) > limit) & (np.diff(level)[1:] * np.diff(level)[:-1] < 0.0)
    result, numbers = np.unique(level[away], return_counts=True)
    if not len(result) or numbers.max() < max(CODES, 0.5 * numbers.sum()):
        return np.zeros(len(values), dtype=bool), 0.0
    code = float(result[numbers.argmax()])
    at_it = away & (level == code)
    return np.repeat(at_it, length), code


def signed(name: str, values: Array) -> tuple[Array, list[Finding]]:
    """A signal without the jumps of words that overflow: 65535 for -1 without a sign, -32768 behind 32767 with one."""
    step, span, top = quantum(values), float(np.ptp(values)), float(values.max())
    jumps = np.abs(np.diff(values)) > 0.8 * span
    middle = np.abs(values - 0.5 * (top + values.min())) < 0.08 * span
    unsigned = values.min() >= 0.0
    if not (step > 0.0 and jumps.sum() >= CODES and (not unsigned or middle.mean() < SPIKES)):
        return values, []
    period = step * 2.0 ** math.ceil(math.log2(span / step + 1.0))
    if not period / step >= 256.0 or not span > 0.9 * period:
        return values, []
    if unsigned:
        above = values > 0.5 * top
        text = f"{name} is in unsigned words, negative values above {0.5 * top:.4g} (SI)"
        return np.where(above, values - period, values), [finding(text, above, f"{period:.6g} subtracted")]
    whole = np.unwrap(values, period=period)
    # the words that most rows are in have no overflow
    whole -= period * np.round(np.median(whole - values) / period)
    text = f"{name} overflows its words beyond {0.5 * period:.4g} (SI)"
    return whole, [
        finding(text, whole != values, f"joined by steps of {period:.6g}: raise the range of the channel")
    ]


def faults(name: str, values: Array, speed: Array) -> tuple[np.ndarray, list[Finding]]:
    """Rows of a signal of the drive that are not measured, and why; speed: relative."""
    result: list[Finding] = []
    bad, code = codes(values)
    if bad.any():
        to = "drops to 0" if code == 0.0 else f"has the code {code:.6g} (SI)"
        result.append(finding(f"{name} {to}", bad, "a lost or damaged value, left out"))
    single = spikes(np.where(bad, np.median(values), values)) & ~bad
    if single.any():
        result.append(finding(f"{name} jumps to single outliers", single, "left out"))
    bad = bad | single
    starts, length = runs(values)
    change, step = np.abs(np.diff(values[~bad])), quantum(values)
    usual = float(np.median(change[change > 0.0])) if np.any(change > 0.0) else 0.0
    coarse = step > 0.5 * usual
    fewest = HELD if step <= 0.1 * usual else HELD_STEPS
    fastest, slowest = np.maximum.reduceat(speed, starts), np.minimum.reduceat(speed, starts)
    # at a constant speed a coarse or quiet signal is constant
    moved = (fastest > 0.0) & (slowest < 0.0) if coarse else fastest - slowest > MOVES
    held = np.repeat((length >= fewest) & moved, length) & ~bad
    clipped = np.zeros(len(values), dtype=bool)
    mirrored = coarse and float(values[~bad].max()) == -float(values[~bad].min())
    for sign in (1.0, -1.0):
        # below its limit a signal is within its noise of it as often as at it
        signed = np.where(bad, -np.inf, sign * values)
        top = float(signed.max())
        at = signed == top
        near = int(np.sum(signed > top - max(1.01 * step, usual))) - int(at.sum())
        rows, fraction = (1e-2 * len(values), float(not mirrored)) if coarse else (2e-4 * len(values), 0.3)
        if at.sum() >= max(10, rows, fraction * near) and np.any(at & (speed != 0.0)):
            clipped |= at
    if coarse and clipped.any():
        text = f"{name}, in steps of {step:.3g} (SI), stays at its extreme"
        remedy = "if that is a limit of the drive, the true values are beyond it and the intervals do not hold them"
        result.append(finding(text, clipped, remedy))
        clipped[:] = False
    held &= ~clipped
    lines = straight(values, step) & (speed != 0.0) & ~bad & ~clipped & ~held
    if lines.any():
        text = f"{name} is a straight line over pieces of the log, as between rows that are lost"
        result.append(finding(text, lines, "left out"))
    if clipped.any():
        clipped = np.asarray(scipy.ndimage.binary_dilation(clipped, iterations=BESIDE))
        lowest, highest = float(values[clipped].min()), float(values[clipped].max())
        result.append(finding(
            f"{name} is clipped, equal to its extreme within {lowest:.4g} to {highest:.4g} (SI)", clipped,
            "left out with its neighbours; raise the range or limit of the signal, or accelerate more slowly",
        ))  # fmt: skip
    if held.any():
        longest = int(length[held[starts]].max())
        text = f"{name} is held at equal values while the axis moves, for up to {longest} rows"
        result.append(finding(text, held, "left out"))
    third = np.abs(np.diff(values, 3))[np.diff(values)[2:] != 0.0]
    size = float(np.diff(np.quantile(values[~bad], (0.05, 0.95)))[0])
    if len(third) and np.median(third) <= QUIET * size:
        remedy = "a set value, a feed-forward or an interpolated signal is no measurement: log the actual one"
        result.append(finding(f"{name} has no noise", np.ones(len(values), dtype=bool), remedy))
    return bad | clipped | held | lines, result


def straight(values: Array, step: float) -> np.ndarray:
    """Rows of straight lines in a signal that has noise elsewhere; step: its least one [SI]."""
    bend = np.abs(np.diff(values, 2))
    noise = float(np.median(bend))
    limit = max(2.1 * step, LINE * noise)
    if not noise > max(4.0 * limit * (step > 0.0), LINE * float(np.std(values))):
        return np.zeros(len(values), dtype=bool)
    line = (bend <= limit) & (np.abs(np.diff(values)[1:]) > limit)
    starts, length = runs(line)
    line = np.repeat(line[starts] & (length >= HELD_STEPS), length)
    return np.asarray(scipy.ndimage.binary_dilation(np.r_[False, line, False]))


def sensor(name: str, values: Array) -> tuple[float | None, list[Finding]]:
    """Mean of a temperature [K] or preload [N] without codes of a lost sensor; None: it has no values."""
    good = np.isfinite(values)
    if name == "temperature":
        good &= (values >= OIL[0]) & (values <= OIL[1])
    if good.any():
        middle = float(np.median(values[good]))
        spread = float(np.median(np.abs(values[good] - middle)))
        least = FAR_LEAST if name == "temperature" else 0.02 * abs(middle)
        good &= ~(np.abs(values - middle) > max(FAR * spread, least))
    bad, mean = np.isfinite(values) & ~good, float(np.mean(values[good])) if good.any() else None
    if not bad.any():
        return mean, []
    worst = float(values[bad][np.argmax(np.abs(values[bad]))])
    shown = f"{worst - CELSIUS:.6g} C" if name == "temperature" else f"{worst:.6g} N"
    text = f"{name} has values of no {name}, as {shown}"
    return mean, [finding(text, bad, "left out")]


def slow_rows(name: str, values: Array) -> tuple[np.ndarray, int, str]:
    """Rows at which a channel that is slower than the log is sampled, rows between them (1: none), and how an export
    fills these: the same value, or straight lines.

    The changes of a slow channel are a whole number of rows apart; those of a coarse encoder are not.
    """
    bend = np.abs(np.diff(values, 2))
    tiny = max(1e-3 * float(np.quantile(bend, 0.995)), 1e-6 * float(np.quantile(np.abs(values), 0.99)))
    for places, text in (
        (np.flatnonzero(np.diff(values)) + 1, "repeats each value in"),
        (np.flatnonzero(bend > tiny) + 1, "is interpolated by straight lines over"),
    ):
        apart = np.diff(places)
        if len(apart) < SLOW_SAMPLES or len(places) > len(values) / 2:
            continue
        rows = int(np.bincount(apart).argmax())
        if rows >= SLOW_ROWS and np.mean(apart % rows == 0) >= IN_PHASE and np.mean(apart == rows) >= FOLLOW:
            ends = np.r_[places[0] % rows, places, len(values)]
            keep = np.concatenate([np.arange(one, other, rows) for one, other in pairwise(ends.tolist())])
            return keep, rows, f"{name} {text} {rows} rows"
    return np.arange(len(values)), 1, ""


def even_stamps(time: Array, motion: Array) -> tuple[Array, float, list[Finding]]:
    """Times of evenly taken samples whose stamps are late, rounded or in bursts; the step; else the stamps.

    Rows that are lost move all later stamps, so that the least delay within a window counts them. The samples are
    taken as even if the motion is then as smooth over time as over the stamps.
    """
    number, steps, lag = len(time), np.diff(time), min(1000, len(time) // 4)
    long, short = (time[rows:] - time[:-rows] for rows in (lag, min(30, lag)))
    usual = float(np.median(long)) / lag
    inside = steps[steps <= 4.5 * usual]
    if np.ptp(inside) <= UNEVEN * usual and steps.min() > 0.0 and np.mean(inside) > 0.5 * usual:
        return time, float(np.mean(inside)), []

    def roughness(at: Array) -> float:
        span = np.maximum(at[2:] - at[:-2], 1e-3 * usual)
        between = motion[:-2] + (motion[2:] - motion[:-2]) * np.clip((at[1:-1] - at[:-2]) / span, 0.0, 1.0)
        remainder = np.abs(motion[1:-1] - between)
        return float(np.mean(np.minimum(remainder, np.quantile(remainder, 0.99)) ** 2))

    best, even, raster = np.inf, time, usual
    slopes = float(np.quantile(long, 0.1)) / lag, float(np.polyfit(np.arange(number), time, 1)[0])
    for step in (usual, float(np.median(steps)), float(np.median(short)) / min(30, lag), *slopes):
        if not step > 0.05 * usual:
            continue
        late = time - step * np.arange(number)
        least = scipy.ndimage.minimum_filter1d(late, WINDOW, origin=-(WINDOW // 2), mode="nearest")
        lost = np.maximum(np.round(np.diff(least, prepend=least[0]) / step), 0.0)
        lost[-WINDOW // 4 :] *= steps[-WINDOW // 4 :] > 4.5 * usual
        place = np.arange(number) + np.cumsum(lost)
        slope, start = np.polyfit(place, time, 1)
        if (rough := roughness(start + slope * place)) < best:
            best, even, raster = rough, start + slope * place, float(slope)
    repeats = float(np.mean(steps <= 0.0)) > REPEATS
    if not best <= (1.1 if repeats else 0.98) * roughness(time):
        return time, float(np.median(steps[steps > 0.0])), []
    off = np.abs(time - even - np.median(time - even))
    text = f"time stamps jitter about an even raster of {raster:.6g} s, by up to {off.max():.3g} s"
    return even, raster, [finding(text, off > 0.05 * raster, "taken as evenly sampled")]


def motoring(
    name: str, pieces: list[tuple[Array, Array]], step: float, of_speed: bool
) -> tuple[list[tuple[Array, Array]], list[Finding]]:
    """Pieces with an effort that is positive towards positive positions, where it is positive when it drives.

    Inertia, friction and offset then explain its product with the sign of the speed better than itself.
    """
    over, columns = SMOOTH / step, []
    for motion, effort in pieces:
        speed = motion if of_speed else np.gradient(motion, step)
        smooth = scipy.ndimage.gaussian_filter1d(speed, over)
        both = [scipy.ndimage.gaussian_filter1d(one, over) for one in (effort, effort * np.sign(smooth))]
        columns.append([np.gradient(smooth, step), np.sign(smooth), smooth, np.ones(len(smooth)), *both])
    every = np.concatenate(columns, axis=1)
    moves = np.abs(every[2]) > SLOWEST * np.quantile(np.abs(every[2]), 0.99)
    model = every[:4, moves].T / np.maximum(np.abs(every[:4, moves]).max(axis=1), 1e-300)
    fits = [values - model @ np.linalg.lstsq(model, values, rcond=None)[0] for values in every[4:, moves]]
    as_it_is, turned = (float(np.sum(remainder**2)) for remainder in fits)
    if not (turned < CLEARLY * as_it_is and every[4, moves].min() < 0.0 < every[4, moves].max()):
        return pieces, []
    text = f"{name} is positive when it drives, in both directions: a sign of the power, not of the axis"
    result = finding(text, every[2] < 0.0, "its sign is changed where the speed is negative")
    signs = [np.where(piece[2] < 0.0, -1.0, 1.0) for piece in columns]
    return [(x, y * sign) for (x, y), sign in zip(pieces, signs, strict=True)], [result]


def of_refusal(found: Sequence[Finding]) -> str:
    """Findings as the end of a refusal."""
    return "".join(f"; found in the data: {one}" for one in found)
