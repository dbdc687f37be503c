"""A contact that does not converge by itself, by way of others that do: lower speeds or loads.

Beyond the loads that converge or that a grid resolves, films are extrapolated from lower ones: the asymptotic branch.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from ..parameters.file import LubricantParameters
from .conditions import ContactConditions, SolverOptions, cells_in_inlet, expected_grid, scales_of
from .integrals import ContactIntegrals, walls
from .one_grid import HIGH_LOAD, solve_cold, solve_near
from .problem import ContactProblem
from .solution import RESOLVED_CELLS, TOUCHING, ContactSolution
from .starts import weighted

#: continuation in speed or load: share by which the first start is sought lower, and how often; first, largest and
#: least step of ln(share); growth of a step after a success, solves at most; a failure halves the step
LOWER, MOST_LOWER = 0.5, {"speed": 3, "load": 5}
FIRST_STEP, LARGEST_STEP, LEAST_STEP = 0.1, 0.4, 0.01
STEP_GROWTH, MOST_STEPS = 1.5, 40
#: last solutions through which the next is extrapolated: a quadratic
NEIGHBOURS = 3
#: largest share of the highest load that converges at which its neighbour of an extrapolation lies
FARTHER = 0.6
#: halvings of the load, from the first that the grid is expected to resolve, in search of two resolved ones
MOST_HALVINGS = 8
#: share of the load below which no resolved load is expected: ends that search
LEAST_LOAD_SHARE = 1e-6

#: solution at other conditions by the way of solve, without extrapolation
Solve = Callable[[ContactConditions], ContactSolution]


def continued(
    problem: ContactProblem, failed: ContactSolution
) -> tuple[ContactSolution, list[ContactSolution]]:
    """By rising speed or load, from the first half of it that converges.

    Heat and the film grow with the speed: a spike of cold oil far from its place is not found from the dry contact.
    Where M is high, it is the load that leaves a hot film of a nanometre. At most options.max_thermal iterations from
    the first that converges, and MOST_STEPS solves.
    Returns the solution, or the failed one, and the converged ones of a thermal contact on the way in load
    """
    name = "load" if failed.M > HIGH_LOAD else "speed"

    def at(share: float) -> ContactProblem:
        c = problem.given
        if share == 1.0:
            return problem
        lower = replace(c, load=share * c.load) if name == "load" else c.at_speed(share)
        return ContactProblem(lower, problem.oil, problem.solid, problem.options)

    share, reached = 1.0, failed
    for _ in range(MOST_LOWER[name]):
        share *= LOWER
        reached = solve_cold(at(share))
        if reached.converged:
            break
    if not reached.converged:
        return replace(failed, reason=f"{failed.reason}; nor at {share:g} of the {name}"), []
    begun_at, step, left = share, FIRST_STEP, problem.options.max_thermal
    line = [(share, reached)]
    for _ in range(MOST_STEPS):
        following = min(share * math.exp(step), 1.0)
        solution = solve_near(at(following), weighted(following, line[-NEIGHBOURS:]), left)
        left -= solution.iterations
        if solution.converged:
            share = following
            line.append((share, solution))
            step = min(STEP_GROWTH * step, LARGEST_STEP)
            if share == 1.0:
                break
        elif solution.reason == TOUCHING:
            # films about as thin as the error of the grid: no base of an extrapolation
            del line[1:]
            break
        else:
            step *= 0.5
        if left <= 0 or step < LEAST_STEP:
            break
    if share == 1.0:
        reason = f"{solution.reason}, continued from {begun_at:g} of the {name}"
        solution = replace(solution, reason=reason, iterations=problem.options.max_thermal - left)
    else:
        reason = f"{failed.reason}; continued from lower {name}s as far as {share:.3g} of the {name}"
        solution = replace(failed, reason=reason)
    return solution, [s for _, s in line] if name == "load" and problem.options.thermal else []


def thermal_reduction_continued(
    failed: ContactSolution, line: list[ContactSolution], isothermal: Solve, thermal: Solve
) -> ContactSolution:
    """The asymptotic branch of a thermal contact: the thermal reduction beyond the loads that converge.

    line: thermal solutions at lower loads, rising; where there are too few, halves of the load are solved. Film over
    isothermal film and minimum over central film are extrapolated linearly in logarithms from the highest load that
    converges and one of FARTHER of it at most, the rest as by _Extrapolation: 10 % too much film, 12 % too much rise
    and 20 % too much mean viscosity over one halving, where both are known (M = 2e4). The fields are those of the load
    that converges.
    """
    c, found = failed.conditions, line[-1:]
    load = found[-1].conditions.load if found else c.load
    found += [s for s in line if s.conditions.load <= FARTHER * load][-1:]
    for _ in range(MOST_LOWER["load"]):
        if len(found) == 2:
            break
        load *= 0.5
        lower = thermal(replace(c, load=load))
        found = [*found, lower] if lower.converged else []
    else:
        return replace(failed, reason=f"{failed.reason}; no film to extrapolate")
    hot, farther = found
    cold, *pair = (isothermal(s.conditions) for s in (failed, hot, farther))
    if not all(s.converged for s in (cold, *pair)):
        return replace(failed, reason=f"{failed.reason}; no isothermal film to reduce")
    near, far = (s.h_c / own.h_c for s, own in zip((hot, farther), pair, strict=True))
    extrapolated = _Extrapolation(hot, farther, c.load)
    h_c = cold.h_c * min(extrapolated(near, far), 1.0)
    return hot.moved_to(
        failed,
        **extrapolated.values(failed),
        p_max=cold.p_max,
        h_c=h_c,
        h_m=h_c * min(extrapolated(hot.h_m / hot.h_c, farther.h_m / farther.h_c), 1.0),
        reason=f"thermal reduction continued from {hot.conditions.load:.6g} N",
    )


class _Extrapolation:
    """Values at a load from those of two lower ones, linearly in logarithms; the nearer where their signs differ."""

    def __init__(self, near: ContactSolution, far: ContactSolution, load: float) -> None:
        self.near, self.far = near, far
        self.power = math.log(load / near.conditions.load) / math.log(
            near.conditions.load / far.conditions.load
        )

    def __call__(self, near: float, far: float) -> float:
        return near * (near / far) ** self.power if near * far > 0.0 else near

    def values(self, target: ContactSolution) -> dict[str, float]:
        """Temperature rise, traction, heat and integrals."""
        near, far = self.near, self.far
        names = ("temperature_rise", "traction_force", "sliding_heat", *ContactIntegrals._fields)
        values = {name: self(getattr(near, name), getattr(far, name)) for name in names}
        # the mean temperature by its rise
        T, u_e = target.conditions.temperature, target.conditions.u_e
        values["mean_temperature"] = T + self(near.mean_temperature - T, far.mean_temperature - T)
        resistance = values["rolling_resistance"]
        values["rolling_loss"] = abs(u_e) * resistance
        return values | walls(u_e, values["traction_force"], resistance)


def anchored(
    solution: ContactSolution,
    oil: LubricantParameters,
    options: SolverOptions,
    isothermal: Solve,
) -> ContactSolution:
    """The asymptotic branch: films extrapolated from the highest load that the grid resolves.

    The ratio of the isothermal film to its closed formula is taken at that load and at half of it and extrapolated
    linearly over the logarithm of load. The thermal reduction, pressure and temperature are those of the solution
    itself: they do not depend on the narrow inlet. An isothermal solution that did not converge gets the fields of the
    highest load that the grid resolves, and forces, heat and integrals extrapolated from the two.
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
        h_c *= solution.h_c / at(c.load).h_c
    h_m = h_c * anchor.h_m / anchor.h_c
    if solution.converged:
        return replace(solution, h_c=h_c, h_m=h_m)
    return anchor.moved_to(
        solution,
        **_Extrapolation(anchor, lower, c.load).values(solution),
        p_max=float(solution.hertz.p_max),
        h_c=h_c,
        h_m=h_m,
        reason=f"film continued from {anchor.conditions.load:.6g} N",
    )


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
