"""The commands `map build`, `map check`, `map info` and `map plot`."""

from __future__ import annotations

import dataclasses
import math
import sys
import time
from argparse import Namespace
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import __version__
from .commands import EXTREMES, screw_of
from .friction_set import default_friction_set
from .measurements import CELSIUS, RPM
from .nut_map.packed import POINT, certificate_totals
from .operating_points import print_results
from .parameters import Parameters

if TYPE_CHECKING:
    from .nut_map.build import Progress
    from .nut_map.evaluate import NutMap
    from .nut_map.plot import MapPicture


def operating_points(nut_map: NutMap, count: int, seed: int = 1) -> np.ndarray:
    """Random points inside a map (count, 4): preload [N], speed [rad/s], temperature [K], axial load [N].

    Every second point has an axial load, up to 1.5 times the preload either way, both nuts within the map.
    """
    generator = np.random.default_rng(seed)
    axes = nut_map.header["axes"]
    u = generator.random((count, 4))
    lowest, highest = (
        max(axes[name][0] for name in ("force", "preload")),
        min(axes["force"][1], axes["preload"][1]),
    )
    preload = lowest * (highest / lowest) ** u[:, 0]
    speed = axes["speed"][0] * (axes["speed"][1] / axes["speed"][0]) ** u[:, 1]
    temperature = axes["temperature"][0] + (axes["temperature"][1] - axes["temperature"][0]) * u[:, 2]
    reach = np.minimum(1.5 * preload, axes["force"][1] - preload)
    axial = np.where(np.arange(count) % 2 == 1, (2.0 * u[:, 3] - 1.0) * reach, 0.0)
    return np.stack([preload, speed, temperature, axial], axis=1)


#: quantiles of a certificate by the ends of their keys
QUANTILES = {0.5: "50", 0.99: "99", 0.999: "999"}


class Deviation(NamedTuple):
    """Relative error of a map at one operating point against direct per-ball solves."""

    torque: float
    film: float
    temperature_rise: float


def deviation_at(nut_map: NutMap, parameters: Parameters, point: tuple[float, ...]) -> Deviation:
    """Errors of friction torque, least central film and largest rise [of the rise, of 1 K if that is more].

    Parameters   point: preload [N], speed [rad/s], temperature [K], axial load [N]
    Raises       ArithmeticError: a contact that did not converge
    """
    from .nut_map.direct import direct_state

    friction_set = default_friction_set(parameters)
    preload, speed, temperature, axial_load = point
    state = nut_map.evaluate(preload, speed, temperature, axial_load, *friction_set.values)
    torque = float(state.viscous_torque + state.hysteresis_torque + state.sliding_torque)
    direct = direct_state(parameters, friction_set, preload, speed, temperature, axial_load)
    films = ("film_thickness_central_screw", "film_thickness_central_nut")
    rise = direct.film_temperature_rise
    return Deviation(
        abs(torque / direct.friction_torque - 1.0),
        max(abs(getattr(state, name) / getattr(direct, name) - 1.0) for name in films),
        abs(state.film_temperature_rise - rise) / max(rise, 1.0),
    )


