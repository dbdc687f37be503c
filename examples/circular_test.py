#!/usr/bin/env python3
"""Circular test of two equal servo axes: the quadrant glitch due to the friction of the ball screw.

    python examples/circular_test.py [--fmu dist/BallScrewFriction.fmu] [--plot circular_test.png]

Any FMI 2.0 FMU of this project can be used: --fmu dist/BallScrewFrictionNative_fmi2.fmu runs the native one.

The axis of servo_axis.py follows a sine, as each axis does on a circle without cutting. The second axis is the
same a quarter turn later, so that one run gives the whole path; the first half turn, from rest, is left out.
Outward deviation of the path from the circle, over the angle from the reversal of one axis:

    deviation = -(error of the reversing axis in its direction outward) - (the same of the other axis)

The result has the known shape of circular tests of machine tools, the quadrant glitch (caused by friction, its height
depends on friction parameters, radius and feed: Proc. JSME LEM21 2003, paper 519, abstract): a sharp outward peak
just after each change of quadrant, which decays within some degrees. Cause in this model: at the reversal the
friction torque swings by twice the Coulomb torque. To the loop that is nearly a step of disturbance. Its response
rises within the time of the speed loop and decays with that of the position loop, exp(-position_gain t), so that in
angle the tail is as long as feed / (radius position_gain).
With presliding the elasto-slip elements spring back first, and all slide the other way after a travel of the table
s = 4 T_C/s0 lead/(2 pi) of 23 um (Coulomb torque T_C, presliding stiffness s0). The torque follows the travel: the
peak comes later, by about half of the angle arccos(1 - s/radius) in which the table covers it, and is 4 to 9 %
lower. Without presliding the torque of the regularised sign falls already
before the reversal, more so at slow feed: an effect of the law, not of the screw. The model has neither backlash nor
other friction.
"""

import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from fmu_command import plain, run_with_fmu
from matplotlib.figure import Figure
from servo_axis import FMU, STYLES, Axis, FrictionFmu, Run, circle, simulate

RADIUS = 10e-3  # [m]
FEEDS = (0.01, 0.02, 0.04)  # [m/s] along the path
FEED = 0.02  # [m/s] of the polar diagram
CASES = ("without", "with", "presliding")
BEFORE = 0.1  # [rad] shown before a reversal


class Glitch(NamedTuple):
    """The peak after one reversal."""

    height: float  # [m] outward, over the deviation BEFORE the reversal
    angle: float  # [rad] from the reversal to the peak
    onset: float  # [rad] from the reversal to a fifth of the peak
    width: float  # [rad] where it is above half its height
    decay: float  # [rad] in which the tail falls to 1/e, fitted from 60 % to 20 % of the height


def one_run(fmu: Path | str, axis: Axis, feed: float, case: str) -> Run:
    """An axis from rest over one and a quarter turns."""
    motion, _ = circle(axis, RADIUS, feed, cutting_force=0.0, after=1.5 * np.pi * RADIUS / feed)
    if case == "without":
        return simulate(axis, motion)
    with FrictionFmu(fmu, axis, case == "presliding") as friction:
        return simulate(axis, motion, friction)


def deviation(run: Run, feed: float) -> tuple[np.ndarray, np.ndarray]:
    """Angle from a reversal [rad], half a turn from BEFORE it on, and outward deviation [m].

    The position of the axis is -radius cos(angle) about the centre; that of the other, which is a quarter turn
    behind, -radius cos(angle - pi/2). Half a turn later every error has the other sign.
    """
    angle = run.motion.time * feed / RADIUS
    first, last = np.searchsorted(angle, (np.pi - BEFORE, 2.0 * np.pi - BEFORE))
    here = angle[first:last]
    reversing = run.error[first:last]
    other = -np.interp(here + 0.5 * np.pi, angle, run.error)  # = error at angle - pi/2
    return here - np.pi, reversing * np.cos(here) + other * np.sin(here)


def glitch(angle: np.ndarray, outward: np.ndarray) -> Glitch:
    """The peak between the reversal at 0 and 1 rad after it."""
    base = float(outward[0])
    near = (angle > -BEFORE) & (angle < 1.0)
    x, y = angle[near], outward[near] - base
    top = int(np.argmax(y))
    height = float(y[top])
    rising = np.flatnonzero(y[:top] < 0.2 * height)
    onset = float(x[rising[-1] + 1]) if rising.size else float(x[0])
    half = np.flatnonzero(y > 0.5 * height)
    tail = np.arange(y.size) > top
    settled = float(np.mean(y[x > 0.8]))
    part = tail & (y - settled < 0.6 * (height - settled)) & (y - settled > 0.2 * (height - settled))
    slope = np.polyfit(x[part], np.log(y[part] - settled), 1)[0] if part.sum() > 5 else float("nan")
    return Glitch(height, float(x[top]), onset, float(x[half[-1]] - x[half[0]]), float(-1.0 / slope))


