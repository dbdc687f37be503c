"""What native FMUs of one program share, and what they must not: one map for all instances, names that differ, no file
with a map that is compiled in."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from fmu_checks import fmi_functions
from native_host import c_host, sanitized_c_host
from native_model import compiler
from paths import NATIVE_HOSTS
from synthetic_map import make_map

from ballscrew_fmu.archive import write_fmu
from ballscrew_fmu.checks.check import check
from ballscrew_fmu.checks.replay import Fmu3Instance, FmuInstance
from ballscrew_fmu.description.native import native_description
from ballscrew_fmu.models import FRICTION, MODELS, MONITOR
from ballscrew_fmu.native_fmu.compile import WARNINGS
from ballscrew_fmu.native_fmu.map_file import MAP_FILE, map_bytes
from ballscrew_fmu.native_fmu.package import native_files
from ballscrew_fmu.native_fmu.sources import is_fmi_header, native_sources, prefix
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters

pytestmark = pytest.mark.slow

NUT_MAP, OTHER = make_map(), make_map(viscous_scale=2.0)
AT = (2000.0, 30.0, 310.0, 400.0)
HOST = ("x86_64-linux",)
# prefix of the FMI functions, model, FMI version, map: as linked.c has them
LINKED = (("one", FRICTION, 2, NUT_MAP), ("two", FRICTION, 3, OTHER), ("three", MONITOR, 2, NUT_MAP))


def run(*command, **options):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=600, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Sanitizer" not in done.stderr, done.stderr
    return done.stdout


# one map for all instances


def test_a_thousand_instances_need_less_than_20_mb_more_than_one(tmp_path):
    nut_map = load_map(None, load_parameters())
    program = c_host(tmp_path, nut_map, "instances", "-O2")
    for line in run(program, tmp_path, 1000).splitlines():
        one, more = (int(number) for number in line.split())
        assert one >= 0.9 * len(map_bytes(nut_map)) / 1024  # the map is in memory
        assert more <= 20_000


# compiler options, threads: each kind of lock of lock.h
LOCKS = {
    "of the system": (("-std=c99",), 8),
    "of the compiler": (("-std=c99", "-DBALLSCREW_SPIN_LOCK"), 8),
    "of C11": (("-std=c11", "-DBALLSCREW_SPIN_LOCK"), 8),
    "none": (("-std=c99", "-DBALLSCREW_NO_THREADS"), 1),
}


@pytest.mark.parametrize("sanitizer", ["thread", "address,undefined"])
@pytest.mark.parametrize("lock", LOCKS)
def test_instances_made_and_freed_in_threads_share_maps_safely(tmp_path, lock, sanitizer):
    options, threads = LOCKS[lock]
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / MAP_FILE).write_bytes(map_bytes(OTHER))
    try:
        program = sanitized_c_host(tmp_path, NUT_MAP, "sharing", f"-fsanitize={sanitizer}", *options)
    except FileNotFoundError as error:
        pytest.skip(str(error))
    assert ": 0 differ" in run(program, tmp_path, tmp_path / "other", threads, 150)


def test_without_a_lock_the_thread_sanitizer_finds_the_race(tmp_path):
    """Otherwise the test above could not fail."""
    try:
        program = sanitized_c_host(
            tmp_path, NUT_MAP, "sharing", "-fsanitize=thread", "-DBALLSCREW_NO_THREADS"
        )
    except FileNotFoundError as error:
        pytest.skip(str(error))
    done = subprocess.run(
        [str(program), str(tmp_path), str(tmp_path), "8", "150"], capture_output=True, text=True, timeout=600
    )
    assert "data race" in done.stderr


# several FMUs in one program


def objects(folder: Path, name, model, version, nut_map, compiled_map=None) -> list[str]:
    """Object files of an FMU, compiled as for a static library with this prefix of the FMI functions."""
    place = folder / name
    (place / "fmi").mkdir(parents=True)
    sources = native_sources(nut_map.header, version, f"token-{name}", model, compiled_map)
    for file, content in sources.items():
        (place / ("fmi" if is_fmi_header(file) else ".") / file).write_bytes(content)
    units = sorted(file for file in sources if file.endswith(".c"))
    defined = f"-DFMI{version}_FUNCTION_PREFIX={name}_"
    run(*compiler(), "-std=c99", "-O2", *WARNINGS, defined, "-isystem", "fmi", "-c", *units, cwd=place)
    (place / MAP_FILE).write_bytes(map_bytes(nut_map))
    return [str(place / unit.replace(".c", ".o")) for unit in units]


def flat(made: list[list[str]]) -> list[str]:
    return [unit for units in made for unit in units]


def references(model, *names: str) -> str:
    text = native_description(NUT_MAP.header, 3, "", "test", (), model).decode()
    return ",".join(re.search(rf'name="{n}" valueReference="(\d+)"', text)[1] for n in names)


def linked(folder: Path, embed: bool, *options: str) -> tuple[Path, list[list[str]]]:
    """Program linked.c with its three FMUs, and their object files."""
    made = [objects(folder, *one, compiled_map=one[3] if embed else None) for one in LINKED]
    defined = {
        "FRICTION_INPUTS": references(FRICTION, "preload", "speed", "temperature", "axial_load"),
        "FRICTION_TORQUE": references(FRICTION, "friction_torque"),
        "MONITOR_INPUTS": references(MONITOR, "torque", "speed", "temperature", "axial_load"),
        "MONITOR_PRELOAD": references(MONITOR, "preload"),
        **{f"TOKEN_{n}": f'"token-{one[0]}"' for n, one in enumerate(LINKED, start=1)},
    }
    command = [*compiler(), "-std=c99", *WARNINGS, *(f"-D{name}={value}" for name, value in defined.items())]
    command += ["-isystem", "one/fmi", "-isystem", "two/fmi", *options, "-o", "linked"]
    run(*command, NATIVE_HOSTS / "linked.c", *flat(made), "-lm", "-lpthread", cwd=folder)
    return folder / "linked", made


def check_results(text: str) -> None:
    """Torque of both screws and preload of the first."""
    first, second, preload = (float(number) for number in text.split())
    for found, nut_map in ((first, NUT_MAP), (second, OTHER)):
        assert found == pytest.approx(nut_map.evaluate(*AT).friction_torque, rel=1e-12)
    assert first < second
    assert preload == pytest.approx(AT[0], rel=1e-9)


def test_fmus_of_two_screws_and_the_monitor_run_in_one_program(tmp_path):
    program, made = linked(tmp_path, False)
    check_results(run(program, *(tmp_path / one[0] for one in LINKED)))
    check_names(made)


def check_names(made: list[list[str]]) -> None:
    """External names of an FMU begin with the prefix of the FMI functions or with that of its token."""
    nm = shutil.which("nm") or pytest.skip("no nm")
    names = [set(re.findall(r"^\S* [A-TV-Z] (\S+)$", run(nm, "-g", *units), re.MULTILINE)) for units in made]
    for found, (name, model, version, _) in zip(names, LINKED, strict=True):
        own = {n for n in found if n.startswith(prefix(f"token-{name}", model))}
        assert len(own) > 40
        assert found - own == {f"{name}_{function}" for function in fmi_functions(version)}
    assert not names[0] & names[1]
    assert not names[0] & names[2]
    assert not names[1] & names[2]


# map compiled in


def test_no_file_is_opened_with_a_map_that_is_compiled_in(tmp_path):
    strace = shutil.which("strace") or pytest.skip("no strace")
    program, made = linked(tmp_path, True, "-static")
    for one in LINKED:
        (tmp_path / one[0] / MAP_FILE).unlink()
    trace = tmp_path / "trace.txt"
    check_results(run(strace, "-f", "-e", "trace=%file,%desc", "-o", trace, program))
    calls = {line.split()[1].partition("(")[0] for line in trace.read_text().splitlines()} - {"+++"}
    assert "open" not in calls
    assert "openat" not in calls
    assert calls <= {"execve", "readlink", "readlinkat", "fstat", "newfstatat", "write", "mmap", "mprotect"}
    check_names(made)
    wanted = run(shutil.which("nm"), "-u", *flat(made))
    assert not re.search(r"\b(fopen|fread|fseek|_wfopen|open)\w*\b", wanted)


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
@pytest.mark.parametrize(("version", "kind"), [(2, FmuInstance), (3, Fmu3Instance)])
def test_an_fmu_with_its_map_compiled_in_passes_the_checks_of_the_build(tmp_path, model, version, kind):
    files = native_files(NUT_MAP, version, platforms=HOST, model=model, embed_map=True)
    assert not any(name.startswith("resources/") for name in files)
    assert "sources/nut_map.c" in files
    write_fmu(tmp_path / "embedded.fmu", files)
    assert "no finding" in check(tmp_path / "embedded.fmu", NUT_MAP, kind, model)