def deviation_from_direct(
    nut_map: NutMap,
    parameters: Parameters,
    count: int,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Relative deviations of a map from direct per-ball solves at random points that the map was not built
    from.

    Parameters   executor: of the concurrent.futures interface, None = in this process
    Returns      points; mean, median, 99 and 99.9 % quantile, largest deviation of torque, film and temperature rise;
                 points_not_solved: those that count nowhere because a contact did not converge;
                 each: the points [N, rad/s, K, N] and the deviations there by column, rounded to six and three digits
    Raises       ArithmeticError: no contact converged
    """
    points = [tuple(point) for point in operating_points(nut_map, count).tolist()]
    found: list[Deviation] = []
    if executor is None:
        results: Iterator[Deviation] = (_deviation_or_nan(nut_map, parameters, point) for point in points)
    else:
        jobs = [executor.submit(_deviation_or_nan, nut_map, parameters, point) for point in points]
        results = (job.result() for job in jobs)
    for deviation in results:
        found.append(deviation)
        if progress is not None:
            progress(len(found), count, "points of the certificate")
    return certificate_of(points, found)


def certificate_of(points: Sequence[tuple[float, ...]], found: Sequence[Deviation]) -> dict[str, Any]:
    """Certificate of the deviations at some points, NaN where no direct solution was found.

    Raises       ArithmeticError: no point has a direct solution
    """
    errors = np.array(found)
    known = np.isfinite(errors).all(axis=1)
    if not known.any():
        raise ArithmeticError(f"none of {len(points)} points of the certificate has a direct solution")
    held = [point for point, good in zip(points, known, strict=True) if good]
    each = {name: _rounded(column, 6) for name, column in zip(POINT, zip(*held, strict=True), strict=True)}
    result: dict[str, Any] = {"points": len(held), "points_not_solved": int(np.sum(~known)), "each": each}
    for name, column in zip(Deviation._fields, errors[known].T, strict=True):
        each[f"{name}_error"] = _rounded(column, 3)
        result[f"{name}_error_mean"] = float(column.mean())
        for share, key in QUANTILES.items():
            result[f"{name}_error_{key}"] = float(np.quantile(column, share))
        result[f"{name}_error_max"] = float(column.max())
    return result


def _deviation_or_nan(nut_map: NutMap, parameters: Parameters, point: tuple[float, ...]) -> Deviation:
    from .nut_map.operating_contact import UnconvergedContactError

    try:
        return deviation_at(nut_map, parameters, point)
    except UnconvergedContactError:
        return Deviation(math.nan, math.nan, math.nan)


def _rounded(column: Iterable[float], digits: int) -> list[float]:
    return [float(f"{value:.{digits}g}") for value in column]


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """A bar with rate and time left on a terminal, else a line per twentieth of the work."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    begun, doing = time.monotonic(), ""
    if not console.is_terminal:
        told, before, whole = -1, 0, 0

        def line(finished: int, total: int, what: str) -> None:
            nonlocal told, before, begun, doing, whole
            if what != doing or total != whole:
                # a build that refines itself adds work stage by stage
                begun, told, before, doing, whole = time.monotonic(), -1, finished, what, total
            if 20 * (finished - before) >= (told + 1) * (total - before):
                told = 20 * (finished - before) // max(total - before, 1)
                rate = (finished - before) / max(time.monotonic() - begun, 1e-9)
                left = f", {rate:.1f}/s, {(total - finished) / rate:.0f} s left" if rate > 0.0 else ""
                print(f"{finished} of {total} {what}{left}", file=sys.stderr, flush=True)

        yield line
        return
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"),
        TimeElapsedColumn(), TimeRemainingColumn(),
    )  # fmt: skip
    with Bar(*columns, console=console) as bar:
        task = bar.add_task("starting", total=None, rate="")

        def progress(finished: int, total: int, what: str) -> None:
            nonlocal doing
            if what != doing:
                doing = what
                bar.reset(task, total=total, description=what)
            speed = bar.tasks[0].speed
            bar.update(task, completed=finished, total=total, rate=f"{speed:.1f}/s" if speed else "")

        yield progress


