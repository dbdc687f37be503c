"""The map of an FMU for Python hosts with its table of variables, once in a process for all instances.

A map has 4.5 MB. Instances share it if their resources have the same map file, by its content: a file that was replaced
is read by the next instance. The modules of an FMU are loaded once in a process, whatever the number of copies.
"""

import functools
import hashlib
import math
import operator
import os
import weakref
from collections.abc import Callable, Mapping
from typing import Any

from ballscrew_fmu.variables.friction import FIRST_REFERENCE, Variable, places
from ballscrew_tehl.runtime.constants import TOO_LARGE
from ballscrew_tehl.runtime.evaluate import NutMap

MAP_FILE = "nut_map.npz"
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
        inputs, outputs, parameters = (places(variables, of) for of in ("input", "output", "parameter"))
        self.map = nut_map
        self.table = dict(enumerate(variables, FIRST_REFERENCE))
        place = self.place = {v.name: n for n, v in self.table.items()}
        self.start: list[Any] = [None] * FIRST_REFERENCE
        self.start += [0.0 if v.start is None else v.start for v in variables]
        self.outputs = slice(outputs[0], outputs[-1] + 1)
        self.named = operator.itemgetter(*(self.table[p].name for p in outputs))
        self.bounds = [(p, -TOO_LARGE) for p in inputs]
        self.bounds += [(p, _least(self.table[p])) for p in parameters if self.table[p].unit is not None]
        #: gets the values of these names from the values by value reference; a tuple unless one name is given
        self.getter = functools.cache(lambda *names: operator.itemgetter(*(place[name] for name in names)))


_MAPS: weakref.WeakValueDictionary[tuple[str, Table], SharedMap] = weakref.WeakValueDictionary()
_latest: list[SharedMap] = []  # kept without an instance too: a simulation is often run again and again


def shared_map(resources: str, table: Table) -> SharedMap:
    """The map in these resources.

    Raises       MapError: it is damaged;  OSError: it is not there
    """
    path = os.path.join(resources, MAP_FILE)
    with open(path, "rb") as file:
        key = hashlib.file_digest(file, "sha256").hexdigest(), table
    found = _MAPS.get(key)
    if found is None:
        found = _MAPS[key] = SharedMap(NutMap.from_npz(path), table)
    _latest[:] = [found]
    return found


def _least(variable: Variable) -> float:
    """Lower bound of a Real parameter; the tolerance must be positive."""
    return math.ulp(0.0) if variable.name == "refine_tolerance" else variable.minimum or 0.0
