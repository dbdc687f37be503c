"""Rolling resistance against direct solutions of Reynolds' equation, printed numbers, a second print, bad input."""

import math
from itertools import pairwise

import numpy as np
import pytest
import scipy.sparse as sparse
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.sparse.linalg import spsolve

from ballscrew_tehl.physics.hertz import ellipse
from ballscrew_tehl.physics.rolling_resistance import (
    RIGID_LINE,
    biboulet_houpert_line,
    biboulet_houpert_point,
    goksem_hargreaves_line,
    houpert_point,
    inlet_heating_factor,
    replenishment_factor,
    rigid_line_force,
    rolling_power,
    starvation_factor,
    truncation_factor,
)

E_PRIME = 226e9


def rigid_line(inlet=math.inf, rise=lambda x: x * x):
    """Reynolds' equation of a rigid isoviscous line contact, gap H = 1 + rise(x), by quadrature.

    Lengths over sqrt(2 R h_0), gap over h_0. Returns load over eta u R/h_0, F_R over eta u sqrt(R/h_0) and the
    dissipation over eta u^2 sqrt(R/h_0).
    """

    def gap(x):
        return 1.0 + rise(x)

    def integral(function, exit_):
        parts = [-inlet, -30.0, exit_] if inlet > 30.0 else [-inlet, exit_]
        return sum(quad(function, a, b, limit=500)[0] for a, b in pairwise(parts))

    # p' = 12 eta u (h - h_exit)/h^3; the pressure vanishes at inlet and exit
    c = brentq(lambda c: integral(lambda x: (gap(x) - gap(c)) / gap(x) ** 3, c), 1e-3, 0.7)
    load = -24.0 * integral(lambda x: x * (gap(x) - gap(c)) / gap(x) ** 3, c)
    force = 6.0 * math.sqrt(2.0) * integral(lambda x: (gap(x) - gap(c)) / gap(x) ** 2, c)
    dissipation = 12.0 * math.sqrt(2.0) * integral(lambda x: (gap(x) - gap(c)) ** 2 / gap(x) ** 3, c)
    return load, force, dissipation


def circle(h_0):
    """Rise of a circle over h_0 [R], in the coordinates of rigid_line."""
    return lambda x: (1.0 - math.sqrt(max(0.0, 1.0 - 2.0 * h_0 * x * x))) / h_0


def test_rigid_line_against_direct_integration():
    load, force, dissipation = rigid_line()
    # 4.896 eta u R/h_0 is Martin's load
    assert abs(load - 4.895) <= 1e-3
    assert abs(force / math.sqrt(load) - RIGID_LINE) <= 1e-5
    # the power of both surfaces is what the film dissipates
    assert abs(rolling_power(force, 1.0) / dissipation - 1.0) <= 1e-8
    assert (
        abs(rigid_line_force(2e4, 0.5, 0.1) / (force / math.sqrt(load) * math.sqrt(2e4 * 0.5 * 0.1)) - 1.0)
        <= 1e-5
    )


@pytest.mark.parametrize(("h_0", "deviation"), [(1e-5, 0.03), (1e-4, 0.005), (1e-3, 0.07)])
def test_rigid_limit_of_the_line_against_a_circle_flooded_from_one_radius(h_0, deviation):
    """Biboulet & Houpert: oil from x = -R; their 1.42 is the middle of their films."""
    load, force, _ = rigid_line(0.999999 * math.sqrt(0.5 / h_0), circle(h_0))
    direct = force / math.sqrt(load)  # F_R/sqrt(eta u w)
    fit = biboulet_houpert_line(1e-3, 1.0, 0.01, E_PRIME, 0.1).rigid_isoviscous / math.sqrt(1e-3 * 0.1)
    assert abs(fit / direct - 1.0) <= deviation


