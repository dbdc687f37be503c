#!/usr/bin/env python3
"""The native FMU in model exchange with a rotor, in CVode: reversals with presliding, compared with co-simulation.

    python examples/model_exchange.py [--fmu dist/BallScrewFrictionNative_fmi2.fmu] [--plot model_exchange.png]

States: speed and angle of a rotor, J dw/dt = amplitude sin(2 pi f t) - friction_torque, and the elasto-slip
elements, the continuous states of the FMU. fmpy's CVode solver calls functions of this file, which set
time, speed and elements before each evaluation. (fmpy.simulate_fmu is not suitable: it sets continuous inputs at
communication points and in the root function, not in the right-hand side of CVode. An input that changes
in between would need input events.)

Events. The FMU has an indicator of in_range, one of the stiffness of the elements, which is set and constant here, and
one of each element. From rest element i (1 to n) follows the motion up to the travel x_m (i - 1/2)/n with
x_m = 2 T_C/presliding_stiffness (Coulomb torque T_C), then slides. When the speed reverses, all that slide stick
again at once, and slide the other way after twice that travel. At a root the FMU enters event mode, newDiscreteStates
is called until no more are needed, and the solver restarts.

Co-simulation, friction first, converges to model exchange with the first order of explicit coupling.
presliding_damping, needed for explicit coupling only, is next to nothing (0 would be that from the screw).
"""

import ctypes
import shutil
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Model
from fmpy.sundials import CVodeSolver
from fmu_command import plain, run_with_fmu
from matplotlib.figure import Figure

from ballscrew_fmu.checks.replay import FmuInstance

FMU = Path(__file__).resolve().parents[1] / "dist" / "BallScrewFrictionNative_fmi2.fmu"
INERTIA, AMPLITUDE, FREQUENCY = 0.01, 1.5, 2.0  # [kg m2], [N m], [Hz]
TIME, INTERVAL = 1.0, 2.0**-9  # [s]
START = {"preload": 2000.0, "temperature": 303.15, "presliding_stiffness": 100.0, "presliding_damping": 1e-9}
STEPS = tuple(2.0**-n for n in (10, 11, 12, 13, 14, 15))  # [s] of co-simulation


class Event(NamedTuple):
    time: float  # [s]
    kind: str  # slip: elements begin to slide; stick: they follow again; other: neither
    elements: tuple[int, ...]  # that change, from 0
    speed: float  # [rad/s]
    angle: float  # [rad]
    torque: float  # [N m]


class FrictionModel:
    """The FMU in model exchange; use it in a `with` block."""

    def __init__(self, fmu: Path | str, **start: float) -> None:
        description = fmpy.read_model_description(str(fmu))
        self.reference = {v.name: v.valueReference for v in description.modelVariables}
        self.states, self.indicators = (
            description.numberOfContinuousStates,
            description.numberOfEventIndicators,
        )
        self._folder = fmpy.extract(str(fmu))
        self.model = FMU2Model(
            guid=description.guid, modelIdentifier=description.modelExchange.modelIdentifier,
            unzipDirectory=self._folder, instanceName="screw",
        )  # fmt: skip
        self.model.instantiate()
        self.model.setupExperiment(startTime=0.0)
        self.model.setReal([self.reference[name] for name in start], list(start.values()))
        self.model.enterInitializationMode()
        self.model.exitInitializationMode()
        self.settle()

    def settle(self) -> None:
        """From event mode to continuous-time mode when no new discrete states are needed."""
        needed = True
        while needed:
            needed, *_ = self.model.newDiscreteStates()
        self.model.enterContinuousTimeMode()

    def torque(self) -> float:
        return float(self.model.getReal([self.reference["friction_torque"]])[0])

    def sliding(self) -> frozenset[int]:
        """Elements that slide, while the speed is not 0: their states hardly change, those of the others follow it."""
        rates = (ctypes.c_double * self.states)()
        self.model.getDerivatives(rates, self.states)
        (speed,) = self.model.getReal([self.reference["speed"]])
        sticking = abs(speed) * np.sqrt(START["presliding_stiffness"] / self.states)
        return frozenset(i for i, rate in enumerate(rates) if abs(rate) < 0.5 * sticking)

    def __enter__(self) -> "FrictionModel":
        return self

    def __exit__(self, *_: object) -> None:
        self.model.freeInstance()
        shutil.rmtree(self._folder, ignore_errors=True)


def values(pointer: Any, count: int) -> np.ndarray:
    """Values in the memory of the solver."""
    return np.ctypeslib.as_array(pointer, (count,))


