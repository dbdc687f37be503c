"""Friction torque of a pair of support bearings, or of one bearing with two rows, from what catalogues print.

Each row is a caged ball bearing by the mechanistic law (applications.bearing), in which nothing is fitted to bearings.

Geometry: as printed. What is missing follows, on the pitch diameter (bore + outer diameter)/2 (IBC prints 1.00 to 1.10
of it), from
  C_a and the stiffness at the preload   ball within 2 %, number within 3 % of SNFA's twelve
  C_a and the filled share of a row      FILL
  section of the rings, filled share     SIZE and FILL
C_a is that of one row in all catalogues that were read (SNFA, NSK, IBC, INA): a pair carries an axial load with one.
Formulas: ISO 281 (physics.rating.bearing_rating), 1.01 to 1.03 of SNFA's; contact stiffness (physics.stiffness) at the
contact angle under preload, 0.985 to 1.00 of SNFA's. A preload that is not printed is that which has the stiffness.

Loads: the rings are rigid, one displacement adds to a row and takes from the other, F_a - F_b = P; beyond 2.83 of the
preload one is free. The contact angle of each row rises with its load.

A printed torque conditions the boundary friction and nothing else: lubricants of VG 22 to 150 have the same torque within
3 % at low speed. Catalogues print neither speed nor oil: TEST_SPEED, TEST_TEMPERATURE and this lubricant are assumed.

Interval, about 80 %: the constants of friction.interval, GROOVE, what of the geometry is not printed, and CATALOGUE. A
printed torque replaces CATALOGUE and the bounds of the boundary friction: its own range (parts.spread) counts as far as
boundary friction has a part in the torque.

Not modelled: churning and running in of grease, cage, radial load, moments, heat that changes the preload.
"""

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import ValidationError

from ...atlas.ball_contacts import BallContacts
from ...friction.film_shear import TorqueParts
from ...friction.interval import (
    DEVIATIONS,
    OperatingPoint,
    effects_at,
    uniform_moments,
    unknown_constants,
    with_constants,
)
from ...friction.mechanistic import ContactValues, double_nut_parts, replenished
from ...numerics import Array, rising_root
from ...nut_map.grid import THICKEST_OIL, THINNEST_OIL
from ...parameters.axis import Range, SupportBearingParameters
from ...parameters.file import LubricantParameters, Parameters, ScrewParameters
from ...parameters.friction import BOUNDED, BoundedConstant
from ...parameters.toml import FieldError
from ...parameters.units import CELSIUS, RPM
from ...physics.ball_law import loaded_contact_angle
from ...physics.lubricant import eta0
from ...physics.rating import STATIC_PRESSURE, ball_pressure, bearing_rating
from ...physics.stiffness import (
    axial_deflection,
    axial_stiffness,
    forces_of_displacement,
    nut_stiffness_constant,
)
from ..bearing import CAGED, SLOWEST, TEMPERATURES, bearing, needs, rings, without_lead
from .parts import middle, spread

