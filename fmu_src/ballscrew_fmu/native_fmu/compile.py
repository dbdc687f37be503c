"""Compiles the native FMUs for five platforms with ziglang, without it for this machine with its own C compiler.

Same sources and same ziglang give the same bytes. A binary contains no path, date or debug information: the compiler
runs in the folder of the sources with relative file names.

For Windows and WebAssembly zig would first compile a C library, which takes it a minute. Both are linked without one:
to the functions that Windows itself has, and to those of JavaScript.
"""

import contextlib
import functools
import importlib.util
import os
import platform as machine
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple, TypeVar

from ballscrew_fmu.archive import BuildError
from ballscrew_fmu.native_fmu.sources import is_fmi_header

Result = TypeVar("Result")


class Platform(NamedTuple):
    target: str  # of zig
    suffix: str  # of the shared library
    options: tuple[str, ...]
    linker: tuple[str, ...] = ()  # of zig, with its options; (): the compiler links, with a C library
    imports: tuple[tuple[str, str], ...] = ()  # libraries of the system with the functions of them
    source: str = ""  # in C, compiled in addition


class Compiler(NamedTuple):
    """A C compiler: how it is called, its name with version, the platforms that it builds for."""

    command: tuple[str, ...]
    name: str
    platforms: tuple[str, ...]
    crosses: bool  # builds for other machines, by the option -target of zig


# Windows 10 and later have the C library (UCRT) in these. The probe of stack pages has another name in ntdll.
_UCRT = {
    "heap": "calloc free malloc",
    "math": "ceil cos exp expm1 floor hypot log pow sin sqrt tanh",
    "private": "memcmp memcpy strstr",
    "runtime": "_errno strerror",
    "stdio": "__stdio_common_vsprintf _wfopen fclose fgets fopen fread fseek ftell",
    "string": "memset strcmp strcpy strcspn strlen strspn",
}
_WINDOWS = (
    *((f"api-ms-win-crt-{name}-l1-1-0", functions) for name, functions in _UCRT.items()),
    ("ntdll", "___chkstk_ms==__chkstk"),
    (
        "kernel32",
        "AcquireSRWLockExclusive GetLastError GetModuleFileNameW GetModuleHandleExW GetProcAddress GetShortPathNameW "
        "LoadLibraryW MultiByteToWideChar ReleaseSRWLockExclusive",
    ),
)
# what headers of a C library declare and the UCRT has under other names
_WINDOWS_SOURCE = """\
#include <stdarg.h>
#include <stddef.h>
int __stdio_common_vsprintf(unsigned long long, char *, size_t, const char *, void *, va_list);
int vsnprintf(char *to, size_t size, const char *format, va_list arguments)
{
    return __stdio_common_vsprintf(2, to, size, format, NULL, arguments); /* 2: as the standard */
}
int snprintf(char *to, size_t size, const char *format, ...)
{
    va_list arguments;
    int used;
    va_start(arguments, format);
    used = vsnprintf(to, size, format, arguments);
    va_end(arguments);
    return used;
}
int __fpclassify(double x) { return x != x ? 0x0100 : x - x != 0.0 ? 0x0500 : 0x0400; }
"""
_ELF = ("-shared", "-fPIC", "-Wl,--build-id=none", "-lm")
PLATFORMS: Mapping[str, Platform] = {  # by platform tuple of FMI 3
    "x86_64-linux": Platform("x86_64-linux-gnu.2.17", ".so", _ELF),
    "aarch64-linux": Platform("aarch64-linux-gnu.2.17", ".so", _ELF),
    "x86_64-windows": Platform(
        "x86_64-windows-gnu", ".dll", ("-D__USE_MINGW_ANSI_STDIO=0",),
        ("lld-link", "/dll", "/noentry", "/nodefaultlib", "/brepro", "/out:{library}"), _WINDOWS, _WINDOWS_SOURCE,
    ),
    "x86_64-darwin": Platform("x86_64-macos", ".dylib", ("-shared", "-fPIC")),
    "aarch64-darwin": Platform("aarch64-macos", ".dylib", ("-shared", "-fPIC")),
}  # fmt: skip
WASM = "WebAssembly"  # a module that imports Math of JavaScript, with the functions of default visibility
TARGETS = {
    **PLATFORMS,
    WASM: Platform(
        "wasm32-wasi", ".wasm", ("-DBALLSCREW_NO_THREADS",),
        ("wasm-ld", "--no-entry", "--export-dynamic", "--import-undefined", "--strip-all", "-o", "{library}"),
    ),
}  # fmt: skip
# -ffp-contract=off: no fused multiply-add on aarch64, so that all platforms round alike
COMPILER_OPTIONS = ("-std=c99", "-O2", "-ffp-contract=off", "-fvisibility=hidden")
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror")

