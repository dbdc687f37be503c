"""Where the torque of a fitted set has a trend that thick films do not have.

The film_shear law takes the viscosity at the inlet and the film of the thermal solve: heat that thins the film raises
its torque, and a film thinner than the fitted height carries less. In thick films it may rise with temperature or
fall with speed. Found by differences of the map, five look-ups for one: too slow for the step of an FMU, which does
not flag it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..runtime.evaluate import NutMap
from ..runtime.packed import FILM_SHEAR

#: film ratio above which a film counts as thick
THICK = 3.0
#: steps of the differences, temperature [K] and ln speed, and least relative change that counts
STEP_K, STEP_LN, LEAST_CHANGE = 1.0, 0.02, 1e-4


class Trend(NamedTuple):
    """Whether the torque rises with temperature and whether it falls with speed, where films are thick."""

    rises_with_temperature: Any
    falls_with_speed: Any

    @property
    def unphysical(self) -> Any:
        """Either."""
        return self.rises_with_temperature | self.falls_with_speed

    @property
    def text(self) -> str:
        """Of a single point; "" where both trends are physical."""
        words = ("rises with temperature" if self.rises_with_temperature else "",
                 "falls with speed" if self.falls_with_speed else "")  # fmt: skip
        found = " and ".join(word for word in words if word)
        return f"torque {found} in a thick film (lambda > {THICK:g})" if found else ""


def unphysical_trend(
    nut_map: NutMap, preload: Any, speed: Any, temperature: Any, axial_load: Any = 0.0
) -> Trend:
    """Trends at operating points; arguments of NutMap.evaluate, with the default friction parameters of the map.

    Returns      Trend of booleans, arrays for arrays; False everywhere for the mechanistic law, below the lowest speed
                 of the map and outside the map
    """
    given = preload, speed, temperature, axial_load
    shape = np.broadcast_shapes(*(np.shape(a) for a in given))
    if nut_map.law != FILM_SHEAR:
        no = np.zeros(shape, dtype=bool)[()]
        return Trend(no, no)
    preload, speed, temperature, axial_load = (np.asarray(a, dtype=float) for a in given)
    speed = np.abs(speed)
    axes = nut_map.header["axes"]
    slow, fast = axes["speed"][:2]
    cold, hot = axes["temperature"][:2]
    inside = (speed >= slow) & (speed <= fast) & (temperature >= cold) & (temperature <= hot)
    speed, temperature = np.clip(speed, slow, fast), np.clip(temperature, cold, hot)
    thick = inside & (nut_map.evaluate(preload, speed, temperature, axial_load).lambda_ratio > THICK)

    def torque(w: Any, t: Any) -> Any:
        return nut_map.evaluate(preload, w, t, axial_load).friction_torque

    colder, hotter = np.maximum(temperature - 0.5 * STEP_K, cold), np.minimum(temperature + 0.5 * STEP_K, hot)
    slower = np.maximum(speed * np.exp(-0.5 * STEP_LN), slow)
    faster = np.minimum(speed * np.exp(0.5 * STEP_LN), fast)
    rise = torque(speed, hotter) > (1.0 + LEAST_CHANGE) * torque(speed, colder)
    fall = torque(faster, temperature) < (1.0 - LEAST_CHANGE) * torque(slower, temperature)
    return Trend((thick & rise)[()], (thick & fall)[()])
