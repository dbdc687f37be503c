"""Numbers of an operating point: names of option and column, bounds, and what of them each command takes."""

import math
import re
from argparse import Namespace
from typing import Any, NamedTuple

from ...parameters.units import CELSIUS


class Quantity(NamedTuple):
    """A number of an operating point: option --some-name, column some_name, both the key `name`."""

    name: str
    help: str
    min_: float = -math.inf
    max_: float = math.inf
    default: float | None = None
    #: zero is rejected
    not_zero: bool = False
    #: the bounds are those of the magnitude
    signed: bool = False

    @property
    def axis(self) -> str:
        """Its name without the unit, as an axis of a map and in the heading of a column."""
        return self.name.rpartition("_")[0]

    @property
    def option(self) -> str:
        """Spelling on the command line."""
        return "--" + self.name.replace("_", "-")

    @property
    def metavar(self) -> str:
        """Its unit, as help shows it."""
        return self.name.rsplit("_", 1)[-1].upper()

    @property
    def allowed(self) -> str:
        """Allowed values as text."""
        words = "a finite number"
        if math.isfinite(self.max_):
            words = f"{self.min_:g} to {self.max_:g}"
        elif math.isfinite(self.min_):
            words += f" >= {self.min_:g}"
        return (
            words
            + (", not 0" if self.not_zero else "")
            + (", or the same with a minus" if self.signed else "")
        )

    def of(self, args: Namespace) -> float | None:
        """The value of the option; None: not given.

        Raises       ValueError: as checked
        """
        value = getattr(args, self.name)
        return None if value is None else self.checked(self.option, value)

    def checked(self, where: str, value: Any) -> float:
        """The value as a float.

        Raises       ValueError: one line with place, value and what is allowed
        """
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        size = abs(number) if self.signed else number
        if not (math.isfinite(number) and self.min_ <= size <= self.max_) or (
            self.not_zero and number == 0.0
        ):
            celsius = number - CELSIUS
            kelvin = self.name.endswith("_c") and self.min_ <= celsius <= self.max_
            hint = f" degrees Celsius; is {value} K = {celsius:.6g} C meant?" if kelvin else ""
            if re.fullmatch(r"[+-]?\d+,\d+", str(value)):
                hint = f", with a decimal point: {value.replace(',', '.')}"
            raise ValueError(f"{where} = {value}; allowed: {self.allowed}{hint}")
        return number


#: beyond any axial load of a screw [N]; larger ones overflow where balls are loaded
MAX_FORCE = 1e7
PRELOAD = Quantity("preload_n", "preload of the nut [N]", 0.0)
SPEED = Quantity("speed_rpm", "screw speed [r/min]")
TEMPERATURE = Quantity("temperature_c", "oil temperature [C]", -73.15, 200.0)
AXIAL_LOAD = Quantity("axial_load_n", "external axial load [N]", -MAX_FORCE, MAX_FORCE, 0.0)
TORQUE = Quantity("torque_nm", "measured friction torque, magnitude [N.m]", 0.0)

TORQUE_POINT = (PRELOAD, SPEED, TEMPERATURE, AXIAL_LOAD)
SCREW_POINT = (PRELOAD, AXIAL_LOAD)
PRELOAD_POINT = (TORQUE, SPEED._replace(not_zero=True), TEMPERATURE)
CALIBRATION_POINT = (
    TORQUE._replace(not_zero=True), PRELOAD._replace(not_zero=True), SPEED._replace(not_zero=True), TEMPERATURE,
)  # fmt: skip
REPORT_POINT = (PRELOAD, SPEED, TEMPERATURE)
TORQUE_CONSTANT = Quantity("torque_constant_nm_a", "torque of the motor over its current [N.m/A]", 1e-6, 1e4)
RATIO = Quantity("ratio", "turns of the motor for one of the screw; default: 1", 1e-3, 1e3)
CURRENT_UNIT = Quantity("current_unit_a", "one of the current of the drive [A]; default: 0.001", 1e-9, 1e3)
LEAD = Quantity("lead_mm", "lead of the screw [mm]; default: by screw or map", 1e-2, 1e3)
OFFSET = Quantity(
    "offset_nm",
    "known torque of gravity or tilt, X or X+-STANDARD_ERROR [N.m]",
    -MAX_FORCE,
    MAX_FORCE,
)
OFFSET_ERROR = OFFSET._replace(min_=0.0)
IDENTIFY_OPTIONS = (
    TORQUE_CONSTANT._replace(signed=True),
    Quantity("gain_n_v", "force of the drive over its voltage [N/V]", 1e-6, 1e9, signed=True),
    RATIO._replace(signed=True),
    LEAD._replace(signed=True, help="lead, negative: left-hand [mm]; default: by screw or map"),
    Quantity("inertia_kgm2", "known inertia at the screw, axis included [kg m2]", 1e-12, 1e6),
    Quantity("mass_kg", "known moved mass, screw and motor included [kg]", 1e-6, 1e7),
    OFFSET,
    OFFSET._replace(name="offset_n", help="the same as a force [N]"),
    Quantity("guide_force_n", "friction of guides and covers, subtracted [N]", 0.0, MAX_FORCE),
    Quantity("seal_torque_nm", "friction of bearings and further seals, subtracted [N.m]", 0.0, 1e6),
    PRELOAD._replace(help="known preload [N]: for --measurements or --before", not_zero=True),
    Quantity("before_preload_n", "known preload of the log before [N]", 0.0, not_zero=True),
    TEMPERATURE._replace(name="before_temperature_c", help="oil temperature of the log before [C]"),
    Quantity("delay_ms", "delay of the drive's signal; default: estimated [ms]", -1e3, 1e3),
    Quantity("cutoff_hz", "of the filter; default: by the noise of the motion [Hz]", 1e-3, 1e6),
    Quantity("bins", "bins of speed in each direction; default: by the samples", 3, 1000),
)
