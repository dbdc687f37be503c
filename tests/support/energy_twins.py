"""Plain NumPy twins of the energy kernels: whole arrays and dense matrices instead of point loops.

Written from the equations in the kernels' docstrings; they share no code with them. Slow, for small grids only.
"""

import numpy as np


def layers(n_z):
    """Share of every level in the film (trapezoidal)."""
    out = np.full(n_z + 1, 1.0 / n_z)
    out[[0, -1]] *= 0.5
    return out


def _mirrored(face_y, mirror):
    """Flow across through the faces below (j) and above (j+1) every line; none known below an edge."""
    return np.concatenate([-face_y[:1] if mirror else 0.0 * face_y[:1], face_y])


def face_flow(width, h_y, mirror, heat, p, flux_x, flux_y, m_x, m_y, start, end):
    """Twin of energy.face_flow: x, y, z, reverse; zero where the kernel computes nothing."""
    ny, nx, levels = m_x.shape
    share = layers(levels - 1)
    mean = 0.5 * (m_y[1:] + m_y[:-1])
    y = heat * (mean + (flux_y - mean @ share)[..., None])
    sides = np.diff(_mirrored(flux_y[..., None], mirror)[..., 0], axis=0)
    out_y = np.diff(_mirrored(y, mirror), axis=0)
    x, z, reverse = np.zeros((ny, nx - 1, levels)), np.zeros((ny, nx, levels - 1)), np.zeros(ny, dtype=int)
    for j in range(0 if mirror else 1, ny - 1):
        faces, cells = np.arange(start[j] - 1, end[j]), np.arange(start[j], end[j])
        # what leaves to the sides before every face, counted from the one behind the largest pressure
        lost = np.concatenate([[0.0], np.cumsum((width * sides[j] / h_y)[1:-1])])
        peak = 1 + np.argmax(p[j, 1:-1])
        passing = (flux_x[j, peak] + lost[peak] - lost)[faces]
        profile = 0.5 * (m_x[j, faces] + m_x[j, faces + 1])
        total = profile @ share
        ruptured = (passing > 0.0) & (passing < total)
        full, shrunk = profile + (passing - total)[:, None], profile * (passing / total)[:, None]
        m = np.where(ruptured[:, None], shrunk, full)
        x[j, faces] = heat * m
        back = faces[(m < 0.0).any(axis=1)]
        reverse[j] = back[-1] + 1 if back.size else 0
        out = (x[j, cells] - x[j, cells - 1]) / width[cells, None] + out_y[j, cells] / h_y
        z[j, cells] = -np.cumsum(out * share, axis=1)[:, :-1]
    return x, y, z, reverse


def side_heat(x, width, h_y, mirror, t, t_in, face, j, i, own):
    """Heat [W/m2] that the side faces of all levels of a column bring in if its temperatures were `own`.

    Sum of inflow times (temperature of the face - own). A face has the temperature upstream of it; of second order
    where the oil has passed two columns forward, with a share of the slope where it swells to more than four times the
    flow of the face before. Across, outflow by what was known, and slopes at most those to the cell downstream.
    """
    ny = t.shape[0]

    def along(i):
        """Temperature of the face between the columns i and i+1, the column i_own at `own`."""
        column = {m: own if m == i_own else t[j, m] for m in (i - 1, i, i + 1) if m >= 0}
        forward = column[i]
        if i >= 1:
            slope = (column[i] - column[i - 1]) / (x[i] - x[i - 1])
            with np.errstate(divide="ignore", invalid="ignore"):
                known = np.clip(4.0 * face.x[j, i - 1] / face.x[j, i], 0.0, 1.0)
            forward = forward + known * 0.5 * (x[i + 1] - x[i]) * slope
        return np.where(face.x[j, i] > 0.0, forward, column[i + 1])

    i_own = i
    west, east = face.x[j, i - 1] / width[i], face.x[j, i] / width[i]
    out = west * (along(i - 1) - own) - east * (along(i) - own)
    flow = _mirrored(face.y, mirror)
    for inflow, step in ((flow[j, i] / h_y, -1), (-flow[j + 1, i] / h_y, 1)):
        near, far, behind = (abs(j + m * step) for m in (1, 2, -1))
        edge = near == ny - 1 or (near == 0 and not mirror)
        from_there = (
            t_in if edge else t[near, i] + 0.5 * smaller(t[near, i] - t[far, i], t[j, i] - t[near, i])
        )
        left = smaller(t[j, i] - t[behind, i], t[near, i] - t[j, i])
        out = out + np.where(inflow > 0.0, inflow * (from_there - own), 0.5 * inflow * left)
    return out


def smaller(one, other):
    """The smaller of two differences, none if their signs differ."""
    return 0.5 * (np.sign(one) + np.sign(other)) * np.minimum(np.abs(one), np.abs(other))


