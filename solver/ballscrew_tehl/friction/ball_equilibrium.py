"""Motion of a ball between its raceways, and the power that slip and spin cost: the minimum of a convex potential.

Each contact slides as its motion says (physics.ball_motion), with Heathcote's parabola and spin over a Hertz-shaped
pressure; the shear stress follows the local slip:
tau = (1-f) min(tau_0 asinh(eta v/(h tau_0)), Lambda p) + f mu_b p, with the share f of the asperities.
tau is the derivative of a convex potential with respect to the slip v, so the forces and moments of the contacts
on the ball vanish where the integral of the potential over all contacts is least. The motion there is unique.
Where oil or asperities stick, the potential has a kink: v is smoothed over 1e-6 of the entrainment speed, which moves
the power by less than 2e-6 of it (1000 random balls; the smoothing a hundredth). Newton's method, many balls at a time.

Assumption: no other force on the ball. What drives it against rolling resistance, hysteresis and its neighbours is a
small part of what the contacts can transmit, its inertia less.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..physics.ball_law import Array
from ..physics.ball_motion import ContactMotion, rolling_motion

#: nodes of the quadrature over the ellipse: Gauss along the radius, equal steps around
RADIAL, AROUND = 8, 16
#: slip [m/s] over the entrainment speed below which the shear stress is smoothed: a ball on oil as stiff as a solid, or
#: on asperities, sticks at some points of its contacts, where the potential has a kink. First with the last one alone;
#: where that takes more than QUICK_STEPS, with all, each from the motion of the one before
SMOOTHED = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
QUICK_STEPS, MOST_STEPS = 12, 400
#: an iteration ends where a further step would lower the potential by less than this share of it; that with a wider
#: smoothing by less than the second
CONVERGED_AT, CONVERGED_FIRST = 1e-10, 1e-4
#: or where a shortened one would by this share: rounding
ROUNDING = 1e-14
#: share of the expected gain of a step that it must reach, else it is shortened by a factor between these
LEAST_GAIN, SHORTENED = 1e-4, (0.05, 0.7)
#: relative addition to the diagonal of the system, which keeps it regular
LEAST_DAMPING = 1e-12
#: balls at a time: their nodes stay within the cache
CHUNK = 256


class BallMotion(NamedTuple):
    """Equilibrium of n balls: power of each contact (n, c) [W], motion q (n, 4) [rad/s], its steps (n,)."""

    power: Array
    motion: Array
    steps: NDArray[np.int64]


class Traction(NamedTuple):
    """What the shear stress of the contacts follows from.

    viscosity (n, c, RADIAL) [Pa s] at the radial nodes; pressure (n, c): largest [Pa]; film (n, c) [m]; asperities
    (n, c): their share of the load; tau_0 [Pa], limiting: Lambda [1], boundary: mu_b [1].
    """

    viscosity: Array
    pressure: Array
    film: Array
    asperities: Array
    tau_0: float
    limiting: float
    boundary: float

    def take(self, rows: Any) -> Traction:
        """That of some balls."""
        viscosity, pressure, film, asperities = (part[rows] for part in self[:4])
        return Traction(viscosity, pressure, film, asperities, *self[4:])


class Stress(NamedTuple):
    """Shear stress over slip at nodes: potential per area [W/m2], stress over slip, slope of the stress [Pa s/m]."""

    potential: Any
    ratio: Any
    slope: Any


class _Balls(NamedTuple):
    """Balls at the nodes of their contacts (n, c, RADIAL, AROUND), or constant along an axis of length one."""

    matrix: Array  # (n, c, 3, 4) slip and spin over the motion of the ball
    offset: Array  # (n, c, 3) slip and spin without motion of the ball
    differential: Array  # (n, c, 1, 1)
    x: Array
    y: Array
    weight: Array  # area of a node
    stiffness: Array  # viscosity/(film tau_0)
    limit: Array  # stress at which the oil slips, Lambda p
    dry: Array  # stress of the asperities
    share: Array  # of the asperities

    def take(self, rows: Any) -> _Balls:
        return _Balls(*(one[rows] for one in self))


def radial_nodes() -> tuple[Array, Array]:
    """Radius of the nodes over the semi-axes, and weights with which the sum around is the mean over the ellipse."""
    x, w = np.polynomial.legendre.leggauss(RADIAL)
    r = 0.5 * (x + 1.0)
    return r, w * r / AROUND


def shear_stress(
    v: Any, stiffness: Any, tau_0: float, limit: Any, dry: Any, share: Any, smooth: Any
) -> Stress:
    """Shear stress of oil and asperities at slip speeds v >= 0 [m/s]; all arguments broadcast.

    With W(v) the potential: W(sqrt(v^2 + smooth^2)), convex as W is; where W is a parabola the stress is that without
    smooth.

    Parameters   stiffness : viscosity/(film tau_0) [s/m];  limit, dry : stress of oil that slips, of asperities [Pa];
                 share : of the load on asperities
    """
    root = np.sqrt(v * v + smooth * smooth)
    z = stiffness * root
    # beyond 1e12 the logarithm is exact, and sinh overflows at last
    ln_limit = limit / tau_0
    ends = np.minimum(z, np.sinh(np.minimum(ln_limit, 300.0)))
    one = np.sqrt(1.0 + ends * ends)
    slips = z > ends
    arc = np.where(slips, ln_limit, np.arcsinh(ends))
    # the integral of asinh, which loses its digits for small ones
    content = np.where(ends < 1e-4, 0.5 * ends * ends, ends * arc - (one - 1.0)) + arc * (z - ends)
    oil = 1.0 - share
    potential = oil * (tau_0 / stiffness) * content + share * dry * root
    ratio = (oil * tau_0 * arc + share * dry) / root
    slope = oil * np.where(slips, 0.0, tau_0 * stiffness / one)
    return Stress(potential, ratio, ratio + (slope - ratio) * (v / root) ** 2)


def _sums(balls: _Balls, tau_0: float, q: Array, smooth: Array) -> tuple[Array, Array, Array, Array]:
    """Potential (n,) [W] to a constant, gradient (n, 4), Hessian (n, 4, 4) and power of each contact (n, c)."""
    matrix = balls.matrix
    at = balls.offset + (matrix @ q[:, None, :, None])[..., 0]
    slip_x, slip_y, spin = (at[..., i, None, None] for i in range(3))
    x, y, w = balls.x, balls.y, balls.weight
    v_x, v_y = slip_x + balls.differential * y * y - spin * y, slip_y + spin * x
    v = np.sqrt(v_x * v_x + v_y * v_y)
    stress = shear_stress(
        v, balls.stiffness, tau_0, balls.limit, balls.dry, balls.share, smooth[:, None, None, None]
    )
    own = w * stress.ratio
    potential = (w * stress.potential).sum(axis=(1, 2, 3))
    f_x, f_y = own * v_x, own * v_y
    power = (own * v * v).sum(axis=(2, 3))
    forces = np.stack([f.sum(axis=(2, 3)) for f in (f_x, f_y, x * f_y - y * f_x)], axis=-1)
    along = w * (stress.slope - stress.ratio) / np.maximum(v * v, 1e-300)
    h_xx, h_xy, h_yy = own + along * v_x * v_x, along * v_x * v_y, own + along * v_y * v_y
    turn_x, turn_y = h_xy * x - h_xx * y, h_yy * x - h_xy * y
    xx, xy, yy, xt, yt, tt = (
        h.sum(axis=(2, 3)) for h in (h_xx, h_xy, h_yy, turn_x, turn_y, turn_y * x - turn_x * y)
    )
    stiff = np.stack([xx, xy, xt, xy, yy, yt, xt, yt, tt], axis=-1).reshape(*xx.shape, 3, 3)
    turned = np.swapaxes(matrix, -1, -2)
    gradient = (turned @ forces[..., None])[..., 0].sum(axis=1)
    hessian = (turned @ stiff @ matrix).sum(axis=1)
    return potential, gradient, hessian, power


def _least_potential(
    balls: _Balls, tau_0: float, q: Array, smooth: Array, converged_at: float, most: int
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Newton's method with shortened steps from motions q (n, 4): motion, power, steps, `most` where it was not found.

    Where all of a contact is at its limit the potential is nearly flat along the slip, and a full step goes far beyond
    the least: the step is shortened. Its direction is kept: it does not depend on the coordinates of the motion.
    """
    q = q.copy()
    state: tuple[Array, ...] = _sums(balls, tau_0, q, smooth)
    power, steps = state[3].copy(), np.full(len(q), most)
    rows = np.arange(len(q))
    diagonal = np.arange(4)
    for step in range(most):
        value, gradient, hessian, _ = state
        good = np.isfinite(gradient).all(axis=1) & np.isfinite(hessian).all(axis=(1, 2))
        hessian[:, diagonal, diagonal] *= 1.0 + LEAST_DAMPING
        change = np.zeros_like(gradient)
        change[good] = np.linalg.solve(hessian[good], gradient[good, :, None])[..., 0]
        decrement = (gradient * change).sum(axis=1)
        done = good & ~(decrement > converged_at * value)
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
            other = _sums(own if pending.size == len(here) else own.take(pending), tau_0, new, smooth[at])
            better = other[0] <= value[at] - LEAST_GAIN * length[pending] * decrement[at]
            took = pending[better]
            moved[took] = new[better]
            for part, found in zip(reached, other, strict=True):
                part[took] = found[better]
            # secant of the slope along the step
            slope = (other[1] * change[at]).sum(axis=1)
            share = np.where(slope < 0.0, decrement[at] / (decrement[at] - slope), SHORTENED[1])
            length[pending] *= np.where(better, 1.0, np.clip(share, *SHORTENED))
            ended = ~better & ~(length[pending] * decrement[at] > ROUNDING * value[at])
            stuck[pending[ended]] = True
            pending = pending[~better & ~ended]
        steps[rows[here[stuck]]] = step
        on = ~stuck
        rows = rows[here[on]]
        q[rows], power[rows] = moved[on], reached[3][on]
        balls = own if on.all() else own.take(on)
        smooth, state = smooth[here[on]], tuple(part[on] for part in reached)
        if not rows.size:
            break
    return q, power, steps


