"""Two reports, built once: with the mechanistic law from a small map, of the packaged screw with fitted numbers."""

import dataclasses
import json
from types import SimpleNamespace

import pytest
from html_page import Page
from synthetic_contacts import GRID

from ballscrew_tehl.applications.cli.main import main
from ballscrew_tehl.applications.report import data
from ballscrew_tehl.nut_map.build import build_map
from ballscrew_tehl.nut_map.file import save_map
from ballscrew_tehl.parameters.file import PACKAGED_DATA, load_screw
from ballscrew_tehl.parameters.units import CELSIUS, RPM


def made(folder, *words):
    path, gathered, out, report_data = folder / "page.html", [], [], data.report_data
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(data, "report_data", lambda *of: gathered.append(report_data(*of)) or gathered[-1])
        patch.setattr(
            "sys.stdout", SimpleNamespace(write=out.append, flush=lambda: None, isatty=lambda: False)
        )
        assert main(["report", *map(str, words), "--output", str(path), "--json"]) == 0
    text = path.read_text(encoding="utf-8")
    return SimpleNamespace(page=Page(text), text=text, answer=json.loads("".join(out)), numbers=gathered[0])


@pytest.fixture(scope="session")
def of_packaged(tmp_path_factory):
    return made(tmp_path_factory.mktemp("packaged"))


@pytest.fixture(scope="session")
def own_words(tmp_path_factory):
    """--screw and --map of another screw, up to films so thick that the supply of grease decides."""
    folder = tmp_path_factory.mktemp("own_map")
    text = (PACKAGED_DATA / "example_25x10.toml").read_text(encoding="utf-8")
    text = text.replace('"example 25x10"', '"a <b> & c"').replace(
        "[friction]", "[friction]\nreplenishment_constant = 6e-8"
    )
    (folder / "my.toml").write_text(text, encoding="utf-8")
    wide = dataclasses.replace(
        GRID, speed=(100.0 * RPM, 6000.0 * RPM, 14), temperature=(10.0 + CELSIUS, 40.0 + CELSIUS, 7)
    )
    save_map(folder / "my.npz", build_map(load_screw(folder / "my.toml"), wide))
    return "--screw", folder / "my.toml", "--map", folder / "my.npz"


@pytest.fixture(scope="session")
def of_own(own_words, tmp_path_factory):
    return made(tmp_path_factory.mktemp("own"), *own_words, "--speed-rpm", "800", "--temperature-c", "35")
