"""Text of the pages of BallScrewPreloadMonitor, for Python hosts and native."""

from collections.abc import Mapping
from typing import Any

from ballscrew_fmu.pages.page import Part, part
from ballscrew_tehl.report.page import bullets

LEAD = (
    "Preload of a double-nut ball screw from its measured friction torque, speed and temperature: the preload at "
    "which a map of thermal elastohydrodynamic contact solutions gives that torque. "
)
#: FMI 2 tolerates a step of size 0, FMI 3 does not
ZERO_STEP = {
    2: "A step of size 0 computes the outputs and stores nothing.",
    3: "A step of size 0 is an Error.",
}
NATIVE_STEP = (
    "A step takes a bounded number of evaluations of the map, mostly four to seven, and allocates no memory."
)
MODEL_EXCHANGE = part(
    "Model exchange",
    "No continuous state. Rest and in_range change at events only, with hysteresis: motion_indicator passes 0 where "
    "the speed reaches speed_min, in_range_indicator where the preload or an input leaves the map. At the event that "
    "ends motion or range the preload is stored. No directional derivatives.",
)


def monitor_parts(header: Mapping[str, Any], refusal: str, step: str) -> list[Part]:
    """Validity and behaviour.

    Parameters   refusal : effect of an invalid number;  step : when inputs act and outputs change
    """
    validity = bullets(
        "The inverse of BallScrewFriction with the same parameters and without presliding. Errors of the model are not "
        "included: calibrate the friction parameters to your screw first.",
        "torque must be that of friction alone: subtract the torque of inertia, of the motor and of the axial load "
        "(lead over 2 pi times load) first.",
        "preload_half_width is torque_uncertainty over torque_sensitivity, for small intervals. Noise of speed and "
        "temperature and errors of the calibration are not included. The start value of torque_uncertainty is an "
        "example.",
    )
    behaviour = bullets(
        "in_range is true while the torque determines the preload: speed at or above speed_min, speed, temperature and "
        "axial load within the map, and a preload within the map that gives the torque.",
        "Below speed_min, and at speed 0, preload keeps the last value that was in range, or initial_preload before "
        "the first one. Half-width and sensitivity are those of that preload at speed_min. The start value of "
        "speed_min, 1 rad/s, is ten times that of regularization_speed: torque measured below is breakaway and "
        "stick-slip.",
        "While the screw turns, preload follows the torque beyond the range as well, with in_range false. A torque "
        "in the direction of motion gives 0. A torque above the range of the map gives the highest preload of the "
        f"map. Below {header['axes']['preload'][0]:g} N the power laws of the map are extrapolated. Speed and "
        "temperature are clamped to the map.",
        "Torque rises with preload in the packaged maps as long as both nuts are loaded. Where an axial load separates "
        "them, the torque is that of one nut. Then preload is the one at which they separate, an upper bound, and "
        "in_range is false. in_range is also false where 1 % of preload is less than 0.01 % of torque, or where the "
        "torque of a map falls with preload.",
        f"Inputs that are clamped are logged once each. {refusal}",
        step,
        "The state can be saved, restored and serialized. A state of another version or map is refused.",
    )
    return [part("Validity", validity), part("Behaviour", behaviour)]
