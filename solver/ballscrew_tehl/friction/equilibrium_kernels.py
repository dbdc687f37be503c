"""Kernels of the equilibrium of a ball: shear stress with its potential, sums over the contacts, Newton's method."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..compiled import kernel

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


class Motion(NamedTuple):
    """Slip and spin of the contacts of a ball over its motion: as physics.ball_motion.ContactMotion."""

    matrix: Any
    offset: Any
    differential: Any


class Nodes(NamedTuple):
    """Quadrature over the ellipse: radius over the semi-axes with weights, cosine and sine of the angles."""

    radius: Any
    weight: Any
    cosine: Any
    sine: Any


@kernel
def limit(p, tau_0, limiting):
    """Where the stress of the oil reaches Lambda p: ln_limit = Lambda p/tau_0 and its sinh, z_limit."""
    ln_limit = limiting * p / tau_0
    # beyond 1e12 the logarithm is exact, and sinh overflows at last
    return ln_limit, math.sinh(min(ln_limit, 300.0))


@kernel
def shear_stress(v, k, tau_0, ln_limit, z_limit, dry, f, smooth):
    """Potential per area [W/m2], stress over slip and slope of the stress over slip [Pa s/m] at a slip speed v >= 0.

    With W(v) the potential of oil and asperities: W(sqrt(v^2 + smooth^2)), convex as W is; where W is a parabola the
    stress is that without smooth.

    Parameters   k : viscosity/(film tau_0) [s/m];  dry : stress of asperities [Pa], f : their share of the load
    """
    root = math.sqrt(v * v + smooth * smooth)
    z = k * root
    if z >= z_limit:
        # the integral for small z is a difference that loses its digits
        content = math.sqrt(1.0 + z_limit * z_limit) - 1.0
        content = 0.5 * z_limit * z_limit if z_limit < 1e-4 else z_limit * ln_limit - content
        content, stress, slope = content + ln_limit * (z - z_limit), tau_0 * ln_limit, 0.0
    else:
        one, arc = math.sqrt(1.0 + z * z), math.asinh(z)
        content = 0.5 * z * z if z < 1e-4 else z * arc - (one - 1.0)
        stress, slope = tau_0 * arc, tau_0 * k / one
    potential = tau_0 / k * content
    if f > 0.0:
        potential = (1.0 - f) * potential + f * dry * root
        stress, slope = (1.0 - f) * stress + f * dry, (1.0 - f) * slope
    ratio, share = stress / root, v / root
    return potential, ratio, ratio + (slope - ratio) * share * share


@kernel
def potential_sums(motion, nodes, axes, traction, ball, speed, q, smooth, gradient, hessian, power):
    """Potential [W] of one ball in motion q, to a constant; gradient, Hessian and power of each contact are written."""
    matrix, offset, differential = motion
    radius, weight, cosine, sine = nodes
    tau_0 = traction.tau_0
    total = 0.0
    gradient[:] = 0.0
    hessian[:, :] = 0.0
    at = np.empty(3)
    row_x, row_y = np.empty(4), np.empty(4)
    for c in range(matrix.shape[0]):
        for i in range(3):
            at[i] = offset[c, i] * speed
            for m in range(4):
                at[i] += matrix[c, i, m] * q[m]
        a, b = axes[ball, c, 0], axes[ball, c, 1]
        area = math.pi * a * b
        lost = 0.0
        for k in range(radius.size):
            p = traction.pressure[ball, c] * math.sqrt(1.0 - radius[k] * radius[k])
            w = area * weight[k]
            stiffness = traction.viscosity[ball, c, k] / (traction.film[ball, c] * tau_0)
            ln_limit, z_limit = limit(p, tau_0, traction.limiting)
            for j in range(cosine.size):
                x, y = b * radius[k] * cosine[j], a * radius[k] * sine[j]
                v_x = at[0] + differential[c] * speed * y * y - at[2] * y
                v_y = at[1] + at[2] * x
                v = math.sqrt(v_x * v_x + v_y * v_y)
                potential, ratio, slope = shear_stress(
                    v, stiffness, tau_0, ln_limit, z_limit, traction.boundary * p, traction.asperities[ball, c],
                    smooth,
                )  # fmt: skip
                total += w * potential
                lost += w * ratio * v * v
                n_x = v_x / v if v > 0.0 else 0.0
                n_y = v_y / v if v > 0.0 else 0.0
                along = slope - ratio
                h_xx, h_xy, h_yy = ratio + along * n_x * n_x, along * n_x * n_y, ratio + along * n_y * n_y
                for m in range(4):
                    row_x[m] = matrix[c, 0, m] - y * matrix[c, 2, m]
                    row_y[m] = matrix[c, 1, m] + x * matrix[c, 2, m]
                for m in range(4):
                    gradient[m] += w * ratio * (v_x * row_x[m] + v_y * row_y[m])
                    to_x, to_y = h_xx * row_x[m] + h_xy * row_y[m], h_xy * row_x[m] + h_yy * row_y[m]
                    for n in range(m + 1):
                        hessian[m, n] += w * (to_x * row_x[n] + to_y * row_y[n])
        power[c] = lost
    for m in range(4):
        for n in range(m):
            hessian[n, m] = hessian[m, n]
    return total


@kernel
def least_potential(motion, nodes, axes, traction, ball, speed, q, smooth, converged_at, most, power):
    """Newton's method with shortened steps from a motion q (4,), which is moved, as the power is written.

    Returns      steps it took, most if the least was not found
    """
    gradient, hessian = np.empty(4), np.empty((4, 4))
    other_gradient, other_hessian, other_power = np.empty(4), np.empty((4, 4)), np.empty(power.size)
    value = potential_sums(motion, nodes, axes, traction, ball, speed, q, smooth, gradient, hessian, power)
    for step in range(most):
        if not (np.isfinite(gradient).all() and np.isfinite(hessian).all()):
            break
        for m in range(4):
            hessian[m, m] *= 1.0 + LEAST_DAMPING
        change = np.linalg.solve(hessian, gradient)
        decrement = gradient @ change
        if not decrement > converged_at * value:
            return step
        # where all of a contact is at its limit the potential is nearly flat along the slip, and a full step goes far
        # beyond the least. The direction is kept: it does not depend on the coordinates of the motion
        length = 1.0
        while True:
            if not length * decrement > ROUNDING * value:
                return step
            new = q - length * change
            other = potential_sums(
                motion, nodes, axes, traction, ball, speed, new, smooth, other_gradient, other_hessian,
                other_power,
            )  # fmt: skip
            if other <= value - LEAST_GAIN * length * decrement:
                break
            # secant of the slope along the step
            slope = other_gradient @ change
            share = decrement / (decrement - slope) if slope < 0.0 else SHORTENED[1]
            length *= min(max(share, SHORTENED[0]), SHORTENED[1])
        q[:] = new
        value = other
        gradient[:] = other_gradient
        hessian[:, :] = other_hessian
        power[:] = other_power
    return most


@kernel(nogil=True)
def equilibria(motion, speeds, axes, traction, radius, weight, first):
    """Power, motion and steps of every ball, from the motion of the ball before, or `first` (4,), per screw speed."""
    count, contacts = traction.pressure.shape
    around = 2.0 * math.pi * (np.arange(AROUND) + 0.5) / AROUND
    nodes = Nodes(radius, weight, np.cos(around), np.sin(around))
    power = np.empty((count, contacts))
    found = np.empty((count, 4))
    steps = np.zeros(count, dtype=np.int64)
    for i in range(count):
        rolling = abs(speeds[i]) * abs(motion.matrix[0, 0, 0])
        for attempt in range(2):
            near = attempt == 0 and i > 0 and steps[i - 1] >= 0
            q = (found[i - 1] / speeds[i - 1] if near else first) * speeds[i]
            least = len(SMOOTHED) - 1
            begin, most = (least, QUICK_STEPS) if attempt == 0 else (0, MOST_STEPS)
            for stage in range(begin, least + 1):
                converged_at = CONVERGED_AT if stage == least else CONVERGED_FIRST
                taken = least_potential(
                    motion, nodes, axes, traction, i, speeds[i], q, SMOOTHED[stage] * rolling, converged_at, most,
                    power[i],
                )  # fmt: skip
                steps[i] += taken
            if taken < most:
                break
        if not taken < most:
            steps[i] = -1
        found[i] = q
    return power, found, steps
