"""The notebooks run, and what they show is what is stored in them."""

import importlib.util
import re

import nbformat
import pytest
from paths import ROOT

FOLDER = ROOT / "docs" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
NUMBER = re.compile(r"(?<![\w.])[+-]?\d+\.?\d*(?:e[+-]?\d+)?")
#: relative, and in units of the last digit shown: a map may be solved anew within its tolerance, and roots of fits
#: differ in the last digits from machine to machine; what moves by more must be stored again (docs/site/notebooks.py)
RELATIVE, LAST_DIGIT = 0.01, 2.0


def runner():
    spec = importlib.util.spec_from_file_location("site_notebooks", ROOT / "docs" / "site" / "notebooks.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def shown(notebook):
    """Kinds of outputs of each cell, and their text."""
    return [
        [
            (output.output_type, output.get("text", ""), sorted(output.get("data", {})))
            for output in cell.outputs
        ]
        for cell in notebook.cells
        if cell.cell_type == "code"
    ]


def differences(stored, new):
    """Pairs of numbers of two texts that differ; all of them if the words do."""
    if NUMBER.sub("#", stored) != NUMBER.sub("#", new):
        return [(stored, new)]
    pairs = zip(NUMBER.findall(stored), NUMBER.findall(new), strict=True)

    def apart(a, b):
        digit = 10.0 ** -len(a.partition(".")[2].partition("e")[0])
        return not abs(float(a) - float(b)) <= RELATIVE * abs(float(a)) + LAST_DIGIT * digit

    return [pair for pair in pairs if apart(*pair)]


def test_there_are_two_notebooks():
    assert [path.stem for path in NOTEBOOKS] == ["catalogue_to_fmu", "torque_to_preload"]


@pytest.mark.parametrize(
    ("stored", "new", "count"),
    [
        ("1.00 N", "1.01 N", 0),
        ("1.00 N", "1.10 N", 1),
        ("1 N", "1 kN", 1),
        ("1 2", "1 9", 1),
        ("a 5", "a nan", 1),
    ],
)
def test_differences_are_found(stored, new, count):
    assert len(differences(stored, new)) == count


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_outputs_are_stored_in_order_and_without_errors(path):
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    outputs = [output for cell in cells for output in cell.outputs]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert {output.output_type for output in outputs} <= {"stream", "display_data"}
    assert {output.get("name", "stdout") for output in outputs} == {"stdout"}


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_run_shows_what_is_stored(path, tmp_path):
    stored = shown(nbformat.read(path, as_version=4))
    new = shown(runner().executed(path, tmp_path))
    assert [[(kind, data) for kind, _, data in cell] for cell in new] == [
        [(kind, data) for kind, _, data in cell] for cell in stored
    ]
    found = [
        pair
        for old_cell, new_cell in zip(stored, new, strict=True)
        for (_, old_text, _), (_, new_text, _) in zip(old_cell, new_cell, strict=True)
        for pair in differences(old_text, new_text)
    ]
    assert found == []
