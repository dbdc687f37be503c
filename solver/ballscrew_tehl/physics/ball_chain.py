"""The balls of a nut as a chain between two elastic rods, screw and nut body.

Counted from the outer face of a nut to the spacer, with axial approach d, axial force f(d) of a ball and
K = dz (1/(E A_screw) + 1/(E A_nut)), the recurrence of force and stretch, S_j = S_(j-1) - s f_j, N_j = N_(j-1) + s f_j,
d_(j+1) = d_j - s dz [S_j/(E A_screw) - N_j/(E A_nut)], becomes

    d_(k+1) - 2 d_k + d_(k-1) = K f(d_k),    d_2 - d_1 = K f(d_1) + end slope,

for both nuts alike. Newton's method on the whole chain has a banded matrix and needs no case for a free nut.
scipy is imported in the functions: evaluation of a stored map needs no load distribution.
"""

import math
from collections.abc import Callable

import numpy as np

from ..parameters.file import ScrewParameters
from .ball_law import MAX_STEPS, Array, check_force, contact_compliance, flank_law, preload_ball_load


def ball_pitch(screw: ScrewParameters, ball_count: int) -> float:
    """Axial pitch dz of the balls [m]: touching balls on the helix, or the loaded turns shared out."""
    return max(screw.ball_diameter * math.sin(screw.lead_angle), screw.turns * screw.lead / (ball_count - 1))


class BallChain:
    """One screw's bodies and ball law with n balls in each nut."""

    least_scale = 0.0  # approach to which the accuracy is relative where a load has a smaller one [m]

    def __init__(self, screw: ScrewParameters, ball_count: int) -> None:
        self.n = int(ball_count)
        self.law = flank_law(screw)
        dz, modulus = ball_pitch(screw, self.n), screw.youngs_modulus
        self.K = dz / modulus * (1.0 / screw.screw_section_area + 1.0 / screw.nut_section_area)
        areas = 1.0 / screw.screw_section_area + 1.0 / screw.spacer_section_area
        self.spacer_stretch = screw.spacer_length / modulus * areas

    def rigid_approach(self, force: float) -> float:
        """Approach of n equal balls under a force, by the unloaded law's power: a start for Newton."""
        if force <= 0.0:
            return 0.0
        d = 1e-6
        for _ in range(MAX_STEPS):
            f = self.n * float(self.law(np.array([d]))[0][0])
            if abs(f - force) <= 1e-3 * force:
                break
            d *= (force / f) ** (2.0 / 3.0)
        return d

    def newton(
        self, d: Array, end_slopes: tuple[float, float], close: Callable[..., None], scale: float
    ) -> Array:
        """Approaches of a chain from a start (m,) of the size scale [m], whose inner rows are the recurrence.

        end_slopes : of d inwards at the first and last ball [m]
        close(d, f, slope, residual, bands) : overwrites rows of residual [m] and matrix that end the chain
        """
        from scipy.linalg import solve_banded

        def system(d: Array) -> tuple[Array, Array]:
            f, slope, _ = self.law(d)
            residual, bands = -self.K * f, np.ones((4, d.size))
            step = np.diff(d)
            residual[:-1] += step
            residual[1:] -= step
            residual[0] -= end_slopes[0]
            residual[-1] -= end_slopes[1]
            bands[1] = -2.0 - self.K * slope
            bands[1, [0, -1]] += 1.0
            bands[3] = 0.0
            close(d, f, slope, residual, bands)
            return residual, bands

        residual, bands = system(d)
        for _ in range(MAX_STEPS):
            step = solve_banded((2, 1), bands, residual, check_finite=False)
            if float(np.max(np.abs(step))) <= 1e-9 * scale:  # the error after it is of the order of rounding
                return d - step
            norm, factor = float(np.max(np.abs(residual))), 1.0
            while True:
                trial = d - factor * step
                residual, bands = system(trial)
                if float(np.max(np.abs(residual))) < norm or factor < 1e-3:
                    break
                factor *= 0.5
            d = trial
        last = float(np.max(np.abs(step)))
        raise ArithmeticError(f"ball loads not converged: last step {last:.1e} m of {scale:.1e} m")

    def nut(self, force: float, end_slope: float = 0.0) -> Array:
        """Approaches of one nut under its axial force, outer ball first (n,) [m]."""
        start = self.rigid_approach(force)

        def close(d: Array, f: Array, slope: Array, residual: Array, bands: Array) -> None:
            # sum of forces, plus the rows above: this makes the matrix row local
            residual[-1] = residual[:-1].sum() + self.K * (f.sum() - force)
            bands[1, -1], bands[2, -2] = 1.0 + self.K * slope[-1], -1.0

        # at least one ball carries: the slope must not separate all of them at the start
        lift = max(0.0, -end_slope) * (self.n - 1)
        scale = max(start + lift, self.least_scale)
        return self.newton(np.full(self.n, start + lift), (end_slope, 0.0), close, scale)

    def double_nut(self, gap: float, axial_load: float, start: tuple[float, float]) -> Array:
        """Approaches of both nuts, left to right (2n,) [m]; `start` for each nut."""
        n, K, spacer = self.n, self.K, self.spacer_stretch

        def close(d: Array, f: Array, slope: Array, residual: Array, bands: Array) -> None:
            f_a = f[:n].sum() + residual[: n - 1].sum() / K
            f_b = f[n:].sum() + residual[n + 1 :].sum() / K
            residual[n - 1] = d[n - 1] + d[n] + spacer * f_a - gap
            residual[n] = K * (f_b - f_a - axial_load)
            d_f = 1.0 / K + slope[n - 1]
            bands[2, n - 2], bands[1, n - 1], bands[0, n] = -spacer / K, 1.0 + spacer * d_f, 1.0
            bands[3, n - 2], bands[2, n - 1] = 1.0, -K * d_f
            bands[1, n], bands[0, n + 1] = 1.0 + K * slope[n], -1.0

        first = np.repeat(start, n)
        return self.newton(first, (0.0, -K * axial_load), close, max(abs(gap), *start))


def ball_oversize(screw: ScrewParameters, preload: float, ball_count: int) -> float:
    """Oversize in diameter [m] of the balls of a single nut for a preload [N]: 2.78 um for 2000 N on GD4008-3.

    Source       Hertz: both contacts of a line together approach by C Q^(2/3), Q = F_p/(n sin(beta) cos(lambda))
    """
    check_force("preload", preload)
    return float(contact_compliance(screw) * np.cbrt(preload_ball_load(screw, preload, ball_count)) ** 2)


class FourPointChain(BallChain):
    """The balls of a single nut between four flanks each: net axial force of the loaded and the relieved pair."""

    def __init__(self, screw: ScrewParameters, preload: float, ball_count: int) -> None:
        super().__init__(screw, ball_count)
        self.least_scale = ball_oversize(screw, preload, ball_count)
        self.flank = flank_law(screw, self.least_scale)
        self.law = self._net

    def _net(self, d: Array) -> tuple[Array, Array, Array]:
        f, slope, Q = self.flank(d)
        f_back, slope_back, _ = self.flank(-d)
        return f - f_back, slope + slope_back, Q

    def rigid_approach(self, force: float) -> float:
        """Displacement of n equal balls under a force by their stiffness under preload: a start for Newton."""
        stiffness = self.n * float(self.law(np.zeros(1))[1][0])
        return force / stiffness if stiffness > 0.0 else super().rigid_approach(force)

    def ways(self, axial_load: float) -> Array:
        """Axial displacements at the balls, left to right [m], under a load > 0 on the right end, screw held there."""
        return self.nut(axial_load, -self.K * axial_load)[::-1]
