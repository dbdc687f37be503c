"""Runs the notebooks of the documentation and stores their outputs in them: python docs/site/notebooks.py [NAME ...]

NAME: of a file in docs/notebooks, without .ipynb; default: all.
"""

from __future__ import annotations

import argparse
import os
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
            if "image/png" in output.get("data", {}):
                output.data.pop("text/plain", None)  # the address of an object
    return notebook


def main(arguments: list[str] | None = None) -> int:
    """Run and store the named notebooks, or all."""
    known = [path.stem for path in sorted(FOLDER.glob("*.ipynb"))]
    parser = argparse.ArgumentParser(description="Runs the notebooks and stores their outputs in them.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"default: all; {', '.join(known)}")
    names = parser.parse_args(arguments).names or known
    if unknown := set(names) - set(known):
        parser.error(f"{', '.join(sorted(unknown))}: no such notebook; allowed: {', '.join(known)}")
    for name in names:
        path = FOLDER / f"{name}.ipynb"
        with tempfile.TemporaryDirectory() as folder:
            notebook = executed(path, folder)
        part = path.with_name(path.name + ".part")
        nbformat.write(notebook, part)
        os.replace(part, path)
        print(f"written: {path}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
