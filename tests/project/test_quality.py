"""The project's own rules: linter, types, layers, plain ASCII, examples that run, cheap imports."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from paths import ROOT

SOURCES = sorted(
    path
    for folder in ("solver", "fmu_src", "tests", "examples")
    for path in (ROOT / folder).rglob("*.py")
    if "build" not in path.relative_to(ROOT).parts
)
CHECKS = {
    "ruff": ["-m", "ruff", "check", "--no-cache", "."],
    "mypy": ["-m", "mypy"],
    "layers": ["-c", "from importlinter.cli import lint_imports_command; lint_imports_command()"],
}


@pytest.mark.parametrize("name", CHECKS)
def test_checker_finds_nothing(name):
    run = subprocess.run(
        [sys.executable, *CHECKS[name]], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stdout + run.stderr


def test_there_are_sources():
    assert len(SOURCES) > 20


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_source_is_ascii_and_its_examples_run(path):
    text = path.read_text(encoding="utf-8")
    assert text.isascii()
    # doctest sees a prompt only at the start of a line: behind a word it never runs
    if path != Path(__file__):
        assert not re.search(r"^.*\w.*>>> ", text, re.MULTILINE)


def test_the_physics_of_a_map_answer_imports_nothing_slow():
    modules = ["parameters.file"] + [
        f"physics.{name}" for name in ("lubricant", "hertz", "kinematics", "load", "film")
    ]
    code = ";".join(f"import ballscrew_tehl.{module}" for module in modules)
    slow = ["numba", "xarray", "pandas", "matplotlib", "scipy", "rich", "fmpy", "pythonfmu"]
    code += f";import sys;print(*[name for name in {slow} if name in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == []
