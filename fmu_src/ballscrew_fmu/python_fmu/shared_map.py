"""The map of an FMU for Python hosts with its table of variables, once in a process for all instances.

In an FMU with a live page the numbers of the map are in the page alone, and the file of the map has its header.
Instances share a map if their resources have the same map file, by its content: a file that was replaced
is read by the next instance. The modules of an FMU are loaded once in a process, whatever the number of copies.
"""

import base64
import functools
import hashlib
import math
import operator
import os
import re
import zlib
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ballscrew_fmu.variables.friction import FIRST_REFERENCE, Variable
from ballscrew_tehl.runtime.constants import TOO_LARGE
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import (
    AXES,
    DEFAULTS,
    FILM_SHEAR,
    FORCE_CURVES,
    SURFACES,
    TORQUE_SURFACES,
    MapError,
    read_npz,
)

MAP_FILE, PAGE_FILE = "nut_map.npz", "live.html"
HEAD = 24 + 64  # [bytes] of nut_map.bin before its numbers
Table = Callable[[Mapping[str, Any]], tuple[Variable, ...]]


class SharedMap:
    """A map and what follows from its table of variables; immutable.

    Attributes   table : variables by value reference
                 start : values by value reference, with nothing below the first
                 outputs : value references;  named : gets the outputs from a mapping, in their order
                 bounds : value reference and lower bound of each Real input and parameter
    """

    def __init__(self, nut_map: NutMap, table: Table) -> None:
        variables = table(nut_map.header)
        self.map = nut_map
        self.table = dict(enumerate(variables, FIRST_REFERENCE))
        inputs, outputs, parameters = (
            [n for n, v in self.table.items() if v.causality == of] for of in ("input", "output", "parameter")
        )
        place = self.place = {v.name: n for n, v in self.table.items()}
        self.start: list[Any] = [None] * FIRST_REFERENCE
        self.start += [0.0 if v.start is None else v.start for v in variables]
        self.outputs = slice(outputs[0], outputs[-1] + 1)
        self.named = operator.itemgetter(*(self.table[p].name for p in outputs))
        self.bounds = [(p, -TOO_LARGE) for p in inputs]
        self.bounds += [(p, _least(self.table[p])) for p in parameters if self.table[p].unit is not None]
        #: gets the values of these names from the values by value reference; a tuple unless one name is given
        self.getter = functools.cache(lambda *names: operator.itemgetter(*(place[name] for name in names)))


_latest: dict[
    tuple[str, Table], SharedMap
] = {}  # kept without an instance too: a simulation is often run again


def shared_map(resources: str, table: Table) -> SharedMap:
    """The map in these resources; the latest one is not read again.

    Raises       MapError: it is damaged;  OSError: it is not there
    """
    with open(os.path.join(resources, MAP_FILE), "rb") as file:
        key = hashlib.file_digest(file, "sha256").hexdigest(), table
    if key not in _latest:
        shared = SharedMap(map_in(resources), table)
        _latest.clear()
        _latest[key] = shared
    return _latest[key]


def map_in(resources: str) -> NutMap:
    """The map of these resources.

    Raises       MapError: it is damaged;  OSError: it is not there
    """
    header, arrays = read_npz(os.path.join(resources, MAP_FILE))
    if not arrays:
        with open(os.path.join(resources, PAGE_FILE), encoding="utf-8") as page:
            packed = re.search(r'id="map">([^<]*)<', page.read())
        try:
            planes = np.frombuffer(zlib.decompress(base64.b64decode(packed[1] if packed else "")), np.uint8)
            numbers = np.frombuffer(planes.reshape(8, -1).T.tobytes(), "<f8", offset=HEAD)
            arrays = arrays_of(numbers, [int(header["axes"][name][2]) + 2 for name in AXES])
        except (ValueError, zlib.error) as error:
            raise MapError(f"{PAGE_FILE}: no map in it: {error}") from error
    return NutMap(header, arrays)


def arrays_of(numbers: NDArray[np.float64], counts: list[int]) -> dict[str, NDArray[np.float64]]:
    """Coefficients of a map from the numbers in nut_map.bin; counts: of coefficients along AXES."""
    force, speed, temperature, preload, share = counts
    plane, films = (speed, temperature, force), len(SURFACES[FILM_SHEAR]) - TORQUE_SURFACES  # of each law
    shapes = (
        (*plane, TORQUE_SURFACES), (*plane, films), (force, len(FORCE_CURVES)), (2, preload), (2, preload, share),
    )  # fmt: skip
    ends = np.cumsum([3 * len(AXES) + len(DEFAULTS) + 2, *map(math.prod, shapes)])
    parts = [part.reshape(shape) for part, shape in zip(np.split(numbers, ends)[1:-1], shapes, strict=True)]
    torques, others, curves, separation, sharing = parts
    return {
        "coefficients": np.concatenate([torques, others], axis=-1).transpose(2, 0, 1, 3),
        "force_coefficients": curves,
        "separation_coefficients": separation.T,
        "sharing_coefficients": sharing.transpose(1, 2, 0),
    }


def _least(variable: Variable) -> float:
    """Lower bound of a Real parameter; the tolerance must be positive."""
    return math.ulp(0.0) if variable.name == "refine_tolerance" else variable.minimum or 0.0
