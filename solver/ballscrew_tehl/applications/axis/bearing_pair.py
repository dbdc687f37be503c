"""Friction torque of a pair of support bearings, or of one bearing with two rows, from what catalogues print.

Each row is a caged ball bearing by the mechanistic law (applications.bearing), in which nothing is fitted to bearings;
balls, preload and loads: bearing_row.

A printed torque conditions the boundary friction, and where that ends at its bounds the level: lubricants of VG 22 to
150 have the same torque within 3 % at low speed. Catalogues print neither speed nor oil: 5 r/min, 25 C and this
lubricant are assumed.

Support bearings are greased: the rolling part has SKF's replenishment factor of grease, and its interval reaches to a
flooded row.

Interval, about 80 %: the constants of friction.interval, what of UNKNOWN is not printed, and CATALOGUE. A printed
torque replaces CATALOGUE and the bounds of the boundary friction: the range that is printed, or parts.SPREAD around one
number, counts at all speeds, with half of what the boundary friction cannot explain of it.

Not modelled: churning and running in of grease, cage, radial load, moments, heat that changes the preload.
"""

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import ValidationError

from ...friction.film_shear import TorqueParts
from ...friction.interval import (
    DEVIATIONS,
    Effects,
    OperatingPoint,
    effects_at,
    ends_of,
    uniform_moments,
    unknown_constants,
)
from ...friction.mechanistic import replenished
from ...numerics import Array
from ...nut_map.grid import THICKEST_OIL, THINNEST_OIL
from ...parameters.axis import Range, SupportBearingParameters
from ...parameters.file import LubricantParameters, Parameters
from ...parameters.friction import BoundedConstant
from ...parameters.toml import FieldError
from ...parameters.units import RPM
from ...physics.lubricant import eta0
from ...physics.rating import STATIC_PRESSURE, ball_pressure, bearing_rating
from ..bearing import CAGED, SLOWEST, TEMPERATURES, needs
from .bearing_row import (
    BOUNDARY,
    FILLED,
    STARVED,
    TEST_SPEED,
    TEST_TEMPERATURE,
    UNKNOWN,
    Row,
    balls_of,
    pair_stiffness,
    row_forces,
    row_of,
)
from .parts import middle, spread

#: law over printed torque at the ends of an 80 % interval, a factor: the least in steps of 0.05 with which the interval
#: holds 80 % of the torques of examples/support_bearings.csv, the only number that is taken from them: 1.71. Without
#: one maker 1.71 to 1.79, without IBC, whose torques go as the preload, 1.25
CATALOGUE = 1.75
#: contact seals have the torque of the rows at TEST_SPEED where nothing is printed, within this factor (assumed). INA
#: prints 2RS as twice 2Z: of a printed torque they have half
SEAL_SPREAD = 2.0
#: highest speed times pitch diameter [mm r/min]: catalogues allow about 200 000 with grease, 300 000 with oil [memory]
FASTEST = 3e5
#: speeds between which ends of intervals are interpolated: 5 to 3000 r/min, 0.6 % of them
NODES = 13
_SI = {"length": " m", "force": " N", "stiffness": " N/m", "torque": " N.m", "angle": " rad"}


class BearingPairTorque(NamedTuple):
    """Torque of both rows by part, with its interval and that of the seals; floats, or (s,) at several speeds.

    Attributes
    ----------
    rolling, sliding, hysteresis : float or array
        Of both rows, as BearingTorque [N.m].
    rows, low, high : float or array
        Their sum with its interval of about 80 % [N.m].
    seals : (float, float, float)
        Value, low and high end of the seals [N.m].
    total, total_low, total_high : float or array
        Rows and seals; their deviations are independent [N.m].
    in_range : bool
        Whether the law holds at all of the speeds.
    why : str
        Why not, or "".
    """

    rolling: Any
    sliding: Any
    hysteresis: Any
    rows: Any
    low: Any
    high: Any
    seals: tuple[float, float, float]
    total: Any
    total_low: Any
    total_high: Any
    in_range: bool
    why: str


