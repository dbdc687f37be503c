"""Text of the pages of BallScrewPreloadMonitor, for Python hosts and native."""

from collections.abc import Mapping
from typing import Any

from ballscrew_fmu.pages.page import Part, part
from ballscrew_tehl.report.page import bullets

LEAD = (
    "Preload of a double-nut ball screw from its measured friction torque, speed and temperature: the preload at "
    "which a map of thermal elastohydrodynamic contact solutions gives that torque. "
)
#: FMI 2 allows a step of size 0, FMI 3 does not
ZERO_STEP = {
    2: "A step of size 0 computes the outputs and stores nothing.",
    3: "A step of size 0 is an Error.",
}
NATIVE_STEP = (
    "A step needs a bounded number of evaluations of the map, usually four to seven, and allocates no memory."
)
MODEL_EXCHANGE = part(
    "Model exchange",
    "No continuous state. Rest and in_range change at events only, with hysteresis. motion_indicator crosses 0 where "
    "the speed crosses speed_min, in_range_indicator where the preload or an input leaves the map. The preload is "
    "stored at the event at which the motion ends or the range is left.",
    "Directional derivatives: the preload is differentiated as an implicit function of the measured torque, so its "
    "derivative is exact. That of torque_sensitivity, and with it of preload_half_width, is a difference quotient.",
)


def monitor_parts(header: Mapping[str, Any], invalid: str, step: str) -> list[Part]:
    """Validity and behaviour.

    Parameters   invalid : effect of an invalid number;  step : when inputs act and outputs change
    """
    validity = bullets(
        "The inverse of BallScrewFriction with the same parameters and without presliding. Errors of the model are not "
        "included. Calibrate the friction parameters of your screw first.",
        "torque is the friction torque alone: subtract the torque of inertia, of the motor and of the axial load "
        "(load times lead/(2 pi)) first.",
        "preload_half_width is torque_uncertainty divided by torque_sensitivity, valid for small intervals. Noise of "
        "speed and temperature and errors of the calibration are not included. The start value of torque_uncertainty "
        "is an example: set it to that of your sensor.",
    )
    behaviour = bullets(
        "in_range is true while the torque determines the preload: the speed is at least speed_min, all inputs are "
        "within the map, and a preload within the map gives the torque.",
        "Below speed_min and at speed 0, preload is the last value that was in range, or initial_preload before the "
        "first one. Half-width and sensitivity are those of that preload at speed_min. The start value of speed_min, "
        "1 rad/s, is ten times that of regularization_speed: torque measured at lower speeds includes breakaway and "
        "stick-slip.",
        "While the screw turns, preload is also computed outside the range, with in_range false. A torque in the "
        "direction of motion gives 0. A torque above the range of the map gives the highest preload of the map. "
        f"Below {header['axes']['preload'][0]:g} N the power laws of the map are extrapolated. Speed and temperature "
        "are clamped to the map.",
        "In the packaged maps the torque increases with preload as long as both nuts are loaded. Where an axial load "
        "separates the nuts, the torque is that of one nut. Then preload is the value at which they separate, an upper "
        "bound, and in_range is false. in_range is also false where a change of preload by 1 % changes the torque by "
        "less than 0.01 %, or where the torque of a map decreases with preload.",
        f"Inputs that are clamped are logged once each. {invalid}",
        step,
        "The state can be saved, restored and serialized. A state of another version or map is rejected.",
    )
    return [part("Validity", validity), part("Behaviour", behaviour)]