@contextmanager
def _executor(args: Namespace) -> Iterator[Executor]:
    """The workers of a build: a Dask cluster, or processes of this machine."""
    if args.dask is None:
        from .nut_map.build import worker_pool

        with worker_pool(args.workers) as pool:
            yield pool
        return
    try:
        from distributed import Client
    except ImportError as error:
        raise ValueError(
            "--dask needs dask.distributed; remedy: pip install 'ballscrew-tehl[dask]'"
        ) from error
    try:
        client = Client(args.dask, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise ValueError(
            f"--dask = {args.dask}: no scheduler answers there ({error}); allowed: tcp://HOST:PORT"
        ) from error
    with client:
        # a dead worker is the cluster's business: its contacts go to another one
        yield client.get_executor(retries=3)


def _build_one(
    parameters: Parameters, path: Path, args: Namespace, executor: Executor, progress: Progress
) -> dict[str, Any]:
    """Build, certify and write one map; contacts that an interrupted build has solved are not solved again."""
    from .nut_map.build import MapGrid, build_map
    from .nut_map.store import load_map, save_map

    journal = path.with_name(path.name + ".contacts")
    grid = MapGrid()
    if args.tolerance is not None:
        grid = dataclasses.replace(grid, contact_tolerance=args.tolerance)
    built = build_map(parameters, progress=progress, grid=grid, executor=executor, journal=journal)
    # a map takes the place of an older one only with its certificate
    trial = path.with_name(path.name + ".trial")
    try:
        save_map(trial, built, {})
        certificate = deviation_from_direct(
            load_map(trial, parameters), parameters, args.count, executor, progress
        )
    finally:
        trial.unlink(missing_ok=True)
    file_hash = save_map(path, built, certificate)
    journal.unlink()
    return {"file": str(path), "file_hash": file_hash, **certificate_totals(certificate)}


def run_map_build(args: Namespace) -> int:
    """Solve the contacts of a screw, or of every screw file of a folder, and write the maps with their certificates."""
    from .nut_map.store import packaged_map

    for name in ("workers", "count"):
        value = getattr(args, name)
        if value is not None and value < 1:
            raise ValueError(f"--{name} = {value}; allowed: a whole number >= 1")
    if args.tolerance is not None and not 1e-5 <= args.tolerance <= 0.1:
        raise ValueError(f"--tolerance = {args.tolerance}; allowed: 1e-5 to 0.1, relative error of the film")
    if args.family is not None:
        wanted = _family(args)
    else:
        parameters = screw_of(args)
        if args.output is None and args.screw is not None:
            raise ValueError(
                "--output (missing); allowed: a file; the packaged map belongs to the packaged screw"
            )
        path = Path(args.output) if args.output else packaged_map(parameters.friction.kinematics)
        wanted = [(parameters, path)]
    with _executor(args) as executor, progress_bar() as progress:
        results = [_build_one(*one, args, executor, progress) for one in wanted]
    print_results(results, args.json, args.family is not None)
    return 0


def _family(args: Namespace) -> list[tuple[Parameters, Path]]:
    """Parameters and map file of every screw file of a folder; all are read before the first contact is solved."""
    folder = Path(args.family)
    if args.screw is not None:
        raise ValueError("--family and --screw; allowed: one of them")
    files = sorted(folder.glob("*.toml"))
    if not files:
        raise ValueError(f"--family = {folder}; allowed: a folder with screw files *.toml")
    target = Path(args.output) if args.output else folder
    return [
        (screw_of(Namespace(screw=str(file), kinematics=args.kinematics)), target / f"{file.stem}.nc")
        for file in files
    ]


def run_map_check(args: Namespace) -> int:
    """Load a map, which verifies hash and parameters, and compare it with direct solves.

    Exit code 1 if it is further off than its certificate says. The points are the first ones of the certificate.
    """
    from .nut_map.store import load_map

    parameters = screw_of(args)
    if args.count < 1:
        raise ValueError(f"--count = {args.count}; allowed: a whole number >= 1")
    nut_map = load_map(args.file, parameters)
    result = certificate_totals(deviation_from_direct(nut_map, parameters, args.count))
    allowed = float(nut_map.header["certificate"].get("torque_error_max", 0.0))
    good = result["torque_error_max"] <= allowed + 1e-6
    result |= {
        "certificate": allowed,
        "within_certificate": good,
        "file_hash": nut_map.header["file_hash"],
    }
    print_results([result], args.json, False)
    if not good:
        print(
            f"map differs from direct solves by {result['torque_error_max']:.2e}; its certificate says {allowed:.2e}",
            file=sys.stderr,
        )
    return 0 if good else 1


def run_map_info(args: Namespace) -> int:
    """Axes, film model, friction defaults, version, hashes and certificate of a map."""
    from .nut_map.store import load_map

    header = dict(load_map(args.file, screw_of(args)).header)
    if args.json:
        print_results([header], True, False)
        return 0
    rows: dict[str, Any] = {}
    header["certificate"] = certificate_totals(header["certificate"])
    for key, value in header.items():
        if isinstance(value, dict):
            told = {name: entry for name, entry in value.items() if not isinstance(entry, dict | None)}
            rows |= {f"{key}.{name}": entry for name, entry in told.items()}
        elif key != "parameters_json":
            rows[key] = value
    for name, unit, scale in (("speed", "r/min", 30.0 / math.pi), ("temperature", "C", 1.0)):
        low, high, nodes = header["axes"][name]
        shift = 273.15 if name == "temperature" else 0.0
        rows[f"axes.{name}"] = (
            f"{scale * low - shift:.6g} to {scale * high - shift:.6g} {unit}, {nodes} nodes"
        )
    print_results([rows], False, False)
    return 0


def run_map_plot(args: Namespace) -> int:
    """Draw a map: torque, film and temperature rise over speed, its samples and the points of its certificate."""
    path = Path(args.output)
    if path.suffix.lower() != ".png" or path.is_dir() or not path.parent.is_dir():
        raise ValueError(f"--output = {path}; allowed: a file *.png in a folder that exists")
    parameters = screw_of(args)
    from .nut_map.plot import map_figure, map_picture, save_figure
    from .nut_map.store import load_contact_map, load_map

    picture = map_picture(load_map(args.file, parameters), load_contact_map(args.file, parameters))
    file_hash = picture.nut_map.header["file_hash"]
    save_figure(map_figure(picture, args.error), path, file_hash)
    friction_set = default_friction_set(parameters)
    result = {
        "file": str(path),
        **_plotted_extremes(picture),
        "screw": parameters.name,
        "kinematics": friction_set.kinematics,
        "friction_set": friction_set.name,
        "map_hash": file_hash,
        "version": __version__,
    }
    print_results([result], args.json, False)
    return 0


def _plotted_extremes(picture: MapPicture) -> dict[str, Any]:
    """Lowest and highest of everything drawn, by the keys of the command line; None: the file does not hold it."""
    from .nut_map.plot import ERRORS, FILM_LINES, friction_torque

    def ends(*values: Any) -> list[float]:
        return [float(min(np.min(v) for v in values)), float(max(np.max(v) for v in values))]

    loads, _, _ = picture.contact_map.axes.nodes
    found: dict[str, Any] = {
        "speed_rpm": ends(picture.speed / RPM),
        "preload_n": ends(picture.preloads),
        "temperature_c": ends(picture.temperatures - CELSIUS),
        "friction_torque_nm": ends(*map(friction_torque, (picture.by_preload, picture.by_temperature))),
    }
    for name in FILM_LINES:
        found[EXTREMES[name]] = ends(getattr(picture.by_temperature, name)[picture.film_rows])
    found["film_temperature_rise_k"] = ends(picture.by_temperature.film_temperature_rise)
    found |= {
        "ball_load_n": ends(loads),
        "samples": sum(int(mask.sum()) for mask in picture.contact_map.solved.values()),
    }
    found |= {f"sampling_error_{name}": error for name, error in picture.sampling_errors.items()}
    points = picture.certificate
    found["certificate_points"] = 0 if points is None else points.speed.size
    return found | {f"{name}_error": None if points is None else ends(points.errors[name]) for name in ERRORS}
