"""The output shown in the README is that of the commands."""

import re
import subprocess
import sys

import pytest
from paths import ROOT

TEXT = (ROOT / "README.md").read_text(encoding="utf-8")


def run(*arguments):
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=True, cwd=ROOT)
    return done.stdout


@pytest.mark.slow
def test_first_example_runs_and_prints_four_speeds():
    code = re.search(r"```python\n(import math.*?)```", TEXT, re.DOTALL).group(1)
    assert len(re.findall(r"r/min  0\.\d{3} N m", run("-c", code))) == 4


@pytest.mark.slow
def test_validation_table_is_that_of_the_command():
    shown = re.findall(r"^\| Table (\d)[^|]*\|([^|]*)\|([^|]*)\|([^|]*)\|([^|]*)\|$", TEXT, re.MULTILINE)
    assert [row[0] for row in shown] == ["2", "4", "3"]
    printed = re.findall(r"mean deviation((?: +[\d.]+ %){4})", run("-m", "ballscrew_tehl", "validate"))
    for (_, *cells), line in zip(shown, printed[:3], strict=True):
        assert [cell.strip() for cell in cells] == re.findall(r"[\d.]+ %", line)


@pytest.mark.slow
def test_pictures_exist_and_commands_are_known():
    for picture in re.findall(r"!\[[^]]*\]\((docs/[^)]*)\)", TEXT):
        assert (ROOT / picture).stat().st_size > 10_000
    known = run("-m", "ballscrew_tehl", "--help")
    for command in re.findall(r"python -m ballscrew_tehl (\w+)", TEXT):
        assert command in known
