"""Where the torque of a map has a trend that thick flooded films do not have, or its film is no lubricant film.

The film_shear law takes the viscosity at the inlet and the film of the thermal solve: heat that thins the film raises
its torque, and a film thinner than the fitted height carries less. In thick films it may rise with temperature or
fall with speed. So may the mechanistic law with a replenishment_constant. Found by differences of the map, five
look-ups for one: too slow for the step of an FMU, which does not flag it.
"""

from typing import Any, NamedTuple

import numpy as np

from ..friction.film_shear import nut_forces
from ..parameters.file import FOUR_POINT, Parameters
from ..physics.film import MIN_FILM, THICKEST_FILM
from ..runtime.constants import HELD
from ..runtime.evaluate import NutMap

THICK = 3.0  # film ratio above which a film counts as thick
#: steps of the differences, temperature [K] and ln speed, and smallest relative change that counts
STEP_K, STEP_LN, MIN_CHANGE = 1.0, 0.02, 1e-4
#: force of the relieved over that of the loaded flanks below which a map holds for free oversize balls, within 3 %
FREE_FORCE_RATIO = 1e-3
#: torque of a map off that by the motion of the ball, from which on a line says so
MOST_OFF = 0.02


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
        trends = {
            "rises with temperature": self.rises_with_temperature, "falls with speed": self.falls_with_speed
        }  # fmt: skip
        words = " and ".join(word for word, result in trends.items() if result)
        return f"torque {words} in a thick film (lambda > {THICK:g})" if words else ""


def unphysical_trend(
    nut_map: NutMap, preload: Any, speed: Any, temperature: Any, axial_load: Any = 0.0
) -> Trend:
    """Trends at operating points, arguments of NutMap.evaluate; False outside the map and below its lowest speed."""
    point = preload, speed, temperature, axial_load
    preload, speed, temperature, axial_load = (np.asarray(a, dtype=float) for a in point)
    speed = np.abs(speed)
    axes = nut_map.header["axes"]
    slow, fast = axes["speed"][:2]
    cold, hot = axes["temperature"][:2]
    inside = (speed >= slow) & (speed <= fast) & (temperature >= cold) & (temperature <= hot)
    speed, temperature = np.clip(speed, slow, fast), np.clip(temperature, cold, hot)
    thick = inside & (nut_map.evaluate(preload, speed, temperature, axial_load).lambda_ratio > THICK)

    def change(*ends: tuple[Any, Any]) -> Any:
        """Change of the torque from one speed and temperature to another, 0 if it does not count."""
        first, second = (nut_map.evaluate(preload, *at, axial_load).friction_torque for at in ends)
        return np.where(np.abs(second - first) > MIN_CHANGE * first, second - first, 0.0)

    colder, hotter = np.maximum(temperature - 0.5 * STEP_K, cold), np.minimum(temperature + 0.5 * STEP_K, hot)
    slower = np.maximum(speed * np.exp(-0.5 * STEP_LN), slow)
    faster = np.minimum(speed * np.exp(0.5 * STEP_LN), fast)
    rise = change((speed, colder), (speed, hotter)) > 0.0
    fall = change((slower, temperature), (faster, temperature)) < 0.0
    return Trend((thick & rise)[()], (thick & fall)[()])


def unlike_flanks(
    parameters: Parameters, preload: float, axial_load: float, torque: float, by_map: float
) -> str:
    """One line if an axial load leaves oversize balls half held, out of the range of a map; else "".

    The ball then slips on the relieved flanks (runtime.nut_law.freed). At a film of a hundredth of its radius, a few
    hundred newtons and above 10,000 r/min, it also slips where it is held: MOST_OFF. torque: [N m] by its motion
    """
    if parameters.screw.preload_kind != FOUR_POINT or not preload >= 0.0 or axial_load == 0.0:
        return ""
    relieved, loaded = sorted(nut_forces(parameters, preload, axial_load))
    held, off = relieved >= HELD * loaded, abs(by_map / torque - 1.0)
    if held and off <= MOST_OFF:
        return ""
    of_free = "up to 40 % off" if relieved > FREE_FORCE_RATIO * loaded else "within 3 %"
    how = f"{100.0 * off:.0f} % off" if held else of_free
    return (
        f"oversize balls slip on one set of flanks ({relieved:.3g} N, the other {loaded:.3g} N): map {how}, "
        f"from the motion of the ball {torque:.4g} N m"
    )


def too_thick(film: float, ball_radius: float) -> str:
    """One line if a film [m] is a large part of the ball radius [m], beyond lubrication theory; or ""."""
    if not film > THICKEST_FILM * ball_radius:
        return ""
    return f"film {1e6 * film:.0f} um, above a tenth of the ball radius: rolling loss from its lower bound"


def too_thin(film: float) -> str:
    """One line if a minimum film [m], not that at rest, is below MIN_FILM, where oil is no continuum; or ""."""
    if film >= MIN_FILM or film == 0.0:
        return ""
    return f"minimum film {1e9 * film:.2g} nm, below {1e9 * MIN_FILM:g} nm: oil is no continuum there"
