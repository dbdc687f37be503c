"""Packing the native FMUs: members, reproducible bytes, libraries for five platforms, clear errors."""

import importlib.util
import io
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from fmu_checks import exports, findings, fmi_functions, machine_of
from native_reference import REFERENCE, VALIDATION
from paths import ROOT, SUPPORT
from synthetic_map import make_map

from ballscrew_fmu.archive import write_fmu
from ballscrew_fmu.checks.replay import Fmu3Instance, FmuInstance
from ballscrew_fmu.description.native import terminals
from ballscrew_fmu.models import MONITOR
from ballscrew_fmu.native_fmu import compile as native_build
from ballscrew_fmu.native_fmu.compile import PLATFORMS, BuildError, build_libraries, universal_library
from ballscrew_fmu.native_fmu.map_file import map_bytes
from ballscrew_fmu.native_fmu.package import build_native_fmu, native_files
from ballscrew_fmu.native_fmu.sources import (
    FMI_HEADERS,
    NATIVE_NAME,
    SourceError,
    is_fmi_header,
    native_sources,
    variable_sources,
)
from ballscrew_fmu.pages.icon import icon_png, icon_svg, shapes

pytestmark = pytest.mark.slow

VERSIONS = pytest.mark.parametrize("version", [2, 3])
HOST = ("x86_64-windows" if sys.platform == "win32" else f"x86_64-{sys.platform}",)
KINDS = {2: FmuInstance, 3: Fmu3Instance}
LARGEST = 3_000_000  # [bytes]


def read(path):
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


COMMON = {
    "modelDescription.xml", "resources/nut_map.bin", "sources/buildDescription.xml", "sources/variables.h",
    "sources/variables.c", "sources/model.c", "sources/map.c", "documentation/index.html",
    "documentation/licenses/license.txt", "documentation/plot.png", "terminalsAndIcons/terminalsAndIcons.xml",
    "terminalsAndIcons/icon.png", "terminalsAndIcons/icon.svg",
    "extra/org.fmi-standard.fmi-ls-ref/fmi-ls-manifest.xml",
    *(
        f"extra/org.fmi-standard.fmi-ls-ref/{NATIVE_NAME}_{kind}{ending}"
        for kind in ("smoke_test", "validation")
        for ending in (".exp", "_in.csv", "_out.csv")
    ),
}  # fmt: skip
BINARIES = {
    2: {"linux64/.so", "win64/.dll", "darwin64/.dylib", "aarch64-linux/.so", "aarch64-darwin/.dylib"},
    3: {
        "x86_64-linux/.so", "x86_64-windows/.dll", "x86_64-darwin/.dylib", "aarch64-linux/.so",
        "aarch64-darwin/.dylib",
    },
}  # fmt: skip


@VERSIONS
def test_members(native_fmus, synthetic_nut_map, version):
    files = read(native_fmus[version])
    binaries = {
        re.sub(rf"binaries/([\w-]+)/{NATIVE_NAME}", r"\1/", n) for n in files if n.startswith("binaries/")
    }
    assert binaries == BINARIES[version]
    assert set(files) >= COMMON | {f"sources/fmi{version}.c"}
    assert f"sources/fmi{5 - version}.c" not in files
    assert ("model.png" in files) == (version == 2)
    assert not any(is_fmi_header(name.rpartition("/")[2]) for name in files)
    assert {name.partition("/")[0] for name in files} <= {
        "modelDescription.xml", "model.png", "binaries", "sources", "resources", "documentation",
        "terminalsAndIcons", "extra",
    }  # fmt: skip
    assert next(iter(files)) == "modelDescription.xml"
    assert files["resources/nut_map.bin"] == map_bytes(synthetic_nut_map)


@VERSIONS
def test_size_with_the_packaged_map(version):
    """The packaged map is larger than the synthetic one, and most of the FMU."""
    from ballscrew_tehl.nut_map.file import load_map
    from ballscrew_tehl.parameters.file import load_parameters

    files = native_files(make_map(), version, platforms=HOST)
    files["resources/nut_map.bin"] = map_bytes(load_map(None, load_parameters()))
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            for n in range(len(PLATFORMS) + 2 if name.startswith("binaries/") else 1):
                archive.writestr(f"{n}{name}", content)
    assert len(out.getvalue()) <= LARGEST


