"""The mechanistic law on machines that it was not made for and whose numbers it was not fitted to.

Bearings   caged ball bearings under an axial load against SKF's friction model, which condenses many measurements
Grooves    three balls between two open grooves, the torque of a spin-down: Balan, Houpert, Tufescu & Olaru, Lubricants
           3 (2015) 222
Screws     two new ball screws of a degradation rig (Xi'an Jiaotong University), of which lead, preload and perhaps the
           speed are known, against all double nuts that these could be

Nothing here enters a fit.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..atlas.ball_contacts import BallContacts
from ..caged_bearing import bearing
from ..friction.interval import torque_interval
from ..friction.mechanistic import nuts_powers
from ..friction.sets import default_friction_set
from ..nut_map.built import Progress
from ..parameters.file import Parameters, graded_oil, load_screw
from ..parameters.packaged_data import PACKAGED_DATA, PACKAGED_VG100
from ..parameters.units import CELSIUS, RPM
from ..physics.lubricant import eta0
from ..physics.supply import FLOODED
from ..tables.csv_file import read_rows
from .bearings import BearingPoint, bearing_points, conformity_ratios


class GroovePoint(NamedTuple):
    """Balls in open grooves: diameter [mm], load of each [N], speed [r/min], rolling torques of three balls [N.m]."""

    ball_diameter: float
    load: float
    speed: float
    measured: float
    flooded: float


class ScrewPoint(NamedTuple):
    """A double nut that the screws of the rig could be: diameters [mm], oil, temperature [degC], torques [N.m]."""

    nominal_diameter: float
    ball_diameter: float
    iso_vg: int
    temperature: float
    torque: float
    low: float
    high: float


#: radius of the grooves across rolling, pitch diameter of the balls [m], viscosity of the oil [Pa s]
GROOVE_RADIUS, GROOVE_PITCH, GROOVE_VISCOSITY = 4.16e-3, 36e-3, 0.05


def groove_points(progress: Progress, rows: Sequence[Mapping[str, str]] = ()) -> list[GroovePoint]:
    """The law, flooded, where the spin-downs begin, of rows of data/balan_rolling_torque.csv, none = all: K omega^n.

    Validity     the oil is one of this viscosity, ISO VG 68 at 43 C: at these loads its pressure coefficient does not
                 matter. The contacts are outside the atlas and solved, a second each
    """
    from scipy.optimize import brentq

    oil, rows, found = graded_oil(68, 95.0), rows or read_rows(PACKAGED_DATA / "balan_rolling_torque.csv"), []
    warm = float(brentq(lambda T: float(eta0(oil, T)) - GROOVE_VISCOSITY, 290.0, 350.0))
    for done, row in enumerate(rows):
        progress(done, len(rows), "balls in open grooves")
        d, load, rpm = (float(row[name]) for name in ("ball_diameter_mm", "load_N", "start_speed_rpm"))
        conformity = 1e3 * GROOVE_RADIUS / d
        balls = bearing(
            GROOVE_PITCH, 1e-3 * d, 3, 0.5 * math.pi, conformity, conformity, oil=oil,
            friction={"supply_length": FLOODED},
        )  # fmt: skip
        ((_, nut),) = nuts_powers(balls.parameters, [3.0 * load], balls.contacts, rpm * RPM, warm)
        measured = 1e-5 * float(row["K_1e-5"]) * (rpm * RPM) ** float(row["exponent"])
        found.append(GroovePoint(d, load, rpm, measured, nut.rolling_screw + nut.rolling_nut))
    progress(len(rows), len(rows), "balls in open grooves")
    return found


#: what is known of the screws: lead [m], preload [N], speed [r/min], and turns of a nut, assumed
SCREW_LEAD, SCREW_PRELOAD, SCREW_SPEED, SCREW_TURNS = 8e-3, 1500.0, 100.0, 3.0
#: what they could be: diameters [mm], ISO VG, temperatures [degC]
SCREW_DIAMETERS, SCREW_BALLS, SCREW_OILS = (32.0, 36.0, 40.0), (4.763, 5.556, 6.35), (32, 68, 100, 150, 220)
SCREW_TEMPERATURES = (20.0, 30.0)


def rig_screw(diameter: float, ball: float, iso_vg: int) -> Parameters:
    """A double nut of a nominal diameter with balls of a diameter [mm] and the grooves and angle of the GD4008-3."""
    like, radius, d = load_screw(PACKAGED_VG100), 0.5e-3 * diameter, 1e-3 * ball
    grooves = {
        name: getattr(like.screw, name) / like.screw.ball_diameter * d
        for name in ("screw_raceway_radius", "nut_raceway_radius")
    }
    screw = like.screw.model_dump(
        include={"preload_kind", "contact_angle", "youngs_modulus", "poisson_ratio"}
    )
    screw |= {"nominal_radius": radius, "ball_diameter": d, "lead": SCREW_LEAD}
    screw |= {"turns": SCREW_TURNS, **grooves}
    return Parameters(
        name=f"{diameter:g} x 8, balls of {ball:g} mm, VG {iso_vg}", screw=type(like.screw)(**screw),
        solid=like.solid, lubricant=graded_oil(iso_vg, 95.0), friction=like.friction,
    )  # fmt: skip


def screw_points(progress: Progress, oils: Sequence[int] = SCREW_OILS) -> list[ScrewPoint]:
    """Torque with interval of the screws that those of the rig could be; the number of the law carried over."""
    screws, found = list(itertools.product(SCREW_DIAMETERS, SCREW_BALLS, oils)), []
    for done, (diameter, ball, iso_vg) in enumerate(screws):
        progress(done, len(screws), "screws")
        parameters = rig_screw(diameter, ball, iso_vg)
        contacts, entry = BallContacts(parameters), default_friction_set(parameters)
        for celsius in SCREW_TEMPERATURES:
            at = SCREW_SPEED * RPM, celsius + CELSIUS
            torque = torque_interval(parameters, [SCREW_PRELOAD] * 2, contacts, *at, entry)
            found.append(ScrewPoint(diameter, ball, iso_vg, celsius, torque.torque, torque.low, torque.high))
    progress(len(screws), len(screws), "screws")
    return found


def rig_torques() -> dict[str, float]:
    """Torque of the two screws of the rig when new [N.m]."""
    first = read_rows(PACKAGED_DATA / "xjtu_torque.csv")[0]
    return {name: float(first[f"{name}_Nm"]) for name in ("upper", "lower")}


class Machines(NamedTuple):
    """All comparisons."""

    bearings: list[BearingPoint]
    conformities: dict[str, dict[str, list[float]]]
    grooves: list[GroovePoint]
    screws: list[ScrewPoint]


def machines(progress: Progress) -> Machines:
    """Compute all comparisons: about a minute."""
    return Machines(
        bearing_points(progress), conformity_ratios(), groove_points(progress), screw_points(progress)
    )
