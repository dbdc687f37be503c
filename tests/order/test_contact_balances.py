"""Balances of a solved contact, evaluated from its result alone: load, mass, heat, wall temperatures."""

import contact_twins as twins
import numpy as np
import pytest
from contact_cases import CHI, CIRCLE, LONG, OIL, STEEL, conditions, moes, solved
from scipy.integrate import trapezoid

from ballscrew_tehl import lubricant
from ballscrew_tehl.contact.grid import Grid
from ballscrew_tehl.contact.moes import reference_oil
from ballscrew_tehl.contact.walls import wall_operator

ISOTHERMAL = {
    "circle": (200.0, 10.0, CIRCLE, "roelands"),
    "long ellipse": (1000.0, 10.0, LONG, "roelands"),
    "barus": (100.0, 5.0, 0.2, "barus"),
    "thick film": (5.0, 2.0, CIRCLE, "roelands"),
}


def grid_of(solution):
    """Grid in metres."""
    return Grid(solution.x * solution.hertz.b, solution.y * solution.hertz.a)


@pytest.mark.parametrize("case", ISOTHERMAL.values(), ids=ISOTHERMAL)
def test_pressure_carries_the_load(case):
    solution = moes(*case, n_x=65, n_y=17).solution
    carried = np.sum(grid_of(solution).weights * solution.pressure)
    # 3e-5 found: the tiny negative pressures of the cavitated part are reported as zero
    assert carried == pytest.approx(solution.conditions.load, rel=1e-4)
    # every line by the trapezoidal rule instead of the cells of the solver: equal, pressure is zero on the edges
    plain = 2.0 * trapezoid(trapezoid(solution.pressure, grid_of(solution).x, axis=1), grid_of(solution).y)
    assert plain == pytest.approx(solution.conditions.load, rel=1e-4)


@pytest.mark.parametrize("srr", [0.0, 1.0])
def test_pressure_carries_the_load_when_hot(srr):
    solution = solved(conditions(srr=srr))
    carried = np.sum(grid_of(solution).weights * solution.pressure)
    assert carried == pytest.approx(solution.conditions.load, rel=1e-4)


def divergence(solution, law):
    """Divergence of the discrete mass flux in u_e h_c/b, by the NumPy twin in physical units and the oil's own laws."""
    grid, p, oil = grid_of(solution), solution.pressure, reference_oil(law)
    t = solution.conditions.temperature
    rho = lubricant.density(oil, p, t) / oil.density
    ln_phi = np.log(rho / (12.0 * lubricant.viscosity(oil, p, t)))
    u_e = solution.conditions.u_e
    flow_x, flow_y, *_ = twins.face_fluxes(
        grid.x, 1.0 / grid.h_y, p, solution.film, ln_phi, 0.0 * p, u_e * rho, lambda h: (h, np.ones_like(h))
    )
    out = twins.residual(grid.width_x, 1.0 / grid.h_y, flow_x, flow_y)
    return out * solution.hertz.b / (u_e * solution.h_c)


@pytest.mark.parametrize("case", ISOTHERMAL.values(), ids=ISOTHERMAL)
def test_mass_flux_has_no_divergence_under_pressure(case):
    solution = moes(*case, n_x=65, n_y=17, tolerance=1e-8).solution
    p = solution.pressure
    wet = p > 0.0
    # not beside a cavitated cell: the slightly negative pressures there are reported as zero
    inner = (
        wet[:-1, 1:-1]
        & wet[:-1, :-2]
        & wet[:-1, 2:]
        & np.vstack([wet[1:2], wet[:-2]])[:, 1:-1]
        & wet[1:, 1:-1]
    )
    inner |= wet[:-1, 1:-1] & (solution.x[1:-1] < -1.0)
    defect = np.abs(divergence(solution, case[3]))[:-1, 1:-1]
    assert inner.sum() > 200
    # what Newton's method leaves at a change of 1e-8 p_max, and 2e-6 of the interpolated viscosity at one temperature
    assert not defect[inner].max() > 1e-5
    # where it cavitates the film opens and the flux of the full gap grows
    cavitated = (p == 0.0) & (solution.x > 1.1)
    cavitated[-1] = cavitated[:, -1] = False
    assert divergence(solution, case[3])[cavitated].max() < 0.0


