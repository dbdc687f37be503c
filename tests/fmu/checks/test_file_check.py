"""`ballscrew_fmu check` and `info` on files: what they print, what they refuse, damage that they find."""

import hashlib
import json
import zipfile
from pathlib import Path

import pytest

from ballscrew_fmu.__main__ import main
from ballscrew_fmu.archive import write_fmu
from ballscrew_fmu.checks.reference import STEP, reference_results
from ballscrew_fmu.native_fmu.compile import this_platform
from ballscrew_fmu.native_fmu.experiments import MANIFEST, Reference
from ballscrew_fmu.native_fmu.package import build_native_fmu

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def with_reference(synthetic_nut_map, tmp_path_factory):
    """Native FMUs for this machine with the reference of a build, by FMI version."""
    folder = tmp_path_factory.mktemp("with_reference")
    reference = Reference(STEP, *reference_results(synthetic_nut_map))
    platforms = (this_platform(),)
    return {
        version: build_native_fmu(
            synthetic_nut_map, version, folder / f"{version}.fmu", reference, platforms=platforms
        ).path
        for version in (2, 3)
    }


def rewritten(fmu: Path, target: Path, end: str, change) -> Path:
    """A copy of an FMU in which the one file whose path has this end is changed."""
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(target, "w") as copy:
        (name,) = [name for name in source.namelist() if name.endswith(end)]
        for info in source.infolist():
            content = source.read(info)
            copy.writestr(info, change(content) if info.filename == name else content)
    return target


def test_info_names_variables_kinds_and_platforms(native_fmus, capsys):
    assert main(["info", str(native_fmus[3]), "--json"]) == 0
    info = json.loads(capsys.readouterr().out)
    assert info["kinds"] == ["co-simulation", "model exchange"]
    assert "x86_64-linux" in info["platforms"]
    (preload,) = [v for v in info["variables"] if v["name"] == "preload"]
    assert (preload["causality"], preload["unit"], float(preload["start"])) == ("input", "N", 2000.0)
    assert main(["info", str(native_fmus[3])]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("BallScrewFrictionNative, FMI 3.0, co-simulation and model exchange, ")
    assert any(line.split()[:3] == ["friction_torque", "output", "N.m"] for line in lines)


@pytest.mark.parametrize("version", [2, 3])
def test_a_native_fmu_is_replayed_against_its_reference(with_reference, version, capsys):
    assert main(["check", str(with_reference[version])]) == 0
    out = capsys.readouterr().out
    assert "fmpy validation: no finding" in out
    assert "reference in the FMU, 240 steps: largest difference" in out


def test_a_native_fmu_that_differs_from_its_reference_is_found(with_reference, tmp_path, capsys):
    def other(content: bytes) -> bytes:
        lines = content.decode().splitlines()
        cells = lines[7].split(",")
        cells[1] = repr(1.001 * float(cells[1]))
        return "\n".join([*lines[:7], ",".join(cells), *lines[8:]]).encode()

    damaged = rewritten(with_reference[2], tmp_path / "damaged.fmu", "_validation_out.csv", other)
    assert main(["check", str(damaged)]) == 1
    error = capsys.readouterr().err
    assert "_validation_out.csv: not the file of the manifest, its checksum differs" in error
    assert error.count("\n") == 1


def with_files(fmu: Path, target: Path, change) -> Path:
    """A copy of an FMU with other files: change(dict of contents by name), which may update the manifest."""
    with zipfile.ZipFile(fmu) as source:
        files = {name: source.read(name) for name in source.namelist()}
    write_fmu(target, change(files))
    return target


def with_table(files: dict[str, bytes], change) -> dict[str, bytes]:
    """The results of the validation changed, with their checksum in the manifest."""
    (place,) = [name for name in files if name.endswith("_validation_out.csv")]
    (manifest,) = [name for name in files if name.endswith(MANIFEST)]
    lines = change(files[place].decode().splitlines())
    content = "\n".join(lines).encode() + b"\n"
    before, after = (hashlib.sha3_256(text).hexdigest().encode() for text in (files[place], content))
    return files | {place: content, manifest: files[manifest].replace(before, after)}


def without_number(lines: list[str]) -> list[str]:
    time, _, rest = lines[5].split(",", 2)
    return [*lines[:5], f"{time},nan,{rest}", *lines[6:]]


def other_manifest(files: dict[str, bytes], content: bytes | None) -> dict[str, bytes]:
    kept = {name: text for name, text in files.items() if not name.endswith(MANIFEST)}
    (name,) = set(files) - set(kept)
    return kept if content is None else kept | {name: content}


def with_library(files: dict[str, bytes]) -> dict[str, bytes]:
    (name,) = [name for name in files if name.startswith("binaries/") and not name.endswith("/")]
    return files | {name: files[name][:5000]}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda files: with_table(files, without_number), "the reference in the FMU is nan"),
        (lambda files: with_table(files, lambda lines: lines[:9]), "_validation_out.csv: 8 rows; 240 steps"),
        (lambda files: with_table(files, lambda lines: [*lines[:9], "a,b"]), "not a table of numbers"),
        (lambda files: other_manifest(files, None), "fmi-ls-manifest.xml: No such file"),
        (lambda files: other_manifest(files, b"<broken"), "fmi-ls-manifest.xml: not XML"),
        (with_library, "library"),
    ],
    ids=["NaN", "few rows", "no numbers", "no manifest", "no XML", "library cut"],
)
def test_damage_is_one_line(with_reference, tmp_path, capsys, change, message):
    damaged = with_files(with_reference[2], tmp_path / "damaged.fmu", change)
    assert main(["check", str(damaged)]) == 1
    error = capsys.readouterr().err
    assert message in error or (message == "library" and "cannot" in error)
    assert error.count("\n") == 1