class Coupled:
    """Callbacks of the solver: rotor and FMU as one system. States: speed, angle, elements."""

    def __init__(self, friction: FrictionModel) -> None:
        self.friction = friction
        self.time, self.speed, self.angle = 0.0, 0.0, 0.0
        self.evaluations = 0
        self.count = friction.states
        self._own = (ctypes.c_double * self.count)()
        self._speed = [friction.reference["speed"]]

    def set_time(self, time: float) -> None:
        self.time = time
        self.friction.model.setTime(time)

    def get_states(self, x: Any, count: int) -> None:
        self.friction.model.getContinuousStates(self._own, self.count)
        values(x, count)[:] = self.speed, self.angle, *self._own

    def set_states(self, x: Any, count: int) -> None:
        self.speed, self.angle, self._own[:] = x[0], x[1], x[2:count]
        self.friction.model.setReal(self._speed, [self.speed])
        self.friction.model.setContinuousStates(self._own, self.count)

    def get_rates(self, rates: Any, count: int) -> None:
        self.evaluations += 1
        self.friction.model.getDerivatives(self._own, self.count)
        drive = AMPLITUDE * np.sin(2.0 * np.pi * FREQUENCY * self.time)
        values(rates, count)[:] = (drive - self.friction.torque()) / INERTIA, self.speed, *self._own

    def get_indicators(self, indicators: Any, count: int) -> None:
        self.friction.model.getEventIndicators(indicators, count)

    def get_nominals(self, nominals: Any, count: int) -> None:
        values(nominals, count)[:] = 10.0, 1.0, *[1e-2] * self.count


def model_exchange(fmu: Path | str, tolerance: float = 1e-8) -> tuple[np.ndarray, list[Event], int]:
    """Rows of (time, speed, angle, torque) every INTERVAL, events, and evaluations of the right-hand side."""
    events: list[Event] = []
    with FrictionModel(fmu, **START) as friction:
        system = Coupled(friction)
        solver = CVodeSolver(
            nx=2 + friction.states, nz=friction.indicators, get_x=system.get_states, set_x=system.set_states,
            get_dx=system.get_rates, get_z=system.get_indicators, get_nominals=system.get_nominals,
            set_time=system.set_time, input=SimpleNamespace(apply=lambda time: None), startTime=0.0, maxStep=INTERVAL,
            relativeTolerance=tolerance, maxNumSteps=20000,
        )  # fmt: skip
        rows = [(0.0, 0.0, 0.0, friction.torque())]
        time, sliding = 0.0, frozenset[int]()
        for n in range(1, round(TIME / INTERVAL) + 1):
            while time < n * INTERVAL:
                result, _, time = solver.step(time, n * INTERVAL)
                system.set_time(time)
                if result:
                    friction.model.enterEventMode()
                    friction.settle()
                    before, sliding = sliding, friction.sliding()
                    kind = "slip" if sliding - before else "stick" if before - sliding else "other"
                    changed = tuple(sorted(before ^ sliding))
                    events.append(Event(time, kind, changed, system.speed, system.angle, friction.torque()))
                    solver.reset(time)
            rows.append((time, system.speed, system.angle, friction.torque()))
        return np.array(rows), events, system.evaluations


def co_simulation(fmu: Path | str, step: float) -> np.ndarray:
    """The same every INTERVAL with steps of this length, friction first, mean motor torque of each step."""
    rate, count, every = 2.0 * np.pi * FREQUENCY, round(TIME / step), round(INTERVAL / step)
    drive = -AMPLITUDE * np.diff(np.cos(rate * step * np.arange(count + 1))) / (rate * step)
    speed = angle = 0.0
    rows = [(0.0, 0.0, 0.0, 0.0)]
    with FmuInstance(fmu, **START) as friction:
        for n, motor in enumerate(drive.tolist(), start=1):
            friction.step(step, speed=speed)
            torque = friction.get("friction_torque")
            gain = step * (motor - torque) / INERTIA
            angle += step * (speed + 0.5 * gain)
            speed += gain
            if n % every == 0:
                rows.append((n * step, speed, angle, torque))
    return np.array(rows)


