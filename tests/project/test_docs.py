"""Every command of the pages and notebooks runs, in a copy of the project, in the order of the page.

The rules are those of the pages: blocks `sh` and `python` are run, a block `csv NAME` is written to that file, a block
`text` is what the block before it prints. A command with the comment `# minutes` is replaced by a small form. Commands
that set up an environment are not run; their extras must be those of pyproject.toml. One map and one set of FMUs serve
all pages and notebooks.
"""

import importlib.util
import os
import re
import runpy
import shlex
import shutil
import sys
import tomllib
from itertools import groupby
from pathlib import Path

import nbformat
import pytest
from paths import FMU_SUPPORT, ROOT
from processes import output

from ballscrew_fmu.command import BALLSCREW, BUILD
from ballscrew_fmu.models import AXIS, FRICTION, MONITOR, TRANSMISSION
from ballscrew_fmu.native_fmu.package import build_native_fmu, native_file_name
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_fmu.variables.friction import fmu_variables
from ballscrew_tehl.applications.cli.parser import build_parser
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters.file import load_screw

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
BLOCK = re.compile(r"^```(.*)\n((?:(?!```).*\n)*)```$", re.MULTILINE)
SET_UP = re.compile(r"-m venv|\bpip install")
MINUTES = re.compile(r"#\s*minutes\b")
NUMBER = re.compile(r"(?<![\w.])[+-]?\d+\.?\d*(?:e[+-]?\d+)?")
#: relative, and in units of the last digit shown: a map may be solved anew within its tolerance, and roots of fits
#: differ in the last digits from machine to machine; what moves by more must be stored again (docs/site/notebooks.py)
RELATIVE, LAST_DIGIT = 0.01, 2.0
VARIABLES = {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}", "MPLBACKEND": "Agg"}


def commands(text: str) -> list[str]:
    """Commands of a shell block that are run: its lines, parted at &&, without those that set up."""
    parts = []
    for line in text.splitlines():
        command, _, remark = line.partition(" #")
        marked = " # minutes" if MINUTES.match(f"#{remark}") else ""
        parts += [f"{part.strip()}{marked}" for part in command.split(" && ") if part.strip()]
    return [part.replace(".venv/bin/python", "python") for part in parts if not SET_UP.search(part)]


def known(command: str) -> None:
    """Raises if a command of the project has options that it does not know, or names a file that is not there."""
    program, *words = shlex.split(command.partition(" #")[0])
    match [program, *words]:
        case ["ballscrew", *rest]:
            build_parser("ballscrew", BALLSCREW).parse_args(rest)
        case [_, "build_fmu.py", *rest]:
            build_parser("build_fmu.py", BUILD).parse_args(rest)
        case [_, "-m", *_]:
            assert all((ROOT / word).exists() for word in words if word.startswith(("tests/", "docs/")))
        case _:
            script = ROOT / (words[0] if words else program)
            assert words or os.access(script, os.X_OK), command
            text = script.read_text(encoding="utf-8")
            assert all(f'"{option}"' in text for option in words[1:] if option.startswith("--")), command


def shell(text: str, folder: Path) -> str:
    printed = ""
    for command in commands(text):
        if MINUTES.search(command):
            known(command)
        else:  # `! command`: one that must fail
            refused = command.startswith("! ")
            command = command.removeprefix("! ")
            printed += output("-c", command, program="bash", folder=folder, refused=refused, **VARIABLES)
    return printed


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    """The project without hidden folders; in `dist` the FMUs that pages name, in `small` the screw of a notebook.

    `refine` of the Python FMU has a stub of the solver.
    """
    folder = tmp_path_factory.mktemp("docs") / "clone"
    hidden = shutil.ignore_patterns(".*", "dist", "build", "*.egg-info", "__pycache__", "*.png")
    shutil.copytree(ROOT, folder, ignore=hidden)
    dist, screw = folder / "dist", load_map(None, load_screw())
    dist.mkdir()
    for version, model in ((2, FRICTION), (3, FRICTION), (2, MONITOR), (2, TRANSMISSION), (2, AXIS)):
        target = dist / native_file_name(version, model)
        build_native_fmu(screw, version, target, platforms=("x86_64-linux",), model=model)
    stub = runpy.run_path(str(FMU_SUPPORT / "stub_solver.py"))["SOURCES"]
    build_fmu(screw, dist / "BallScrewFriction.fmu", solver=stub)
    return folder