def presliding_angle(axis: Axis, coulomb: float) -> float:
    """Angle [rad] from a reversal to sliding the other way at this Coulomb torque [N m]: geometry alone."""
    travel = axis.ratio * 4.0 * coulomb / axis.presliding_stiffness
    return float(np.arccos(1.0 - travel / RADIUS))


def main(fmu: Path | str = FMU, axis: Axis | None = None, feeds: tuple[float, ...] = FEEDS) -> dict[str, Any]:
    """Height, angle and shape of the glitch for each feed [m/s] and case.

    Returns peak_um_<case>, peak_deg_<case>, onset_deg_<case>, width_deg_<case>, decay_deg_<case>: tuples over the
    feeds; presliding_deg, tail_deg: angles of the closed forms in the head of the file; curves: (angle, outward) by
    (case, feed); runs by the same; in_range.
    """
    axis = axis or Axis()
    result: dict[str, Any] = {"axis": axis, "feeds": feeds, "curves": {}, "runs": {}}
    for case in CASES:
        found = []
        for feed in feeds:
            run = one_run(fmu, axis, feed, case)
            curve = deviation(run, feed)
            result["runs"][case, feed], result["curves"][case, feed] = run, curve
            found.append(glitch(*curve))
        result[f"peak_um_{case}"] = tuple(1e6 * g.height for g in found)
        for name in ("angle", "onset", "width", "decay"):
            key = "peak" if name == "angle" else name
            result[f"{key}_deg_{case}"] = tuple(float(np.degrees(getattr(g, name))) for g in found)
    coulomb = coulomb_torque(result["runs"]["presliding", feeds[0]])
    result["coulomb_torque_Nm"] = coulomb
    result["presliding_deg"] = float(np.degrees(presliding_angle(axis, coulomb)))
    result["tail_deg"] = tuple(float(np.degrees(feed / RADIUS / axis.position_gain)) for feed in feeds)
    result["in_range"] = all(run.in_range for run in result["runs"].values())
    return result


def coulomb_torque(run: Run) -> float:
    """Torque at the turning point [N m], where the speed is 0 and all elements are at their share of the torque."""
    return float(abs(run.friction_torque[int(np.argmax(run.angle))]))


def table(result: dict[str, Any]) -> str:
    """The numbers of main(), one line per feed and case."""
    names = ("peak_um", "peak_deg", "onset_deg", "width_deg", "decay_deg")
    lines = [f"{'feed m/min':>10} {'friction':>11}" + "".join(f"{name:>11}" for name in names)]
    for i, feed in enumerate(result["feeds"]):
        for case in CASES:
            values = "".join(f"{result[f'{name}_{case}'][i]:11.2f}" for name in names)
            lines.append(f"{60.0 * feed:10.1f} {case:>11}{values}")
    lines.append(f"closed forms: presliding {result['presliding_deg']:.2f} deg, tail at these feeds "
                 + ", ".join(f"{angle:.2f}" for angle in result["tail_deg"]) + " deg")  # fmt: skip
    return "\n".join(lines)


def plot(result: dict[str, Any], path: Path | str) -> None:
    """Draw the result of main(): path of a circle, its deviation enlarged, and the glitch over the angle."""
    figure = Figure(figsize=(12.0, 5.4), layout="constrained")
    polar = figure.add_subplot(1, 2, 1, projection="polar")
    panel = figure.add_subplot(1, 2, 2)
    feed = min(result["feeds"], key=lambda f: abs(f - FEED))
    for case in CASES:
        angle, outward = result["curves"][case, feed]
        for quadrant in range(4):  # both axes reverse alike, in both directions
            part = angle < 0.5 * np.pi - BEFORE
            polar.plot(angle[part] + 0.5 * np.pi * quadrant, 20.0 + 1e6 * outward[part],
                       color=STYLES[case]["color"], lw=1.4)  # fmt: skip
        for f, dash in zip(result["feeds"], (":", "-", "--"), strict=False):
            angle, outward = result["curves"][case, f]
            label = STYLES[case]["label"] if f == feed else None
            panel.plot(np.degrees(angle), 1e6 * outward, dash, color=STYLES[case]["color"], label=label)
    polar.set(ylim=(0.0, 38.0), yticks=[10.0, 20.0, 30.0], yticklabels=["-10", "0", "10 \u00b5m"])
    polar.set_rlabel_position(67.5)
    polar.set_title(f"Deviation outward, {1e3 * RADIUS:g} mm radius, {60.0 * feed:g} m/min")
    feeds = ", ".join(f"{60.0 * f:g}" for f in result["feeds"])
    panel.set_title(f"Quadrant glitch at {feeds} m/min (dotted, solid, dashed)")
    panel.set(xlabel="angle past the reversal [deg]", ylabel="deviation outward [\u00b5m]", xlim=(-5.0, 40.0))
    plain([panel])
    panel.legend(frameon=False)
    figure.savefig(path, dpi=110)


def command_line(arguments: list[str] | None = None) -> int:
    return run_with_fmu(arguments, __file__, __doc__, FMU, main, table, plot)


if __name__ == "__main__":
    sys.exit(command_line())
