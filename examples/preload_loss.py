#!/usr/bin/env python3
"""A real loss of preload: the drag torques of two ball screws over 1015 h, as preload with its interval and an alarm.

    python examples/preload_loss.py [--plot preload_loss.png]

Data: degradation rig of Xi'an Jiaotong University, two new double nuts of lead 8 mm, preload 1500 N, a torque of each
every 35 h. The first torque calibrates the one number of the law at 1500 N, as `calibrate --torque-nm` does; the others
give a preload with its interval each, as the FMU BallScrewPreloadMonitor does in a controller.

Interval: about 80 %. Of the change since the first reading: both readings scatter, by the mean square of successive
differences of the series, which a slow loss hardly enters; law_uncertainty is 0. Of the preload itself: the interval of
the calibrated law, too. Alarm: the whole interval of the change lies below 90 % of the first preload.

What the series cannot tell. Diameter, balls, oil and its temperature are not published, the speed is probably 100
r/min: the packaged GD4008-3 with ISO VG 100 at 30 C stands for both (lead 8 mm as well); `other_screws` has the effect
of that. Torque alone does not separate wear of balls and grooves, which relieves the preload, from surfaces that run
in, seals that wear, or grease that ages or warms: each lowers the torque at the same preload. A stiffness or the lost
motion, measured at the same time, would separate them.
"""

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
from fmu_command import plain, run_and_plot
from matplotlib.figure import Figure

from ballscrew_tehl import load_map, load_screw
from ballscrew_tehl.applications.calibration.measured import calibrate_point
from ballscrew_tehl.applications.calibration.measurements import Measurement
from ballscrew_tehl.applications.preload import preload_from_torque
from ballscrew_tehl.atlas.ball_contacts import BallContacts
from ballscrew_tehl.friction.interval import DEVIATIONS
from ballscrew_tehl.friction.mechanistic import double_nut_parts
from ballscrew_tehl.nut_map.interval import map_interval
from ballscrew_tehl.parameters.file import PACKAGED_VG100
from ballscrew_tehl.parameters.units import CELSIUS, RPM

sys.path.append(str(Path(__file__).resolve().parent / "paper"))
from rig import RIG_PRELOAD, RIG_SPEED, rig_screw, rig_series

SPEED, TEMPERATURE = RIG_SPEED * RPM, 30.0 + CELSIUS
KEPT = 0.9  # share of the first preload below which the whole interval must lie for an alarm
SCREWS = ("upper", "lower")
COLOURS = ("#0072B2", "#D55E00")
#: screws that those of the rig could be: diameters of screw and balls [mm], ISO VG
OTHERS = ((32.0, 4.763, 68), (32.0, 6.35, 220), (40.0, 6.35, 32))


def scatter(torque: np.ndarray) -> float:
    """Relative standard deviation of a reading, by successive differences."""
    return float(np.sqrt(0.5 * np.mean(np.diff(np.log(torque)) ** 2)))


def monitored(torque: np.ndarray) -> dict[str, Any]:
    """One screw: preload of each reading; low, high: of the change, law_low, law_high: with the law."""
    parameters = load_screw(PACKAGED_VG100)
    point = Measurement(RIG_PRELOAD, SPEED, TEMPERATURE, float(torque[0]))
    fitted = calibrate_point(point, parameters, BallContacts(parameters)).friction_set
    nut_map = load_map(None, parameters, fitted)
    low, high = map_interval(
        parameters, nut_map.header["axes"], fitted, RIG_PRELOAD, SPEED, TEMPERATURE
    ).relative
    noise = DEVIATIONS * math.sqrt(2.0) * scatter(torque)
    ends = nut_map.header["axes"]["preload"][:2]

    def torque_at(preload: Any) -> Any:
        return nut_map.evaluate(preload, SPEED, TEMPERATURE).friction_torque

    preload = np.array([preload_from_torque(torque_at, reading, *ends, 1e-9) for reading in torque.tolist()])
    slope = (torque_at(1.0001 * preload) - torque_at(0.9999 * preload)) / (2e-4 * preload)
    result = {"preload": preload}
    for law, prefix in ((0.0, ""), (0.5 * (high - low), "law_")):
        half = math.hypot(noise, law) * torque / slope
        result |= {f"{prefix}low": preload - half, f"{prefix}high": preload + half}
    colder = float(nut_map.evaluate(RIG_PRELOAD, SPEED, TEMPERATURE - 10.0).friction_torque) / torque[0]
    return result | {"torque": torque, "scatter": scatter(torque), "colder": colder - 1.0}


