"""Packing the native FMUs: members, reproducible bytes, libraries for five platforms, clear errors."""

import json
import os
import re
import shutil
import struct
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest
from fmpy.util import create_cmake_project
from fmu_checks import exports, findings, fmi_functions, machine_of, members
from native_model import FLAGS, compiler
from processes import elsewhere, output
from reference_screw import GD4008
from synthetic_map import closed_form, make_map

from ballscrew_fmu.archive import write_fmu
from ballscrew_fmu.checks.check import check
from ballscrew_fmu.checks.reference import reference_of
from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.models import FRICTION, MODELS
from ballscrew_fmu.native_fmu import compile as native_build
from ballscrew_fmu.native_fmu.compile import PLATFORMS, WASM, BuildError, build_libraries
from ballscrew_fmu.native_fmu.libraries import entry_library, native_library, page_library
from ballscrew_fmu.native_fmu.package import build_native_fmu, native_files
from ballscrew_fmu.native_fmu.resource_files import map_bytes
from ballscrew_fmu.native_fmu.sources import is_fmi_header, write_sources
from ballscrew_fmu.native_fmu.validation import Reference
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.runtime.packed import Law

pytestmark = pytest.mark.slow
NATIVE_NAME = FRICTION.native_name
REFERENCE = Reference(
    1e-3,
    [{"preload": 2000.0, "speed": 10.0 * n, "temperature": 303.15, "axial_load": 0.0} for n in range(5)],
    [{"friction_torque": 0.1 * n, "in_range": n < 4} for n in range(5)],
)
VERSIONS = pytest.mark.parametrize("version", [2, 3])
HOST = ("x86_64-windows" if sys.platform == "win32" else f"x86_64-{sys.platform}",)
BUILT_FOR = {2: tuple(PLATFORMS), 3: ("x86_64-linux", "x86_64-windows")}
BINARIES = {
    2: {"linux64/.so", "win64/.dll", "darwin64/.dylib", "aarch64-linux/.so", "aarch64-darwin/.dylib"},
    3: {"x86_64-linux/.so", "x86_64-windows/.dll"},
}


@pytest.fixture(scope="module")
def native_fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("native")
    return {
        v: build_native_fmu(closed_form(), v, folder / f"{v}.fmu", REFERENCE, platforms).path
        for v, platforms in BUILT_FOR.items()
    }


@pytest.fixture(scope="module")
def native_unpacked(native_fmus):
    return {v: fmpy.extract(str(path), unzipdir=str(path.with_suffix(""))) for v, path in native_fmus.items()}


def token_of(files):
    return re.search(rb'instantiationToken="([^"]+)"', files["modelDescription.xml"])[1].decode()


@VERSIONS
def test_members(native_fmus, synthetic_nut_map, tmp_path, version):
    files = members(native_fmus[version])
    libraries = [name for name in files if name.startswith("binaries/")]
    found = {re.sub(rf"binaries/([\w-]+)/{NATIVE_NAME}", r"\1/", name) for name in libraries}
    assert found == BINARIES[version]
    assert next(iter(files)) == "modelDescription.xml"
    assert not any(is_fmi_header(n.rpartition("/")[2]) for n in files)
    assert files["resources/nut_map.bin"] == map_bytes(synthetic_nut_map)
    assert findings(files) == []
    write_fmu(tmp_path / "same.fmu", files)
    assert (tmp_path / "same.fmu").read_bytes() == native_fmus[version].read_bytes()


def test_another_process_and_folder_build_the_same_bytes(synthetic_nut_map, monkeypatch, tmp_path):
    other, further = tmp_path / "a folder with another name", (REFERENCE, HOST)
    other.mkdir()
    here = build_native_fmu(synthetic_nut_map, 3, tmp_path / "here.fmu", *further)
    for name in ("TMPDIR", "TEMP", "TMP"):
        monkeypatch.setenv(name, str(other))
    elsewhere(build_native_fmu, synthetic_nut_map, 3, other / "again.fmu", *further)
    assert (other / "again.fmu").read_bytes() == here.path.read_bytes()
    contents = ((synthetic_nut_map, REFERENCE), (make_map(1.01), REFERENCE), (synthetic_nut_map, None))
    tokens = {token_of(native_files(nut_map, 3, of, ())) for nut_map, of in contents}
    assert len({*tokens, here.guid}) == 4


