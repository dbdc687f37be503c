"""Numbers that carry a derivative: the law of the nut (nut_law.py) computed with them returns its slope as well.

Standard library only: this module travels inside the FMU BallScrewPreloadMonitor.
"""

import math
from typing import Any

from ballscrew_tehl.runtime.bspline import Axis
from ballscrew_tehl.runtime.nut_law import Ops


class Dual:
    """Value and derivative over one variable; the other operand may be a float."""

    __slots__ = ("slope", "value")

    def __init__(self, value: float, slope: float) -> None:
        self.value = value
        self.slope = slope

    def __add__(self, other: Any) -> "Dual":
        if other.__class__ is Dual:
            return Dual(self.value + other.value, self.slope + other.slope)
        return Dual(self.value + other, self.slope)

    __radd__ = __add__

    def __sub__(self, other: Any) -> "Dual":
        if other.__class__ is Dual:
            return Dual(self.value - other.value, self.slope - other.slope)
        return Dual(self.value - other, self.slope)

    def __rsub__(self, other: float) -> "Dual":
        return Dual(other - self.value, -self.slope)

    def __mul__(self, other: Any) -> "Dual":
        if other.__class__ is Dual:
            return Dual(self.value * other.value, self.slope * other.value + self.value * other.slope)
        return Dual(self.value * other, self.slope * other)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> "Dual":
        if other.__class__ is Dual:
            ratio = self.value / other.value
            return Dual(ratio, (self.slope - ratio * other.slope) / other.value)
        return Dual(self.value / other, self.slope / other)

    def __rtruediv__(self, other: float) -> "Dual":
        ratio = other / self.value
        return Dual(ratio, -ratio * self.slope / self.value)

    def __pow__(self, exponent: float) -> "Dual":
        """value >= 0 or a whole exponent; at 0 the derivative counts as 0."""
        power = self.value**exponent
        return Dual(power, exponent * power / self.value * self.slope if self.value else 0.0)

    def __lt__(self, other: Any) -> bool:
        return bool(self.value < (other.value if other.__class__ is Dual else other))

    def __gt__(self, other: Any) -> bool:
        return bool(self.value > (other.value if other.__class__ is Dual else other))


def _exp(x: Dual) -> Dual:
    value = math.exp(x.value)
    return Dual(value, value * x.slope)


def _where(condition: bool, yes: Dual, no: float) -> Dual:
    return yes if condition else Dual(no, 0.0)


def _place(axis: Axis, x: Dual) -> tuple[int, Dual]:
    """Cell of a value on an axis and position in it, constant beyond the axis."""
    cell, t = axis.place(x.value)
    if not axis.lo < x.value < axis.hi:
        return cell, Dual(t, 0.0)
    return cell, Dual(t, axis.scale * (x.slope / x.value if axis.logarithmic else x.slope))


DUALS = Ops(_exp, min, max, _where, _place)
