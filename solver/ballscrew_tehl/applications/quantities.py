"""Numbers of an operating point and of other options: names, bounds, and what of them each command takes."""

import math
import re
from argparse import ArgumentTypeError
from typing import NamedTuple

from ballscrew_tehl.parameters.units import CELSIUS, turns_of
from ballscrew_tehl.runtime.constants import MOST_DIFFERENCE


class RefusedError(ArgumentTypeError, ValueError):
    """A value that is not allowed, of an option or of a file."""


class Quantity(NamedTuple):
    """A number: option --some-name, whose type of argparse it is, column some_name, both the key `name`."""

    name: str
    help: str
    min_: float = -math.inf
    max_: float = math.inf
    default: float | None = None
    not_zero: bool = False  # zero is rejected
    signed: bool = False  # the bounds are those of the magnitude
    whole: bool = False

    @property
    def axis(self) -> str:
        """Its name without the unit, as an axis of a map and in the heading of a column."""
        return self.name.rpartition("_")[0]

    @property
    def option(self) -> str:
        """Spelling on the command line."""
        return "--" + self.name.replace("_", "-")

    @property
    def allowed(self) -> str:
        """Allowed values as text."""
        text = "a whole number" if self.whole else "a finite number"
        if math.isfinite(self.max_):
            text = f"{'a whole number, ' if self.whole else ''}{self.min_:g} to {self.max_:g}"
        elif math.isfinite(self.min_):
            text += f" {'>' if self.not_zero and not self.min_ else '>='} {self.min_:g}"
        text += ", not 0" if self.not_zero and (self.min_ or math.isfinite(self.max_)) else ""
        return text + (", or the same with a minus" if self.signed else "")

    def checked(self, value: object) -> float:
        """A value that a script states, as by the option; ValueError: not allowed."""
        return self(str(value), self.option)

    def __call__(self, text: str, where: str = "") -> float:
        """The value from its text; where: its place in a message, for argparse "", which names the option."""
        try:
            number = (int if self.whole else float)(text)
        except ValueError:
            number = math.nan
        size = abs(number) if self.signed else number
        if math.isfinite(number) and self.min_ <= size <= self.max_ and (number or not self.not_zero):
            return number
        celsius, hint = number - CELSIUS, ""
        if self.name.endswith("_c") and self.min_ <= celsius <= self.max_:
            hint = f" degrees Celsius; is {text} K = {celsius:.6g} C meant?"
        elif re.fullmatch(r"[+-]?\d+,\d+([xX*]\d+)?", text):
            whole = f" {text.replace(',', '')}, or" * (
                re.fullmatch(r"[+-]?[1-9]\d{0,2},\d{3}", text) is not None
            )
            hint = f";{whole} with a decimal point: {text.replace(',', '.')}"
        raise RefusedError(f"{where} = {text}; allowed: {self.allowed}{hint}")


def turns(text: str) -> float:
    """TURNS from a number or turns x circuits."""
    return TURNS(str(turns_of(text)))


#: beyond any axial load of a screw [N]; larger ones overflow where balls are loaded
MAX_FORCE = 1e7
PRELOAD = Quantity("preload_n", "preload of the nut [N]", 0.0)
SPEED = Quantity("speed_rpm", "screw speed [r/min]")
TEMPERATURE = Quantity("temperature_c", "oil temperature [C]", -73.15, 200.0)
TOLERANCE = Quantity("temperature_tolerance_k", "for the interval: the oil may be so much warmer or colder; default: "
                     "5 [K]", 0.0, 50.0)  # fmt: skip
AXIAL_LOAD = Quantity("axial_load_n", "external axial load [N]", -MAX_FORCE, MAX_FORCE, 0.0)
DIFFERENCE = Quantity("temperature_difference_k", "of the screw over the nut: changes the preload; default: 0 [K]",
                      -MOST_DIFFERENCE, MOST_DIFFERENCE)  # fmt: skip
TORQUE = Quantity("torque_nm", "measured friction torque, magnitude [N.m]", 0.0)
TOLERANCES = tuple(
    Quantity(f"{name}_tolerance_percent", f"of the {name} of all rows that state none, one error shared by all",
             0.0, 95.0)
    for name in ("torque", "preload")
)  # fmt: skip
TURNS = Quantity("turns", "loaded turns of one start of one nut, also as 2.5x2", 0.0, 100.0, not_zero=True)

