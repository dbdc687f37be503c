"""Two published formulas for the drag torque of a preloaded nut, for every comparison table and plot.

Both are proportional to the preload and independent of speed and oil.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..parameters.file import ScrewParameters

#: friction coefficient that the printed torques of Zhou's model imply
ZHOU_COEFFICIENT = 0.0065


def nsk_slope(screw: ScrewParameters) -> float:
    """Drag torque per newton of preload after NSK.

    Returns      0.05 L_p/(2 pi sqrt(tan lambda)) [N.m/N]; 0.2524 N.m per kN for the GD4008-3
    Source       JIS B1192 / ISO 3408-3 form, as used in Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231
    """
    return 0.05 * screw.lead / (2.0 * math.pi * math.sqrt(math.tan(screw.lead_angle)))


def zhou_slope(screw: ScrewParameters, coefficient: float = ZHOU_COEFFICIENT) -> float:
    """Drag torque per newton of preload after Zhou.

    Returns      2 mu (r_m + r_b cos(beta))/sin(beta) [N.m/N]; 0.3987 N.m per kN for the GD4008-3
    Source       the form and mu = 0.0065 that reproduce the values of Zhou's model printed in Zhao 2023 Table
                 2 at 4 to 6 kN to all digits; the formula itself is not printed there
    """
    beta = screw.contact_angle
    return (
        2.0
        * coefficient
        * (screw.nominal_radius + 0.5 * screw.ball_diameter * math.cos(beta))
        / math.sin(beta)
    )


def nsk_torque(screw: ScrewParameters, preload: Any) -> np.ndarray:
    """Drag torque of the double nut after NSK [N.m]; preload [N], see nsk_slope."""
    return np.asarray(preload) * nsk_slope(screw)


def zhou_torque(screw: ScrewParameters, preload: Any) -> np.ndarray:
    """Drag torque of the double nut after Zhou [N.m]; preload [N], see zhou_slope."""
    return np.asarray(preload) * zhou_slope(screw)
