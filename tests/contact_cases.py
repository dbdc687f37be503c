"""Operating points shared by the tests of the contact solver, each solved once per run."""

from functools import lru_cache

from reference_screw import GD4008

from ballscrew_tehl.contact.moes import MoesFilm, solve_moes
from ballscrew_tehl.contact.solve import ContactConditions, ContactSolution, SolverOptions, solve_contact
from ballscrew_tehl.hertz import E_prime, reduced_radii

OIL, STEEL = GD4008.lubricant, GD4008.solid
CHI = STEEL.thermal_conductivity / (STEEL.density * STEEL.specific_heat)
#: screw-side ellipse, radius ratio 0.0353
R_X, R_Y = (float(r) for r in reduced_radii(GD4008.screw, GD4008.screw.contact_angle, "screw"))
MODULUS = E_prime(GD4008.screw)
LONG, CIRCLE = 0.0353, 1.0


def conditions(load=30.0, u_e=2.0, srr=0.5, temperature=303.15) -> ContactConditions:
    """A screw-side contact; u_1 is the faster body for srr > 0."""
    return ContactConditions(
        load, R_X, R_Y, u_e * (1.0 + 0.5 * srr), u_e * (1.0 - 0.5 * srr), temperature, MODULUS
    )


@lru_cache(maxsize=64)
def solved(at: ContactConditions, **options) -> ContactSolution:
    """Solution on a coarse grid unless said otherwise."""
    solution = solve_contact(at, OIL, STEEL, SolverOptions(**({"n_x": 65, "n_y": 9, "n_z": 8} | options)))
    assert solution.converged, solution.reason
    return solution


@lru_cache(maxsize=64)
def moes(M, L, radius_ratio, law, **options) -> MoesFilm:
    """Isothermal film; default grid unless said otherwise."""
    film = solve_moes(M, L, radius_ratio, law, SolverOptions(thermal=False, **options))
    assert film.solution.converged, film.solution.reason
    return film
