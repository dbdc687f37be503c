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
from ballscrew_tehl.runtime.constants import DAMPING_TIME, LEAST_STIFFNESS
from ballscrew_tehl.runtime.nut_law import DoubleNutState
from ballscrew_tehl.runtime.outputs import friction_outputs
from ballscrew_tehl.runtime.packed import DEFAULTS, POINT
from ballscrew_tehl.runtime.standstill import (
    RELAXED,
    CoulombFriction,
    Elements,
    held_stiffness,
    initial_elements,
    longest_step,
    presliding_friction,
    regularised_friction,
)


class BallScrewFrictionBase(MapSlave):
    """Friction torque of a preloaded double-nut ball screw."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(fmu_variables, **kwargs)
        self._point = self._shared.getter(*POINT, *DEFAULTS)
        self._regularized = self._shared.getter("speed", "regularization_speed", "presliding")
        self._given = self._shared.getter("presliding_stiffness", "presliding_damping", "presliding_side")
        self._seal = self._shared.getter("seal_torque")
        self._loads = self._shared.getter(
            "preload", "axial_load", "net_sliding_coefficient", "breakaway_factor"
        )
        self._refining = self._shared.getter("refine", "refine_tolerance")
        self._elements = RELAXED
        self._heat = 0.0  # [J] dissipated in the steps
        self._stiffness = ((), 0.0)  # of the screw [N.m/rad], with what it belongs to
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

    def _evaluate(self, step: float | None) -> bool:
        values = self._values
        point = self._point(values)
        refine, tolerance = self._refining(values)
        nut = self._refined(tolerance, point) if refine else None
        if nut is None:
            nut = self._map.evaluate_point(*point)
        nut = nut._replace(seal_torque=self._seal(values))
        speed, regularization_speed, presliding = self._regularized(values)
        if presliding:
            coulomb = self._presliding(nut.coulomb_torque, speed, step)
        else:
            coulomb = regularised_friction(
                nut.coulomb_torque, speed, step, regularization_speed, self._elements
            )
        loads = point[: len(POINT)]
        outputs = friction_outputs(nut, speed, coulomb, loads_a=loads[-1] >= 0.0)
        outputs["range_margin"] = self._map.range_margin(*loads)
        outputs["heat"] = self._heat + (step or 0.0) * outputs["power_loss"]
        self._set_outputs(outputs)
        self._elements, self._heat = coulomb.elements, outputs["heat"]
        if nut.clamped:
            self._warn(nut.clamped)
        return True

    def _presliding(self, coulomb_torque: float, speed: float, step: float | None) -> CoulombFriction:
        """Standstill law of the elements; without a step, at the start of the simulation."""
        stiffness, damping, side = self._given(self._values)
        if stiffness < LEAST_STIFFNESS:
            stiffness = self._stiffness_of_screw() + self._map.seal_stiffness(self._seal(self._values))
        before = self._elements
        if step is None:
            before = initial_elements(side, speed, coulomb_torque, stiffness)
        stiffness = held_stiffness(before, stiffness)
        damping = damping or DAMPING_TIME * stiffness
        coulomb = presliding_friction(coulomb_torque, speed, step, before, stiffness, damping)
        if step and speed and step * stiffness >= damping > 0.0 and abs(coulomb.sign) < 1.0 - 1e-9:
            self._log_once(
                "step",
                f"step = {step} s; an inertia coupled with the values of the last step comes to rest for steps below "
                f"damping over presliding stiffness only, {damping:.6g} N.m.s/rad over {stiffness:.6g} N.m/rad = "
                f"{longest_step(stiffness, damping):.6g} s (logged once)",
                Fmi2Status.warning,
            )
        return coulomb

    def _stiffness_of_screw(self) -> float:
        """Stiffness at the present loads, computed when they change."""
        loads = self._loads(self._values)
        if loads != self._stiffness[0]:
            self._stiffness = (loads, self._map.presliding_stiffness(*loads))
        return self._stiffness[1]

    def _refined(self, tolerance: float, point: tuple[float, ...]) -> DoubleNutState | None:
        """The refined map at a point. None if the solver cannot be used, which is logged once."""
        if self._solver_failed:
            return None
        try:
            if self._refinement is None:
                self._refinement = self._make_refinement()
            self._refinement.tolerance = tolerance
            return self._refinement.evaluate_point(*point)
        except Exception as error:  # the step continues with the map
            self._solver_failed = True
            if self._refinement is not None:
                self._refinement_state, self._refinement = self._refinement.state(), None
            reason = str(error) if isinstance(error, SolverError) else f"{type(error).__name__}: {error}"
            self._log_once("refine", f"refine: {reason}; results are those of the map", Fmi2Status.error)
            return None

    def _make_refinement(self) -> Any:
        """Refinement of this map with its saved state. Imports the solver, and compiles it if that was not done yet."""
        solver, remark = load_solver(Path(self.resources, str(__package__)))
        if remark:
            self._log_once("cache", f"refine: {remark}", Fmi2Status.warning)
        refinement = solver.Refinement(self._map, report=self._report)
        refinement.prepare()
        if self._refinement_state is not None:
            refinement.restore(self._refinement_state)
        return refinement

    def _report(self, solve: Any) -> None:
        if solve.failure:
            self._log_once("unsolved", f"refine: {solve} (logged once)", Fmi2Status.warning)
        else:
            self.log(f"refine: {solve}", Fmi2Status.ok)
