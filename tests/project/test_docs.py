"""Every command of the docs runs, in a copy of the project, in the order of the page.

The rules are those of the pages: blocks `sh` and `python` are run, a block `csv NAME` is written to that
file, a block `text` is what the block before it prints, a command with the comment `# minutes` runs in a small form
(small_form below). Commands that set up an environment (venv, pip) are not run; their extras must be those of
pyproject.toml.
"""

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

import pytest
from paths import FMU_SUPPORT, ROOT

from ballscrew_fmu.models import FRICTION, TRANSMISSION
from ballscrew_fmu.native_fmu.package import build_native_fmu, native_file_name
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_fmu.variables.friction import fmu_variables
from ballscrew_tehl.cli.parser import build_parser
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
IDS = [page.name for page in PAGES]
#: a real map with few solved contacts; the range holds the points of the pages
SMALL_MAP = "--quick --preload-n 800 3500 --speed-rpm 80 1000 --temperature-c 25 40"
SMALL_CERTIFICATE = "--count 2"
SET_UP = re.compile(r"-m venv|\bpip install")
MINUTES = re.compile(r"#\s*minutes\b")


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

    map build and check: few contacts of a narrow range, few points; with a cluster, to the parser only. FMUs: those for
    Python hosts, the fixture has made the native ones. Fits: with the film of a formula. Tests: a collection.
    Benchmarks: their options. Importers: not installed.
    """
    bare = command.partition(" #")[0].rstrip()
    if action := re.match(r"python -m ballscrew_tehl map (build|check)\b", bare):
        if "--dask" in bare:
            parsed = build_parser().parse_args(shlex.split(bare)[3:])
            assert parsed.dask == "tcp://HOST:PORT"
            return "true"
        # of two options of one name the last one counts
        return " ".join([bare, *([SMALL_MAP] if action[1] == "build" else []), SMALL_CERTIFICATE])
    if bare.startswith("python build_fmu.py") and "--python-only" not in bare:
        return f"{bare} --python-only"
    if bare == "python -m mkdocs build --strict -f docs/site/mkdocs.yml":
        reads = "from mkdocs.config import load_config; load_config('docs/site/mkdocs.yml')"
        return f'python -c "{reads}"'  # test_site.py builds
    if bare == "python docs/site/notebooks.py":
        return f"{bare} --help"  # test_notebooks.py runs them
    if "calibrate --packaged" in bare:
        return f"{bare} --help"  # the fits of the calibration tests
    if re.match(r"python -m pytest( -n auto .*|.*(tests/(fmu|project)|not slow).*)$", bare):
        return f"{bare} --collect-only -q" + ("" if "tests/" in bare else " tests/published")
    if bare == ".ci/importers":
        assert os.access(ROOT / bare, os.X_OK)
        return "true"
    if bare.startswith(("python tests/benchmarks/", "python tests/fmu/")):
        script, *options = shlex.split(bare)[1:]
        for option in options:
            assert not option.startswith("--") or f'"{option}"' in (ROOT / script).read_text(encoding="utf-8")
        return f"python {script} --help"
    return None


class Clone:
    """A copy of the project in which the commands of the pages run."""

    def __init__(self, folder: Path, environment: dict[str, str]) -> None:
        self.folder, self.environment = folder, environment

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
            code, environment = (
                code.replace('"dist/', '"dist/stub/'),
                {"XDG_CACHE_HOME": str(self.folder / "cache")},
            )
        return self.run([sys.executable, "-c", code], f"{page}, line {block.line}", **environment)


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    """The project without hidden folders; in `dist` native FMUs of this machine and one with a stub solver."""
    folder = tmp_path_factory.mktemp("docs") / "clone"
    shutil.copytree(
        ROOT,
        folder,
        ignore=shutil.ignore_patterns(".*", "dist", "build", "*.egg-info", "__pycache__", "*.png"),
    )
    dist = folder / "dist"
    (dist / "stub").mkdir(parents=True)
    screw = load_map(None, load_parameters())
    for version, model in ((2, FRICTION), (3, FRICTION), (2, TRANSMISSION)):
        target = dist / native_file_name(version, model)
        build_native_fmu(screw, version, target, platforms=("x86_64-linux",), model=model)
    stub = runpy.run_path(str(FMU_SUPPORT / "stub_solver.py"))
    build_fmu(screw, dist / "stub" / "BallScrewFriction.fmu", solver=stub["SOURCES"])
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    return Clone(folder, os.environ | {"PATH": path, "MPLBACKEND": "Agg"})


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=IDS)
def test_every_block_runs_and_prints_what_is_shown(page, clone):
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


@pytest.mark.parametrize("page", PAGES, ids=IDS)
def test_set_up_names_extras_that_exist(page):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for extras in re.findall(r"pip install [^\n]*?\[([a-z,]+)\]", page.read_text(encoding="utf-8")):
        assert set(extras.split(",")) <= project["optional-dependencies"].keys()


@pytest.mark.parametrize("page", PAGES, ids=IDS)
def test_commands_in_the_prose_are_known(page):
    """Commands in backticks: the parser accepts them, scripts exist, examples have a test."""
    prose = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    for command in re.findall(r"`(python [^`]+)`", prose):
        words = shlex.split(command)[1:]
        if words[:2] == ["-m", "ballscrew_tehl"]:
            build_parser().parse_args(words[2:])
        elif words[:2] == ["-m", "mkdocs"]:
            assert (ROOT / words[-1]).is_file()
        else:
            assert (ROOT / words[0]).is_file(), command
    for name in re.findall(r"examples/(\w+)\.py", page.read_text(encoding="utf-8")):
        tests = (ROOT / "tests").rglob("*.py")
        used = (re.search(rf"import {name}|{name}\.py", test.read_text(encoding="utf-8")) for test in tests)
        assert any(used), f"examples/{name}.py has no test"


@pytest.mark.parametrize("page", PAGES, ids=IDS)
def test_links_and_paths_exist(page):
    text = page.read_text(encoding="utf-8")
    for link in re.findall(r"\]\(([^)#]+)\)", text):
        assert re.match(r"https?://", link) or (page.parent / link).exists(), link
    places = r"`((?:solver|fmu_src|tests|examples|docs)/[\w/.]+)`"
    for place in re.findall(places, text):
        assert (ROOT / place.replace("test_MODULE", "test_film")).exists(), place


def test_tables_of_variables_are_those_of_the_fmu():
    text = (ROOT / "docs" / "import_the_fmu.md").read_text(encoding="utf-8")
    table = {v.name: v for v in fmu_variables(load_map(None, load_parameters()).header)}
    shown = set(re.findall(r"`(\w+)`", text)) & table.keys()
    assert shown == table.keys()
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


def test_pages_are_linked():
    readme = PAGES[0].read_text(encoding="utf-8")
    for page in PAGES[1:]:
        assert f"(docs/{page.name})" in readme
