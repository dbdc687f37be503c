#!/usr/bin/env python3
"""Error and stability of the explicit coupling of the friction FMU with a rotor, over the step size.

    python examples/step_size_study.py [--fmu dist/BallScrewFrictionNative_fmi2.fmu] [--plot step_size_study.png]

Rotor: J dw/dt = motor torque - friction torque, solved exactly with both torques held over the step h. The FMU
steps with the speed of the rotor at the start of the step and returns the torque at its end.

    parallel    both step with the values of the last communication point (Jacobi)
    sequential  friction first, the rotor with its torque of the same step (Gauss-Seidel)

Accuracy: a swing with two reversals under a sine of motor torque. Error: largest difference of the speed from a
run with a 16th of the smallest step. Explicit coupling is of first order with either law and master, as long as
the step resolves the law: h well below 2 J w_s/T_C for the regularised sign, and with presliding w h below the
travel 2 T_C/s0 in which all elasto-slip elements come to slide from rest.

Stability while all elements stick (together stiffness s0, damping s1), with a = h^2 s0/J, b = h s1/J:

    parallel    a < b (1 - b)       sequential  a < 4 - 2 b (b <= 1)

They are the conditions under which all roots of the recursion of one step lie inside the unit circle; main()
finds the limit by bisection with the FMU itself, from an initial speed far too small to slide.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from fmu_command import plain, run_with_fmu
from matplotlib.figure import Figure

from ballscrew_fmu.checks.replay import FmuInstance

FMU = Path(__file__).resolve().parents[1] / "dist" / "BallScrewFrictionNative_fmi2.fmu"
INERTIA = 0.01  # [kg m2]
PRELOAD, TEMPERATURE = 2000.0, 303.15
LAWS = {
    "tanh": {"presliding": False, "regularization_speed": 0.5},
    "presliding": {"presliding_stiffness": 100.0, "presliding_damping": 0.1},
}
MASTERS = ("parallel", "sequential")
AMPLITUDE, FREQUENCY, TIME = 1.5, 2.0, 0.75  # [N m], [Hz], [s] of the motor torque
STEPS = tuple(2.0**-n for n in (9, 10, 11, 12))  # [s]


class Pair:
    """The FMU and a rotor at rest."""

    def __init__(self, fmu: Path | str, law: dict[str, float], inertia: float = INERTIA) -> None:
        self.friction = FmuInstance(fmu, preload=PRELOAD, temperature=TEMPERATURE, **law)
        self.inertia, self.speed, self.angle, self.torque = inertia, 0.0, 0.0, 0.0
        self._speed = [self.friction.references["speed"]]
        self._torque = [self.friction.references["friction_torque"]]

    def step(self, h: float, motor_torque: float, parallel: bool) -> None:
        slave, old = self.friction.slave, self.torque
        slave.setReal(self._speed, [self.speed])
        slave.doStep(currentCommunicationPoint=self.friction.time, communicationStepSize=h)
        self.friction.time += h
        self.torque = slave.getReal(self._torque)[0]
        gain = h * (motor_torque - (old if parallel else self.torque)) / self.inertia
        self.angle += h * (self.speed + 0.5 * gain)
        self.speed += gain

    def __enter__(self) -> "Pair":
        return self

    def __exit__(self, *_: object) -> None:
        self.friction.close()


def swing(fmu: Path | str, law: str, master: str, h: float, every: int) -> np.ndarray:
    """Speed [rad/s] after every so many steps; the motor torque is the mean of the sine over the step."""
    rate, n = 2.0 * np.pi * FREQUENCY, round(TIME / h)
    times = h * np.arange(n + 1)
    torques = -AMPLITUDE * np.diff(np.cos(rate * times)) / (rate * h)
    result = []
    with Pair(fmu, LAWS[law]) as pair:
        for i, torque in enumerate(torques, start=1):
            pair.step(h, float(torque), master == "parallel")
            if i % every == 0:
                result.append(pair.speed)
    return np.array(result)


def errors(
    fmu: Path | str, steps: tuple[float, ...]
) -> tuple[dict[tuple[str, str], np.ndarray], dict[str, np.ndarray]]:
    """Largest error of the speed [rad/s] by (law, master) over the steps, and the reference runs by law."""
    finest = steps[-1] / 16.0
    exact = {law: swing(fmu, law, "sequential", finest, round(steps[0] / finest)) for law in LAWS}
    result = {}
    for law in LAWS:
        for master in MASTERS:
            runs = [swing(fmu, law, master, h, round(steps[0] / h)) for h in steps]
            result[law, master] = np.array([np.abs(run - exact[law]).max() for run in runs])
    return result, exact


def order(steps: tuple[float, ...], error: np.ndarray) -> float:
    """Slope of the error over the step in logarithms."""
    return float(np.polyfit(np.log(steps), np.log(error), 1)[0])


def grows(fmu: Path | str, a: float, b: float, master: str) -> bool:
    """Whether a small initial speed of the rotor grows while all elements stick."""
    h = 1e-3
    law = {"presliding_stiffness": a * INERTIA / h**2, "presliding_damping": b * INERTIA / h}
    with Pair(fmu, law) as pair:
        pair.speed = 1e-9
        sizes = []
        for _ in range(600):
            pair.step(h, 0.0, master == "parallel")
            sizes.append(abs(pair.speed) + abs(pair.torque) * h / INERTIA)
        # beyond a factor 1e4 it slides and does not grow any more
        return max(sizes) > 1e4 * sizes[0] or max(sizes[-100:]) > max(sizes[200:300])


def border(fmu: Path | str, b: float, master: str) -> float:
    """a at which the coupling turns unstable, by bisection to 1 %."""
    stable, unstable = 1e-3, 6.0
    while unstable > 1.01 * stable:
        a = float(np.sqrt(stable * unstable))
        if grows(fmu, a, b, master):
            unstable = a
        else:
            stable = a
    return float(np.sqrt(stable * unstable))


def limit(b: float, master: str) -> float:
    """The closed form in the docstring of this file."""
    return b * (1.0 - b) if master == "parallel" else 4.0 - 2.0 * b


def main(
    fmu: Path | str = FMU, steps: tuple[float, ...] = STEPS, damping: tuple[float, ...] = (0.2, 0.5, 0.8)
) -> dict[str, Any]:
    """Errors, fitted orders and stability borders.

    Returns steps; errors, orders: by (law, master); exact: reference speeds by law; borders, limits: by master over
    the b of `damping`, by the FMU and in closed form.
    """
    result, exact = errors(fmu, steps)
    return {
        "steps": steps, "errors": result, "exact": exact, "damping": damping,
        "orders": {key: order(steps, value) for key, value in result.items()},
        "borders": {m: [border(fmu, b, m) for b in damping] for m in MASTERS},
        "limits": {m: [limit(b, m) for b in damping] for m in MASTERS},
    }  # fmt: skip


def table(result: dict[str, Any]) -> str:
    lines = [
        f"{'error [rad/s] at h =':24}" + "".join(f"{1e3 * h:9.3f} ms" for h in result["steps"]) + "   order"
    ]
    for (law, master), values in result["errors"].items():
        cells = "".join(f"{value:12.2e}" for value in values)
        lines.append(f"{law + ', ' + master:24}{cells}{result['orders'][law, master]:8.2f}")
    for master in MASTERS:
        for b, found, target in zip(
            result["damping"], result["borders"][master], result["limits"][master], strict=True
        ):
            lines.append(f"{master:12} b = {b:.2f}: unstable from a = {found:.4f}, closed form {target:.4f}")
    return "\n".join(lines)


def plot(result: dict[str, Any], path: Path | str) -> None:
    """Error over the step, and the borders of stability."""
    figure = Figure(figsize=(11.0, 4.6), layout="constrained")
    left, right = panels = figure.subplots(1, 2)
    milliseconds = 1e3 * np.array(result["steps"])
    for (law, master), values in result["errors"].items():
        color = "#D55E00" if law == "tanh" else "#009E73"
        dash = "-" if master == "parallel" else "--"
        left.loglog(milliseconds, values, dash, marker="o", ms=4, color=color,
                    label=f"{law}, {master}, order {result['orders'][law, master]:.2f}")  # fmt: skip
    left.set(
        title="Swing with two reversals", xlabel="step [ms]", ylabel="largest error of the speed [rad/s]"
    )
    left.set_xticks(milliseconds, [f"{h:.3g}" for h in milliseconds])
    left.minorticks_off()
    b = np.linspace(0.0, 1.0, 101)
    for master, color in zip(MASTERS, ("#0072B2", "#CC79A7"), strict=True):
        right.plot(b, limit(b, master), color=color, label=f"{master}: closed form")
        right.plot(result["damping"], result["borders"][master], "o", color=color, label="found with the FMU")
    right.set(title="Presliding: stable below", xlabel="b = h s1/J", ylabel="a = h\u00b2 s0/J", yscale="log",
              ylim=(0.03, 10.0), xlim=(0.0, 1.0))  # fmt: skip
    plain(panels)
    for panel in panels:
        panel.legend(frameon=False, fontsize=9)
    figure.savefig(path, dpi=110)


def command_line(arguments: list[str] | None = None) -> int:
    return run_with_fmu(arguments, __file__, __doc__, FMU, main, table, plot)


if __name__ == "__main__":
    sys.exit(command_line())
