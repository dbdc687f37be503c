"""Operating points shared by the tests of the contact solver, each solved once per run."""

from functools import lru_cache

import numpy as np
from reference_screw import GD4008

from ballscrew_tehl.contact.conditions import ContactConditions, SolverOptions
from ballscrew_tehl.contact.half_space.grid import Grid
from ballscrew_tehl.contact.moes import MoesFilm, reference_oil, solve_moes
from ballscrew_tehl.contact.solve import ContactSolution, solve_contact
from ballscrew_tehl.physics.hertz import E_prime, reduced_radii

OIL, STEEL = GD4008.lubricant, GD4008.solid
CHI = STEEL.thermal_conductivity / (STEEL.density * STEEL.specific_heat)
#: screw-side ellipse, radius ratio 0.0353
R_X, R_Y = (float(r) for r in reduced_radii(GD4008.screw, GD4008.screw.contact_angle, "screw"))
MODULUS = E_prime(GD4008.screw)
LONG, CIRCLE = 0.0353, 1.0


def conditions(load=30.0, u_e=2.0, srr=0.5, temperature=303.15, **more) -> ContactConditions:
    """A screw-side contact; u_1 is the faster body for srr > 0. more: differential_1, spin_1, ..."""
    return ContactConditions(
        load, R_X, R_Y, u_e * (1.0 + 0.5 * srr), u_e * (1.0 - 0.5 * srr), temperature, MODULUS, **more
    )


def options(**changed) -> SolverOptions:
    """Options of a coarse grid, with changes."""
    return SolverOptions(**({"n_x": 65, "n_y": 9, "n_z": 8} | changed))


@lru_cache(maxsize=128)
def solved(at: ContactConditions, rheology="newtonian", **changed) -> ContactSolution:
    """Solution of the oil with a rheology and its default constants."""
    oil = OIL.model_copy(update={"rheology": rheology})
    solution = solve_contact(at, oil, STEEL, options(**changed))
    assert solution.converged, solution.reason
    return solution


@lru_cache(maxsize=128)
def moes(M, L, radius_ratio, law, **options) -> MoesFilm:
    """Isothermal film, on the default grid unless options are given."""
    film = solve_moes(M, L, radius_ratio, law, SolverOptions(thermal=False, **options))
    assert film.solution.converged, film.solution.reason
    return film


def grid_of(solution: ContactSolution) -> Grid:
    """Grid in metres."""
    hertz, choice = solution.hertz, solution.choice
    return Grid(solution.x * hertz.b, solution.y * hertz.a, choice.mirror, choice.open_side)


def on_axis(solution: ContactSolution) -> int:
    """Line Y = 0."""
    return int(np.argmin(np.abs(solution.y)))


def grid_film(solution: ContactSolution) -> float:
    """Central film of the grid alone [m]: the quadratic through the three nodes around X = 0, not extrapolated."""
    x, film = solution.x, solution.film[on_axis(solution)]
    k = int(np.argmin(np.abs(x)))
    return float(np.polyval(np.polyfit(x[k - 1 : k + 2], film[k - 1 : k + 2], 2), 0.0))


#: pressure and density laws of the kernels
OILS = {
    "roelands, compressible, thermal expansion": OIL,
    "barus": OIL.model_copy(update={"pressure_law": "barus"}),
    "incompressible": OIL.model_copy(update={"density_law": "incompressible"}),
    "barus, incompressible, one viscosity": reference_oil("barus"),
}
