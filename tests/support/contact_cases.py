"""Operating points shared by the tests of the contact solver, each solved once per run."""

from functools import lru_cache

from reference_screw import GD4008

from ballscrew_tehl.contact import ContactConditions, SolverOptions, solve, solve_moes
from ballscrew_tehl.contact.grid import Grid
from ballscrew_tehl.physics.hertz import E_prime, reduced_radii

OIL, STEEL = GD4008.lubricant, GD4008.solid
#: screw-side ellipse, radius ratio 0.0353
R_X, R_Y = (float(r) for r in reduced_radii(GD4008.screw, GD4008.screw.contact_angle, "screw"))
MODULUS = E_prime(GD4008.screw)
LONG, CIRCLE = 0.0353, 1.0


def conditions(load=30.0, u_e=2.0, srr=0.5, temperature=303.15) -> ContactConditions:
    """A screw-side contact; u_1 is the faster body for srr > 0."""
    u_1, u_2 = u_e * (1.0 + 0.5 * srr), u_e * (1.0 - 0.5 * srr)
    return ContactConditions(load, R_X, R_Y, u_1, u_2, temperature, MODULUS)


def options(**changed) -> SolverOptions:
    """Options of a coarse grid, with changes."""
    return SolverOptions(**({"n_x": 65, "n_y": 9, "n_z": 8} | changed))


@lru_cache(maxsize=128)
def solved(at: ContactConditions, **changed):
    """Solution of the oil."""
    result = solve(at, OIL, STEEL, options(**changed))
    assert result.converged, result.reason
    return result


@lru_cache(maxsize=128)
def moes(M, L, radius_ratio, law, **options):
    """Isothermal film, on the default grid unless options are given."""
    film = solve_moes(M, L, radius_ratio, law, SolverOptions(thermal=False, **options))
    assert film.result.converged, film.result.reason
    return film


def grid_of(solution) -> Grid:
    """Grid in metres."""
    hertz = solution.hertz
    return Grid(solution.x * hertz.b, solution.y * hertz.a, solution.choice.open_side)