#: what catalogues of bearings do not print, within bounds
GROOVE = BoundedConstant(
    0.52, 0.515, 0.53, "1", "groove radius over ball diameter, both rings", "angular contact [memory]"
)
FILL = BoundedConstant(
    0.78, 0.69, 0.93, "1", "diameters of the balls of a row over the circle that they fill",
    "SNFA prints balls of 0.69 to 0.83; C_a and stiffness: IBC 0.69 to 0.84, NSK 0.86 to 0.93",
)  # fmt: skip
SIZE = BoundedConstant(
    0.47, 0.40, 0.62, "1", "ball diameter over half of outer diameter less bore",
    "SNFA prints balls of 0.40 to 0.48; C_a and stiffness: NSK 0.40 to 0.51, IBC 0.42 to 0.62",
)  # fmt: skip
STIFFNESS = BoundedConstant(
    1.0, 0.97, 1.03, "1", "printed stiffness over that of the contacts, where it gives the preload",
    "SNFA 1.00 to 1.02; twice that for other makers [assumption]",
)  # fmt: skip
#: law over printed torque at the ends of an 80 % interval, a factor: the least in steps of 0.05 with which the interval
#: holds 80 % of the 53 rows of examples/support_bearings.csv. The only number that is taken from their torques; printed
#: over law scatters by 1.65 among the makers. Without IBC, whose torques go as the preload, 1.5 holds 32 of 35
CATALOGUE = 1.75
#: by their names in _row
UNKNOWN = {"groove": GROOVE, "fill": FILL, "size": SIZE, "stiffness": STIFFNESS}
#: balls over half of outer diameter less bore that can be; filled share that can be
SIZES, FILLS = (0.05, 0.95), (0.4, 1.0)
#: at which a printed torque is taken [rad/s, K]
TEST_SPEED, TEST_TEMPERATURE = 5.0 * RPM, 25.0 + CELSIUS
#: contact seals have the torque of the rows at this point where nothing is printed, within this factor (assumed). INA
#: prints 2RS as twice 2Z: of a printed torque they have half
SEAL_SPREAD = 2.0
#: highest speed times pitch diameter [rad/s m]: catalogues allow about 200 000 mm r/min with grease, 300 000 with oil
#: [memory]
FASTEST = 300.0 * RPM
#: replenishment below which the rolling part falls with speed: SKF's goes as x^0.6 exp(-k x), x = viscosity times speed
STARVED = math.exp(-0.6)
BOUNDARY = "boundary_friction"


