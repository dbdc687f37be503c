"""Steps an FMI 3.0 FMU in fmpy by variable names: the sibling of replay.py."""

import tempfile
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi3 import FMU3Slave

from ballscrew_fmu.checks.replay import FmuInstance


class Fmu3Instance(FmuInstance):
    """One instance of an FMI 3.0 co-simulation FMU; arguments and attributes as FmuInstance."""

    def __init__(
        self, fmu: Path | str, initialize: bool = True, name: str = "instance", **start: float
    ) -> None:
        self._unpacked = None if Path(fmu).is_dir() else tempfile.mkdtemp(prefix="ballscrew_fmu_")
        folder = str(fmu) if self._unpacked is None else fmpy.extract(str(fmu), unzipdir=self._unpacked)
        self.description = fmpy.read_model_description(folder)
        self._references = {v.name: v.valueReference for v in self.description.modelVariables}
        self._types = {v.name: v.type for v in self.description.modelVariables}
        self.messages: list[tuple[int, str]] = []
        self.time = 0.0
        self.slave = FMU3Slave(
            guid=self.description.guid,
            unzipDirectory=folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.slave.instantiate(loggingOn=True, logMessage=self._log_fmi3)
        if initialize:
            self.set(**start)
            self.slave.enterInitializationMode(startTime=0.0)
            self.slave.exitInitializationMode()

    def set(self, **values: float) -> None:
        if values:
            self.slave.setFloat64([self._references[name] for name in values], list(values.values()))

    def get(self, *names: str) -> Any:
        values = [
            bool(self.slave.getBoolean([self._references[name]])[0])
            if self._types[name] == "Boolean"
            else self.slave.getFloat64([self._references[name]])[0]
            for name in names
        ]
        return values if len(values) > 1 else values[0]

    def _log_fmi3(self, _environment: Any, status: int, _category: bytes, message: bytes) -> None:
        self.messages.append((status, message.decode()))
