"""Base class of the slaves: FMI 2.0 co-simulation of a table of variables with a nut map.

Inside the FMU this module is in a package named by its content (package.py). All imports are at the top: an import
during a step would fail if the folder of the FMU copy that was loaded first has been deleted.

No call may raise once the instance exists: pythonfmu 0.7 then releases its objects twice, at the exception and when
the instance is freed, which crashes the host process. Steps that fail are discarded. The entry library
(native/python_host/entry.c) refuses what is illegal: references that are unknown or cannot be set, all Integer and
String variables, impossible steps, states that cannot be read.
"""

import hashlib
import importlib
import json
import os
import sys
from collections.abc import Mapping
from copy import copy
from typing import Any

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from ballscrew_fmu.python_fmu.process_end import reset_at_exit
from ballscrew_fmu.python_fmu.shared_map import Table, shared_map
from ballscrew_fmu.variables.friction import origin_text
from ballscrew_tehl.runtime.constants import TOO_LARGE

INITIALIZING, STEPPING, TERMINATED, UNUSABLE = range(4)  # as in entry.c
CHECKSUM = hashlib.sha256().digest_size  # [bytes] of a serialized state
ALWAYS = "always"  # category of a message that is logged without debug logging, too: entry.c
SAVED = ("values", "phase", "stale", "started", "warned")  # of a slave, in a saved state


class MapSlave(Fmi2Slave):
    """Inputs, parameters and outputs of a table by value reference. A model adds _evaluate and its memory.

    Outputs are those of the last successful step; before the first step, those of the current inputs.
    With an invalid input or parameter doStep returns Discard and changes nothing.
    """

    def __init__(self, table: Table, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        _restore_imports(self.resources)
        reset_at_exit(self.resources)
        self._shared = shared_map(self.resources, table)
        self._map = self._shared.map
        self._values = copy(self._shared.start)  # by value reference
        self._phase = INITIALIZING
        self._stale = True  # outputs are older than the inputs; used while initializing
        self._started = True  # not if initialization ended with an invalid value: the first good step does it
        self._warned: list[str] = []
        if origin := origin_text(self._map.header):
            self.log(origin, Fmi2Status.warning)

    # of a model

    def _evaluate(self, step: float | None) -> tuple[Mapping[str, Any], tuple[str, ...]]:
        """Outputs by name for valid inputs, and which inputs are clamped; with a step, update the memory."""
        raise NotImplementedError

    def _memory(self) -> dict[str, Any]:
        """Data of the model other than the values, for a saved state."""
        raise NotImplementedError

    def _restore_memory(self, state: Mapping[str, Any]) -> None:
        """Restore this data from a saved state."""
        raise NotImplementedError

    # FMI calls

    def exit_initialization_mode(self) -> None:
        self._started = self._update(None)
        self._phase = STEPPING

    def do_step(self, current_time: float, step_size: float) -> bool:
        if self._phase != STEPPING:
            needs = "exitInitializationMode or a restored state of this FMU"
            return self._discard(f"doStep in a wrong state: needs {needs}")
        self._started = self._started or self._update(None)
        return self._started and self._update(step_size)

    def terminate(self) -> None:
        self._phase = TERMINATED

    def get_real(self, vrs: list[int]) -> list[float]:
        if self._stale and self._phase == INITIALIZING:
            self._stale = False
            self._update(None)
        return [float(self._values[vr]) for vr in vrs]

    def get_boolean(self, vrs: list[int]) -> list[bool]:
        return [bool(value) for value in self.get_real(vrs)]

    def get_integer(self, vrs: list[int]) -> list[int]:
        """The phase, for the entry library."""
        return [self._phase] * len(vrs)

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        for vr, value in zip(vrs, values, strict=True):
            self._values[vr] = value
        self._stale = True

    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        self.set_real(vrs, [bool(value) for value in values])

    def _get_fmu_state(self) -> dict[str, Any]:
        return {
            "code": __name__,
            "map": self._map.header["content_hash"],
            **{name: copy(getattr(self, f"_{name}")) for name in SAVED},
            **self._memory(),
        }

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        if (state.get("code"), state.get("map")) != (__name__, self._map.header["content_hash"]):
            self._phase = UNUSABLE
            self.log("FMU state is of another version or map: not restored", Fmi2Status.error)
            return
        for name in SAVED:
            setattr(self, f"_{name}", copy(state[name]))
        self._restore_memory(state)

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        """Checksum and JSON. A state that could not be read has no bytes."""
        text = json.dumps(state, sort_keys=True).encode()  # floats as repr: exact, NaN and infinity too
        return hashlib.sha256(text).digest() + text if state else b""

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        """The state, empty if the checksum differs."""
        result, text = bytes(state)[:CHECKSUM], bytes(state)[CHECKSUM:]
        return dict(json.loads(text)) if hashlib.sha256(text).digest() == result else {}

    # evaluation

    def _discard(self, message: str) -> bool:
        self.log(message, Fmi2Status.discard)
        return False

    def _valid(self) -> bool:
        """Whether all inputs and parameters are valid. The first invalid one is logged."""
        for place, least in self._shared.bounds:
            value = self._values[place]
            if not least <= value < TOO_LARGE:
                needs = "a finite number"
                if least > -TOO_LARGE:
                    needs += " > 0" if 0.0 < least < 1e-300 else f" >= {least:g}"
                return self._discard(f"{self._shared.table[place].name} = {value}; needs {needs}")
        return True

    def _update(self, step: float | None) -> bool:
        """Outputs and, with a step, memory for the current inputs. False and no change if they are invalid."""
        try:
            if not self._valid():
                return False
            outputs, clamped = self._evaluate(step)
            self._values[self._shared.outputs] = self._shared.named(outputs)
            for name in clamped:
                value = self._values[self._shared.place[name]]
                absent = name == "temperature" and value == 0.0  # many tools set unconnected inputs to 0
                message = f"{name} = {value} is outside the map and is clamped"
                message += "; is the input connected? (logged once)" if absent else " (logged once)"
                self._log_once(name, message, Fmi2Status.warning, ALWAYS if absent else None)
            return True
        except Exception as error:  # an exception would crash the host (see the module docstring)
            return self._discard(f"step failed: {type(error).__name__}: {error}")

    def _log_once(self, key: str, message: str, status: Fmi2Status, category: str | None = None) -> None:
        if key not in self._warned:
            self._warned.append(key)
            self.log(message, status, category)


def _restore_imports(resources: str) -> None:
    """Make this package importable from these resources and remove them from sys.path.

    pythonfmu puts the resources of every instance first on sys.path and leaves them there. The modules of
    this package were loaded from the first copy of the FMU, whose folder may have been deleted since.
    """
    package = sys.modules[__package__]
    here = os.path.join(resources, __package__)
    if os.path.isdir(here):
        others = [folder for folder in package.__path__ if folder != here and os.path.isdir(folder)]
        package.__path__[:] = [here, *others]
    while resources in sys.path:
        sys.path.remove(resources)
    importlib.invalidate_caches()
