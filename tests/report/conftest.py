"""Two reports, built once: of the paper's screw with solved contacts, of another screw with a closed-form map."""

import dataclasses
import json
from types import SimpleNamespace

import pytest
from html_page import Page
from reference_screw import GD4008
from synthetic_contacts import GRID, closed_build

from ballscrew_tehl.cli.main import main
from ballscrew_tehl.nut_map.file import load_map, save_map
from ballscrew_tehl.parameters.file import load_screw
from ballscrew_tehl.parameters.packaged_data import PACKAGED_DATA
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.report import material


def made(folder, *words):
    """Page, file, text, answer and numbers of a report."""
    path, gathered, out, gather = folder / "page.html", [], [], material.gather
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(material, "gather", lambda *given: gathered.append(gather(*given)) or gathered[-1])
        patch.setattr(
            "sys.stdout", SimpleNamespace(write=out.append, flush=lambda: None, isatty=lambda: False)
        )
        assert main(["report", *map(str, words), "--output", str(path), "--json"]) == 0
    text = path.read_text(encoding="utf-8")
    return SimpleNamespace(
        page=Page(text), path=path, text=text, answer=json.loads("".join(out)), numbers=gathered[0]
    )


@pytest.fixture(scope="session")
def of_paper(tmp_path_factory):
    """The report on the measured screw of the paper."""
    return made(tmp_path_factory.mktemp("paper"))


@pytest.fixture(scope="session")
def own_words(tmp_path_factory):
    """--screw and --map of another screw, up to films so thick that the supply of oil decides."""
    folder = tmp_path_factory.mktemp("own_map")
    text = (PACKAGED_DATA / "example_25x10.toml").read_text(encoding="utf-8")
    (folder / "my.toml").write_text(text.replace('"example 25x10"', '"a <b> & c"'), encoding="utf-8")
    wide = dataclasses.replace(
        GRID, speed=(100.0 * RPM, 6000.0 * RPM, 14), temperature=(10.0 + CELSIUS, 40.0 + CELSIUS, 7)
    )
    certificate = {k: v for k, v in load_map(None, GD4008).header["certificate"].items() if k != "each"}
    save_map(folder / "my.nc", closed_build(load_screw(folder / "my.toml"), wide), certificate)
    return "--screw", folder / "my.toml", "--map", folder / "my.nc"


@pytest.fixture(scope="session")
def of_own(own_words, tmp_path_factory):
    """The report on that screw."""
    return made(tmp_path_factory.mktemp("own"), *own_words)
