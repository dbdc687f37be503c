"""What a ball-screw program states of a screw: ratings, loads, pressure, stiffness, life, efficiency."""

import math
from typing import NamedTuple

from ..parameters.file import ScrewParameters
from ..physics.load import double_nut_loads, separation_load
from ..physics.rating import STATIC_PRESSURE, ball_pressure, dynamic_rating, life, nsk_torque, static_rating
from ..physics.stiffness import axial_deflection, axial_stiffness, nut_stiffness_constant


class ScrewConstants(NamedTuple):
    """Constants of a screw at any load.

    Attributes
    ----------
    static_rating, dynamic_rating : float
        Axial, of one nut [N].
    stiffness : float
        k of F = k deflection^(3/2) [N/m^1.5].
    """

    static_rating: float
    dynamic_rating: float
    stiffness: float


class LoadedScrew(NamedTuple):
    """Nut under a preload and an axial load, on the balls that carry load.

    Attributes
    ----------
    nut_force_a : float
        Of the nut that an axial load > 0 loads, as in the FMUs; nut B of physics.load [N].
    nut_force_b : float
        Of the nut that it relieves [N].
    separation_load : float
        Axial load that unloads a nut, in its direction; without one the smaller [N].
    ball_load_max, contact_pressure_max : float
        Largest ball load [N] and its Hertz pressure [Pa].
    static_load_rating, static_safety : float
        Static rating [N], and over the larger force of a nut.
    pressure_over_static : float
        Pressure over STATIC_PRESSURE.
    dynamic_load_rating, preload_over_dynamic : float
        Dynamic rating [N], and preload over it.
    life_turns : float
        L10 in turns.
    axial_stiffness, axial_deflection : float
        [N/m] and [m].
    lost_motion : float
        When the axial load changes its sign [m].
    catalogue_torque : float
        JIS B 1192 [N.m].
    """

    nut_force_a: float
    nut_force_b: float
    separation_load: float
    ball_load_max: float
    contact_pressure_max: float
    static_load_rating: float
    static_safety: float
    pressure_over_static: float
    dynamic_load_rating: float
    preload_over_dynamic: float
    life_turns: float
    axial_stiffness: float
    axial_deflection: float
    lost_motion: float
    catalogue_torque: float


class Efficiency(NamedTuple):
    """Useful over spent work in one turn [1]."""

    driving: float  # screw drives the nut
    backdriving: float  # nut drives the screw; 0: self-locking


def screw_constants(screw: ScrewParameters) -> ScrewConstants:
    """Constants of a screw, computed once for all loads.

    Parameters
    ----------
    screw : ScrewParameters
        Geometry.

    Returns
    -------
    ScrewConstants
        Ratings [N] and stiffness constant.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> f"{screw_constants(load_screw().screw).dynamic_rating / 1e3:.1f} kN"
    '26.5 kN'
    """
    return ScrewConstants(static_rating(screw), dynamic_rating(screw), nut_stiffness_constant(screw))


def loaded_screw(
    screw: ScrewParameters, constants: ScrewConstants, preload: float, axial_load: float
) -> LoadedScrew:
    """Loads, pressure, stiffness and life at a preload and an axial load.

    Parameters
    ----------
    screw : ScrewParameters
        Geometry.
    constants : ScrewConstants
        Its constants.
    preload : float
        Preload [N], >= 0.
    axial_load : float
        Axial load [N].

    Returns
    -------
    LoadedScrew
        Results, SI.

    Raises
    ------
    ValueError
        A force not finite, or preload negative.

    Notes
    -----
    Sources: physics.load, physics.rating, physics.stiffness.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> screw = load_screw().screw
    >>> f"{loaded_screw(screw, screw_constants(screw), 2000.0, 0.0).axial_stiffness / 1e6:.0f} N/um"
    '1353 N/um'
    """
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
