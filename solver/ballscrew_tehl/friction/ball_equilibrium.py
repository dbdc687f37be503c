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
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..numerics import Array
from ..physics.kinematics import ContactMotion, rolling_motion

#: nodes of the quadrature over the ellipse: Gauss along the radius, equal steps around
RADIAL, AROUND = 8, 16
#: slip [m/s] over the entrainment speed below which the shear stress is smoothed: first with the last one alone; where
#: that takes more than QUICK_STEPS and PATIENT_STEPS, with all, each from the motion of the one before
SMOOTHED = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
QUICK_STEPS, PATIENT_STEPS, MAX_STEPS = 10, 60, 400
#: an iteration ends where a further step would lower the potential by less than this share of the power; that with a
#: wider smoothing by less than the second
CONVERGED_AT, CONVERGED_FIRST = 1e-10, 1e-4
ROUNDING = 1e-14  # or where a shortened one would by this share: rounding
#: slope of the potential at the end of a step over that at its begin, up to which it may rise again; else the step is
#: shortened by a factor between these
MAX_REVERSAL, SHORTENING = 0.5, (0.05, 0.7)
BLOCK = 64  # contacts at a time: what is known of their nodes stays within the cache
#: what comes of a ball after a step: another one, its motion is found, or it has none
GOES_ON, DONE, LOST = range(3)
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
    """Balls and what the stress at the nodes of their contacts follows from, (n, c, nodes)."""

    matrix: Array  # (n, 3 c, 4) slip and spin of the contacts over the motion of the ball
    offset: Array  # (n, 3 c) slip and spin without motion of the ball
    shape: Array  # (n, c, 3) semi-axes across and along rolling, differential slip at the end of that across
    scales: Array  # (n, c, 15) of the sums over nodes: area, with lever arms
    stiffness: Array  # viscosity/(film tau_0)
    slipping: Array  # stiffness times slip at which the oil slips
    oil: Array  # tau_0 of the share on oil (n, c, 1)
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
#: of the sums f_x, f_x Y, f_x YY, f_y, f_y X, xx, xx Y, xx YY, xy, xy X, xy Y, xy XY, yy, yy X, yy XX: powers of the
#: semi-axes across (Y) and along rolling (X) with which they enter, and what they add to force and moment of a contact
#: (3) and to their slopes (3, 3)
_LEVERS = np.array(
    [(0, 1, 2, 0, 0, 0, 1, 2, 0, 0, 1, 1, 0, 0, 0), (0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 1, 2)]
)
_ADDED = np.zeros((15, 12))
for _sum, _to, _factor in (
    (0, (0,), 1), (3, (1,), 1), (4, (2,), 1), (1, (2,), -1),
    (5, (3,), 1), (8, (4, 6), 1), (12, (7,), 1), (9, (5, 9), 1), (6, (5, 9), -1), (13, (8, 10), 1), (10, (8, 10), -1),
    (14, (11,), 1), (11, (11,), -2), (7, (11,), 1),
):  # fmt: skip
    _ADDED[_sum, list(_to)] = _factor


def _shear_stress(smoothed: Array, stress: Sequence[Array], ratio: Array, slope: Array, work: Array) -> None:
    """Shear stress over slip [Pa s/m] at slips with these squares, and its slope; stress: of _Balls.

    The square [m2/s2] is with that of the smoothing, which keeps the potential convex. smoothed, ratio, slope: (m,
    nodes); work: (4, m, nodes).
    """
    stiffness, slipping, oil, dry = stress
    root, z, ends, one = work
    np.sqrt(smoothed, out=root)
    np.multiply(stiffness, root, out=z)
    np.minimum(z, slipping, out=ends)
    np.multiply(ends, ends, out=ratio)
    np.add(ratio, 1.0, out=one)
    np.sqrt(one, out=one)
    # asinh: NumPy's takes three times as long; its series where the logarithm loses digits
    few = ends < 1e-3
    series = ends[few] * (1.0 - ratio[few] / 6.0)
    np.add(ends, one, out=ratio)
    np.log(ratio, out=ratio)
    ratio[few] = series
    ratio *= oil
    ratio += dry
    ratio /= root
    np.multiply(oil, stiffness, out=slope)
    slope /= one
    slope *= z <= slipping


