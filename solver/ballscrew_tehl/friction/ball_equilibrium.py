"""Motion of a ball between its raceways, and the power that slip and spin cost: the minimum of a convex potential.

Each contact slides as its motion says (physics.kinematics), with Heathcote's parabola and spin over a Hertz-shaped
pressure; tau = (1-f) min(tau_0 asinh(eta v/(h tau_0)), Lambda p) + f mu_b p with the share f of the asperities is the
derivative of a convex potential with respect to the local slip v. So the forces and moments of the contacts on the ball
vanish where the integral of the potential over all contacts is least. The motion there is unique.
Where oil or asperities stick, the potential has a kink: v is smoothed over 1e-6 of the entrainment speed, which moves
the power by less than 2e-6 of it (1000 random balls; the smoothing a hundredth). Newton's method, all side by side.

Assumption: no other force on the ball. What drives it against rolling resistance, hysteresis and its neighbours is a
small part of what the contacts can transmit, its inertia less.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..numerics import Array
from ..physics.kinematics import ContactMotion, rolling_motion

#: nodes of the quadrature over the ellipse: Gauss along the radius, equal steps around
RADIAL, AROUND = 8, 16
#: slip [m/s] over the entrainment speed below which the shear stress is smoothed: first with the last one alone; where
#: that takes more than QUICK_STEPS, with all, each from the motion of the one before
SMOOTHED = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
QUICK_STEPS, MAX_STEPS = 12, 400
#: an iteration ends where a further step would lower the potential by less than this share of the power; that with a
#: wider smoothing by less than the second
CONVERGED_AT, CONVERGED_FIRST = 1e-10, 1e-4
ROUNDING = 1e-14  # or where a shortened one would by this share: rounding
#: slope of the potential at the end of a step over that at its begin, up to which it may rise again; else the step is
#: shortened by a factor between these
MAX_REVERSAL, SHORTENING = 0.5, (0.05, 0.7)
BLOCK = 96  # contacts at a time: what is known of their nodes stays within the cache
MIN_DAMPING = 1e-12  # relative addition to the diagonal of the system, which keeps it regular


class BallMotion(NamedTuple):
    """Equilibrium of n balls: power of each contact (n, c) [W], motion q (n, 4) [rad/s], its steps (n,)."""

    power: Array
    motion: Array
    steps: NDArray[np.int64]


class Traction(NamedTuple):
    """What the shear stress of the contacts follows from; the constants of each ball (n, 1) or of all."""

    viscosity: Array  # (n, c, RADIAL) [Pa s] at the radial nodes
    pressure: Array  # (n, c) largest [Pa]
    film: Array  # (n, c) [m]
    asperities: Array  # (n, c) their share of the load
    tau_0: Any  # [Pa]
    limiting: Any  # Lambda [1]
    boundary: Any  # mu_b [1]

    def take(self, rows: Any) -> "Traction":
        """That of some balls, with the same constants."""
        return self._replace(**{name: getattr(self, name)[rows] for name in self._fields[:4]})


class _Balls(NamedTuple):
    """Balls and what the stress at the RADIAL nodes of their contacts follows from, (n, c, RADIAL, 1)."""

    matrix: Array  # (n, c, 3, 4) slip and spin over the motion of the ball
    offset: Array  # (n, c, 3) slip and spin without motion of the ball
    differential: Array  # (n, c)
    axes: Array  # (n, c, 2) semi-axes across and along rolling
    stiffness: Array  # viscosity/(film tau_0)
    slipping: Array  # stiffness times slip at which the oil slips
    oil: Array  # tau_0 of the share on oil (n, c, 1, 1)
    dry: Array  # stress of the asperities times their share

    def take(self, rows: Any) -> "_Balls":
        return _Balls(*(one[rows] for one in self))


def radial_nodes() -> tuple[Array, Array]:
    """Radius of the nodes over the semi-axes, and weights with which the sum around is the mean over the ellipse."""
    x, w = np.polynomial.legendre.leggauss(RADIAL)
    r = 0.5 * (x + 1.0)
    return r, w * r / AROUND


_AROUND = 2.0 * math.pi * (np.arange(AROUND) + 0.5) / AROUND
#: places of all nodes along and across rolling in the unit circle, and their weights (RADIAL * AROUND,)
_X, _Y = (np.outer(radial_nodes()[0], of(_AROUND)).ravel() for of in (np.cos, np.sin))
_W = np.repeat(radial_nodes()[1], AROUND)
#: slips over their coefficients, and sums over nodes with what the moments take
_SLIP_X, _SLIP_Y = np.stack([np.ones_like(_Y), _Y, _Y**2]), np.stack([np.ones_like(_X), _X])
_WITH_Y, _WITH_X = (_W * _SLIP_X).T, (_W * np.stack([np.ones_like(_X), _X, _X**2])).T
_WITH_BOTH = (_W * np.stack([np.ones_like(_X), _X, _Y, _X * _Y])).T


def shear_stress(square: Any, stiffness: Any, slipping: Any, oil: Any, dry: Any) -> tuple[Any, Any]:
    """Shear stress over slip [Pa s/m] at slips with these squares, and the slope of the stress; other names as _Balls.

    The square [m2/s2] is with that of the smoothing, which keeps the potential convex.
    """
    root = np.sqrt(square)
    z = stiffness * root
    ends = np.minimum(z, slipping)
    one = np.sqrt(1.0 + ends * ends)
    # asinh: NumPy's takes three times as long; its series where the logarithm loses digits
    arc = np.where(ends < 1e-3, ends - ends**3 / 6.0, np.log(ends + one))
    return (oil * arc + dry) / root, np.where(z > ends, 0.0, oil * stiffness / one)


def _node_sums(along: Array, across: Array, smooth: Array, stress: tuple[Array, ...]) -> Array:
    """Sums over the nodes of contacts (m, 15), per area, that _sums takes.

    along (m, 3), across (m, 2): coefficients of _SLIP_X, _SLIP_Y; smooth (m, 1) [m/s]; stress: of _Balls (m, RADIAL, 1)
    """
    v_x, v_y = along @ _SLIP_X, across @ _SLIP_Y
    square = v_x * v_x + v_y * v_y
    smoothed = square + smooth * smooth
    ratio, slope = (
        part.reshape(square.shape) for part in shear_stress(smoothed.reshape(-1, RADIAL, AROUND), *stress)
    )
    bend = (slope - ratio) / smoothed
    bend_x = bend * v_x
    return np.concatenate([
        (ratio * square) @ _W[:, None], (ratio * v_x) @ _WITH_Y[:, :2], (ratio * v_y) @ _WITH_X[:, :2],
        (ratio + bend_x * v_x) @ _WITH_Y, (bend_x * v_y) @ _WITH_BOTH, (ratio + bend * v_y * v_y) @ _WITH_X,
    ], axis=1)  # fmt: skip


def _sums(balls: _Balls, q: Array, smooth: Array) -> tuple[Array, Array, Array]:
    """Gradient of the potential (n, 4), its Hessian (n, 4, 4) and power of each contact (n, c) [W]."""
    matrix, (a, b) = balls.matrix, np.moveaxis(balls.axes, -1, 0)
    at = balls.offset + (matrix @ q[:, None, :, None])[..., 0]
    slip_x, slip_y, spin = np.moveaxis(at, -1, 0)
    along = np.stack([slip_x, -spin * a, balls.differential * a * a], axis=-1).reshape(-1, 3)
    across = np.stack([slip_y, spin * b], axis=-1).reshape(-1, 2)
    of_contact = np.repeat(smooth, a.shape[1])[:, None]
    stress = [part.reshape(-1, *part.shape[2:]) for part in balls[4:]]
    sums = np.concatenate([
        _node_sums(along[rows], across[rows], of_contact[rows], tuple(part[rows] for part in stress))
        for rows in (slice(i, i + BLOCK) for i in range(0, len(along), BLOCK))
    ])  # fmt: skip
    area = math.pi * a * b
    power, f_x, f_x_y, f_y, f_y_x, xx, xx_y, xx_yy, xy, xy_x, xy_y, xy_xy, yy, yy_x, yy_xx = (
        area * column.reshape(a.shape) for column in sums.T
    )
    forces = np.stack([f_x, f_y, b * f_y_x - a * f_x_y], axis=-1)
    xt, yt = b * xy_x - a * xx_y, b * yy_x - a * xy_y
    tt = b * b * yy_xx - 2.0 * a * b * xy_xy + a * a * xx_yy
    stiff = np.stack([xx, xy, xt, xy, yy, yt, xt, yt, tt], axis=-1).reshape(*xx.shape, 3, 3)
    turned = np.swapaxes(matrix, -1, -2)
    gradient = (turned @ forces[..., None])[..., 0].sum(axis=1)
    return gradient, (turned @ stiff @ matrix).sum(axis=1), power


def _minimise(
    balls: _Balls, q: Array, smooth: Array, tolerance: float, max_steps: int
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Newton's method with shortened steps from motions q (n, 4): motion, power, steps, max_steps where not found.

    Where all of a contact is at its limit the potential is nearly flat along the slip, and a full step goes far beyond
    the least: the step is shortened. Its direction is kept: it does not depend on the coordinates of the motion.
    The power stands for the potential, which is between half and all of it.
    """
    q = q.copy()
    state: tuple[Array, ...] = _sums(balls, q, smooth)
    power, steps = state[2].copy(), np.full(len(q), max_steps)
    rows = np.arange(len(q))
    diagonal = np.arange(4)
    for step in range(max_steps):
        gradient, hessian, total = state[0], state[1], state[2].sum(axis=1)
        good = np.isfinite(gradient).all(axis=1) & np.isfinite(hessian).all(axis=(1, 2))
        hessian[:, diagonal, diagonal] *= 1.0 + MIN_DAMPING
        change = np.zeros_like(gradient)
        change[good] = np.linalg.solve(hessian[good], gradient[good, :, None])[..., 0]
        decrement = (gradient * change).sum(axis=1)
        done = good & ~(decrement > tolerance * total)
        steps[rows[done]] = step
        here = np.flatnonzero(good & ~done)
        length, own = np.ones(len(here)), balls if len(here) == len(rows) else balls.take(here)
        reached = [part[here] for part in state]
        moved = q[rows[here]]
        pending = np.arange(len(here))
        stuck = np.zeros(len(here), dtype=bool)
        while pending.size:
            at = here[pending]
            new = q[rows[at]] - length[pending, None] * change[at]
            other = _sums(own if pending.size == len(here) else own.take(pending), new, smooth[at])
            # how the potential still falls along the step: beyond its least where this is negative
            slope = (other[0] * change[at]).sum(axis=1)
            better = slope >= -MAX_REVERSAL * decrement[at]
            took = pending[better]
            moved[took] = new[better]
            for part, result in zip(reached, other, strict=True):
                part[took] = result[better]
            # secant of the slope
            fraction = np.where(slope < 0.0, decrement[at] / (decrement[at] - slope), SHORTENING[1])
            length[pending] *= np.where(better, 1.0, np.clip(fraction, *SHORTENING))
            ended = ~better & ~(length[pending] * decrement[at] > ROUNDING * total[at])
            stuck[pending[ended]] = True
            pending = pending[~better & ~ended]
        steps[rows[here[stuck]]] = step
        on = ~stuck
        rows = rows[here[on]]
        q[rows], power[rows] = moved[on], reached[2][on]
        balls = own if on.all() else own.take(on)
        smooth, state = smooth[here[on]], tuple(part[on] for part in reached)
        if not rows.size:
            break
    return q, power, steps