@pytest.fixture(scope="module")
def executed(clone):
    spec = importlib.util.spec_from_file_location("notebooks", ROOT / "docs" / "site" / "notebooks.py")
    notebooks = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(notebooks)
    (clone / "small").mkdir()
    return {path: notebooks.executed(path, clone / "small") for path in NOTEBOOKS}


def shown(notebook):
    """Outputs of each code cell: their kinds, and all text; on a busy machine text may come in several parts."""
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    every = [[(o.output_type, sorted(o.get("data", {}))) for o in cell.outputs] for cell in cells]
    kinds = [[kind for kind, _ in groupby(each)] for each in every]
    return kinds, "\n".join("".join(o.get("text", "") for o in cell.outputs) for cell in cells)


def close(stored: str, new: str) -> bool:
    digit = 10.0 ** -len(stored.partition(".")[2].partition("e")[0])
    return abs(float(stored) - float(new)) <= RELATIVE * abs(float(stored)) + LAST_DIGIT * digit


@pytest.mark.slow
def test_notebooks_show_what_is_stored(executed):
    for path, new in executed.items():
        stored = nbformat.read(path, as_version=4)
        counts = [cell.execution_count for cell in stored.cells if cell.cell_type == "code"]
        assert counts == list(range(1, len(counts) + 1))
        (kinds, text), (new_kinds, new_text) = shown(stored), shown(new)
        assert new_kinds == kinds
        assert NUMBER.sub("#", new_text) == NUMBER.sub("#", text)
        pairs = zip(NUMBER.findall(text), NUMBER.findall(new_text), strict=True)
        assert [pair for pair in pairs if not close(*pair)] == []


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_block_runs_and_prints_what_is_shown(page, clone, executed):
    printed, text = "", page.read_text(encoding="utf-8")
    assert len(re.findall("^```", text, re.MULTILINE)) == 2 * len(BLOCK.findall(text))
    for block in BLOCK.finditer(text):
        where = f"{page.name}, line {text.count(chr(10), 0, block.start()) + 1}"
        match block[1].split():
            case ["sh"]:
                printed = shell(block[2], clone)
            case ["python"]:
                # what the stub of the solver compiles must not stay in the cache of the user
                cache = {"XDG_CACHE_HOME": str(clone / "cache")} if MINUTES.match(block[2]) else {}
                printed = output("-c", block[2], folder=clone, **VARIABLES, **cache)
            case ["csv", name]:
                (clone / name).write_text(block[2], encoding="utf-8")
            case ["text"]:
                assert block[2] == printed, where
            case _:
                pytest.fail(f"{where}: a block {block[1]} is not run")


def test_commands_links_and_paths_in_the_prose_exist():
    """Examples have a test, every page is linked from README."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    tests = "\n".join(test.read_text(encoding="utf-8") for test in (ROOT / "tests").rglob("test_*.py"))
    readme = PAGES[0].read_text(encoding="utf-8")
    for page in PAGES:
        assert page == PAGES[0] or f"(docs/{page.name})" in readme
        text = page.read_text(encoding="utf-8")
        for named in re.findall(r"pip install [^\n]*?\[([a-z,]+)\]", text):
            assert set(named.split(",")) <= extras.keys()
        for command in re.findall(r"`((?:python|ballscrew) (?!--help|COMMAND)[^`]+)`", BLOCK.sub("", text)):
            known(command)
        for name in re.findall(r"examples/(\w+)\.py", text):
            assert re.search(rf"\b{name}\b", tests), f"examples/{name}.py has no test"
        for link in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", text):
            assert re.match(r"https?://", link) or (page.parent / link).exists(), f"{page.name}: {link}"
        for place in re.findall(r"`((?:solver|fmu_src|tests|examples|docs)/[\w/.]+)`", text):
            assert (ROOT / place).exists(), f"{page.name}: {place}"


def test_tables_of_variables_are_those_of_the_fmu():
    text = (ROOT / "docs" / "import_the_fmu.md").read_text(encoding="utf-8")
    table = {v.name: v for v in fmu_variables(load_map(None, load_screw()).header)}
    assert set(re.findall(r"`(\w+)`", text)) & table.keys() == table.keys()
    rows = re.findall(r"^\| ((?:`\w+`(?:, )?)+) \| ([^|]+) \| ([^|]+) \|", text, re.MULTILINE)
    assert len(rows) > 12
    for names, units, third in rows:
        names = names.replace("`", "").split(", ")
        for k, name in enumerate(names):
            v = table[name]
            assert units.split(", ")[min(k, units.count(", "))] == (v.unit or "Boolean"), name
            if v.start is not None:
                start = third.split(", ")[k]
                assert start == str(v.start).lower() if v.unit is None else float(start) == v.start, name