def _node_sums(along: Array, across: Array, smooth: Array, stress: Sequence[Array], work: Array) -> Array:
    """Sums over the nodes of contacts (m, 15), per area, in the order of _LEVERS.

    along (m, 3), across (m, 2): coefficients of _SLIP_X, _SLIP_Y; smooth (m, 1) [m/s]; stress: of _Balls (m, nodes);
    work (9, m, nodes)
    """
    v_x, v_y, smoothed, ratio, bend, *_ = work
    bend_x, bend_y, product = work[5:8]
    np.matmul(along, _SLIP_X, out=v_x)
    np.matmul(across, _SLIP_Y, out=v_y)
    np.multiply(v_x, v_x, out=smoothed)
    smoothed += np.multiply(v_y, v_y, out=bend)
    smoothed += smooth * smooth
    _shear_stress(smoothed, stress, ratio, bend, work[5:])
    bend -= ratio
    bend /= smoothed
    result = np.empty((len(along), 15))
    result[:, :3] = np.multiply(ratio, v_x, out=product) @ _WITH_Y
    result[:, 3:5] = np.multiply(ratio, v_y, out=product) @ _WITH_X[:, :2]
    np.multiply(bend, v_x, out=bend_x)
    np.multiply(bend, v_y, out=bend_y)
    result[:, 8:12] = np.multiply(bend_x, v_y, out=product) @ _WITH_BOTH
    bend_x *= v_x
    bend_y *= v_y
    bend_x += ratio
    bend_y += ratio
    result[:, 5:8], result[:, 12:] = bend_x @ _WITH_Y, bend_y @ _WITH_X
    return result


def _sums(balls: _Balls, q: Array, smooth: Array, work: Array) -> tuple[Array, Array, Array]:
    """Gradient of the potential (n, 4), its Hessian (n, 4, 4) and power of each contact (n, c) [W]."""
    matrix, (n, c, _) = balls.matrix, balls.shape.shape
    at = (balls.offset + (matrix @ q[:, :, None])[..., 0]).reshape(-1, 3)
    a, b, differential = balls.shape.reshape(-1, 3).T
    along = np.stack([at[:, 0], -at[:, 2] * a, differential], axis=-1)
    across = np.stack([at[:, 1], at[:, 2] * b], axis=-1)
    of_contact = np.repeat(smooth, c)[:, None]
    stress = [part.reshape(-1, *part.shape[2:]) for part in balls[4:]]
    sums = np.empty((n * c, 15))
    for begin in range(0, n * c, BLOCK):
        rows = slice(begin, min(begin + BLOCK, n * c))
        own = [part[rows] for part in stress]
        sums[rows] = _node_sums(
            along[rows], across[rows], of_contact[rows], own, work[:, : rows.stop - begin]
        )
    power = (along * sums[:, :3]).sum(axis=1) + (across * sums[:, 3:5]).sum(axis=1)
    scales = balls.scales.reshape(-1, 15)
    added = (scales * sums) @ _ADDED
    stiff = added[:, 3:].reshape(n, c, 3, 3) @ matrix.reshape(n, c, 3, 4)
    turned = np.swapaxes(matrix, -1, -2)
    gradient = (turned @ added[:, :3].reshape(n, 3 * c, 1))[..., 0]
    return gradient, turned @ stiff.reshape(matrix.shape), (scales[:, 0] * power).reshape(n, c)