TORQUE_POINT = (PRELOAD, SPEED, TEMPERATURE, AXIAL_LOAD)
PRELOAD_POINT = (TORQUE, SPEED._replace(not_zero=True), TEMPERATURE)
CALIBRATION_POINT = (*(number._replace(not_zero=True) for number in (TORQUE, PRELOAD, SPEED)), TEMPERATURE)
REPORT_POINT = (PRELOAD, SPEED, TEMPERATURE)
AXIS_POINT = (
    PRELOAD,
    SPEED._replace(not_zero=True),
    TEMPERATURE,
    AXIAL_LOAD._replace(help="force of the process along the axis; the weight is added [N]"),
)
CONTACT_POINT = (
    Quantity("load_n", "load [N]"),
    Quantity("radius_x_m", "reduced radius along rolling [m]"),
    Quantity("radius_y_m", "reduced radius across rolling [m], not below the other"),
    Quantity("u1_m_s", "speed of surface 1 [m/s]"),
    Quantity("u2_m_s", "speed of surface 2 [m/s]"),
    Quantity("temperature_k", "temperature of oil and bodies [K]"),
)
TORQUE_CONSTANT = Quantity("torque_constant_nm_a", "torque of the motor over its current [N.m/A]", 1e-6, 1e4)
RATIO = Quantity("ratio", "turns of the motor for one of the screw; default: 1", 1e-3, 1e3)
CURRENT_UNIT = Quantity("current_unit_a", "one of the current of the drive [A]; default: 0.001", 1e-9, 1e3)
LEAD = Quantity("lead_mm", "lead of the screw [mm]; default: by screw or map", 1e-2, 1e3)
OFFSET = Quantity(
    "offset_nm", "known torque of gravity or tilt, X or X+-STANDARD_ERROR [N.m]", -MAX_FORCE, MAX_FORCE
)
OFFSETS = (OFFSET, OFFSET._replace(name="offset_n", help="the same as a force [N]"))


POINTS = Quantity("points", "most entries of a list (20), speeds of a table (40)", 3, 400, whole=True)
#: friction that is subtracted, X or X+-STANDARD_ERROR
FRICTIONS = (
    Quantity("guide_force_n", "friction of guides and covers, the same at every speed, subtracted; F or "
             "F+-STANDARD_ERROR [N]", 0.0, MAX_FORCE),
    Quantity("seal_torque_nm", "friction of bearings and further seals, subtracted; of the wipers where the screw "
             "file has the bearings; T or T+-STANDARD_ERROR [N.m]", 0.0, 1e6),
)  # fmt: skip


def with_error(text: str, quantity: Quantity = OFFSET) -> tuple[float, float]:
    """A quantity and its standard error, 0 where none is given."""
    value, both, error = text.partition("+-")
    return quantity(value), quantity._replace(min_=0.0)(error, "standard error") if both else 0.0


IDENTIFY_OPTIONS = (
    TORQUE_CONSTANT._replace(signed=True),
    Quantity("gain_n_v", "force of the drive over its voltage [N/V]", 1e-6, 1e9, signed=True),
    RATIO._replace(signed=True),
    LEAD._replace(signed=True, help="lead, negative: left-hand [mm]; default: by screw or map"),
    Quantity("inertia_kgm2", "known inertia at the screw, axis included [kg m2]", 1e-12, 1e6),
    Quantity("mass_kg", "known moved mass, screw and motor included [kg]", 1e-6, 1e7),
    PRELOAD._replace(help="known preload [N]: for --measurements or --before", not_zero=True),
    Quantity("before_preload_n", "known preload of the log before [N]", 0.0, not_zero=True),
    TEMPERATURE._replace(name="before_temperature_c", help="oil temperature of the log before [C]"),
    Quantity("delay_ms", "delay of the drive's signal; default: estimated [ms]", -1e3, 1e3),
    Quantity("cutoff_hz", "of the filter; default: by the noise of the motion [Hz]", 1e-3, 1e6),
    Quantity("bins", "bins of speed in each direction; default: by the samples", 3, 1000, whole=True),
)
