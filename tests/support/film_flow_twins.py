"""Plain NumPy twins of the film coefficients and the film flow: whole arrays, a general root finder for the stress.

Written from the equations in the kernels' docstrings; they share no code with them. Fields may be complex where no
column is solved, so that a step of 1e-30 i gives derivatives to rounding.
"""

import numpy as np
from contact_twins import (
    column_integrals,
    column_stress,
    density,
    fluidity,
    ln_viscosity,
    running_integral,
    shear_stress,
    upwind_slope,
)

STEP = 1e-30


def cells(n_z):
    """Share of every level in the film, by which the energy equation adds up the heat of its cells (trapezoidal)."""
    out = np.full(n_z + 1, 1.0 / n_z)
    out[[0, -1]] *= 0.5
    return out


def film_coefficients(table, p, t, inv_e, speeds, u_e, scale):
    """Twin of film_flow.film_coefficients without the derivatives: ln phi, g, g_y for 1/e; p [Pa] of the shape of t."""
    inv0, inv1, r0, r1, r2 = column_integrals(inv_e, density(table, p, t))
    e0, e1 = 1.0 / inv0, 1.0 / inv1
    u_a, u_b, v_a, v_b = speeds
    g = (u_a * r0 + (u_b - u_a) * e0 * r1) / u_e
    g_y = (v_a * r0 + (v_b - v_a) * e0 * r1) / u_e
    return np.log(12.0 * scale * (r1 * e0 / e1 - r2)), g, g_y


def thinned_coefficients(table, p_max, p, t, thinning, ln_eta_at, share, speeds, u_e, scale):
    """The same for the thinning that belongs to ln_eta_at and follows the viscosity by share; p in units of p_max."""
    p = (p * p_max)[..., None] + 0.0 * t
    inv_e = fluidity(table, p, t, thinning, ln_eta_at, share)
    return film_coefficients(table, p, t, inv_e, speeds, u_e, scale)


def film_flow(oil, table, x, p, h, t, speeds, gradient, power):
    """Twin of film_flow.film_flow: the fields of FilmFlow by name.

    gradient (n_y, n_x, 2) of pressure [Pa/m], power (n_y, n_x): dissipation of the pressure flow times the relative
    density [W/m2].
    """
    n_z = t.shape[-1] - 1
    z, running = np.arange(n_z + 1) / n_z, running_integral(n_z)
    weights = running[-1]
    everywhere = np.broadcast_to(p[..., None], t.shape)
    eta, rho = np.exp(ln_viscosity(table, everywhere, t)), table.density * density(table, everywhere, t)
    surface_a = np.stack([speeds.u_a, speeds.v_a], axis=-1)
    slip = np.stack([speeds.u_b, speeds.v_b], axis=-1) - surface_a
    wall, thinning = np.zeros((*p.shape, 2)), np.ones(t.shape)
    for j, i in np.ndindex(p.shape):
        wall[j, i], thinning[j, i] = column_stress(
            oil, p[j, i], h[j, i], gradient[j, i], slip[j, i], eta[j, i]
        )
    gap, inv_e = h[..., None], thinning / eta
    stress = wall[..., None, :] + (z * gap)[..., None] * gradient[..., None, :]
    sheared = stress * inv_e[..., None]
    speed = surface_a[..., None, :] + np.einsum("kl,jilc->jikc", running, gap[..., None] * sheared)
    # stress at the same shear rate of an oil that is thicker by a share STEP
    thicker = np.zeros(t.shape)
    for index in np.ndindex(t.shape):
        rate = np.linalg.norm(sheared[index])
        tau = shear_stress(oil, p[index[:2]], eta[index] * (1.0 + 1j * STEP), rate)
        thicker[index] = np.imag(tau) / np.real(tau) / STEP
    # the pressure turns the stress about the level where it shears the film without a slip of the surfaces
    pivot = (inv_e @ (weights * z)) / (inv_e @ weights)
    about = z - pivot[..., None]
    turned = (about * gap)[..., None] * gradient[..., None, :]
    lever = (about**2 * inv_e) @ cells(n_z)
    sliding = gap * inv_e * (np.sum(stress**2, axis=-1) - np.sum(turned**2, axis=-1))
    driven = about**2 * inv_e / lever[..., None] * (table.density / (rho @ weights))[..., None]
    # the first two columns have no quadratic behind them
    upwind, own = upwind_slope(x, p)
    upwind[:, :2] = gradient[:, :2, 0]
    expansion = table.beta_t * table.density / rho
    return {
        "m_x": rho * gap * speed[..., 0],
        "m_y": rho * gap * speed[..., 1],
        "shear": sliding + driven * power[..., None],
        "compression": gap
        * expansion
        * (speed[..., 0] * upwind[..., None] + speed[..., 1] * gradient[..., None, 1]),
        "sliding": sliding,
        "driven": driven,
        "squeeze": gap * expansion * speed[..., 0] * own[:, None],
        "soft": -np.imag(ln_viscosity(table, everywhere, t + 1j * STEP)) / STEP,
        "stiff": np.imag(ln_viscosity(table, everywhere + 1j * STEP, t)) / STEP,
        "rate": gap * sheared[..., 0],
        "thinning": thinning,
        "ln_eta": np.log(eta),
        "stress_share": thicker,
        "fluidity": h * ((inv_e / thicker) @ weights),
        "stress_x": wall[..., 0] + pivot * h * gradient[..., 0],
        "stress_y": wall[..., 1] + pivot * h * gradient[..., 1],
        "traction_x": wall[..., 0] + 0.5 * h * gradient[..., 0],
        "traction_y": wall[..., 1] + 0.5 * h * gradient[..., 1],
        "gradient_x": gradient[..., 0],
        "gradient_y": gradient[..., 1],
        "power": power,
    }


def dissipation(oil, table, p, h, t, speeds, gradient):
    """Full stress times shear rate on every level, times h [W/m2]: no split into sliding and pressure flow."""
    n_z = t.shape[-1] - 1
    z = h[..., None] * np.arange(n_z + 1) / n_z
    eta = np.exp(ln_viscosity(table, np.broadcast_to(p[..., None], t.shape), t))
    out = np.zeros(t.shape)
    slip = np.stack([speeds.u_b - speeds.u_a, speeds.v_b - speeds.v_a], axis=-1)
    for j, i in np.ndindex(p.shape):
        wall, thinning = column_stress(oil, p[j, i], h[j, i], gradient[j, i], slip[j, i], eta[j, i])
        tau = wall[:, None] + z[j, i] * gradient[j, i][:, None]
        out[j, i] = h[j, i] * thinning / eta[j, i] * np.sum(tau**2, axis=0)
    return out
