"""Limits, symmetries and scalings of the solved contact."""

import math
from dataclasses import replace

import numpy as np
import pytest
from contact_cases import CIRCLE, LONG, OIL, STEEL, conditions, moes, solved
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import spsolve

from ballscrew_tehl.contact.moes import reference_oil
from ballscrew_tehl.contact.solve import ContactConditions, SolverOptions, solve_contact

# --- vanishing speed: Hertz --------------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.2, LONG])
def test_pressure_tends_to_that_of_hertz(ratio):
    deviations = []
    for M in (1e2, 1e3, 1e4):
        solution = moes(M, 5.0, ratio, "roelands", n_y=17).solution
        r_2 = solution.x**2 + solution.y[:, None] ** 2
        hertz = solution.hertz.p_max * np.sqrt(np.maximum(0.0, 1.0 - r_2))
        deviations.append(np.abs(solution.pressure - hertz)[r_2 < 0.8].max() / solution.hertz.p_max)
    assert deviations[0] > 2.0 * deviations[1] > 4.0 * deviations[2]
    assert not deviations[-1] > 0.03  # 1.1 and 2.1 % found
    assert solution.p_max == pytest.approx(solution.hertz.p_max, rel=0.01)
    assert solution.h_c < 0.02 * solution.hertz.delta


def test_gap_tends_to_that_of_the_dry_contact():
    """Beside the ellipse, on the axis, the gap opens by Hertz' outer form (Johnson 1985, section 4.2, circle)."""
    solution = moes(1e4, 5.0, CIRCLE, "roelands").solution
    x, film = solution.x[solution.x > 1.05], solution.film[0][solution.x > 1.05]
    # u_z outside / (a^2/R): [(2 - r^2) asin(1/r) + sqrt(r^2 - 1)]/pi; approach 1
    bulge = ((2.0 - x**2) * np.arcsin(1.0 / x) + np.sqrt(x**2 - 1.0)) / np.pi
    gap = 0.5 * x**2 + bulge - 1.0
    unit = solution.hertz.b**2 / solution.conditions.R_x
    np.testing.assert_allclose((film - solution.h_c) / unit, gap, atol=5e-3)


# --- thick film: rigid bodies, one viscosity ---------------------------------------------------------------------


def rigid_load(ratio, x_in, x_out, y_max, n=60):
    """Integral of P over the plane for div(H^3 grad P) = dH/dX, P >= 0, H = 1 + X^2 + Y^2, dY/dX scaled by ratio.

    X = x/sqrt(2 R_x h_0), Y = y/sqrt(2 R_y h_0); finite volumes on a graded grid, cavitation by active sets; P = 0 on
    the edges. Shares nothing with the solver.
    """
    half = np.sinh(3.0 * np.linspace(0.0, 1.0, n + 1)) / math.sinh(3.0)
    x, y = np.concatenate([x_in * half[:0:-1], x_out * half]), y_max * half
    x_f, y_f = 0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1])
    w_x, w_y = np.diff(x_f, prepend=x[0], append=x[-1]), np.diff(y_f, prepend=0.0, append=y[-1])
    height = lambda x, y: 1.0 + x**2 + y**2  # noqa: E731
    j, i = (v.ravel() for v in np.mgrid[0:n, 1 : x.size - 1])
    east = height(x_f[i], y[j]) ** 3 / (x[i + 1] - x[i]) * w_y[j]
    west = height(x_f[i - 1], y[j]) ** 3 / (x[i] - x[i - 1]) * w_y[j]
    north = ratio * height(x[i], y_f[j]) ** 3 / (y[j + 1] - y[j]) * w_x[i]
    below = np.maximum(j - 1, 0)
    south = np.where(
        j > 0, ratio * height(x[i], y_f[below]) ** 3 / np.where(j > 0, y[j] - y[below], 1.0) * w_x[i], 0.0
    )
    row, size = j * x.size + i, x.size * y.size
    columns = [row + 1, row - 1, row + x.size, np.where(j > 0, row - x.size, row), row]
    values = [east, west, north, south, -(east + west + north + south)]
    matrix = csr_matrix(
        (np.concatenate(values), (np.tile(row, 5), np.concatenate(columns))), shape=(size, size)
    )
    rhs, inside = np.zeros(size), np.zeros(size, dtype=bool)
    rhs[row], inside[row] = (height(x_f[i], y[j]) - height(x_f[i - 1], y[j])) * w_y[j], True
    wet, p = inside.copy(), np.zeros(size)
    for _ in range(100):
        k = np.flatnonzero(wet)
        p[:] = 0.0
        p[k] = spsolve(matrix[k][:, k].tocsc(), rhs[k])
        changed = inside & np.where(wet, p > 0.0, rhs - matrix @ p < 0.0)
        if np.array_equal(changed, wet):
            break
        wet = changed
    return 2.0 * float(np.sum(np.outer(w_y, w_x).ravel() * p))


