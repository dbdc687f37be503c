"""The linear system of a Newton step: residual and Jacobian of the Reynolds equation, and GMRES for the step.

Preconditioned by columns across, then one LU factor per line along, with the line's own deflection in it. Vectors are
fields (n_y, n_x), zero on the outer edges, and the approach behind them.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs

from ...compiled import kernel
from ..grid import TINY, Array
from ..half_space import convolve
from .flow import SWEEP_LIMIT, FilmFlow
from .fluxes import Faces, Mesh, face_fluxes, lifted_gap, line_fluxes, net_flow, smaller
from .geometry import TARGET_LOAD, ContactGeometry, ReynoldsState
from .transport import HeatTransport, follow, line_response

#: deepest pressure of an iterate, as a share of its largest: bounds the negative load of cavitated nodes; the penalty
#: that holds them is stiff in inverse proportion
LEAST_PRESSURE = 1e-6
PENALTY = 10.0  # factor of the penalty over the wedge flux and the conductance of a cavitated node
LEAST_FLUIDITY = 0.05  # smallest share of its fluidity that a node keeps in one Newton step


class Film:
    """The oil at temperatures (n_y, n_x, n_z+1) [K], which follow pressure and gap where heat is given (warm).

    law: flow.film_coefficients of pressure (n_y, n_x) and temperatures; unit [Pa], unit_h [m]: of pressure and gap;
    by_t (n_y, n_x, 2, n_z+1): derivatives to temperatures of the last coefficients; across: whether columns across
    precondition the line solves.
    """

    def __init__(
        self,
        law: Callable[[Array, Array], tuple[Array, ...]],
        unit: float,
        unit_h: float,
        temperature: Array,
        heat: HeatTransport | None = None,
        across: bool = False,
    ) -> None:
        self.law, self.unit, self.unit_h, self.across = law, unit, unit_h, across
        self.temperature, self.warm = temperature, heat is not None
        self.heat = heat or HeatTransport.empty(0, np.zeros(0), 1)

    def coefficients(self, p: Array) -> tuple[Array, ...]:
        """Ln phi, d ln phi/dP, g, dg/dP (n_y, n_x) at a pressure >= 0 [p_max]."""
        *out, self.by_t = self.law(p, self.temperature)
        return tuple(out)

    def follow(self, linear: "LinearSystem", d_p: Array, d_h: Array) -> None:
        """Temperatures after a change of pressure [p_max] and gap [b^2/R_x]."""
        if self.warm:
            change = np.empty_like(self.temperature)
            follow(self.heat, linear.g, linear.dg, linear.by_t, self.unit, self.unit_h, d_p, d_h, change)
            self.temperature += np.clip(change, -SWEEP_LIMIT, SWEEP_LIMIT)


class LinearSystem(NamedTuple):
    """Jacobian of residual and load at one state, for compiled loops: numbers of Linearisation, Film and geometry.

    weights (n_y, n_x): of the load; forward, modes, backward: deflection in single precision, same_line (n_x, n_x):
    that of a line by itself.
    """

    mesh: Mesh
    faces: Faces
    gap: Array
    g: Array
    dln_phi: Array
    dg: Array
    by_t: Array
    penalty: Array
    squeeze: float
    scale: Array
    free: bool
    weights: Array
    forward: NDArray[np.float32]
    modes: NDArray[np.float32]
    backward: NDArray[np.float32]
    same_line: Array
    heat: HeatTransport
    unit: float
    unit_h: float
    warm: bool
    across: bool


class Linearisation:
    """Residual of the Reynolds equation [u_e b^2/R_x] and its Jacobian at one state; arrays (n_y, n_x) unless said.

    floor: gap below which the flow is that of a lifted one; squeeze: inverse step of pseudo time [u_e/b], 0 = steady;
    free: whether the approach follows from the load, else it is held. dln_phi, dg: derivatives of ln phi and g to the
    pressure of the node, by_t (n_y, n_x, 2, n_z+1): to temperatures; scale: size of the diagonal, residuals are divided
    by it; flow_share: share of the flow in it.
    """

    def __init__(
        self,
        geometry: ContactGeometry,
        state: ReynoldsState,
        film: Film,
        floor: float,
        squeeze: float = 0.0,
        free: bool = True,
    ) -> None:
        grid, mesh, p, gap = geometry.grid, geometry.mesh, state.p, state.gap
        self.geometry, self.film, self.p, self.gap, self.floor = geometry, film, p, gap, floor
        self.ln_phi, self.dln_phi, self.g, dg = film.coefficients(np.maximum(p, 0.0))
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
        self.system = LinearSystem(
            mesh, self.faces, gap, self.g, self.dln_phi, dg, film.by_t, self.penalty, squeeze, self.scale, free,
            geometry.weights, *geometry.deflection.single, geometry.deflection.same_line,
            film.heat, film.unit, film.unit_h, film.warm, film.across,
        )  # fmt: skip

    def update(self, d_p: Array) -> Array:
        """Change of pressure for a linear step d_p: taken in the fluidity where pressure flow dominates."""
        # the equation is linear in the fluidity there, with whose logarithm the pressure rises in few steps
        thickening = np.maximum(-self.dln_phi, TINY)
        in_fluidity = -np.log1p(np.maximum(-thickening * d_p, LEAST_FLUIDITY - 1.0)) / thickening
        return d_p + self.flow_share * (in_fluidity - d_p)

    def pressure_flow(self, flow: FilmFlow, heat: HeatTransport) -> None:
        """Fill gradients and power of flow, pull and push of heat from the fluxes of the faces; zero where cavitated.

        Gradients, per unit of x and y: the smaller of the one that drives the mean flux of the faces and of that of the
        neighbours; near a pressure spike, where viscosity changes by decades from node to node, either may be far too
        large. Power: flux, along x bounded by that of continuity, times pressure drop, half of it to either node, per
        area. Pull and push: changes of power with the pressure drops, and with the wedge fluxes that the pressure must
        carry, by the share of pressure flow over deflection.
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
        before, behind = mesh.wedge[:, :-1], mesh.wedge[:, 1:]
        pull = np.stack((half * flux[:, :-1], half * flux[:, 1:]), axis=2)
        wedges = left * before[1], left * before[0] + right * behind[1], left * before[2] + right * behind[0]
        push = np.stack((*wedges, right * behind[2]), axis=2)
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
def line_jacobian(s, j, far_phi, far_g, out):
    """Derivatives of line j to its pressures, out (n_x-2, n_x), by heat too unless far_* are empty; to an approach."""
    c_x, wedge, g, gap, same_line = s.faces.c_x[:, j], s.mesh.wedge, s.g[j], s.gap[j], s.same_line
    dln_phi, dg, penalty, inverse = s.dln_phi[j], s.dg[j], s.penalty[j], 1.0 / s.mesh.width
    # the flux through the line of symmetry is that of its neighbour with opposite sign
    up = (2.0 if j == 0 else 1.0) * s.mesh.kappa_h * s.faces.c_y[:, j]
    down = (0.0 if j == 0 else 1.0) * s.mesh.kappa_h * s.faces.c_y[:, j - 1]
    raised = up[4, 1:-1] - down[3, 1:-1]
    by_p, by_phi, by_h, by_g = np.zeros((4, 4))
    for i in range(1, g.size - 1):
        inv, left, right, row = inverse[i], c_x[:, i - 1], c_x[:, i], out[i - 1]
        # by nodes i-2, i-1, i, i+1; there is none before the first
        by_p[1], by_p[3] = left[0] * inv, right[0] * inv
        by_p[2] = -(left[0] + right[0]) * inv - up[0, i] - down[0, i] - penalty[i]
        by_phi[1], by_phi[3] = -left[1] * inv, right[2] * inv
        by_phi[2] = (right[1] - left[2]) * inv + up[1, i] - down[2, i]
        by_h[0], by_h[1], by_h[3] = 0.0, -left[3] * inv, right[3] * inv
        by_h[2] = (right[3] - left[3]) * inv + up[3, i] - down[4, i]
        by_g[0], by_g[1] = wedge[1, i - 1] * inv, (wedge[0, i - 1] - wedge[1, i]) * inv
        by_g[2] = (wedge[2, i - 1] - wedge[0, i]) * inv - s.squeeze
        by_g[3] = -wedge[2, i] * inv
        first = max(i - 2, 0)
        for m in range(4):
            at = max(i - 2 + m, 0)
            by_h[m] += by_g[m] * g[at]
            by_g[m] *= gap[at]
        lifted_0, lifted_1, lifted_2, lifted_3 = by_h
        raised[i - 1] += lifted_0 + lifted_1 + lifted_2 + lifted_3
        for k in range(row.size):
            row[k] = lifted_0 * same_line[first, k] + lifted_1 * same_line[i - 1, k]
            row[k] += lifted_2 * same_line[i, k] + lifted_3 * same_line[i + 1, k]
        for m in range(4):
            at = max(i - 2 + m, 0)
            row[at] += by_p[m] + by_phi[m] * dln_phi[at] + by_g[m] * dg[at]
            if far_phi.size > 0:
                phi, g_row, far, far_row = by_phi[m], by_g[m], far_phi[at], far_g[at]
                for k in range(row.size):
                    row[k] += phi * far[k] + g_row * far_row[k]
    return raised


