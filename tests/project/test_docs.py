"""Every command of the pages and notebooks runs, in a copy of the project, in the order of the page.

The rules are those of the pages: blocks `sh` and `python` are run, a block `csv NAME` is written to that file, a block
`text` is what the block before it prints. A command with the comment `# minutes` is replaced by a small form. Commands
that set up an environment (venv, pip) are not run; their extras must be those of pyproject.toml. One map and one set of
FMUs serve all pages and notebooks.
"""

import importlib.util
import json
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import NamedTuple

import nbformat
import pytest
from paths import FMU_SUPPORT, ROOT

from ballscrew_fmu.__main__ import parser as fmu_parser
from ballscrew_fmu.models import FRICTION, TRANSMISSION
from ballscrew_fmu.native_fmu.package import build_native_fmu, native_file_name
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_fmu.variables.friction import fmu_variables
from ballscrew_tehl.cli.parser import build_parser
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
SET_UP = re.compile(r"-m venv|\bpip install")
MINUTES = re.compile(r"#\s*minutes\b")
NUMBER = re.compile(r"(?<![\w.])[+-]?\d+\.?\d*(?:e[+-]?\d+)?")
#: relative, and in units of the last digit shown: a map may be solved anew within its tolerance, and roots of fits
#: differ in the last digits from machine to machine; what moves by more must be stored again (docs/site/notebooks.py)
RELATIVE, LAST_DIGIT = 0.01, 2.0


class Block(NamedTuple):
    """One fenced block: words after the fence, its text, its first line in the page."""

    info: list[str]
    text: str
    line: int


def blocks(page: Path) -> list[Block]:
    found, fence = [], None
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), start=1):
        if fence is None and line.startswith("```"):
            fence = Block(line[3:].split(), "", number + 1)
        elif fence is not None and line == "```":
            found.append(fence)
            fence = None
        elif fence is not None:
            fence = fence._replace(text=f"{fence.text}{line}\n")
    assert fence is None, f"{page.name}: the block at line {fence.line} has no end"
    return found


def commands(text: str) -> list[str]:
    """Commands of a shell block that are run: its lines, parted at &&, without those that set up."""
    parts = []
    for line in text.splitlines():
        command, _, remark = line.partition(" #")
        marked = " # minutes" if MINUTES.match(f"#{remark}") else ""
        parts += [f"{part.strip()}{marked}" for part in command.split(" && ") if part.strip()]
    return [part.replace(".venv/bin/python", "python") for part in parts if not SET_UP.search(part)]


def small_form(command: str) -> str | None:
    """What the test runs of a command that takes minutes; None if the command runs as it is.

    The map of `my.toml` is that of the notebook (fixture clone), a check of a map solves one point, other solves and
    fits are parsed only. FMUs: those for Python hosts, the fixture has made the native ones. Tests and scripts: they
    exist and know their options.
    """
    bare = command.partition(" #")[0].rstrip()
    program, *words = shlex.split(bare)
    match words:
        case ["-m", "ballscrew_tehl", "map", "check", *_]:
            return f"{bare} --count 1"  # of two options of one name the last one counts
        case ["-m", "ballscrew_tehl", *rest] if MINUTES.search(command):
            build_parser().parse_args(rest)
            if rest[:2] == ["map", "build"] and rest[2:] == ["--screw", "my.toml", "--output", "my_map.nc"]:
                return "cp small/screw_20x5.toml my.toml && cp small/map_20x5.nc my_map.nc"
            return "true"
        case ["build_fmu.py", *rest] if "--python-only" not in rest:
            fmu_parser("build_fmu.py", False, Path("dist")).parse_args(rest)
            return f"{bare} --python-only" if rest else "true"
        case ["-m", "mkdocs", *_]:
            reads = "from mkdocs.config import load_config; load_config('docs/site/mkdocs.yml')"
            return f'python -c "{reads}"'  # test_site.py builds
        case ["-m", "pytest", *rest] if MINUTES.search(command):
            assert all((ROOT / word).exists() for word in rest if word.startswith("tests/"))
            return "true"
        case [script, *rest] if program == "python" and script.startswith(("tests/", "docs/site/")):
            known = (ROOT / script).read_text(encoding="utf-8")
            assert all(f'"{option}"' in known for option in rest if option.startswith("--"))
            return f"python {script} --help"
    if program == ".ci/importers":
        assert os.access(ROOT / program, os.X_OK)
        return "true"
    return None


