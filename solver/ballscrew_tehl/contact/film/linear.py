"""The linear system of a Newton step: GMRES, preconditioned by columns across, then one LU factor per line along.

Vectors are fields (n_y, n_x), zero on the outer edges, and the approach behind them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs

from ...compiled import kernel
from ..half_space.deflection import LineConvolution
from ..half_space.grid import Array
from . import kernels
from .transport import HeatTransport, follow, line_response


class LinearSystem(NamedTuple):
    """Jacobian of residual and load at one state; arrays (n_y, n_x) unless said.

    width (n_x,), kappa_h: of the grid; gap, g, dln_phi, dg, penalty: of the film, derivatives to the pressure of the
    node; by_t (n_y, n_x, 2, n_z+1): to temperatures; c_x, c_y, wedge: of the faces; squeeze: inverse step of pseudo
    time, 0 = steady; scale: size of the diagonal, load its last; weights: of the load; free: whether the approach
    follows from the load, else it is held; same_line (n_x, n_x): deflection of a line by itself; heat, unit [Pa],
    unit_h [m]: temperatures that follow the pressure, warm: whether they do; across: whether columns precondition too.
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
    approach_load: float


def factor_lines(s: LinearSystem, carried: bool) -> LineFactors:
    """Factors of every line's Jacobian with the line's own deflection.

    carried: with the heat that the oil of the line carries along, which costs as much as all the rest
    Raises       LinAlgError: singular, or not finite
    Source       LAPACK getrf of the transposed matrix, which is stored by columns as it wants it
    """
    ny, nx = s.gap.shape
    lu, pivots = np.empty((ny - 1, nx - 2, nx - 2)), np.empty((ny - 1, nx - 2), dtype=np.int32)
    approach = np.zeros((ny, nx))
    line_jacobians(s, carried and s.warm, lu, approach)
    for matrix, exchanges, line in zip(lu, pivots, approach[:-1], strict=True):
        _, exchanges[:], info = dgetrf(matrix.T, overwrite_a=1)
        if info != 0:
            raise np.linalg.LinAlgError("a line of the contact has a singular Jacobian")
        line[1:-1], _ = dgetrs(matrix.T, exchanges, line[1:-1], trans=1)
    load = float(np.sum(s.weights * approach))
    if not np.isfinite(load):
        raise np.linalg.LinAlgError("a line of the contact has a singular Jacobian")
    return LineFactors(lu, pivots, approach, load)


@kernel(fastmath={"reassoc", "contract"})  # sums in any order; NaN and infinity stay what they are
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
def solve_columns(s, columns, v, left, out):
    """Pressures out (n_y, n_x) by the flow across of a scaled residual v, by its share; left: what they leave of v.

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
    r = np.empty((ny, nx))
    kernels.jacobian_times(s, out, np.zeros((ny, nx)), s.dln_phi * out, s.dg * out, r)
    for j in range(ny):
        for i in range(nx):
            left[j * nx + i] = v[j * nx + i] - r[j, i] / s.scale[j, i]
    left[ny * nx] = v[ny * nx] - (np.sum(s.weights * out) / s.load if s.free else 0.0)


@kernel
def precondition(s, factors, columns, v):
    """Column and line solves of a scaled residual v (n_y n_x + 1,), bordered by the load balance."""
    ny, nx = s.gap.shape
    line, out, left = np.empty(nx - 2), np.zeros(v.size), v.copy()
    if s.across:
        solve_columns(s, columns, v, left, out[: ny * nx].reshape((ny, nx)))
    load = 0.0
    for j in range(factors.lu.shape[0]):
        for i in range(1, nx - 1):
            line[i - 1] = left[j * nx + i] * s.scale[j, i]
        lu_solve(factors.lu[j], factors.pivots[j], line)
        for i in range(1, nx - 1):
            out[j * nx + i] += line[i - 1]
            load += s.weights[j, i] * line[i - 1]
    rise = (load - left[ny * nx] * s.load) / factors.approach_load if s.free else v[ny * nx]
    for j in range(ny):
        for i in range(nx):
            out[j * nx + i] -= rise * factors.approach[j, i]
    out[ny * nx] = rise
    return out


def times(s: LinearSystem, deflection: LineConvolution, v: Array) -> Array:
    """Scaled Jacobian times a change v (n_y n_x + 1,) of pressures and approach; deflection in single precision."""
    d_p, out = v[:-1].reshape(s.gap.shape), np.empty_like(s.gap)
    d_h = deflection.rough(d_p) + v[-1]
    d_phi, d_g = s.dln_phi * d_p, s.dg * d_p
    if s.warm:
        d_t = np.empty((*s.gap.shape, s.by_t.shape[-1]))
        follow(s.heat, s.g, s.dg, s.by_t, s.unit, s.unit_h, d_p, d_h, d_t)
        by_heat = np.einsum("jimk,jik->mji", s.by_t, d_t)
        d_phi, d_g = d_phi + by_heat[0], d_g + by_heat[1]
    kernels.jacobian_times(s, d_p, d_h, d_phi, d_g, out)
    return np.append(out / s.scale, np.sum(s.weights * d_p) / s.load if s.free else v[-1])


def gmres(
    s: LinearSystem,
    deflection: LineConvolution,
    factors: LineFactors,
    rhs: Array,
    tolerance: float,
    most: int,
) -> tuple[Array, int, float]:
    """Solution for a scaled right-hand side (n_y n_x + 1,), the iterations used and the relative residual left.

    GMRES without restart, preconditioned from the right; every vector is made orthogonal twice.
    Source       Saad 2003, algorithm 9.5
    """
    columns = column_factors(s) if s.across else np.zeros((4, 1, 1))
    basis, hessenberg = np.empty((most + 1, rhs.size)), np.zeros((most + 1, most))
    size = float(np.linalg.norm(rhs))
    if size == 0.0:
        return np.zeros_like(rhs), 0, 0.0
    basis[0] = rhs / size
    for k in range(most):
        w, known = times(s, deflection, precondition(s, factors, columns, basis[k])), basis[: k + 1]
        for _ in range(2):
            overlap = known @ w
            w -= overlap @ known
            hessenberg[: k + 1, k] += overlap
        hessenberg[k + 1, k] = np.linalg.norm(w)
        basis[k + 1] = w / hessenberg[k + 1, k]
        rotation, triangle = np.linalg.qr(hessenberg[: k + 2, : k + 1], mode="complete")
        left = float(abs(rotation[0, -1]))
        if not left > tolerance:
            break
    weights = np.linalg.solve(triangle[:-1], size * rotation[0, :-1])
    return precondition(s, factors, columns, weights @ known), k + 1, left
