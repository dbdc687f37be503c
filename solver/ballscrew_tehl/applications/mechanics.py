"""What a ball-screw program states of a screw: ratings, loads, pressure, stiffness, life, efficiency."""

import math
from typing import NamedTuple

from ..parameters.file import ScrewParameters
from ..physics.load import double_nut_loads, separation_load
from ..physics.rating import STATIC_PRESSURE, ball_pressure, dynamic_rating, life, nsk_torque, static_rating
from ..physics.stiffness import axial_deflection, axial_stiffness, nut_stiffness_constant


class ScrewConstants(NamedTuple):
    """What a screw has at any load."""

    static_rating: float  # [N] axial, of one nut
    dynamic_rating: float  # [N]
    stiffness: float  # [N/m^1.5] k of F = k deflection^(3/2)


class LoadedScrew(NamedTuple):
    """The nut under a preload and an axial load, on the balls that carry load."""

    nut_force_a: float  # [N] of the nut that an axial load > 0 loads, as in the FMUs; nut B of physics.load
    nut_force_b: float  # [N] of the nut that it relieves
    separation_load: float  # [N] unloads a nut, along the axial load; without one the smaller
    ball_load_max: float  # [N]
    contact_pressure_max: float  # [Pa]
    static_load_rating: float  # [N]
    static_safety: float  # rating over the larger force of a nut
    pressure_over_static: float  # over STATIC_PRESSURE
    dynamic_load_rating: float  # [N]
    preload_over_dynamic: float
    life_turns: float  # L10
    axial_stiffness: float  # [N/m]
    axial_deflection: float  # [m]
    lost_motion: float  # [m] when the axial load changes its sign
    catalogue_torque: float  # [N.m] JIS B 1192


class Efficiency(NamedTuple):
    """Useful over spent work in one turn [1]."""

    driving: float  # screw drives the nut
    backdriving: float  # nut drives the screw; 0: self-locking


def screw_constants(screw: ScrewParameters) -> ScrewConstants:
    """Constants of a screw, computed once for all loads."""
    return ScrewConstants(static_rating(screw), dynamic_rating(screw), nut_stiffness_constant(screw))


def loaded_screw(
    screw: ScrewParameters, constants: ScrewConstants, preload: float, axial_load: float
) -> LoadedScrew:
    """Loads, pressure, stiffness and life at a preload [N] >= 0 and an axial load [N]."""
    count = screw.loaded_ball_count
    nuts = double_nut_loads(screw, preload, axial_load, count)
    heaviest = max(float(nuts.Q_a.max()), float(nuts.Q_b.max()))
    pressure = ball_pressure(screw, heaviest) if heaviest > 0.0 else 0.0
    largest = max(nuts.force_a, nuts.force_b)
    static, dynamic, k = constants
    signs = (math.copysign(1.0, axial_load),) if axial_load else (1.0, -1.0)
    deflection = axial_deflection(k, preload, axial_load)
    return LoadedScrew(
        nut_force_a=nuts.force_b,
        nut_force_b=nuts.force_a,
        separation_load=min(separation_load(screw, preload, count, int(sign)) for sign in signs),
        ball_load_max=heaviest,
        contact_pressure_max=pressure,
        static_load_rating=static,
        static_safety=static / largest if largest > 0.0 else math.inf,
        pressure_over_static=pressure / STATIC_PRESSURE,
        dynamic_load_rating=dynamic,
        preload_over_dynamic=preload / dynamic,
        life_turns=life(screw, nuts.force_a, nuts.force_b),
        axial_stiffness=axial_stiffness(k, preload, deflection),
        axial_deflection=deflection,
        lost_motion=2.0 * abs(deflection),
        catalogue_torque=float(nsk_torque(screw, preload)),
    )


def efficiency(screw: ScrewParameters, axial_load: float, torque: float) -> Efficiency | None:
    """Efficiency both ways under an axial load [N] with a friction torque [N.m], magnitude; None without axial load."""
    useful = abs(axial_load) * screw.lead / (2.0 * math.pi)
    if useful == 0.0:
        return None
    # below zero: self-locking
    return Efficiency(useful / (useful + torque), max(1.0 - torque / useful, 0.0))
