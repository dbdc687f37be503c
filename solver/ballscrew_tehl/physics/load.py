"""Ball loads of the preloaded nut: stretch of screw and nut bodies, spacer, external axial load.

Kinds of preload (`preload_kind` of the screw), after the usual names of the trade:

double_nut                two nuts pressed apart by a spacer; each ball touches two flanks.
single_nut_offset         one nut whose thread is shifted by a little in its middle, computed as a double nut: turns and
                          ball counts are those of one half, the nut between the halves, which are assumed to be pressed
                          apart, is the spacer.
single_nut_oversize_ball  balls a few micrometres thicker than their room between grooves of gothic arch: two opposed
                          sets of flanks, each with all the balls. Without axial load their forces are equal; it adds to
                          one and relieves the other. Assumed: bodies stiff in radial direction, flanks symmetric, balls
                          of one size.

With oversize balls, nut A and B of this module are the two sets of flanks. Preload alone stretches neither screw nor
nut; an axial load stretches both, and the force of a set comes from the chain of all balls. The loads that `nut_loads`
gives for it are equal ones: exact under preload, under an axial load the heaviest ball of the loaded set carries up to
6 % more (GD4008-3, 1 to 6 kN, up to the separation load; `double_nut_loads` has it).

Each nut is a chain of balls between two elastic rods, screw and nut body. Counted from the outer face of a nut to the
spacer, with axial approach d, axial force f(d) of a ball and K = dz (1/(E A_screw) + 1/(E A_nut)), the recurrence of
force and stretch, S_j = S_(j-1) - s f_j, N_j = N_(j-1) + s f_j, d_(j+1) = d_j - s dz [S_j/(E A_screw) - N_j/(E A_nut)],
becomes

    d_(k+1) - 2 d_k + d_(k-1) = K f(d_k),    d_2 - d_1 = K f(d_1) + end slope,

for both nuts alike. Newton's method on the whole chain has a banded matrix and needs no case for a free nut.
scipy is imported in the functions: evaluation of a stored map needs no load distribution.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..numerics import MAX_STEPS, Array, rising_root
from ..parameters.file import FOUR_POINT, ScrewParameters
from .ball_law import (
    check_force,
    contact_compliance,
    flank_law,
    flank_travel,
    largest_oversize,
    preload_ball_load,
)

#: Chebyshev nodes over the loads of one nut: three leave an error of the film below 1e-6; more per unit of ln(load);
#: range of ln(load) below which all loads are one
LOAD_NODES, NODES_PER_LN, EQUAL_LOADS = 3, 6.0, 1e-9


def ball_pitch(screw: ScrewParameters, ball_count: int) -> float:
    """Axial pitch dz of the balls of all starts [m]: touching balls on the helix, or the loaded turns shared out."""
    touching = screw.ball_diameter * math.sin(screw.lead_angle) / screw.starts
    return max(touching, screw.turns * screw.lead / (ball_count - 1))


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

        end_slopes: of d inwards at the first and last ball [m]
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

    Hertz: both contacts of a line together approach by C Q^(2/3), Q = F_p/(n sin(beta) cos(lambda)).
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


class DoubleNutLoads(NamedTuple):
    """Loads of all balls, from left to right, and axial forces.

    An axial load > 0 relieves nut A of this module, but loads nut A of the FMUs. With oversize balls: of the same balls
    on the flanks that an axial load > 0 relieves and loads; no spacer.

    Attributes
    ----------
    Q_a : (n,) array
        Loads of the balls of the left nut [N], spacer at its right end.
    Q_b : (n,) array
        Loads of the balls of the right nut [N], spacer at its left end.
    force_a : float
        Axial force of the left nut [N], which the spacer carries.
    force_b : float
        Axial force of the right nut [N], force_a + axial load.
    """

    Q_a: Array
    Q_b: Array
    force_a: float
    force_b: float


_chain, _four_point_chain = lru_cache(maxsize=64)(BallChain), lru_cache(maxsize=64)(FourPointChain)


@lru_cache(maxsize=4096)
def _preload_gap(screw: ScrewParameters, preload: float, ball_count: int) -> float:
    """Excess length of the spacer over the gap between the nuts [m]."""
    chain = _chain(screw, ball_count)
    return 2.0 * float(chain.nut(preload)[-1]) + chain.spacer_stretch * preload


def nut_loads(screw: ScrewParameters, force: float, ball_count: int) -> Array:
    """Normal loads of the balls of one nut.

    Parameters
    ----------
    screw : ScrewParameters
        Screw.
    force : float
        Axial force of the nut [N], >= 0.
    ball_count : int
        Balls n that share the force.

    Returns
    -------
    array (n,)
        Loads [N], that next to the spacer last, each at its contact angle. Oversize balls: one set of flanks, equal
        loads.

    Raises
    ------
    ValueError
        Force negative or not finite.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> f"{nut_loads(load_screw().screw, 2000.0, 72).mean():.1f} N"
    '38.8 N'
    """
    check_force("force", force)
    if screw.preload_kind == FOUR_POINT:
        return np.full(int(ball_count), preload_ball_load(screw, float(force), ball_count))
    chain = _chain(screw, ball_count)
    if force == 0.0:
        return np.zeros(chain.n)
    return chain.law(chain.nut(float(force)))[2]


def double_nut_loads(
    screw: ScrewParameters, preload: float, axial_load: float, ball_count: int
) -> DoubleNutLoads:
    """Ball loads of two nuts that a spacer pushes apart, under an external axial load.

    Parameters
    ----------
    screw : ScrewParameters
        Geometry, kind of preload, section areas.
    preload : float
        Preload [N], >= 0.
    axial_load : float
        Load on the outer flange of the right nut [N], screw fixed on the right; > 0 (to the right) relieves the left
        nut A, < 0 the right nut B.
    ball_count : int
        Balls of each nut that carry load.

    Returns
    -------
    DoubleNutLoads
        Loads (n,) of the balls of both nuts and the axial forces [N].

    Raises
    ------
    ValueError
        Preload or load not finite, or preload negative.
    ArithmeticError
        Newton's method did not converge.

    Notes
    -----
    d_A + d_B + L_sp [S_mid/(E A_screw) - N_sp/(E A_sp)] at the spacer is that of the preload. Chain of balls between
    elastic rods, each ball at the contact angle of its load: head of this module.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> screw = load_screw().screw
    >>> loads = double_nut_loads(screw, 2000.0, 500.0, screw.loaded_ball_count)
    >>> f"{loads.force_a:.0f} N, {loads.force_b:.0f} N"
    '1782 N, 2282 N'
    """
    check_force("preload", preload)
    check_force("axial_load", axial_load, allow_negative=True)
    preload, axial_load = float(preload), float(axial_load)
    if screw.preload_kind == FOUR_POINT:
        balls = _four_point_chain(screw, preload, ball_count)
        d = balls.ways(abs(axial_load)) if axial_load != 0.0 else np.zeros(balls.n)
        # a load to the left acts on the other flanks; the order of the balls is the same
        (f_b, _, Q_b), (f_a, _, Q_a) = (
            balls.flank(math.copysign(1.0, axial_load) * side * d) for side in (1.0, -1.0)
        )
        return DoubleNutLoads(Q_a, Q_b, float(f_a.sum()), float(f_b.sum()))
    chain = _chain(screw, ball_count)
    if preload == 0.0 and axial_load == 0.0:
        nothing = np.zeros(chain.n)
        return DoubleNutLoads(nothing, nothing, 0.0, 0.0)
    gap = _preload_gap(screw, preload, ball_count) if preload > 0.0 else 0.0
    forces = np.array([preload - 0.5 * axial_load, preload + 0.5 * axial_load])
    # start: half of the load on each nut, or all of it on one
    forces = np.where(forces > 0.0, forces, 0.0) + np.where(forces[::-1] < 0.0, -forces[::-1], 0.0)
    d = chain.double_nut(gap, axial_load, (chain.rigid_approach(forces[0]), chain.rigid_approach(forces[1])))
    f, _, Q = chain.law(d)
    return DoubleNutLoads(Q[: chain.n], Q[chain.n :], float(f[: chain.n].sum()), float(f[chain.n :].sum()))


def separation_load(screw: ScrewParameters, preload: float, ball_count: int, sign: int = 1) -> float:
    """External axial load [N], its magnitude, at which the left nut (sign +1) or the right one (-1) comes free.

    Its ball next to the spacer just touches; 2^(3/2) preload between rigid bodies. Oversize balls: the way of the ball
    that moves least is oversize/(sin(beta) cos(lambda)), to first order.
    """
    check_force("preload", preload)
    if preload == 0.0:
        return 0.0
    if screw.preload_kind == FOUR_POINT:
        balls = _four_point_chain(screw, float(preload), ball_count)
        gap = flank_travel(screw, ball_oversize(screw, preload, ball_count))

        def opening(load: float) -> float:
            # the last ball to come free is the one farthest from where the load enters
            return float(balls.ways(load)[0]) - gap

    else:
        chain = _chain(screw, ball_count)
        gap = _preload_gap(screw, float(preload), ball_count)

        def opening(load: float) -> float:
            if sign > 0:
                return float(chain.nut(load, -chain.K * load)[-1]) - gap
            return float(chain.nut(load)[-1]) + chain.spacer_stretch * load - gap

    low, high = preload, 4.0 * preload
    while opening(high) < 0.0:
        low, high = high, 2.0 * high
    return rising_root(opening, low, high)[0]


def largest_preload(screw: ScrewParameters, ball_count: int) -> float:
    """Preload [N] from which on no axial load frees oversize balls from two flanks; infinite for other kinds."""
    if screw.preload_kind != FOUR_POINT:
        return math.inf
    # the oversize goes with the power 2/3 of the preload
    return (largest_oversize(screw) / ball_oversize(screw, 1.0, ball_count)) ** 1.5


def load_nodes(load: Array, per_ln: float = NODES_PER_LN) -> tuple[Array, Array]:
    """Ball loads (k,) to evaluate at, and weights (n, k) from logarithms there to those at the loads (n,) of one nut.

    Chebyshev nodes in ln(load), LOAD_NODES and per_ln more by its unit; or the loads themselves where they are no more.
    """
    x = np.log(np.asarray(load, dtype=float))
    low, high = float(x.min()), float(x.max())
    if high - low < EQUAL_LOADS:
        return np.exp(np.array([low])), np.ones((x.size, 1))
    count = LOAD_NODES + int(per_ln * (high - low))
    if count >= x.size:
        return np.exp(x), np.eye(x.size)
    roots = np.cos(np.pi * (np.arange(count) + 0.5) / count)
    vandermonde = np.polynomial.chebyshev.chebvander
    at = 2.0 * (x - low) / (high - low) - 1.0
    weights = vandermonde(at, count - 1) @ np.linalg.inv(vandermonde(roots, count - 1))
    return np.exp(0.5 * (low + high) + 0.5 * (high - low) * roots), weights
