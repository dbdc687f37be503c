"""What every number that steers the contact solver does, at a fixed sample of contacts.

`python tests/benchmarks/constant_effects.py [--only TEXT] [--every K] [--output FILE.csv]` finds the named
numbers in the modules of `contact`, moves one after the other to half and to twice its value, solves the sample and
prints for each: contacts that are not solved, films that move by more than their error estimate, median and largest
change of the film, ratio of linear solves and of CPU time. Numbers in compiled kernels cannot be moved: they are named.
One pass of the sample takes about a minute.
"""

import argparse
import importlib
import inspect
import os
import pkgutil
import re
import sys
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from unittest.mock import patch

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pandas as pd
from rich.progress import track
from scipy.stats import qmc

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))  # run as a script
sys.path.insert(0, str(Path(__file__).parents[2] / "solver"))
from paths import ROOT
from robustness import isothermal, thermal

from atlas_builder.screws import contact_pool
from ballscrew_tehl import contact
from ballscrew_tehl.contact import ball_conditions, solve_for_map
from ballscrew_tehl.contact.film import geometry, reynolds
from ballscrew_tehl.nut_map.grid import ball_range, map_grid
from ballscrew_tehl.parameters.file import load_screw

#: units, physics, ranges that are refused, tables and quadratures: they steer nothing
MODULES_ASIDE = ("moes",)
NAMES_ASIDE = (
    "TINY", "INLET_SHAPE", "TARGET_LOAD", "FAR_POWER", "LARGEST_LN_ETA",
    "FASTEST", "FEWEST", "LEAST_LAYERS", "LEAST_NODES", "LEAST_LINES", "MOST_NODES", "BOUNDS",
    "RANGES", "THICKEST", "MOST_FILM", "LEAST_FILM", "CORE", "WARNED_ABOVE",
    "SMOOTHED_OVER", "SMOOTHED_HERTZ", "POINTS", "SHARE", "CUT", "COLUMNS", "PIECE_DECAY", "PIECES_PER_T", "INNERMOST",
    "TABLE_BELOW", "TABLE_SPAN", "TABLE_STEP",
)  # fmt: skip
#: points of robustness.py without and with heat: some at random, and those of 700 that took damping, pseudo time, held
#: approaches, cold starts on the whole grid, doubled nodes, or most steps; contacts of random screws
ISOTHERMAL = (15, 17, 23, 47, 59, 68, 79, 87, 96, 121, 159, 184)
THERMAL = (0, 5, 21, 22, 30, 44, 60, 77, 90, 93, 122, 125)
RANDOM = 15


def modules():
    """Modules of the room that hold numbers which steer, by name."""
    found = pkgutil.walk_packages(contact.__path__, contact.__name__ + ".")
    names = [item.name.removeprefix(contact.__name__ + ".") for item in found if not item.ispkg]
    return {n: importlib.import_module(f"{contact.__name__}.{n}") for n in names if n not in MODULES_ASIDE}


def numbers(value):
    """The numbers of a constant."""
    if isinstance(value, dict | tuple):
        return [n for part in (value.values() if isinstance(value, dict) else value) for n in numbers(part)]
    return [value] if isinstance(value, int | float) and not isinstance(value, bool) else []


def constants():
    """Values by module and name, where they are assigned."""
    found = {}
    for name, module in modules().items():
        assigned = re.findall(r"^([A-Z][A-Z_0-9]*(?:, [A-Z_0-9]+)*) = ", inspect.getsource(module), re.M)
        for each in (part for names in assigned for part in names.split(", ")):
            if each not in NAMES_ASIDE and numbers(getattr(module, each)):
                found[name, each] = getattr(module, each)
    return found


def compiled(module, name):
    """Whether a kernel of its module takes a constant: it is frozen when that is compiled."""
    kernels = [each.py_func for each in vars(module).values() if hasattr(each, "py_func")]
    return any(name in kernel.__code__.co_names for kernel in kernels)


def moved(value, factor):
    """A constant with all its numbers times a factor; whole numbers stay whole."""
    if isinstance(value, dict):
        return {key: moved(part, factor) for key, part in value.items()}
    if isinstance(value, tuple):
        return tuple(moved(part, factor) for part in value)
    return max(round(factor * value), 1) if isinstance(value, int) else factor * value


def solved(every):
    """Results of every k-th contact of the sample, products of GMRES and CPU seconds of all."""
    cube = qmc.Sobol(5, seed=1).random_base2(11)
    jobs = [lambda k=k: isothermal(cube[k])[1] for k in ISOTHERMAL]
    jobs += [lambda k=k: thermal(cube[k])[1] for k in THERMAL]
    jobs += [lambda c=c: solve_for_map(*c, True) for c in contact_pool(1, RANDOM, 1)]
    for own in map(load_screw, sorted((ROOT / "examples/screws").glob("*.toml"))):
        range_ = ball_range(own, map_grid(own))
        third = range_.load[1] / 3.0, range_.speed[1] / 3.0, sum(range_.temperature) / 2.0
        at = ball_conditions(own, "nut", *third)
        jobs.append(lambda at=at, own=own: solve_for_map(at, own.lubricant, own.solids, True))
    products, linear_step = 0, reynolds._linear_step

    def counted(*args):
        nonlocal products
        found = linear_step(*args)
        products += args[3].krylov[-1]
        return found

    geometry.contact_geometry.cache_clear()
    with patch.object(reynolds, "_linear_step", counted):
        begun = time.process_time()
        results = [job() for job in jobs[::every]]
    return results, products, time.process_time() - begun


def effect(before, name, value, every):
    """What changes with another value of a constant, in all modules that have taken it over."""
    with ExitStack() as stack:
        for module in modules().values():
            if hasattr(module, name):
                stack.enter_context(patch.object(module, name, value))
        now = solved(every)
    pairs = [(a, b) for a, b in zip(before[0], now[0], strict=True) if a.converged and b.converged]
    change = [abs(b.h_c / a.h_c - 1.0) for a, b in pairs]
    beyond = sum(c > a.error_estimate + b.error_estimate for c, (a, b) in zip(change, pairs, strict=True))
    return {
        "unsolved": sum(not r.converged for r in now[0]), "beyond": beyond, "median": float(np.median(change)),
        "largest": max(change), "products": now[1] / before[1], "time": now[2] / before[2],
    }  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="part of module.NAME")
    parser.add_argument("--every", type=int, default=1, help="take every k-th contact of the sample")
    parser.add_argument("--output", type=Path, help="CSV file of the table")
    args = parser.parse_args()
    found, before, rows = constants(), solved(args.every), []
    for module, name in track([key for key in found if args.only in ".".join(key)], "constants"):
        value = found[module, name]
        for factor in ("compiled",) if compiled(modules()[module], name) else (0.5, 2.0):
            rows.append({"constant": f"{module}.{name}", "value": value, "moved": factor})
            with suppress(ArithmeticError, ValueError, IndexError):  # then without results
                if factor != "compiled":
                    rows[-1] |= effect(before, name, moved(value, factor), args.every)
    table = pd.DataFrame(rows)
    if args.output:
        table.to_csv(args.output, index=False)
    print(table.to_string(index=False, float_format="{:.3g}".format))


if __name__ == "__main__":
    main()