class BearingPairTorque(NamedTuple):
    """Torque of both rows by part, with its interval and that of the seals; floats, or (s,) at several speeds.

    Attributes
    ----------
    rolling, sliding, hysteresis : float or array
        Of both rows, as BearingTorque [N.m].
    rows : float or array
        Their sum [N.m].
    low, high : float or array
        Interval of rows, about 80 % [N.m].
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


class Row(NamedTuple):
    """One of two equal rows, as screw and nut without a lead, with its preload [N]."""

    parameters: Parameters
    contacts: ContactValues
    preload: float

    def parts(self, axial_load: float, speeds: Any, temperatures: Any) -> TorqueParts:
        """Torque of both rows (s, t) at speeds (s, 1) and temperatures (t,), floats at one point."""
        forces = row_forces(self.parameters.screw, self.preload, axial_load)
        at = self.contacts, speeds, temperatures, *CAGED.values[:2]
        return double_nut_parts(self.parameters, forces, *at)

    @property
    def at_test(self) -> float:
        """Torque of both rows at TEST_SPEED and TEST_TEMPERATURE [N.m]."""
        return float(self.parts(0.0, TEST_SPEED, TEST_TEMPERATURE).total)

    def with_friction(self, coefficient: float) -> "Row":
        """With another boundary friction, which then counts as known."""
        return self._replace(parameters=with_constants(self.parameters, {BOUNDARY: coefficient}))

    def with_torque(self, torque: float) -> "Row":
        """With the boundary friction at which both rows have a torque at_test, or the nearer end of its bounds."""
        ends = BOUNDED[BOUNDARY].low, BOUNDED[BOUNDARY].high
        low, high = (self.with_friction(end).at_test for end in ends)
        if not low < torque < high:
            return self.with_friction(ends[torque >= high])
        return self.with_friction(
            rising_root(lambda mu: self.with_friction(mu).at_test - torque, *ends, 1e-6)[0]
        )


class BearingPair(NamedTuple):
    """Pair of support bearings as the friction law takes it.

    Attributes
    ----------
    row : Row
        One of two equal rows, with its preload.
    unknown : tuple of (BoundedConstant, Row, Row)
        What is not known of its geometry, and the row at both ends.
    torque_deviation : float or None
        Standard deviation of ln(torque) of a printed torque; None: none is printed.
    seals : (float, float, float)
        Torque of contact seals, value, low and high end [N.m].
    notes : tuple of str
        How what is not printed was found, and printed numbers that contradict each other.
    """

    row: Row
    unknown: tuple[tuple[BoundedConstant, Row, Row], ...]
    torque_deviation: float | None
    seals: tuple[float, float, float]
    notes: tuple[str, ...]

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
        one, speeds = np.ndim(speed) == 0, np.atleast_1d(np.asarray(speed, float))
        _check_point(axial_load, speeds, np.array([temperature]))
        place = float(axial_load), speeds[:, None], np.array([float(temperature)])
        parts = self.row.parts(*place)
        rows = np.broadcast_to(parts.total, (len(speeds), 1))
        low, high = self._relative(rows, *place)
        parts = (parts.viscous, parts.sliding, parts.hysteresis + 0.0 * rows, rows, low * rows, high * rows)
        columns = [np.reshape(part, -1) for part in parts]
        rows, low, high = columns[3:]
        seals, seals_low, seals_high = self.seals
        below, above = np.hypot(rows - low, seals - seals_low), np.hypot(high - rows, seals_high - seals)
        total = rows + seals
        why = self._why(*place[:2], float(temperature))
        shown = [
            column[0].item() if one else column for column in (*columns, total, total - below, total + above)
        ]
        return BearingPairTorque(*shown[:6], self.seals, *shown[6:], not why, why)

    def table(self, speeds: Array, temperatures: Array, axial_load: float = 0.0) -> Array:
        """Torque of the rows (s, t) [N.m] at speeds (s,) [rad/s] and temperatures (t,) [K], without intervals."""
        speeds, temperatures = (np.asarray(of, float) for of in (speeds, temperatures))
        _check_point(axial_load, speeds, temperatures)
        parts = self.row.parts(float(axial_load), speeds[:, None], temperatures)
        return np.broadcast_to(parts.total, (speeds.size, temperatures.size)).copy()

    def _relative(
        self, rows: Array, axial_load: float, speeds: Array, temperatures: Array
    ) -> tuple[Array, Array]:
        """Ends of the interval over the torque of the rows (s, 1), as friction.interval has it."""
        row, printed = self.row, self.torque_deviation is not None
        names = [*unknown_constants(row.parameters), *[BOUNDARY] * printed]

        def effects(load: float, *at: Any) -> Any:
            point = _Point(row.preload, *at, load)
            return effects_at(row.parameters, point, row.contacts, CAGED, names)

        here = effects(axial_load, speeds, temperatures)
        known = [name for name in here.mean if not (printed and name == BOUNDARY)]
        mean = sum(here.mean[name][0] for name in known)
        variance = sum(here.deviation[name][0] ** 2 for name in known)
        for constant, *of_ends in self.unknown:
            torques = (end.parts(axial_load, speeds, temperatures).total for end in of_ends)
            own = uniform_moments(*(np.log(end / rows) for end in torques), constant.place(constant.value))
            mean, variance = mean + own[0], variance + own[1]
        if self.torque_deviation is None:
            variance = variance + (math.log(CATALOGUE) / DEVIATIONS) ** 2
        else:
            test = effects(0.0, TEST_SPEED, TEST_TEMPERATURE)
            (slope, of_test) = (
                np.log(one.ends[BOUNDARY][1][0] / one.ends[BOUNDARY][0][0]) for one in (here, test)
            )
            variance = variance + (self.torque_deviation * slope / of_test) ** 2
        wide = DEVIATIONS * np.sqrt(variance)
        return np.minimum(np.exp(mean - wide), 1.0), np.maximum(np.exp(mean + wide), 1.0)

    def _why(self, axial_load: float, speeds: Array, temperature: float) -> str:
        """What is beyond the range of the law, "": nothing."""
        parameters = self.row.parameters
        screw, reasons = parameters.screw, []
        fastest = 2.0 * screw.nominal_radius * float(speeds.max())
        if not fastest <= FASTEST:
            limits = (f"{1e3 * of / RPM:.3g}" for of in (fastest, FASTEST))
            reasons.append("speed times pitch diameter = {} mm r/min; needs <= {}".format(*limits))
        force = row_forces(screw, self.row.preload, axial_load)[1]
        pressure = ball_pressure(screw, force / screw.loaded_ball_count)
        if not pressure <= STATIC_PRESSURE:
            limit = 1e-9 * STATIC_PRESSURE
            reasons.append(f"pressure of the balls = {1e-9 * pressure:.3g} GPa; needs <= {limit:g}: a dent")
        viscosity = float(eta0(parameters.lubricant, temperature))
        if not THINNEST_OIL <= viscosity <= THICKEST_OIL:
            reasons.append(f"viscosity = {viscosity:.3g} Pa s; needs {THINNEST_OIL:g} to {THICKEST_OIL:g}")
        supply = float(np.min(replenished(parameters, speeds.max(), np.array([temperature]))))
        if not supply >= STARVED:
            reasons.append(
                f"replenishment = {supply:.2g}; needs >= {STARVED:.2f}: beyond, the rolling part would fall with speed"
            )
        return "; ".join(reasons)


class _Point(OperatingPoint):
    """Point with arrays of speeds and temperatures, whose nuts are both rows."""

    def forces(self, parameters: Parameters, factor: float = 1.0) -> tuple[float, float]:
        return row_forces(parameters.screw, factor * self.preload, self.axial_load)


def row_forces(screw: ScrewParameters, preload: float, axial_load: float) -> tuple[float, float]:
    """Forces [N] of the relieved and of the loaded row under a preload > 0 and a load of any sign [N]."""
    if axial_load == 0.0:
        return preload, preload
    k = _row_constant(screw, screw.loaded_ball_count, preload)
    return forces_of_displacement(k, preload, axial_deflection(k, preload, abs(axial_load)))


def _row_constant(screw: ScrewParameters, balls: float, preload: float) -> float:
    """nut_stiffness_constant of a row with this number of balls at the angle under its preload [N]."""
    angle = loaded_contact_angle(screw, preload / balls, 1)
    return balls * nut_stiffness_constant(screw.model_copy(update={"loaded_ball_count": 1}), angle)


def _pair_stiffness(screw: ScrewParameters, balls: float, preload: float) -> float:
    return axial_stiffness(_row_constant(screw, balls, preload), preload)


def _check_point(axial_load: float, speeds: Array, temperatures: Array) -> None:
    low, high = TEMPERATURES
    needs(math.isfinite(axial_load), "axial_load", axial_load, "N", "finite", "0 is the preload alone")
    slow = "below it the torque no longer depends on speed"
    good = bool(speeds.size) and bool(np.all((speeds >= SLOWEST) & np.isfinite(speeds)))
    needs(good, "speed", speeds.min(initial=math.inf), "rad/s", f">= {SLOWEST:g}, finite", slow)
    good = bool(temperatures.size) and bool(np.all((temperatures >= low) & (temperatures <= high)))
    needs(good, "temperature", temperatures, "K", f"{low:g} to {high:g}", "is it in kelvin?")


def _pitch(table: SupportBearingParameters) -> float:
    return table.pitch_diameter or 0.5 * (table.bore + table.outer_diameter)


def _rings(table: SupportBearingParameters, ball: float, balls: int, groove: float) -> ScrewParameters:
    return without_lead(rings(_pitch(table), ball, balls, table.contact_angle, groove, groove))


class _Balls(NamedTuple):
    """Diameter [m] and number of the balls of a row, how they were found, and which constants of _row they take."""

    diameter: float
    number: int
    how: str = ""
    by: tuple[str, ...] = ()


def _balls(table: SupportBearingParameters, fill: float, size: float) -> _Balls:
    """What is printed of the balls, and what is missing as the head of this module says."""
    ball, number, rating = table.ball_diameter, table.balls, table.dynamic_rating
    stiffness, preload = table.axial_stiffness, table.preload
    if ball is not None and number is not None:
        return _Balls(ball, number)
    section, circle = 0.5 * (table.outer_diameter - table.bore), math.pi * _pitch(table)
    if rating is None:
        by = ("fill",) if ball or number else ("fill", "size")
        ball = ball or (fill * circle / number if number else size * section)
        number = number or round(fill * circle / ball)
        return _Balls(ball, number, "the section of the rings and a filled row", by)
    least, largest = (share * section for share in SIZES)
    first = _rings(table, SIZE.value * section, 2, GROOVE.value)

    def screw(ball: float) -> ScrewParameters:
        groove = GROOVE.value * ball
        sizes = {"ball_diameter": ball, "screw_raceway_radius": groove, "nut_raceway_radius": groove}
        return first.model_copy(update=sizes | {"loaded_ball_count": 1})

    def rated(ball: float) -> float:
        """Number of balls with the rating: it falls with the ball."""
        return float((rating / bearing_rating(screw(ball))) ** 1.5)

    def root(rising: Callable[[float], float]) -> float:
        sizes = f"{1e3 * least:.3g} to {1e3 * largest:.3g} mm"
        needs(
            rising(least) < 0.0 < rising(largest), "dynamic_rating", rating, "N",
            f"what balls of {sizes} have together with axial_stiffness and preload",
            "C_a is of one row; check the units, or give ball_diameter and balls",
        )  # fmt: skip
        return rising_root(rising, least, largest, 1e-9)[0]

    how, by = "C_a", ()
    if ball is None and number is None and stiffness is not None and preload is not None:
        how += " and the stiffness at the preload"
        ball = root(lambda ball: stiffness - _pair_stiffness(screw(ball), rated(ball), preload))
    elif ball is None and number is None:
        how, by = f"{how} and a row filled to {100.0 * fill:g} %", ("fill",)
        ball = root(lambda ball: fill * circle / ball - rated(ball))
    if number is None:
        assert ball is not None
        share = rated(ball) * ball / circle
        needs(
            FILLS[0] <= share <= FILLS[1], "dynamic_rating", rating, "N",
            f"balls that fill {FILLS[0]:g} to {FILLS[1]:g} of their circle, not {share:.2f}",
            "C_a is of one row; check axial_stiffness and preload, or omit one",
        )  # fmt: skip
        number = max(round(rated(ball)), 2)
    if table.ball_diameter is None:
        ball = root(lambda ball: number - rated(ball))
    return _Balls(ball, number, how, by)


def _row(table: SupportBearingParameters, law: Mapping[str, Any], **at: float) -> Row:
    """The row with other values of constants that are not printed, by their names; law: keywords of bearing."""
    groove, fill, size, factor = (at.get(name, of.value) for name, of in UNKNOWN.items())
    ball, balls = _balls(table, fill, size)[:2]
    preload, screw = table.preload, _rings(table, ball, balls, groove)
    if preload is None:
        assert table.axial_stiffness is not None
        stiffness = table.axial_stiffness / factor

        def excess(ln_force: float) -> float:
            return _pair_stiffness(screw, balls, math.exp(ln_force)) - stiffness

        preload = math.exp(rising_root(excess, 0.0, math.log(1e8), 1e-9)[0])
    built = bearing(_pitch(table), ball, balls, table.contact_angle, groove, groove, **law)
    # not solved where the atlas does not hold them: OutsideAtlasError
    contacts = built.contacts if isinstance(built.contacts, BallContacts) else BallContacts(built.parameters)
    return Row(built.parameters, contacts, preload)


def _pair(table: SupportBearingParameters, law: Mapping[str, Any]) -> BearingPair:
    """The pair of a table of the screw file."""
    row, found, notes = _row(table, law), _balls(table, FILL.value, SIZE.value), []
    screw, preload, printed = row.parameters.screw, row.preload, table.axial_stiffness
    names = ["groove", *found.by]
    if found.how:
        notes.append(f"{found.number} balls of {1e3 * found.diameter:.3g} mm by {found.how}")
    stiffness = _pair_stiffness(screw, found.number, preload)
    if table.preload is None:
        names.append("stiffness")
        notes.append(f"preload {preload:.4g} N by the stiffness")
    elif printed is not None and not STIFFNESS.low <= printed / stiffness <= STIFFNESS.high:
        both = f"{1e-6 * printed:.4g} N/um is printed, {1e-6 * stiffness:.4g} N/um computed at the preload"
        notes.append(f"axial_stiffness: {both}: one of the numbers is of another bearing")
    unknown = [
        (of, *(_row(table, law, **{name: end}) for end in (of.low, of.high)))
        for name in names for of in (UNKNOWN[name],)
    ]  # fmt: skip
    law_torque = row.at_test
    if table.friction_torque is None:
        value = law_torque if table.seals == "contact" else 0.0
        seals = value, value / SEAL_SPREAD, value * SEAL_SPREAD
        if value:
            notes.append(
                f"contact seals: taken as the rows within a factor of {SEAL_SPREAD:g}; none is printed"
            )
        return BearingPair(row, tuple(unknown), None, seals, tuple(notes))
    share = 0.5 if table.seals == "contact" else 1.0
    torque, ends = (
        share * middle(table.friction_torque),
        [share * end for end in spread(table.friction_torque)],
    )
    seals = (torque, *ends) if share < 1.0 else (0.0, 0.0, 0.0)
    free = BearingPair(row, tuple(unknown), None, (0.0, 0.0, 0.0), ())
    low, high = free.torque(0.0, TEST_SPEED, TEST_TEMPERATURE)[4:6]
    where = f"friction_torque: {torque:.3g} N.m of the rows is printed, {law_torque:.3g} N.m computed"
    if not low <= torque <= high:
        by = "stiffness" if table.preload is None else "preload"
        notes.append(f"{where} by the {by}, interval {low:.3g} to {high:.3g} N.m: they contradict each other")
    row = row.with_torque(torque)
    unknown = [(of, low.with_torque(torque), high.with_torque(torque)) for of, low, high in unknown]
    friction = row.parameters.friction.boundary_friction
    if friction in (BOUNDED[BOUNDARY].low, BOUNDED[BOUNDARY].high):
        notes.append(
            f"{where}: boundary friction ends at {friction:g}, where the rows have {row.at_test:.3g} N.m"
        )
    deviation = 0.5 * math.log(ends[1] / ends[0]) / DEVIATIONS
    return BearingPair(row, tuple(unknown), deviation, seals, tuple(notes))


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
        Constants of the law, as of bearing.

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
    How a missing number is found, what the interval contains and what is assumed: head of the module bearing_pair.

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
    names = tuple(SupportBearingParameters.model_fields)
    given = {name: value for name, value in locals().items() if name in names}
    try:
        table = SupportBearingParameters(**given)
    except ValidationError as err:
        raise ValueError(_refused(given, dict(err.errors()[0]))) from None
    if friction_torque is not None:
        stated = BOUNDARY in (friction or {})
        needs(
            not stated,
            "friction",
            BOUNDARY,
            "",
            "no such entry with friction_torque",
            "the torque conditions it",
        )
    law = {"iso_vg": iso_vg, "viscosity_index": viscosity_index, "oil": oil, "friction": friction}
    return _pair(table, law)


def _refused(given: Mapping[str, Any], error: Mapping[str, Any]) -> str:
    """The one line of an argument that the table of a screw file refuses."""
    cause = error.get("ctx", {}).get("error")
    field = cause.field if isinstance(cause, FieldError) else str(error["loc"][0])
    entry = SupportBearingParameters.entries()[field]
    where = f"{field} = {given[field]}{SI.get(entry.dimension or '', '')}; needs "
    if isinstance(cause, FieldError):
        return f"{where}{cause.allowed}: {cause.remedy}"
    said = error["msg"].removeprefix("Input should be ")
    return f"{where}{said}: it stands for: {entry.info.description}"


SI = {"length": " m", "force": " N", "stiffness": " N/m", "torque": " N.m", "angle": " rad"}


def pair_of(parameters: Parameters) -> BearingPair:
    """The support bearings of a screw file with its lubricant; made once for tables that are equal."""
    assert parameters.support_bearings is not None
    return _pair_of(parameters.support_bearings, parameters.lubricant)


@lru_cache(maxsize=32)
def _pair_of(table: SupportBearingParameters, oil: LubricantParameters) -> BearingPair:
    return _pair(table, {"oil": oil})
