"""Thermal elastohydrodynamic solve of one elliptical contact: everything that other rooms may take from here.

`solve` is the one way to a result; `solve_ball`, `solve_for_map` and `solve_moes` only make its conditions and options.
"""

from .ball_contact import (
    MAP_NODES,
    UnconvergedContactError,
    ball_conditions,
    map_nodes,
    solve_ball,
    solve_for_map,
)
from .conditions import ContactConditions, Scales, SolverOptions, scales_of
from .moes import MoesFilm, moes_conditions, reference_oil, solve_moes
from .result import THICKEST, ContactResult, HeatBalance
from .solver import announce_compilation, solve

__all__ = [
    "MAP_NODES", "THICKEST", "ContactConditions", "ContactResult", "HeatBalance", "MoesFilm", "Scales", "SolverOptions",
    "UnconvergedContactError", "announce_compilation", "ball_conditions", "map_nodes", "moes_conditions",
    "reference_oil", "scales_of", "solve", "solve_ball", "solve_for_map", "solve_moes",
]  # fmt: skip
