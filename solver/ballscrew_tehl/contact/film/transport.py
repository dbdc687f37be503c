"""Temperature that follows the pressure: what changes of pressure heat or cool, carried along the lines of the contact.

The energy equation of a line, linearised at its last solution with the surfaces, the flow and the neighbour lines held,
is marched downstream: a column answers to its own pressure, to those upstream and to the two columns upstream.
"""

from typing import NamedTuple, Self

import numpy as np

from ...compiled import kernel
from ..grid import Array


class HeatTransport(NamedTuple):
    """Factors of the columns of the energy equation, (n_y, n_x, n_z-1) unless said.

    up_1, up_2: weights of the temperatures one and two columns upstream [W/(m2 K)]; source: heat by the pressure of
    the node, squeeze: by the difference of compression [W/(m2 Pa)]; back_1, back_2 (n_x,): weights of the pressures
    upstream in that difference; lift: share of the power of the pressure flow, widen: heat by the gap [W/m3]; pull
    (n_y, n_x, 2), push (n_y, n_x, 4): power by the pressure drops before and behind and by the wedge fluxes at
    nodes i-2 to i+1, which pressure must carry [W/m2]; wedge_h (n_y, n_x): wedge flux by g; lower, upper, pivot:
    factors of the column, pivot inverted; weight: how temperatures change the stress, stress: how the stress
    changes the temperatures.
    """

    up_1: Array
    up_2: Array
    source: Array
    squeeze: Array
    back_1: Array
    back_2: Array
    lift: Array
    widen: Array
    pull: Array
    push: Array
    wedge_h: Array
    lower: Array
    upper: Array
    pivot: Array
    weight: Array
    stress: Array

    @classmethod
    def empty(cls, ny: int, x: Array, nz: int) -> Self:
        """Without any transport, on nodes x (n_x,) [m]."""
        nx = x.size
        back_1, back_2 = np.zeros((2, nx))
        if nz > 1:
            d_1, d_2 = x[2:] - x[1:-1], x[2:] - x[:-2]
            own = 1.0 / d_1 + 1.0 / d_2
            back_1[2:] = -d_2 / (d_1 * (d_2 - d_1)) / own
            back_2[2:] = d_1 / (d_2 * (d_2 - d_1)) / own
        up_1, up_2, source, squeeze, lift, widen, *factors = np.zeros((11, ny, nx, nz - 1))
        nodes = np.zeros((ny, nx, 2)), np.zeros((ny, nx, 4)), np.zeros((ny, nx))
        return cls(up_1, up_2, source, squeeze, back_1, back_2, lift, widen, *nodes, *factors)


@kernel
def follow(heat, g, dg, by_t, unit, unit_h, dp, dh, dt):
    """Fill temperature changes dt [K] by those of pressure dp [unit] and gap dh [unit_h]; g, dg, by_t: of the film."""
    ny, nx = dp.shape
    n = dt.shape[2] - 2
    dt[:, :, :] = 0.0
    for j in range(ny):
        wedge_1 = wedge_2 = 0.0
        for i in range(1, nx - 1):
            change = unit * heat.back_1[i] * dp[j, i - 1]
            if i > 1:
                change += unit * heat.back_2[i] * dp[j, i - 2]
            own = heat.wedge_h[j, i] * dg[j, i] * dp[j, i] + g[j, i] * dh[j, i]
            ahead = heat.wedge_h[j, i + 1] * dg[j, i + 1] * dp[j, i + 1] + g[j, i + 1] * dh[j, i + 1]
            push = heat.push[j, i, 0] * wedge_2 + heat.push[j, i, 1] * wedge_1
            push += heat.push[j, i, 2] * own + heat.push[j, i, 3] * ahead
            push += heat.pull[j, i, 0] * (dp[j, i] - dp[j, i - 1]) + heat.pull[j, i, 1] * (
                dp[j, i + 1] - dp[j, i]
            )
            x = 0.0
            for r in range(n):
                b = unit * heat.source[j, i, r] * dp[j, i] + heat.squeeze[j, i, r] * change
                b += heat.lift[j, i, r] * push + unit_h * heat.widen[j, i, r] * dh[j, i]
                b += heat.up_1[j, i, r] * dt[j, i - 1, r + 1]
                if i > 1:
                    b += heat.up_2[j, i, r] * dt[j, i - 2, r + 1]
                x = b - heat.lower[j, i, r] * x
                dt[j, i, r + 1] = x
            x = 0.0
            top = 0.0
            for r in range(n - 1, -1, -1):
                x = (dt[j, i, r + 1] - heat.upper[j, i, r] * x) * heat.pivot[j, i, r]
                dt[j, i, r + 1] = x
                top += heat.weight[j, i, r] * x
            wedge_2, wedge_1 = wedge_1, own
            for r in range(n):
                dt[j, i, r + 1] -= top * heat.stress[j, i, r]
                wedge_1 += heat.wedge_h[j, i] * by_t[j, i, 1, r + 1] * dt[j, i, r + 1]