def test_the_libraries_are_the_same_for_all_screws_and_versions():
    maps = [
        closed_form(Law.THREE_PARAMETER),
        closed_form(Law.MECHANISTIC),
        make_map(2.0),
        load_map(None, GD4008),
    ]
    for model in MODELS:
        library, *others = (native_library(nut_map.header, model) for nut_map in maps)
        assert all(other == library for other in others)
        packed = (native_files(nut_map, 2, platforms=HOST, model=model) for nut_map in maps)
        found = [{n: c for n, c in files.items() if n.startswith("binaries/")} for files in packed]
        assert all(one == found[0] != {} for one in found)
        changed = library._replace(sources=library.sources | {"model.c": b""})
        assert changed.file(HOST[0]) != library.file(
            HOST[0]
        )  # else an update would take the library of old sources
    assert len({entry_library(nut_map.header).file(HOST[0]) for nut_map in maps}) == 1
    assert len({page_library(nut_map.header).file(WASM) for nut_map in maps}) == 1


def test_libraries_of_all_platforms(native_fmus, native_unpacked):
    files = {name.removeprefix("binaries/"): content for name, content in members(native_fmus[2]).items()}
    fat, thin = (files[f"{folder}/{NATIVE_NAME}.dylib"] for folder in ("darwin64", "aarch64-darwin"))
    assert machine_of(fat) == ("mach", 0x01000007, 0x0100000C)
    for n, name in enumerate((0x01000007, 0x0100000C)):  # each slice where the table says, on a page
        cpu, _, start, size, alignment = struct.unpack_from(">5I", fat, 8 + 20 * n)
        assert (cpu, start % 2**alignment) == (name, 0)
        assert machine_of(fat[start : start + size]) == ("mach", name)
    assert fat[start : start + size] == thin
    # macOS does not load an unsigned arm64 library: its signature lies at the end
    assert b"\xfa\xde\x0c\xc0" in thin
    assert f"@rpath/{NATIVE_NAME}.dylib".encode() in thin
    needed = re.findall(rb"[\w.-]+\.dll", files[f"win64/{NATIVE_NAME}.dll"].lower())
    others = {n for n in needed if not n.startswith((b"api-ms-win-crt-", b"kernel32", b"ntdll"))}
    assert others == {f"{NATIVE_NAME}.dll".lower().encode()}
    readelf = shutil.which("readelf") or pytest.skip("no readelf")
    for folder in ("linux64", "aarch64-linux"):
        (library,) = (Path(native_unpacked[2]) / "binaries" / folder).iterdir()
        text = output("-W", "--dyn-syms", library, program=readelf)
        defined = {line.split()[7] for line in text.splitlines() if re.search(r"GLOBAL +DEFAULT +\d+ ", line)}
        assert defined == {*fmi_functions(2), *fmi_functions(3)}
        versions = {n for line in text.splitlines() for n in re.findall(r"GLIBC_([\d.]+)", line)}
        assert all(tuple(map(int, n.split("."))) <= (2, 17) for n in versions)


