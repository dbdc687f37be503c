"""The contacts of the atlas: chosen from those of random screws, solved on a fine grid, kept in a journal."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from pathlib import Path

import numpy as np

from ballscrew_tehl.atlas.groups import COLD, QUANTITIES, wall_group
from ballscrew_tehl.contact import SolverOptions, scales_of, solve
from ballscrew_tehl.nut_map.grid import Progress
from ballscrew_tehl.physics.film import thermal_load_parameter
from ballscrew_tehl.refinement.direct import THICKEST, contact_quantities

from .journal import Journal, solve_missing
from .screws import Contact, any_body, contact_pool

#: nodes along rolling, and of further attempts. 22 contacts against 385 to 513 nodes: rolling loss within 0.4 %,
#: minimum film within 0.3 %
FINE_NODES: tuple[int, ...] = 257, 193, 129
#: nodes of contacts that hardly converge on a fine grid, above an N of HOT, and of those that need none, below an M of
#: RIGID: three of M 2 to 3 have their loss on 129 nodes within 0.05 % of that on 385
HOT, RIGID, FEW_NODES = 2.0, 4.0, (129, 97, 193)
#: N and L above which one in ten does not converge on 257 nodes, and the nodes of these
WARM, STIFF, SOME_NODES = 0.2, 25.0, (193, 129)
#: most thermal iterations of an attempt but the last: what takes more rarely converges
MOST_ITERATIONS = 60
#: seed of the pool, its screws, and tries of each
POOL_SEED, POOL_SCREWS, POOL_TRIES = 1, 5000, 12
#: film [m] by the closed formula above which contacts are solved, up to THICKEST of R_x: below, oil is no continuum; M,
#: L and N up to which they are
THINNEST = 0.7e-9
LARGEST_M, LARGEST_L, LARGEST_N = 5e5, 160.0, 80.0
#: the first contacts are spread over all. From each of these numbers on they have an M in between these, and at least
#: this L and N: after 2,000, 86 points of the certificate had their largest errors there, 1 to 2 % of the torque; after
#: 3,546 the largest torque of 386, 4.4 %; after 3,750 a thrust bearing at L = 32, N = 5
CRITICAL_M = 2.0, 250.0
STAGES = (2000, 15.0, 0.0), (3600, 45.0, 0.3), (3750, 15.0, 0.3)
#: from this number on, contacts whose walls matter, above an M and an N, with walls of any body: the first ones have
#: those of four pairs of materials only
ANY_WALL, WALL_MATTERS = 4250, (2.0, 3e-3)
#: from this number on, contacts with any walls and oils of other pressure exponents, of so many screws
OTHER_OILS, OTHER_SCREWS = 4500, 1500
#: distances in ln(M), ln(L), ln(R_x/R_y), z, ln(p_max), ln(N + COLD), ln(effusivity of the walls) that count alike
SPACING = 1.0, 2.0, 2.0, 0.8, 3.0, 3.0, 0.6
#: what a contact is given by in the journal
VALUES = *QUANTITIES, "asymptotic", "nodes"


def usable(contact: Contact) -> bool:
    """Whether a contact has a film that is solved."""
    c, scales = contact.conditions, scales_of(contact.conditions, contact.oil)
    film = scales.film_estimate * scales.h_unit
    N = thermal_load_parameter(contact.oil, c.u_e, c.temperature)
    inside = scales.M <= LARGEST_M and scales.L <= LARGEST_L and N <= LARGEST_N
    return bool(inside and THINNEST <= film <= THICKEST * c.R_x)


def _place(contact: Contact) -> list[float]:
    """Coordinates in which contacts are spread."""
    c, oil = contact.conditions, contact.oil
    scales = scales_of(c, oil)
    N = float(thermal_load_parameter(oil, c.u_e, c.temperature))
    place = (
        np.log(scales.M), np.log(scales.L), np.log(c.R_x / c.R_y), oil.z_roelands, np.log(scales.hertz.p_max),
        np.log(N + COLD), np.log(wall_group(contact.solids)),
    )  # fmt: skip
    return [float(value / unit) for value, unit in zip(place, SPACING, strict=True)]


def critical(contact: Contact, min_L: float, min_N: float, of_M: tuple[float, float] = CRITICAL_M) -> bool:
    """Whether a contact is where torques of maps are least certain: in the transition, with thick, stiff or hot oil."""
    c, scales = contact.conditions, scales_of(contact.conditions, contact.oil)
    N = thermal_load_parameter(contact.oil, c.u_e, c.temperature)
    return bool(of_M[0] <= scales.M <= of_M[1] and min_L <= scales.L and min_N <= N)


def atlas_contacts(count: int) -> list[Contact]:
    """The first `count` contacts: by turns the one of the pool farthest from those before, and one at random.

    From the first number of STAGES on, of those that are critical; from ANY_WALL on, with walls of any body; from
    OTHER_OILS on, with oils of other pressure exponents.
    """
    pool = [contact for contact in contact_pool(POOL_SEED, POOL_SCREWS, POOL_TRIES) if usable(contact)]
    random = np.random.default_rng(POOL_SEED)
    random.shuffle(pool)  # type: ignore[arg-type]
    places = np.array([_place(contact) for contact in pool])
    nearest, target, taken = np.full(len(pool), np.inf), np.ones(len(pool), dtype=bool), list[Contact]()
    begins = {at: limits for at, *limits in STAGES}
    for k in range(count):
        if k in begins:
            target = np.array([critical(contact, *begins[k]) for contact in pool])
        if k in (ANY_WALL, OTHER_OILS):
            if k == ANY_WALL:
                least_M, least_N = WALL_MATTERS
                warm = [c for c in pool if critical(c, 0.0, least_N, (least_M, LARGEST_M))]
                pool = [contact._replace(solids=2 * (any_body(random),)) for contact in warm]
            else:
                pool = [c for c in contact_pool(POOL_SEED + 1, OTHER_SCREWS, POOL_TRIES, True) if usable(c)]
            places, target = np.array([_place(contact) for contact in pool]), np.ones(len(pool), dtype=bool)
            before = np.array([_place(contact) for contact in taken])
            nearest = np.array([np.min(np.sum((before - place) ** 2, axis=1)) for place in places])
        left = np.where(target, nearest, 0.0)  # what was taken has no distance left
        own = int(np.argmax(left > 0.0)) if k % 2 else int(np.argmax(left))
        taken.append(pool[own])
        nearest = np.minimum(nearest, np.sum((places - places[own]) ** 2, axis=1))
    return taken


def solve_contact(contact: Contact) -> dict[str, float | str]:
    """VALUES of a contact, SI; `reason` alone if it does not converge."""
    c = contact.conditions
    nodes, scales = FINE_NODES, scales_of(c, contact.oil)
    N = float(thermal_load_parameter(contact.oil, c.u_e, c.temperature))
    if N > HOT or scales.M < RIGID:
        nodes = FEW_NODES
    elif N > WARM and scales.L > STIFF:
        nodes = SOME_NODES
    for n_x in nodes:
        options = SolverOptions(n_x=n_x, max_thermal=150 if n_x == nodes[-1] else MOST_ITERATIONS)
        result = solve(c, contact.oil, contact.solids, options, warn=False)
        if result.converged:
            return {
                **contact_quantities(result), "asymptotic": float(result.branch == "asymptotic"), "nodes": float(n_x),
            }  # fmt: skip
    return {"reason": result.reason}


def solve_contacts(
    contacts: Sequence[Contact], journal: Journal, executor: Executor, progress: Progress | None = None
) -> list[dict[str, float | str]]:
    """Solve those that are not in the journal, by their place in the sequence; every one is kept at once."""
    jobs = {str(k): (contact,) for k, contact in enumerate(contacts)}
    solve_missing(solve_contact, jobs, journal, executor, progress, "contacts solved")
    return [journal.entries[str(k)] for k in range(len(contacts))]


def journal_of(path: Path) -> Journal:
    """The journal of the contacts of the atlas."""
    return Journal(path, {"what": "contacts of the atlas", "seed": POOL_SEED, "nodes": list(FINE_NODES)})
