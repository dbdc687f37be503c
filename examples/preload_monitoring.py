#!/usr/bin/env python3
"""Preload of a ball screw over its life, monitored by motor torque, speed and temperature.

    python examples/preload_monitoring.py [--plot preload_monitoring.png] [--fmu FILE.fmu]

Once per shift a batch of measurements is taken while the axis moves without load. Synthetic here: torque of
the packaged map at a random speed and temperature, then 2 % noise (standard deviation) on torque, on speed and
on the temperature in degrees Celsius, all independent. With real measurements the map must be calibrated
(`ballscrew calibrate`), and its remaining error is systematic and not part of the intervals here.

Preload of a batch: that at which the mean torque of the map over the batch equals the mean measured torque
(torque.preload_from_torque). Its interval by the delta method: with s the scatter of the relative residuals
measured/map - 1 of the reference batches at their own preload, mean torque has the variance
s^2 sum(T_i^2)/m^2, and preload that over (d mean torque / d preload)^2, from the map. s contains the noise of
all three channels, so the interval does too; student t with the degrees of freedom of s.

With --fmu the measurements of a wearing life go one by one through the FMU BallScrewPreloadMonitor as well, as in a
controller, and the preload of a batch is the mean of its outputs.

Alarm: one-sided CUSUM, S = max(0, S - z - k), z = (preload - reference)/its standard deviation, alarm at
S > h. With independent normal z and S = 0 at the start the mean number of batches to a false alarm is about
(exp(2 k b) - 2 k b - 1)/(2 k^2), b = h + 1.166 (Siegmund, Sequential Analysis, 1985), 19,000 at k = 0.5 and
h = 8; a loss of d standard deviations is detected after about (h + 1.166)/(d - k) batches. z includes the error of
the reference, which all batches share: it shifts z, so the reference takes many batches.
"""

import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from fmu_command import Parser, no_fmu, plain
from matplotlib.figure import Figure
from scipy.stats import t as student

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_tehl import load_map
from ballscrew_tehl.applications.preload import preload_from_torque
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.runtime.evaluate import NutMap

NOISE = 0.02
SIZE = 25  # measurements of a batch
REFERENCE = 100  # batches of the reference
SLACK, LIMIT = 0.5, 8.0  # k, h
BRACKET = (200.0, 10000.0)  # [N]


class Batch(NamedTuple):
    """Measured values; arrays."""

    torque: np.ndarray  # [N m]
    speed: np.ndarray  # [rad/s]
    temperature: np.ndarray  # [K]


class Estimate(NamedTuple):
    """Preload of one batch [N] and its standard deviation."""

    preload: float
    deviation: float


def map_torque(screw: NutMap, preload: Any, speed: Any, temperature: Any) -> np.ndarray:
    state = screw.evaluate(preload, speed, temperature)
    return state.friction_torque


def measure(screw: NutMap, preload: float, random: np.random.Generator, size: int = SIZE) -> Batch:
    """A batch at 100 to 2000 r/min and 20 to 45 C."""
    speed = random.uniform(100.0, 2000.0, size) * RPM
    celsius = random.uniform(20.0, 45.0, size)
    torque = map_torque(screw, preload, speed, celsius + CELSIUS)
    noisy = [column * (1.0 + NOISE * random.standard_normal(size)) for column in (torque, speed, celsius)]
    return Batch(noisy[0], noisy[1], noisy[2] + CELSIUS)


def preload_of(screw: NutMap, batch: Batch) -> float:
    """Preload [N] at which the mean torque of the map is the measured one."""

    def mean_torque(preload: float) -> float:
        return float(np.mean(map_torque(screw, preload, batch.speed, batch.temperature)))

    return preload_from_torque(mean_torque, float(np.mean(batch.torque)), *BRACKET, relative=1e-6)


def residuals(screw: NutMap, batch: Batch, preload: float) -> np.ndarray:
    """measured/map - 1 at a preload [N]."""
    return batch.torque / map_torque(screw, preload, batch.speed, batch.temperature) - 1.0


def estimate(screw: NutMap, batch: Batch, scatter: float) -> Estimate:
    """Preload and its standard deviation by the delta method, scatter: s of the head of this file."""
    preload = preload_of(screw, batch)
    step = 1e-3 * preload
    above, below = (map_torque(screw, preload + d, batch.speed, batch.temperature) for d in (step, -step))
    slope = float(np.mean(above - below)) / (2.0 * step)
    mean = 0.5 * (above + below)
    return Estimate(preload, scatter * float(np.sqrt(np.sum(mean**2))) / mean.size / slope)


