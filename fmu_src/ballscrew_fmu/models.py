"""The models that are built as FMUs: what differs between them. Everything else is shared."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ballscrew_fmu.variables.friction import Variable, fmu_variables, native_variables
from ballscrew_fmu.variables.monitor import monitor_variables, native_monitor_variables

Table = Callable[[Mapping[str, Any]], tuple[Variable, ...]]


class FmuModel(NamedTuple):
    """One model, as an FMU for Python hosts and as native FMUs."""

    name: str  # model name and identifier of the FMU for Python hosts
    summary: str  # first words of the description
    variables: Table
    native_variables: Table
    slave: str  # module of the base class, which is named by name
    refines: bool  # the contact solver travels
    layer: str  # folder of native/ that holds the model layer
    derivatives: bool  # directional and adjoint ones
    terminal: tuple[str, str, tuple[str, ...]] | None = None  # kind, description, variables

    @property
    def native_name(self) -> str:
        """Model name and identifier of the native FMUs."""
        return f"{self.name}Native"


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
        "Shaft of the screw: its speed comes in, the friction torque goes out and acts against the speed; "
        "no angle, so no Modelica flange",
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
MODELS = (FRICTION, MONITOR)
