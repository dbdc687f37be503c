"""BallScrewFriction for Python hosts: inputs to the map, signs and standstill law to the outputs.

All imports are at the top (slave_base.py). Only the contact solver is imported later, and only with refine = true,
from a folder that stays (solver_cache.py).
"""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pythonfmu.enums import Fmi2Status

from ballscrew_fmu.python_fmu.slave_base import MapSlave
from ballscrew_fmu.python_fmu.solver_cache import SolverError, compiled_files, load_solver
from ballscrew_fmu.variables.friction import fmu_variables
from ballscrew_tehl.runtime.nut_law import DoubleNutState
from ballscrew_tehl.runtime.outputs import friction_outputs
from ballscrew_tehl.runtime.packed import DEFAULTS, POINT
from ballscrew_tehl.runtime.standstill import coulomb_friction


class BallScrewFrictionBase(MapSlave):
    """Friction torque of a preloaded double-nut ball screw."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(fmu_variables, **kwargs)
        self._point = self._getter(*POINT, *DEFAULTS)
        self._standstill = self._getter(
            "speed", "regularization_speed", "presliding_stiffness", "presliding_damping"
        )
        self._refining = self._getter("refine", "refine_tolerance")
        self._deflection = 0.0  # of the presliding bristle [rad]
        self._refinement: Any = None  # made at the first refined step
        self._remembered: Any = None  # state of a refinement that is not made yet
        self._solver_fails = False

    def _memory(self) -> dict[str, Any]:
        remembered = self._remembered if self._refinement is None else self._refinement.state()
        return {"deflection": self._deflection, "refinement": remembered}

    def _recall(self, state: Mapping[str, Any]) -> None:
        self._deflection = state["deflection"]
        self._refinement, self._remembered = None, state["refinement"]

    def _evaluate(self, step: float | None) -> bool:
        values = self._values
        point = self._point(values)
        refine, tolerance = self._refining(values)
        nut = self._refined(tolerance, point) if refine else None
        if nut is None:
            nut = self._map.evaluate_point(*point)
        speed, *bristle = self._standstill(values)
        coulomb = coulomb_friction(nut.coulomb_torque, speed, step, self._deflection, *bristle)
        self._show(friction_outputs(nut, speed, coulomb))
        self._deflection = coulomb.deflection
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
