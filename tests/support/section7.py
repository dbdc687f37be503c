"""The eleven measured points as in the hand-checked numbers: Hamrock-Dowson, uniform loads, 45 degrees."""

import math

import numpy as np
from closed_film import HamrockDowsonFilm

from ballscrew_tehl.applications.calibration.fit import TorqueBasis
from ballscrew_tehl.applications.calibration.measured_screw import packaged_measurements
from ballscrew_tehl.applications.calibration.measurements import Measurement
from ballscrew_tehl.friction.film_shear import UnfittedTorques, nut_sums
from ballscrew_tehl.parameters.file import FOUR_POINT, changed, load_screw

TEMPERATURE = 303.0
RPM = math.pi / 30.0
BETA = math.radians(45.0)
#: balls on four flanks keep the contact angle without load
SCREW = changed(load_screw(), screw={"preload_kind": FOUR_POINT})
FILM = HamrockDowsonFilm(SCREW)
MEASURED = packaged_measurements(TEMPERATURE)


def uniform_sums(preload: float, speed: float) -> UnfittedTorques:
    """86 equal balls at the unloaded contact angle; speed [rad/s]."""
    screw = SCREW.screw
    share = preload / (screw.ball_count * math.sin(BETA) * math.cos(screw.lead_angle))
    loads = np.full(screw.ball_count, share)
    return nut_sums(SCREW, loads, speed, TEMPERATURE, FILM)


def basis_of(points: list[Measurement]) -> TorqueBasis:
    """Torque of the double nut at these points."""
    return TorqueBasis.of_nuts(points, [2 * [uniform_sums(m.preload, m.speed)] for m in points])


BASIS = basis_of(MEASURED)
