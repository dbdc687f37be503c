"""The eleven measured points as in the hand-checked numbers: Hamrock-Dowson, uniform loads, 45 degrees."""

import math

import numpy as np
from closed_film import HamrockDowsonFilm
from reference_screw import GD4008

from ballscrew_tehl.calibration.fit import TorqueBasis
from ballscrew_tehl.calibration.measurements import Measurement, packaged_measurements
from ballscrew_tehl.friction.torque import NutSums, nut_sums

TEMPERATURE = 303.0
RPM = math.pi / 30.0
BETA = math.radians(45.0)
FILM = HamrockDowsonFilm(GD4008, contact_angle=BETA)
MEASURED = packaged_measurements(TEMPERATURE)


def uniform_sums(preload: float, speed: float) -> NutSums:
    """86 equal balls at the unloaded contact angle; speed [rad/s]."""
    screw = GD4008.screw
    share = preload / (screw.ball_count * math.sin(BETA) * math.cos(screw.lead_angle))
    loads = np.full(screw.ball_count, share)
    return nut_sums(GD4008, loads, speed, TEMPERATURE, FILM, contact_angle=BETA)


def basis_of(points: list[Measurement]) -> TorqueBasis:
    """Torque of the double nut at these points."""
    return TorqueBasis.of_nuts(points, [2 * [uniform_sums(m.preload, m.speed)] for m in points])


BASIS = basis_of(MEASURED)
