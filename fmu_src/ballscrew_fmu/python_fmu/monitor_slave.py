"""BallScrewPreloadMonitor for Python hosts: the preload at which the map shows the measured torque.

Below speed_min the torque does not tell the preload: then the last preload that was in range is shown. A step of
size 0 is not remembered. Twin: native/monitor/model.c.
"""

from collections.abc import Mapping
from typing import Any

from ballscrew_fmu.python_fmu.slave_base import MapSlave
from ballscrew_fmu.variables.monitor import monitor_variables
from ballscrew_tehl.runtime.preload import OverPreload, estimate_preload


class BallScrewPreloadMonitorBase(MapSlave):
    """Preload of a double-nut ball screw from its friction torque."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(monitor_variables, **kwargs)
        self._held: float | None = None  # [N] preload of the last step that was in range

    def _memory(self) -> dict[str, Any]:
        return {"held": self._held}

    def _recall(self, state: Mapping[str, Any]) -> None:
        self._held = state["held"]

    def _evaluate(self, step: float | None) -> bool:
        torque, speed, temperature, axial_load = self._values[self._inputs]
        ratio, net, roughness, regularization, slowest, uncertainty, initial = self._values[self._parameters]
        friction = (axial_load, ratio, net, roughness)
        moving = abs(speed) >= slowest and speed != 0.0
        held, highest = self._held, self._map.force.hi
        if moving:
            found = estimate_preload(self._map, torque, speed, temperature, *friction, regularization)
            preload, slope, clamped = found.preload, found.torque_sensitivity, list(found.clamped)
            if step and found.in_range:
                held = preload
        else:
            preload = initial if held is None else held
            over = OverPreload(self._map, max(abs(speed), slowest), temperature, *friction, regularization)
            slope = max(over.torque(min(preload, highest))[1], 0.0)
            clamped = []
        # films at this preload, and what else is beyond the map
        nut = self._map.evaluate_point(preload, speed, temperature, *friction)
        if not moving:
            clamped = [name for name in nut.clamped if name != "preload"]
        width = uncertainty / slope if uncertainty < slope * highest else highest
        in_range = moving and not clamped
        self._values[self._outputs] = [preload, width, slope, nut.lambda_ratio, in_range]
        self._held = held
        if clamped:
            self._warn(tuple(clamped))
        return True
