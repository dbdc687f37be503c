"""The native runtime in C hosts and under sanitizers: memory, threads, several FMUs in one program, the map file."""

import ctypes
import os
import re
import shutil
import struct
import subprocess
import sys
from ctypes import c_double, c_size_t, c_uint, c_void_p
from pathlib import Path

import pytest
from fmu_checks import fmi_functions
from native_library import OK, NativeInstance, doubles
from native_model import FLAGS, TOKEN, c_host, compiler, put_resources, resources, sealed
from paths import FMU_SUPPORT
from synthetic_map import closed_form, make_map

from ballscrew_fmu.models import FRICTION, MONITOR
from ballscrew_fmu.native_fmu.resource_files import HEAD_SIZE, MAP_FILE, SCREW_FILE, map_bytes, screw_bytes
from ballscrew_fmu.native_fmu.sources import Embedded, is_fmi_header, native_sources, table_hash, units_of
from ballscrew_tehl.runtime.packed import AXES, DEFAULTS, Law

pytestmark = pytest.mark.slow
NUT_MAP, OTHER = closed_form(), make_map(viscous_scale=2.0)


def run(*command, code=0, **options):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=600, **options)
    assert done.returncode == code, done.stdout + done.stderr
    assert code or "Sanitizer" not in done.stderr, done.stderr
    return done.stdout


def test_calls_states_and_files_under_sanitizers():
    """Of all models in random order, also illegal and damaged ones: native_walk.py."""
    names = [run(*compiler(), f"-print-file-name=lib{name}.so").strip() for name in ("asan", "ubsan")]
    if not all(map(os.path.isabs, names)):
        pytest.skip("needs the sanitizers of gcc, which are preloaded")
    environment = os.environ | {
        "LD_PRELOAD": " ".join(names), "ASAN_OPTIONS": "detect_leaks=0", "PYTHONMALLOC": "malloc",
        "BALLSCREW_CFLAGS": "-g -O0 -fsanitize=address,undefined -fno-sanitize-recover=all",
        "PYTHONPATH": os.pathsep.join(sys.path),
    }  # fmt: skip
    run(sys.executable, FMU_SUPPORT / "native_walk.py", 5, env=environment)


@pytest.mark.parametrize(("options", "races"), [((), False), (("-DBALLSCREW_NO_THREADS",), True)])
def test_instances_in_threads_share_maps_safely(tmp_path, options, races):
    """Made, stepped and freed: as in a serial run. Without the lock the thread sanitizer finds the race."""
    if len(compiler()) > 1:
        pytest.skip("no C compiler of the system")
    program = c_host(NUT_MAP, "threads", "-g", "-O0", "-fsanitize=thread", *options)
    command = [str(program), str(program.parent), put_resources(tmp_path, OTHER)]
    environment = os.environ | {"TSAN_OPTIONS": "halt_on_error=1"}
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, env=environment)
    assert ("data race" in done.stderr, done.returncode == 0) == (races, not races), done.stdout + done.stderr


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_a_thousand_instances_share_one_map_and_leave_nothing():
    """Less than 20 MB more than one; a map of each would be 50 MB."""

    def resident():
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")

    many = [NativeInstance(2, logger=False) for _ in range(10)]
    before = resident()
    many += [NativeInstance(2, logger=False) for _ in range(1000)]
    assert resident() - before < 20e6
    for one in many:
        one.__exit__()
    for _ in range(2000):  # each reads the map again
        NativeInstance(3, logger=False).__exit__()
    assert resident() - before < 20e6


