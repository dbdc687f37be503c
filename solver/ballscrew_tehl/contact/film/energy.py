"""Film energy equation on the columns of the contact, coupled with the temperatures of both surfaces.

rho c (u T_x + v T_y + w T_z) = k T_zz - (T/rho)(d rho/dT)(u p_x + v p_y) + tau . du/dz   (Eq. 11 with the continuity
equation corrected). Steady, in conservative finite volumes: the mass through every face is that of the Reynolds
equation, so the heat balance closes exactly. Upwind along the local flow, of second order where it runs forward,
exponential scheme across the film, dissipation linearised with the stress it leaves to the rest of the column. T = T0
only where flow enters the domain, outlet included; the domain ends where the gap is INLET_GAPS films.
A cavitated film is taken as full; its mass flow is that at the rupture.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from ..half_space.grid import TINY, Array
from ..half_space.walls import LineConvolution
from .flow import FilmFlow
from .krylov import gmres
from .oil import ln_viscosity, pressure_factor

#: gap, in films, at which oil enters with the inlet temperature
INLET_GAPS = 6.0
#: largest change of a node in one sweep [K]: the sources are exponential in temperature, longer steps overshoot
SWEEP_LIMIT = 30.0
#: right-hand sides of a column; a constant, so that the compiler unrolls the loops over them
COLUMNS = 5
#: relative residual at which GMRES ends for the wall temperatures, and its most iterations
WALL_TOLERANCE, MOST_WALL_STEPS = 1e-2, 40


class FaceFlow(NamedTuple):
    """Mass flow times heat capacity through the faces of the cells [W/(m K)] per unit of z/h.

    x (n_y, n_x-1, n_z+1), y (n_y-1, n_x, n_z+1): in direction of x and y; z (n_y, n_x, n_z): upwards between the
    levels [W/(m2 K)]; start, end (n_y,): columns of a line where the energy equation is solved, start <= i < end, T0
    elsewhere; reverse (n_y,): last column of a line whose oil flows back at some level.
    """

    x: Array
    y: Array
    z: Array
    start: Array
    end: Array
    reverse: Array

    @classmethod
    def empty(cls, start: Array, end: Array, nx: int, nz: int) -> FaceFlow:
        ny = start.size
        return cls(
            np.zeros((ny, nx - 1, nz + 1)),
            np.zeros((ny - 1, nx, nz + 1)),
            np.zeros((ny, nx, nz)),
            start,
            end,
            np.zeros(ny, dtype=np.int64),
        )


@njit(cache=True, error_model="numpy")
def face_flow(width, h_y, mirror, heat, flux_x, flux_y, flow, face):
    """Mass through the faces: profiles of the nodes, in sum the flux of the Reynolds equation; fills face.

    width (nx,), h_y [m]; flux_x (n_y, n_x-1), flux_y (n_y-1, n_x) [kg/(m s)]. Along a line the flux follows from
    continuity, so that it is also right where the film cavitates.
    """
    ny, nx, nz = flow.m_x.shape[0], flow.m_x.shape[1], flow.m_x.shape[2] - 1
    dz = 1.0 / nz
    first = 0 if mirror else 1
    for j in range(ny - 1):
        for i in range(nx):
            total = 0.0
            for k in range(nz + 1):
                m = 0.5 * (flow.m_y[j, i, k] + flow.m_y[j + 1, i, k])
                face.y[j, i, k] = m
                total += m * (0.5 * dz if k == 0 or k == nz else dz)
            for k in range(nz + 1):
                face.y[j, i, k] = heat * (face.y[j, i, k] + flux_y[j, i] - total)
    for j in range(first, ny - 1):
        # from the first column of the energy equation: residuals far upstream must not add up
        start = face.start[j] - 1
        passing = flux_x[j, start]
        face.reverse[j] = 0
        for i in range(start, face.end[j]):
            if i > start:
                side = 2.0 * flux_y[0, i] if mirror and j == 0 else flux_y[j, i] - flux_y[j - 1, i]
                passing -= width[i] / h_y * side
            total = 0.0
            for k in range(nz + 1):
                m = 0.5 * (flow.m_x[j, i, k] + flow.m_x[j, i + 1, k])
                face.x[j, i, k] = m
                total += m * (0.5 * dz if k == 0 or k == nz else dz)
            # a ruptured film keeps its profile
            scale = passing / total if 0.0 < passing < total else 1.0
            for k in range(nz + 1):
                m = scale * face.x[j, i, k] + passing - scale * total
                face.x[j, i, k] = heat * m
                if m < 0.0:
                    face.reverse[j] = i + 1
        for i in range(face.start[j], face.end[j]):
            up = 0.0
            for k in range(nz):
                out = (face.x[j, i, k] - face.x[j, i - 1, k]) / width[i]
                if mirror and j == 0:
                    out += 2.0 * face.y[0, i, k] / h_y
                else:
                    out += (face.y[j, i, k] - face.y[j - 1, i, k]) / h_y
                up -= out * (0.5 * dz if k == 0 else dz)
                face.z[j, i, k] = up


@njit(cache=True, error_model="numpy")
def bernoulli(x):
    """x/(exp(x) - 1): weight of the exponential scheme (Scharfetter & Gummel 1969)."""
    if abs(x) < 1e-3:
        return 1.0 - 0.5 * x + x * x / 12.0
    if x > 300.0:
        return 0.0
    if x < -300.0:
        return -x
    return x / np.expm1(x)


@njit(cache=True, error_model="numpy")
def sideways(x, width, h_y, mirror, t, t_in, face, j, i, k):
    """Heat that the side faces of a cell bring in, as rest - diag*T [W/m2 per unit z/h]; returns diag, rest."""
    ny = t.shape[0]
    diag = rest = 0.0
    w, e = face.x[j, i - 1, k] / width[i], face.x[j, i, k] / width[i]
    d_w, d_e = x[i] - x[i - 1], x[i + 1] - x[i]
    # a face takes the temperature upstream of it; where the oil runs forward for two columns, continued with the slope
    if w > 0.0:
        if i > 1 and face.x[j, i - 2, k] > 0.0:
            slope = (t[j, i - 1, k] - t[j, i - 2, k]) / (x[i - 1] - x[i - 2])
            rest += w * (t[j, i - 1, k] + 0.5 * d_w * slope)
        else:
            rest += w * t[j, i - 1, k]
        diag += w
    if e < 0.0:
        rest -= e * t[j, i + 1, k]
        diag -= e
    elif w > 0.0:
        r = 0.5 * d_e / d_w
        diag += e * r
        rest += e * r * t[j, i - 1, k]
    for side in range(2):
        axis = mirror and j == 0
        if side == 0:
            m = face.y[j, i, k] / h_y * (2.0 if axis else 1.0)
            near, far = j + 1, j + 2
            behind = 1 if axis else j - 1
        else:
            if axis:
                break
            m = -face.y[j - 1, i, k] / h_y
            near, far = j - 1, j - 2
            behind = j + 1
            if far < 0 and mirror:
                far = 1
        # m: flow out of the cell
        if m < 0.0:
            if near == ny - 1 or (near == 0 and not mirror):
                inflow = t_in
            else:
                inflow = t[near, i, k] + 0.5 * (t[near, i, k] - t[far, i, k])
            diag -= m
            rest -= m * inflow
        elif behind >= 0:
            # outflow with the slope of the cell from its last temperatures
            rest -= m * 0.5 * (t[j, i, k] - t[behind, i, k])
    return diag, rest


@njit(cache=True, error_model="numpy")
def solve_tridiagonal(lower, diag, upper, rhs):
    """Gaussian elimination without pivoting for the columns of rhs, in place; diag is overwritten."""
    n = diag.size
    for r in range(1, n):
        f = lower[r] / diag[r - 1]
        diag[r] -= f * upper[r - 1]
        for c in range(COLUMNS):
            rhs[r, c] -= f * rhs[r - 1, c]
    for c in range(COLUMNS):
        rhs[n - 1, c] /= diag[n - 1]
    for r in range(n - 2, -1, -1):
        for c in range(COLUMNS):
            rhs[r, c] = (rhs[r, c] - upper[r] * rhs[r + 1, c]) / diag[r]


@njit(cache=True, error_model="numpy")
def sweep(
    x, width, h_y, mirror, h, conductivity, t_in, flow, face, t_at, damped, forward, t, t_p, q_a, q_b, response
):  # fmt: skip
    """One Gauss-Seidel sweep along x (forward or backward) over all columns, each solved across the film; walls held.

    width (nx,), h_y [m]; t_at: temperatures that flow belongs to; damped: dissipation as if hotter oil sheared with
    less heat everywhere, which converges slowly from far away. Fills q_a, q_b (heat flux into the walls, W/m2),
    response (n_y, n_x, 4): -dq_a/dT_a, dq_a/dT_b, dq_b/dT_a, -dq_b/dT_b, and t_p, dT/dp [K/Pa], with the neighbour
    columns held. Backward, only columns with reverse flow are visited. Returns the largest change [K].
    """
    # one function: assembly and wall fluxes called with flow and face cost half as much again (1.2 to 1.9 ms)
    ny, nz = h.shape[0], t.shape[2] - 1
    dz = 1.0 / nz
    n = nz - 1
    lower, diag, upper = np.empty(n), np.empty(n), np.empty(n)
    rhs = np.empty((n, COLUMNS))
    change = 0.0
    first = 0 if mirror else 1
    for j in range(first, ny - 1):
        start = face.start[j] if forward else min(face.reverse[j], face.end[j] - 1)
        step = 1 if forward else -1
        end = face.end[j] if forward else face.start[j] - 1
        for i in range(start, end, step):
            cond = conductivity / (h[j, i] * dz)
            share = 0.0
            if flow.fluidity[j, i] > 0.0 and not damped:
                share = 2.0 * dz / flow.fluidity[j, i]
            for r in range(n):
                k = r + 1
                d, b = sideways(x, width, h_y, mirror, t, t_in, face, j, i, k)
                below, above = face.z[j, i, k - 1] / cond, face.z[j, i, k] / cond
                lo, hi = cond / dz * bernoulli(-below), cond / dz * bernoulli(above)
                s, sigma = flow.shear[j, i, k], flow.soft[j, i, k]
                # hotter oil at the same stress shears faster; the stress of the column falls in turn (rank one, below)
                growth = -s * sigma if damped else s * sigma
                d += lo + hi - growth
                b += s - growth * t_at[j, i, k]
                c = flow.compression[j, i, k]
                if c > 0.0:
                    b += c * t[j, i, k]
                else:
                    d -= c
                lower[r], diag[r], upper[r] = -lo, d, -hi
                rhs[r, 0] = b
                rhs[r, 1] = rhs[r, 2] = 0.0
                rhs[r, 3] = share * flow.rate[j, i, k]
                rhs[r, 4] = flow.squeeze[j, i, k] * t[j, i, k] - s * flow.stiff[j, i, k]
            v_a = flow.rate[j, i, 0] * flow.soft[j, i, 0] * 0.5
            v_b = flow.rate[j, i, nz] * flow.soft[j, i, nz] * 0.5
            # change of stress by what the walls have warmed since
            known = v_a * (t_at[j, i, 0] - t[j, i, 0]) + v_b * (t_at[j, i, nz] - t[j, i, nz])
            stiff = 0.0
            for k in range(1, nz):
                known += flow.rate[j, i, k] * flow.soft[j, i, k] * t_at[j, i, k]
                stiff += flow.rate[j, i, k] * flow.stiff[j, i, k]
            stiff += 0.5 * flow.rate[j, i, 0] * flow.stiff[j, i, 0]
            stiff += 0.5 * flow.rate[j, i, nz] * flow.stiff[j, i, nz]
            rhs[0, 0] -= lower[0] * t[j, i, 0]
            rhs[n - 1, 0] -= upper[n - 1] * t[j, i, nz]
            rhs[0, 1] = -lower[0]
            rhs[n - 1, 2] = -upper[n - 1]
            for r in range(n):
                u_r = rhs[r, 3]
                rhs[r, 0] += u_r * known
                rhs[r, 1] -= u_r * v_a
                rhs[r, 2] -= u_r * v_b
                rhs[r, 4] += u_r * stiff
            solve_tridiagonal(lower, diag, upper, rhs)
            # Sherman-Morrison: the stress depends on the temperatures of the whole column
            for c_ in (0, 1, 2, 4):
                top = bottom = 0.0
                for r in range(n):
                    v = flow.rate[j, i, r + 1] * flow.soft[j, i, r + 1]
                    top += v * rhs[r, c_]
                    bottom += v * rhs[r, 3]
                f = top / (1.0 + bottom)
                for r in range(n):
                    rhs[r, c_] -= f * rhs[r, 3]
            for r in range(n):
                delta = rhs[r, 0] - t[j, i, r + 1]
                change = max(change, abs(delta))
                t_p[j, i, r + 1] = rhs[r, 4]
                t[j, i, r + 1] += min(max(delta, -SWEEP_LIMIT), SWEEP_LIMIT)
            b_a = cond * bernoulli(face.z[j, i, 0] / cond)
            b_b = cond * bernoulli(-face.z[j, i, nz - 1] / cond)
            # half cells at the walls
            d_a, r_a = sideways(x, width, h_y, mirror, t, t_in, face, j, i, 0)
            d_b, r_b = sideways(x, width, h_y, mirror, t, t_in, face, j, i, nz)
            t_a, t_b = t[j, i, 0], t[j, i, nz]
            q_a[j, i] = b_a * (t[j, i, 1] - t_a) + 0.5 * dz * (
                flow.shear[j, i, 0] + flow.compression[j, i, 0] * t_a + r_a - d_a * t_a
            )
            q_b[j, i] = b_b * (t[j, i, nz - 1] - t_b) + 0.5 * dz * (
                flow.shear[j, i, nz] + flow.compression[j, i, nz] * t_b + r_b - d_b * t_b
            )
            response[j, i, 0] = b_a * (1.0 - rhs[0, 1]) + 0.5 * dz * d_a
            response[j, i, 1] = b_a * rhs[0, 2]
            response[j, i, 2] = b_b * rhs[n - 1, 1]
            response[j, i, 3] = b_b * (1.0 - rhs[n - 1, 2]) + 0.5 * dz * d_b
    return change


@njit(cache=True, error_model="numpy")
def sheared_film(conductivity, h, slip, eta, soft, t_a, t_b, t):
    """Temperature (n_z+1,) across a film sheared at one rate between walls: start of the iteration; returns q_wall.

    Couette flow with viscosity eta exp(-soft (T - T_wall)) [Pa s, 1/K] between equally warm walls, slip [m/s]:
    T = T_wall + (2/soft) ln[cosh(a)/cosh(a (1 - 2z/h))], cosh(a)^2 = 1 + soft eta slip^2/(8 k). Nahme 1940.
    """
    n = t.size - 1
    nahme = soft * eta * slip * slip / conductivity
    a = np.arcsinh(np.sqrt(0.125 * nahme))
    for k in range(n + 1):
        z = k / n
        t[k] = t_a + (t_b - t_a) * z
        if soft > 0.0:
            t[k] += 2.0 / soft * np.log(np.cosh(a) / np.cosh(a * (1.0 - 2.0 * z)))
    if soft > 0.0:
        return 4.0 * conductivity * a * np.tanh(a) / (soft * h)
    return 0.5 * eta * slip * slip / h


@njit(cache=True, error_model="numpy")
def sheared_films(oil, p, h, conductivity, slip, t_a, t_b, t, q):
    """Every column sheared by itself between given walls (n_y, n_x) [K]; fills t and the flux into either wall q."""
    for j in range(p.shape[0]):
        for i in range(p.shape[1]):
            wall = 0.5 * (t_a[j, i] + t_b[j, i])
            factor, _ = pressure_factor(oil, p[j, i])
            ln_eta, slope, _ = ln_viscosity(oil, factor, wall)
            eta = np.exp(ln_eta)
            for _ in range(2):
                soft = max(-slope, 1e-9)
                q[j, i] = sheared_film(
                    conductivity, h[j, i], slip[j, i], eta, soft, t_a[j, i], t_b[j, i], t[j, i]
                )
                # the slope flattens with heat: take it where half the rise of the first guess has been reached
                middle = 0.5 * (wall + t[j, i, (t.shape[2] - 1) // 2])
                _, slope, _ = ln_viscosity(oil, factor, middle)


def update_walls(
    walls: tuple[LineConvolution, LineConvolution],
    t: Array,
    q_a: Array,
    q_b: Array,
    response: Array,
    t_in: float,
) -> int:
    """Set both wall temperatures of t [K] so that T = T0 + K q, with q linearised in both; returns GMRES iterations.

    Both walls at once: a thin film couples them more strongly than either is coupled to its own body.
    """
    shape = (2, *q_a.shape)
    wall_a, wall_b = walls
    missing = np.stack([t_in + wall_a(q_a) - t[:, :, 0], t_in + wall_b(q_b) - t[:, :, -1]])

    def apply(v: Array) -> Array:
        d_a, d_b = v.reshape(shape)
        return np.stack([
            d_a + wall_a.rough(response[:, :, 0] * d_a - response[:, :, 1] * d_b),
            d_b + wall_b.rough(response[:, :, 3] * d_b - response[:, :, 2] * d_a),
        ]).ravel()  # fmt: skip

    step, used, _ = gmres(apply, lambda v: v, missing.ravel(), WALL_TOLERANCE, MOST_WALL_STEPS)
    t[:, :, 0] += step.reshape(shape)[0]
    t[:, :, -1] += step.reshape(shape)[1]
    return used


class HeatBalance(NamedTuple):
    """Heat of the whole contact [W]: generated by shear and compression, into the walls, carried out by the oil."""

    generated: float
    conducted: float
    convected: float

    @property
    def defect(self) -> float:
        """Relative gap of the balance; vanishes with the iteration."""
        size = max(abs(self.generated), abs(self.conducted), abs(self.convected), TINY)
        return (self.generated - self.conducted - self.convected) / size


@njit(cache=True, error_model="numpy")
def _balance(x, width, h_y, mirror, t, t_in, flow, face, q_a, q_b):
    """Generated, conducted, convected heat [W] of the lines of the grid, each as wide as h_y."""
    nz = t.shape[2] - 1
    generated = conducted = convected = 0.0
    for j in range(0 if mirror else 1, t.shape[0] - 1):
        twice = 2.0 if mirror and j > 0 else 1.0
        for i in range(face.start[j], face.end[j]):
            area = width[i] * h_y * twice
            conducted += area * (q_a[j, i] + q_b[j, i])
            for k in range(nz + 1):
                w = area * (0.5 if k == 0 or k == nz else 1.0) / nz
                rise = t[j, i, k] - t_in
                generated += w * (flow.shear[j, i, k] + flow.compression[j, i, k] * t[j, i, k])
                diag, rest = sideways(x, width, h_y, mirror, t, t_in, face, j, i, k)
                out = (face.x[j, i, k] - face.x[j, i - 1, k]) / width[i]
                if mirror and j == 0:
                    out += 2.0 * face.y[0, i, k] / h_y
                else:
                    out += (face.y[j, i, k] - face.y[j - 1, i, k]) / h_y
                convected += w * (diag * t[j, i, k] - rest + out * rise)
    return generated, conducted, convected


def heat_balance(
    x: Array, width: Array, h_y: float, mirror: bool, flow: FilmFlow, face: FaceFlow, t: Array, t_in: float,
    q_a: Array, q_b: Array,
) -> HeatBalance:  # fmt: skip
    """Balance over the cells where the energy equation is solved: what leaves through the sides of all of them."""
    return HeatBalance(*_balance(x, width, h_y, mirror, t, t_in, flow, face, q_a, q_b))
