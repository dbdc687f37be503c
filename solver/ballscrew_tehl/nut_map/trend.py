"""Where the torque of a map has a trend that thick flooded films do not have, or its film is no lubricant film.

The film_shear law takes the viscosity at the inlet and the film of the thermal solve: heat that thins the film raises
its torque, and a film thinner than the fitted height carries less. In thick films it may rise with temperature or
fall with speed. The mechanistic law does so where the replenishment factor falls faster than the flooded loss rises: it
is that of bearings, known for moderate speeds and viscosities. Found by differences of the map, five look-ups for one:
too slow for the step of an FMU, which does not flag it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..friction.torque import nut_forces
from ..parameters.file import FOUR_POINT, Parameters
from ..physics.ball_formula import THICKEST_FILM
from ..runtime.evaluate import NutMap
from ..runtime.packed import MECHANISTIC
from .contacts import MIN_FILM

#: film ratio above which a film counts as thick
THICK = 3.0
#: steps of the differences, temperature [K] and ln speed, and smallest relative change that counts
STEP_K, STEP_LN, MIN_CHANGE = 1.0, 0.02, 1e-4
#: force of the relieved over that of the loaded set of flanks below which oversize balls begin to slip on it
MIN_FORCE_RATIO = 0.12
#: least replenishment factor of which a logarithm is taken
TINY = 1e-300


class Trend(NamedTuple):
    """Whether the torque rises with temperature and whether it falls with speed, where films are thick.

    supply : replenishment factor of the mechanistic law, by which it does; None: fitted set
    """

    rises_with_temperature: Any
    falls_with_speed: Any
    supply: Any = None

    @property
    def unphysical(self) -> Any:
        """Either."""
        return self.rises_with_temperature | self.falls_with_speed

    @property
    def text(self) -> str:
        """Of a single point; "" where both trends are physical."""
        words = ("rises with temperature" if self.rises_with_temperature else "",
                 "falls with speed" if self.falls_with_speed else "")  # fmt: skip
        trend = " and ".join(word for word in words if word)
        if not trend:
            return ""
        why = (
            ""
            if self.supply is None
            else f": replenishment factor {self.supply:.2g}, the supply of oil decides"
        )
        return f"torque {trend} in a thick film (lambda > {THICK:g}){why}"


def unphysical_trend(
    nut_map: NutMap,
    preload: Any,
    speed: Any,
    temperature: Any,
    axial_load: Any = 0.0,
    supply: Callable[[Any, Any], Any] | None = None,
) -> Trend:
    """Trends at operating points; arguments of NutMap.evaluate, with the default friction parameters of the map.

    Parameters   supply : mechanistic law: replenishment factor over speed [rad/s] and temperature [K]
    Returns      Trend of booleans, arrays for arrays; False everywhere below the lowest speed of the map and outside
                 the map. Mechanistic law: True where the trend would be physical at constant supply
    """
    given = preload, speed, temperature, axial_load
    shape = np.broadcast_shapes(*(np.shape(a) for a in given))
    mechanistic = nut_map.law == MECHANISTIC
    if mechanistic and supply is None:
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

    def change(w: Any, t: Any, w_2: Any, t_2: Any) -> tuple[Any, Any, Any]:
        """Change of the torque from one point to another, that part of it that the supply makes, and what counts."""
        first, second = (nut_map.evaluate(preload, *at, axial_load) for at in ((w, t), (w_2, t_2)))
        supplied = 0.0
        if mechanistic and supply is not None:
            ratio = np.log(np.maximum(supply(w_2, t_2), TINY) / np.maximum(supply(w, t), TINY))
            supplied = 0.5 * (first.viscous_torque + second.viscous_torque) * ratio
        return second.friction_torque - first.friction_torque, supplied, MIN_CHANGE * first.friction_torque

    colder, hotter = np.maximum(temperature - 0.5 * STEP_K, cold), np.minimum(temperature + 0.5 * STEP_K, hot)
    slower = np.maximum(speed * np.exp(-0.5 * STEP_LN), slow)
    faster = np.minimum(speed * np.exp(0.5 * STEP_LN), fast)
    warmed, by_supply, limit = change(speed, colder, speed, hotter)
    rise = (warmed > limit) & ((supply is None) | (warmed - by_supply <= limit))
    sped, by_supply, limit = change(slower, temperature, faster, temperature)
    fall = (sped < -limit) & ((supply is None) | (sped - by_supply >= -limit))
    if not mechanistic or supply is None:
        return Trend((thick & rise)[()], (thick & fall)[()])
    factor = np.broadcast_to(np.asarray(supply(speed, temperature), dtype=float), shape)[()]
    return Trend((thick & rise)[()], (thick & fall)[()], factor)


def unlike_flanks(parameters: Parameters, preload: float, axial_load: float, torque: float) -> str:
    """One line if an axial load nearly frees oversize balls of two flanks, which a map follows in closed form; else "".

    Between held by all four flanks and free on two, the ball slips on the relieved ones (runtime.nut_law.freed_shear).

    Parameters   preload, axial_load : [N];  torque : [N m] with the motion of the ball between unlike flanks
    Source       ten example screws over the range of their maps, contacts in closed form: torque of the map off by
                 0.2 % from MIN_FORCE_RATIO on (2.6 % at most), below by 2 % in the mean, 9 % for 95 % of the points and
                 21 % at most; free of two flanks by 0.5 % (2.2 % at most)
    """
    if parameters.screw.preload_kind != FOUR_POINT or not preload > 0.0 or axial_load == 0.0:
        return ""
    relieved, loaded = sorted(nut_forces(parameters, preload, axial_load))
    if not 0.0 < relieved < MIN_FORCE_RATIO * loaded:
        return ""
    return (
        f"oversize balls slip on one set of flanks ({relieved:.3g} N, the other {loaded:.3g} N): map within some 10 %, "
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
    return (
        f"minimum film {1e9 * film:.2g} nm, below {1e9 * MIN_FILM:g} nm: oil is no continuum there, a "
        "map solves no contact with a central film below it"
    )
