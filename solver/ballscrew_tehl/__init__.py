"""Friction torque of preloaded ball screws from thermal elastohydrodynamic lubrication.

The names of __all__ are the library; what is not among them is internal and may move. They are imported when they are
used: a command line answer must not wait for a compiler.
"""

from typing import TYPE_CHECKING, Any

from ._version import __date__ as __date__
from ._version import __version__ as __version__

if TYPE_CHECKING:
    from .applications.axis.bearing_pair import bearing_pair
    from .applications.bearing import bearing
    from .applications.calibration.measured import calibrate
    from .contact import solve
    from .nut_map.load import load_map
    from .parameters.file import load_screw

__all__ = ["bearing", "bearing_pair", "calibrate", "load_map", "load_screw", "solve"]

_PLACES = {
    "bearing": "applications.bearing:bearing",
    "bearing_pair": "applications.axis.bearing_pair:bearing_pair",
    "calibrate": "applications.calibration.measured:calibrate",
    "load_map": "nut_map.load:load_map",
    "load_screw": "parameters.file:load_screw",
    "solve": "contact:solve",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__} has no attribute {name}")
    from pkgutil import resolve_name

    return resolve_name(f"{__name__}.{_PLACES[name]}")


def __dir__() -> list[str]:
    return [*globals(), *__all__]