def rigid_ellipse(radius_ratio, h_0, nodes=(121, 61)):
    """The same of a rigid ellipse, gap of a circle in both directions, by finite volumes with Reynolds' exit.

    Lengths over sqrt(2 R h_0) of each direction, h_0 over R_x. Returns the integrals of p, of h dp/dx and of the
    dissipation in these units.
    """
    far = 0.999 * math.sqrt(0.5 / h_0)
    x = np.sinh(np.linspace(-math.asinh(far), math.asinh(3.0), nodes[0]))
    y = np.sinh(np.linspace(0.0, math.asinh(far), nodes[1]))
    middle_x, middle_y = 0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1])
    dx, dy = np.diff(middle_x, prepend=x[0], append=x[-1]), np.diff(middle_y, prepend=y[0], append=y[-1])

    def gap(x, y):
        return 1.0 + (1.0 - np.sqrt(1.0 - np.minimum(2.0 * h_0 * (x**2 + y**2), 1.0))) / h_0

    along = gap(middle_x[:, None], y) * dy
    k_x = gap(middle_x[:, None], y) ** 3 * dy / np.diff(x)[:, None]
    k_y = radius_ratio * gap(x[:, None], middle_y) ** 3 * dx[:, None] / np.diff(y)
    index = np.arange(x.size * y.size).reshape(x.size, y.size)
    pairs = [(index[:-1], index[1:], k_x), (index[:, :-1], index[:, 1:], k_y)]
    a, b, k = (np.concatenate([np.ravel(pair[i]) for pair in pairs]) for i in range(3))
    matrix = sparse.csr_matrix((np.r_[k, k, -k, -k], (np.r_[a, b, a, b], np.r_[a, b, b, a])))
    supply = np.zeros(index.shape)
    supply[:-1] -= along
    supply[1:] += along
    inner = np.zeros(index.shape, bool)
    inner[1:-1, :-1] = True
    inner, supply, p = inner.ravel(), supply.ravel(), np.zeros(index.size)
    full = inner.copy()
    for _ in range(60):
        here = np.flatnonzero(full)
        p[:] = 0.0
        p[here] = spsolve(matrix[here][:, here].tocsc(), supply[here])
        update = inner & ((p > 0.0) | (~full & (supply - matrix @ p > 0.0)))
        if np.array_equal(update, full):
            break
        full = update
    else:
        pytest.fail("the exit of the film has not been found")
    p = p.reshape(index.shape)
    d_x, d_y = np.diff(p, axis=0), np.diff(p, axis=1)
    return (
        2.0 * np.sum(p * dx[:, None] * dy),
        2.0 * np.sum(d_x * along),
        2.0 * (np.sum(d_x**2 * k_x) + np.sum(d_y**2 * k_y)),
    )


# deviations found: +11, -11, -13 and -3 %; the paper prints none.  1 % for the grid
@pytest.mark.parametrize(("R_y", "h_0", "low", "high"), [
    (2e-3, 1e-4, 0.10, 0.13), (2e-2, 1e-4, -0.12, -0.09), (5.6e-2, 1e-4, -0.14, -0.11), (5.6e-2, 1e-5, -0.04, -0.02),
])  # fmt: skip
def test_rigid_limit_of_the_ellipse_against_a_solution_in_two_dimensions(R_y, h_0, low, high):
    R_x, eta0, u_e = 2e-3, 0.1, 1.0
    p, work, dissipation = rigid_ellipse(R_x / R_y, h_0)
    load = 12.0 * eta0 * u_e * 2.0 * R_x * math.sqrt(2.0 * R_y / (h_0 * R_x)) * p
    force = 12.0 * eta0 * u_e * math.sqrt(R_x * R_y) * work
    assert abs(dissipation / work - 1.0) <= 1e-9
    fit = biboulet_houpert_point(load, u_e, R_x, R_y, E_PRIME, eta0).rigid_isoviscous
    assert low <= fit / force - 1.0 <= high


def line_case(U, W, G=4000.0):
    """Arguments of a line contact from the papers' groups, U with the factor 2."""
    R = 0.01
    return {
        "load_per_length": W * E_PRIME * R,
        "u_e": 0.5 * U * E_PRIME * R / 0.1,
        "R": R,
        "E_prime": E_PRIME,
        "eta0": 0.1,
    }


def test_numbers_printed_for_the_line():
    """Biboulet & Houpert part 1, after Eq. (44): 14.2e-9, 8.26e-9, and 1.00 of Goksem & Hargreaves, to the digit."""
    unit = E_PRIME * 0.01
    assert abs(biboulet_houpert_line(**line_case(1e-10, 1e-6)).rigid_isoviscous / unit - 14.2e-9) <= 0.05e-9
    elastic = biboulet_houpert_line(**line_case(1e-11, 1e-4)).elastic / unit
    assert abs(elastic - 8.26e-9) <= 0.01e-9
    goksem = goksem_hargreaves_line(**line_case(1e-11, 1e-4), alpha_pv=4000.0 / E_PRIME) / unit
    assert abs(goksem / elastic - 1.00) <= 0.005


