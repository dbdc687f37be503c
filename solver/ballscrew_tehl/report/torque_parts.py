"""Parts of the torque of the mechanistic law over speed and preload."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..friction.sets import FrictionSet
from ..parameters.file import Parameters
from ..physics.ball_law import Array
from ..physics.kinematics import entrainment_speed
from ..physics.load import nut_loads
from ..runtime.evaluate import NutMap

#: parts from the bottom of the stack with their colours (Okabe & Ito)
PARTS = {
    "ball on ball, full film": "#56B4E9",
    "ball on ball, more by asperities": "#0072B2",
    "spin, differential and helix slip": "#009E73",
    "hysteresis": "#F0E442",
    "rolling": "#D55E00",
}


class Law(NamedTuple):
    """The mechanistic law of a screw: its map, its numbers and the oil temperature [K]."""

    parameters: Parameters
    entry: FrictionSet
    nut_map: NutMap
    temperature: float


def torque_parts(law: Law, preload: Array, speed: Array) -> Array:
    """Parts of the torque of the double nut [N.m] without axial load, rows as PARTS (n, ...); their sum is the torque.

    Parameters   preload : [N], speed : [rad/s], broadcast to (...), within the map
    """
    ratio, net, _ = law.entry.values
    preload, speed = np.broadcast_arrays(np.asarray(preload, float), np.asarray(speed, float))
    whole = law.nut_map.evaluate(preload, speed, law.temperature, 0.0, ratio, net)
    slip = np.asarray(law.nut_map.evaluate(preload, speed, law.temperature, 0.0, ratio, 0.0).sliding_torque)
    screw = law.parameters.screw
    loads = {
        force: nut_loads(screw, force, screw.loaded_ball_count).sum()
        for force in set(preload.ravel().tolist())
    }
    on_balls = np.vectorize(loads.__getitem__, otypes=[float])(preload)
    film = 2.0 * net * float(entrainment_speed(screw, 1.0)) * on_balls
    more = np.asarray(whole.sliding_torque) - slip - film
    return np.array([film, more, slip, whole.hysteresis_torque, whole.viscous_torque])
