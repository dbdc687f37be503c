"""An FMU of FMI 2.0 or 3.0 stepped in fmpy, with variables by name; imported by hosts that step an FMU, too."""

import contextlib
import math
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

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

DISCARD = 2  # status of FMI
FLOOR = 0.01  # of the largest value of an output: smaller ones are compared with this
Rows = Sequence[Mapping[str, Any]]  # outputs of steps by name


class CheckError(RuntimeError):
    """An FMU fails a check. No FMU is delivered."""


class FmuInstance:
    """One instance of a co-simulation FMU, for use in a `with` block.

    Parameters
    ----------
    fmu : path or str
        The FMU, or the folder of an unpacked FMU.
    messages : list of (int, str), optional
        Takes the log; a list of the caller outlives an instance that cannot be made.
    **start : float
        Values set before initialization.

    Attributes
    ----------
    messages : list of (int, str)
        Status and text of each log message.
    time : float
        Of the last successful step [s].
    slave : object
        The instance of fmpy.
    references : dict of str to int
        Value references by name.

    Examples
    --------
    >>> with FmuInstance("BallScrewFrictionNative_fmi2.fmu", preload=2000.0) as fmu:  # doctest: +SKIP
    ...     fmu.step(speed=100.0), round(fmu.get("friction_torque"), 1)
    (True, 1.3)
    """

    def __init__(
        self, fmu: Path | str, messages: list[tuple[int, str]] | None = None, **start: float
    ) -> None:
        self._unpacked, folder = contextlib.ExitStack(), str(fmu)
        if not Path(fmu).is_dir():
            scratch = tempfile.TemporaryDirectory(prefix="ballscrew_fmu_", ignore_cleanup_errors=True)
            folder = str(fmpy.extract(str(fmu), unzipdir=self._unpacked.enter_context(scratch)))
        self.description = fmpy.read_model_description(folder)
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self._types = {v.name: v.type for v in self.description.modelVariables}
        self.messages = [] if messages is None else messages
        self.slave = self._instantiated(folder)
        self.initialize(**start)

    def _instantiated(self, folder: str) -> Any:
        """By the classes of fmpy: its simulation.instantiate_fmu sends all messages to the latest instance."""
        identifier = self.description.coSimulation.modelIdentifier
        names = {"guid": self.description.guid, "unzipDirectory": folder, "modelIdentifier": identifier}
        if self.description.fmiVersion != "2.0":
            slave = FMU3Slave(**names)
            slave.instantiate(loggingOn=True, logMessage=self._log)
            return slave
        callbacks = fmi2CallbackFunctions()
        callbacks.logger = fmi2CallbackLoggerTYPE(self._log)
        callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        slave = FMU2Slave(**names)
        slave.instantiate(callbacks=callbacks, loggingOn=True)
        return slave

    def initialize(self, **start: float) -> None:
        """Set start values and initialize at time 0, also after a reset of `slave`."""
        self.time = 0.0
        if self.description.fmiVersion == "2.0":
            self.slave.setupExperiment(startTime=0.0)
        self.set(**start)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    def set(self, **values: float) -> None:
        """Set variables.

        Parameters
        ----------
        **values : float
            Values by name.
        """
        for name, value in values.items():
            getattr(self.slave, f"set{self._types[name]}")([self.references[name]], [value])

    def get(self, *names: str) -> Any:
        """Value of one variable, or the list of several."""
        values: list[Any] = []
        for name in names:
            value = getattr(self.slave, f"get{self._types[name]}")([self.references[name]])[0]
            values.append(bool(value) if self._types[name] == "Boolean" else float(value))
        return values if len(values) > 1 else values[0]

    def outputs(self) -> dict[str, Any]:
        """Values of all outputs.

        Returns
        -------
        dict
            Values by name.
        """
        names = [v.name for v in self.description.modelVariables if v.causality == "output"]
        return dict(zip(names, self.get(*names), strict=True))

    def step(self, step_size: float = 1e-3, **inputs: float) -> bool:
        """Set inputs and step.

        Parameters
        ----------
        step_size : float, optional
            Communication step [s].
        **inputs : float
            Inputs by name.

        Returns
        -------
        bool
            False if the FMU discards the step.

        Raises
        ------
        FMICallException
            The step fails otherwise.
        """
        self.set(**inputs)
        try:
            self.slave.doStep(currentCommunicationPoint=self.time, communicationStepSize=step_size)
        except FMICallException as error:
            if error.status != DISCARD:
                raise
            return False
        self.time += step_size
        return True

    def close(self) -> None:
        """Free the instance and its unpacked files."""
        self.slave.freeInstance()
        self._unpacked.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _log(self, *arguments: Any) -> None:
        *_, status, _category, message = arguments  # FMI 2 has the name of the instance before them
        self.messages.append((status, message.decode()))


@contextlib.contextmanager
def running(fmu: Path | str) -> Iterator[FmuInstance]:
    """An instance of an FMU; CheckError: it cannot be loaded, instantiated or stepped, with what it says itself."""
    messages: list[tuple[int, str]] = []
    try:
        instance = FmuInstance(fmu, messages)
    except Exception as error:  # fmpy raises Exception itself
        raise _failed(messages, error) from error
    with instance:
        try:
            yield instance
        except FMICallException as error:
            raise _failed(messages, error) from error


def _failed(messages: Sequence[tuple[int, str]], error: Exception) -> CheckError:
    return CheckError(" ".join((messages[-1][1] if messages else str(error)).split()))


def replay(
    fmu: Path | str, rows: Iterable[Mapping[str, float]], step_size: float = 1e-3
) -> list[dict[str, Any]]:
    """Outputs after each step of an input sequence, a row of inputs that change each; CheckError: it fails a step."""
    results = []
    with running(fmu) as instance:
        for row in rows:
            if not instance.step(step_size, **row):
                raise CheckError(f"the FMU discards the step at {row}: {instance.messages[-1][1]}")
            results.append(instance.outputs())
    return results


def largest_difference(results: Rows, expected: Rows) -> tuple[float, int, str, Any, Any]:
    """The largest relative one of two sequences of outputs, NaN before all; its row, name, result and expected value.

    Relative to the value, or to FLOOR of the largest value of that output where the value is smaller: the force on a
    nut is a difference of forces, and rounds as they do. ValueError: their names or lengths differ.
    """
    if any(row.keys() != target.keys() for row, target in zip(results, expected, strict=True)):
        raise ValueError(f"outputs {sorted(results[0])}; expected {sorted(expected[0])}")
    floors = {name: FLOOR * max(abs(row[name]) for row in expected) for name in expected[0]}
    differences = (
        (abs(row[name] - value) / max(1e-300, abs(value), floors[name]), n, name, row[name], value)
        for n, (row, target) in enumerate(zip(results, expected, strict=True))
        for name, value in target.items()
    )
    return max(differences, key=lambda one: (math.isnan(one[0]), one[0]))
