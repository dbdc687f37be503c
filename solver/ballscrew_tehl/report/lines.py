"""A friction set with its map, as claims reads it; goes where that goes."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..friction.sets import FrictionSet
from ..runtime.evaluate import NutMap


class Friction(NamedTuple):
    """A friction set and the map with the film of its fit."""

    entry: FrictionSet
    nut_map: NutMap

    def parts(self, preload: Any, speed: Any, temperature: Any) -> tuple[Any, Any, Any]:
        """Viscous, hysteresis and sliding torque [N.m] at preload [N], speed [rad/s], temperature [K]."""
        state = self.nut_map.evaluate(preload, speed, temperature)
        return state.viscous_torque, state.hysteresis_torque, state.sliding_torque

    def torque(self, preload: Any, speed: Any, temperature: Any) -> Any:
        """Their sum."""
        return sum(self.parts(preload, speed, temperature))