def _nodes(motion: ContactMotion, speed: Array, axes: Array, traction: Traction) -> _Balls:
    radius, weight = radial_nodes()
    around = 2.0 * math.pi * (np.arange(AROUND) + 0.5) / AROUND
    a, b = axes[..., 0, None, None], axes[..., 1, None, None]
    p = traction.pressure[..., None] * np.sqrt(1.0 - radius**2)
    return _Balls(
        np.broadcast_to(motion.matrix, (*traction.pressure.shape, 3, 4)),
        motion.offset * speed[:, None, None],
        motion.differential[..., None, None] * speed[:, None, None, None],
        b * (radius[:, None] * np.cos(around)),
        a * (radius[:, None] * np.sin(around)),
        math.pi * a * b * weight[:, None],
        (traction.viscosity / (traction.film[..., None] * traction.tau_0))[..., None],
        (traction.limiting * p)[..., None],
        (traction.boundary * p)[..., None],
        traction.asperities[..., None, None],
    )


def ball_equilibrium(
    motion: ContactMotion, speed: Array, axes: Array, traction: Traction, near: Array | None = None
) -> BallMotion:
    """Motion and power of balls.

    Parameters   motion : of the c contacts, of all balls or of each;  near : motions (n, 4) [rad/s] to begin with, None
                 = those that slide least without traction;  speed : of the screw (n,) [rad/s], > 0
                 axes : semi-axes of the pressure across and along rolling (n, c, 2) [m]
    Raises       ArithmeticError: a ball whose equilibrium was not found
    """
    speed = np.asarray(speed, dtype=float)
    first = rolling_motion(motion) * speed[:, None]
    begin = first if near is None else near
    rolling = np.abs(speed * motion.matrix[..., 0, 0, 0])
    each = motion.matrix.ndim == 4
    chunks = [slice(i, i + CHUNK) for i in range(0, len(speed), CHUNK)]

    def solve(rows: slice) -> tuple[Array, Array, NDArray[np.int64]]:
        # each thread has its own state of the warnings
        with np.errstate(all="ignore"):
            own = ContactMotion(motion.raceways, *(part[rows] if each else part for part in motion[1:]))
            balls = _nodes(own, speed[rows], axes[rows], traction.take(rows))
            tau_0 = traction.tau_0
            q, power, steps = _least_potential(
                balls, tau_0, begin[rows], SMOOTHED[-1] * rolling[rows], CONVERGED_AT, QUICK_STEPS
            )
            left = np.flatnonzero(steps == QUICK_STEPS)
            if left.size:
                hard, begun = balls.take(left), first[rows][left]
                for smooth in SMOOTHED:
                    end = CONVERGED_AT if smooth == SMOOTHED[-1] else CONVERGED_FIRST
                    begun, power[left], taken = _least_potential(
                        hard, tau_0, begun, smooth * rolling[rows][left], end, MOST_STEPS
                    )
                    steps[left] += taken
                q[left] = begun
                steps[left[taken == MOST_STEPS]] = -1
            return q, power, steps

    with ThreadPoolExecutor() as threads:
        parts = list(threads.map(solve, chunks)) if len(chunks) > 1 else [solve(chunks[0])]
    q, power, steps = (np.concatenate(column) for column in zip(*parts, strict=True))
    known = (steps >= 0) & np.isfinite(power).all(axis=1)
    if not known.all():
        bad = int(np.argmin(known))
        raise ArithmeticError(
            f"equilibrium of a ball not found in {MOST_STEPS} steps: speed {speed[bad]:.6g} rad/s, pressure "
            f"{traction.pressure[bad].max():.4g} Pa, film {traction.film[bad].min():.4g} m"
        )
    return BallMotion(power, q, steps)
