"""Convergence orders of the contact solver: deflection, Reynolds residual, film over the grid and over the layers."""

import numpy as np
import pytest
from contact_cases import CIRCLE, LONG, conditions, moes, solved

from ballscrew_tehl.contact.film import fluxes
from ballscrew_tehl.contact.grid import Grid, GridChoice
from ballscrew_tehl.contact.half_space import deflection_operator


def fitted_order(sizes, errors):
    """Slope of log error over log spacing."""
    return -np.polyfit(np.log(sizes), np.log(np.abs(errors)), 1)[0]


def weighted_rms(field, weights):
    return float(np.sqrt(np.sum(weights * field**2) / np.sum(weights)))


SIZES = [(33, 9), (65, 17), (129, 33)]


def test_deflection_of_a_smooth_pressure_is_of_second_order():
    """P = (1 - r^2)^(3/2): integral of P/r is 3 pi^2/8 (1 - r^2 + 3/8 r^4); Hertz pressures added over all radii."""
    errors = []
    for n_x, n_y in SIZES:
        grid = GridChoice(-1.5, 1.5, 1.25, n_x, n_y, 0.2).build()
        r_2 = grid.x**2 + grid.y[:, None] ** 2
        deflection = deflection_operator(grid, 1.0, 1.0)(np.maximum(0.0, 1.0 - r_2) ** 1.5)
        exact = 3.0 * np.pi**2 / 8.0 * (1.0 - r_2 + 0.375 * r_2**2)
        errors.append(weighted_rms((deflection - exact)[r_2 < 1.0], grid.weights[r_2 < 1.0]))
    assert 1.8 < fitted_order([n for n, _ in SIZES], errors) < 2.4
    assert errors[-1] <= 5e-4 * exact.max()


def manufactured_residual(n_x, n_y):
    """Residual of smooth fields minus its exact value, on a smoothly graded grid."""
    s = np.linspace(-1.0, 1.0, n_x)
    grid = Grid(1.2 * s + 0.3 * s**3, np.linspace(0.0, 1.0, n_y))
    x, y, kappa = grid.x[None, :], grid.y[:, None], 0.4
    p = np.exp(-(x**2)) * np.cos(0.5 * np.pi * y)
    gap = 0.5 + 0.2 * x**2 + 0.1 * y**2 + 0.05 * x
    ln_phi, g = -1.5 * p, 1.0 + 0.2 * p
    # exact: d/dx (H^3 phi p_x) + kappa^2 d/dy (H^3 phi p_y) - d/dx (g H)
    p_x, p_y = -2.0 * x * p, -0.5 * np.pi * np.exp(-(x**2)) * np.sin(0.5 * np.pi * y)
    p_xx, p_yy = (4.0 * x**2 - 2.0) * p, -0.25 * np.pi**2 * p
    h_x, h_y = 0.4 * x + 0.05, 0.2 * y
    e = gap**3 * np.exp(ln_phi)
    along = e * (p_xx + 3.0 * h_x / gap * p_x - 1.5 * p_x**2)
    across = e * (p_yy + 3.0 * h_y / gap * p_y - 1.5 * p_y**2)
    exact = along + kappa**2 * across - (g * h_x + 0.2 * p_x * gap)
    mesh = fluxes.Mesh(grid.x, grid.width_x, kappa / grid.h_y, False, fluxes.wedge_weights(grid.x))
    faces = fluxes.face_fluxes(mesh, p, gap, ln_phi, g, 1e-9)
    out = fluxes.net_flow(mesh, faces.flow_x, faces.flow_y)
    # the first two columns next to the inlet are upwinded with first order
    return weighted_rms((out - exact)[:-1, 3:-1], grid.weights[:-1, 3:-1])


def test_reynolds_residual_of_a_manufactured_solution_is_of_second_order():
    errors = [manufactured_residual(n_x, n_y) for n_x, n_y in SIZES]
    assert 1.8 < fitted_order([n for n, _ in SIZES], errors) < 2.2
    assert errors[-1] <= 2e-3


#: (M, L, ratio, law), grids; 33 nodes are enough for a thick film only
HALVINGS = {
    "circle": ((20.0, 5.0, CIRCLE, "roelands"), [(33, 9), (65, 17), (129, 33)]),
    "long ellipse": ((1000.0, 10.0, LONG, "roelands"), [(65, 9), (129, 17), (257, 33)]),
    "thick film": ((5.0, 2.0, 0.2, "barus"), [(33, 9), (65, 17), (129, 33)]),
}


def family(case, grids):
    """Solutions on exactly these grids; the solver has doubled none."""
    solutions = [moes(*case, n_x=n_x, n_y=n_y, tolerance=1e-6).result for n_x, n_y in grids]
    assert [(s.choice.n_x, s.choice.n_y) for s in solutions] == grids
    return solutions


@pytest.mark.slow
@pytest.mark.parametrize(("case", "grids"), HALVINGS.values(), ids=HALVINGS)
def test_central_film_is_of_second_order(case, grids):
    solutions = family(case, grids)
    films = [s.grid_film for s in solutions]
    steps = np.diff(films)
    assert np.all(steps > 0.0) or np.all(steps < 0.0)
    # 1.80 to 1.99 found
    assert 1.75 < fitted_order([n_x - 1 for n_x, _ in grids[1:]], steps) < 2.25
    exact, middle = films[-1] + (films[-1] - films[-2]) / 3.0, solutions[1]
    plain, reported = films[1] / exact - 1.0, middle.h_c / exact - 1.0
    assert abs(plain) > 2e-3
    assert abs(reported) <= min(0.25 * abs(plain), middle.error_estimate)
    # a quarter of the error of the film of the grid: not an empty bound
    assert 0.8 < middle.error_estimate / (0.25 * abs(plain)) < 1.25


@pytest.mark.slow
def test_thermal_results_are_of_second_order_or_better_in_the_layers():
    """Integrals of fourth order, energy equation of second: 1.9 to 3.2 found, depending on which dominates."""
    layers = (8, 16, 32)
    solutions = [solved(conditions(srr=1.0), n_z=n_z, tolerance=1e-6) for n_z in layers]
    for values, bound in (
        ([s.grid_film for s in solutions], 3e-4),
        ([s.traction_force for s in solutions], 2e-3),
    ):
        steps = np.diff(values)
        assert fitted_order(layers[1:], steps) > 1.7
        assert abs(steps[-1]) <= bound * abs(values[-1])