def rigid_film(ratio, *domain):
    """Hc M^2: load 12 eta u_e (2 R_x)^(3/2) (R_y/R_x)^(1/2) h_0^(-1/2) I in Moes' numbers."""
    return 288.0 * rigid_load(ratio, *domain) ** 2 / ratio


@pytest.mark.parametrize("ratio", [CIRCLE, LONG])
def test_closed_form_of_rigid_bodies_is_met_by_the_small_solve(ratio):
    """Brewe, Hamrock & Taylor, J Lubr Technol 101 (1979) 231: rigid, one viscosity, flooded.

    H = 128 alpha lambda^2 [0.131 atan(alpha/2) + 1.683]^2 (U/W)^2, alpha = R_y/R_x, lambda = 1/(1 + 2/(3 alpha)).
    """
    alpha = 1.0 / ratio
    side = 1.0 / (1.0 + 2.0 / (3.0 * alpha))
    closed = 0.25 * 128.0 * alpha * side**2 * (0.131 * math.atan(0.5 * alpha) + 1.683) ** 2
    # the flooded value over 1/width: pressure falls with the third power of the distance
    near, far = (rigid_film(ratio, -w, 0.5 * w, w) for w in (20.0, 40.0))
    assert 2.0 * far - near == pytest.approx(closed, rel=0.05)  # a fit, 3 % stated


@pytest.mark.parametrize("ratio", [CIRCLE, LONG])
def test_film_tends_to_that_of_rigid_bodies(ratio):
    """Low load, thin oil: on the same domain as an independent rigid solve."""
    film = moes(0.5, 0.01, ratio, "barus")
    unit = math.sqrt(2.0 * film.solution.conditions.R_x * film.solution.h_c)  # of x; y likewise with R_y
    hertz = film.solution.hertz
    x, y = film.solution.x * hertz.b / unit, film.solution.y * hertz.a / unit * math.sqrt(ratio)
    rigid = rigid_film(ratio, x[0], x[-1], y[-1])
    # uniform lines across: 5 to 9 of them in the pressurised part
    assert film.Hc * 0.5**2 == pytest.approx(rigid, rel=0.03)


@pytest.mark.xfail(
    strict=True, reason="the default domain starves thick films: 45 % below flooded at M = 0.5"
)
def test_default_domain_floods_thick_films():
    assert moes(0.5, 0.01, CIRCLE, "barus").Hc * 0.5**2 == pytest.approx(35.0, rel=0.1)


# --- symmetries --------------------------------------------------------------------------------------------------


def test_rolling_the_other_way_round_gives_the_same_film():
    here = conditions(srr=0.7)
    back = replace(here, u_1=-here.u_1, u_2=-here.u_2)
    for options in ({"thermal": False}, {}):
        one, other = solved(here, **options), solved(back, **options)
        assert other.h_c == pytest.approx(one.h_c, rel=1e-12)
        assert other.h_m == pytest.approx(one.h_m, rel=1e-12)
        assert other.temperature_rise == pytest.approx(one.temperature_rise, rel=1e-12, abs=1e-12)
        # a force along x: body 1 now drags body 2 the other way
        assert other.traction_force == pytest.approx(-one.traction_force, rel=1e-12)


def test_result_carries_the_conditions_that_were_asked():
    asked = replace(conditions(), u_1=-3.0, u_2=-2.0)
    assert solved(asked, thermal=False).conditions == asked


def test_swapped_bodies_give_the_same_film_and_the_opposite_traction():
    """What is left of the asymmetry is that of the vertical flux, summed up from body 1: it fades with the nodes."""
    here = conditions(srr=0.7)
    swapped = replace(here, u_1=here.u_2, u_2=here.u_1)
    gaps = {"film": [], "traction": [], "temperature": []}
    for n_x in (65, 129):
        one, other = solved(here, n_x=n_x), solved(swapped, n_x=n_x)
        gaps["film"].append(abs(other.h_c / one.h_c - 1.0))
        gaps["traction"].append(abs(other.traction_force / one.traction_force + 1.0))
        turned = other.temperature[:, :, ::-1]
        gaps["temperature"].append(np.abs(turned - one.temperature).mean() / one.temperature_rise)
    for name, (coarse, fine) in gaps.items():
        assert not fine > 1e-3, name
        assert fine < coarse, name
    isothermal = [solved(c, thermal=False) for c in (here, swapped)]
    assert isothermal[1].h_c == pytest.approx(isothermal[0].h_c, rel=1e-12)
    assert isothermal[1].traction_force == pytest.approx(-isothermal[0].traction_force, rel=1e-9)