def cusum(z: np.ndarray, slack: float = SLACK) -> np.ndarray:
    """S after each batch, along the last axis."""
    level = np.zeros(z.shape[:-1])
    levels = np.empty_like(z)
    for n in range(z.shape[-1]):
        level = np.maximum(0.0, level - z[..., n] - slack)
        levels[..., n] = level
    return levels


def first_alarm(levels: np.ndarray, limit: float = LIMIT) -> int | None:
    """Index of the first batch with an alarm."""
    above = np.flatnonzero(levels > limit)
    return int(above[0]) if above.size else None


def false_alarm_length(slack: float = SLACK, limit: float = LIMIT) -> float:
    """Mean number of batches to a false alarm, Siegmund's approximation."""
    b = 2.0 * slack * (limit + 1.166)
    return float((np.exp(b) - b - 1.0) / (2.0 * slack**2))


class Reference(NamedTuple):
    """Reference from the first batches of a life."""

    preload: float  # [N]
    deviation: float  # [N] of that mean
    scatter: float
    freedom: int


def reference_of(screw: NutMap, batches: list[Batch]) -> Reference:
    """Mean preload and pooled scatter; the preload of each batch costs one degree of freedom."""
    result = np.array([estimate(screw, batch, 1.0) for batch in batches])
    left = [residuals(screw, batch, preload) for batch, preload in zip(batches, result[:, 0], strict=True)]
    freedom = sum(r.size - 1 for r in left)
    scatter = float(np.sqrt(sum(float(np.sum((r - r.mean()) ** 2)) for r in left) / freedom))
    deviation = scatter * float(np.sqrt(np.sum(result[:, 1] ** 2))) / len(batches)
    return Reference(float(result[:, 0].mean()), deviation, scatter, freedom)


def life(
    screw: NutMap, true: np.ndarray, random: np.random.Generator, reference: Reference
) -> dict[str, np.ndarray]:
    """A life with these true preloads [N], one per batch: estimates, half widths of the 95 % interval, CUSUM."""
    result = np.array([estimate(screw, measure(screw, float(p), random), reference.scatter) for p in true])
    z = (result[:, 0] - reference.preload) / np.hypot(result[:, 1], reference.deviation)
    half = float(student.ppf(0.975, reference.freedom)) * result[:, 1]
    return {"true": true, "preload": result[:, 0], "half_width": half, "z": z, "cusum": cusum(z)}


def wearing(batches: int = 150, preload: float = 2000.0, healthy: int = 50, lost: float = 0.2) -> np.ndarray:
    """Preload [N], constant over the healthy batches, then falling linearly by a share that is lost."""
    return preload * (1.0 - lost * np.clip((np.arange(batches) - healthy) / (batches - healthy), 0.0, 1.0))


def main(screw: NutMap | None = None, lives: int = 8, seed: int = 1) -> dict[str, Any]:
    """Lives with and without loss of preload.

    Returns coverage: fraction of the 95 % intervals that contain the true preload; half_width_percent; detected:
    fraction of wearing lives with an alarm after the loss began; loss_at_alarm_percent: median; false_alarms: over
    `healthy_batches`; false_alarm_length: of the formula; shown: one wearing life.
    """
    screw = screw or load_map()
    random = np.random.default_rng(seed)
    course = wearing()
    healthy = int(np.argmax(course < course[0]))
    covered, deviations, losses, false_alarms, count = [], [], [], 0, 0
    shown: dict[str, np.ndarray] = {}
    for _ in range(lives):
        batches = [measure(screw, float(course[0]), random) for _ in range(REFERENCE)]
        reference = reference_of(screw, batches)
        run = life(screw, course, random, reference)
        covered.append(np.abs(run["preload"] - run["true"]) <= run["half_width"])
        deviations.append((run["preload"] - run["true"])[:healthy])
        alarm = first_alarm(run["cusum"])
        count += healthy
        if alarm is not None and alarm < healthy:
            false_alarms += 1
        elif alarm is not None:
            losses.append(100.0 * (1.0 - course[alarm] / course[0]))
        shown = shown or {**run, "reference": np.array(reference.preload)}
    half = 100.0 * float(np.mean(shown["half_width"] / shown["true"]))
    return {
        "coverage": float(np.mean(covered)), "half_width_percent": half, "scatter": reference.scatter,
        "deviation_N": float(np.std(deviations)), "detected": len(losses) / lives,
        "loss_at_alarm_percent": float(np.median(losses)) if losses else float("nan"),
        "largest_loss_at_alarm_percent": float(np.max(losses)) if losses else float("nan"),
        "false_alarms": false_alarms, "healthy_batches": count, "false_alarm_length": false_alarm_length(),
        "shown": shown,
    }  # fmt: skip


