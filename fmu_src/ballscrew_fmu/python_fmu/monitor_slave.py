"""BallScrewPreloadMonitor for Python hosts: the preload at which the map gives the measured torque.

Below speed_min the torque does not determine the preload, and the output is the last preload that was in range. A
step of size 0 does not change that preload.
"""

from collections.abc import Mapping
from typing import Any

from ballscrew_fmu.python_fmu.slave_base import MapSlave
from ballscrew_fmu.variables.monitor import monitor_variables
from ballscrew_tehl.runtime.monitor import MonitorInputs, MonitorParameters, monitor_step


class BallScrewPreloadMonitorBase(MapSlave):
    """Preload of a ball screw from its friction torque."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(monitor_variables, **kwargs)
        self._inputs = self._shared.getter(*MonitorInputs._fields)
        self._parameters = self._shared.getter(*MonitorParameters._fields)
        self._held: float | None = None  # [N] preload of the last step that was in range

    def _memory(self) -> dict[str, Any]:
        return {"held": self._held}

    def _restore_memory(self, state: Mapping[str, Any]) -> None:
        self._held = state["held"]

    def _evaluate(self, step: float | None) -> tuple[Mapping[str, Any], tuple[str, ...]]:
        inputs = MonitorInputs(*self._inputs(self._values))
        parameters = MonitorParameters(*self._parameters(self._values))
        done = monitor_step(self._map, inputs, parameters, self._held)
        if step:
            self._held = done.preload
        return done.outputs, done.clamped