def test_limits_of_the_line():
    light, heavy = (biboulet_houpert_line(**line_case(1e-10, W)) for W in (1e-8, 1e-3))
    assert abs(light.force / light.rigid_isoviscous - 1.0) <= 1e-6
    # 1.42 1.45/1.4 = 1.4707 for 1.47
    assert abs(heavy.force / heavy.elastic - 1.0) <= 1e-3
    assert abs(light.M / (1e-8 / 1e-5) - 1.0) <= 1e-12
    loads = np.geomspace(1e-8, 1e-2, 60) * E_PRIME * 0.01
    forces = biboulet_houpert_line(loads, 1.0, 0.01, E_PRIME, 0.1).force
    assert np.min(np.diff(forces)) >= -1e-12 * forces[-1]


def point_case(U, W, kappa):
    """Arguments of an elliptical contact from the papers' groups and b/a, at R_x = 2 mm."""
    R_x = 2e-3
    ratio = brentq(lambda r: np.divide(*ellipse(1.0, R_x, r * R_x, E_PRIME)[1::-1]) - kappa, 1.0, 1e5)
    return {"load": W * E_PRIME * R_x**2, "u_e": 0.5 * U * E_PRIME * R_x / 0.1, "R_x": R_x, "R_y": ratio * R_x,
            "E_prime": E_PRIME, "eta0": 0.1}  # fmt: skip


def test_numbers_printed_for_the_point():
    """Biboulet & Houpert part 2, section 3.4: 10.9e-9 and the ratios 0.624 and 0.734 of Houpert's forces."""
    elastic = biboulet_houpert_point(**point_case(1e-11, 1e-5, 0.01))
    assert abs(elastic.elastic / (E_PRIME * 4e-6) - 10.9e-9) <= 0.1e-9
    old = houpert_point(**point_case(1e-11, 1e-5, 0.01), alpha_pv=4000.0 / E_PRIME)
    assert abs(old.elastic / elastic.elastic - 0.734) <= 0.01
    # printed after approximating R_x/R_z by a power of kappa, which is 7 % off here
    case = point_case(1e-10, 1e-7, 0.01)
    rigid = biboulet_houpert_point(**case).rigid_isoviscous
    assert abs(houpert_point(**case, alpha_pv=2e-8).rigid_isoviscous / rigid - 0.624) <= 0.05


@pytest.mark.parametrize("kappa", [0.02, 0.12, 0.5])
def test_both_printed_lines_of_houperts_forces(kappa):
    """Part 2, Eqs. (28) and (29): 0.34 and 0.674 with the length of the ellipse, to their digits."""
    U, W, G = 1e-10, 1e-5, 4000.0
    case = point_case(U, W, kappa)
    contact, R_x = ellipse(case["load"], case["R_x"], case["R_y"], E_PRIME), case["R_x"]
    beta, length = contact.b * E_PRIME / (math.pi * contact.p_max * R_x), 2.0 * contact.a / R_x
    rigid = 0.34 * beta ** (-1 / 3) * (R_x / case["R_y"]) ** -0.358 * kappa**0.636 * length * U**0.636
    elastic = 0.674 * kappa**-0.043 * length * U**0.656 * (kappa * W) ** 0.133 * G**0.022
    force, unit = houpert_point(**case, alpha_pv=G / E_PRIME), E_PRIME * R_x**2
    assert abs(force.rigid_isoviscous / unit / (rigid * (kappa * W) ** 0.031) - 1.0) <= 0.015
    assert abs(force.elastic / unit / elastic - 1.0) <= 0.007