# fat header of macOS, big-endian: magic, count; then per slice cpu type, cpu subtype, offset, size, alignment
_FAT_MAGIC = 0xCAFEBABE
_FAT_ALIGNMENT = 14  # 2^14 bytes, the page of arm64
_CPU_TYPES = {0x01000007: 3, 0x0100000C: 0}  # x86_64, arm64: cpu subtype "all"
_MACH_MAGIC_64 = 0xFEEDFACF
INSTALL = "python -m pip install ziglang"  # or the extra compile
_ZIG = (sys.executable, "-m", "ziglang")


def find_compiler() -> Compiler:
    """ziglang, else the C compiler of this machine: that in the variable CC, cc, gcc or clang.

    BuildError: there is none.
    """
    if importlib.util.find_spec("ziglang") is not None:
        version = _answer(*_ZIG, "version").strip()
        return Compiler((*_ZIG, "cc"), f"ziglang {version}", tuple(PLATFORMS), True)
    candidates = [os.environ.get("CC"), "cc", "gcc", "clang"]
    own = next((result for name in candidates if name and (result := shutil.which(name))), None)
    if own is None:
        raise BuildError(
            f"no C compiler: neither ziglang, which builds for Linux, Windows and macOS ({INSTALL}) nor cc, gcc or "
            "clang on the path"
        )
    version = _answer(own, "-dumpfullversion", "-dumpversion").split()[0]
    return Compiler((own,), f"{Path(own).stem} {version}", (this_platform(),), False)


@functools.cache
def _answer(*command: str) -> str:
    return _run(command, Path.cwd(), command[0])


def this_platform() -> str:
    """Platform tuple of FMI 3 of this machine. BuildError: the FMUs are not made for it."""
    processor = {"amd64": "x86_64", "arm64": "aarch64"}.get(
        machine.machine().lower(), machine.machine().lower()
    )
    system = {"win32": "windows"}.get(sys.platform, sys.platform)
    if f"{processor}-{system}" not in PLATFORMS:
        raise BuildError(
            f"no libraries for {processor}-{system} without ziglang, only for {', '.join(PLATFORMS)}: {INSTALL}"
        )
    return f"{processor}-{system}"


def build_libraries(
    sources: Mapping[str, bytes], units: Sequence[str], name: str, platforms: Sequence[str]
) -> dict[str, bytes]:
    """Shared libraries by platform of TARGETS.

    sources: C files and headers by name; units: those that are compiled; name: of the library, without suffix.
    BuildError: there is no compiler for a platform, or its first error.
    """
    compiler = find_compiler()
    if missing := [name for name in platforms if not compiler.crosses and name not in compiler.platforms]:
        raise BuildError(f"{compiler.name} does not compile for {', '.join(missing)}: {INSTALL}, which does")
    tasks = [functools.partial(_compiled, compiler, sources, units, name, platform) for platform in platforms]
    return dict(zip(platforms, two_at_a_time(tasks), strict=True))


def two_at_a_time(tasks: Sequence[Callable[[], Result]]) -> list[Result]:
    """Results in their order. The first error ends it."""
    with ThreadPoolExecutor(max_workers=min(2, os.cpu_count() or 1)) as pool:
        return list(pool.map(lambda task: task(), tasks))