class Clone(NamedTuple):
    """A copy of the project in which the commands of the pages run."""

    folder: Path
    environment: dict[str, str]

    def run(self, arguments: list[str], where: str, refused: bool = False, **environment: str) -> str:
        variables = self.environment | environment
        done = subprocess.run(
            arguments, cwd=self.folder, env=variables, capture_output=True, text=True, check=False
        )
        report = f"{where}: {shlex.join(arguments)}\n{done.stdout[-2000:]}\n{done.stderr[-3000:]}"
        assert (done.returncode != 0) == refused, report
        return done.stdout

    def shell(self, block: Block, page: str) -> str:
        printed = ""
        for command in commands(block.text):
            where, small = f"{page}, line {block.line}", small_form(command)
            assert (small is not None) == bool(MINUTES.search(command)), f"{where}: `{command}`: # minutes?"
            bare = small or command
            # `! command`: one that must fail
            printed += self.run(["bash", "-c", bare.removeprefix("! ")], where, bare.startswith("! "))
        return printed

    def python(self, block: Block, page: str) -> str:
        code, environment = block.text, {}
        if MINUTES.match(code):
            assert "refine=True" in code
            code = code.replace('"dist/', '"dist/stub/')
            environment = {"XDG_CACHE_HOME": str(self.folder / "cache")}
        return self.run([sys.executable, "-c", code], f"{page}, line {block.line}", **environment)


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    """The project without hidden folders; in `dist` all FMUs that pages name, in `small` the screw of a notebook."""
    folder = tmp_path_factory.mktemp("docs") / "clone"
    hidden = shutil.ignore_patterns(".*", "dist", "build", "*.egg-info", "__pycache__", "*.png")
    shutil.copytree(ROOT, folder, ignore=hidden)
    dist = folder / "dist"
    (dist / "stub").mkdir(parents=True)
    screw = load_map(None, load_parameters())
    for version, model in ((2, FRICTION), (3, FRICTION), (2, TRANSMISSION)):
        target = dist / native_file_name(version, model)
        build_native_fmu(screw, version, target, platforms=("x86_64-linux",), model=model)
    stub = runpy.run_path(str(FMU_SUPPORT / "stub_solver.py"))
    build_fmu(screw, dist / "stub" / "BallScrewFriction.fmu", solver=stub["SOURCES"])
    (folder / "small").mkdir()
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    made = Clone(folder, os.environ | {"PATH": path, "MPLBACKEND": "Agg"})
    made.run([sys.executable, "build_fmu.py", "--python-only"], "fixture")
    return made


def shown(notebook):
    """Kinds of outputs of each cell, and their text."""
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    return [[(o.output_type, o.get("text", ""), sorted(o.get("data", {}))) for o in c.outputs] for c in cells]


def differences(stored, new):
    """Pairs of numbers of two texts that differ; all of them if the words do."""
    if NUMBER.sub("#", stored) != NUMBER.sub("#", new):
        return [(stored, new)]
    pairs = zip(NUMBER.findall(stored), NUMBER.findall(new), strict=True)

    def same(a, b):
        digit = 10.0 ** -len(a.partition(".")[2].partition("e")[0])
        return abs(float(a) - float(b)) <= RELATIVE * abs(float(a)) + LAST_DIGIT * digit

    return [pair for pair in pairs if not same(*pair)]


