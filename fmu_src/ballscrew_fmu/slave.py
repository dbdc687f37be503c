"""The FMI 2.0 co-simulation slave: inputs to the map, signs and standstill law to the outputs.

Inside the FMU this module lives in a package named by its content (package.py), next to copies of everything
it imports. All imports are at the top, so that a deleted folder of another copy of the FMU can never break a
step. Only the contact solver is imported later, and only with refine = true, from a folder that stays
(solver_cache.py).

No call may raise once the instance exists: pythonfmu 0.7 then releases its objects at once and again when the
instance is freed, and the host process dies. Wrong calls are logged as errors, steps that cannot be done are
discarded.
"""

import importlib
import json
import math
import os
import sys
import time
from pathlib import Path
from typing import Any

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from ballscrew_fmu.process_end import reset_at_exit
from ballscrew_fmu.solver_cache import SolverError, compiled_files, load_solver
from ballscrew_fmu.variables import Variable, fmu_variables, places
from ballscrew_tehl.nut_map.evaluate import DoubleNutState, NutMap
from ballscrew_tehl.standstill import presliding_power, presliding_step, regularised_sign

MAP_FILE = "nut_map.npz"
INITIALIZING, STEPPING, TERMINATED, UNUSABLE = range(4)
TOO_LARGE = 1e30  # an input beyond is refused like infinity, so that no product overflows