def sweep(
    x, width, h_y, mirror, h, conductivity, t_in, flow, face, t_at, damped, forward, whole, t, limit=30.0
):
    """Twin of energy.sweep: columns in turn, each a dense linear system for all its temperatures, walls given.

    Returns a dict: t, q_a, q_b, response, change; of HeatTransport up_1, up_2, source, squeeze, lift, widen; and
    `answer` (n_y, n_x, n_z-1, n_z-1): the temperatures that one unit of heat at every level leaves in a column.
    Columns that are not visited keep zero.
    """
    t = t.copy()
    n_y, n_x, n_z = *h.shape, t.shape[2] - 1
    dz, inner = 1.0 / n_z, slice(1, n_z)
    q, response = np.zeros((2, n_y, n_x)), np.zeros((n_y, n_x, 4))
    factors = {
        name: np.zeros((n_y, n_x, n_z - 1)) for name in ("up_1", "up_2", "source", "squeeze", "lift", "widen")
    }
    answer = np.zeros((n_y, n_x, n_z - 1, n_z - 1))
    change = 0.0
    for j in range(0 if mirror else 1, n_y - 1):
        columns = np.arange(face.start[j], face.end[j])
        if not (forward and whole):
            columns = columns[columns <= face.reverse[j]]
        for i in columns if forward else columns[::-1]:
            lam = conductivity / (h[j, i] * dz)
            peclet = face.z[j, i] / lam
            up, down = lam * peclet / -np.expm1(-peclet), lam * peclet / np.expm1(peclet)
            soft, stiff, rate = flow.soft[j, i], flow.stiff[j, i], flow.rate[j, i]
            # at the same stress thicker oil is sheared less; damped: hotter oil gives less heat, at unchanged stress
            sliding = flow.sliding[j, i]
            growth = -np.abs(sliding) * soft if damped else sliding * soft
            by_stress = rate + rate / flow.stress_share[j, i]
            # change of the stress by one unit of ln(viscosity) of every level, at the same sliding
            fluid = flow.fluidity[j, i]
            stress = layers(n_z) * rate / fluid if fluid > 0.0 and not damped else np.zeros(n_z + 1)

            def column_heat(own, j=j, i=i, up=up, down=down, growth=growth, gain_by=by_stress, stress=stress):
                """Heat of all levels [W/m2] times their share of the film, at temperatures `own`."""
                rising = up * own[:-1] - down * own[1:]
                # oil that flows upwards has the temperature of its cell, the reference of the heat
                lift = face.z[j, i]
                gain = np.zeros(n_z + 1)
                gain[1:] += rising - lift * own[1:]
                gain[:-1] -= rising - lift * own[:-1]
                warmer = own - t_at[j, i]
                c = flow.compression[j, i]
                heated = flow.shear[j, i] + growth * warmer - gain_by * (stress @ (flow.soft[j, i] * warmer))
                heated += np.maximum(c, 0.0) * t[j, i] + np.minimum(c, 0.0) * own
                sides = side_heat(x, width, h_y, mirror, t, t_in, face, j, i, own)
                return gain + layers(n_z) * (heated + sides)

            zero = column_heat(np.zeros(n_z + 1))
            matrix = np.stack([column_heat(unit) - zero for unit in np.eye(n_z + 1)], axis=1)
            walls = matrix[inner][:, [0, -1]]
            solve = np.linalg.inv(-matrix[inner, inner])
            before = t[j, i].copy()
            new = solve @ (zero[inner] + walls @ t[j, i, [0, -1]])
            answer[j, i] = dz * solve
            for m in (1, 2):
                if i >= m:
                    unit = np.zeros_like(t)
                    unit[j, i - m] = 1.0
                    by_up = side_heat(x, width, h_y, mirror, unit, 0.0, face, j, i, np.zeros(n_z + 1))
                    factors[f"up_{m}"][j, i] = by_up[inner]
            squeezed = flow.squeeze[j, i] * before
            factors["squeeze"][j, i] = squeezed[inner]
            # more pressure: thicker oil is sheared less, by a stress that rises everywhere
            factors["source"][j, i] = (squeezed - sliding * stiff + by_stress * (stress @ stiff))[inner]
            factors["lift"][j, i] = flow.driven[j, i, inner]
            # a wider gap: less conduction; more oil sheared, at a stress that falls with the rate of the same sliding
            slid = rate.sum() - 0.5 * (rate[0] + rate[-1])
            eased = 0.0 if damped else slid * dz / fluid
            bent = lam / dz * np.diff(before, 2)
            factors["widen"][j, i] = (-bent + (sliding - by_stress * eased)[inner]) / h[j, i]
            by_walls = solve @ walls
            delta = new - t[j, i, inner]
            change = np.maximum(change, np.abs(delta).max())
            t[j, i, inner] += np.clip(delta, -limit, limit)
            # half cells at the walls: no linearisation; only the effect of the wall itself
            own = t[j, i]
            sides = side_heat(x, width, h_y, mirror, t, t_in, face, j, i, own)
            still = side_heat(x, width, h_y, mirror, t, t_in, face, j, i, own + 1.0)
            source = flow.shear[j, i] + flow.compression[j, i] * own + sides
            for side, (level, next_, b) in enumerate(((0, 1, down[0]), (n_z, n_z - 1, up[-1]))):
                q[side, j, i] = b * (own[next_] - own[level]) + 0.5 * dz * source[level]
                response[j, i, 3 * side] = (
                    b * (1.0 - by_walls[next_ - 1, side]) + 0.5 * dz * (sides - still)[level]
                )
                response[j, i, 1 + side] = b * by_walls[next_ - 1, 1 - side]
    found = {"t": t, "q_a": q[0], "q_b": q[1], "response": response, "change": change, "answer": answer}
    return found | factors


def column_answer(heat, j, i):
    """What the factors of a column make of one unit of heat at every level: the matrix that `sweep` gives densely."""
    n = heat.lower.shape[2]
    lower, upper = np.eye(n), np.diag(1.0 / heat.pivot[j, i])
    lower[np.arange(1, n), np.arange(n - 1)] = heat.lower[j, i, 1:]
    upper[np.arange(n - 1), np.arange(1, n)] = heat.upper[j, i, :-1]
    held = np.linalg.inv(lower @ upper)
    return held - np.outer(heat.stress[j, i], heat.weight[j, i] @ held)