def test_fmus_of_two_screws_fit_into_one_program(tmp_path):
    """With screws and maps compiled in: all external names differ, no file is opened. They are linked, and run."""
    nm = shutil.which("nm") or pytest.skip("no nm")
    objects = []
    for name, nut_map in (("one", NUT_MAP), ("two", OTHER)):
        place = tmp_path / name
        (place / "fmi").mkdir(parents=True)
        screw = resources(nut_map, FRICTION, name)[SCREW_FILE]
        sources = native_sources(nut_map.header, (2,), FRICTION, Embedded(nut_map, screw))
        for file, content in sources.items():
            (place / ("fmi" if is_fmi_header(file) else ".") / file).write_bytes(content)
        options = "-std=c99", "-fPIC", *FLAGS, f"-DFMI2_FUNCTION_PREFIX={name}_", "-isystem", "fmi"
        run(*compiler(), *options, "-c", *units_of(FRICTION), cwd=place)
        units = [place / unit.replace(".c", ".o") for unit in units_of(FRICTION)]
        found = set(re.findall(r"^\S* [A-TV-Z] (\S+)$", run(nm, "-g", *units), re.MULTILINE))
        assert {f"{name}_{function}" for function in fmi_functions(2)} <= found
        assert all(one.startswith(f"{name}_") for one in found)
        assert not re.search(r"\b(fopen|fread|fseek|_wfopen|open)\w*\b", run(nm, "-u", *units))
        objects += units
    run(*compiler(), "-shared", "-o", tmp_path / "both.so", *objects, "-lm")
    both, torque = ctypes.CDLL(str(tmp_path / "both.so")), doubles(0.0)
    for name, nut_map in (("one", NUT_MAP), ("two", OTHER)):
        names = "Instantiate", "SetReal", "SetupExperiment", "EnterInitializationMode", "GetReal"
        make, put, set_up, enter, get = (both[f"{name}_fmi2{call}"] for call in names)
        make.restype, zero, vr = c_void_p, c_double(0.0), (c_uint * 4)(1, 2, 3, 7)
        handle = c_void_p(make(b"a", 1, name.encode(), None, None, 0, 0))
        assert put(handle, vr, c_size_t(3), doubles(2000.0, 10.0, 303.15)) == OK
        assert (set_up(handle, 0, zero, zero, 0, zero), enter(handle)) == (OK, OK)
        assert get(handle, (c_uint * 1)(7), c_size_t(1), torque) == OK
        assert torque[0] == pytest.approx(nut_map.evaluate(2000.0, 10.0, 303.15).viscous_torque, rel=1e-12)


def refusal(folder, version=2, of=NUT_MAP, **files):
    put_resources(folder, of, **files)
    with NativeInstance(version, resources=str(folder), nut_map=of) as one:
        assert one.handle or [message.status for message in one.messages] == [3]
        return "" if one.handle else one.last