@pytest.mark.parametrize("k", [5.0, 10.0, 28.0, 60.0])
@pytest.mark.parametrize("load", [0.1, 20.0])
def test_second_print_of_the_point(k, load):
    """Balan, Houpert, Tufescu & Olaru, Lubricants 3 (2015) 222, Eqs. (1) to (4): powers of k for the ellipse."""
    R_x, u_e, eta0 = 2e-3, 1.0, 0.1
    U, W, unit = eta0 * u_e / (E_PRIME * R_x), load / (E_PRIME * R_x**2), E_PRIME * R_x**2
    rigid = 2.9766 * unit * k**0.3316 * W ** (1 / 3) * U ** (2 / 3)
    elastic = 7.5826 * unit * k**0.4055 * W ** (1 / 3) * U**0.75
    M = 0.5549 * k**-0.6029 * W * U**-0.75
    printed = rigid, elastic, M, (rigid - elastic) / (1.0 + M / 6.6) + elastic
    force = biboulet_houpert_point(load, u_e, R_x, k * R_x, E_PRIME, eta0)
    ours = force.rigid_isoviscous, force.elastic, force.M, force.force
    # their fit of the ellipse by a power of k
    assert np.max(np.abs(np.divide(ours, printed) - 1.0)) <= 0.025


def test_limits_of_the_point():
    light, heavy = (biboulet_houpert_point(load, 1.0, 2e-3, 5e-2, E_PRIME, 0.1) for load in (1e-5, 1e5))
    assert abs(light.force / light.rigid_isoviscous - 1.0) <= 1e-3
    assert abs(heavy.force / heavy.elastic - 1.0) <= 1e-3
    # both are proportional to the length of the ellipse, F^(1/3), in their limits; the rigid one does not know E'
    soft = biboulet_houpert_point(1e-5, 1.0, 2e-3, 5e-2, 0.5 * E_PRIME, 0.1)
    assert abs(soft.rigid_isoviscous / light.rigid_isoviscous - 1.0) <= 1e-12
    loads, speeds = np.geomspace(1e-3, 1e3, 40), np.geomspace(1e-3, 10.0, 40)
    assert np.min(np.diff(biboulet_houpert_point(loads, 1.0, 2e-3, 5e-2, E_PRIME, 0.1).force)) > 0.0
    assert np.min(np.diff(biboulet_houpert_point(20.0, speeds, 2e-3, 5e-2, E_PRIME, 0.1).force)) > 0.0
    assert np.min(np.diff(houpert_point(20.0, speeds, 2e-3, 5e-2, E_PRIME, 0.1, 2e-8).force)) > 0.0
    alone = [float(biboulet_houpert_point(load, 1.0, 2e-3, 5e-2, E_PRIME, 0.1).force) for load in loads]
    together = biboulet_houpert_point(loads, 1.0, 2e-3, 5e-2, E_PRIME, 0.1).force
    assert np.max(np.abs(alone / together - 1.0)) <= 1e-14


@pytest.mark.parametrize(
    ("inlet", "deviation"), [(2.0, 0.1), (3.0, 0.05), (5.0, 0.02), (10.0, 0.04), (50.0, 0.03)]
)
def test_starvation_against_direct_integration(inlet, deviation):
    """The same load with less oil: h_0 follows from the load, S is the gap at the inlet over the flooded film."""
    (load, force, _), (flooded, flooded_force, _) = rigid_line(inlet), rigid_line()
    S = (1.0 + inlet**2) * load / flooded
    direct = force / flooded_force * math.sqrt(flooded / load)
    assert abs(starvation_factor(S) - direct) <= deviation


def test_factors():
    S = np.geomspace(2.0, 1e6, 80)
    assert np.min(np.diff(starvation_factor(S))) > 0.0
    assert abs(starvation_factor(1e8) - 1.0) <= 1e-6
    assert abs(starvation_factor(2.0) - (4 + 325.6) / (4 + 386.2 + 1257)) <= 1e-12
    assert inlet_heating_factor(0.0) == 1.0
    assert abs(inlet_heating_factor(1.0) - 1 / 1.29) <= 1e-15
    assert np.max(np.diff(inlet_heating_factor(np.linspace(0.0, 40.0, 50)))) < 0.0
    assert truncation_factor(50.0, 0.1, 0.0) == 1.0
    ratio = np.linspace(0.0, 1.0, 30)
    assert np.max(np.diff(truncation_factor(50.0, 0.1, ratio))) < 0.0
    c = 0.85 / (1 + 4.72 * 50**-0.39 * 0.1 ** (0.484 * 50**0.165))
    assert abs(truncation_factor(50.0, 0.1, 1.0) - c) <= 1e-14
    half = 1 / (1 + (1 / c - 1) * 0.5 ** (1.9 * (0.09 + 1.33)))
    assert abs(truncation_factor(50.0, 0.1, 0.5) - half) <= 1e-14


