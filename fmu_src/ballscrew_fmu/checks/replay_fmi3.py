"""An FMI 3.0 FMU stepped in fmpy, with variables by name, as replay.py does for FMI 2.0."""

from collections.abc import Mapping
from typing import Any

from fmpy.fmi3 import FMU3Slave

from ballscrew_fmu.checks.replay import FmuInstance


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