class BallScrewFrictionBase(Fmi2Slave):
    """Friction torque of a preloaded double-nut ball screw.

    Outputs are those of the last successful step; before the first step those of the inputs as they are set.
    An input or parameter that is not a usable number makes doStep return Discard and changes nothing.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        _settle_imports(self.resources)
        reset_at_exit(self.resources)
        self._map = NutMap.from_npz(os.path.join(self.resources, MAP_FILE))
        self._table = fmu_variables(self._map.header)
        self._inputs = slice(0, len(places(self._table, "input")))
        self._outputs = slice(self._inputs.stop, self._inputs.stop + len(places(self._table, "output")))
        self._parameters = slice(self._outputs.stop, len(self._table))
        parameters = places(self._table, "parameter")
        self._bounds = [(p, -TOO_LARGE) for p in range(self._inputs.stop)]
        self._bounds += [(p, _least(self._table[p])) for p in parameters if self._table[p].unit is not None]
        self._known = range(len(self._table))
        self._settable = frozenset(place for place, _ in self._bounds)
        self._switches = frozenset(p for p in parameters if self._table[p].unit is None)
        # by value reference
        self._values: list[Any] = [0.0 if v.start is None else v.start for v in self._table]
        self._deflection = 0.0  # of the presliding bristle [rad]
        self._phase = INITIALIZING
        self._stale = True  # outputs do not belong to the inputs yet; of interest while initializing
        self._warned: list[str] = []
        self._refinement: Any = None  # made at the first refined step
        self._remembered: Any = None  # state of a refinement that is not made yet
        self._solver_fails = False

    # FMI calls

    def exit_initialization_mode(self) -> None:
        self._update(None)
        self._phase = STEPPING

    def do_step(self, current_time: float, step_size: float) -> bool:
        if self._phase != STEPPING:
            return self._refuse(
                "doStep outside of a simulation: needs exitInitializationMode or a state of this FMU"
            )
        if not 0.0 <= step_size < TOO_LARGE:
            return self._refuse(f"step size = {step_size} s; needs a finite number >= 0")
        return self._update(step_size)

    def terminate(self) -> None:
        self._phase = TERMINATED

    def get_real(self, vrs: list[int]) -> list[float]:
        return [float(value) for value in self._get(vrs)]

    def get_boolean(self, vrs: list[int]) -> list[bool]:
        return [bool(value) for value in self._get(vrs)]

    def get_integer(self, vrs: list[int]) -> list[int]:
        return [int(value) for value in self._none(vrs, "Integer", 0)]

    def get_string(self, vrs: list[int]) -> list[str]:
        return [str(value) for value in self._none(vrs, "String", "")]

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        for vr, value in zip(vrs, values, strict=True):
            if vr in self._settable:
                self._values[vr] = value
            else:
                self.log(f"{self._name(vr)} is no Real input or parameter: not set", Fmi2Status.error)
        self._stale = True

    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        for vr, value in zip(vrs, values, strict=True):
            if vr in self._switches:
                self._values[vr] = bool(value)
            else:
                self.log(f"{self._name(vr)} is no Boolean parameter: not set", Fmi2Status.error)
        self._stale = True

    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        self._none(vrs, "Integer", 0)

    def set_string(self, vrs: list[int], values: list[str]) -> None:
        self._none(vrs, "String", "")

    def _get_fmu_state(self) -> dict[str, Any]:
        return {
            "code": __name__,
            "map": self._map.header["content_hash"],
            "values": list(self._values),
            "deflection": self._deflection,
            "phase": self._phase,
            "stale": self._stale,
            "warned": list(self._warned),
            "refinement": self._remembered if self._refinement is None else self._refinement.state(),
        }

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        if (state.get("code"), state.get("map")) != (__name__, self._map.header["content_hash"]):
            self._phase = UNUSABLE
            self.log(
                "FMU state that is damaged or of another version or map: not restored; "
                "doStep is discarded until a state of this FMU is restored",
                Fmi2Status.error,
            )
            return
        self._values = list(state["values"])
        self._deflection = state["deflection"]
        self._phase = state["phase"]
        self._stale = state["stale"]
        self._warned = list(state["warned"])
        self._refinement, self._remembered = None, state["refinement"]

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        return json.dumps(state, sort_keys=True).encode()  # floats as repr: exact, NaN and infinity too

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        try:
            found = json.loads(bytes(state))
        except ValueError:
            return {}
        return found if isinstance(found, dict) else {}

    # evaluation

    def _refresh(self) -> None:
        """In initialization mode outputs follow the inputs as soon as they are read."""
        if self._stale and self._phase == INITIALIZING:
            self._stale = False
            self._update(None)

    def _get(self, vrs: list[int]) -> list[Any]:
        self._refresh()
        known = self._known
        return [
            self._values[vr] if vr in known else self._none([vr], "Real or Boolean", 0.0)[0] for vr in vrs
        ]

    def _none(self, vrs: list[int], kind: str, value: Any) -> list[Any]:
        """Answer to a call about variables that do not exist."""
        for vr in vrs:
            self.log(f"no {kind} variable has value reference {vr}", Fmi2Status.error)
        return [value] * len(vrs)

    def _name(self, vr: int) -> str:
        return self._table[vr].name if vr in self._known else f"value reference {vr}"

    def _refuse(self, message: str) -> bool:
        self.log(message, Fmi2Status.discard)
        return False

    def _usable(self) -> bool:
        """Whether every input and parameter is a usable number; the log names the first one that is not."""
        for place, least in self._bounds:
            value = self._values[place]
            if not least <= value < TOO_LARGE:
                needs = "a finite number" if least < 0.0 else f"a finite number {'>' if least else '>='} 0"
                return self._refuse(f"{self._table[place].name} = {value}; needs {needs}")
        return True

    def _update(self, step: float | None) -> bool:
        """Outputs, and with a step the bristle, for the inputs as set; False and no change if unusable."""
        try:
            return self._usable() and self._evaluate(step)
        except Exception as error:  # see the head of this module: raising would kill the host
            return self._refuse(f"step failed: {type(error).__name__}: {error}")

    def _evaluate(self, step: float | None) -> bool:
        preload, speed, temperature, axial_load = self._values[self._inputs]
        ratio, net, roughness, regularization, stiffness, damping, refine, tolerance = self._values[
            self._parameters
        ]
        point = (preload, speed, temperature, axial_load, ratio, net, roughness)
        nut = self._refined(tolerance, point) if refine else None
        if nut is None:
            nut = self._map.evaluate_point(*point)
        viscous = math.copysign(nut.viscous_torque, speed)
        power = nut.viscous_torque * abs(speed)
        coulomb = nut.hysteresis_torque + nut.sliding_torque
        deflection = self._deflection
        if stiffness > 0.0:
            bristle = presliding_step(deflection, speed, step or 0.0, coulomb, stiffness, damping)
            sign = bristle.torque / coulomb if coulomb > 0.0 else 0.0
            if step:
                deflection = bristle.deflection
                power += bristle.heat / step
            else:
                power += presliding_power(deflection, speed, coulomb, stiffness)
        else:
            deflection = 0.0 if step else deflection  # a bristle that is switched off is unwound
            sign = regularised_sign(speed, regularization)
            power += coulomb * sign * speed
        hysteresis, sliding = sign * nut.hysteresis_torque, sign * nut.sliding_torque
        self._values[self._outputs] = [
            viscous + hysteresis + sliding, viscous, hysteresis, sliding, power, *nut[3:11],
        ]  # fmt: skip
        self._deflection = deflection
        if nut.clamped:
            self._warn(nut.clamped)
        return True

    def _refined(self, tolerance: float, point: tuple[float, ...]) -> DoubleNutState | None:
        """The refined map at a point; None if the solver cannot be used here, which is logged once."""
        if self._solver_fails:
            return None
        try:
            if self._refinement is None:
                self._refinement = self._make_refinement()
            self._refinement.tolerance = tolerance
            return self._refinement.evaluate_point(*point)
        except Exception as error:  # the map must go on
            self._solver_fails = True
            if self._refinement is not None:
                self._remembered, self._refinement = self._refinement.state(), None
            reason = str(error) if isinstance(error, SolverError) else f"{type(error).__name__}: {error}"
            self._say_once("refine", f"refine: {reason}; results are those of the map", Fmi2Status.error)
            return None

    def _make_refinement(self) -> Any:
        """Refinement of this map with what is remembered; imports the solver and compiles it where that is new."""
        solver, remark = load_solver(Path(self.resources, str(__package__)))
        if remark:
            self._say_once("cache", f"refine: {remark}", Fmi2Status.warning)
        refinement = solver.Refinement(self._map, report=self._report)
        before, begun = compiled_files(solver), time.monotonic()
        refinement.prepare()
        if compiled_files(solver) > before:
            seconds = time.monotonic() - begun
            self.log(f"refine: contact solver compiled in {seconds:.0f} s, once per machine", Fmi2Status.ok)
        if self._remembered is not None:
            refinement.restore(self._remembered)
        return refinement

    def _report(self, solve: Any) -> None:
        if solve.failure:
            self._say_once("unsolved", f"refine: {solve} (said once)", Fmi2Status.warning)
        else:
            self.log(f"refine: {solve}", Fmi2Status.ok)

    def _say_once(self, key: str, message: str, status: Fmi2Status) -> None:
        if key not in self._warned:
            self._warned.append(key)
            self.log(message, status)

    def _warn(self, clamped: tuple[str, ...]) -> None:
        for name in clamped:
            if name not in self._warned:
                value = self._values[next(i for i, v in enumerate(self._table) if v.name == name)]
                message = f"{name} = {value} lies beyond the map and is clamped (said once)"
                self._say_once(name, message, Fmi2Status.warning)


def _least(variable: Variable) -> float:
    """Least value of a Real parameter: all may be 0 but the tolerance."""
    return math.ulp(0.0) if variable.name == "refine_tolerance" else 0.0


def _settle_imports(resources: str) -> None:
    """Leave the interpreter as an FMU should: the package found here, the search path without this folder.

    pythonfmu puts the resources of every instance first on sys.path and leaves them there. The modules of
    this package were loaded from the first copy of the FMU, whose folder may be gone by now.
    """
    package = sys.modules[__package__]
    here = os.path.join(resources, __package__)
    if os.path.isdir(here):
        others = [folder for folder in package.__path__ if folder != here and os.path.isdir(folder)]
        package.__path__[:] = [here, *others]
    while resources in sys.path:
        sys.path.remove(resources)
    importlib.invalidate_caches()
