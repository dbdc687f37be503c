"""The models that are built as FMUs, with all that differs between them."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ballscrew_fmu.variables.friction import Variable, fmu_variables, native_variables
from ballscrew_fmu.variables.monitor import monitor_variables, native_monitor_variables
from ballscrew_fmu.variables.transmission import transmission_variables

Table = Callable[[Mapping[str, Any]], tuple[Variable, ...]]


class FmuModel(NamedTuple):
    """One model, as native FMUs and, if it has a slave, as an FMU for Python hosts."""

    name: str  # model name and identifier; native FMUs of a model with a slave add "Native"
    summary: str  # first words of the description
    variables: Table
    native_variables: Table
    slave: str  # module of the base class {name}Base; "": native only
    refines: bool  # the FMU contains the contact solver
    layer: str  # folder of the model in native/models
    derivatives: bool  # directional and adjoint derivatives
    terminal: tuple[str, str, tuple[str, ...]] | None = None  # name, description, variables
    borrowed: tuple[str, ...] = ()  # files of other models in native/models

    @property
    def native_name(self) -> str:
        """Model name and identifier of the native FMUs."""
        return f"{self.name}Native" if self.slave else self.name


FRICTION = FmuModel(
    "BallScrewFriction",
    "Friction torque of a preloaded double-nut ball screw",
    fmu_variables,
    native_variables,
    "ballscrew_fmu.python_fmu.slave",
    refines=True,
    layer="friction",
    derivatives=True,
    terminal=(
        "shaft",
        "Shaft of the screw: speed as input, friction torque as output, acting against the speed. "
        "Without an angle, so not a Modelica flange",
        ("speed", "friction_torque"),
    ),
)
MONITOR = FmuModel(
    "BallScrewPreloadMonitor",
    "Preload of a double-nut ball screw from its measured friction torque",
    monitor_variables,
    native_monitor_variables,
    "ballscrew_fmu.python_fmu.monitor_slave",
    refines=False,
    layer="monitor",
    derivatives=False,
)
TRANSMISSION = FmuModel(
    "BallScrewTransmission",
    "Preloaded double-nut ball screw between shaft and axis: axial stiffness and friction",
    transmission_variables,
    transmission_variables,
    slave="",
    refines=False,
    layer="transmission",
    derivatives=True,
    terminal=(
        "shaft",
        "Shaft of the screw: angle and speed as inputs, torque as output, acting against the speed",
        ("angle", "speed", "screw_torque"),
    ),
    borrowed=("friction/friction_law.h", "friction/model.c", "friction/tangent.h"),
)
MODELS = (FRICTION, MONITOR)  # for Python hosts and native
NATIVE_MODELS = (*MODELS, TRANSMISSION)
