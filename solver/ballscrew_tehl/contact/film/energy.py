"""Film energy equation on the columns of the contact, coupled with the temperatures of both surfaces.

rho c (u T_x + v T_y + w T_z) = k T_zz - (T/rho)(d rho/dT)(u p_x + v p_y) + tau . du/dz   (Eq. 11 with the continuity
equation corrected). Steady, in conservative finite volumes with the mass of the Reynolds equation, so the heat balance
closes exactly. Upwind along the flow, of second order where it runs forward, exponential scheme across. Where flow
enters the domain, T = T0; that ends where the gap is a given number of films. A cavitated film is taken as full; its
mass flow is that at the rupture.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ...compiled import kernel
from ..grid import TINY, Array
from ..half_space import LineConvolution
from .flow import SWEEP_LIMIT, FilmFlow, ln_viscosity, pressure_factor, trapezoid_weights
from .fluxes import line_fluxes, outflow_across

#: right-hand sides of a column; a constant, so that the compiler unrolls the loops over them
COLUMNS = 4
#: flow, over that of the cell upstream, up to which the slope of the latter counts in full
REVERSAL = 4.0
WALL_TOLERANCE = 1e-2  # relative residual at which the iteration of the wall temperatures ends


class EnergyMesh(NamedTuple):
    """Nodes x and cell widths (n_x,), distance of the lines [m]; conductivity [W/(m K)], inlet temperature [K]."""

    x: Array
    width: Array
    h_y: float
    conductivity: float
    t_in: float


class WallHeat(NamedTuple):
    """Heat into the walls q_a, q_b (n_y, n_x) [W/m2]; response: -dq_a/dT_a, dq_a/dT_b, dq_b/dT_a, -dq_b/dT_b."""

    q_a: Array
    q_b: Array
    response: Array


class FaceFlow(NamedTuple):
    """Mass flow times heat capacity through the faces of the cells [W/(m K)] per unit of z/h.

    x (n_y, n_x-1, n_z+1), y (n_y-1, n_x, n_z+1), z (n_y, n_x, n_z) upwards [W/(m2 K)]; start, end (n_y,): the columns
    start <= i < end of a line are solved, T0 elsewhere; reverse (n_y,): the last whose oil flows back at some level.
    """

    x: Array
    y: Array
    z: Array
    start: NDArray[np.int64]
    end: NDArray[np.int64]
    reverse: NDArray[np.int64]

    @classmethod
    def empty(cls, start: NDArray[np.int64], end: NDArray[np.int64], nx: int, nz: int) -> Self:
        """Without any flow."""
        ny = start.size
        x, y, z = np.zeros((ny, nx - 1, nz + 1)), np.zeros((ny - 1, nx, nz + 1)), np.zeros((ny, nx, nz))
        return cls(x, y, z, start, end, np.zeros(ny, dtype=np.int64))


def face_flow(
    mesh: EnergyMesh, heat: float, p: Array, flux_x: Array, flux_y: Array, flow: FilmFlow, face: FaceFlow
) -> None:
    """Fill face with the mass flux_x, flux_y [kg/(m s)] by the profiles of the nodes; heat: capacity [J/(kg K)]."""
    nx, cells = p.shape[1], trapezoid_weights(flow.m_x.shape[2] - 1)
    m = 0.5 * (flow.m_y[:-1] + flow.m_y[1:])
    face.y[:] = heat * (m + (flux_y - m @ cells)[..., None])
    steady = line_fluxes(mesh.width, 1.0 / mesh.h_y, p, flux_x, flux_y)
    m = 0.5 * (flow.m_x[:-1, :-1] + flow.m_x[:-1, 1:])
    total = m @ cells
    # a ruptured film keeps its profile
    ruptured = (steady > 0.0) & (steady < total)
    scale = np.where(ruptured, steady / np.where(ruptured, total, 1.0), 1.0)
    m = scale[..., None] * m + (steady - scale * total)[..., None]
    start, end, columns = face.start[:-1, None], face.end[:-1, None], np.arange(nx)
    solved = (columns[:-1] >= start - 1) & (columns[:-1] < end)
    face.x[:-1] = np.where(solved[..., None], heat * m, 0.0)
    back = solved & (m < 0.0).any(axis=2)
    face.reverse[:-1] = np.where(back.any(axis=1), nx - 1 - np.argmax(back[:, ::-1], axis=1), 0)
    out = np.diff(face.x[:-1], axis=1) / mesh.width[1:-1, None] + outflow_across(face.y)[:, 1:-1] / mesh.h_y
    inside = (columns[1:-1] >= start) & (columns[1:-1] < end)
    face.z[:-1, 1:-1] = np.where(inside[..., None], -np.cumsum(out * cells, axis=2)[..., :-1], 0.0)


@kernel
def bernoulli(x):
    """x/(exp(x) - 1): weight of the exponential scheme (Scharfetter & Gummel 1969)."""
    if abs(x) < 1e-3:
        return 1.0 - 0.5 * x + x * x / 12.0
    if x > 300.0:
        return 0.0
    if x < -300.0:
        return -x
    return x / np.expm1(x)


@kernel
def along(x, width, flow_x, j, i, k):
    """Weights [W/(m2 K) per unit z/h] of the own temperature (negated), one and two columns upstream, and downstream.

    A face takes the temperature upstream, continued with the slope, which counts with REVERSAL times its flow at most.
    """
    w, e = flow_x[j, i - 1, k] / width[i], flow_x[j, i, k] / width[i]
    own = up_1 = up_2 = down = 0.0
    if w > 0.0:
        own = up_1 = w
        if i > 1:
            passing = min(w, REVERSAL * max(flow_x[j, i - 2, k] / width[i], 0.0))
            slope = 0.5 * passing * (x[i] - x[i - 1]) / (x[i - 1] - x[i - 2])
            up_1 += slope
            up_2 = -slope
    if e < 0.0:
        down = -e
        own -= e
    elif w > 0.0:
        slope = 0.5 * min(e, REVERSAL * w) * (x[i + 1] - x[i]) / (x[i] - x[i - 1])
        own += slope
        up_1 += slope
    return own, up_1, up_2, down


@kernel
def bounded_slope(upstream, own, downstream):
    """Change over a cell by minmod (Harten 1983): without, oil across wide gaps would gain tens of kelvin."""
    before, behind = own - upstream, downstream - own
    if before * behind <= 0.0:
        return 0.0
    return before if abs(before) < abs(behind) else behind


@kernel
def across(h_y, t, t_in, flow_y, j, i, k):
    """Heat that the faces to the neighbour lines bring in, as rest - diag*T [W/m2 per unit z/h]; returns diag, rest."""
    ny = t.shape[0]
    diag = remainder = 0.0
    for side in range(2):
        axis = j == 0
        if side == 0:
            m = flow_y[j, i, k] / h_y * (2.0 if axis else 1.0)
            near, far = j + 1, j + 2
            behind = 1 if axis else j - 1
        else:
            if axis:
                break
            m = -flow_y[j - 1, i, k] / h_y
            near, far = j - 1, j - 2
            behind = j + 1
            if far < 0:
                far = 1
        # m: flow out of the cell
        if m < 0.0:
            if near == ny - 1:
                inflow = t_in
            else:
                inflow = t[near, i, k] + 0.5 * bounded_slope(t[far, i, k], t[near, i, k], t[j, i, k])
            diag -= m
            remainder -= m * inflow
        elif behind >= 0:
            # outflow with the slope of the cell from its last temperatures
            remainder -= m * 0.5 * bounded_slope(t[behind, i, k], t[j, i, k], t[near, i, k])
    return diag, remainder


@kernel
def sideways(x, width, h_y, t_in, t, flow_x, flow_y, j, i, k):
    """Heat that the side faces of a cell bring in, as rest - diag*T [W/m2 per unit z/h]; returns diag, rest."""
    own, up_1, up_2, down = along(x, width, flow_x, j, i, k)
    diag, remainder = across(h_y, t, t_in, flow_y, j, i, k)
    remainder += up_1 * t[j, i - 1, k] + down * t[j, i + 1, k]
    if up_2 != 0.0:
        remainder += up_2 * t[j, i - 2, k]
    return own + diag, remainder


@kernel
def stress_changes(t_at, t, rate, soft, stiff, j, i):
    """Change of the stress of a column by what the walls have warmed since, by its pressure, and its sliding."""
    nz = t.shape[2] - 1
    known = by_pressure = slid = 0.0
    for k in range(nz + 1):
        own = rate[j, i, k] * (0.5 if k == 0 or k == nz else 1.0)
        warmed = t_at[j, i, k]
        if k == 0 or k == nz:
            warmed -= t[j, i, k]
        known += own * soft[j, i, k] * warmed
        by_pressure += own * stiff[j, i, k]
        slid += own
    return known, by_pressure, slid


@kernel
def solve_column(lower, diag, upper, rhs, weight, heat_lower, heat_upper, pivot, stress):
    """Temperatures of a column and its responses, rhs in place; fills the last four (Sherman-Morrison)."""
    n, bottom = diag.size, 1.0
    lower[0] = 0.0
    for r in range(1, n):
        f = lower[r] / diag[r - 1]
        lower[r] = f
        diag[r] -= f * upper[r - 1]
        for c in range(COLUMNS):
            rhs[r, c] -= f * rhs[r - 1, c]
    for c in range(COLUMNS):
        rhs[n - 1, c] /= diag[n - 1]
    for r in range(n - 2, -1, -1):
        for c in range(COLUMNS):
            rhs[r, c] = (rhs[r, c] - upper[r] * rhs[r + 1, c]) / diag[r]
    for r in range(n):
        bottom += weight[r] * rhs[r, 3]
        heat_lower[r], heat_upper[r], pivot[r] = lower[r], upper[r], 1.0 / diag[r]
    for r in range(n):
        stress[r] = rhs[r, 3] / bottom
    for c in range(COLUMNS - 1):
        top = 0.0
        for r in range(n):
            top += weight[r] * rhs[r, c]
        for r in range(n):
            rhs[r, c] -= top * stress[r]


@kernel
def sweep_line(mesh, h, flow, face, t_at, damped, j, columns, t, heat, response):
    """Solve the columns of line j in turn, walls and neighbour columns held; columns: a range, the rest as in sweep."""
    # arrays by name: a tuple of them that is passed or searched in the inner loops costs three times the rest
    x, width, h_y, t_in = mesh.x, mesh.width, mesh.h_y, mesh.t_in
    flow_x, flow_y, flow_z = face.x, face.y, face.z
    compression, driven, shear, sliding = flow.compression, flow.driven, flow.shear, flow.sliding
    rate, soft, squeeze, stiff, fluidity = flow.rate, flow.soft, flow.squeeze, flow.stiff, flow.fluidity
    heat_up_1, heat_up_2, heat_squeeze, heat_source = heat.up_1, heat.up_2, heat.squeeze, heat.source
    heat_weight, heat_lift, heat_widen = heat.weight, heat.lift, heat.widen
    heat_lower, heat_upper, heat_pivot, heat_stress = heat.lower, heat.upper, heat.pivot, heat.stress
    nz = t.shape[2] - 1
    n, dz = nz - 1, 1.0 / nz
    # diagonals; heat, then by the temperatures of wall a and wall b, and by the stress
    (lower, diag, upper), rhs = np.empty((3, n)), np.empty((n, COLUMNS))
    for i in columns:
        cond = mesh.conductivity / (h[j, i] * dz)
        eased = dz / fluidity[j, i] if fluidity[j, i] > 0.0 and not damped else 0.0
        known, by_pressure, slid = stress_changes(t_at, t, rate, soft, stiff, j, i)
        wall_a = 0.5 * rate[j, i, 0] * soft[j, i, 0]
        wall_b = 0.5 * rate[j, i, nz] * soft[j, i, nz]
        for r in range(n):
            k = r + 1
            own, up_1, up_2, down = along(x, width, flow_x, j, i, k)
            d, b = across(h_y, t, t_in, flow_y, j, i, k)
            d += own
            b += up_1 * t[j, i - 1, k] + down * t[j, i + 1, k]
            if up_2 != 0.0:
                b += up_2 * t[j, i - 2, k]
            heat_up_1[j, i, r], heat_up_2[j, i, r] = up_1, up_2
            below, above = flow_z[j, i, k - 1] / cond, flow_z[j, i, k] / cond
            lo, hi = cond / dz * bernoulli(-below), cond / dz * bernoulli(above)
            s, sigma = sliding[j, i, k], soft[j, i, k]
            growth = -abs(s) * sigma if damped else s * sigma
            d += lo + hi - growth
            b += shear[j, i, k] - growth * t_at[j, i, k]
            c = compression[j, i, k]
            if c > 0.0:
                b += c * t[j, i, k]
            else:
                d -= c
            lower[r], diag[r], upper[r] = -lo, d, -hi
            # d shear/d stress
            u = eased * 2.0 * rate[j, i, k]
            rhs[r, 0], rhs[r, 1], rhs[r, 2], rhs[r, 3] = b + u * known, -u * wall_a, -u * wall_b, u
            compressed = squeeze[j, i, k] * t[j, i, k]
            heat_squeeze[j, i, r] = compressed
            heat_source[j, i, r] = compressed - s * stiff[j, i, k] + u * by_pressure
            heat_weight[j, i, r] = rate[j, i, k] * sigma
            heat_lift[j, i, r] = driven[j, i, k]
            spread = cond / dz * (2.0 * t[j, i, k] - t[j, i, k - 1] - t[j, i, k + 1])
            heat_widen[j, i, r] = (spread + s - u * slid) / h[j, i]
        rhs[0, 0] -= lower[0] * t[j, i, 0]
        rhs[n - 1, 0] -= upper[n - 1] * t[j, i, nz]
        rhs[0, 1] -= lower[0]
        rhs[n - 1, 2] -= upper[n - 1]
        solve_column(
            lower, diag, upper, rhs, heat_weight[j, i], heat_lower[j, i], heat_upper[j, i], heat_pivot[j, i],
            heat_stress[j, i],
        )  # fmt: skip
        for r in range(n):
            delta = rhs[r, 0] - t[j, i, r + 1]
            t[j, i, r + 1] += min(max(delta, -SWEEP_LIMIT), SWEEP_LIMIT)
        response[j, i, 0], response[j, i, 1] = rhs[0, 1], rhs[0, 2]
        response[j, i, 2], response[j, i, 3] = rhs[n - 1, 1], rhs[n - 1, 2]


@kernel
def sweep(mesh, h, flow, face, t_at, damped, forward, whole, t, heat, response):
    """One Gauss-Seidel sweep along x (forward or backward) over all columns, each solved across the film; walls held.

    h (n_y, n_x) [m]; t_at: temperatures that flow belongs to; damped: dissipation as if hotter oil sheared with less
    heat everywhere, slow but from far away; else linearised at the sliding and the flux of the column. Fills heat, the
    factors by which temperatures follow the pressure, and response (n_y, n_x, 4) of the levels next to both walls to
    wall a, b, a, b. Backward, and forward unless whole, only columns with reverse flow are visited.
    """
    for j in range(h.shape[0] - 1):
        start = face.start[j] if forward else min(face.reverse[j], face.end[j] - 1)
        step = 1 if forward else -1
        end = face.end[j] if forward else face.start[j] - 1
        if forward and not whole:
            end = min(face.reverse[j] + 1, end)
        sweep_line(mesh, h, flow, face, t_at, damped, j, range(start, end, step), t, heat, response)


@kernel
def wall_heat(mesh, h, flow, face, t, walls):
    """Heat into both walls of every column after the last sweep, and its response from that of the next levels."""
    x, width, h_y, t_in = mesh.x, mesh.width, mesh.h_y, mesh.t_in
    flow_x, flow_y, flow_z, start, end = face.x, face.y, face.z, face.start, face.end
    shear, compression = flow.shear, flow.compression
    q_a, q_b, response = walls.q_a, walls.q_b, walls.response
    nz = t.shape[2] - 1
    dz = 1.0 / nz
    for j in range(h.shape[0] - 1):
        for i in range(start[j], end[j]):
            cond = mesh.conductivity / (h[j, i] * dz)
            b_a = cond * bernoulli(flow_z[j, i, 0] / cond)
            b_b = cond * bernoulli(-flow_z[j, i, nz - 1] / cond)
            d_a, r_a = sideways(x, width, h_y, t_in, t, flow_x, flow_y, j, i, 0)
            d_b, r_b = sideways(x, width, h_y, t_in, t, flow_x, flow_y, j, i, nz)
            t_a, t_b = t[j, i, 0], t[j, i, nz]
            q_a[j, i] = b_a * (t[j, i, 1] - t_a) + 0.5 * dz * (
                shear[j, i, 0] + compression[j, i, 0] * t_a + r_a - d_a * t_a
            )
            q_b[j, i] = b_b * (t[j, i, nz - 1] - t_b) + 0.5 * dz * (
                shear[j, i, nz] + compression[j, i, nz] * t_b + r_b - d_b * t_b
            )
            response[j, i, 0] = b_a * (1.0 - response[j, i, 0]) + 0.5 * dz * d_a
            response[j, i, 1] *= b_a
            response[j, i, 2] *= b_b
            response[j, i, 3] = b_b * (1.0 - response[j, i, 3]) + 0.5 * dz * d_b


@kernel
def sheared_films(oil, p, h, conductivity, slip, t_a, t_b, t):
    """Every column sheared by itself between walls t_a, t_b (n_y, n_x) [K]; fills t, returns the heat into each wall.

    Viscosity eta exp(-soft (T - T_wall)) between equally warm walls (Nahme 1940), slip [m/s]: T = T_wall + (2/soft)
    ln[cosh(a)/cosh(a (1 - 2z/h))], cosh(a)^2 = 1 + soft eta slip^2/(8 k).
    """
    heat, n = np.empty(p.shape), t.shape[2] - 1
    for j in range(p.shape[0]):
        for i in range(p.shape[1]):
            wall = 0.5 * (t_a[j, i] + t_b[j, i])
            factor, _ = pressure_factor(oil, p[j, i])
            ln_eta, slope, _ = ln_viscosity(oil, factor, wall)
            for _attempt in range(2):
                soft = max(-slope, 1e-9)
                a = np.arcsinh(np.sqrt(0.125 * soft * np.exp(ln_eta) * slip * slip / conductivity))
                for k in range(n + 1):
                    rise = 2.0 / soft * np.log(np.cosh(a) / np.cosh(a * (1.0 - 2.0 * k / n)))
                    t[j, i, k] = t_a[j, i] + (t_b[j, i] - t_a[j, i]) * (k / n) + rise
                # the slope flattens with heat: take it where half the rise of the first guess has been reached
                _, slope, _ = ln_viscosity(oil, factor, 0.5 * (wall + t[j, i, n // 2]))
            heat[j, i] = 4.0 * conductivity * a * np.tanh(a) / (soft * h[j, i])
    return heat


def least_residual(apply: Callable[[Array], Array], rhs: Array, tolerance: float) -> Array:
    """Solution of apply(x) = rhs to a relative residual, by generalised conjugate residuals (Eisenstat et al. 1983)."""
    x, residual = np.zeros_like(rhs), rhs.copy()
    steps: list[tuple[Array, Array]] = []
    for _ in range(rhs.size):
        step, image = residual.copy(), apply(residual)
        for other, its_image in steps:
            fraction = float(its_image @ image)
            step -= fraction * other
            image -= fraction * its_image
        size = max(float(np.linalg.norm(image)), TINY)
        steps.append((step / size, image / size))
        fraction = float(steps[-1][1] @ residual)
        x += fraction * steps[-1][0]
        residual -= fraction * steps[-1][1]
        if not float(np.linalg.norm(residual)) > tolerance * float(np.linalg.norm(rhs)):
            break
    return x


def update_walls(operators: Sequence[LineConvolution], t: Array, walls: WallHeat, t_in: float) -> None:
    """Set both wall temperatures of t [K] at once so that T = T0 + K q, with q linearised: a thin film couples them."""
    shape, response = (2, *walls.q_a.shape), walls.response
    wall_a, wall_b = operators
    missing = np.stack([t_in + wall_a(walls.q_a) - t[:, :, 0], t_in + wall_b(walls.q_b) - t[:, :, -1]])

    def apply(v: Array) -> Array:
        d_a, d_b = v.reshape(shape)
        return np.stack([
            d_a + wall_a.rough(response[:, :, 0] * d_a - response[:, :, 1] * d_b),
            d_b + wall_b.rough(response[:, :, 3] * d_b - response[:, :, 2] * d_a),
        ]).ravel()  # fmt: skip

    step = least_residual(apply, missing.ravel(), WALL_TOLERANCE)
    t[:, :, 0] += step.reshape(shape)[0]
    t[:, :, -1] += step.reshape(shape)[1]


@kernel
def heat_flows(mesh, t, flow, face, walls):
    """Generated, conducted, convected heat [W] of the cells where the energy equation is solved."""
    # arrays by name: see sweep
    flow_x, flow_y, start, end = face.x, face.y, face.start, face.end
    shear, compression = flow.shear, flow.compression
    x, width, h_y, t_in, q_a, q_b = mesh.x, mesh.width, mesh.h_y, mesh.t_in, walls.q_a, walls.q_b
    nz = t.shape[2] - 1
    generated = conducted = convected = 0.0
    for j in range(t.shape[0] - 1):
        twice = 2.0 if j > 0 else 1.0
        for i in range(start[j], end[j]):
            area = width[i] * h_y * twice
            conducted += area * (q_a[j, i] + q_b[j, i])
            for k in range(nz + 1):
                w = area * (0.5 if k == 0 or k == nz else 1.0) / nz
                rise = t[j, i, k] - t_in
                generated += w * (shear[j, i, k] + compression[j, i, k] * t[j, i, k])
                diag, remainder = sideways(x, width, h_y, t_in, t, flow_x, flow_y, j, i, k)
                out = (flow_x[j, i, k] - flow_x[j, i - 1, k]) / width[i]
                if j == 0:
                    out += 2.0 * flow_y[0, i, k] / h_y
                else:
                    out += (flow_y[j, i, k] - flow_y[j - 1, i, k]) / h_y
                convected += w * (diag * t[j, i, k] - remainder + out * rise)
    return generated, conducted, convected