@kernel
def line_jacobians(s, carried):
    """Jacobians of lines to pressures (lines, n_x-2, n_x-2), carried: with heat; to an approach (lines, n_x-2)."""
    ny, nx = s.gap.shape
    out, raised = np.empty((ny - 1, nx - 2, nx - 2)), np.empty((ny - 1, nx - 2))
    matrix, (far_phi, far_g) = np.empty((nx - 2, nx)), np.empty((2, nx, nx) if carried else (2, 0, 0))
    for j in range(ny - 1):
        if carried:
            line_response(s.heat, j, s.g, s.dg, s.by_t, s.unit, s.unit_h, s.same_line, far_phi, far_g)
        raised[j] = line_jacobian(s, j, far_phi, far_g, matrix)
        out[j] = matrix[:, 1:-1]
    return out, raised


class LineFactors(NamedTuple):
    """LU factors of the transposed matrices (lines, n, n), exchanges (lines, n), answer to an approach and its load."""

    lu: Array
    pivots: NDArray[np.int32]
    approach: Array
    approach_load: float


def factor_lines(s: LinearSystem, carried: bool) -> LineFactors:
    """Factors of the Jacobians of all lines; carried: with the heat that their oil carries, which doubles the cost."""
    lu, raised = line_jacobians(s, carried and s.warm)
    pivots, approach = np.empty(raised.shape, dtype=np.int32), np.zeros_like(s.gap)
    # LAPACK takes matrices stored by columns: the transposed ones
    for j, matrix in enumerate(lu):
        _, pivots[j], _ = dgetrf(matrix.T, overwrite_a=1)
        approach[j, 1:-1], _ = dgetrs(matrix.T, pivots[j], raised[j], trans=1)
    load = float(np.sum(s.weights * approach))
    if not np.isfinite(load):
        raise np.linalg.LinAlgError("the Jacobian of a line of the contact is singular or not finite")
    return LineFactors(lu, pivots, approach, load)


