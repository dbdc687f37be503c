"""The native runtime compiled for tests, once for each set of sources and options; its model without FMI by ctypes."""

import ctypes
import functools
import hashlib
import os
import shutil
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from filelock import FileLock
from paths import NATIVE_HOSTS

from ballscrew_fmu.models import FRICTION
from ballscrew_fmu.native_fmu.compile import COMPILER_OPTIONS, WARNINGS
from ballscrew_fmu.native_fmu.resource_files import (
    MAP_FILE,
    SCREW_FILE,
    checksum,
    map_bytes,
    screw_bytes,
    start_numbers,
)
from ballscrew_fmu.native_fmu.sources import is_fmi_header, native_sources, table_hash, units_of
from ballscrew_tehl.runtime.packed import SURFACES

TOKEN = "{test}"
# compiled programs and libraries of all sessions of this user
CACHE = Path(tempfile.gettempdir()) / f"ballscrew_native_{os.getuid() if hasattr(os, 'getuid') else ''}"
FLAGS = tuple(os.environ.get("BALLSCREW_CFLAGS", "").split())  # in addition, e.g. "-O3 -ffp-contract=fast"
ROOM = 16384  # [bytes] more than a Model takes


def compiler():
    """The C compiler of the system, or that of ziglang."""
    found = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    return [found] if found else [sys.executable, "-m", "ziglang", "cc"]


def runtime_sources(nut_map, model=FRICTION):
    """Sources of the runtime with both FMI versions, the FMI headers in fmi/."""
    sources = native_sources(nut_map.header, model=model)
    return {f"fmi/{name}" if is_fmi_header(name) else name: text for name, text in sources.items()}


@functools.cache
def resources(nut_map, model=FRICTION, token=TOKEN):
    """Files that an instance reads."""
    screw = screw_bytes(nut_map.header, model, table_hash(nut_map.header, model), token)
    return {MAP_FILE: map_bytes(nut_map), SCREW_FILE: screw}


def put_resources(folder, *arguments, **files):
    """The folder with these resources; files : others in their places by stem, None: none."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in resources(*arguments).items():
        if (content := files.get(name.partition(".")[0], content)) is not None:
            (folder / name).write_bytes(content)
    return str(folder)


def sealed(content):
    """Bytes of a file, a map or a saved state, with correct size and checksum."""
    head = struct.pack("<QQ", len(content), checksum(content[24 : len(content) // 8 * 8]))
    return content[:8] + head + content[24:]


def compile_once(sources, units, name, *options):
    """Program or library `name` of these units of C sources, in a folder of its own in CACHE, unless it is there."""
    command = [
        *compiler(), "-std=c99", *WARNINGS, *options, *FLAGS, "-I.", "-isystem", "fmi", "-o", name, *units,
    ]  # fmt: skip
    command += ["-lm", "-lpthread", "-ldl"]
    content = hashlib.sha256("\0".join(command).encode())
    for file, text in sorted(sources.items()):
        content.update(f"{file} {len(text)} ".encode() + text)
    folder = CACHE / content.hexdigest()[:24]
    folder.mkdir(parents=True, exist_ok=True)
    with FileLock(folder / "lock"):
        if not (folder / "done").exists():
            (folder / "fmi").mkdir(exist_ok=True)
            for file, text in sources.items():
                (folder / file).write_bytes(text)
            run = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)
            if run.returncode:
                raise RuntimeError(run.stderr)
            (folder / "done").touch()
    return folder / name


COUNTS = b"""#define _POSIX_C_SOURCE 200809L
#include <stdlib.h>
extern long counts[2]; /* of memory taken and given back */
static inline void *counted(void *memory) { counts[0] += memory != NULL; return memory; }
static inline void given_back(void *memory) { counts[1] += memory != NULL; free(memory); }
#define calloc(count, size) counted(calloc(count, size))
#define malloc(size) counted(malloc(size))
#define free(memory) given_back(memory)
"""


@functools.cache
def compiled_model(nut_map, model=FRICTION, counts=False):
    """Library of the runtime with both FMI versions, beside the file of its map; functions have external names."""
    shared = [option for option in COMPILER_OPTIONS if not option.startswith("-fvisibility")]
    sources, units = runtime_sources(nut_map, model) | resources(nut_map, model), units_of(model)
    names = ["-DINTERNAL=extern", "-shared", "-fPIC"]
    if counts:
        sources |= {"counts.h": COUNTS, "counts.c": b"long counts[2];\n"}
        units, names = (*units, "counts.c"), [*names, "-include", "counts.h"]
    return compile_once(sources, units, "runtime.so", *shared, "-Wshadow", *names)


def c_host(nut_map, name, *options):
    """Program of a C file of native/, linked with the runtime of both versions, beside the map."""
    sources = runtime_sources(nut_map)
    sources |= {**resources(nut_map), f"{name}.c": (NATIVE_HOSTS / f"{name}.c").read_bytes()}
    return compile_once(sources, (f"{name}.c", *units_of(FRICTION)), name, f'-DTOKEN="{TOKEN}"', *options)


class NativeModel:
    """One Model with its map; numbers: of the model, None: those of the map."""

    def __init__(self, nut_map, continuous=False, model=FRICTION, numbers=None):
        library = compiled_model(nut_map, model)
        self._library = ctypes.CDLL(str(library))
        self._library.map_read.restype = ctypes.c_void_p
        self._library.model_get.restype = ctypes.c_double
        self._library.model_clamped.restype = ctypes.c_uint
        self._library.model_event.restype = ctypes.c_bool
        self.names = [v.name for v in model.variables(nut_map.header)]
        self._place = {name: place for place, name in enumerate(self.names)}
        message = ctypes.create_string_buffer(1000)
        path = str(library.parent / MAP_FILE).encode()
        law = tuple(SURFACES).index(nut_map.law)
        found = self._library.map_read(path, law, message, ctypes.c_size_t(1000))
        assert found, message.value
        self._map = ctypes.c_void_p(found)
        starts = start_numbers(nut_map.header, model)
        starts[len(self.names) :] = numbers or model.numbers(nut_map.header)
        self._start = (ctypes.c_double * len(starts))(*starts)
        self._model = ctypes.create_string_buffer(ROOM)
        self.reset(continuous)

    def reset(self, continuous=False):
        self._library.model_reset(self._model, self._map, self._start, continuous)

    def set(self, **values):
        for name, value in values.items():
            self._library.model_set(self._model, self._place[name], ctypes.c_double(value))

    def get(self, name):
        return self._library.model_get(self._model, self._place[name])

    def values(self, names):
        return np.array([self.get(name) for name in names])

    def latch(self, **values):
        self.set(**values)
        self._library.model_latch(self._model)

    def step(self, step, **values):
        self.set(**values)
        self._library.model_step(self._model, ctypes.c_double(step))

    def initial_event(self):
        self._library.model_initial_event(self._model)

    def event(self):
        return self._library.model_event(self._model)

    def derivative(self, unknowns, **seeds):
        vector = ctypes.c_double * len(self.names)
        direction, slopes = vector(*(seeds.get(name, 0.0) for name in self.names)), vector()
        self._library.model_derivatives(self._model, direction, slopes)
        return [slopes[self._place[name]] for name in unknowns]
