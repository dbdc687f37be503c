"""Operating point, accuracy and scales of one contact, and the grid that fits them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .. import film as film_formulas
from ..hertz import HertzContact, ellipse
from ..parameters import LubricantParameters
from .reynolds import GridChoice


@dataclass(frozen=True)
class ContactConditions:
    """Operating point of one contact.

    load [N], R_x along and R_y across rolling [m] (R_x <= R_y), u_1, u_2 surface speeds [m/s] of the two bodies,
    temperature of the oil that enters and of the bodies [K], E_prime = 2/sum((1-nu^2)/E) [Pa].
    """

    load: float
    R_x: float
    R_y: float
    u_1: float
    u_2: float
    temperature: float
    E_prime: float

    def __post_init__(self) -> None:
        for name, unit in (
            ("load", "N"),
            ("R_x", "m"),
            ("R_y", "m"),
            ("E_prime", "Pa"),
            ("temperature", "K"),
        ):
            value = getattr(self, name)
            if not (value > 0.0 and math.isfinite(value)):
                raise ValueError(f"{name} = {value} {unit}; needs finite, > 0")
        if not self.R_x <= self.R_y:
            raise ValueError(
                f"R_x = {self.R_x} m; needs R_x <= R_y = {self.R_y} m: x is the rolling direction"
            )
        if not (math.isfinite(self.u_1) and math.isfinite(self.u_2) and self.u_1 + self.u_2 != 0.0):
            raise ValueError(
                f"u_1, u_2 = {self.u_1}, {self.u_2} m/s; needs finite with u_1 + u_2 not 0: no oil is drawn in"
            )

    @property
    def u_e(self) -> float:
        """Entrainment speed [m/s]."""
        return 0.5 * (self.u_1 + self.u_2)


@dataclass(frozen=True)
class SolverOptions:
    """Accuracy and cost of a solve.

    thermal: couple the energy equation; n_x, n_y, n_z: nodes along, across (half; None = 17 for a long
    ellipse to 33 for a circle) and layers through the film;
    tolerance of pressure [p_max] and of temperature (relative to the largest rise). x_in, x_out [b], y_max [a]:
    domain, None = wide enough not to starve.
    """

    thermal: bool = True
    n_x: int = 129
    n_y: int | None = None
    n_z: int = 10
    tolerance: float = 1e-5
    x_in: float | None = None
    x_out: float | None = None
    y_max: float | None = None
    max_newton: int = 300
    max_thermal: int = 500

    def __post_init__(self) -> None:
        least = {"n_x": 17, "n_y": 5, "n_z": 4, "max_newton": 1, "max_thermal": 1}
        for name, bound in least.items():
            value = getattr(self, name)
            if not (value is None or value >= bound):
                raise ValueError(f"{name} = {value}; needs a whole number >= {bound}")
        if not (0.0 < self.tolerance < 1.0):
            raise ValueError(
                f"tolerance = {self.tolerance}; needs > 0, < 1: relative to the largest pressure"
            )
        # the Hertz ellipse must lie inside
        for name, sign in (("x_in", -1.0), ("x_out", 1.0), ("y_max", 1.0)):
            value = getattr(self, name)
            if not (value is None or (sign * value > 1.0 and math.isfinite(value))):
                relation = "<" if sign < 0.0 else ">"
                raise ValueError(f"{name} = {value}; needs finite, {relation} {sign:g} Hertz half-widths")


DEFAULT_OPTIONS = SolverOptions()


@dataclass(frozen=True)
class Scales:
    """Dimensionless numbers of one operating point."""

    hertz: HertzContact
    h_unit: float  # b^2/R_x [m]
    reynolds: float  # 12 eta0 u_e R_x^2/(b^3 p_max), with eta0 = 1 Pa s
    M: float
    L: float
    film_estimate: float  # [b^2/R_x]
    inlet: float  # [b]


def inlet_length(film: float) -> float:
    """Distance [b] over which the Hertz gap (2 sqrt(2)/3) s^(3/2) outside a line opens by `film` [b^2/R_x]."""
    return (1.06 * film) ** (2.0 / 3.0)


def scales_of(c: ContactConditions, oil: LubricantParameters) -> Scales:
    hertz = ellipse(c.load, c.R_x, c.R_y, c.E_prime)
    a, b, p_max = float(hertz.a), float(hertz.b), float(hertz.p_max)
    hertz = HertzContact(a, b, p_max, float(hertz.delta))
    u_e = abs(c.u_e)
    groups = film_formulas.moes_groups(oil, c.load, u_e, c.R_x, c.E_prime, c.temperature)
    h_c = float(film_formulas.central_film_estimate(oil, groups, c.R_x, c.R_y, p_max, c.temperature))
    h_unit = b * b / c.R_x
    return Scales(
        hertz,
        h_unit,
        12.0 * u_e * c.R_x**2 / (b**3 * p_max),
        groups.M,
        groups.L,
        h_c / h_unit,
        inlet_length(h_c / h_unit),
    )


def choose_grid(options: SolverOptions, film: float, curvature_y: float, kappa: float) -> GridChoice:
    """Domain and refinement for an expected film [b^2/R_x]; rounded, so that neighbouring points share a grid.

    The inlet begins where the gap is about thirty films, the sides end where it is about ten.
    """
    wedge = math.sqrt(2.0 * film)
    x_in = -max(2.5, _round_up(5.5 * wedge))
    x_out = max(1.5, _round_up(1.5 * wedge))
    y_max = max(1.5, _round_up(math.sqrt(1.0 + 15.0 * film / curvature_y)))
    inlet = 2.0 ** (round(4.0 * math.log2(inlet_length(film))) / 4.0)
    n_y = options.n_y if options.n_y is not None else 17 + 2 * round(8.0 * kappa)
    if y_max > 2.5 and options.n_y is None:
        n_y += 8
    return GridChoice(
        options.x_in or x_in, options.x_out or x_out, options.y_max or y_max, options.n_x, n_y, inlet
    )


def _round_up(value: float) -> float:
    """Next of a geometric row with eight steps per doubling."""
    return float(2.0 ** (math.ceil(8.0 * math.log2(value)) / 8.0))