class Streamed(NamedTuple):
    """Result of the FMU for a batch."""

    preload: float  # [N] mean over the measurements in range
    deviation: float  # [N] of that mean, from the noise of torque alone
    in_range: int  # measurements


def streamed(fmu: Any, batches: list[Batch], period: float = 1.0) -> list[Streamed]:
    """Batches through BallScrewPreloadMonitor, measurement by measurement, `period` s apart."""
    result = []
    with FmuInstance(fmu) as monitor:
        for batch in batches:
            values = []
            for torque, speed, temperature in zip(*batch, strict=True):
                inputs = {"torque": torque, "speed": speed, "temperature": temperature}
                monitor.step(period, **inputs, torque_uncertainty=NOISE * abs(torque))
                if monitor.get("in_range"):
                    values.append(monitor.get("preload", "preload_half_width"))
            preload, deviation = np.array(values).T
            result.append(
                Streamed(
                    float(preload.mean()), float(np.sqrt(np.sum(deviation**2))) / len(values), len(values)
                )
            )
    return result


def compared_with_fmu(fmu: Any, screw: NutMap | None = None, seed: int = 1) -> dict[str, float]:
    """A wearing life by the mean torque of each batch and by the FMU.

    Returns difference_percent: root mean square of their difference over the preload; deviation_percent: of a batch by
    the FMU from the true preload, root mean square; stated_percent: by its half-widths.
    """
    screw = screw or load_map()
    random = np.random.default_rng(seed)
    course = wearing()
    batches = [measure(screw, float(preload), random) for preload in course]
    result = streamed(fmu, batches)
    preload = np.array([each.preload for each in result])
    by_mean = np.array([preload_of(screw, batch) for batch in batches])
    return {
        "difference_percent": 100.0 * float(np.sqrt(np.mean((preload / by_mean - 1.0) ** 2))),
        "deviation_percent": 100.0 * float(np.sqrt(np.mean((preload / course - 1.0) ** 2))),
        "stated_percent": 100.0 * float(np.mean([each.deviation / each.preload for each in result])),
        "in_range": float(sum(each.in_range for each in result)) / (SIZE * len(result)),
    }


def table(result: dict[str, Any]) -> str:
    return "\n".join(f"{name:32}{value:12.4g}" for name, value in result.items() if name != "shown")


def plot(result: dict[str, Any], path: Any) -> None:
    """One wearing life: preload with its intervals, CUSUM with its limit."""
    run = result["shown"]
    figure = Figure(figsize=(8.0, 6.4), layout="constrained")
    preload, level = panels = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    batch = np.arange(run["true"].size)
    preload.errorbar(batch, run["preload"], run["half_width"], fmt="o", ms=2.5, lw=0.8, color="#0072B2",
                     label="estimated, 95 % interval")  # fmt: skip
    preload.plot(batch, run["true"], color="#D55E00", label="true")
    level.step(batch, run["cusum"], where="mid", color="0.25")
    level.axhline(LIMIT, color="#D55E00", lw=1.0, ls="--")
    alarm = first_alarm(run["cusum"])
    if alarm is not None:
        for panel in panels:
            panel.axvline(alarm, color="0.5", lw=1.0, ls=":")
        lost = 100.0 * (1.0 - run["true"][alarm] / run["true"][0])
        level.text(alarm - 1.0, 3.0 * LIMIT, f"alarm, {lost:.1f} % lost", color="0.4", ha="right")
    preload.set(ylabel="preload [N]", title="Preload from torque, speed, temperature with 2 % noise")
    level.set(ylabel="CUSUM", xlabel="batch of 25 measurements", ylim=(0.0, 6.0 * LIMIT))
    preload.legend(frameon=False, loc="lower left")
    plain(panels)
    figure.savefig(path, dpi=110)


def command_line(arguments: list[str] | None = None) -> int:
    parser = Parser(__file__, __doc__)
    parser.add_argument("--plot", metavar="FILE.png", help="draw one life to this file")
    parser.add_argument(
        "--fmu", type=Path, help="BallScrewPreloadMonitor, FMI 2.0: run a life through it as well"
    )
    options = parser.parse_args(arguments)
    if options.fmu and (problem := no_fmu(options.fmu)):
        return parser.complain(problem)
    result = main()
    print(table(result))
    if options.fmu:
        print("\nBallScrewPreloadMonitor, a wearing life")
        print(table(compared_with_fmu(options.fmu)))
    if options.plot:
        plot(result, options.plot)
        print(options.plot)
    return 0


if __name__ == "__main__":
    sys.exit(command_line())
