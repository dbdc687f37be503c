"""The native runtime in C hosts and under sanitizers: memory, threads, several FMUs in one program, the map file."""

import os
import re
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import pytest
from fmu_checks import fmi_functions
from native_library import NativeInstance
from native_model import FLAGS, TOKEN, c_host, compiled_model, compiler, put_resources, resources
from native_walk import WALKED, sealed
from paths import FMU_SUPPORT, ROOT, SUPPORT
from synthetic_map import closed_form, make_map

from ballscrew_fmu.models import FRICTION, MONITOR
from ballscrew_fmu.native_fmu.resource_files import (
    HEAD_SIZE,
    MAP_FILE,
    SCREW_FILE,
    map_bytes,
    screw_bytes,
)
from ballscrew_fmu.native_fmu.sources import Embedded, is_fmi_header, native_sources, table_hash, units_of
from ballscrew_tehl.runtime.packed import AXES, DEFAULTS, MECHANISTIC

pytestmark = pytest.mark.slow
NUT_MAP, OTHER = closed_form(), make_map(viscous_scale=2.0)


def run(*command, code=0, **options):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=600, **options)
    assert done.returncode == code, done.stdout + done.stderr
    assert code or "Sanitizer" not in done.stderr, done.stderr
    return done.stdout


def test_random_calls_under_sanitizers():
    """All functions of both versions in random order, damaged states and map files: native_walk.py."""
    names = [run(*compiler(), f"-print-file-name=lib{name}.so").strip() for name in ("asan", "ubsan")]
    if not all(map(os.path.isabs, names)):
        pytest.skip("needs the sanitizers of gcc, which are preloaded")
    for model, law in WALKED:  # compiled without the sanitizer in the compiler
        compiled_model(closed_form(law), model, sanitize=True)
    environment = {
        **os.environ, "LD_PRELOAD": " ".join(names), "ASAN_OPTIONS": "detect_leaks=0", "PYTHONMALLOC": "malloc",
        "PYTHONPATH": os.pathsep.join(map(str, (FMU_SUPPORT, SUPPORT, *sys.path[1:]))),
    }  # fmt: skip
    assert int(run(sys.executable, FMU_SUPPORT / "native_walk.py", 5, env=environment)) > 3_300


def test_memory_is_taken_for_maps_and_by_the_allocator_of_the_importer_alone():
    """No step can allocate: instances, saved states and paths are what `allocate` serves, in three functions."""
    native = ROOT / "fmu_src/ballscrew_fmu/native"
    taken = {
        (path.relative_to(native).as_posix(), *re.findall(r"\b(\w*alloc\w*|strn?dup)\(", path.read_text()))
        for folder in ("core", "models", "runtime")
        for path in (native / folder).rglob("*.[ch]")
    }
    once = {(f"runtime/{name}.c", "allocate") for name in ("saved_state", "resources", "instance")}
    assert {names for names in taken if len(names) > 1} == once | {
        ("core/map.c", "calloc"), ("core/file.c", "malloc")
    }  # fmt: skip


LOCKS = {
    "of the system": ((), False),
    "none": (("-DBALLSCREW_NO_THREADS",), True),
}  # must the sanitizer find a race


@pytest.mark.parametrize("lock", LOCKS)
def test_instances_in_threads_share_maps_safely(tmp_path, lock):
    """Made, stepped, saved and freed: as in a serial run. Without a lock the thread sanitizer finds the race."""
    options, races = LOCKS[lock]
    put_resources(tmp_path, OTHER)
    try:
        program = c_host(NUT_MAP, "threads", "-g", "-O0", "-fsanitize=thread", *options)
    except FileNotFoundError as error:
        pytest.skip(str(error))
    command = [str(program), str(program.parent), str(tmp_path), "8", "60"]
    environment = {**os.environ, "TSAN_OPTIONS": "halt_on_error=1"}
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, env=environment)
    assert ("data race" in done.stderr) == races, done.stderr
    assert races or (done.returncode == 0 and "all as in a serial run" in done.stdout), done.stdout


def test_a_thousand_instances_share_one_map_and_leave_nothing():
    """Less than 20 MB more than one; a map of each would be 50 MB."""

    def resident():
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")

    if not sys.platform.startswith("linux"):
        pytest.skip("reads /proc")
    many = [NativeInstance(2, logger=False) for _ in range(10)]
    before = resident()
    many += [NativeInstance(2, logger=False) for _ in range(1000)]
    assert resident() - before < 20e6
    for one in many:
        one.__exit__()
    for n in range(2000):  # each reads the map again
        NativeInstance(2 + n % 2, logger=False).__exit__()
    assert resident() - before < 20e6


# --- several FMUs in one program, maps compiled in ---