def _minimise(
    balls: _Balls, q: Array, smooth: Array, tolerance: float, max_steps: int, work: Array
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Newton's method with shortened steps from motions q (n, 4): motion, power, steps, max_steps where not found.

    Where all of a contact is at its limit the potential is nearly flat along the slip, and a full step goes far beyond
    the least: the step is shortened. Its direction is kept: it does not depend on the coordinates of the motion.
    The power stands for the potential, which is between half and all of it. All balls side by side, each at its step.
    """
    q, steps, taken = q.copy(), np.full(len(q), max_steps), np.zeros(len(q), dtype=int)
    gradient, hessian, each = _sums(balls, q, smooth, work)
    power = each.copy()
    change, decrement, on = _newton_step(gradient, hessian, each, tolerance)
    steps[on == DONE] = 0
    rows, length, total = np.arange(len(q)), np.ones(len(q)), each.sum(axis=1)
    keep = on == GOES_ON
    while True:
        if not keep.all():
            balls = balls.take(keep)
            rows, smooth, change, decrement, length, total = (
                of[keep] for of in (rows, smooth, change, decrement, length, total)
            )
        if not rows.size:
            return q, power, steps
        new = q[rows] - length[:, None] * change
        gradient, hessian, each = _sums(balls, new, smooth, work)
        # how the potential still falls along the step: beyond its least where this is negative
        slope = (gradient * change).sum(axis=1)
        better = slope >= -MAX_REVERSAL * decrement
        # secant of the slope
        fraction = np.where(slope < 0.0, decrement / (decrement - slope), SHORTENING[1])
        length *= np.clip(fraction, *SHORTENING)
        keep = better | (length * decrement > ROUNDING * total)
        steps[rows[~keep]] = taken[rows[~keep]]
        moved = rows[better]
        q[moved], power[moved], length[better] = new[better], each[better], 1.0
        total[better] = each[better].sum(axis=1)
        taken[moved] += 1
        change[better], decrement[better], on = _newton_step(
            gradient[better], hessian[better], each[better], tolerance
        )
        on = np.where((on == GOES_ON) & (taken[moved] == max_steps), LOST, on)
        steps[moved[on == DONE]] = taken[moved[on == DONE]]
        keep[better] = on == GOES_ON


def _newton_step(
    gradient: Array, hessian: Array, power: Array, tolerance: float
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Step of Newton's method (n, 4), by how much the potential falls twice (n,), and what comes of each ball."""
    good = np.isfinite(gradient).all(axis=1) & np.isfinite(hessian).all(axis=(1, 2))
    change = np.zeros_like(gradient)
    hessian[:, range(4), range(4)] *= 1.0 + MIN_DAMPING
    change[good] = np.linalg.solve(hessian[good], gradient[good, :, None])[..., 0]
    decrement = (gradient * change).sum(axis=1)
    on = decrement > tolerance * power.sum(axis=1)
    return change, decrement, np.where(good, np.where(on, GOES_ON, DONE), LOST)


def _balls(motion: ContactMotion, speed: Array, axes: Array, traction: Traction) -> _Balls:
    tau_0, limiting, boundary = (np.asarray(constant)[..., None] for constant in traction[4:])
    p = traction.pressure[..., None] * np.sqrt(1.0 - radial_nodes()[0] ** 2)
    asperities = traction.asperities[..., None]
    (n, c), (a, b) = traction.pressure.shape, np.moveaxis(axes, -1, 0)
    differential = motion.differential * speed[:, None] * a * a
    return _Balls(
        np.broadcast_to(motion.matrix, (n, c, 3, 4)).reshape(n, 3 * c, 4),
        np.broadcast_to(motion.offset * speed[:, None, None], (n, c, 3)).reshape(n, 3 * c),
        np.stack([a, b, differential], axis=-1),
        math.pi * (a * b)[..., None] * a[..., None] ** _LEVERS[0] * b[..., None] ** _LEVERS[1],
        # of every node, as _node_sums takes them
        np.repeat(traction.viscosity / (traction.film[..., None] * tau_0), AROUND, axis=-1),
        # beyond, sinh overflows
        np.repeat(np.sinh(np.minimum(limiting * p / tau_0, 300.0)), AROUND, axis=-1),
        (1.0 - asperities) * tau_0,
        np.repeat(asperities * boundary * p, AROUND, axis=-1),
    )


def ball_equilibrium(motion: ContactMotion, speed: Array, axes: Array, traction: Traction) -> BallMotion:
    """Motion and power of balls at screw speeds (n,) [rad/s] > 0, with semi-axes across, along rolling (n, c, 2) [m].

    motion: of the c contacts, of all balls or of each. ArithmeticError: not found.
    """
    whole = ball_equilibria(motion, speed, axes[:, None], traction.take(np.s_[:, None]))
    return BallMotion(whole.power[:, 0], whole.motion[:, 0], whole.steps[:, 0])


def ball_equilibria(
    motion: ContactMotion,
    speed: Array,
    axes: Array,
    traction: Traction,
    at_state: Callable[[], None] = lambda: None,
) -> BallMotion:
    """As ball_equilibrium in m states in order, as of a rising temperature; all with a second dimension (n, m, ...).

    A ball begins from its motion in the states before, in the first from that which slides least without traction. What
    takes more than QUICK_STEPS is left, and found for all states together. at_state: called before each.
    """
    speed, states = np.asarray(speed, dtype=float), axes.shape[1]
    first = rolling_motion(motion) * speed[:, None]
    rolling = np.abs(speed * motion.matrix[..., 0, 0, 0])
    q, power = np.empty((len(speed), states, 4)), np.empty(traction.pressure.shape)
    steps, slow = np.empty((len(speed), states), dtype=int), list[_Balls]()
    # once: memory that is taken anew takes longer than what is done in it
    work = np.empty((9, min(power.size, BLOCK), RADIAL * AROUND))
    with np.errstate(all="ignore"):
        begin = first
        for t in range(states):
            at_state()
            balls = _balls(motion, speed, axes[:, t], traction.take(np.s_[:, t]))
            found = _minimise(balls, begin, SMOOTHED[-1] * rolling, CONVERGED_AT, QUICK_STEPS, work)
            q[:, t], power[:, t], steps[:, t] = found
            slow.append(balls.take(steps[:, t] == QUICK_STEPS))
            begin = q[:, t] if t == 0 else 2.0 * q[:, t] - q[:, t - 1]
        state, ball = np.nonzero(steps.T == QUICK_STEPS)
        if ball.size:
            left, at = _Balls(*map(np.concatenate, zip(*slow, strict=True))), (ball, state)
            q[at], power[at], steps[at] = _minimise_slow(left, q[at], first[ball], rolling[ball], work)
    known = (steps >= 0) & np.isfinite(power).all(axis=-1)
    if not known.all():
        bad = np.unravel_index(int(np.argmin(known)), known.shape)
        raise ArithmeticError(
            f"equilibrium of a ball not found in {MAX_STEPS} steps: speed {speed[bad[0]]:.6g} rad/s, pressure "
            f"{traction.pressure[bad].max():.4g} Pa, film {traction.film[bad].min():.4g} m"
        )
    return BallMotion(power, q, steps)


def _minimise_slow(
    balls: _Balls, near: Array, first: Array, rolling: Array, work: Array
) -> tuple[Array, Array, NDArray[np.int64]]:
    """_minimise of balls that take more steps: from near, else from first with a smoothing that ends at the last."""
    q, power, steps = _minimise(balls, near, SMOOTHED[-1] * rolling, CONVERGED_AT, PATIENT_STEPS, work)
    left = np.flatnonzero(steps == PATIENT_STEPS)
    steps += QUICK_STEPS
    if left.size:
        hard, begun = balls.take(left), first[left]
        for smooth in SMOOTHED:
            end = CONVERGED_AT if smooth == SMOOTHED[-1] else CONVERGED_FIRST
            begun, power[left], taken = _minimise(hard, begun, smooth * rolling[left], end, MAX_STEPS, work)
            steps[left] += taken
        q[left] = begun
        steps[left[taken == MAX_STEPS]] = -1
    return q, power, steps
