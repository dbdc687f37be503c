"""BallScrewFriction for Python hosts: outputs from the map and the law of friction at standstill.

All imports are at the top (slave_base.py), except for the contact solver: with refine = true it is imported from the
cache folder (solver_cache.py).
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pythonfmu.enums import Fmi2Status

from ballscrew_fmu.python_fmu.slave_base import MapSlave
from ballscrew_fmu.python_fmu.solver_cache import SolverError, load_solver
from ballscrew_fmu.variables.friction import fmu_variables
from ballscrew_tehl.runtime.constants import DAMPING_TIME
from ballscrew_tehl.runtime.nut_law import DoubleNutState
from ballscrew_tehl.runtime.packed import DEFAULTS, POINT
from ballscrew_tehl.runtime.standstill import RELAXED, Elements, StandstillLaw, friction_step


class BallScrewFrictionBase(MapSlave):
    """Friction torque of a preloaded ball screw."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(fmu_variables, **kwargs)
        self._point = self._shared.getter(*POINT, *DEFAULTS)
        self._law = self._shared.getter(*StandstillLaw._fields)
        self._others = self._shared.getter(
            "temperature_difference", "seal_torque", "refine", "refine_tolerance"
        )
        self._elements = RELAXED
        self._heat = 0.0  # [J] dissipated in the steps
        self._refinement: Any = None  # created at the first refined step
        self._refinement_state: Any = None  # state for a refinement that is not created yet
        self._solver_failed = False

    def _memory(self) -> dict[str, Any]:
        refinement = self._refinement_state if self._refinement is None else self._refinement.state()
        return {"elements": list(self._elements), "heat": self._heat, "refinement": refinement}

    def _restore_memory(self, state: Mapping[str, Any]) -> None:
        states, *others = state["elements"]
        self._elements, self._heat = Elements(tuple(states), *others), state["heat"]
        self._refinement, self._refinement_state = None, state["refinement"]

    def _evaluate(self, step: float | None) -> tuple[Mapping[str, Any], tuple[str, ...]]:
        point, law = self._point(self._values), StandstillLaw(*self._law(self._values))
        difference, seal_torque, refine, tolerance = self._others(self._values)
        at = point, difference, seal_torque
        refined = self._refined(tolerance, at) if refine else None
        actual, nut = refined or self._map.point_at_difference(*at)
        margin = self._map.range_margin(point[:4], difference)
        before = None if step is None else self._elements
        outputs, coulomb = friction_step(self._map, nut, actual, law, step, before, self._heat, margin)
        self._elements, self._heat = coulomb.elements, outputs["heat"]
        # rotor and elements that both step with the values of the last step: stable in the elastic range for
        # step stiffness/damping < 1 - step damping/inertia
        stiffness = coulomb.elements.stiffness
        damping = law.presliding_damping or DAMPING_TIME * stiffness
        sticks = law.presliding and point[POINT.index("speed")] != 0.0 and abs(coulomb.sign) < 1.0 - 1e-9
        if step and sticks and step * stiffness >= damping > 0.0:
            self._log_once(
                "step",
                f"step = {step} s; an inertia coupled with the values of the last step comes to rest for steps below "
                f"damping over presliding stiffness only, {damping:.6g} N.m.s/rad over {stiffness:.6g} N.m/rad = "
                f"{damping / stiffness:.6g} s (logged once)",
                Fmi2Status.warning,
            )
        return outputs, nut.clamped

    def _refined(
        self, tolerance: float, at: tuple[tuple[float, ...], float, float]
    ) -> tuple[tuple[float, ...], DoubleNutState] | None:
        """The refined map at a point. None if the solver cannot be used, which is logged once."""
        if self._solver_failed:
            return None
        try:
            if self._refinement is None:
                # imports the solver, and compiles it if that was not done yet
                solver, remark = load_solver(Path(self.resources, str(__package__)))
                if remark:
                    self._log_once("cache", f"refine: {remark}", Fmi2Status.warning)
                refinement = solver.Refinement(self._map, report=self._report)
                refinement.prepare()
                if self._refinement_state is not None:
                    refinement.restore(self._refinement_state)
                self._refinement = refinement
            self._refinement.tolerance = tolerance
            return self._map.point_at_difference(*at, self._refinement)
        except Exception as error:  # the step continues with the map
            self._solver_failed = True
            if self._refinement is not None:
                self._refinement_state, self._refinement = self._refinement.state(), None
            reason = str(error) if isinstance(error, SolverError) else f"{type(error).__name__}: {error}"
            self._log_once("refine", f"refine: {reason}; results are those of the map", Fmi2Status.error)
            return None

    def _report(self, solve: Any) -> None:
        if solve.failure:
            self._log_once("unsolved", f"refine: {solve} (logged once)", Fmi2Status.warning)
        else:
            self.log(f"refine: {solve}", Fmi2Status.ok)
