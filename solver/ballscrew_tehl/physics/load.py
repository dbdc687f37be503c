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
nut; an axial load stretches both, and the force of a set comes from the chain of all balls (`ball_chain`). The loads
that `nut_loads` gives for it are equal ones: exact under preload, under an axial load the heaviest ball of the loaded
set carries up to 6 % more (GD4008-3, 1 to 6 kN, up to the separation load; `double_nut_loads` has it).
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..parameters.file import FOUR_POINT, ScrewParameters
from .ball_chain import BallChain, FourPointChain, ball_oversize
from .ball_law import Array, check_force, flank_travel, largest_oversize, preload_ball_load, rising_root

#: Chebyshev nodes over the loads of one nut: three leave an error of the film below 1e-6; more per unit of ln(load);
#: range of ln(load) below which all loads are one
LOAD_NODES, NODES_PER_LN, EQUAL_LOADS = 3, 6.0, 1e-9


class DoubleNutLoads(NamedTuple):
    """Loads of all balls from left to right and axial forces [N].

    With oversize balls: of the same balls on the flanks that an axial load > 0 relieves and loads; no spacer.
    """

    Q_a: Array  # (n,) of the left nut, spacer at its right end
    Q_b: Array  # (n,) of the right nut, spacer at its left end
    force_a: float  # carried by the spacer
    force_b: float  # force_a + axial load


_chain, _four_point_chain = lru_cache(maxsize=64)(BallChain), lru_cache(maxsize=64)(FourPointChain)


@lru_cache(maxsize=4096)
def _preload_gap(screw: ScrewParameters, preload: float, ball_count: int) -> float:
    """Excess length of the spacer over the gap between the nuts [m]."""
    chain = _chain(screw, ball_count)
    return 2.0 * float(chain.nut(preload)[-1]) + chain.spacer_stretch * preload


def nut_loads(screw: ScrewParameters, force: float, ball_count: int) -> Array:
    """Normal loads (n,) [N] of the balls of one nut under its axial force [N], >= 0, that next to the spacer last.

    Each is at its own contact angle. Oversize balls: one set of flanks, equal loads.
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
    """Ball loads of two nuts, each with ball_count balls, pushed apart by a spacer, under an external axial load [N].

    It acts on the outer flange of the right nut, screw held on the right; > 0 (to the right) relieves the left nut A,
    < 0 the right nut B. d_A + d_B + L_sp [S_mid/(E A_screw) - N_sp/(E A_sp)] at the spacer is that of the preload.
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
