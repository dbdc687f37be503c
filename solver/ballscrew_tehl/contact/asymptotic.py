"""The asymptotic branch: beyond the loads that a grid resolves, films are extrapolated from lower ones."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from ..parameters.file import LubricantParameters
from .conditions import ContactConditions, SolverOptions, cells_in_inlet, expected_grid, scales_of
from .solution import RESOLVED_CELLS, ContactSolution

#: halvings of the load, from the first that the grid is expected to resolve, in search of two resolved ones
MOST_HALVINGS = 8
#: share of the load below which no resolved load is expected: ends that search
LEAST_LOAD_SHARE = 1e-6


def anchored(
    solution: ContactSolution,
    oil: LubricantParameters,
    options: SolverOptions,
    isothermal: Callable[[ContactConditions], ContactSolution],
) -> ContactSolution:
    """The asymptotic branch: films extrapolated from the highest load that the grid resolves.

    The ratio of the isothermal film to its closed formula is taken at that load and at half of it and extrapolated
    linearly over the logarithm of load. The thermal reduction, pressure and temperature are those of the solution
    itself: they do not depend on the narrow inlet.
    """
    c, scales = solution.conditions, scales_of(solution.conditions, oil)

    def at(load: float) -> ContactSolution:
        return isothermal(replace(c, load=load))

    anchors = _resolved_pair(c, oil, options, at)
    if anchors is None:
        reason = "no resolved load to anchor the asymptotic branch to"
        return replace(solution, converged=False, reason=reason)
    anchor, lower = anchors

    def ln_ratio(s: ContactSolution) -> float:
        own = scales_of(s.conditions, oil)
        return math.log(s.h_c / (own.film_estimate * own.h_unit))

    slope = (ln_ratio(anchor) - ln_ratio(lower)) / math.log(2.0)
    ln_share = ln_ratio(anchor) + slope * math.log(c.load / anchor.conditions.load)
    h_c = scales.film_estimate * scales.h_unit * math.exp(ln_share)
    if options.thermal:
        cold = at(c.load)
        if not cold.converged:
            return replace(solution, converged=False, reason=f"no isothermal film to reduce: {cold.reason}")
        h_c *= solution.h_c / cold.h_c
    return replace(solution, h_c=h_c, h_m=h_c * anchor.h_m / anchor.h_c)


def _resolved_pair(
    c: ContactConditions,
    oil: LubricantParameters,
    options: SolverOptions,
    at: Callable[[float], ContactSolution],
) -> tuple[ContactSolution, ContactSolution] | None:
    """Solutions at the highest halved load that the grid resolves and at half of it; None if there are none."""
    load, lower = c.load, None
    # expected films give nearly where the grid begins to resolve: no solves before
    while load > LEAST_LOAD_SHARE * c.load and not expected_resolved(
        replace(c, load=0.5 * load), oil, replace(options, thermal=False)
    ):
        load *= 0.5
    for _ in range(MOST_HALVINGS):
        load *= 0.5
        anchor, lower = lower, at(load)
        if anchor is not None and anchor.usable and lower.usable:
            return anchor, lower
    return None


def expected_resolved(
    conditions: ContactConditions, oil: LubricantParameters, options: SolverOptions, share: float = 1.0
) -> bool:
    """Whether the grid of an operating point holds a share of the cells that its expected inlet asks for."""
    scales = scales_of(conditions, oil)
    x = expected_grid(conditions, scales, scales.film_estimate, options).build().x
    return cells_in_inlet(x, scales.film_estimate) >= share * RESOLVED_CELLS
