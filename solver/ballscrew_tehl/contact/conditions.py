"""Operating point, accuracy and scales of one contact, and the grid that fits them."""

import math
from dataclasses import dataclass, replace
from numbers import Integral
from typing import Any, Self

import numpy as np

from ..parameters.file import LubricantParameters, Parameters
from ..physics import film as film_formulas
from ..physics.ball_law import contact_angle_at_ball_load
from ..physics.hertz import E_prime, HertzContact, ellipse, reduced_radii
from ..physics.kinematics import surface_speeds
from .film.flow import LEAST_LAYERS
from .film.geometry import THICK_FILM
from .grid import INLET_SHAPE, LEAST_LINES, LEAST_NODES, Array, GridChoice

#: unit, least and largest of what a contact is given by: wider than any machine, so that no number overflows
RANGES = {
    "load": ("N", 1e-12, 1e9),
    "R_x": ("m", 1e-7, 1e3),
    "R_y": ("m", 1e-7, 1e6),
    "E_prime": ("Pa", 1e6, 1e14),
    "temperature": ("K", 1.0, 1000.0),
}
FASTEST = 1e4  # [m/s]


def number(name: str, value: Any, unit: str) -> float:
    """A single number as given; None, text, a truth value and an array are refused."""
    array = np.asarray(value)
    if array.ndim > 0 or array.dtype.kind not in "iuf":
        raise ValueError(f"{name} = {value!r} {unit}; needs a number")
    return float(value)


@dataclass(frozen=True)
class ContactConditions:
    """Operating point of one smooth contact, both speeds the same all over it.

    Parameters
    ----------
    load : float
        Load [N].
    R_x, R_y : float
        Reduced radii along and across rolling [m], R_x <= R_y.
    u_1, u_2 : float
        Surface speeds of the two bodies [m/s].
    temperature : float
        Temperature of the oil that enters and of the bodies [K].
    E_prime : float
        Reduced modulus 2/sum((1-nu^2)/E) [Pa].

    Raises
    ------
    ValueError
        A value out of range, R_x above R_y, or no entrainment.

    Examples
    --------
    >>> ContactConditions(60.0, 2e-3, 60e-3, 1.0, 1.0, 303.15, 226e9).u_e
    1.0
    """

    load: float
    R_x: float
    R_y: float
    u_1: float
    u_2: float
    temperature: float
    E_prime: float

    def __post_init__(self) -> None:
        for name, (unit, low, high) in RANGES.items():
            value = number(name, getattr(self, name), unit)
            if not low <= value <= high:
                raise ValueError(f"{name} = {value} {unit}; allowed: {low:g} to {high:g} {unit}")
        if not self.R_x <= self.R_y:
            raise ValueError(
                f"R_x = {self.R_x} m; needs R_x <= R_y = {self.R_y} m: x is the rolling direction"
            )
        u_1, u_2 = number("u_1", self.u_1, "m/s"), number("u_2", self.u_2, "m/s")
        if not (abs(u_1) <= FASTEST and abs(u_2) <= FASTEST and u_1 + u_2 != 0.0):
            needs = f"needs up to {FASTEST:g} m/s, u_1 + u_2 not 0: no oil is drawn in"
            raise ValueError(f"u_1, u_2 = {u_1}, {u_2} m/s; {needs}")

    @property
    def u_e(self) -> float:
        """Entrainment speed [m/s]."""
        return 0.5 * (self.u_1 + self.u_2)


#: fewest nodes, lines, layers and iterations of a solve; most, which then take hours
FEWEST = {"n_x": LEAST_NODES, "n_y": LEAST_LINES, "n_z": LEAST_LAYERS, "max_newton": 1, "max_thermal": 1}
MOST_NODES = 10_000
#: bounds of the other numbers of a solve
BOUNDS = {"extent": (0.25, 64), "density": (0.25, 64), "tolerance": (1e-15, 0.9), "warm_films": (2, 1e6)}