class BearingPair(NamedTuple):
    """Pair of support bearings as the friction law takes it.

    Attributes
    ----------
    row : Row
        One of two equal rows, with its preload.
    unknown : tuple of (BoundedConstant, Row, Row)
        What of UNKNOWN is not printed, and the row at both ends.
    printed : (float, float) or None
        ln(printed torque/torque of the rows) there, 0 unless the boundary friction is at an end of its bounds, and the
        standard deviation of the former; None: no torque is printed.
    seals : (float, float, float)
        Torque of contact seals, value, low and high end [N.m].
    notes : tuple of str
        How what is not printed was found, and printed numbers that contradict each other.
    """

    row: Row
    unknown: tuple[tuple[BoundedConstant, Row, Row], ...]
    printed: tuple[float, float] | None
    seals: tuple[float, float, float]
    notes: tuple[str, ...]

    @property
    def level(self) -> float:
        """Factor on the law, 1 unless a printed torque is beyond the bounds of the boundary friction."""
        return 1.0 if self.printed is None else math.exp(self.printed[0])

    @property
    def axial_stiffness(self) -> float:
        """Axial stiffness under the preload alone by the contacts [N/m]."""
        screw = self.row.parameters.screw
        return pair_stiffness(screw, screw.loaded_ball_count, self.row.preload)

    @property
    def dynamic_rating(self) -> float:
        """C_a of one row by ISO 281 [N]."""
        return bearing_rating(self.row.parameters.screw)

    def torque(self, axial_load: float, speed: Any, temperature: float) -> BearingPairTorque:
        """Friction torque of the screw against the housing.

        Parameters
        ----------
        axial_load : float
            Load of the screw on the pair [N], of any sign.
        speed : float or (s,) array
            Speed [rad/s], >= bearing.SLOWEST.
        temperature : float
            Temperature of the lubricant [K].

        Returns
        -------
        BearingPairTorque
            Torque by part, with interval and range.

        Raises
        ------
        ValueError
            An argument out of range.
        ArithmeticError
            The equilibrium of a ball did not converge.
        """
        place = load, speeds, _ = _checked(axial_load, speed, temperature)
        found, (seals, low, high) = (
            TorqueParts(*(self.level * of for of in self.row.parts(*place))),
            self.seals,
        )
        rows = np.reshape(found.total, (-1, 1))
        ends = [rows * end for end in self._over_speed(*place)]
        total, below, above = (
            rows + seals, np.hypot(rows - ends[0], seals - low), np.hypot(ends[1] - rows, high - seals)
        )  # fmt: skip
        parts = found.viscous, found.sliding, found.hysteresis + 0.0 * rows, rows, *ends
        columns = [np.reshape(of, -1) for of in (*parts, total, total - below, total + above)]
        shown: list[Any] = [of[0].item() for of in columns] if np.ndim(speed) == 0 else columns
        why = self.why_not(load, float(speeds.max()), float(temperature))
        shown[6:6] = [self.seals]
        return BearingPairTorque._make([*shown, not why, why])

    def table(self, speeds: Array, temperatures: Array, axial_load: float = 0.0) -> Array:
        """Torque of the rows (s, t) [N.m] at speeds (s,) [rad/s] and temperatures (t,) [K], without intervals."""
        total = self.level * self.row.parts(*_checked(axial_load, speeds, temperatures)).total
        return np.reshape(total, (np.size(speeds), np.size(temperatures)))

    def _over_speed(self, load: float, speeds: Array, temperatures: Array) -> tuple[Array, Array]:
        """Ends of the interval over the torque of the rows (s, 1), between NODES of many speeds."""
        from scipy.interpolate import CubicSpline

        if speeds.size <= NODES:
            return self._ends(load, speeds, temperatures)
        nodes = np.geomspace(speeds.min(), speeds.max(), NODES)[:, None]
        low, high = (np.log(end).ravel() for end in self._ends(load, nodes, temperatures))
        place, at = np.log(nodes).ravel(), np.log(speeds)
        return np.exp(CubicSpline(place, low)(at)), np.exp(CubicSpline(place, high)(at))

    def _ends(self, *place: Any) -> tuple[Array, Array]:
        """The same at each speed, as friction.interval has it."""
        row, rows, printed = self.row, self.row.parts(*place).total, self.printed
        names = unknown_constants(row.parameters)

        def effects(load: float, speeds: Any, temperatures: Any) -> Effects:
            point = _Point(row.preload, speeds, temperatures, load)
            return effects_at(row.parameters, point, row.contacts, CAGED, names)

        here, moments = effects(*place), []
        for constant, *of_ends in self.unknown:
            low, high = (np.log(end.parts(*place).total / rows) for end in of_ends)
            moments.append(uniform_moments(low, high, constant.place(constant.value)))
        for name in here.mean:
            moments.append((here.mean[name][0], here.deviation[name][0] ** 2))
        if printed is None:
            moments.append((0.0, (math.log(CATALOGUE) / DEVIATIONS) ** 2))
        else:
            # one factor at all speeds: the boundary friction has its part at low ones only, but what else makes
            # a torque differ from the print is not known to end there; half of what the friction cannot explain
            moments.append((0.0, printed[1] ** 2 + (0.5 * printed[0]) ** 2))
        mean, variance = (sum(of) for of in zip(*moments, strict=True))
        return ends_of(mean, variance)

    def why_not(self, axial_load: float, speed: float, temperature: float) -> str:
        """What is beyond the range of the law at a load [N], speed [rad/s] and temperature [K], "": nothing."""
        parameters = self.row.parameters
        screw, oil = parameters.screw, parameters.lubricant
        force = row_forces(screw, self.row.preload, axial_load)[1]
        supply = float(np.min(replenished(parameters, np.array(speed), np.array([temperature]))))
        numbers = (
            ("speed times diameter", 2e3 * screw.nominal_radius * speed / RPM, 0.0, FASTEST, "mm r/min"),
            ("viscosity", float(eta0(oil, temperature)), THINNEST_OIL, THICKEST_OIL, "Pa s"),
            ("replenishment", supply, STARVED, 1.0, "of a flooded row, or its torque falls with speed"),
            ("pressure of a ball", ball_pressure(screw, force / screw.loaded_ball_count), 0.0, STATIC_PRESSURE, "Pa"),
        )  # fmt: skip
        return "; ".join(
            f"{name} = {value:.3g}; needs {low:.3g} to {high:.3g} {unit}"
            for name, value, low, high, unit in numbers
            if not low <= value <= high
        )


