"""The compiled parts of the FMUs, which are the same for all screws: libraries of the native FMUs, entry libraries of
the FMUs for Python hosts, WebAssembly of the live page.

A wheel carries them for all platforms: `python -m ballscrew_fmu.native_fmu.libraries` puts them in the folder prebuilt
before it is built. Elsewhere they are compiled once and kept in the cache of the user. The name of a file has the hash
of sources and options, and in the cache the compiler: what other sources left behind is not found.
"""

import atexit
import contextlib
import functools
import importlib.resources
import os
import re
import shutil
import sys
import tempfile
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from filelock import FileLock

from ballscrew_fmu.archive import write_whole
from ballscrew_fmu.models import FRICTION, MODELS, FmuModel
from ballscrew_fmu.native_fmu.compile import (
    COMPILER_OPTIONS,
    PLATFORMS,
    TARGETS,
    WASM,
    Compiler,
    build_libraries,
    find_compiler,
    two_at_a_time,
)
from ballscrew_fmu.native_fmu.sources import (
    entry_sources,
    is_fmi_header,
    native_sources,
    page_sources,
    units_of,
)
from ballscrew_fmu.variables.friction import fmu_variables
from ballscrew_tehl.runtime.user_cache import digest, user_cache

PREBUILT = importlib.resources.files("ballscrew_fmu") / "prebuilt"
COMPILER_FILE = "compiler.txt"  # its name, in the folder prebuilt
ENTRY_PLATFORMS = ("x86_64-linux", "x86_64-windows")  # of pythonfmu


class Library(NamedTuple):
    """A library before it is compiled."""

    name: str
    sources: Mapping[str, bytes]
    units: Sequence[str]  # that are compiled
    platforms: tuple[str, ...]

    def file(self, platform: str) -> str:
        """Name of its file where it is kept. The FMI headers, of the standard, do not count."""
        own = {name: content for name, content in self.sources.items() if not is_fmi_header(name)}
        recipe = repr((COMPILER_OPTIONS, TARGETS[platform], self.units)).encode()
        return f"{self.name}.{platform}.{digest({**own, 'recipe': recipe})[:20]}"


def native_library(header: Mapping[str, Any], model: FmuModel) -> Library:
    """That of the native FMUs of a model, with both FMI versions. header : of any map"""
    return Library(model.native_name, native_sources(header, model=model), units_of(model), tuple(PLATFORMS))


def entry_library(header: Mapping[str, Any]) -> Library:
    """That of the FMU for Python hosts."""
    sources = entry_sources(fmu_variables(header))
    return Library(f"{FRICTION.name}_entry", sources, ("entry.c",), ENTRY_PLATFORMS)


def page_library(header: Mapping[str, Any]) -> Library:
    """The WebAssembly of the live page."""
    return Library("page", page_sources(header), ("page.c",), (WASM,))


def all_libraries(header: Mapping[str, Any]) -> list[Library]:
    """Of all FMUs, and the live page."""
    return [
        *(native_library(header, model) for model in MODELS),
        entry_library(header),
        page_library(header),
    ]


def provider(header: Mapping[str, Any], embed_map: bool = False) -> Compiler:
    """For which platforms there are libraries, and the compiler that they are from.

    embed_map: the map is compiled in, which needs a compiler here. BuildError: they are not in the package and there
    is no compiler.
    """
    target = [(one, platform) for one in all_libraries(header) for platform in one.platforms]
    if not embed_map and all((PREBUILT / one.file(platform)).is_file() for one, platform in target):
        name = (PREBUILT / COMPILER_FILE).read_text(encoding="utf-8")
        return Compiler((), name, tuple(PLATFORMS), True)
    return find_compiler()


def contents(library: Library, platforms: Sequence[str] | None = None) -> dict[str, bytes]:
    """The compiled library by platform; None: of all.

    BuildError: it has to be compiled, and there is no compiler for a platform, or its first error.
    """
    return {platform: _content(library, platform) for platform in platforms or library.platforms}


def _content(library: Library, platform: str) -> bytes:
    shipped = PREBUILT / library.file(platform)
    if shipped.is_file():
        return shipped.read_bytes()
    file = _kept(library, platform, find_compiler())
    with FileLock(f"{file}.lock"):
        if not file.is_file():
            made = build_libraries(library.sources, library.units, library.name, (platform,))
            write_whole(file, made[platform])
    return file.read_bytes()


def _kept(library: Library, platform: str, compiler: Compiler) -> Path:
    by = re.sub(r"[^\w.]+", "_", compiler.name)
    return _folder(user_cache() / "libraries") / f"{library.file(platform)}.{by}"


@functools.cache
def _folder(cache: Path) -> Path:
    """The folder of the cache; where it cannot be written, one of this process."""
    with contextlib.suppress(OSError):
        cache.mkdir(parents=True, exist_ok=True)
    if os.access(cache, os.W_OK):
        return cache
    own = Path(tempfile.mkdtemp(prefix="ballscrew_libraries_"))
    atexit.register(shutil.rmtree, own, ignore_errors=True)
    return own


def prepare(
    libraries: Sequence[Library], platforms: Sequence[str], advance: Callable[[str, int], None]
) -> None:
    """Compile those libraries that are not there for these platforms, two at a time.

    advance: called with how many there are to compile, with each that is compiled, and 0. BuildError: as contents.
    """
    needed = [
        (library, platform)
        for library in libraries
        for platform in library.platforms
        if platform in platforms
        and not (PREBUILT / library.file(platform)).is_file()
        and not _kept(library, platform, find_compiler()).is_file()
    ]
    if needed:
        advance(f"compiling {len(needed)} libraries, some minutes", 0)
    one_line, number = threading.Lock(), iter(range(1, len(needed) + 1))

    def compiled(library: Library, platform: str) -> None:
        _content(library, platform)
        with one_line:
            advance(f"compiled {next(number)} of {len(needed)}: {library.name} for {platform}", 0)

    two_at_a_time([functools.partial(compiled, *one) for one in needed])


def main() -> int:
    """Fill the folder prebuilt of a clone, for the wheel that is built next."""
    from ballscrew_tehl.nut_map.load import load_map

    folder, compiler = Path(str(PREBUILT)), find_compiler()
    libraries = all_libraries(load_map(None).header)
    shutil.rmtree(folder, ignore_errors=True)
    prepare(libraries, tuple(TARGETS), lambda text, _: print(text, flush=True))
    for library in libraries:
        for platform, content in contents(library).items():
            write_whole(folder / library.file(platform), content)
    (folder / COMPILER_FILE).write_text(compiler.name, encoding="utf-8")
    size = sum(path.stat().st_size for path in folder.iterdir())
    print(f"{folder}: libraries of {compiler.name}, {size} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