def test_differences_are_found():
    cases = [
        ("1.00 N", "1.01 N", 0),
        ("1.00 N", "1.10 N", 1),
        ("1 N", "1 kN", 1),
        ("1 2", "1 9", 1),
        ("a 5", "a nan", 1),
    ]
    for stored, new, count in cases:
        assert len(differences(stored, new)) == count


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_shows_what_is_stored(path, clone):
    """Before the pages: the first notebook builds the map that they use."""
    stored = nbformat.read(path, as_version=4)
    nbformat.validate(stored)
    cells = [cell for cell in stored.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    spec = importlib.util.spec_from_file_location("notebooks", ROOT / "docs" / "site" / "notebooks.py")
    notebooks = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(notebooks)
    old, new = shown(stored), shown(notebooks.executed(path, clone.folder / "small"))
    assert [[output[::2] for output in cell] for cell in new] == [
        [output[::2] for output in cell] for cell in old
    ]
    texts = [[text for cell in cells for _, text, _ in cell] for cells in (old, new)]
    assert [pair for both in zip(*texts, strict=True) for pair in differences(*both)] == []


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_block_runs_and_prints_what_is_shown(page, clone):
    if not (clone.folder / "small" / "map_20x5.nc").exists():  # a page alone
        test_a_notebook_shows_what_is_stored(NOTEBOOKS[0], clone)
    printed = ""
    for block in blocks(page):
        match block.info:
            case ["sh"]:
                printed = clone.shell(block, page.name)
            case ["python"]:
                printed = clone.python(block, page.name)
            case ["csv", name]:
                (clone.folder / name).write_text(block.text, encoding="utf-8")
            case ["text"]:
                assert block.text == printed, f"{page.name}, line {block.line}"
            case _:
                pytest.fail(f"{page.name}, line {block.line}: a block {block.info} is not run")


def test_commands_links_and_paths_in_the_prose_exist():
    """The parser accepts commands, scripts exist, examples have a test, every page is linked from README."""
    tests = "\n".join(test.read_text(encoding="utf-8") for test in (ROOT / "tests").rglob("test_*.py"))
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for extras in re.findall(r"pip install [^\n]*?\[([a-z,]+)\]", text):
            assert set(extras.split(",")) <= PROJECT["optional-dependencies"].keys()
        prose = re.sub(r"^```.*?^```$", "", text, flags=re.DOTALL | re.MULTILINE)
        for command in re.findall(r"`(python [^`]+)`", prose):
            words = shlex.split(command)[1:]
            if words[:2] == ["-m", "ballscrew_tehl"]:
                build_parser().parse_args(words[2:])
            elif words[:2] == ["-m", "ballscrew_fmu"]:
                fmu_parser("ballscrew_fmu", True, Path("dist")).parse_args(words[2:])
            else:
                assert (ROOT / words[-1 if words[:2] == ["-m", "mkdocs"] else 0]).is_file(), command
        for name in re.findall(r"examples/(\w+)\.py", text):
            assert re.search(rf"import {name}\b|{name}\.py", tests), f"examples/{name}.py has no test"
        for link in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", text):
            assert re.match(r"https?://", link) or (page.parent / link).exists(), f"{page.name}: {link}"
        for place in re.findall(r"`((?:solver|fmu_src|tests|examples|docs)/[\w/.]+)`", text):
            assert (ROOT / place).exists(), f"{page.name}: {place}"
    readme = PAGES[0].read_text(encoding="utf-8")
    assert [page.name for page in PAGES[1:] if f"(docs/{page.name})" not in readme] == []


def test_tables_of_variables_are_those_of_the_fmu():
    text = (ROOT / "docs" / "import_the_fmu.md").read_text(encoding="utf-8")
    table = {v.name: v for v in fmu_variables(load_map(None, load_parameters()).header)}
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


@pytest.mark.slow
def test_validation_table_of_the_readme_is_that_of_the_command(clone):
    text = PAGES[0].read_text(encoding="utf-8")
    rows = re.findall(r"^\| (Table \d)[^|]*\|([^|]*)\|([^|]*)\|([^|]*)\|([^|]*)\|$", text, re.MULTILINE)
    printed = clone.run([sys.executable, "-m", "ballscrew_tehl", "validate", "--json"], "README.md")
    tables = json.loads(printed)["tables"]["three_parameter"]
    assert len(rows) == len(tables) == 3
    for (name, *cells), table in zip(rows, tables, strict=True):
        assert table["title"].startswith(name)
        assert [cell.strip() for cell in cells] == [f"{100.0 * value:.2f} %" for value in table["deviations"]]
