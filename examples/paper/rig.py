"""Two ball screws of a degradation rig (Xi'an Jiaotong University): lead 8 mm, preload 1500 N, probably 100 r/min.

Their diameter, balls and oil are not published: `rig_screw` makes one that they could be.
"""

import pandas as pd
from pipe_table import data_file

from ballscrew_tehl import load_screw
from ballscrew_tehl.parameters.file import PACKAGED_VG100, Parameters, graded_oil

#: lead [mm], preload [N], speed [r/min], and turns of a nut, assumed
RIG_LEAD_MM, RIG_PRELOAD, RIG_SPEED, RIG_TURNS = 8.0, 1500.0, 100.0, 3.0


def rig_series() -> pd.DataFrame:
    """Torques of both screws over their run: hours, upper_Nm, lower_Nm."""
    return data_file("xjtu_torque.csv")


def rig_torques() -> dict[str, float]:
    """Torque of the two screws when new [N.m]."""
    first = rig_series().iloc[0]
    return {name: float(first[f"{name}_Nm"]) for name in ("upper", "lower")}


def rig_screw(diameter: float, ball: float, iso_vg: int) -> Parameters:
    """A double nut of a nominal diameter with balls of a diameter [mm] and the grooves and angle of the GD4008-3."""
    like, d = load_screw(PACKAGED_VG100), 1e-3 * ball
    screw = like.screw.model_dump(
        include={"preload_kind", "preload_basis", "contact_angle", "youngs_modulus", "poisson_ratio"}
    )
    screw |= {
        "nominal_radius": 0.5e-3 * diameter,
        "ball_diameter": d,
        "lead": 1e-3 * RIG_LEAD_MM,
        "turns": RIG_TURNS,
    }
    for name in ("screw_raceway_radius", "nut_raceway_radius"):
        screw[name] = getattr(like.screw, name) / like.screw.ball_diameter * d
    return Parameters(
        name=f"{diameter:g} x 8, balls of {ball:g} mm, VG {iso_vg}", screw=type(like.screw)(**screw),
        solid=like.solid, lubricant=graded_oil(iso_vg, 95.0), friction=like.friction,
    )  # fmt: skip
