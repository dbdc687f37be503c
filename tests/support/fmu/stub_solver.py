"""A stub of the refinement for tests of the FMU: no contact is solved.

Every new speed counts as a solved contact; each lowers the viscous torque and the films by 1 %, the tolerance as well.
Two preloads raise errors.
"""

UNSOLVED, BROKEN = 1111.0, 1222.0  # [N] preloads where a contact fails, where the refinement itself fails

REFINE = f"""
import math
from typing import NamedTuple


class Solve(NamedTuple):
    speed: float
    failure: str

    def __str__(self):
        return self.failure or f"contact at {{self.speed}} rad/s solved"


class Refinement:
    def __init__(self, nut_map, report):
        self.nut_map, self.report, self.tolerance, self.speeds = nut_map, report, None, []

    def prepare(self):
        pass

    def evaluate_point(self, preload, speed, *others):
        if preload == {UNSOLVED}:
            self.report(Solve(speed, "no convergence"))
        if preload == {BROKEN}:
            raise RuntimeError("broken")
        if speed not in self.speeds:
            self.speeds.append(speed)
            self.report(Solve(speed, ""))
        shift = math.log(1.0 - self.tolerance - 0.01 * len(self.speeds))
        return self.nut_map.evaluate_point(
            preload, speed, *others, correction=lambda force, values: [v + shift for v in values]
        )

    def state(self):
        return {{"speeds": list(self.speeds)}}

    def restore(self, state):
        self.speeds = list(state["speeds"])
"""

SOURCES = {"__init__.py": "", "refinement/__init__.py": "", "refinement/refine.py": REFINE}


def factor(solved: int, tolerance: float = 1e-3) -> float:
    """Factor of the stub for films and rise after a number of solved contacts."""
    return 1.0 - tolerance - 0.01 * solved
