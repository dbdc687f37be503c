"""A map before it is stored, without what makes it: a map is read faster than that is imported."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..parameters.file import Parameters
from ..physics.ball_law import Array

#: called with (finished, total, what) while a map is built
Progress = Callable[[int, int, str], None]
#: arrays of a map that depend on the film model, whose name follows
VISCOUS = "viscous_coefficients_"


@dataclass(frozen=True)
class BuiltMap:
    """A whole map before it is stored: header without friction defaults, spline arrays, parameters."""

    header: dict[str, Any]
    arrays: dict[str, Array]
    parameters: Parameters