def _balls(motion: ContactMotion, speed: Array, axes: Array, traction: Traction) -> _Balls:
    tau_0, limiting, boundary = (np.asarray(constant)[..., None, None] for constant in traction[4:])
    p = (traction.pressure[..., None] * np.sqrt(1.0 - radial_nodes()[0] ** 2))[..., None]
    asperities = traction.asperities[..., None, None]
    return _Balls(
        np.broadcast_to(motion.matrix, (*traction.pressure.shape, 3, 4)),
        motion.offset * speed[:, None, None],
        motion.differential * speed[:, None],
        axes,
        traction.viscosity[..., None] / (traction.film[..., None, None] * tau_0),
        # beyond, sinh overflows
        np.sinh(np.minimum(limiting * p / tau_0, 300.0)),
        (1.0 - asperities) * tau_0,
        asperities * boundary * p,
    )


def ball_equilibrium(
    motion: ContactMotion, speed: Array, axes: Array, traction: Traction, near: Array | None = None
) -> BallMotion:
    """Motion and power of balls at screw speeds (n,) [rad/s] > 0, with semi-axes across, along rolling (n, c, 2) [m].

    motion: of the c contacts, of all balls or of each; near: motions (n, 4) [rad/s] to begin with, None = those that
    slide least without traction
    """
    speed = np.asarray(speed, dtype=float)
    first = rolling_motion(motion) * speed[:, None]
    begin = first if near is None else near
    rolling = np.abs(speed * motion.matrix[..., 0, 0, 0])
    with np.errstate(all="ignore"):
        balls = _balls(motion, speed, axes, traction)
        q, power, steps = _minimise(balls, begin, SMOOTHED[-1] * rolling, CONVERGED_AT, QUICK_STEPS)
        left = np.flatnonzero(steps == QUICK_STEPS)
        if left.size:
            hard, begun = balls.take(left), first[left]
            for smooth in SMOOTHED:
                end = CONVERGED_AT if smooth == SMOOTHED[-1] else CONVERGED_FIRST
                begun, power[left], taken = _minimise(hard, begun, smooth * rolling[left], end, MAX_STEPS)
                steps[left] += taken
            q[left] = begun
            steps[left[taken == MAX_STEPS]] = -1
    known = (steps >= 0) & np.isfinite(power).all(axis=1)
    if not known.all():
        bad = int(np.argmin(known))
        raise ArithmeticError(
            f"equilibrium of a ball not found in {MAX_STEPS} steps: speed {speed[bad]:.6g} rad/s, pressure "
            f"{traction.pressure[bad].max():.4g} Pa, film {traction.film[bad].min():.4g} m"
        )
    return BallMotion(power, q, steps)