class _Point(OperatingPoint):
    """Point with arrays of speeds and temperatures, whose nuts are both rows."""

    def forces(self, parameters: Parameters, factor: float = 1.0) -> tuple[float, float]:
        return row_forces(parameters.screw, factor * self.preload, self.axial_load)


def _checked(axial_load: float, speeds: Any, temperatures: Any) -> tuple[float, Array, Array]:
    """Load, speeds (s, 1) and temperatures (t,) in range."""
    low, high = TEMPERATURES
    n, T = np.asarray(speeds, float).reshape(-1, 1), np.asarray(temperatures, float).reshape(-1)
    needs(math.isfinite(axial_load), "axial_load", axial_load, "N", "finite", "0 is the preload alone")
    good, slow = np.all((n >= SLOWEST) & np.isfinite(n)), "below it the torque no longer depends on speed"
    needs(bool(good) and n.size > 0, "speed", speeds, "rad/s", f"finite, >= {SLOWEST:g}", slow)
    good = np.all((low <= T) & (high >= T))
    allowed = f"{low:g} to {high:g}"
    needs(bool(good) and T.size > 0, "temperature", temperatures, "K", allowed, "is it in kelvin?")
    return float(axial_load), n, T


def _pair(table: SupportBearingParameters, law: Mapping[str, Any]) -> BearingPair:
    """The pair of a table of the screw file; law: keywords of bearing."""
    supply, given = "replenishment_constant", law.get("friction") or {}
    row, names, notes = row_of(table, law), ["groove", *[supply] * (supply not in given)], []
    ball, balls, how = balls_of(table, UNKNOWN["fill"].value)
    if how:
        notes.append(f"{balls} balls of {1e3 * ball:.3g} mm by C_a and {how}")
        names += ["fill"] * (how == FILLED)
        if table.contact_angle <= 0.25 * math.pi:
            notes.append(
                "contact_angle: below 45 degrees ISO 281 has another formula of C_a than the one taken"
            )
    pair, contact = BearingPair(row, (), None, (0.0, 0.0, 0.0), ()), table.seals == "contact"
    stiffness, printed, known = pair.axial_stiffness, table.axial_stiffness, UNKNOWN["stiffness"]
    if table.preload is None:
        names.append("stiffness")
        notes.append(f"preload {row.preload:.4g} N by the stiffness")
    elif printed is not None and not known.low <= printed / stiffness <= known.high:
        both = f"{1e-6 * printed:.4g} N/um printed, {1e-6 * stiffness:.4g} N/um by the balls at the preload"
        notes.append(f"axial_stiffness: {both}: one of the numbers is of another bearing")
    unknown = []
    for name in names:
        low, high = (row_of(table, law, **{name: end}) for end in (UNKNOWN[name].low, UNKNOWN[name].high))
        unknown.append((UNKNOWN[name], low, high))
    pair = pair._replace(unknown=tuple(unknown))
    if table.friction_torque is None:
        if contact:
            torque, how = row.at_test, f"as the rows at 5 r/min, within a factor of {SEAL_SPREAD:g}"
            pair = pair._replace(seals=(torque, torque / SEAL_SPREAD, torque * SEAL_SPREAD))
            notes.append(f"contact seals: {how}: nothing is printed")
        return pair._replace(notes=tuple(notes))
    share = 0.5 if contact else 1.0
    torque, (least, most) = share * middle(table.friction_torque), spread(table.friction_torque)
    law_torque, *ends = pair.torque(0.0, TEST_SPEED, TEST_TEMPERATURE)[3:6]
    where = f"friction_torque: {torque:.3g} N.m of the rows printed, {law_torque:.3g} N.m by the law"
    if not ends[0] <= torque <= ends[1]:
        notes.append(f"{where}, interval {ends[0]:.3g} to {ends[1]:.3g}: the printed numbers do not fit")
    row = row.with_torque(torque)
    left = math.log(torque / row.at_test)
    return BearingPair(
        row,
        tuple((of, low.with_torque(torque), high.with_torque(torque)) for of, low, high in unknown),
        (left, 0.5 * math.log(most / least) / DEVIATIONS),
        (torque, share * least, share * most) if contact else (0.0, 0.0, 0.0),
        tuple(notes),
    )


