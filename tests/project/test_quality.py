"""The project's own rules: linter, types, layers, plain ASCII, examples that run."""

import re

import pytest
from paths import ROOT
from processes import output

SOURCES = [
    path
    for folder in ("solver", "fmu_src", "tests", "examples", "docs")
    for path in sorted((ROOT / folder).rglob("*.py"))
    if "build" not in path.relative_to(ROOT).parts
]
CHECKS = {
    "ruff": ["-m", "ruff", "check", "--no-cache", "."],
    "mypy": ["-m", "mypy"],
    "layers": ["-c", "from importlinter.cli import lint_imports_command; lint_imports_command()"],
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CHECKS)
def test_checker_finds_nothing(name):
    output(*CHECKS[name])


def test_sources_are_ascii_and_their_examples_run():
    assert len(SOURCES) > 20
    for path in SOURCES:
        text = path.read_text(encoding="utf-8")
        assert text.isascii(), path
        # doctest finds a prompt only at the start of a line
        assert path.name == "test_quality.py" or not re.search(r"^.*\w.*>>> ", text, re.MULTILINE), path
