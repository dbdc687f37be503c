"""Runs the notebooks of the documentation and stores their outputs in them: python docs/site/notebooks.py [NAME ...]"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
#: seconds that a cell may take
TIMEOUT = 1800


def executed(path: Path, folder: Path | str) -> Any:
    """The notebook with new outputs; its files are written to `folder`. An error in a cell is raised."""
    notebook = nbformat.read(path, as_version=4)
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
    resources = {"metadata": {"path": str(folder)}}
    NotebookClient(
        notebook, timeout=TIMEOUT, kernel_name="python3", record_timing=False, resources=resources
    ).execute()
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            output.get("data", {}).pop("text/plain", None) if "image/png" in output.get("data", {}) else None
    return notebook


def main(names: list[str]) -> int:
    """Run and store the named notebooks, or all."""
    for path in sorted(FOLDER.glob("*.ipynb")):
        if not names or path.stem in names:
            with tempfile.TemporaryDirectory() as folder:
                notebook = executed(path, folder)
            part = path.with_name(path.name + ".part")
            nbformat.write(notebook, part)
            os.replace(part, path)
            print(f"written: {path}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
