"""The linear system of a Newton step: GMRES, preconditioned by columns across, then one LU factor per line along.

GMRES as in krylov. Vectors are fields (n_y, n_x), zero on the outer edges, and the approach behind them. Compiled as a
whole: nothing between the products runs in Python.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf

from ...compiled import kernel
from ..half_space.grid import Array
from . import kernels
from .krylov import SUMS, orthogonalise, rotate, solution
from .transport import HeatTransport, film_change, follow, line_response


class LinearSystem(NamedTuple):
    """Jacobian of residual and load at one state; arrays (n_y, n_x) unless said.

    width (n_x,), kappa_h: of the grid; gap, g, dln_phi, dg, penalty: of the film, derivatives to the pressure of the
    node; by_t (n_y, n_x, 2, n_z+1): to temperatures; c_x, c_y, wedge: of the faces; squeeze: inverse step of pseudo
    time, 0 = steady; scale: size of the diagonal, load its last; weights: of the load; free: whether the approach
    follows from the load, else it is held;
    forward, modes, backward: deflection in single precision, same_line (n_x, n_x): that of a line by itself;
    heat, unit [Pa], unit_h [m]: temperatures that follow the pressure, warm: whether they do; across: whether columns
    precondition too.
    """

    width: Array
    kappa_h: float
    gap: Array
    g: Array
    dln_phi: Array
    dg: Array
    by_t: Array
    penalty: Array
    c_x: Array
    c_y: Array
    wedge: Array
    squeeze: float
    scale: Array
    load: float
    weights: Array
    free: bool
    forward: NDArray[np.float32]
    modes: NDArray[np.float32]
    backward: NDArray[np.float32]
    same_line: Array
    heat: HeatTransport
    unit: float
    unit_h: float
    warm: bool
    across: bool


class LineFactors(NamedTuple):
    """LU factors of the transposed matrices of all lines (lines, n, n), their exchanges (lines, n), and the answer to a
    rigid approach.

    In double precision: with factors in single precision Newton's method took up to twice the steps. approach
    (n_y, n_x), approach_load: its load.
    """

    lu: Array
    pivots: NDArray[np.int32]
    approach: Array
    approach_load: Array

    @classmethod
    def empty(cls, ny: int, nx: int) -> LineFactors:
        lines, n = ny - 1, nx - 2
        return cls(
            np.empty((lines, n, n)), np.empty((lines, n), dtype=np.int32), np.zeros((ny, nx)), np.zeros(1)
        )


def factor_lines(s: LinearSystem, factors: LineFactors, carried: bool) -> bool:
    """Factors of every line's Jacobian with the line's own deflection; returns whether all are regular.

    carried: with the heat that the oil of the line carries along, which costs as much as all the rest
    Source: LAPACK getrf of the transposed matrix, which is stored by columns as it wants it
    """
    line_jacobians(s, carried and s.warm, factors.lu, factors.approach)
    for matrix, pivots in zip(factors.lu, factors.pivots, strict=True):
        _, pivots[:], info = dgetrf(matrix.T, overwrite_a=1)
        if info != 0:
            return False
    answer_to_approach(s, factors)
    return bool(np.isfinite(factors.approach_load[0]))


@kernel(fastmath=SUMS)
def lu_solve(a, pivots, b):
    """Solve with the factors a (n, n) and pivots of the transposed matrix by LAPACK getrf, b (n,) in place."""
    n = a.shape[0]
    for k in range(n):
        row = a[k]
        total = b[k]
        for m in range(k):
            total -= row[m] * b[m]
        b[k] = total / row[k]
    for k in range(n - 2, -1, -1):
        row = a[k]
        total = b[k]
        for m in range(k + 1, n):
            total -= row[m] * b[m]
        b[k] = total
    for k in range(n - 1, -1, -1):
        at = pivots[k]
        if at != k:
            b[k], b[at] = b[at], b[k]


@kernel
def convolve(forward, modes, backward, field, out):
    """Deflection of a field (n_y, n_x) in the precision of the modes: see half_space.deflection."""
    rows = np.dot(forward, field)
    number = modes.shape[0]
    each = rows.shape[0] // number
    bent = np.empty_like(rows)
    for m in range(number):
        for r in range(each):
            bent[each * m + r] = np.dot(modes[m], rows[each * m + r])
    out[:, :] = np.dot(backward, bent)


@kernel
def line_jacobians(s, carried, out, approach):
    """Jacobians of all lines (lines, n, n), and their changes with a rigid approach (n_y, n_x)."""
    nx = s.gap.shape[1]
    n = nx - 2
    far = nx if carried else 0
    far_phi, far_g = np.empty((far, far)), np.empty((far, far))
    columns = np.empty((3 * s.heat.up_1.shape[2] + 5, nx))
    column = np.empty(n)
    for j in range(out.shape[0]):
        if carried:
            line_response(
                s.heat, j, s.g, s.dg, s.by_t, s.unit, s.unit_h, s.same_line, columns, far_phi, far_g
            )
        kernels.line_jacobian(j, s, far_phi, far_g, out[j], column)
        for i in range(n):
            approach[j, i + 1] = column[i]


@kernel
def answer_to_approach(s, factors):
    """Line solves of what a rigid approach changes, in place, and their load."""
    nx = s.gap.shape[1]
    line = np.empty(nx - 2)
    load = 0.0
    for j in range(factors.lu.shape[0]):
        for i in range(1, nx - 1):
            line[i - 1] = factors.approach[j, i]
        lu_solve(factors.lu[j], factors.pivots[j], line)
        for i in range(1, nx - 1):
            factors.approach[j, i] = line[i - 1]
            load += s.weights[j, i] * line[i - 1]
    factors.approach_load[0] = load


@kernel
def column_factors(s):
    """Factors (4, n_y, n_x) of the flow across through every column, neighbour columns and deflection held.

    Lower, inverse pivot and upper of the rows of the scaled residual; share of the flow across in the diagonal.
    """
    ny, nx = s.gap.shape
    out = np.zeros((4, ny, nx))
    lower, pivot, upper, share = out[0], out[1], out[2], out[3]
    for j in range(ny - 1):
        for i in range(1, nx - 1):
            unit = s.kappa_h / s.scale[j, i]
            above = (2.0 if j == 0 else 1.0) * unit
            own = above * (s.c_y[j, i, 1] * s.dln_phi[j, i] - s.c_y[j, i, 0]) - 1.0
            if j + 1 < ny - 1:
                upper[j, i] = above * (s.c_y[j, i, 2] * s.dln_phi[j + 1, i] + s.c_y[j, i, 0])
            if j > 0:
                own -= unit * (s.c_y[j - 1, i, 2] * s.dln_phi[j, i] + s.c_y[j - 1, i, 0])
                lower[j, i] = unit * (s.c_y[j - 1, i, 0] - s.c_y[j - 1, i, 1] * s.dln_phi[j - 1, i])
                lower[j, i] *= pivot[j - 1, i]
            share[j, i] = 1.0 + 1.0 / own
            if j > 0:
                own -= lower[j, i] * upper[j - 1, i]
            pivot[j, i] = 1.0 / own
    return out


@kernel
def solve_columns(s, columns, v, work, left, out):
    """Pressures out (n_y, n_x) by the flow across of a scaled residual v, by its share; what they leave of v.

    The deflection by them is left out. Far upstream of a circle, where lines lie closer than nodes, lines alone take
    dozens of iterations. Not with temperatures that follow, where nothing is gained.
    """
    ny, nx = s.gap.shape
    lower, pivot, upper, share = columns[0], columns[1], columns[2], columns[3]
    out[:, :] = 0.0
    for j in range(ny - 1):
        for i in range(1, nx - 1):
            out[j, i] = share[j, i] * v[j * nx + i]
            if j > 0:
                out[j, i] -= lower[j, i] * out[j - 1, i]
    for j in range(ny - 2, -1, -1):
        for i in range(1, nx - 1):
            out[j, i] = pivot[j, i] * (out[j, i] - upper[j, i] * out[j + 1, i])
    dh, d_phi, d_g, r = work[0], work[1], work[2], work[3]
    load = 0.0
    for j in range(ny):
        for i in range(nx):
            dh[j, i] = 0.0
            d_phi[j, i], d_g[j, i] = s.dln_phi[j, i] * out[j, i], s.dg[j, i] * out[j, i]
            load += s.weights[j, i] * out[j, i]
    kernels.jacobian_times(s, out, dh, d_phi, d_g, r)
    for j in range(ny):
        for i in range(nx):
            left[j * nx + i] = v[j * nx + i] - r[j, i] / s.scale[j, i]
    left[ny * nx] = v[ny * nx] - (load / s.load if s.free else 0.0)


@kernel
def precondition(s, factors, columns, v, work, left, out):
    """Column and line solves of a scaled residual v, bordered by the load balance; work (4, n_y, n_x), left: space."""
    ny, nx = s.gap.shape
    line = np.empty(nx - 2)
    out[:] = 0.0
    left[:] = v
    if s.across:
        solve_columns(s, columns, v, work, left, out[: ny * nx].reshape((ny, nx)))
    load = 0.0
    for j in range(factors.lu.shape[0]):
        for i in range(1, nx - 1):
            line[i - 1] = left[j * nx + i] * s.scale[j, i]
        lu_solve(factors.lu[j], factors.pivots[j], line)
        for i in range(1, nx - 1):
            out[j * nx + i] += line[i - 1]
            load += s.weights[j, i] * line[i - 1]
    rise = (load - left[ny * nx] * s.load) / factors.approach_load[0] if s.free else v[ny * nx]
    for j in range(ny):
        for i in range(nx):
            out[j * nx + i] -= rise * factors.approach[j, i]
    out[ny * nx] = rise


@kernel
def film_step(s, dp, dh, dt, d_phi, d_g):
    """Changes of ln phi and g with changes of the pressure, temperatures dt [K] included; fills all."""
    ny, nx = dp.shape
    if s.warm:
        follow(s.heat, s.g, s.dg, s.by_t, s.unit, s.unit_h, dp, dh, dt)
    change = np.zeros((2, nx))
    for j in range(ny):
        if s.warm:
            film_change(s.by_t, dt, j, change)
        for i in range(nx):
            d_phi[j, i] = s.dln_phi[j, i] * dp[j, i] + change[0, i]
            d_g[j, i] = s.dg[j, i] * dp[j, i] + change[1, i]


@kernel
def times(s, v, dt, work, out):
    """Scaled Jacobian times a change of pressures and approach; dt: temperatures, work (4, n_y, n_x): work space."""
    ny, nx = s.gap.shape
    dp = v[: ny * nx].reshape((ny, nx))
    dh, d_phi, d_g, r = work[0], work[1], work[2], work[3]
    convolve(s.forward, s.modes, s.backward, dp.astype(np.float32), dh)
    load = 0.0
    for j in range(ny):
        for i in range(nx):
            dh[j, i] += v[ny * nx]
            load += s.weights[j, i] * dp[j, i]
    film_step(s, dp, dh, dt, d_phi, d_g)
    kernels.jacobian_times(s, dp, dh, d_phi, d_g, r)
    for j in range(ny):
        for i in range(nx):
            out[j * nx + i] = r[j, i] / s.scale[j, i]
    out[ny * nx] = load / s.load if s.free else v[ny * nx]


@kernel
def gmres(s, factors, rhs, tolerance, most, out):
    """Solve for a scaled right-hand side (n_y n_x + 1,); returns the iterations used and the relative residual left."""
    n = rhs.size
    ny, nx = s.gap.shape
    basis, hessenberg = np.empty((most + 1, n)), np.zeros((most + 1, most))
    cs, sn, e = np.zeros(most), np.zeros(most), np.zeros(most + 1)
    z, w, left_over = np.empty(n), np.empty(n), np.empty(n)
    columns = column_factors(s) if s.across else np.zeros((4, 1, 1))
    dt = np.zeros((ny, nx, s.heat.up_1.shape[2] + 2 if s.warm else 0))
    work = np.zeros((4, ny, nx))
    beta = np.sqrt(np.sum(rhs * rhs))
    out[:] = 0.0
    if beta == 0.0:
        return 0, 0.0
    basis[0] = rhs / beta
    e[0] = beta
    used, left = 0, beta
    for k in range(most):
        precondition(s, factors, columns, basis[k], work, left_over, z)
        times(s, z, dt, work, w)
        orthogonalise(basis, k, w, hessenberg)
        left = rotate(hessenberg, cs, sn, e, k)
        used = k + 1
        if not left > tolerance * beta:
            break
    solution(basis, hessenberg, e, used, w)
    precondition(s, factors, columns, w, work, left_over, out)
    return used, left / beta