@VERSIONS
@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
def test_the_sources_compile_as_the_cmake_project_of_fmpy(built, folder_of, tmp_path, version, model):
    """Without a warning, to the numbers of the library in the FMU. Another token is refused."""
    cmake = shutil.which("cmake") or pytest.skip("no cmake")
    create_cmake_project(str(built(model, version)), str(folder := tmp_path / "fmu"))
    place = folder / "binaries" / {2: "linux64", 3: "x86_64-linux"}[version] / f"{model.native_name}.so"
    place.unlink()
    warnings = " ".join(("-Wall", "-Wextra", "-Wpedantic", "-Werror", *FLAGS))
    output("-S", folder, "-B", tmp_path / "build", f"-DCMAKE_C_FLAGS={warnings}", program=cmake)
    output("--build", tmp_path / "build", program=cmake)
    assert exports(place, fmi_functions(version)) == []
    with FmuInstance(folder) as one, FmuInstance(folder_of(model, version)) as two:
        for row in reference_of(closed_form(), model).inputs[:20]:
            assert one.step(**row)
            assert two.step(**row)
            assert one.outputs() == pytest.approx(two.outputs(), rel=1e-9)
    description = folder / "modelDescription.xml"
    old = "guid" if version == 2 else "instantiationToken"
    description.write_text(re.sub(f'{old}="[^"]+"', f'{old}="other"', description.read_text(), count=1))
    with pytest.raises(Exception, match=r"[Ii]nstantiate"):
        FmuInstance(folder)


def test_an_fmu_with_its_map_compiled_in_passes_the_checks_of_the_build(synthetic_nut_map, tmp_path):
    files = native_files(synthetic_nut_map, 2, platforms=HOST, embed_map=True)
    assert not any(name.startswith("resources/") for name in files)
    write_fmu(tmp_path / "embedded.fmu", files)
    assert "no finding" in check(tmp_path / "embedded.fmu", reference_of(synthetic_nut_map))


def test_without_ziglang_the_compiler_of_the_machine_builds_for_it_alone(
    synthetic_nut_map, monkeypatch, tmp_path
):
    own = shutil.which("cc") or pytest.skip("no C compiler")
    monkeypatch.setattr(native_build.importlib.util, "find_spec", lambda _: None)
    monkeypatch.setattr("ballscrew_fmu.native_fmu.libraries.PREBUILT", tmp_path / "none")
    found, here = native_build.find_compiler(), native_build.this_platform()
    assert (found.command, found.platforms) == ((own,), (here,))
    with pytest.raises(BuildError, match=r"does not compile for aarch64-darwin: .*pip install ziglang"):
        build_libraries({}, (), NATIVE_NAME, (here, "aarch64-darwin"))
    build_native_fmu(synthetic_nut_map, 3, tmp_path / "own.fmu", platforms=found.platforms)
    with zipfile.ZipFile(tmp_path / "own.fmu") as archive:
        archive.extractall(tmp_path / "own")
    assert found.name in (tmp_path / "own/modelDescription.xml").read_text(encoding="utf-8")
    monkeypatch.setattr(native_build.shutil, "which", lambda _: None)
    with pytest.raises(BuildError, match=r"pip install ziglang") as error:
        build_libraries({}, (), NATIVE_NAME, (here,))
    assert "\n" not in str(error.value)


def test_one_line_for_what_cannot_be_built():
    for text, found in (
        (b"int f(void) { return missing; }\nint g(void) { return absent; }\n", r"x86_64-linux: .*a\.c:1:.*missing"),
        (b"int f(double x);\nint f(double x) { return x; }\n", r"a\.c:2:.*conversion"),  # warnings are errors
    ):  # fmt: skip
        with pytest.raises(BuildError, match=found) as error:
            build_libraries({"a.c": text}, ("a.c",), "a", ("x86_64-linux",))
        assert "\n" not in str(error.value)


def test_each_c_file_compiles_alone(tmp_path):
    """As an editor does: none needs what all.c includes before it."""
    write_sources(tmp_path)
    commands = json.loads((tmp_path / "compile_commands.json").read_text())
    assert {(Path(c["directory"]).name, c["file"]) for c in commands} >= {
        (model.layer, file) for model in MODELS for file in ("fmi2.c", "fmi3.c", "map.c", model.dual)
    }
    for command in commands:
        cc, *first = compiler()
        options = *first, *command["arguments"][1:], "-o", os.devnull
        output(*options, program=cc, folder=command["directory"])