@dataclass(frozen=True)
class SolverOptions:
    """Accuracy and cost of a solve.

    Parameters
    ----------
    thermal : bool, optional
        Couple the energy equation.
    n_x, n_y, n_z : int, optional
        Nodes along and across rolling (half) and layers through the film; n_y None: by film and ellipse (choose_grid).
    tolerance : float, optional
        Of pressure [p_max] and temperature (relative to the largest rise).
    x_in, x_out : float, optional
        Inlet and outlet of the domain [b], with p = 0 there; None: wide enough for a flooded contact. x_in is also the
        meniscus of a starved one.
    y_max : float, optional
        Side of the domain [a], None likewise.
    warm_films : float, optional
        Gap, in films, up to which the energy equation is solved: oil enters there, or at x_in, with the inlet
        temperature. Twice as many change the film by 0.1 % at most (eight contacts of two screws).
    extent, density : float, optional
        Factors of the default domain and of the default number of lines over it.
    max_newton, max_thermal : int, optional
        Most iterations; of 1,000 contacts that converge, the isothermal ones take 4 to 90, the others 3 to 110 in both
        attempts.

    Raises
    ------
    ValueError
        An option out of range.

    Examples
    --------
    >>> SolverOptions(thermal=False).n_x
    129
    """

    thermal: bool = True
    n_x: int = 129
    n_y: int | None = None
    n_z: int = 8
    tolerance: float = 3e-5
    x_in: float | None = None
    x_out: float | None = None
    y_max: float | None = None
    warm_films: float = 400.0
    extent: float = 1.0
    density: float = 1.0
    max_newton: int = 150
    max_thermal: int = 150

    def __post_init__(self) -> None:
        if not isinstance(self.thermal, bool | np.bool_):
            raise ValueError(f"thermal = {self.thermal!r}; needs True or False")
        for name, bound in FEWEST.items():
            value = getattr(self, name)
            if name == "n_y" and value is None:
                continue
            if not (isinstance(value, Integral) and bound <= int(value) <= MOST_NODES):
                raise ValueError(f"{name} = {value!r}; needs a whole number >= {bound}, <= {MOST_NODES}")
        for name, (low, high) in BOUNDS.items():
            value = number(name, getattr(self, name), "of SolverOptions")
            if not low <= value <= high:
                raise ValueError(f"{name} = {value}; needs {low:g} to {high:g}")
        # the Hertz ellipse must lie inside
        for name, sign in (("x_in", -1.0), ("x_out", 1.0), ("y_max", 1.0)):
            value = getattr(self, name)
            if value is not None and not (1.0 < sign * number(name, value, "Hertz half-widths") < math.inf):
                relation = "<" if sign < 0.0 else ">"
                raise ValueError(f"{name} = {value}; needs finite, {relation} {sign:g} Hertz half-widths")

    def refined(self, factor: float) -> Self:
        """The truth check: nodes, lines, layers (in even numbers of cells) and extents times a factor of 1 to 8.

        The tolerance falls with the square. A given domain stays.
        """
        if not (1.0 <= number("refine", factor, "of the default") <= 8.0):
            raise ValueError(f"refine = {factor}; needs 1 <= refine <= 8")
        return replace(
            self,
            n_x=1 + 2 * round(0.5 * factor * (self.n_x - 1)),
            n_y=None if self.n_y is None else 1 + 2 * round(0.5 * factor * (self.n_y - 1)),
            n_z=2 * round(0.5 * factor * self.n_z),
            tolerance=self.tolerance / factor**2,
            warm_films=self.warm_films * factor,
            extent=self.extent * factor,
            density=self.density * factor,
        )


DEFAULT_OPTIONS = SolverOptions()
#: Moes M and least L of a narrow pressure in a cold fast film, and its lines over those of choose_grid. The spike, a
#: few spacings wide, moves through the lines with the load: over five loads within 10 %, on eight contacts of four
#: screws, mean rise and core pressure left their trend by 12 to 33 and 3 to 19 % before, by 2 to 12 and 1 to 16 % with
#: them; twice the lines are no better
NARROW_M, NARROW_L, NARROW_LINES = (15.0, 150.0), 20.0, 1.5


@dataclass(frozen=True)
class Scales:
    """Dimensionless numbers of one operating point."""

    hertz: HertzContact
    h_unit: float  # b^2/R_x [m]
    reynolds: float  # 12 eta0 u_e R_x^2/(b^3 p_max), with eta0 = 1 Pa s
    M: float
    L: float
    film_estimate: float  # [b^2/R_x], isothermal
    warm_film: float  # [b^2/R_x], expected thermal film