def main(fmu: Path | str = FMU, steps: tuple[float, ...] = STEPS) -> dict[str, Any]:
    """Both interfaces.

    Returns exchange: rows of model_exchange(); tight: the same at a tenth of the tolerance; coarsest: rows of
    co_simulation() with the longest step; events; elements: their number; reversals: changes of sign of the speed;
    evaluations; tolerance_error [rad/s]; steps, errors [rad/s]: largest difference of the speed of co-simulation from
    `tight`; order: fitted to them.
    """
    exchange, events, evaluations = model_exchange(fmu)
    tight, _, _ = model_exchange(fmu, 1e-9)
    coupled = {step: co_simulation(fmu, step) for step in steps}
    errors = [float(np.abs(run[:, 1] - tight[:, 1]).max()) for run in coupled.values()]
    sign = np.sign(exchange[:, 1][np.abs(exchange[:, 1]) > 0.05])
    return {
        "exchange": exchange, "tight": tight, "coarsest": coupled[steps[0]], "events": events,
        "elements": len({i for event in events for i in event.elements}),
        "reversals": int(np.count_nonzero(np.diff(sign))), "evaluations": evaluations,
        "tolerance_error": float(np.abs(tight[:, 1] - exchange[:, 1]).max()), "steps": steps, "errors": errors,
        "order": float(np.polyfit(np.log(steps), np.log(errors), 1)[0]),
    }  # fmt: skip


def table(result: dict[str, Any]) -> str:
    lines = []
    for event in result["events"]:
        numbers = " ".join(str(i + 1) for i in event.elements)
        lines.append(f"{event.kind:6} {numbers:12} at {event.time:.6f} s, {event.speed:+.2e} rad/s")
    lines.append(f"{result['reversals']} reversals, {result['evaluations']} evaluations")
    lines.append(f"a tenth of the tolerance changes the speed by {result['tolerance_error']:.1e} rad/s")
    for step, error in zip(result["steps"], result["errors"], strict=True):
        lines.append(f"co-simulation, {1e3 * step:.3f} ms: speed differs by {error:.2e} rad/s")
    return "\n".join([*lines, f"order of co-simulation {result['order']:.2f}"])


def plot(result: dict[str, Any], path: Path | str) -> None:
    """Speed and torque over time, torque over angle, with the events; error of co-simulation over its step."""
    figure = Figure(figsize=(11.0, 6.0), layout="constrained")
    (speed, error), (torque, loop) = figure.subplots(2, 2, width_ratios=(2, 1))
    started = result["events"][: result["elements"]]
    rest = result["exchange"][:, 0] < started[-1].time + 0.01
    for rows, style, label in (
        (result["coarsest"], {"color": "#D55E00", "lw": 2.2}, f"co-simulation, {1e3 * result['steps'][0]:.2g} ms"),
        (result["exchange"], {"color": "0.15", "ls": "--", "lw": 1.2}, "model exchange"),
    ):  # fmt: skip
        speed.plot(rows[:, 0], rows[:, 1], label=label, **style)
        torque.plot(rows[:, 0], rows[:, 3], **style)
        loop.plot(1e3 * rows[rest, 2], rows[rest, 3], **style)
    for kind, color in (("slip", "#0072B2"), ("stick", "#009E73")):
        events = [event for event in result["events"] if event.kind == kind]
        style = {"marker": "o", "ls": "", "ms": 4, "color": color}
        torques = [event.torque for event in events]
        torque.plot([event.time for event in events], torques, label=f"event: {kind}", **style)
    speed.set(ylabel="speed [rad/s]", title="Rotor under a sine of torque", ylim=(-10.0, 17.0))
    torque.set(ylabel="friction torque [N m]", xlabel="time [s]")
    loop.plot([1e3 * e.angle for e in started], [e.torque for e in started], "o", ms=4, color="#0072B2")
    loop.set(xlabel="angle [mrad]", title="Start from rest")
    error.loglog(
        1e3 * np.array(result["steps"]),
        result["errors"],
        "o-",
        color="#D55E00",
        label=f"order {result['order']:.2f}",
    )
    error.set_xticks(1e3 * np.array(result["steps"]), [f"{1e3 * h:.2g}" for h in result["steps"]])
    error.minorticks_off()
    error.set(xlabel="step [ms]", ylabel="difference [rad/s]")
    error.legend(frameon=False, fontsize=9)
    error.set_title("Co-simulation to model exchange")
    speed.legend(frameon=False, fontsize=9, loc="upper right", ncols=2)
    torque.legend(frameon=False, fontsize=9, loc="center right")
    plain((speed, torque, error, loop))
    figure.savefig(path, dpi=110)


def command_line(arguments: list[str] | None = None) -> int:
    return run_with_fmu(arguments, __file__, __doc__, FMU, main, table, plot, "native FMU")


if __name__ == "__main__":
    sys.exit(command_line())