def flipped(content, bits):
    for bit in bits:
        yield content[: bit // 8] + bytes([content[bit // 8] ^ 1 << bit % 8]) + content[bit // 8 + 1 :]


def test_a_screw_file_that_is_not_of_this_library_is_refused_with_one_message(tmp_path):
    good, table = resources(NUT_MAP)[SCREW_FILE], table_hash(NUT_MAP.header)
    assert refusal(tmp_path, screw=good) == ""
    start = HEAD_SIZE + 4 * 64 + 8  # of the first start value
    nan = good[:start] + struct.pack("<d", float("nan")) + good[start + 8 :]
    for content, found in (
        (screw_bytes(NUT_MAP.header, MONITOR, table, TOKEN), f"is of {MONITOR.native_name}, this library is Ball"),
        (screw_bytes(NUT_MAP.header, FRICTION, "0" * 64, TOKEN), f"000000000000, this library has {table[:12]}"),
        (screw_bytes(NUT_MAP.header, FRICTION, table, "{other}"), "the resources have {other}"),
        (sealed(good[:-8]), "another version"), (sealed(good + bytes(8)), "another version"),
        (sealed(nan), "start value of preload is not valid"), (b"BSFSCR00" + good[8:], "begins with 'BSFSCR01'"),
        (map_bytes(NUT_MAP), "not a screw"), (b"", "0 bytes"),
    ):  # fmt: skip
        for version in (2, 3):
            assert found in refusal(tmp_path, version, screw=content), found
    assert all(refusal(tmp_path, screw=good[:size]) for size in range(0, len(good), 31))
    assert all(refusal(tmp_path, screw=bad) for bad in flipped(good, range(0, 8 * len(good), 17)))


@pytest.mark.skipif(os.name != "posix", reason="makes links and pipes")
@pytest.mark.parametrize("name", [SCREW_FILE, MAP_FILE])
def test_what_is_no_file_is_refused_with_one_message(tmp_path, name):
    """Missing, a folder, a link, a device, which has no end, a pipe, and 2 GB of zeros."""
    place = tmp_path / name
    put_resources(tmp_path, NUT_MAP)
    place.unlink()
    for make, found in (
        (lambda: None, "No such file"), (place.mkdir, "Is a directory"),
        (lambda: place.symlink_to(tmp_path / "nothing"), "needs a file"),
        (lambda: place.symlink_to("/dev/zero"), "needs a file"), (lambda: os.mkfifo(place), "needs a file"),
        (lambda: place.touch() or os.truncate(place, 2**31 + 8), "larger than"),
    ):  # fmt: skip
        make()
        for version in (2, 3):
            with NativeInstance(version, resources=str(tmp_path)) as one:
                assert one.handle is None
                assert [message.status for message in one.messages] == [3]
                assert found in one.last
                assert name in one.last
        if os.path.lexists(place):
            place.rmdir() if place.is_dir() else place.unlink()


GOOD = map_bytes(NUT_MAP)
HEAD = 88  # [bytes] magic, size, checksum, content hash
LAW = 8 * (3 * len(AXES) + len(DEFAULTS))  # [bytes] axes and defaults, before the law


def test_damaged_and_foreign_map_files_are_refused(tmp_path):
    def number(place, value):
        return sealed(GOOD[: HEAD + place] + struct.pack("<d", value) + GOOD[HEAD + place + 8 :])

    assert sealed(GOOD) == GOOD
    law = closed_form(Law.MECHANISTIC)
    for content, of in ((GOOD, NUT_MAP), (map_bytes(OTHER), NUT_MAP), (map_bytes(law), law)):
        assert refusal(tmp_path, of=of, nut_map=content) == ""
    for content, found in (
        (GOOD[:20], "not a nut map"), (GOOD[:50], "truncated"), (b"X" + GOOD[1:], "not a nut map"),
        (GOOD[:-8], "truncated"), (GOOD + bytes(8), "truncated"), (sealed(GOOD[:-8]), "size does not fit"),
        (GOOD[:500] + bytes([GOOD[500] ^ 16]) + GOOD[501:], "checksum"), (number(0, -1.0), "axis force"),
        (number(16, 3.0), "axis force"), (number(16, 1e9), "axis force"), (number(16, 4096.0), "size does not fit"),
        *((number(LAW, value), "friction law") for value in (2.0, 0.5, float("nan"))),
        (sealed(GOOD[:-8] + struct.pack("<d", float("nan"))), "not finite"),
        (number(LAW - 8, float("inf")), "a default is not finite"),
        (map_bytes(law), "has the friction law mechanistic, expected three_parameter"),
        (b"BSFMAP01" + GOOD[8:], "begins with 'BSFMAP04'"), (b"\x00\n\x50\xff", "begin with '..P.'"),
    ):  # fmt: skip
        assert found in refusal(tmp_path, nut_map=content), found
    odd = screw_bytes(NUT_MAP.header, FRICTION, "x", "t").replace(
        FRICTION.native_name.encode(), b"Ball\n\xff\x1b[2J", 1
    )
    assert refusal(tmp_path, screw=sealed(odd.ljust(-(-len(odd) // 8) * 8, b"\0"))).isprintable()
    assert all(refusal(tmp_path, nut_map=bad) for bad in flipped(GOOD, range(8 * HEAD)))
