"""An FMU of FMI 2.0 or 3.0 stepped in fmpy, with variables by name, for the checks and the tests."""

from __future__ import annotations

import contextlib
import math
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    calloc,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    free,
)
from fmpy.fmi3 import FMU3Slave

if TYPE_CHECKING:
    from ballscrew_fmu.native_fmu.experiments import Reference

FMI2_DISCARD = 2
AGREEMENT = 1e-9  # relative difference between an FMU and its reference
Rows = Sequence[Mapping[str, Any]]  # outputs of steps by name
FLOOR = 0.01  # of the largest value of an output: smaller ones are compared with this


class CheckError(RuntimeError):
    """An FMU fails a check. No FMU is delivered."""


class FmuInstance:
    """One instance of an FMI 2.0 co-simulation FMU, for use in a `with` block.

    Parameters   fmu : the FMU, or the folder of an unpacked FMU
                 start : values set before initialization
                 initialize : False: instantiate only
                 messages : takes the log; a list of the caller outlives an instance that cannot be made
    Attributes   messages : (status, text) of each log message
                 time : of the last successful step [s]
    """

    def __init__(
        self,
        fmu: Path | str,
        initialize: bool = True,
        name: str = "instance",
        messages: list[tuple[int, str]] | None = None,
        **start: float,
    ) -> None:
        self._unpacked = None if Path(fmu).is_dir() else tempfile.mkdtemp(prefix="ballscrew_fmu_")
        folder = str(fmu) if self._unpacked is None else fmpy.extract(str(fmu), unzipdir=self._unpacked)
        self.description = fmpy.read_model_description(folder)
        self._references = {v.name: v.valueReference for v in self.description.modelVariables}
        self._types = {v.name: v.type for v in self.description.modelVariables}
        self.messages = [] if messages is None else messages
        self.time = 0.0
        self.slave = self._instantiated(folder, name)
        if initialize:
            self._initialize(start)

    def _instantiated(self, folder: str, name: str) -> Any:
        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = fmi2CallbackLoggerTYPE(self._log)
        self._callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        self._callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        slave = FMU2Slave(guid=self.description.guid, **self._identity(folder, name))
        slave.instantiate(callbacks=self._callbacks, loggingOn=True)
        self._get_numbers, self._set_numbers = slave.getReal, slave.setReal
        return slave

    def _identity(self, folder: str, name: str) -> dict[str, str]:
        """Arguments of fmpy that name folder, model and instance."""
        identifier = self.description.coSimulation.modelIdentifier
        return {"unzipDirectory": folder, "modelIdentifier": identifier, "instanceName": name}

    def _initialize(self, start: Mapping[str, float]) -> None:
        self.slave.setupExperiment(startTime=0.0)
        self.set(**start)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    def set(self, **values: float) -> None:
        switches = [name for name in values if self._types[name] == "Boolean"]
        numbers = [name for name in values if name not in switches]
        for names, setter in ((numbers, self._set_numbers), (switches, self.slave.setBoolean)):
            if names:
                setter([self._references[name] for name in names], [values[name] for name in names])

    def get(self, *names: str) -> Any:
        """Value of one variable, or the list of several."""
        values = [
            bool(self.slave.getBoolean([self._references[name]])[0])
            if self._types[name] == "Boolean"
            else self._get_numbers([self._references[name]])[0]
            for name in names
        ]
        return values if len(values) > 1 else values[0]

    def outputs(self) -> dict[str, Any]:
        names = [v.name for v in self.description.modelVariables if v.causality == "output"]
        return dict(zip(names, self.get(*names), strict=True))

    def step(self, step_size: float = 1e-3, **inputs: float) -> bool:
        """Set inputs and step. False if the step is discarded; FMICallException for other failures."""
        self.set(**inputs)
        try:
            self.slave.doStep(currentCommunicationPoint=self.time, communicationStepSize=step_size)
        except FMICallException as error:
            if error.status != FMI2_DISCARD:
                raise
            return False
        self.time += step_size
        return True

    def close(self) -> None:
        self.slave.freeInstance()
        if self._unpacked is not None:
            shutil.rmtree(self._unpacked, ignore_errors=True)

    def __enter__(self) -> FmuInstance:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _log(self, _environment: Any, _name: bytes, status: int, _category: bytes, message: bytes) -> None:
        self.messages.append((status, message.decode()))