def universal_library(slices: Sequence[bytes]) -> bytes:
    """One fat Mach-O from several thin ones, as written by lipo.

    BuildError: a slice is not a 64-bit Mach-O of a known processor.
    """
    page = 1 << _FAT_ALIGNMENT
    table, body = struct.pack(">II", _FAT_MAGIC, len(slices)), b""
    for content in slices:
        magic, cpu_type = struct.unpack_from("<II", content)
        if magic != _MACH_MAGIC_64 or cpu_type not in _CPU_TYPES:
            raise BuildError(f"slice with magic {magic:#x} and processor {cpu_type:#x} is not a known Mach-O")
        body += bytes(-len(body) % page)
        place = (page + len(body), len(content), _FAT_ALIGNMENT)
        table += struct.pack(">IIIII", cpu_type, _CPU_TYPES[cpu_type], *place)
        body += content
    return table.ljust(page, b"\0") + body


def _compiled(
    compiler: Compiler, sources: Mapping[str, bytes], units: Sequence[str], name: str, platform: str
) -> bytes:
    target = TARGETS[platform]
    library, options = f"{name}{target.suffix}", target.options
    if platform.endswith("darwin"):
        options = (*options, f"-Wl,-install_name,@rpath/{library}")
    if not compiler.crosses and target.linker:  # by the C library of this machine
        options = ("-shared",)
    # of a compiler that the sources have not been tried with, a warning is not an error
    strict = ("-target", target.target, *WARNINGS) if compiler.crosses else ()
    # FMI 3.0 headers cause warnings, which -isystem suppresses
    command = [*compiler.command, *strict, *COMPILER_OPTIONS, "-s", "-isystem", "fmi"]
    with tempfile.TemporaryDirectory(prefix="ballscrew_native_") as scratch:
        folder = Path(scratch)
        (folder / "fmi").mkdir()
        for file, content in sources.items():
            (folder / ("fmi" if is_fmi_header(file) else ".") / file).write_bytes(content)
        if compiler.crosses and target.linker:
            _link([*command, *options], units, target, library, folder)
        else:
            _run([*command, "-o", library, *units, *options], folder, platform)
        return (folder / library).read_bytes()


def _link(command: Sequence[str], units: Sequence[str], target: Platform, library: str, folder: Path) -> None:
    """Compile and link without a C library."""
    parts = []
    if target.source:
        (folder / "system.c").write_text(target.source)
        units = [*units, "system.c"]
    for unit in units:
        parts.append(f"{unit}.o")
        _run([*command, "-c", "-o", parts[-1], unit], folder, target.target)
    for system, functions in target.imports:
        exports = "\n".join(functions.split()).replace("==", " == ")
        (folder / f"{system}.def").write_text(f"LIBRARY {system}.dll\nEXPORTS\n{exports}\n")
        parts.append(f"{system}.lib")
        tool = [*_ZIG, "dlltool", "-m", "i386:x86-64", "-d", f"{system}.def", "-l", parts[-1]]
        _run(tool, folder, target.target)
    linker = [option.format(library=library) for option in target.linker]
    _run([*_ZIG, *linker, *parts], folder, target.target)


def _with_cache() -> dict[str, str]:
    """Environment of the compiler, with a folder for the cache of zig that can be written.

    Without one, or without HOME, zig fails or never ends. ZIG_GLOBAL_CACHE_DIR, if set, is kept.
    """
    environment = dict(os.environ)
    if os.name == "posix" and "ZIG_GLOBAL_CACHE_DIR" not in environment:
        cache = Path(environment.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "zig")
        with contextlib.suppress(OSError):
            cache.mkdir(parents=True, exist_ok=True)
        usable = os.access(cache, os.W_OK)
        own = str(cache) if usable else f"{tempfile.gettempdir()}/ballscrew_zig_{os.getuid()}"
        environment["ZIG_GLOBAL_CACHE_DIR"] = own
    return environment


def _run(command: Sequence[str], folder: Path, what: str) -> str:
    try:
        run = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=_with_cache())
    except OSError as error:
        raise BuildError(f"{what}: {' '.join(command[:4])}: {error.strerror or error}") from error
    if run.returncode:
        lines = [line for line in (run.stderr + run.stdout).splitlines() if line.strip()]
        errors = [line for line in lines if "error" in line] or lines or ["no message"]
        raise BuildError(f"{what}: the compiler failed with exit code {run.returncode}: {errors[0].strip()}")
    return run.stdout