def test_size_of_the_fmus(native_fmus):
    assert all(path.stat().st_size <= LARGEST for path in native_fmus.values())


BUILD_AGAIN = """
import sys
sys.path[:0] = [sys.argv[1], sys.argv[1] + "/fmu"]
from native_reference import REFERENCE, VALIDATION
from synthetic_map import make_map
from ballscrew_fmu.native_fmu.package import build_native_fmu
print(build_native_fmu(make_map(), int(sys.argv[2]), sys.argv[3], REFERENCE, VALIDATION).guid)
"""


def test_another_process_and_folder_build_the_same_bytes(native_fmus, tmp_path):
    version = 3
    tests = str(SUPPORT)
    other = tmp_path / "a folder with another name"
    other.mkdir()
    run = subprocess.run(
        [sys.executable, "-c", BUILD_AGAIN, tests, str(version), str(other / "again.fmu")],
        capture_output=True,
        text=True,
        cwd=other,
        env={**os.environ, "TMPDIR": str(other), "TEMP": str(other), "TMP": str(other)},
    )
    assert run.returncode == 0, run.stderr[-2000:]
    before, after = read(native_fmus[version]), read(other / "again.fmu")
    assert [name for name in before if after.get(name) != before[name]] == []
    assert (other / "again.fmu").read_bytes() == native_fmus[version].read_bytes()


def test_an_empty_cache_of_the_compiler_builds_the_same_bytes(native_fmus, tmp_path, monkeypatch):
    sources = native_sources(make_map().header, 3, token_of(native_fmus[3]))
    monkeypatch.setenv("ZIG_GLOBAL_CACHE_DIR", str(tmp_path / "cache"))
    platform = "aarch64-darwin"
    library = build_libraries(sources, NATIVE_NAME, (platform,))[platform]
    assert (tmp_path / "cache").is_dir()
    assert library == read(native_fmus[3])[f"binaries/{platform}/{NATIVE_NAME}.dylib"]


def token_of(fmu):
    return re.search(rb'MODEL_TOKEN "([^"]+)"', read(fmu)["sources/variables.h"])[1].decode()


