"""The model of the native runtime without FMI, compiled for tests and called through ctypes."""

import ctypes
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from ballscrew_fmu.models import FRICTION, MONITOR, FmuModel
from ballscrew_fmu.native_fmu.compile import COMPILER_OPTIONS, WARNINGS
from ballscrew_fmu.native_fmu.map_file import map_bytes
from ballscrew_fmu.native_fmu.sources import native_sources
from ballscrew_tehl.runtime.packed import SURFACES

SHARED_UNITS = ("model.c", "nut.c", "map.c", "variables.c")


def model_units(model: FmuModel = FRICTION) -> tuple[str, ...]:
    """C units of a model without FMI."""
    return (*SHARED_UNITS, "search.c" if model is MONITOR else f"{model.layer}_tangent.c")


ROOM = 8192  # [bytes] more than a Model takes


def compiler() -> list[str]:
    """The C compiler of the system, or that of ziglang."""
    found = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    return [found] if found else [sys.executable, "-m", "ziglang", "cc"]


def write_sources(folder: Path, nut_map, fmi_version: int = 2, model: FmuModel = FRICTION) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in native_sources(nut_map.header, fmi_version, "{test}", model).items():
        (folder / name).write_bytes(content)
    (folder / "nut_map.bin").write_bytes(map_bytes(nut_map))


def compiled_model(folder: Path, nut_map, model: FmuModel = FRICTION) -> Path:
    """Shared library of the model with all its functions visible."""
    write_sources(folder, nut_map, model=model)
    units = model_units(model)
    options = [o for o in COMPILER_OPTIONS if not o.startswith("-fvisibility")]
    options.append("-DBALLSCREW_PREFIX=")  # plain names, for ctypes
    command = [*compiler(), *options, *WARNINGS, "-shared", "-fPIC", "-o", "model.so", *units, "-lm"]
    subprocess.run(command, cwd=folder, check=True, timeout=300)
    return folder / "model.so"


class NativeModel:
    """One Model with its map."""

    def __init__(self, library: Path, nut_map, continuous: bool = False, model: FmuModel = FRICTION) -> None:
        self._library = ctypes.CDLL(str(library))
        self._library.map_read.restype = ctypes.c_void_p
        self._library.model_get.restype = ctypes.c_double
        self._library.model_clamped.restype = ctypes.c_uint
        self._library.model_event.restype = ctypes.c_bool
        self._library.model_accepts.restype = ctypes.c_bool
        self.names = [v.name for v in model.native_variables(nut_map.header)]
        self._place = {name: place for place, name in enumerate(self.names)}
        message = ctypes.create_string_buffer(1000)
        path = str(library.parent / "nut_map.bin").encode()
        law = tuple(SURFACES).index(nut_map.law)
        found = self._library.map_read(path, law, message, ctypes.c_size_t(1000))
        assert found, message.value
        self._map = ctypes.c_void_p(found)
        self._model = ctypes.create_string_buffer(ROOM)
        self.reset(continuous)

    def reset(self, continuous: bool = False) -> None:
        self._library.model_reset(self._model, self._map, continuous)

    def set(self, **values: float) -> None:
        for name, value in values.items():
            self._library.model_set(self._model, self._place[name], ctypes.c_double(value))

    def get(self, name: str) -> float:
        return self._library.model_get(self._model, self._place[name])

    def latch(self, **values: float) -> None:
        self.set(**values)
        self._library.model_latch(self._model)

    def step(self, step: float, **values: float) -> None:
        self.set(**values)
        self._library.model_step(self._model, ctypes.c_double(step))

    def accepts(self, name: str, value: float) -> bool:
        return self._library.model_accepts(self._place[name], ctypes.c_double(value))

    def initial_event(self) -> None:
        self._library.model_initial_event(self._model)

    def event(self) -> bool:
        return self._library.model_event(self._model)

    def derivative(self, unknowns: Iterable[str], **seeds: float) -> list[float]:
        unknowns = list(unknowns)
        wanted = (ctypes.c_int * len(unknowns))(*(self._place[name] for name in unknowns))
        knowns = (ctypes.c_int * len(seeds))(*(self._place[name] for name in seeds))
        seed = (ctypes.c_double * len(seeds))(*seeds.values())
        found = (ctypes.c_double * len(unknowns))()
        counts = ctypes.c_size_t(len(unknowns)), ctypes.c_size_t(len(seeds))
        self._library.model_directional_derivative(
            self._model, wanted, counts[0], knowns, counts[1], seed, found
        )
        return list(found)

    def values_with_derivatives(self) -> dict[str, float]:
        found = (ctypes.c_double * len(self.names))()
        self._library.model_values_with_derivatives(self._model, found)
        return dict(zip(self.names, found, strict=True))


SANITIZERS = ("-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")


def sanitized_host(
    folder: Path, nut_map, host: Path, units: Iterable[str] = model_units(), *options: str
) -> Path:
    """Program of a C host and the runtime with AddressSanitizer and UndefinedBehaviorSanitizer.

    Raises       FileNotFoundError: no compiler of the system, whose sanitizers it needs
    """
    command = compiler()
    if len(command) > 1:
        raise FileNotFoundError("no C compiler of the system: sanitizers not run")
    write_sources(folder, nut_map)
    program = folder / host.stem
    subprocess.run(
        [*command, "-std=c99", *WARNINGS, *SANITIZERS, *options, "-I.", "-o", str(program), str(host), *units, "-lm"],
        cwd=folder, check=True, timeout=300,
    )  # fmt: skip
    return program