@kernel(fastmath={"reassoc", "contract"})  # sums in any order; NaN and infinity stay what they are
def solve_lines(lu, pivots, rows):
    """Solve for the rows (lines, n) in place, with the factors and exchanges of the transposed matrices by getrf."""
    n = rows.shape[1]
    for j in range(rows.shape[0]):
        b = rows[j]
        for k in range(n):
            row, total = lu[j, k], b[k]
            for m in range(k):
                total -= row[m] * b[m]
            b[k] = total / row[k]
        for k in range(n - 2, -1, -1):
            row, total = lu[j, k], b[k]
            for m in range(k + 1, n):
                total -= row[m] * b[m]
            b[k] = total
        for k in range(n - 1, -1, -1):
            at = pivots[j, k]
            if at != k:
                b[k], b[at] = b[at], b[k]


@kernel
def residual_change(s, d_p, d_h, d_phi, d_g):
    """Change of the scaled residual with changes of pressure, gap, ln phi and g at the nodes."""
    width, kappa_h, c_x, c_y, wedge = s.mesh.width, s.mesh.kappa_h, s.faces.c_x, s.faces.c_y, s.mesh.wedge
    ny, nx = s.gap.shape
    out, carried = np.zeros((ny, nx)), s.g * d_h + s.gap * d_g
    along, side, before = np.empty(nx - 1), np.empty(nx), np.zeros(nx)
    for j in range(ny - 1):
        for i in range(nx - 1):
            along[i] = (
                c_x[0, j, i] * (d_p[j, i + 1] - d_p[j, i])
                + c_x[1, j, i] * d_phi[j, i]
                + c_x[2, j, i] * d_phi[j, i + 1]
                + c_x[3, j, i] * (d_h[j, i] + d_h[j, i + 1])
                - wedge[0, i] * carried[j, i]
                - wedge[2, i] * carried[j, i + 1]
            )
        for i in range(1, nx - 1):
            along[i] -= wedge[1, i] * carried[j, i - 1]
        for i in range(1, nx - 1):
            side[i] = kappa_h * (
                c_y[0, j, i] * (d_p[j + 1, i] - d_p[j, i])
                + c_y[1, j, i] * d_phi[j, i]
                + c_y[2, j, i] * d_phi[j + 1, i]
                + c_y[3, j, i] * d_h[j, i]
                + c_y[4, j, i] * d_h[j + 1, i]
            )
            # the flux through the line of symmetry is that of its neighbour with opposite sign
            across = side[i] + side[i] if j == 0 else side[i] - before[i]
            flow = (along[i] - along[i - 1]) / width[i] + across
            held = s.penalty[j, i] * d_p[j, i] + s.squeeze * carried[j, i]
            out[j, i] = (flow - held) / s.scale[j, i]
        before, side = side, before
    return out


