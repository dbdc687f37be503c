"""Friction over the signed speed of an axis and its units; both directions at common speeds: mean and difference."""

import math
from statistics import NormalDist
from typing import NamedTuple, Self

import numpy as np
import scipy

from ballscrew_tehl.numerics import Array
from ballscrew_tehl.parameters.units import RPM

#: of two-sided 95 % limits, and their standard deviations
PROBABILITY = 0.975
LIMIT = NormalDist().inv_cdf(PROBABILITY)
#: chance that a difference that is the same at all speeds is taken for one that varies
CHANCE = 1e-3


class Units(NamedTuple):
    """Keys of JSON, unit of speed [SI]; names of inertia, speed, effort; units of speed, effort; as shown."""

    inertia: str
    offset: str
    speed: str
    effort: str
    place: str
    one: float
    names: tuple[str, str, str]
    si: tuple[str, str]
    shown: tuple[str, str, str]

    def effort_key(self, part: str = "") -> str:
        """Key of the effort, or of its part: low, high, error, residual."""
        return self.effort.format(f"{part}_" if part else "")


LINEAR = Units(
    "mass_{}kg", "offset_{}n", "velocity_m_s", "force_{}n", "position_m", 1.0,
    ("mass", "velocity", "force"), ("m/s", "N"), ("kg", "N", "m/s"),
)  # fmt: skip
ROTARY = Units(
    "inertia_{}kgm2", "offset_{}nm", "speed_rpm", "torque_{}nm", "angle_rad", RPM,
    ("inertia", "speed", "torque"), ("rad/s", "N.m"), ("kg m2", "N m", "r/min"),
)  # fmt: skip


#: by whether an axis is that of a screw
UNITS = {False: LINEAR, True: ROTARY}


def option(key: str) -> str:
    """Option of the command line for a key."""
    return f"--{key.format('').replace('_', '-')}"


class Friction(NamedTuple):
    """Bins of speed in rising order: speed, friction without the offset, standard error, 95 % limits, samples."""

    speed: Array
    value: Array
    error: Array
    low: Array
    high: Array
    samples: np.ndarray


class Bidirectional(NamedTuple):
    """At common speeds > 0: half the sum and difference of magnitudes, their error without that of an offset."""

    speed: Array
    mean: Array
    difference: Array
    error: Array

    def at_screw(self, lead: float) -> Self:
        """Speed [rad/s] and torque [N.m] at a screw of this lead [m/rad], from those of a linear axis."""
        return type(self)(self.speed / lead, *(values * lead for values in self[1:]))

    def where(self, keep: np.ndarray) -> Self:
        """A part of the speeds."""
        return type(self)(*(values[keep] for values in self))

    @property
    def span(self) -> str:
        """Range of the speeds of a screw."""
        return f"{self.speed.min() / RPM:.4g} to {self.speed.max() / RPM:.4g} r/min"


def weights(error: Array) -> Array:
    """1/error^2; errors of 0, of signals without noise, count as the least other one."""
    least = float(np.min(error, where=error > 0.0, initial=math.inf))
    return np.asarray(np.maximum(error, least if math.isfinite(least) else 1.0) ** -2.0)


def bidirectional_friction(friction: Friction, offset_error: float = 0.0) -> Bidirectional:
    """At the speeds that both directions have; offset_error: of a known offset, which the bins hold."""
    back = friction.speed < 0.0
    other = friction.speed[back]
    if not len(other):
        return Bidirectional(*[np.empty(0)] * 4)
    both = (friction.speed >= -0.97 * other[-1]) & (friction.speed <= -1.03 * other[0])
    speed, value = friction.speed[both], friction.value[both]
    half = 0.5 * (friction.high - friction.low) / LIMIT
    against, half_back = (np.interp(-speed, other, values[back]) for values in (-friction.value, half))
    error = 0.5 * np.sqrt(np.maximum(half[both] ** 2 + half_back**2 - 2.0 * offset_error**2, 0.0))
    return Bidirectional(speed, 0.5 * (value + against), 0.5 * (value - against), error)


def varies(both: Bidirectional) -> bool:
    """Whether the difference of the directions depends on speed, so that it cannot all be an offset."""
    if len(both.speed) < 2:
        return False
    weight = weights(both.error)
    squares = float(np.sum(weight * (both.difference - np.average(both.difference, weights=weight)) ** 2))
    return squares > float(scipy.special.chdtri(len(weight) - 1, CHANCE))