def test_fmus_of_two_screws_and_the_monitor_fit_into_one_program(tmp_path):
    """With screws and maps compiled in: all external names differ, no file is opened. They are linked, and run."""
    nm = shutil.which("nm") or pytest.skip("no nm")
    fmus = (("one", FRICTION, 2, NUT_MAP), ("two", FRICTION, 2, OTHER), ("three", MONITOR, 3, NUT_MAP))
    names, objects = set(), []
    for name, model, version, nut_map in fmus:
        place = tmp_path / name
        (place / "fmi").mkdir(parents=True)
        screw = resources(nut_map, model, name)[SCREW_FILE]
        sources = native_sources(nut_map.header, (version,), model, Embedded(nut_map, screw))
        for file, content in sources.items():
            (place / ("fmi" if is_fmi_header(file) else ".") / file).write_bytes(content)
        options = (
            "-std=c99", "-Wall", "-Werror", *FLAGS, f"-DFMI{version}_FUNCTION_PREFIX={name}_", "-isystem",
            "fmi",
        )  # fmt: skip
        run(*compiler(), *options, "-c", *units_of(model), cwd=place)
        units = [place / unit.replace(".c", ".o") for unit in units_of(model)]
        found = set(re.findall(r"^\S* [A-TV-Z] (\S+)$", run(nm, "-g", *units), re.MULTILINE))
        assert {f"{name}_{function}" for function in fmi_functions(version)} <= found
        assert {one for one in found if not one.startswith(f"{name}_")} == set()
        assert not found & names
        names |= found
        objects += units
        wanted = run(nm, "-u", *units)
        assert not re.search(r"\b(fopen|fread|fseek|_wfopen|open)\w*\b", wanted)
    host = tmp_path / "host.c"
    host.write_text(TWO_SCREWS)
    headers = ("-isystem", tmp_path / "one" / "fmi")
    run(*compiler(), "-std=c99", *headers, "-o", tmp_path / "host", host, *objects, "-lm")
    expected = [m.evaluate(2000.0, 10.0, 303.15) for m in (NUT_MAP, OTHER)]
    found = [float(text) for text in run(tmp_path / "host").split()]
    assert found == pytest.approx([one.viscous_torque for one in expected], rel=1e-12)


TWO_SCREWS = """
#include <stdio.h>
#define FMI2_FUNCTION_PREFIX one_
#include "fmi2Functions.h"
#undef fmi2Functions_h
#undef FMI2_FUNCTION_PREFIX
#define DECLARE(name) extern fmi2##name##TYPE one_fmi2##name, two_fmi2##name;
DECLARE(Instantiate) DECLARE(SetupExperiment) DECLARE(EnterInitializationMode) DECLARE(SetReal) DECLARE(GetReal)
#define RUN(screw)                                                                                  \\
    {                                                                                               \\
        const fmi2ValueReference in[] = {1, 2, 3}, out = 6;                                          \\
        const double at[] = {2000.0, 10.0, 303.15};                                                  \\
        double torque = 0.0;                                                                         \\
        fmi2Component c = screw##_fmi2Instantiate("a", fmi2CoSimulation, #screw, NULL, NULL, 0, 0);    \\
        if (c == NULL || screw##_fmi2SetReal(c, in, 3, at) != fmi2OK                                   \\
            || screw##_fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0) != fmi2OK                           \\
            || screw##_fmi2EnterInitializationMode(c) != fmi2OK                                        \\
            || screw##_fmi2GetReal(c, &out, 1, &torque) != fmi2OK) {                                   \\
            return 1;                                                                                \\
        }                                                                                            \\
        printf("%.17g\\n", torque);                                                                  \\
    }
int main(void)
{
    RUN(one)
    RUN(two)
    return 0;
}
"""


# --- the files of the resources ---


def refusal(folder, version=2, of=NUT_MAP, **files):
    """The one message why there is no instance with these files; empty if there is one."""
    put_resources(folder, of, **files)
    with NativeInstance(version, resources=str(folder), nut_map=of) as one:
        assert one.handle or [message.status for message in one.messages] == [3]
        return "" if one.handle else one.last


