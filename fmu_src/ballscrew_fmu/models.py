"""The models that are built as FMUs, with all that differs between them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from ballscrew_fmu.variables.axis import BEARING_NUMBERS, axis_variables, bearing_table
from ballscrew_fmu.variables.friction import Variable, native_variables
from ballscrew_fmu.variables.monitor import monitor_variables
from ballscrew_fmu.variables.transmission import transmission_variables

Table = Callable[[Mapping[str, Any]], tuple[Variable, ...]]


class Terminal(NamedTuple):
    """Variables that are connected together. Each member: variable, member name as in Modelica, kind; then a comma.

    A flow (torque, heat) is an inflow if positive values enter the FMU, else an outflow. The flows of a connection add
    up to 0.
    """

    name: str
    kind: str
    description: str
    members: str


class FmuModel(NamedTuple):
    """One model, as native FMUs; FRICTION also as an FMU for Python hosts.

    Attributes
    ----------
    name : str
        Model name and identifier, of native FMUs with the suffix.
    summary : str
        First words of the description.
    variables : callable
        Variables of the native FMUs, from the header of a map.
    layer : str
        Folder of the model in native/models.
    dual : str
        File there with the laws in dual numbers.
    suffix : str
        Of native FMUs.
    terminals : tuple of Terminal
        Variables that are connected together.
    borrowed : tuple of str
        Files of other models in native/models.
    step : float
        Of the default experiment [s].
    step_derivatives : bool
        Whether co-simulation has derivatives; model exchange always has them.
    number_count : int
        Numbers of a screw that are no variables,
    numbers : callable
        these numbers, from the header of a map.
    """

    name: str
    summary: str
    variables: Table
    layer: str
    dual: str = "dual_laws.c"
    suffix: str = ""
    terminals: tuple[Terminal, ...] = ()
    borrowed: tuple[str, ...] = ()
    step: float = 1e-3
    step_derivatives: bool = True
    number_count: int = 0
    numbers: Callable[[Mapping[str, Any]], Sequence[float]] = lambda header: ()

    @property
    def native_name(self) -> str:
        """Model name and identifier of the native FMUs."""
        return self.name + self.suffix


HEAT = Terminal(
    "heat",
    "heat",
    "Heat port: temperature of the oil in, dissipated power out",
    "temperature T signal, power_loss Q_flow outflow",
)
FRICTION = FmuModel(
    "BallScrewFriction",
    "Friction torque of a preloaded ball screw",
    native_variables,
    "friction",
    suffix="Native",
    terminals=(
        Terminal(
            "shaft",
            "shaft",
            "Shaft of the screw: speed in, torque that the shaft gives to friction. "
            "With a speed instead of an angle, so not a Modelica flange",
            "speed w signal, friction_torque tau inflow",
        ),
        HEAT,
    ),
)
MONITOR = FmuModel(
    "BallScrewPreloadMonitor",
    "Preload of a ball screw from its measured friction torque",
    monitor_variables,
    "monitor",
    dual="search.c",
    suffix="Native",
    terminals=(
        Terminal(
            "shaft",
            "shaft_measurement",
            "Measured speed and friction torque of the shaft",
            "speed w signal, torque tau signal",
        ),
        Terminal(
            "estimate",
            "preload_estimate",
            "Preload with its interval, and whether the torque determines it",
            "preload preload signal, preload_half_width half_width signal, preload_low low signal, "
            "preload_high high signal, in_range in_range signal",
        ),
    ),
)
TRANSMISSION = FmuModel(
    "BallScrewTransmission",
    "Preloaded ball screw between shaft and axis: axial stiffness and friction",
    transmission_variables,
    "transmission",
    terminals=(
        Terminal(
            "shaft",
            "rotational_shaft",
            "Shaft of the screw: angle and speed in, torque that the shaft gives to the screw. "
            "With a speed beside the angle, so not a Modelica flange",
            "angle phi signal, speed w signal, screw_torque tau inflow",
        ),
        Terminal(
            "nut",
            "translational_flange",
            "Nut: position and velocity in, force that the nut gives to the axis. "
            "With a velocity beside the position, so not a Modelica flange",
            "position s signal, velocity v signal, nut_force f outflow",
        ),
        HEAT,
    ),
    borrowed=(
        "friction/dual_laws.c",
        "friction/dual_laws.h",
        "friction/friction_law.h",
        "friction/model.c",
        "friction/named_parts.h",
        "friction/screw_model.c",
        "friction/screw_model.h",
        "friction/state.h",
    ),
    step=1e-5,  # below 1.5 times the damping time of the contacts: stable with any masses and either order of exchange
)
AXIS = FmuModel(
    "BallScrewAxis",
    "Ball screw axis: motor inertia, preloaded nut with stiffness and friction, table and guide",
    axis_variables,
    "axis",
    terminals=(
        Terminal(
            "shaft",
            "shaft_drive",
            "Shaft of the motor: torque in, angle and speed out. The inertia is in the FMU, so not a Modelica flange",
            "angle phi signal, speed w signal, motor_torque tau inflow",
        ),
        Terminal(
            "table",
            "table_drive",
            "Table: force in, position and velocity out. The mass is in the FMU, so not a Modelica flange",
            "position s signal, velocity v signal, external_force f inflow",
        ),
        HEAT,
    ),
    borrowed=(
        "friction/dual_laws.h",
        "friction/named_parts.h",
        "friction/screw_model.c",
        "friction/screw_model.h",
        "transmission/contacts.h",
    ),
    step_derivatives=False,  # of a step of many parts they would cost as much as differences of steps
    number_count=BEARING_NUMBERS,
    numbers=bearing_table,
)
MODELS = (FRICTION, MONITOR, TRANSMISSION, AXIS)
