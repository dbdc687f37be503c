"""The map of an FMU for Python hosts with its table of variables, once in a process for all instances.

In an FMU with a live page the numbers of the map are in the page alone, and the file of the map has its header.
Instances share a map if their resources have the same map file, by its content: a file that was replaced
is read by the next instance.
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
    EXTREMES,
    FORCE_CURVES,
    TORQUE_SURFACES,
    MapError,
    read_npz,
)

MAP_FILE, PAGE_FILE = "nut_map.npz", "live.html"
HEAD = 24 + 64  # [bytes] of nut_map.bin before its numbers
Table = Callable[[Mapping[str, Any]], tuple[Variable, ...]]


class SharedMap:
    """A map and what follows from its table of variables; immutable.

    table: variables by value reference; start: values by value reference, with nothing below the first; outputs: value
    references; named: gets the outputs from a mapping, in their order; bounds: value reference and lower bound of each
    Real input and parameter.
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
        for p in parameters:
            if self.table[p].unit is not None:  # the tolerance must be positive
                positive = self.table[p].name == "refine_tolerance"
                self.bounds.append((p, math.ulp(0.0) if positive else self.table[p].minimum or 0.0))
        #: gets the values of these names from the values by value reference; a tuple unless one name is given
        self.getter = functools.cache(lambda *names: operator.itemgetter(*(place[name] for name in names)))


_latest: dict[
    tuple[str, Table], SharedMap
] = {}  # of one map; kept without an instance: simulations are run again


def shared_map(resources: str, table: Table) -> SharedMap:
    """The map in these resources, as map_in; the latest one is not read again."""
    with open(os.path.join(resources, MAP_FILE), "rb") as file:
        key = hashlib.file_digest(file, "sha256").hexdigest(), table
    if key not in _latest:
        shared = SharedMap(map_in(resources), table)
        _latest.clear()
        _latest[key] = shared
    return _latest[key]


def map_in(resources: str) -> NutMap:
    """The map of these resources; MapError: it is damaged, OSError: it is not there."""
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
    force, speed, temperature, preload, fraction, difference = counts
    plane, films = (speed, temperature, force), len(EXTREMES)
    shapes = (
        (*plane, TORQUE_SURFACES), (*plane, films), (force, len(FORCE_CURVES)), plane[:2], (2, preload),
        (2, preload, fraction), (preload, difference),
    )  # fmt: skip
    ends = np.cumsum([3 * len(AXES) + len(DEFAULTS) + 3, *map(math.prod, shapes)])
    parts = [part.reshape(shape) for part, shape in zip(np.split(numbers, ends)[1:-1], shapes, strict=True)]
    return {
        "coefficients": np.concatenate(parts[:2], axis=-1).transpose(2, 0, 1, 3),
        "force_coefficients": parts[2],
        "drag_coefficients": parts[3],
        "separation_coefficients": parts[4].T,
        "sharing_coefficients": parts[5].transpose(1, 2, 0),
        "shift_coefficients": parts[6],
    }