def test_pure_rolling_gives_no_traction():
    sliding, rolling = solved(conditions(srr=0.5)), solved(conditions(srr=0.0))
    assert not abs(rolling.traction_force) > 1e-5 * abs(sliding.traction_force)
    # both walls alike
    t = rolling.temperature
    assert not np.abs(t - t[:, :, ::-1]).mean() > 0.02 * rolling.temperature_rise


def test_traction_drags_body_2_towards_the_faster_body_1():
    assert solved(conditions(srr=0.5)).traction_force > 0.0 > solved(conditions(srr=-0.5)).traction_force


# --- slow: isothermal --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n_z", [10, 20])
def test_film_of_a_slow_contact_is_isothermal(n_z):
    slow = conditions(load=0.05, u_e=1e-4, srr=1.0)
    thermal, isothermal = solved(slow, n_z=n_z), solved(slow, thermal=False)
    assert 0.0 < thermal.temperature_rise < 1e-3
    # the trapezoidal rule takes 1/n_z^2 off the fluidity of the film, and the film follows with a power of 0.7
    assert 0.0 <= thermal.h_c / isothermal.h_c - 1.0 + 1e-5 < 0.8 / n_z**2
    np.testing.assert_allclose(thermal.pressure, isothermal.pressure, atol=0.02 * isothermal.p_max)
    # traction is linear in the viscosity, which the heat does not touch
    assert thermal.traction_force == pytest.approx(isothermal.traction_force, rel=0.02)


def test_heat_takes_film_away_and_sliding_takes_more():
    isothermal = solved(conditions(srr=0.0), thermal=False).h_c
    films = [solved(conditions(srr=srr)).h_c for srr in (0.0, 0.5, 1.0)]
    assert isothermal * 1.02 > films[0] > films[1] > films[2] > 0.5 * isothermal


# --- scaling -----------------------------------------------------------------------------------------------------


def test_film_in_moes_units_depends_on_M_and_L_alone():
    """Another size, modulus and oil with the same M and L (Barus, incompressible: no further number)."""
    M, L, ratio = 100.0, 5.0, 0.2
    E, R_x, alpha, eta0 = 1.1e11, 3e-3, 1.3e-8, 0.2
    oil = reference_oil("barus").model_copy(update={"pressure_viscosity": alpha, "viscosity": eta0})
    two_u = (L / (alpha * E)) ** 4
    u_e = 0.5 * two_u * E * R_x / eta0
    at = ContactConditions(M * two_u**0.75 * E * R_x**2, R_x, R_x / ratio, u_e, u_e, 313.15, E)
    options = SolverOptions(thermal=False, n_x=65, n_y=17)
    other = solve_contact(at, oil, STEEL, options)
    np.testing.assert_allclose([other.M, other.L], [M, L], rtol=1e-9)
    reference = moes(M, L, ratio, "barus", n_x=65, n_y=17)
    assert other.h_c / (R_x * math.sqrt(two_u)) == pytest.approx(reference.Hc, rel=1e-4)
    assert other.h_m / (R_x * math.sqrt(two_u)) == pytest.approx(reference.Hm, rel=1e-4)


def test_film_falls_with_load_and_grows_with_speed():
    films = [solved(conditions(load=load), thermal=False).h_c for load in (15.0, 30.0, 60.0)]
    assert films[0] > films[1] > films[2]
    # exponents of the piezoviscous-elastic regime, Nijenbanning et al.: load -0.08 to -0.1, speed 0.67 to 0.72
    assert -0.13 < math.log(films[2] / films[0]) / math.log(4.0) < -0.03
    speeds = [solved(conditions(u_e=u_e), thermal=False).h_c for u_e in (1.0, 2.0)]
    assert 0.6 < math.log2(speeds[1] / speeds[0]) < 0.75


def test_warm_start_changes_nothing_but_the_work():
    first = solved(conditions())
    near = conditions(u_e=2.02)
    cold = solved(near)
    warm = solve_contact(near, OIL, STEEL, SolverOptions(n_x=65, n_y=9, n_z=8), start=first)
    assert warm.converged
    assert warm.iterations < cold.iterations
    assert warm.h_c == pytest.approx(cold.h_c, rel=1e-4)
    assert warm.traction_force == pytest.approx(cold.traction_force, rel=1e-3)