def test_a_truncated_long_ellipse_is_a_line():
    """What the paper says of the truncation factor: within a few per cent."""
    R_x, R_y, load = 5e-3, 20.0, 2e3
    point, contact = (
        biboulet_houpert_point(load, 1.0, R_x, R_y, E_PRIME, 0.1),
        ellipse(load, R_x, R_y, E_PRIME),
    )
    length = 2.0 * contact.a
    line = biboulet_houpert_line(load / length, 1.0, R_x, E_PRIME, 0.1).force * length
    cut = point.force * truncation_factor(point.M, contact.b / contact.a, 1.0)
    assert abs(cut / line - 1.0) <= 0.06


def test_power():
    assert np.max(np.abs(rolling_power(np.array([0.0, 0.1]), 0.5) - np.array([0.0, 0.1]))) <= 1e-16


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_bad_input(bad):
    with pytest.raises(ValueError, match=r"load = .* N; needs finite, > 0: check preload"):
        biboulet_houpert_point(bad, 1.0, 2e-3, 5e-2, E_PRIME, 0.1)
    with pytest.raises(ValueError, match=r"u_e = .* m/s; needs finite, > 0"):
        houpert_point(10.0, bad, 2e-3, 5e-2, E_PRIME, 0.1, 2e-8)
    with pytest.raises(ValueError, match=r"alpha_pv = .* 1/Pa"):
        houpert_point(10.0, 1.0, 2e-3, 5e-2, E_PRIME, 0.1, bad)
    with pytest.raises(ValueError, match=r"load_per_length = .* N/m"):
        biboulet_houpert_line(bad, 1.0, 0.01, E_PRIME, 0.1)
    with pytest.raises(ValueError, match=r"eta0 = .* Pa s"):
        rigid_line_force(1e4, 1.0, bad)
    with pytest.raises(ValueError, match=r"R = .* m;"):
        goksem_hargreaves_line(1e4, 1.0, bad, E_PRIME, 0.1, 2e-8)
    with pytest.raises(ValueError, match="M = "):
        truncation_factor(bad, 0.1, 0.5)
    with pytest.raises(ValueError, match="axes_ratio = "):
        truncation_factor(10.0, bad, 0.5)
    with pytest.raises(ValueError, match=r"inlet_ratio = .*needs finite, >= 2"):
        starvation_factor(bad)


@pytest.mark.parametrize("bad", [-1.0, math.nan, math.inf])
def test_negative_input(bad):
    with pytest.raises(ValueError, match=r"force = .* N; needs finite, >= 0"):
        rolling_power(bad, 1.0)
    with pytest.raises(ValueError, match="N = "):
        inlet_heating_factor(bad)
    with pytest.raises(ValueError, match="length_ratio = "):
        truncation_factor(10.0, 0.1, bad)


def test_rolling_along_the_long_axis():
    with pytest.raises(ValueError, match="R_x <= R_y"):
        biboulet_houpert_point(10.0, 1.0, 5e-2, 2e-3, E_PRIME, 0.1)


def test_replenishment_falls_with_speed_and_viscosity_and_is_one_when_flooded():
    speeds = np.array([0.0, 100.0, 1000.0, 5000.0])
    factor = replenishment_factor(6e-8, 4.4, speeds, 100.0, 32.0, 48.0)
    assert factor[0] == 1.0
    assert np.all(np.diff(factor) < 0.0)
    assert np.all(replenishment_factor(0.0, 4.4, speeds, 100.0, 32.0, 48.0) == 1.0)
    # the exponent is linear in each of its factors
    assert (
        np.max(np.abs(np.log(replenishment_factor(3e-8, 4.4, speeds, 200.0, 32.0, 48.0)) - np.log(factor)))
        <= 1e-12
    )


@pytest.mark.parametrize(
    "bad", [{"K_rs": -1.0}, {"speed_rpm": math.nan}, {"bore_mm": 48.0}, {"bore_mm": 0.0}]
)
def test_replenishment_refuses_bad_input(bad):
    good = {
        "K_rs": 6e-8,
        "K_z": 4.4,
        "speed_rpm": 1.0,
        "viscosity_mm2_s": 1.0,
        "bore_mm": 32.0,
        "outer_mm": 48.0,
    }
    with pytest.raises(ValueError, match=next(iter(bad))):
        replenishment_factor(**(good | bad))