@kernel
def times(s, v):
    """Scaled Jacobian times a change v (n_y n_x + 1,) of pressures and approach; deflection in single precision."""
    ny, nx = s.gap.shape
    d_p = v[:-1].reshape((ny, nx))
    d_h = convolve(s.forward, s.modes, s.backward, d_p.astype(np.float32)) + v[-1]
    d_phi, d_g = s.dln_phi * d_p, s.dg * d_p
    if s.warm:
        by_t, d_t = s.by_t, np.empty((ny, nx, s.by_t.shape[3]))
        follow(s.heat, s.g, s.dg, by_t, s.unit, s.unit_h, d_p, d_h, d_t)
        for j in range(ny):
            for i in range(nx):
                by_phi = by_g = 0.0
                for k in range(d_t.shape[2]):
                    by_phi += by_t[j, i, 0, k] * d_t[j, i, k]
                    by_g += by_t[j, i, 1, k] * d_t[j, i, k]
                d_phi[j, i] += by_phi
                d_g[j, i] += by_g
    out = np.empty_like(v)
    out[:-1] = residual_change(s, d_p, d_h, d_phi, d_g).ravel()
    out[-1] = np.sum(s.weights * d_p) / TARGET_LOAD if s.free else v[-1]
    return out


@kernel
def column_factors(s):
    """Lower, inverse pivot, upper of the flow across in columns, its share of the diagonal: (4, n_y, n_x), scaled."""
    c_y, (ny, nx) = s.faces.c_y, s.gap.shape
    out = np.zeros((4, ny, nx))
    lower, pivot, upper, fraction = out
    for j in range(ny - 1):
        for i in range(1, nx - 1):
            unit = s.mesh.kappa_h / s.scale[j, i]
            above = (2.0 if j == 0 else 1.0) * unit
            own = above * (c_y[1, j, i] * s.dln_phi[j, i] - c_y[0, j, i]) - 1.0
            if j + 1 < ny - 1:
                upper[j, i] = above * (c_y[2, j, i] * s.dln_phi[j + 1, i] + c_y[0, j, i])
            if j > 0:
                own -= unit * (c_y[2, j - 1, i] * s.dln_phi[j, i] + c_y[0, j - 1, i])
                lower[j, i] = unit * (c_y[0, j - 1, i] - c_y[1, j - 1, i] * s.dln_phi[j - 1, i])
                lower[j, i] *= pivot[j - 1, i]
            fraction[j, i] = 1.0 + 1.0 / own
            pivot[j, i] = 1.0 / (own - lower[j, i] * upper[j - 1, i])
    return out


