"""The project's own rules: linter, types, layers, plain ASCII, examples that run, cheap imports."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest
from paths import ROOT

SOURCES = sorted(
    path
    for folder in ("solver", "fmu_src", "tests", "examples", "docs")
    for path in (ROOT / folder).rglob("*.py")
    if "build" not in path.relative_to(ROOT).parts
)
CHECKS = {
    "ruff": ["-m", "ruff", "check", "--no-cache", "."],
    "mypy": ["-m", "mypy"],
    "layers": ["-c", "from importlinter.cli import lint_imports_command; lint_imports_command()"],
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CHECKS)
def test_checker_finds_nothing(name):
    run = subprocess.run(
        [sys.executable, *CHECKS[name]], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stdout + run.stderr


def test_sources_are_ascii_and_their_examples_run():
    assert len(SOURCES) > 20
    for path in SOURCES:
        text = path.read_text(encoding="utf-8")
        assert text.isascii(), path
        # doctest finds a prompt only at the start of a line
        assert path == Path(__file__) or not re.search(r"^.*\w.*>>> ", text, re.MULTILINE), path


def test_evaluating_a_map_imports_nothing_slow():
    modules = ["parameters.file"] + [
        f"physics.{name}" for name in ("lubricant", "hertz", "kinematics", "load", "film")
    ]
    code = ";".join(f"import ballscrew_tehl.{module}" for module in modules)
    slow = ["numba", "xarray", "pandas", "matplotlib", "scipy", "rich", "fmpy", "pythonfmu"]
    code += f";import sys;print(*[name for name in {slow} if name in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == []


ORDER = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)


def ordered(node):
    """Whether an ordering comparison is in this expression."""
    return any(
        isinstance(part, ast.Compare) and any(isinstance(op, ORDER) for op in part.ops)
        for part in ast.walk(node)
    )


def extreme(node, names, arguments):
    """Whether this is a call of a built-in extreme, which loses a NaN, with so many arguments."""
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id in names
        and len(node.args) == arguments
    )


def passes_on_nan(text):
    """Lines of a source where a NaN would pass.

    `assert not error > tol`, `assert not (errors > tol).any()`, `assert max(errors) <= tol`, `worst = max(worst, e)`.
    """
    lines = []
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Assert(test=test):
                parts = list(ast.walk(test))
                negated = any(
                    isinstance(p, ast.UnaryOp)
                    and isinstance(p.op, ast.Not | ast.Invert)
                    and ordered(p.operand)
                    for p in parts
                )
                lost = any(
                    extreme(side, ("max", "min"), 1)
                    for p in parts
                    if isinstance(p, ast.Compare) and any(isinstance(op, ORDER) for op in p.ops)
                    for side in (p.left, *p.comparators)
                )
                if negated or lost:
                    lines.append(node.lineno)
            case ast.Assign(targets=[ast.Name(id=name)], value=value) if extreme(value, ("max",), 2):
                if any(isinstance(a, ast.Name) and a.id == name for a in value.args):
                    lines.append(node.lineno)
    return lines


def test_forms_that_pass_on_nan_are_found():
    wrong = [
        "assert not a > b", "assert not (a <= b)", "assert not (a > b).any()", "assert c and not np.any(a >= b)",
        "assert max(errors) <= tol", "assert 0.0 < min(x for x in y)", "worst = max(worst, error)",
    ]  # fmt: skip
    right = [
        "assert a <= b", "assert not a", "assert np.max(errors) <= tol", "n = max(m, 1)", "x = min(x, highest)",
        "assert not a == b",
    ]  # fmt: skip
    for statement in wrong:
        assert passes_on_nan(statement) == [1], statement
    for statement in right:
        assert passes_on_nan(statement) == [], statement


def test_no_assert_passes_on_nan():
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in SOURCES
        if path.relative_to(ROOT).parts[0] in ("tests", "examples")
        for line in passes_on_nan(path.read_text(encoding="utf-8"))
    ]
    assert found == []