class Fmu3Instance(FmuInstance):
    """One instance of an FMI 3.0 co-simulation FMU; arguments and attributes as in FmuInstance."""

    def _instantiated(self, folder: str, name: str) -> Any:
        slave = FMU3Slave(guid=self.description.guid, **self._identity(folder, name))
        slave.instantiate(loggingOn=True, logMessage=self._log_fmi3)
        self._get_numbers, self._set_numbers = slave.getFloat64, slave.setFloat64
        return slave

    def _initialize(self, start: Mapping[str, float]) -> None:
        self.set(**start)
        self.slave.enterInitializationMode(startTime=0.0)
        self.slave.exitInitializationMode()

    def _log_fmi3(self, _environment: Any, status: int, _category: bytes, message: bytes) -> None:
        self.messages.append((status, message.decode()))


def largest_difference(found: Rows, expected: Rows) -> tuple[float, int, str, Any, Any]:
    """The largest relative one of two sequences of outputs, NaN before all; its row, name, value found and expected.

    Relative to the value, or to FLOOR of the largest value of that output where the value is smaller: the force on a
    nut is a difference of forces, and rounds as they do.

    Raises       ValueError: their names or lengths differ
    """
    if any(row.keys() != wanted.keys() for row, wanted in zip(found, expected, strict=True)):
        raise ValueError(f"outputs {sorted(found[0])}; expected {sorted(expected[0])}")
    floors = {name: FLOOR * max(abs(row[name]) for row in expected) for name in expected[0]}
    differences = (
        (abs(row[name] - value) / max(1e-300, abs(value), floors[name]), n, name, row[name], value)
        for n, (row, wanted) in enumerate(zip(found, expected, strict=True))
        for name, value in wanted.items()
    )
    return max(differences, key=lambda one: (math.isnan(one[0]), one[0]))


def kind_of(fmu: Path | str) -> type[FmuInstance]:
    """Class of the instances of an FMU, packed or in a folder."""
    version = fmpy.read_model_description(str(fmu)).fmiVersion
    return Fmu3Instance if version.startswith("3") else FmuInstance


@contextlib.contextmanager
def running(fmu: Path | str, **start: Any) -> Iterator[FmuInstance]:
    """An instance of an FMU, packed or in a folder.

    Raises       CheckError: it cannot be loaded, instantiated or stepped, with what the FMU says itself
    """
    messages: list[tuple[int, str]] = []
    try:
        one = kind_of(fmu)(fmu, messages=messages, **start)
    except Exception as error:  # fmpy raises Exception itself
        raise _failed(messages, error) from error
    with one:
        try:
            yield one
        except FMICallException as error:
            raise _failed(messages, error) from error


def _failed(messages: Sequence[tuple[int, str]], error: Exception) -> CheckError:
    return CheckError(" ".join((messages[-1][1] if messages else str(error)).split()))


def replay(
    fmu: Path | str, rows: Iterable[Mapping[str, float]], step_size: float = 1e-3, **start: float
) -> list[dict[str, Any]]:
    """Outputs after each step of an input sequence. A row may be limited to the inputs that change.

    Raises       CheckError: as running, or the FMU discards a step
    """
    results = []
    with running(fmu, **start) as instance:
        for row in rows:
            if not instance.step(step_size, **row):
                raise CheckError(f"the FMU discards the step at {row}: {instance.messages[-1][1]}")
            results.append(instance.outputs())
    return results


def check_replay(fmu: Path | str, reference: Reference, source: str) -> float:
    """Largest relative difference between an FMU in fmpy and a reference, which comes from `source`.

    Raises       CheckError: an output differs by more than AGREEMENT, or as replay
    """
    outputs = replay(fmu, reference.inputs, reference.step, **reference.parameters)
    try:
        worst, n, name, value, wanted = largest_difference(outputs, reference.outputs)
    except ValueError as error:
        raise CheckError(f"replay: {error}") from error
    if not worst <= AGREEMENT:
        raise CheckError(f"replay step {n}: {name} = {value!r}; {source} {wanted!r}")
    return worst
