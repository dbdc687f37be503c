"""The linear system of a Newton step: residual and Jacobian of the Reynolds equation, and GMRES for the step.

Preconditioned by columns across, then one LU factor per line along, with the line's own deflection in it. Vectors are
fields (n_y, n_x), zero on the outer edges, and the approach behind them.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded
from scipy.linalg.lapack import dgetrf, dgetrs

from ...compiled import kernel
from ..half_space.grid import TINY, Array
from .flow import FilmFlow
from .fluxes import face_fluxes, lifted_gap, line_fluxes, net_flow, net_flow_change, smaller
from .geometry import TARGET_LOAD, ContactGeometry
from .transport import HeatTransport, follow, line_response

#: deepest pressure of an iterate, as a share of its largest: bounds the negative load of cavitated nodes; the penalty
#: that holds them is stiff in inverse proportion
LEAST_PRESSURE = 1e-6
#: factor of the penalty over the wedge flux and the conductance of a cavitated node
PENALTY = 10.0
#: smallest share of its fluidity that a node keeps in one Newton step
LEAST_FLUIDITY = 0.05


class Film:
    """Film coefficients over the pressure; an oil of one temperature unless overridden.

    heat, unit [Pa], unit_h [m], by_t (n_y, n_x, 2, n_z+1) of a film whose temperatures follow the pressure (warm):
    factors, units of pressure and gap, and derivatives of the last coefficients to temperatures.
    """

    #: whether columns across precondition the line solves
    across = False
    warm = False
    heat: HeatTransport
    unit: float
    unit_h: float
    by_t: Array = np.zeros((0, 0, 2, 0))

    def __init__(self, coefficients: Callable[[Array], tuple[Array, ...]]) -> None:
        #: nodal coefficients of P >= 0: ln phi, d ln phi/dP, g, dg/dP (n_y, n_x)
        self.coefficients = coefficients

    def follow(self, linear: "Linearisation", d_p: Array, d_h: Array) -> None:
        """Take over changes of pressure [p_max] and gap [b^2/R_x] into what depends on them."""


class Linearisation:
    """Residual of the Reynolds equation and its Jacobian at one state; arrays (n_y, n_x) unless said.

    floor: gap below which the flow is that of a lifted one; squeeze: inverse step of pseudo time [u_e/b], 0 = steady;
    free: whether the approach follows from the load, else it is held. dln_phi, dg: derivatives of ln phi and g to the
    pressure of the node, by_t (n_y, n_x, 2, n_z+1): to temperatures; scale: size of the diagonal, residuals are divided
    by it; flow_share: share of the flow in it.
    """

    def __init__(
        self,
        geometry: ContactGeometry,
        p: Array,
        gap: Array,
        film: Film,
        floor: float,
        squeeze: float = 0.0,
        free: bool = True,
    ) -> None:
        grid, mesh = geometry.grid, geometry.mesh
        self.geometry, self.film, self.p, self.gap, self.floor = geometry, film, p, gap, floor
        self.squeeze, self.free = squeeze, free
        self.ln_phi, self.dln_phi, self.g, self.dg = film.coefficients(np.maximum(p, 0.0))
        self.by_t = film.by_t
        self.faces = face_fluxes(mesh, p, gap, self.ln_phi, self.g, floor)
        c_x = self.faces.c_x
        # measured by the local flow conductance, which spans many decades from thick films to the contact
        conductance, slope = np.zeros_like(p), self.dln_phi[:, 1:-1]
        right, left = c_x[1, :, 1:] * slope - c_x[0, :, 1:], c_x[2, :, :-1] * slope + c_x[0, :, :-1]
        conductance[:, 1:-1] = (np.abs(right) + np.abs(left)) / grid.width_x[1:-1]
        # stiff enough that the wedge holds a cavitated node well above the deepest pressure allowed
        stiffness = PENALTY * (1.0 + grid.x[-1]) / (LEAST_PRESSURE * float(p.max()))
        self.penalty = np.where(p < 0.0, stiffness + PENALTY * conductance, 0.0)
        self.residual = np.zeros_like(p)
        flow = net_flow(mesh, self.faces.flow_x, self.faces.flow_y)
        self.residual[grid.inner] = (flow - self.penalty * p)[grid.inner]
        own = np.diagonal(geometry.deflection.same_line)
        elastic = np.abs(self.g * own * (1.0 / grid.width_x + squeeze))
        self.flow_share = conductance / (conductance + elastic + TINY)
        self.scale = conductance + elastic + self.penalty
        self.scale[self.scale == 0.0] = 1.0

    def update(self, d_p: Array) -> Array:
        """Change of pressure for a linear step d_p.

        Where pressure flow dominates, the equation is linear in the fluidity rather than in the pressure: the step is
        taken in the fluidity there, with whose logarithm the pressure rises in few steps.
        """
        thickening = np.maximum(-self.dln_phi, TINY)
        in_fluidity = -np.log1p(np.maximum(-thickening * d_p, LEAST_FLUIDITY - 1.0)) / thickening
        return d_p + self.flow_share * (in_fluidity - d_p)

    def right_hand_side(self, load_error: float) -> Array:
        """Scaled residual and load error with negative sign."""
        return -np.append((self.residual / self.scale).ravel(), load_error / TARGET_LOAD)

    def derivative(self, d_p: Array, d_h: Array, d_phi: Array, d_g: Array) -> Array:
        """Change of the residual with changes of pressure, gap, ln phi and g at the nodes."""
        mesh, inner = self.geometry.mesh, self.geometry.grid.inner
        out, carried = net_flow_change(mesh, self.faces, self.g, self.gap, d_p, d_h, d_phi, d_g)
        out[inner] -= (self.penalty * d_p + self.squeeze * carried)[inner]
        return np.asarray(out)

    def times(self, v: Array) -> Array:
        """Scaled Jacobian times a change v (n_y n_x + 1,) of pressures and approach; deflection in single precision."""
        d_p, film = v[:-1].reshape(self.gap.shape), self.film
        d_h = self.geometry.deflection.rough(d_p) + v[-1]
        d_phi, d_g = self.dln_phi * d_p, self.dg * d_p
        if film.warm:
            d_t = np.empty((*self.gap.shape, self.by_t.shape[-1]))
            follow(film.heat, self.g, self.dg, self.by_t, film.unit, film.unit_h, d_p, d_h, d_t)
            by_heat = np.einsum("jimk,jik->mji", self.by_t, d_t)
            d_phi, d_g = d_phi + by_heat[0], d_g + by_heat[1]
        load = np.sum(self.geometry.weights * d_p) / TARGET_LOAD if self.free else v[-1]
        return np.append(self.derivative(d_p, d_h, d_phi, d_g) / self.scale, load)

    def pressure_flow(self, flow: FilmFlow, heat: HeatTransport) -> None:
        """Gradients and dissipation of the pressure flow at the nodes, from the fluxes of their faces.

        Fills of flow gradient_x, gradient_y (n_y, n_x), per unit of x and y: the smaller of the gradient that drives
        the mean flux of the faces and that of the pressures of the neighbours: beside a pressure spike, where the
        viscosity changes by decades from node to node, either may be far too large. power (n_y, n_x): flux times
        pressure drop, half of it to either node of a face, per area, so that its sum is that of the faces between nodes
        under pressure. While iterating, the flux along x is bounded by that of continuity, which temperatures do not
        change. Zero in a cavitated node.
        Fills of heat pull (n_y, n_x, 2), push (n_y, n_x, 4): changes of power with the pressure drops before and
        behind, and with the wedge fluxes at the nodes i-2 to i+1, which continuity asks the pressure to carry: on faces
        where pressure flow dominates over the deflection, by their share.
        """
        faces, mesh, inner = self.faces, self.geometry.mesh, self.geometry.grid.inner
        p, dx = np.maximum(self.p, 0.0), np.diff(mesh.x)
        wet, half = p[inner] > 0.0, 0.5 / mesh.width[1:-1]
        steady = line_fluxes(mesh.width, mesh.kappa_h, p, faces.flow_x, faces.flow_y)
        drop = np.diff(p[:-1], axis=1)
        flux = faces.c_x[0, :-1] * drop
        flux = smaller(flux, steady + flux - faces.flow_x[:-1])
        conductance = (lifted_gap(self.gap, self.floor)[0] ** 3 * np.exp(self.ln_phi))[inner]
        central = (drop[:, 1:] / dx[1:] * dx[:-1] + drop[:, :-1] / dx[:-1] * dx[1:]) / (dx[:-1] + dx[1:])
        gradient_x = smaller(0.5 * (flux[:, :-1] + flux[:, 1:]) / conductance, central)
        power = half * (flux[:, :-1] * drop[:, :-1] + flux[:, 1:] * drop[:, 1:])
        # how much of a change of the wedge flux the pressure carries through the faces before and behind a node
        through = faces.c_x[0] + np.abs(faces.c_x[1] * self.dln_phi[:, :-1])
        through = (through + np.abs(faces.c_x[2] * self.dln_phi[:, 1:]))[:-1]
        elastic = (np.abs(self.g) * np.diagonal(self.geometry.deflection.same_line))[inner]
        left, right = (
            part / (part + elastic) * half * drop_ for part, drop_ in
            ((through[:, :-1], drop[:, :-1]), (through[:, 1:], drop[:, 1:]))
        )  # fmt: skip
        before, behind = faces.wedge[:, :-1], faces.wedge[:, 1:]
        pull = np.stack((half * flux[:, :-1], half * flux[:, 1:]), axis=2)
        push = np.stack(
            (
                left * before[1],
                left * before[0] + right * behind[1],
                left * before[2] + right * behind[0],
                right * behind[2],
            ),
            axis=2,
        )
        # pressure is even over the line of symmetry
        rise, up = np.diff(p, axis=0)[:, 1:-1], (faces.c_y[0] * np.diff(p, axis=0))[:, 1:-1]
        fall, down = (np.concatenate((-values[:1], values[:-1])) for values in (rise, up))
        power += 0.5 * mesh.kappa_h * (up * rise + down * fall)
        h_y = self.geometry.grid.h_y
        gradient_y = smaller(
            0.5 * (up + down) / (conductance * mesh.kappa_h * h_y), 0.5 * (rise + fall) / h_y
        )
        for field, values in (
            (flow.gradient_x, gradient_x), (flow.gradient_y, gradient_y), (flow.power, power),
            (heat.pull, pull), (heat.push, push),
        ):  # fmt: skip
            field[:] = 0.0
            field[inner] = np.where(wet if values.ndim == 2 else wet[..., None], values, 0.0)


@kernel
def add_rows(weights, nodes, source, matrix):
    """Add to the rows i of a matrix the rows nodes[:, i] of another times weights[:, i]."""
    for i in range(matrix.shape[0]):
        for m in range(nodes.shape[0]):
            for k in range(matrix.shape[1]):
                matrix[i, k] += weights[m, i] * source[nodes[m, i], k]


def line_jacobians(s: Linearisation, carried: bool) -> tuple[Array, Array]:
    """Jacobians of all lines to their own pressures (lines, n, n), n = n_x-2, and to a rigid approach (lines, n).

    With the deflection of a line by itself; carried: and with the heat that its oil carries along.
    """
    (ny, nx), geometry, film = s.gap.shape, s.geometry, s.film
    before, behind, wedge = s.faces.c_x[:, :-1, :-1], s.faces.c_x[:, :-1, 1:], s.faces.wedge
    inv, same_line = 1.0 / geometry.grid.width_x[1:-1], geometry.deflection.same_line
    up = geometry.kappa_h * s.faces.c_y[:, :, 1:-1]
    down = np.concatenate((0.0 * up[:, :1], up[:, :-1]), axis=1)
    up[:, 0] *= 2.0
    # derivatives by nodes i-2, i-1, i, i+1 (gap, g) or i-1, i, i+1; the node before the first weighs nothing
    nodes = np.maximum(np.arange(1, nx - 1) + np.arange(-2, 2)[:, None], 0)
    by_p = np.array([before[0] * inv, -(before[0] + behind[0]) * inv - up[0] - down[0], behind[0] * inv])
    by_p[1] -= s.penalty[:-1, 1:-1]
    by_phi = np.array([-before[1] * inv, (behind[1] - before[2]) * inv + up[1] - down[2], behind[2] * inv])
    by_h = np.array([0.0 * before[3], -before[3] * inv, (behind[3] - before[3]) * inv, behind[3] * inv])
    by_h[2] += up[3] - down[4]
    by_g = (
        np.array([wedge[1, :-1], wedge[0, :-1] - wedge[1, 1:], wedge[2, :-1] - wedge[0, 1:], -wedge[2, 1:]])
        * inv
    )
    by_g[2] -= s.squeeze
    g, gap, dg = (np.moveaxis(field[:-1, nodes], 1, 0) for field in (s.g, s.gap, s.dg))
    by_h += by_g[:, None] * g
    by_g = by_g[:, None] * gap
    bands = by_g * dg
    bands[1:] += by_p + by_phi * np.moveaxis(s.dln_phi[:-1, nodes[1:]], 1, 0)
    rows, out = np.arange(nx - 2), np.empty((ny - 1, nx - 2, nx - 2))
    far_phi, far_g = np.empty((2, nx, nx))
    for j in range(ny - 1):
        matrix = np.zeros((nx - 2, nx))
        add_rows(by_h[:, j], nodes, same_line, matrix)
        if carried:
            line_response(film.heat, j, s.g, s.dg, s.by_t, film.unit, film.unit_h, same_line, far_phi, far_g)
            add_rows(by_phi[:, j], nodes[1:], far_phi, matrix)
            add_rows(by_g[:, j], nodes, far_g, matrix)
        for band, at in zip(bands[:, j], nodes, strict=True):
            matrix[rows, at] += band
        out[j] = matrix[:, 1:-1]
    return out, up[4] - down[3] + by_h.sum(axis=0)


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


def factor_lines(s: Linearisation, carried: bool) -> LineFactors:
    """Factors of the Jacobians of all lines.

    carried: with the heat that the oil of a line carries along, which costs as much as all the rest
    Raises       LinAlgError: singular, or not finite
    Source       LAPACK getrf of the transposed matrix, which is stored by columns as it wants it
    """
    lu, raised = line_jacobians(s, carried and s.film.warm)
    pivots, approach = np.empty(raised.shape, dtype=np.int32), np.zeros_like(s.gap)
    for j, matrix in enumerate(lu):
        _, pivots[j], info = dgetrf(matrix.T, overwrite_a=1)
        if info != 0:
            raise np.linalg.LinAlgError("a line of the contact has a singular Jacobian")
        approach[j, 1:-1], _ = dgetrs(matrix.T, pivots[j], raised[j], trans=1)
    load = float(np.sum(s.geometry.weights * approach))
    if not np.isfinite(load):
        raise np.linalg.LinAlgError("the Jacobian of a line of the contact is not finite")
    return LineFactors(lu, pivots, approach, load)


@kernel(fastmath={"reassoc", "contract"})  # sums in any order; NaN and infinity stay what they are
def solve_lines(lu, pivots, rows):
    """Solve for the rows (lines, n) in place, with the factors and exchanges of the transposed matrices by getrf."""
    n = rows.shape[1]
    for j in range(rows.shape[0]):
        a, b = lu[j], rows[j]
        for k in range(n):
            total = b[k]
            for m in range(k):
                total -= a[k, m] * b[m]
            b[k] = total / a[k, k]
        for k in range(n - 2, -1, -1):
            total = b[k]
            for m in range(k + 1, n):
                total -= a[k, m] * b[m]
            b[k] = total
        for k in range(n - 1, -1, -1):
            at = pivots[j, k]
            if at != k:
                b[k], b[at] = b[at], b[k]


class ColumnSolve:
    """Pressures by the flow across through every column of a scaled residual, neighbour columns and deflection held.

    By the share of the flow across in the diagonal. Far upstream of a circle, where lines lie closer than nodes, lines
    alone take dozens of iterations. Not with temperatures that follow, where nothing is gained.
    """

    def __init__(self, s: Linearisation) -> None:
        c_y, inner = s.faces.c_y, s.geometry.grid.inner
        unit, slope = (s.geometry.kappa_h / s.scale)[inner], s.dln_phi[:, 1:-1]
        above = unit.copy()
        above[0] *= 2.0
        self.diagonals = np.zeros((3, *unit.shape))
        upper, own, lower = self.diagonals
        own[:] = above * (c_y[1, :, 1:-1] * slope[:-1] - c_y[0, :, 1:-1]) - 1.0
        own[1:] -= unit[1:] * (c_y[2, :-1, 1:-1] * slope[1:-1] + c_y[0, :-1, 1:-1])
        # as solve_banded takes them: upper at the next line, lower at the line before
        upper[1:] = above[:-1] * (c_y[2, :-1, 1:-1] * slope[1:-1] + c_y[0, :-1, 1:-1])
        lower[:-1] = unit[1:] * (c_y[0, :-1, 1:-1] - c_y[1, :-1, 1:-1] * slope[:-2])
        self.share = 1.0 + 1.0 / own

    def __call__(self, residual: Array) -> Array:
        """Pressures (n_y-1, n_x-2) for a residual on the inner nodes."""
        ab = self.diagonals.transpose(0, 2, 1).reshape(3, -1)
        columns = solve_banded((1, 1), ab, (self.share * residual).T.ravel(), check_finite=False)
        return np.asarray(columns.reshape(residual.shape[::-1]).T)


def precondition(s: Linearisation, factors: LineFactors, columns: ColumnSolve | None, v: Array) -> Array:
    """Column and line solves of a scaled residual v (n_y n_x + 1,), bordered by the load balance."""
    inner, weights = s.geometry.grid.inner, s.geometry.weights
    residual, missing, d_p = v[:-1].reshape(s.gap.shape), v[-1] * TARGET_LOAD, np.zeros_like(s.gap)
    if columns is not None:
        d_p[inner] = columns(residual[inner])
        residual = residual - s.derivative(d_p, np.zeros_like(d_p), s.dln_phi * d_p, s.dg * d_p) / s.scale
        missing -= np.sum(weights * d_p)
    lines = residual[inner] * s.scale[inner]
    solve_lines(factors.lu, factors.pivots, lines)
    d_p[inner] += lines
    rise = (np.sum(weights[inner] * lines) - missing) / factors.approach_load if s.free else v[-1]
    return np.append(d_p - rise * factors.approach, rise)


def gmres(
    s: Linearisation, factors: LineFactors, rhs: Array, tolerance: float, most: int
) -> tuple[Array, int, float]:
    """Solution for a scaled right-hand side (n_y n_x + 1,), the iterations used and the relative residual left.

    GMRES without restart, preconditioned from the right; every vector is made orthogonal twice.
    Source       Saad 2003, algorithm 9.5
    """
    columns = ColumnSolve(s) if s.film.across else None
    basis, triangle = np.empty((most + 1, rhs.size)), np.zeros((most, most))
    turns: list[tuple[float, float]] = []
    size = float(np.linalg.norm(rhs))
    if size == 0.0:
        return np.zeros_like(rhs), 0, 0.0
    basis[0], target = rhs / size, [size]
    for k in range(most):
        w, known = s.times(precondition(s, factors, columns, basis[k])), basis[: k + 1]
        column = np.zeros(k + 1)
        for _ in range(2):
            overlap = known @ w
            w -= overlap @ known
            column += overlap
        length = float(np.linalg.norm(w))
        basis[k + 1] = w / length
        # Givens rotations of the new column of the Hessenberg matrix
        entries = column.tolist()
        for i, (cos, sin) in enumerate(turns):
            entries[i : i + 2] = (
                cos * entries[i] + sin * entries[i + 1],
                cos * entries[i + 1] - sin * entries[i],
            )
        diagonal = max(math.hypot(entries[k], length), TINY)
        turns.append((entries[k] / diagonal, length / diagonal))
        entries[k] = diagonal
        triangle[: k + 1, k] = entries
        target[k:] = turns[k][0] * target[k], -turns[k][1] * target[k]
        if not abs(target[-1]) > tolerance * size:
            break
    weights = np.linalg.solve(triangle[: k + 1, : k + 1], target[:-1])
    return precondition(s, factors, columns, weights @ known), k + 1, abs(target[-1]) / size