def test_a_screw_file_that_is_not_of_this_library_is_refused_with_one_message(tmp_path):
    good = resources(NUT_MAP)[SCREW_FILE]
    table, own = table_hash(NUT_MAP.header), FRICTION.native_name

    assert refusal(tmp_path, screw=good) == ""
    start = HEAD_SIZE + 4 * 64 + 8  # of the first start value
    nan = good[:start] + struct.pack("<d", float("nan")) + good[start + 8 :]
    for content, found in (
        (screw_bytes(NUT_MAP.header, MONITOR, table, TOKEN), f"is of {MONITOR.native_name}, this library is {own}"),
        (screw_bytes(NUT_MAP.header, FRICTION, "0" * 64, TOKEN), f"000000000000, this library has {table[:12]}"),
        (screw_bytes(NUT_MAP.header, FRICTION, table, "{other}"), "the resources have {other}"),
        (sealed(good[:-8]), "another version"), (sealed(good + bytes(8)), "another version"),
        (sealed(nan), "start value of preload is not valid"), (b"BSFSCR00" + good[8:], "begins with 'BSFSCR01'"),
        (map_bytes(NUT_MAP), "not a screw"), (b"", "0 bytes"),
    ):  # fmt: skip
        for version in (2, 3):
            assert found in refusal(tmp_path, version, screw=content), found
    for size in range(0, len(good), 31):
        assert refusal(tmp_path, screw=good[:size]), size
    for bit in range(0, 8 * len(good), 17):
        flipped = bytearray(good)
        flipped[bit // 8] ^= 1 << bit % 8
        assert refusal(tmp_path, screw=bytes(flipped)), bit


@pytest.mark.skipif(os.name != "posix", reason="makes links and pipes")
@pytest.mark.parametrize("name", [SCREW_FILE, MAP_FILE])
def test_what_is_no_file_is_refused_with_one_message(tmp_path, name):
    """Missing, a folder, a link, a pipe and a device, which has no end, and 2 GB of zeros."""
    place, good = tmp_path / name, tmp_path / "good"

    def refused(found):
        for version in (2, 3):
            with NativeInstance(version, resources=str(tmp_path)) as one:
                assert one.handle is None
                assert [message.status for message in one.messages] == [3]
                assert found in one.last
                assert name in one.last

    put_resources(tmp_path, NUT_MAP)
    place.rename(good)
    refused("No such file")
    place.mkdir()
    refused("Is a directory")
    place.rmdir()
    for target in (good, tmp_path / "nothing", Path("/dev/zero"), place):
        place.symlink_to(target)
        refused("Too many levels of symbolic links" if sys.platform == "linux" else "needs a file")
        place.unlink()
    os.mkfifo(place)
    refused("needs a file")
    place.unlink()
    with place.open("wb") as file:
        file.truncate(2**31 + 8)
    refused("larger than")


# --- the map file ---

GOOD = map_bytes(NUT_MAP)
HEAD = 88  # [bytes] magic, size, checksum, content hash
LAW = 8 * (3 * len(AXES) + len(DEFAULTS))  # [bytes] axes and defaults, before the law


def test_damaged_and_foreign_map_files_are_refused(tmp_path):
    def number(place, value):
        return sealed(GOOD[: HEAD + place] + struct.pack("<d", value) + GOOD[HEAD + place + 8 :])

    assert sealed(GOOD) == GOOD
    mechanistic = map_bytes(closed_form(MECHANISTIC))
    for content, of in (
        (GOOD, NUT_MAP),
        (map_bytes(OTHER), NUT_MAP),
        (mechanistic, closed_form(MECHANISTIC)),
    ):
        assert refusal(tmp_path, of=of, nut_map=content) == ""
    for content, found in (
        (GOOD[:20], "not a nut map"), (GOOD[:50], "truncated"), (b"X" + GOOD[1:], "not a nut map"),
        (GOOD[:-8], "truncated"), (GOOD + bytes(8), "truncated"), (sealed(GOOD[:-8]), "size does not fit"),
        (GOOD[:500] + bytes([GOOD[500] ^ 16]) + GOOD[501:], "checksum"), (number(0, -1.0), "axis force"),
        (number(16, 3.0), "axis force"), (number(16, 1e9), "axis force"), (number(16, 4096.0), "size does not fit"),
        *((number(LAW, law), "friction law") for law in (2.0, 0.5, float("nan"))),
        (sealed(GOOD[:-8] + struct.pack("<d", float("nan"))), "not finite"),
        (number(LAW - 8, float("inf")), "a default is not finite"),
        (mechanistic, "has the friction law mechanistic, expected film_shear"),
        (b"BSFMAP01" + GOOD[8:], "begins with 'BSFMAP03'"), (b"\x00\n\x50\xff", "begin with '..P.'"),
    ):  # fmt: skip
        assert found in refusal(tmp_path, nut_map=content), found
    odd = screw_bytes(NUT_MAP.header, FRICTION, "x", "t").replace(
        FRICTION.native_name.encode(), b"Ball\n\xff\x1b[2J", 1
    )
    assert refusal(tmp_path, screw=sealed(odd.ljust(-(-len(odd) // 8) * 8, b"\0"))).isprintable()
    for bit in range(8 * HEAD):
        flipped = bytearray(GOOD)
        flipped[bit // 8] ^= 1 << bit % 8
        assert refusal(tmp_path, nut_map=bytes(flipped)), bit
