"""Balances of a solved contact: load, mass, heat, power of the surfaces, traction against viscosity and sliding."""

import numpy as np
import pytest
from contact_cases import CIRCLE, LONG, OIL, STEEL, conditions, grid_of, moes, options, solved
from scipy.integrate import quad, trapezoid

from ballscrew_tehl.contact import reference_oil
from ballscrew_tehl.contact.film.linear import Linearisation
from ballscrew_tehl.contact.film.reynolds import FLOOR_SHARE
from ballscrew_tehl.contact.problem import ContactProblem
from ballscrew_tehl.physics import lubricant

GIVEN = {"x_in": -4.0, "x_out": 1.5, "y_max": 1.5}  # a domain that is given has P = 0 on its edges
ISOTHERMAL_CASES = {
    "long ellipse": (1000.0, 10.0, LONG, "roelands", {}),
    "thick film": (5.0, 2.0, CIRCLE, "barus", {}),
    "given domain": (200.0, 10.0, 0.2, "roelands", GIVEN),
}
#: points at which the balances must close, easy and hard ones
HOT_CASES = {
    "rolling": conditions(srr=0.0), "much sliding": conditions(srr=1.5), "wall at rest": conditions(srr=-2.0),
    "thick film, sliding": conditions(load=1.0, u_e=5.0, srr=1.0), "backwards": conditions(u_e=-2.0, srr=0.5),
}  # fmt: skip


def carried(solution):
    """Load by the trapezoidal rule. Beyond an open side pressure falls with the square of the distance."""
    grid = grid_of(solution)
    lines = trapezoid(solution.pressure, grid.x, axis=1)
    load = 2.0 * trapezoid(lines, grid.y)
    if grid.open_side:
        last, border = grid.y[-2], grid.y[-2] + 0.5 * grid.h_y
        load += 2.0 * lines[-2] * quad(lambda y: (y / last) ** -2, border, np.inf)[0]
    return load


def outflow(solution, problem, film):
    """Net outflow of every inner cell over the gap, from the fluxes of the faces, which are counted upstream."""
    floor = FLOOR_SHARE * problem.scales.film_estimate
    linear = Linearisation(problem.geometry, solution.state, film, floor)
    flux_x, flux_y = -linear.faces.flow_x, -linear.faces.flow_y
    grid, inner = problem.geometry.grid, problem.geometry.grid.inner
    along = np.diff(flux_x, axis=1)[inner[0]] / grid.width_x[1:-1]
    # the flux through the line of symmetry is that of its neighbour with opposite sign
    across = np.diff(np.concatenate([-flux_y[:1], flux_y]), axis=0)[:, 1:-1] * problem.geometry.mesh.kappa_h
    return (along + across) / solution.state.gap[inner], solution.state.p[inner]


@pytest.mark.slow
@pytest.mark.parametrize("case", ISOTHERMAL_CASES.values(), ids=ISOTHERMAL_CASES)
def test_pressure_carries_the_load_and_no_mass_is_lost(case):
    *numbers, law, domain = case
    solution = moes(*numbers, law, n_x=65, n_y=17, tolerance=1e-8, **domain).result
    assert solution.choice.open_side == (not domain)
    # tolerance of the solver 1e-4; tiny negative pressures of the cavitated part are reported as zero
    assert carried(solution) == pytest.approx(solution.conditions.load, rel=1e-4)
    problem = ContactProblem(
        solution.conditions, reference_oil(law), (STEEL, STEEL), options(thermal=False), solution.choice
    )
    out, p = outflow(solution, problem, problem.film(problem.uniform_temperature()))
    assert np.count_nonzero(p > 1e-5) > 250
    # residual of Newton's method at a change of 1e-8 p_max; 2e-9 to 1e-5 found
    assert np.abs(out[p > 1e-5]).max() <= 5e-5
    # where it cavitates the flux of the full gap grows, and nowhere else
    assert out[p <= 0.0].min() > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("name", HOT_CASES)
def test_balances_of_a_hot_contact(name):
    at = HOT_CASES[name]
    solution = solved(at, tolerance=1e-6)
    assert carried(solution) == pytest.approx(at.load, rel=1e-4)
    problem = ContactProblem(at, OIL, (STEEL, STEEL), options(), solution.choice)
    it = problem.start(solution.state)
    problem.update_flow(it, solution.temperature)
    out, p = outflow(solution, problem, problem.film(solution.temperature, it.heat))
    assert np.abs(out)[p > 1e-4].max() <= 3e-3
    heat = solution.heat_balance
    assert min(heat.generated, heat.conducted) > 0.0
    # conservative scheme: the rest is the last change of the iteration
    assert abs(heat.generated - heat.conducted - heat.convected) <= 1e-4 * heat.generated
    assert heat.defect == pytest.approx(
        (heat.generated - heat.conducted - heat.convected) / max(heat.generated, heat.conducted), abs=1e-15
    )
    # the energy equation is solved up to 400 films, shear and compression are those of the whole grid
    assert 0.7 < heat.generated / (solution.shear_heat + solution.compression_heat) < 1.001
    work = solution.traction_force * (at.u_1 - at.u_2)
    assert solution.sliding_heat == pytest.approx(work, rel=1e-9, abs=1e-9)
    # both surfaces together lose what heats the film, without the compression; less what lies beyond the grid
    lost = -(solution.traction_force_1 * at.u_1 + solution.traction_force_2 * at.u_2)
    beyond = abs(at.u_e) * solution.resistance_beyond
    assert lost - beyond == pytest.approx(solution.shear_heat, rel=0.06 if "rolling" in name else 0.02)
    # the walls share the rolling resistance, against the motion
    walls = solution.traction_force_1 + solution.traction_force_2
    assert walls == pytest.approx(-np.sign(at.u_e) * solution.rolling_resistance, rel=1e-9)
    if abs(at.u_1 - at.u_2) < abs(at.u_e) and name != "rolling":
        # pressure flow and compression add little to the work of traction
        assert 1.0 < heat.generated / solution.sliding_heat < 1.1
    # oil enters at the temperature of the bath
    np.testing.assert_array_equal(solution.temperature[:-1, 0, 1:-1], at.temperature)


def test_isothermal_traction_is_viscosity_times_shear_rate():
    """One viscosity through the film: mid-film stress eta (u_b - u_a)/h, by the oil's own law."""
    at = conditions(load=3.0, srr=0.1)
    solution = solved(at, thermal=False)
    eta = lubricant.viscosity(OIL, solution.pressure, at.temperature)
    slip = at.u_1 - at.u_2
    force = float(np.sum(grid_of(solution).weights * eta / solution.film * slip))
    assert solution.traction_force == pytest.approx(force, rel=1e-4)
    assert solution.sliding_heat == pytest.approx(force * slip, rel=1e-4)