def test_another_map_in_a_native_fmu_is_named(with_reference, synthetic_nut_map, tmp_path, capsys):
    own = synthetic_nut_map.header["content_hash"].encode()
    other = rewritten(
        with_reference[2], tmp_path / "other.fmu", "nut_map.bin", lambda c: c.replace(own, own[::-1])
    )
    assert main(["info", str(other)]) == 0
    assert f"map {own[::-1].decode()}, not that of the description" in capsys.readouterr().out
    assert main(["info", str(with_reference[2])]) == 0
    assert f"map {own.decode()}\n" in capsys.readouterr().out
    assert main(["check", str(other)]) == 1  # its checksum is wrong
    error = capsys.readouterr().err
    assert "damaged" in error
    assert error.count("\n") == 1


def test_a_python_fmu_is_replayed_against_its_map(fmu, capsys):
    assert main(["check", str(fmu), "--json"]) == 0
    checks = json.loads(capsys.readouterr().out)["checks"]
    assert checks[1].startswith("replay against the map in the FMU: largest difference")


def test_a_map_of_another_version_in_a_python_fmu_is_named(fmu, tmp_path, capsys):
    damaged = rewritten(
        fmu, tmp_path / "damaged.fmu", "nut_map.npz", lambda content: content[: len(content) // 2]
    )
    assert main(["check", str(damaged)]) == 1
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("command", ["check", "info"])
def test_what_is_not_an_fmu_is_refused_in_one_line(command, tmp_path, capsys):
    text = tmp_path / "text.fmu"
    text.write_text("no archive")
    empty = tmp_path / "empty.fmu"
    with zipfile.ZipFile(empty, "w") as archive:
        archive.writestr("readme.txt", "nothing")
    broken = tmp_path / "broken.fmu"
    with zipfile.ZipFile(broken, "w") as archive:
        archive.writestr("modelDescription.xml", "<fmiModelDescription fmiVersion='2.0'/>")
    for file, word in (
        (text, "not an FMU"),
        (empty, "not an FMU"),
        (broken, "broken.fmu"),
        (tmp_path / "a.fmu", "no such"),
        (tmp_path, "a folder; give an FMU file"),
    ):
        assert main([command, str(file)]) == 2
        error = capsys.readouterr().err
        assert word in error
        assert error.count("\n") == 1
