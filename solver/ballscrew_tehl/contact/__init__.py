"""Thermal elastohydrodynamic solve of one elliptical contact: everything that other rooms may take from here.

`solve` is the one way to a result; `solve_ball`, `solve_for_map` and `solve_moes` only make its conditions and options.
"""

from .conditions import (
    MAP_NODES,
    ContactConditions,
    Scales,
    SolverOptions,
    ball_conditions,
    map_nodes,
    scales_of,
)
from .moes import MoesFilm, moes_conditions, reference_oil, solve_moes
from .result import THICKEST, ContactResult, HeatBalance
from .solver import UnconvergedContactError, announce_compilation, solve, solve_ball, solve_for_map

__all__ = [
    "MAP_NODES", "THICKEST", "ContactConditions", "ContactResult", "HeatBalance", "MoesFilm", "Scales", "SolverOptions",
    "UnconvergedContactError", "announce_compilation", "ball_conditions", "map_nodes", "moes_conditions",
    "reference_oil", "scales_of", "solve", "solve_ball", "solve_for_map", "solve_moes",
]  # fmt: skip