def inlet_length(film: float) -> float:
    """Distance [b] over which the Hertz gap (2 sqrt(2)/3) s^(3/2) outside a line opens by `film` [b^2/R_x]."""
    return (INLET_SHAPE * film) ** (2.0 / 3.0)


def expected_cells(c: ContactConditions, oil: LubricantParameters, options: SolverOptions) -> float:
    """Cells of the grid of an operating point in its expected inlet."""
    scales = scales_of(c, oil)
    x = choose_grid(c, scales, scales.film_estimate, options).build().x
    return cells_in_inlet(x, scales.film_estimate)


def cells_in_inlet(x: Array, film: float) -> float:
    """Cells of the nodes x [b] in the inlet length of the central line for a film [b^2/R_x]."""
    k = int(np.searchsorted(x, -1.0))
    return inlet_length(max(film, 0.0)) / float(x[k] - x[k - 1])


def scales_of(c: ContactConditions, oil: LubricantParameters) -> Scales:
    """Dimensionless numbers of an operating point."""
    hertz = HertzContact(*map(float, ellipse(c.load, c.R_x, c.R_y, c.E_prime)))
    b, p_max, u_e = hertz.b, hertz.p_max, abs(c.u_e)
    groups = film_formulas.moes_groups(oil, c.load, u_e, c.R_x, c.E_prime, c.temperature)
    h_c = float(film_formulas.central_film_estimate(oil, groups, c.R_x, c.R_y, p_max, c.temperature))
    h_unit = b * b / c.R_x
    N = film_formulas.thermal_load_parameter(oil, u_e, c.temperature)
    # the formula reduces thin films too much: half of it, in the logarithm
    left = math.sqrt(float(film_formulas.wilson_sheu(N, abs(c.u_1 - c.u_2) / u_e)))
    reynolds = 12.0 * u_e * c.R_x**2 / (b**3 * p_max)
    return Scales(hertz, h_unit, reynolds, groups.M, groups.L, h_c / h_unit, left * h_c / h_unit)


FILM_STEPS = 4.0  # steps of a doubled film in which grids differ: neighbouring points share one
#: least inlet, outlet [b] and side [a] of the domain, and where the wedges of inlet and outlet begin [b]
LEAST_DOMAIN, WEDGES_FROM = (2.5, 1.5, 1.25), (1.5, 1.25)
#: wedges to inlet, outlet and side of a thin film, and more per film [b^2/R_x] up to THICK_FILM (to the side up to 1),
#: to the inlet with a part over b/a: 250 on a long ellipse, 110 on a circle
INLET_WEDGES, OUTLET_WEDGES, SIDE_WEDGES = (12.0, 40.0, 9.0), (1.0, 2.5), (4.0, 2.0)
#: lines per half-width: without side lobes and more with them, which narrow with b/a over film and are those of an
#: ellipse rounder than ROUND; per wedge across, and more of round contacts in thin films
LINES, LOBES, ROUND, LINES_PER_WEDGE, THIN = (11.0, 49.0), (0.1, 1.3), 0.3, (3.6, 14.0), 0.3