def test_token_depends_on_the_content(native_fmus, synthetic_nut_map):
    tokens = [token_of(path) for path in native_fmus.values()]
    assert all(re.fullmatch(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}", token) for token in tokens)
    variants = [
        (make_map(1.01), REFERENCE, VALIDATION),
        (synthetic_nut_map, None, VALIDATION),
        (synthetic_nut_map, REFERENCE, VALIDATION._replace(tables="<p>Other</p>")),
    ]
    for nut_map, reference, validation in variants:
        header = native_files(nut_map, 2, reference, validation, HOST)["sources/variables.h"].decode()
        tokens.append(re.search(r'MODEL_TOKEN "([^"]+)"', header)[1])
    assert len(set(tokens)) == len(tokens) == 5


@VERSIONS
def test_the_library_of_this_machine_exports_all_functions(native_unpacked, version):
    folder = {2: {"linux": "linux64", "win32": "win64", "darwin": "darwin64"}[sys.platform], 3: HOST[0]}[
        version
    ]
    (library,) = (Path(native_unpacked[version]) / "binaries" / folder).iterdir()
    names = fmi_functions(version)
    assert len(names) == {2: 44, 3: 75}[version]
    assert exports(library, names) == []
    assert exports(library, ["model_step", "map_read", "fmi9GetVersion"]) != []


def test_nothing_but_fmi_is_exported(native_unpacked):
    readelf = shutil.which("readelf") or pytest.skip("no readelf")
    for folder in ("x86_64-linux", "aarch64-linux"):
        (library,) = (Path(native_unpacked[3]) / "binaries" / folder).iterdir()
        text = subprocess.run(
            [readelf, "-W", "--dyn-syms", str(library)], capture_output=True, text=True, check=True
        ).stdout
        defined = {line.split()[7] for line in text.splitlines() if re.search(r"GLOBAL +DEFAULT +\d+ ", line)}
        assert defined == set(fmi_functions(3))
        needed = {n for line in text.splitlines() for n in re.findall(r"GLIBC_([\d.]+)", line)}
        assert all(tuple(map(int, n.split("."))) <= (2, 17) for n in needed)


def test_a_library_with_the_description_of_another_fmu_is_refused(native_unpacked, tmp_path):
    """A description with another token must not start this library."""
    for name in ("binaries", "resources"):
        (tmp_path / name).symlink_to(f"{native_unpacked[2]}/{name}")
    text = Path(native_unpacked[2], "modelDescription.xml").read_text()
    (tmp_path / "modelDescription.xml").write_text(re.sub('guid="[^"]+"', 'guid="other"', text))
    with pytest.raises(Exception, match="instantiate"):
        FmuInstance(tmp_path)


@VERSIONS
def test_steps_as_the_map(native_unpacked, synthetic_nut_map, version):
    with KINDS[version](native_unpacked[version]) as one:
        assert one.step(preload=1500.0, speed=30.0, temperature=310.0, axial_load=200.0)
        state = synthetic_nut_map.evaluate(1500.0, 30.0, 310.0, 200.0)
        assert one.get("film_thickness_min") == pytest.approx(state.film_thickness_min, rel=1e-12)
        assert one.get("viscous_torque") == pytest.approx(state.viscous_torque, rel=1e-12)
        assert one.get("in_range") is True


@VERSIONS
def test_the_sources_compile_without_ziglang(native_unpacked, synthetic_nut_map, tmp_path, version):
    """Compile sources/ as an importer does: its headers, its compiler, the listed files."""
    compiler = shutil.which("cc") or pytest.skip("no C compiler")
    folder = tmp_path / "fmu"
    shutil.copytree(native_unpacked[version], folder)
    root = Path(importlib.util.find_spec("fmpy").origin).parent / "c-code"
    units = re.findall(r'SourceFile name="([^"]+)"', (folder / "sources/buildDescription.xml").read_text())
    place = folder / "binaries" / {2: "linux64", 3: "x86_64-linux"}[version] / f"{NATIVE_NAME}.so"
    before = place.read_bytes()
    subprocess.run(
        [compiler, "-std=c99", "-O2", "-fPIC", "-shared", f"-I{root}", "-o", str(place), *units, "-lm"],
        cwd=folder / "sources",
        check=True,
        timeout=300,
    )
    assert place.read_bytes() != before
    with KINDS[version](folder) as one, KINDS[version](native_unpacked[version]) as two:
        for speed in (-3.0, 0.2, 250.0):
            assert one.step(speed=speed)
            assert two.step(speed=speed)
            assert one.outputs() == pytest.approx(two.outputs(), rel=1e-12)


def test_universal_library(native_fmus):
    thin = read(native_fmus[3])
    slices = [thin[f"binaries/{p}/{NATIVE_NAME}.dylib"] for p in ("x86_64-darwin", "aarch64-darwin")]
    fat = universal_library(slices)
    assert machine_of(fat) == ("mach", (0x01000007, 0x0100000C))
    assert all(content in fat for content in slices)
    assert len(fat) < sum(map(len, slices)) + 3 * 2**14
    with pytest.raises(BuildError, match="not a known Mach-O"):
        universal_library([slices[0], thin[f"binaries/x86_64-linux/{NATIVE_NAME}.so"]])


def test_arm_libraries_of_macos_are_signed(native_fmus):
    """macOS does not load an unsigned arm64 library: load command 0x1d names the signature."""
    content = read(native_fmus[3])[f"binaries/aarch64-darwin/{NATIVE_NAME}.dylib"]
    (count,) = (int.from_bytes(content[16:20], "little"),)
    commands, place = [], 32
    for _ in range(count):
        commands.append(int.from_bytes(content[place : place + 4], "little"))
        place += int.from_bytes(content[place + 4 : place + 8], "little")
    assert 0x1D in commands
    assert f"@rpath/{NATIVE_NAME}.dylib".encode() in content


def test_windows_library_needs_only_system_libraries(native_fmus):
    content = read(native_fmus[3])[f"binaries/x86_64-windows/{NATIVE_NAME}.dll"]
    needed = {name.lower() for name in re.findall(rb"[\w.-]+\.dll", content, re.IGNORECASE)}
    others = {n for n in needed if not n.startswith((b"api-ms-win-crt-", b"kernel32", b"ntdll"))}
    assert others == {f"{NATIVE_NAME}.dll".lower().encode()}


def test_without_any_compiler_one_line_names_the_remedy(monkeypatch):
    monkeypatch.setattr(native_build.importlib.util, "find_spec", lambda _: None)
    monkeypatch.setattr(native_build.shutil, "which", lambda _: None)
    with pytest.raises(BuildError, match=r"pip install ziglang") as error:
        build_libraries({}, NATIVE_NAME)
    assert "\n" not in str(error.value)


def test_without_ziglang_the_compiler_of_the_machine_builds_for_it_alone(
    synthetic_nut_map, monkeypatch, tmp_path
):
    own = shutil.which("cc") or pytest.skip("no C compiler")
    monkeypatch.setattr(native_build.importlib.util, "find_spec", lambda _: None)
    found = native_build.find_compiler()
    here = native_build.this_platform()
    assert (found.command, found.platforms) == ((own,), (here,))
    with pytest.raises(BuildError, match=r"does not compile for aarch64-darwin: .*pip install ziglang"):
        build_libraries({}, NATIVE_NAME, (here, "aarch64-darwin"))
    target = tmp_path / "own.fmu"
    build_native_fmu(synthetic_nut_map, 3, target, platforms=found.platforms)
    with zipfile.ZipFile(target) as archive:
        archive.extractall(tmp_path / "own")
    assert found.name in (tmp_path / "own/modelDescription.xml").read_text(encoding="utf-8")
    with KINDS[3](tmp_path / "own") as one:
        assert one.step(preload=1500.0, speed=30.0, temperature=310.0, axial_load=200.0)
        state = synthetic_nut_map.evaluate(1500.0, 30.0, 310.0, 200.0)
        assert one.get("friction_torque") == pytest.approx(state.friction_torque, rel=1e-12)


def test_an_unknown_machine_is_named(monkeypatch):
    monkeypatch.setattr(native_build.machine, "machine", lambda: "riscv64")
    with pytest.raises(
        BuildError, match=r"no libraries for riscv64-linux without ziglang, only for x86_64-linux"
    ):
        native_build.this_platform()


def test_a_failed_compilation_shows_the_first_error():
    sources = {"a.c": b"int f(void) { return missing; }\nint g(void) { return absent; }\n"}
    with pytest.raises(BuildError, match=r"x86_64-linux: .*a\.c:1:.*missing") as error:
        build_libraries(sources, "a", ("x86_64-linux", "aarch64-linux"))
    assert "\n" not in str(error.value)
    with pytest.raises(BuildError, match=r"b\.c:2:.*conversion"):  # warnings are errors
        build_libraries({"b.c": b"int f(double x);\nint f(double x) { return x; }\n"}, "b", ("x86_64-linux",))


def test_progress_names_each_platform(synthetic_nut_map):
    done = []
    sources = {"a.c": b"int f(void);\nint f(void) { return 1; }\n"}
    build_libraries(sources, "a", ("aarch64-linux", "x86_64-linux"), done.append)
    assert done == ["aarch64-linux", "x86_64-linux"]


@VERSIONS
def test_sources_of_a_version(synthetic_nut_map, version):
    sources = native_sources(synthetic_nut_map.header, version, "{token}")
    assert set(FMI_HEADERS[version]) <= set(sources)
    assert not any(name.startswith(f"fmi{5 - version}") for name in sources)
    assert b'"{token}"' in sources["variables.h"]
    assert synthetic_nut_map.header["content_hash"].encode() in sources["variables.h"]
    assert all(name.endswith((".c", ".h")) for name in sources)


def test_an_invalid_token_is_refused(synthetic_nut_map):
    with pytest.raises(ValueError, match="token"):
        variable_sources(synthetic_nut_map.header, '"; int x')


def test_a_missing_header_is_one_line(synthetic_nut_map, monkeypatch, tmp_path):
    monkeypatch.setattr("ballscrew_fmu.native_fmu.sources.fmpy.__file__", str(tmp_path / "__init__.py"))
    with pytest.raises(SourceError, match=r"fmi2Functions\.h not found"):
        native_sources(synthetic_nut_map.header, 2, "")


@pytest.mark.parametrize(
    ("path", "before", "after"),
    [
        ("sources/variables.c", b'{"speed"', b'{"velocity"'),
        ("sources/buildDescription.xml", b'name="map.c"', b'name="maps.c"'),
        ("terminalsAndIcons/terminalsAndIcons.xml", b'variableName="speed"', b'variableName="w"'),
        ("extra/org.fmi-standard.fmi-ls-ref/fmi-ls-manifest.xml", b"beta.1", b"alpha.1"),
        (
            f"extra/org.fmi-standard.fmi-ls-ref/{NATIVE_NAME}_validation_out.csv",
            b"friction_torque",
            b"torque",
        ),
        ("documentation/index.html", b'src="plot.png"', b'src="plots.png"'),
    ],
)
def test_members_that_contradict_each_other_are_found(native_fmus, path, before, after):
    files = read(native_fmus[2])
    assert before in files[path]
    assert findings(files | {path: files[path].replace(before, after)}) != []


def test_a_library_in_the_wrong_folder_or_with_a_path_in_it_is_found(native_fmus):
    files = read(native_fmus[3])
    linux, arm = (f"binaries/{p}/{NATIVE_NAME}.so" for p in ("x86_64-linux", "aarch64-linux"))
    assert any("is made for" in f for f in findings(files | {linux: files[arm]}))
    assert any("/home/" in f for f in findings(files | {linux: files[linux] + b"/home/someone"}))
    assert any("is a file of the importer" in f for f in findings(files | {"sources/fmi3Functions.h": b""}))


def test_documentation(native_fmus):
    for version, path in native_fmus.items():
        files = read(path)
        page = files["documentation/index.html"].decode()
        assert "{" not in page.partition("</head>")[2]
        for word in (
            "slip_indicator",
            "presliding_stiffness",
            "s0 &lt; (s1/h) (1 - h s1/J)",
            "<p>Table</p>",
            "plot.png",
        ):
            assert word in page
        assert ("<td>time</td>" in page) == (version == 3)
        licence = files["documentation/licenses/license.txt"].decode()
        assert "Permission is hereby granted" in licence
        assert "mingw-w64" in licence


def test_icon():
    png, svg = icon_png(), icon_svg().decode()
    assert png == icon_png()
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    assert int.from_bytes(png[16:20], "big") == int.from_bytes(png[20:24], "big") == 256
    assert len(png) < 20_000
    assert len(re.findall("<(?:circle|polygon|polyline) ", svg)) == len(shapes())


def test_terminal():
    text = terminals().decode()
    assert re.findall('Terminal name="([^"]+)"', text) == ["shaft", "heat"]
    assert re.findall('variableName="([^"]+)" memberName="([^"]+)" variableKind="([^"]+)"', text) == [
        ("speed", "w", "signal"),
        ("friction_torque", "tau", "inflow"),
        ("temperature", "T", "signal"),
        ("power_loss", "Q_flow", "outflow"),
    ]
    assert re.findall('variableName="([^"]+)"', terminals(MONITOR).decode())[:2] == ["speed", "torque"]


def test_hand_written_sources_are_package_data():
    """The installed package contains them."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert "native/*/*" in project["tool"]["setuptools"]["package-data"]["ballscrew_fmu"]
    assert any(line.startswith("ziglang>=") for line in project["project"]["optional-dependencies"]["fmu"])


def test_write_keeps_plain_zip_entries(native_fmus, tmp_path):
    with zipfile.ZipFile(native_fmus[2]) as archive:
        infos = archive.infolist()
    assert all(info.compress_type == zipfile.ZIP_DEFLATED and info.filename.isascii() for info in infos)
    assert {info.date_time for info in infos} == {(1980, 1, 1, 0, 0, 0)}
    write_fmu(tmp_path / "same.fmu", read(native_fmus[2]))
    assert (tmp_path / "same.fmu").read_bytes() == native_fmus[2].read_bytes()
