"""The commands `map build`, `map check` and `map info`."""

from __future__ import annotations

import math
import sys
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .commands import film_model_of, screw_of
from .friction_set import default_friction_set
from .operating_points import print_results
from .parameters import Parameters

if TYPE_CHECKING:
    from .nut_map.build import Progress
    from .nut_map.evaluate import NutMap


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


def deviation_from_direct(nut_map: NutMap, parameters: Parameters, count: int) -> dict[str, Any]:
    """Relative deviations of a map from direct per-ball solves at random points that the map was not built
    from.

    Returns      points, largest and mean deviation of the friction torque
    Raises       ArithmeticError: a contact that did not converge
    """
    from .torque import double_nut_torque

    friction_set = default_friction_set(parameters)
    film = film_model_of(str(nut_map.header["film_model"]), parameters)
    found = []
    for preload, speed, temperature, axial_load in operating_points(nut_map, count).tolist():
        state = nut_map.evaluate(preload, speed, temperature, axial_load, *friction_set.values)
        torque = float(state.viscous_torque + state.hysteresis_torque + state.sliding_torque)
        direct = double_nut_torque(parameters, friction_set, film, preload, speed, temperature, axial_load)
        found.append(abs(torque / direct.total - 1.0))
    return {"points": count, "torque_error_max": max(found), "torque_error_mean": float(np.mean(found))}


@contextmanager
def _progress_bar() -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    if not console.is_terminal:
        told = -1

        def line(finished: int, total: int, what: str) -> None:
            nonlocal told
            if 20 * finished // total > told:
                told = 20 * finished // total
                print(f"{finished} of {total} {what}", file=sys.stderr, flush=True)

        yield line
        return
    with Bar(console=console) as bar:
        task = bar.add_task("starting", total=None)

        def progress(finished: int, total: int, what: str) -> None:
            bar.update(task, completed=finished, total=total, description=what)

        yield progress


def run_map_build(args: Namespace) -> int:
    """Solve the contacts of a screw, write the map with its certificate."""
    from .nut_map.build import build_map
    from .nut_map.store import load_map, packaged_map, save_map

    parameters = screw_of(args)
    if args.workers is not None and args.workers < 1:
        raise ValueError(f"--workers = {args.workers}; allowed: a whole number >= 1")
    if args.output is None and args.screw is not None:
        raise ValueError(
            "--output (missing); allowed: a file; the packaged map belongs to the packaged screw"
        )
    path = Path(args.output) if args.output else packaged_map(parameters.friction.kinematics)
    with _progress_bar() as progress:
        built = build_map(parameters, args.workers, progress)
    # a map takes the place of an older one only with its certificate
    trial = path.with_name(path.name + ".trial")
    try:
        save_map(trial, built, {})
        certificate = deviation_from_direct(load_map(trial, parameters), parameters, args.count)
    finally:
        trial.unlink(missing_ok=True)
    file_hash = save_map(path, built, certificate)
    result = {"file": str(path), "file_hash": file_hash, **certificate}
    print_results([result], args.json, False)
    return 0


def run_map_check(args: Namespace) -> int:
    """Load a map, which verifies hash and parameters, and compare it with direct solves.

    Exit code 1 if it is further off than its certificate says. The points are the first ones of the certificate.
    """
    from .nut_map.store import load_map

    parameters = screw_of(args)
    if args.count < 1:
        raise ValueError(f"--count = {args.count}; allowed: a whole number >= 1")
    nut_map = load_map(args.file, parameters)
    result = deviation_from_direct(nut_map, parameters, args.count)
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
    for key, value in header.items():
        if isinstance(value, dict):
            rows |= {f"{key}.{name}": entry for name, entry in value.items()}
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
