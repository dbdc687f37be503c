"""Kernels of the equilibrium of a ball: shear stress with its potential, sums over the contacts, Newton's method."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

#: nodes of the quadrature over the ellipse: Gauss along the radius, equal steps around
RADIAL, AROUND = 8, 16
#: slip [m/s] over the entrainment speed below which the friction of asperities is proportional to it
STICTION = 1e-6
#: an iteration ends where a further step would lower the potential by less than this share of it
CONVERGED_AT, MOST_STEPS = 1e-8, 200
#: or by this share, whatever the damping: rounding
ROUNDING = 1e-14
#: where steps are used up: at the kink of oil as stiff as a solid the damped steps creep; power within some 1e-4
ACCEPTED_AT = 1e-6
#: damping of a step that would not lower the potential, and least one, which keeps the system regular
FIRST_DAMPING, LEAST_DAMPING = 1e-3, 1e-12


@njit(cache=True, error_model="numpy")
def shear_stress(v, film, eta, p, tau_0, limiting, boundary, f, sticky):
    """Potential per area [W/m2], stress [Pa] and its slope over slip of a slip speed v >= 0."""
    k = eta / (film * tau_0)
    z, most = k * v, limiting * p
    ln_limit = most / tau_0
    # beyond 1e12 the logarithm is exact, and sinh overflows at last
    z_limit = math.sinh(min(ln_limit, 300.0))
    if z >= z_limit:
        content = math.sqrt(1.0 + z_limit * z_limit) - 1.0
        content = 0.5 * z_limit * z_limit if z_limit < 1e-4 else z_limit * ln_limit - content
        potential, stress, slope = tau_0 / k * content + most * (v - z_limit / k), most, 0.0
    else:
        root = math.sqrt(1.0 + z * z)
        arc = math.asinh(z)
        # for small z the difference z asinh(z) - (root - 1) loses its digits
        content = 0.5 * z * z if z < 1e-4 else z * arc - (root - 1.0)
        potential, stress, slope = tau_0 / k * content, tau_0 * arc, tau_0 * k / root
    if f > 0.0:
        root = math.sqrt(v * v + sticky * sticky)
        dry = boundary * p
        potential = (1.0 - f) * potential + f * dry * (root - sticky)
        stress = (1.0 - f) * stress + f * dry * v / root
        slope = (1.0 - f) * slope + f * dry * sticky * sticky / root**3
    return potential, stress, slope


@njit(cache=True, error_model="numpy")
def potential_sums(
    matrix, offset, differential, speed, axes, radius, weight, cosine, sine, viscosity, pressure, film, asperities,
    tau_0, limiting, boundary, q, sticky, gradient, hessian, power,
):  # fmt: skip
    """Potential [W] of a ball in motion q; its gradient, Hessian and the power of each contact are written."""
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
        a, b = axes[c, 0], axes[c, 1]
        area = math.pi * a * b
        lost = 0.0
        for k in range(radius.size):
            p = pressure[c] * math.sqrt(1.0 - radius[k] * radius[k])
            w = area * weight[k]
            for j in range(cosine.size):
                x, y = b * radius[k] * cosine[j], a * radius[k] * sine[j]
                v_x = at[0] + differential[c] * speed * y * y - at[2] * y
                v_y = at[1] + at[2] * x
                v = math.sqrt(v_x * v_x + v_y * v_y)
                potential, stress, slope = shear_stress(
                    v, film[c], viscosity[c, k], p, tau_0, limiting, boundary, asperities[c], sticky
                )
                total += w * potential
                lost += w * stress * v
                # stress over slip; its limit at rest is the slope
                ratio = stress / v if v > 1e-9 * sticky else slope
                n_x = v_x / v if v > 1e-9 * sticky else 0.0
                n_y = v_y / v if v > 1e-9 * sticky else 0.0
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


@njit(cache=True, error_model="numpy")
def damped_step(hessian, gradient, damping):
    """Step (4,) towards the least of the potential, to be subtracted, and by how much it would lower it, doubled."""
    damped = hessian.copy()
    for m in range(4):
        damped[m, m] *= 1.0 + damping
    change = np.linalg.solve(damped, gradient)
    return change, gradient @ change


@njit(cache=True, error_model="numpy")
def equilibria(
    matrix, offset, differential, speeds, axes, radius, weight, viscosity, pressure, film, asperities, tau_0,
    limiting, boundary, first,
):  # fmt: skip
    """Newton's method with damped steps (Levenberg), from the motion `first` (4,) per screw speed, for every ball."""
    count, contacts = pressure.shape
    around = 2.0 * math.pi * (np.arange(AROUND) + 0.5) / AROUND
    cosine, sine = np.cos(around), np.sin(around)
    power = np.empty((count, contacts))
    motion = np.empty((count, 4))
    steps = np.empty(count, dtype=np.int64)
    gradient, hessian = np.empty(4), np.empty((4, 4))
    other_gradient, other_hessian, other_power = np.empty(4), np.empty((4, 4)), np.empty(contacts)
    for i in range(count):
        speed = speeds[i]
        sticky = STICTION * abs(speed) * abs(matrix[0, 0, 0])
        q = first * speed
        value = potential_sums(
            matrix, offset, differential, speed, axes[i], radius, weight, cosine, sine, viscosity[i], pressure[i],
            film[i], asperities[i], tau_0, limiting, boundary, q, sticky, gradient, hessian, power[i],
        )  # fmt: skip
        steps[i] = MOST_STEPS
        damping, decrement = 0.0, math.inf
        for step in range(MOST_STEPS):
            if not (np.isfinite(gradient).all() and np.isfinite(hessian).all()):
                break
            change, decrement = damped_step(hessian, gradient, LEAST_DAMPING)
            lower = decrement > CONVERGED_AT * value
            # where all of a contact is at its limit the potential is nearly flat along the slip, and a full step goes
            # far beyond the least
            while lower:
                if damping > 0.0:
                    change, decrement = damped_step(hessian, gradient, damping)
                lower = decrement > ROUNDING * value
                new = q - change
                other = potential_sums(
                    matrix, offset, differential, speed, axes[i], radius, weight, cosine, sine, viscosity[i],
                    pressure[i], film[i], asperities[i], tau_0, limiting, boundary, new, sticky, other_gradient,
                    other_hessian, other_power,
                )  # fmt: skip
                if other <= value - 1e-4 * decrement:
                    break
                damping = max(10.0 * damping, FIRST_DAMPING)
            if not lower:
                steps[i] = step
                break
            q[:] = new
            value = other
            gradient[:] = other_gradient
            hessian[:, :] = other_hessian
            power[i] = other_power
            damping = 0.1 * damping if damping > FIRST_DAMPING else 0.0
        if decrement <= ACCEPTED_AT * value:
            steps[i] = min(steps[i], MOST_STEPS - 1)
        motion[i] = q
    return power, motion, steps