@kernel
def line_response(heat, j, g, dg, by_t, unit, unit_h, same_line, far_phi, far_g):
    """Fill far_phi, far_g (n_x, n_x): changes of ln phi and g of line j with its pressures; same_line: of its gap."""
    nx = far_phi.shape[0]
    n = heat.up_1.shape[2]
    far_phi[:, :] = 0.0
    far_g[:, :] = 0.0
    columns = np.zeros((5 + 3 * n, nx))
    push, top = columns[0], columns[1]
    wedges = columns[2:5]
    for i in range(1, nx - 1):
        now = columns[5 + n * (i % 3) :]
        last, before = columns[5 + n * ((i + 2) % 3) :], columns[5 + n * ((i + 1) % 3) :]
        wedge, wedge_1, wedge_2 = wedges[i % 3], wedges[(i + 2) % 3], wedges[(i + 1) % 3]
        p_2, p_1, p_0, p_a = heat.push[j, i, 0], heat.push[j, i, 1], heat.push[j, i, 2], heat.push[j, i, 3]
        g_0, g_a = g[j, i], g[j, i + 1]
        for k in range(nx):
            wedge[k] = g_0 * same_line[i, k]
            push[k] = p_2 * wedge_2[k] + p_1 * wedge_1[k] + p_0 * wedge[k] + p_a * g_a * same_line[i + 1, k]
        own = heat.wedge_h[j, i] * dg[j, i]
        wedge[i] += own
        push[i - 1] -= heat.pull[j, i, 0]
        push[i] += p_0 * own + heat.pull[j, i, 0] - heat.pull[j, i, 1]
        push[i + 1] += heat.pull[j, i, 1] + p_a * heat.wedge_h[j, i + 1] * dg[j, i + 1]
        for r in range(n):
            a, b, f = heat.up_1[j, i, r], heat.up_2[j, i, r], heat.lower[j, i, r]
            lift, widen = heat.lift[j, i, r], unit_h * heat.widen[j, i, r]
            for k in range(nx):
                now[r, k] = a * last[r, k] + b * before[r, k] + lift * push[k] + widen * same_line[i, k]
            now[r, i] += unit * heat.source[j, i, r]
            now[r, i - 1] += unit * heat.squeeze[j, i, r] * heat.back_1[i]
            if i > 1:
                now[r, i - 2] += unit * heat.squeeze[j, i, r] * heat.back_2[i]
            if r > 0:
                for k in range(nx):
                    now[r, k] -= f * now[r - 1, k]
        top[:] = 0.0
        for r in range(n - 1, -1, -1):
            f, v = heat.pivot[j, i, r], heat.upper[j, i, r]
            w = heat.weight[j, i, r]
            if r == n - 1:
                for k in range(nx):
                    now[r, k] *= f
                    top[k] += w * now[r, k]
            else:
                for k in range(nx):
                    now[r, k] = (now[r, k] - v * now[r + 1, k]) * f
                    top[k] += w * now[r, k]
        for r in range(n):
            s, a, b = heat.stress[j, i, r], by_t[j, i, 0, r + 1], by_t[j, i, 1, r + 1]
            f = heat.wedge_h[j, i] * b
            for k in range(nx):
                now[r, k] -= s * top[k]
                far_phi[i, k] += a * now[r, k]
                far_g[i, k] += b * now[r, k]
                wedge[k] += f * now[r, k]