@kernel
def solve_columns(columns, residual):
    """Pressures (n_y, n_x) by the flow across of a scaled residual, by its share, without the deflection by them."""
    lower, pivot, upper, fraction = columns
    out = fraction * residual
    for j in range(1, len(out) - 1):
        out[j] -= lower[j] * out[j - 1]
    for j in range(len(out) - 2, -1, -1):
        out[j] = pivot[j] * (out[j] - upper[j] * out[j + 1])
    return out


@kernel
def precondition(s, factors, columns, v):
    """Column and line solves of a scaled residual v (n_y n_x + 1,), bordered by the load balance."""
    residual, d_p, missing = v[:-1].reshape(s.gap.shape), np.zeros_like(s.gap), v[-1] * TARGET_LOAD
    if s.across:
        # far upstream of a circle lines alone take dozens of iterations; with heat nothing is gained
        d_p = solve_columns(columns, residual)
        residual = residual - residual_change(s, d_p, np.zeros_like(d_p), s.dln_phi * d_p, s.dg * d_p)
        missing -= np.sum(s.weights * d_p)
    lines = residual[:-1, 1:-1] * s.scale[:-1, 1:-1]
    solve_lines(factors.lu, factors.pivots, lines)
    d_p[:-1, 1:-1] += lines
    load = np.sum(s.weights[:-1, 1:-1] * lines)
    rise = (load - missing) / factors.approach_load if s.free else v[-1]
    out = np.empty_like(v)
    out[:-1] = (d_p - rise * factors.approach).ravel()
    out[-1] = rise
    return out


@kernel
def gmres(s, factors, rhs, tolerance, most):
    """GMRES without restart (Saad 2003, 9.5) for (n_y n_x + 1,): solution, iterations used, relative residual left."""
    columns = column_factors(s) if s.across else np.zeros((4, 1, 1))
    basis, steps = np.empty((most + 1, rhs.size)), np.empty((most, rhs.size))
    triangle, turns, target = np.zeros((most, most)), np.zeros((most, 2)), np.zeros(most + 1)
    size = np.sqrt(np.dot(rhs, rhs))
    if size == 0.0:
        return np.zeros_like(rhs), 0, 0.0
    basis[0], target[0] = rhs / size, size
    for k in range(most):
        steps[k] = precondition(s, factors, columns, basis[k])
        w, column = times(s, steps[k]), triangle[:, k]
        for i in list(range(k + 1)) * 2:
            overlap = np.dot(basis[i], w)
            column[i] += overlap
            w -= overlap * basis[i]
        length = np.sqrt(np.dot(w, w))
        basis[k + 1] = w / length
        # Givens rotations of the new column of the Hessenberg matrix
        for i in range(k):
            a, b, cos, sin = column[i], column[i + 1], turns[i, 0], turns[i, 1]
            column[i], column[i + 1] = cos * a + sin * b, cos * b - sin * a
        diagonal = max(np.hypot(column[k], length), TINY)
        turns[k] = column[k] / diagonal, length / diagonal
        column[k] = diagonal
        target[k], target[k + 1] = turns[k, 0] * target[k], -turns[k, 1] * target[k]
        used = k + 1
        if not abs(target[used]) > tolerance * size:
            break
    left, weights = abs(target[used]) / size, target[:used]
    for i in range(used - 1, -1, -1):
        weights[i] /= triangle[i, i]
        weights[:i] -= weights[i] * triangle[:i, i]
    return np.dot(weights, steps[:used]), used, left
