"""The project's own rules: linter, types, layers, plain ASCII, examples that run."""

import ast
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
ORDER = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)


@pytest.mark.slow
@pytest.mark.parametrize("name", CHECKS)
def test_checker_finds_nothing(name):
    output(*CHECKS[name])


def ordered(node):
    parts = [part for part in ast.walk(node) if isinstance(part, ast.Compare)]
    return [part for part in parts if any(isinstance(op, ORDER) for op in part.ops)]


def extreme(node, names, arguments):
    """Whether this is a call of a built-in extreme, which loses a NaN, with so many arguments."""
    match node:
        case ast.Call(func=ast.Name(id=name), args=args):
            return name in names and len(args) == arguments
    return False


def passes_on_nan(text):
    """Lines that hold for NaN: `assert not a > b`, `assert max(errors) <= tol`, `worst = max(worst, e)`."""
    lines = []
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Assert(test=test):
                negations = [p for p in ast.walk(test) if isinstance(p, ast.UnaryOp)]
                sides = [side for p in ordered(test) for side in (p.left, *p.comparators)]
                if any(
                    isinstance(p.op, ast.Not | ast.Invert) and ordered(p.operand) for p in negations
                ) or any(extreme(side, ("max", "min"), 1) for side in sides):
                    lines.append(node.lineno)
            case ast.Assign(targets=[ast.Name(id=name)], value=value) if extreme(value, ("max",), 2):
                if any(isinstance(a, ast.Name) and a.id == name for a in value.args):
                    lines.append(node.lineno)
    return lines


def test_sources_are_ascii_their_examples_run_and_no_assert_passes_on_nan():
    wrong = [
        "assert not a > b", "assert not (a <= b)", "assert not (a > b).any()", "assert c and not np.any(a >= b)",
        "assert max(errors) <= tol", "assert 0.0 < min(x for x in y)", "worst = max(worst, error)",
    ]  # fmt: skip
    right = ["assert a <= b", "assert not a", "assert np.max(e) <= tol", "n = max(m, 1)", "assert not a == b"]
    assert [passes_on_nan(statement) for statement in wrong + right] == [[1]] * len(wrong) + [[]] * len(right)
    assert len(SOURCES) > 20
    for path in SOURCES:
        text = path.read_text(encoding="utf-8")
        assert text.isascii(), path
        # doctest finds a prompt only at the start of a line
        assert path.name == "test_quality.py" or not re.search(r"^.*\w.*>>> ", text, re.MULTILINE), path
        if path.relative_to(ROOT).parts[0] in ("tests", "examples"):
            assert passes_on_nan(text) == [], path