def other_screws(torque: np.ndarray) -> list[float]:
    """Last preload [N] with other screws, each calibrated on the first torque."""
    result = []
    for other in OTHERS:
        parameters = rig_screw(*other)
        contacts = BallContacts(parameters)
        point = Measurement(RIG_PRELOAD, SPEED, TEMPERATURE, float(torque[0]))
        number = calibrate_point(point, parameters, contacts).friction_set.net_sliding_coefficient

        def at(
            preload: float, parameters: Any = parameters, contacts: Any = contacts, k: float = number
        ) -> float:
            return double_nut_parts(parameters, [preload] * 2, contacts, SPEED, TEMPERATURE, 1.0, k).total

        result.append(preload_from_torque(at, float(torque[-1]), 300.0, 2000.0, 1e-3))
    return result


def main() -> dict[str, Any]:
    """Both screws.

    Returns hours; upper, lower: as `monitored`, with `alarm`, hour of the first alarm or None, and `others`, last
    preloads with other screws.
    """
    series = rig_series()
    hours = series.hours.to_numpy(float)
    result: dict[str, Any] = {"hours": hours}
    for name in SCREWS:
        torque = series[f"{name}_Nm"].to_numpy()
        found = monitored(torque)
        below = np.flatnonzero(found["high"] < KEPT * RIG_PRELOAD)
        found |= {"alarm": float(hours[below[0]]) if below.size else None, "others": other_screws(torque)}
        result[name] = found
    return result


def table(result: dict[str, Any]) -> str:
    lines = []
    for name in SCREWS:
        found = result[name]
        last = {key: values[-1] for key, values in found.items() if key in ("preload", "low", "high")}
        others = ", ".join(f"{preload:.0f}" for preload in found["others"])
        lines += [
            f"{name} screw: torque {found['torque'][0]:.3f} to {found['torque'][-1]:.3f} N m, a reading scatters by "
            f"{100.0 * found['scatter']:.1f} %",
            f"  preload after {result['hours'][-1]:.0f} h {last['preload']:.0f} N, as a change since the first reading "
            f"{last['low']:.0f} to {last['high']:.0f} N, of the law {found['law_low'][-1]:.0f} to "
            f"{found['law_high'][-1]:.0f} N; with other screws {others} N",
            f"  alarm at {found['alarm']:.0f} h" if found["alarm"] is not None else "  no alarm",
            f"  oil 10 K colder at the same preload: torque {100.0 * found['colder']:+.1f} %",
        ]  # fmt: skip
    return "\n".join(lines)


def plot(result: dict[str, Any], path: Path | str) -> None:
    """Preload over hours with both intervals and the alarm, one panel a screw."""
    figure = Figure(figsize=(9.0, 4.6), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    plain(panels)
    hours = result["hours"]
    for panel, name, colour in zip(panels, SCREWS, COLOURS, strict=True):
        found = result[name]
        of_preload, of_change = (f"80 % interval of the {what}" for what in ("preload", "change"))
        panel.fill_between(hours, found["law_low"], found["law_high"], color="0.9", lw=0, label=of_preload)
        panel.fill_between(
            hours, found["low"], found["high"], color=colour, alpha=0.25, lw=0, label=of_change
        )
        panel.plot(
            hours, found["preload"], "o-", color=colour, ms=3.0, lw=1.0, label="preload by the monitor"
        )
        panel.axhline(KEPT * RIG_PRELOAD, color="0.4", lw=1.0, ls="--")
        if found["alarm"] is not None:
            panel.axvline(found["alarm"], color="0.4", lw=1.0, ls=":")
            panel.text(found["alarm"] + 15.0, 1790.0, f"alarm at {found['alarm']:.0f} h", color="0.3")
        panel.set(title=f"{name} screw", xlabel="hours", ylim=(400.0, 1900.0), xlim=(0.0, hours[-1]))
        panel.legend(frameon=False, loc="lower left")
    panels[0].set_ylabel("preload [N]")
    panels[1].text(hours[-1], KEPT * RIG_PRELOAD + 10.0, "90 % of the first", color="0.4", ha="right")
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    run_and_plot(__file__, __doc__, main, table, plot)
