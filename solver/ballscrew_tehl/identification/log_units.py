"""Column headings of logs of a drive: which signal in which unit."""

from __future__ import annotations

import math

from ..calibration.measurement_units import FORCE, KELVIN, SPEED, TORQUE, Quantity, Units, column_of

LENGTH: Units = {unit: (factor, 0.0) for unit, factor in {"m": 1.0, "mm": 1e-3, "um": 1e-6}.items()}
ANGLE: Units = {
    "rad": (1.0, 0.0),
    "deg": (math.pi / 180.0, 0.0),
    **dict.fromkeys(("rev", "r", "turns"), (2.0 * math.pi, 0.0)),
}
TIME: Units = {"s": (1.0, 0.0), "ms": (1e-3, 0.0), "us": (1e-6, 0.0)}
VELOCITY: Units = {
    "m/s": (1.0, 0.0), "mm/s": (1e-3, 0.0), "m/min": (1.0 / 60.0, 0.0), "mm/min": (1e-3 / 60.0, 0.0),
}  # fmt: skip

#: speed and velocity are taken by their unit; the names with `screw` are of the screw side of a gear
QUANTITIES: dict[str, Quantity] = {
    "time": Quantity(("time", "t"), TIME),
    "position": Quantity(("position", "actual_position", "motor_position", "angle"), LENGTH | ANGLE),
    "screw_position": Quantity(("screw_position", "screw_angle"), ANGLE),
    "speed": Quantity(("speed", "actual_speed", "motor_speed", "velocity", "actual_velocity"), SPEED | VELOCITY),
    "screw_speed": Quantity(("screw_speed",), SPEED),
    "current": Quantity(("current", "actual_current", "motor_current"), {"A": (1.0, 0.0), "mA": (1e-3, 0.0)}),
    "torque": Quantity(("torque", "actual_torque", "motor_torque"), TORQUE),
    "screw_torque": Quantity(("screw_torque",), TORQUE),
    "force": Quantity(("force", "drive_force"), FORCE),
    "voltage": Quantity(("voltage", "drive_voltage"), {"V": (1.0, 0.0), "mV": (1e-3, 0.0)}),
    "temperature": Quantity(("temperature", "oil_temperature"), KELVIN),
    "preload": Quantity(("preload",), FORCE),
}  # fmt: skip
EXAMPLE = "time [s], position [mm], current [A]"
#: signals of the motion, the position first, and of the drive; the first that a log has is used
MOTION = ("position", "screw_position", "speed", "screw_speed")
EFFORT = ("force", "screw_torque", "torque", "current", "voltage")


def log_columns(headings: list[str]) -> tuple[dict[str, tuple[str, str]], list[str]]:
    """Heading and unit by signal, and the headings that are not used.

    Raises       ValueError: a known signal without unit or with an unknown one, misspelt, given twice; one missing
    """
    found: dict[str, tuple[str, str]] = {}
    unused = []
    for heading in headings:
        column = column_of(heading, QUANTITIES, ("comment",), EXAMPLE)
        if column is None or not column.unit:
            unused.append(heading)
            continue
        if column.key in found:
            raise ValueError(
                f"columns {found[column.key][0]!r} and {heading!r} both are {column.key}; allowed: one"
            )
        found[column.key] = heading, column.unit
    needed = {"time": ("time",), "position or speed": MOTION, "current, torque, force or voltage": EFFORT}
    for what, names in needed.items():
        if not found.keys() & set(names):
            raise ValueError(
                f"column {what} missing (found: {', '.join(headings)}); allowed: headings with units, such as "
                f"{EXAMPLE}"
            )
    return found, unused