def test_flux_stays_on_its_line_through_the_middle():
    """Flux along rolling by central differences of the result: the contact is too stiff a place to leak sideways."""
    solution = moes(1000.0, 10.0, LONG, "roelands").solution
    oil, t = reference_oil("roelands"), solution.conditions.temperature
    p, h = solution.pressure[0], solution.film[0]
    rho = lubricant.density(oil, p, t) / oil.density
    slope = np.gradient(p, solution.x * solution.hertz.b)
    flux = solution.conditions.u_e * rho * h - rho * h**3 / (12.0 * lubricant.viscosity(oil, p, t)) * slope
    inside = np.abs(solution.x) < 0.8
    assert inside.sum() > 20
    assert not np.ptp(flux[inside]) > 0.01 * flux[inside].mean()


@pytest.mark.parametrize("srr", [0.5, 1.0, 1.5])
def test_heat_balance_closes_with_the_layers(srr):
    defects = [abs(solved(conditions(srr=srr), n_z=n_z).heat_balance.defect) for n_z in (5, 10, 20)]
    assert defects[0] > 2.0 * defects[1] > 4.0 * defects[2]
    assert not defects[1] > 0.03  # 0.9 to 1.6 % found
    assert not defects[2] > 0.01


def test_heat_balance_closes_in_pure_rolling():
    """Hard case: little heat, and compression in the inlet nearly cancels expansion at the outlet."""
    defects = [abs(solved(conditions(srr=0.0), n_z=n_z).heat_balance.defect) for n_z in (5, 10, 20)]
    assert defects[0] > 2.0 * defects[1] > 4.0 * defects[2]
    assert not defects[2] > 0.08  # 6.5 % found; 15 % at the default of 10 layers


def test_heat_balance_closes_with_a_wall_at_rest():
    defects = [abs(solved(conditions(srr=2.0), n_z=n_z).heat_balance.defect) for n_z in (5, 10, 20)]
    assert defects[0] > defects[1] > defects[2]
    assert not defects[2] > 0.02


def test_heat_is_mostly_the_work_of_traction():
    """Shear heat is traction times sliding plus what drives the pressure flow and compresses the oil: never less."""
    solution = solved(conditions(srr=1.0), n_z=20)
    c = solution.conditions
    work = solution.traction_force * (c.u_1 - c.u_2)
    assert 1.0 < solution.heat_balance.generated / work < 1.1
    assert solution.heat_balance.convected < 0.05 * solution.heat_balance.generated


@pytest.mark.parametrize("srr", [0.0, 1.0, 2.0])
def test_walls_have_the_temperature_of_the_heat_they_take(srr):
    """Flux from the result by one-sided differences, wall rise by the moving point source: T = T0 + K q."""
    solution = solved(conditions(srr=srr))
    t, h = solution.temperature, solution.film[..., None]
    dz = h / (t.shape[2] - 1)
    k_oil, k = OIL.thermal_conductivity, STEEL.thermal_conductivity
    grid = Grid(solution.x, solution.y)
    c, hertz = solution.conditions, solution.hertz
    for levels, speed in (((0, 1, 2), c.u_1), ((-1, -2, -3), c.u_2)):
        flux = (
            k_oil * (-1.5 * t[..., [levels[0]]] + 2.0 * t[..., [levels[1]]] - 0.5 * t[..., [levels[2]]]) / dz
        )[..., 0]
        flux[:, [0, -1]] = flux[-1] = 0.0
        rise = wall_operator(grid, hertz.b / hertz.a, hertz.b, speed, k, CHI)(flux)
        # the iteration stops at a change of 1e-4 of the largest rise
        assert not np.abs(t[..., levels[0]] - c.temperature - rise).max() > 2e-3 * solution.temperature_rise


def test_oil_enters_at_the_temperature_of_the_bath():
    solution = solved(conditions(srr=1.0))
    inflow = solution.temperature[:-1, 0, 1:-1]
    np.testing.assert_array_equal(inflow, OIL.reference_temperature + 0.15)