def choose_grid(c: ContactConditions, scales: Scales, film: float, options: SolverOptions) -> GridChoice:
    """Domain and lines for an expected film [b^2/R_x]; rounded, so that neighbouring points share a grid.

    wedge: distance over which the undeformed gap opens by one film. A flattened contact feels the inlet over a dozen of
    them (a gap of 150 films). A film thicker than the flattening is carried by the wedge alone, whose pressure falls
    with the third power of the distance: the inlet goes farther (beyond, GMRES needs too many iterations), the outlet
    past the inclined line of cavitation. Across, the side is open and four to six wedges are enough. The Hertz edge is
    on a line; side lobes of a wide ellipse are narrower the thinner the film; thick films need two lines per wedge.
    """
    kappa, extent, density = scales.hertz.b / scales.hertz.a, options.extent, options.density
    curvature_y = c.R_x / c.R_y / kappa**2
    if NARROW_M[0] <= scales.M <= NARROW_M[1] and scales.L >= NARROW_L:
        density *= NARROW_LINES
    film = 2.0 ** (math.ceil(FILM_STEPS * math.log2(film)) / FILM_STEPS)
    wedge, wedge_y, thick = math.sqrt(2.0 * film), math.sqrt(2.0 * film / curvature_y), min(film, THICK_FILM)
    inlet = INLET_WEDGES[0] + (INLET_WEDGES[1] + INLET_WEDGES[2] / kappa) * thick
    outlet = OUTLET_WEDGES[0] + OUTLET_WEDGES[1] * thick
    side = (SIDE_WEDGES[0] + SIDE_WEDGES[1] * min(film, 1.0)) * wedge_y
    x_in = options.x_in or -extent * max(LEAST_DOMAIN[0], WEDGES_FROM[0] + inlet * wedge)
    x_out = options.x_out or extent * max(LEAST_DOMAIN[1], WEDGES_FROM[1] + outlet * wedge)
    lobes = min(1.0, LOBES[0] * kappa / film) ** LOBES[1] * min(1.0, (kappa / ROUND) ** 2)
    round_ = LINES_PER_WEDGE[1] * kappa**1.5 * min(1.0, THIN / film) ** 2
    per_half_width = min(LINES[0] + LINES[1] * lobes, (LINES_PER_WEDGE[0] + round_) / wedge_y)
    if per_half_width > 2.0:
        per_half_width = float(round(per_half_width))
    y_max, lines = options.y_max, options.n_y
    if y_max is None:
        y_max = extent * max(LEAST_DOMAIN[2], math.sqrt(1.0 + side**2))
        y_max = 2.0 * math.ceil(0.5 * y_max * per_half_width - 1e-9) / per_half_width
    if lines is None:
        # an odd number, so that every other line makes the coarse grid; LEAST_LINES after two halvings
        lines = max(1 + 4 * (LEAST_LINES - 1), 1 + 2 * round(0.5 * y_max * per_half_width))
        lines = 1 + 2 * round(0.5 * density * (lines - 1))
    return GridChoice(x_in, x_out, y_max, options.n_x, lines, inlet_length(film), options.y_max is None)


#: nodes along rolling of a direct solve; the film is extrapolated from these and half of them
MAP_NODES = 97
#: Moes M and least L where a rigid contact becomes a flattened one, which takes the default of SolverOptions: on 97
#: nodes the pressure spike, a few spacings wide there, moved films by 1.5 % and one rolling loss by 7 % in nine
#: contacts, on 129 by 0.5 %
SPIKE_M, SPIKE_L = (15.0, 80.0), 15.0


def ball_conditions(
    parameters: Parameters, raceway: str, load: float, speed: float, temperature: float
) -> ContactConditions:
    """Conditions of the contact of a ball at the contact angle under its load.

    Parameters
    ----------
    parameters : Parameters
        Screw, oil and kinematics.
    raceway : str
        Raceway that the ball touches, "screw" or "nut".
    load : float
        Ball load [N], > 0.
    speed : float
        Speed of the screw [rad/s], > 0.
    temperature : float
        Temperature of oil and bodies [K].

    Returns
    -------
    ContactConditions
        Operating point of the contact.

    Raises
    ------
    ValueError
        A value out of range.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> conditions = ball_conditions(load_screw(), "screw", 60.0, 104.7, 303.15)
    >>> f"{1e3 * conditions.R_x:.2f} mm"
    '2.19 mm'
    """
    screw = parameters.screw
    load, speed = number("load", load, "N"), number("speed", speed, "rad/s")
    temperature = number("temperature", temperature, "K")
    if not (0.0 < speed < math.inf):
        raise ValueError(f"speed = {speed} rad/s; needs finite, > 0: the other way round is the mirror image")
    angle = float(contact_angle_at_ball_load(screw, load))
    R_x, R_y = (float(r) for r in reduced_radii(screw, angle, raceway))
    speeds = surface_speeds(parameters, raceway, speed)
    u_1, u_2 = float(speeds.u_1), float(speeds.u_2)
    return ContactConditions(load, R_x, R_y, u_1, u_2, temperature, E_prime(screw))


def map_nodes(conditions: ContactConditions, oil: LubricantParameters) -> int:
    """Nodes along rolling that a direct solve takes."""
    scales = scales_of(conditions, oil)
    sharp = SPIKE_M[0] <= scales.M <= SPIKE_M[1] and scales.L >= SPIKE_L
    return DEFAULT_OPTIONS.n_x if sharp else MAP_NODES