def bearing_pair(
    bore: float,
    outer_diameter: float,
    *,
    pitch_diameter: float | None = None,
    ball_diameter: float | None = None,
    balls: int | None = None,
    contact_angle: float = math.pi / 3.0,
    dynamic_rating: float | None = None,
    axial_stiffness: float | None = None,
    preload: float | None = None,
    friction_torque: float | Range | None = None,
    seals: Literal["none", "contact"] = "none",
    iso_vg: int = 68,
    viscosity_index: float = 95.0,
    oil: LubricantParameters | None = None,
    friction: Mapping[str, Any] | None = None,
) -> BearingPair:
    """Pair of support bearings of a ball screw, or one with two rows, from what its catalogue prints.

    Parameters
    ----------
    bore, outer_diameter : float
        Diameters [m].
    pitch_diameter : float, optional
        Of the ball centres [m]; default: mean of both.
    ball_diameter : float, optional
        Ball [m].
    balls : int, optional
        Balls of one row.
    contact_angle : float, optional
        Contact angle without load [rad].
    dynamic_rating : float, optional
        Axial rating C_a as printed, of one row [N].
    axial_stiffness : float, optional
        Of the pair under its preload [N/m].
    preload : float, optional
        Preload [N]; default: that at which the pair has its stiffness.
    friction_torque : float or (float, float), optional
        Of the pair with its seals as printed [N.m]: a number, which counts within a factor of parts.SPREAD, or low
        and high end, which count as they are.
    seals : {"none", "contact"}, optional
        Shields count as none.
    iso_vg : int, optional
        ISO grade of a mineral oil, or of the base oil of a grease.
    viscosity_index : float, optional
        Its viscosity index.
    oil : LubricantParameters, optional
        Another oil.
    friction : mapping of str to float, optional
        Constants of the law, as of bearing; replenishment_constant 0 is a flooded pair, default: that of grease.

    Returns
    -------
    BearingPair
        With torque(axial_load, speed, temperature), table and notes.

    Raises
    ------
    ValueError
        An argument out of range, or numbers that no row of balls has together.

    Notes
    -----
    How a missing number is found, what the interval contains, what is assumed: heads of bearing_row and this module.

    Examples
    --------
    NSK 30TAC62B at 5 r/min, 25 C; the catalogue prints 0.24 N.m:

    >>> pair = bearing_pair(0.030, 0.062, dynamic_rating=29200.0, axial_stiffness=1.03e9, preload=3350.0)
    >>> pair.notes
    ('17 balls of 7.55 mm by C_a and the stiffness at the preload',)
    >>> result = pair.torque(0.0, 0.52, 298.15)
    >>> result.low < 0.24 < result.high, result.in_range
    (True, True)
    """
    given = {name: value for name, value in locals().items() if name in SupportBearingParameters.model_fields}
    try:
        table = SupportBearingParameters(**given)
    except ValidationError as err:
        raise ValueError(_refused(given, dict(err.errors()[0]))) from None
    stated = friction_torque is not None and BOUNDARY in (friction or {})
    needs(not stated, "friction", BOUNDARY, "", "another constant", "friction_torque conditions this one")
    law = {"iso_vg": iso_vg, "viscosity_index": viscosity_index, "oil": oil, "friction": friction}
    return _pair(table, law)


def _refused(given: Mapping[str, Any], error: Mapping[str, Any]) -> str:
    """The one line of an argument that the table of a screw file refuses."""
    cause = error.get("ctx", {}).get("error")
    known = isinstance(cause, FieldError)
    field = cause.field if isinstance(cause, FieldError) else str(error["loc"][0])
    entry = SupportBearingParameters.entries()[field]
    allowed, remedy = (cause.allowed, cause.remedy) if known else (error["msg"], entry.info.description)
    value = f"{given[field]}{_SI.get(entry.dimension or '', '')}"
    return f"{field} = {value}; needs {allowed.removeprefix('Input should be ')}: {remedy}"


def pair_of(parameters: Parameters) -> BearingPair:
    """The support bearings of a screw file with its lubricant, made once for equal tables."""
    assert parameters.support_bearings is not None
    try:
        return _pair_of(parameters.support_bearings, parameters.lubricant)
    except ValueError as error:
        raise ValueError(f"{parameters.name}: [support_bearings] {error}") from None


@lru_cache(maxsize=32)
def _pair_of(table: SupportBearingParameters, oil: LubricantParameters) -> BearingPair:
    return _pair(table, {"oil": oil})
