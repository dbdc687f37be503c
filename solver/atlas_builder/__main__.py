"""Command line: each step continues what its journal in the folder solved holds, and may be interrupted at any time.

python -m atlas_builder contacts --count 4250     solve contacts
python -m atlas_builder points --count 1000       solve the points of the certificate, --fine: on the finer grid
python -m atlas_builder atlas                     fit, certify; writes data/contact_atlas.npz and the VG 100 map
python -m atlas_builder certificate               certify the atlas that is there anew, after a change of the law
python -m atlas_builder packaged                  write the VG 100 map alone
python -m atlas_builder published --count 1024    solve sliding contacts, write the packaged map of the published law
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ballscrew_tehl.applications.cli.shared.output import progress_bar
from ballscrew_tehl.atlas.ball_contacts import BallContacts
from ballscrew_tehl.atlas.contact_atlas import load_atlas, packaged_atlas
from ballscrew_tehl.atlas.groups import COORDINATES, QUANTITIES, coordinates
from ballscrew_tehl.nut_map.build import build_map
from ballscrew_tehl.nut_map.file import VG100, packaged_map, save_map
from ballscrew_tehl.nut_map.grid import ball_range, map_grid
from ballscrew_tehl.nut_map.load import nut_map_of
from ballscrew_tehl.parameters.file import PACKAGED_VG100, load_screw
from ballscrew_tehl.refinement.certificate import deviation_from_direct
from ballscrew_tehl.refinement.direct import rolling_parameters
from ballscrew_tehl.refinement.processes import worker_pool

from .certificate import SEED, certificate, solve_points
from .contacts import atlas_contacts, journal_of, solve_contacts
from .fit import (
    BOUNDS_OF_ATLAS,
    FIRST,
    certify_atlas,
    interpolant_of,
    lengths_and_noise,
    save_atlas,
    table_of,
)
from .journal import Journal
from .published import SlidingFilms, published_map, solve_sliding

#: folder of the journals
SOLVED = Path(__file__).parent / "solved"


@contextmanager
def executor_of(args: argparse.Namespace) -> Iterator[Executor]:
    """Processes of this machine, or a Dask cluster, whose executor has the same interface."""
    if args.dask is None:
        with worker_pool(args.workers) as pool:
            yield pool
        return
    from distributed import Client

    with Client(args.dask, timeout="10s", set_as_default=False) as client:
        # what a dead worker had goes to another one
        yield client.get_executor(retries=3)


def points_journal() -> Journal:
    return Journal(SOLVED / "points.jsonl", {"what": "points of the certificate", "seed": SEED})


def sliding_journal() -> Journal:
    return Journal(SOLVED / "sliding.jsonl", {"what": "sliding contacts of the published law"})


def run_contacts(args: argparse.Namespace) -> None:
    contacts = atlas_contacts(args.count)
    with (
        executor_of(args) as executor,
        progress_bar() as progress,
        journal_of(SOLVED / "contacts.jsonl") as journal,
    ):
        solve_contacts(contacts, journal, executor, progress)


def run_points(args: argparse.Namespace) -> None:
    with executor_of(args) as executor, progress_bar() as progress, points_journal() as journal:
        solve_points(range(args.first, args.first + args.count), args.fine, journal, executor, progress)


def run_published(args: argparse.Namespace) -> None:
    parameters = load_screw()
    grid = map_grid(parameters)
    range_ = ball_range(parameters, grid)
    with executor_of(args) as executor, progress_bar() as progress, sliding_journal() as journal:
        solve_sliding(parameters, range_, args.count, journal, executor, progress)
        films = SlidingFilms(parameters, range_, journal.entries, args.count)
        contacts = BallContacts(rolling_parameters(parameters), range_)
        built = published_map(parameters, films, contacts, grid, {})
        result = deviation_from_direct(nut_map_of(built), parameters, args.points, executor, progress)
    built.header["certificate"] = result
    save_map(packaged_map("published"), built)


def run_atlas(args: argparse.Namespace) -> None:
    with journal_of(SOLVED / "contacts.jsonl") as journal:
        solved = journal.entries
    rows = sorted(map(int, solved))
    contacts = atlas_contacts(rows[-1] + 1)
    table = table_of([contacts[k] for k in rows], [solved[str(k)] for k in rows])
    at = coordinates(table.groups)
    lengths, level = lengths_and_noise(at, table.values, table.noise, FIRST, BOUNDS_OF_ATLAS)
    interpolant, left_out = interpolant_of(at, table.values, table.noise, lengths, level)
    for name, length in zip(COORDINATES, lengths, strict=True):
        print(f"length of {name:13} {length:.3g}")
    for name, errors in zip(QUANTITIES, np.abs(left_out).T, strict=True):
        print(f"left out, {name:17} mean {errors.mean():.2e}, 99 % {np.quantile(errors, 0.99):.2e}")
    header: dict[str, Any] = {
        "contacts_not_solved": len(rows) - len(table.rows),
        "certificate": {"what": "", "points": 0},
    }
    save_atlas(packaged_atlas(), table, lengths, interpolant, header)
    run_certificate(args)


def run_certificate(args: argparse.Namespace) -> None:
    load_atlas.cache_clear()
    # own processes, begun now: they read the atlas that is there
    with worker_pool(args.workers) as executor, progress_bar() as progress, points_journal() as journal:
        result = certificate(journal.entries, executor, progress)
    certify_atlas(packaged_atlas(), result)
    load_atlas.cache_clear()
    write_packaged(args)


def write_packaged(args: argparse.Namespace) -> None:
    save_map(packaged_map(VG100), build_map(load_screw(PACKAGED_VG100), map_grid(load_screw())))


def main() -> None:
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser("python -m atlas_builder", description=__doc__, formatter_class=raw)
    steps = parser.add_subparsers(required=True)
    for name, run, count in (
        ("contacts", run_contacts, 4250), ("points", run_points, 1000), ("published", run_published, 1024),
        ("atlas", run_atlas, 0), ("certificate", run_certificate, 0), ("packaged", write_packaged, 0),
    ):  # fmt: skip
        step = steps.add_parser(name)
        step.set_defaults(run=run)
        step.add_argument("--workers", type=int)
        if count:
            step.add_argument("--count", type=int, default=count)
            step.add_argument("--dask", metavar="ADDRESS", help="tcp://HOST:PORT of a scheduler")
        if name == "published":
            step.add_argument("--points", type=int, default=1000, help="of its certificate")
        if name == "points":
            step.add_argument("--fine", action="store_true", help="on the grid of the atlas")
            step.add_argument("--first", type=int, default=0, help="number of the first one")
    args = parser.parse_args()
    SOLVED.mkdir(exist_ok=True)
    args.run(args)


if __name__ == "__main__":
    main()
