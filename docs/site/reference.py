"""Pages of the Python reference: one for each folder of the two packages, with all its modules."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = (ROOT / "solver" / "ballscrew_tehl", ROOT / "fmu_src" / "ballscrew_fmu")

#: first part of the overview
START = Path(__file__).with_name("reference.md")


class Room(NamedTuple):
    """A folder: name of the package, its docstring, names of its modules."""

    name: str
    summary: str
    modules: list[str]

    @property
    def page(self) -> str:
        """Path of its page in the site."""
        return f"reference/{self.name}.md"


def docstring(path: Path) -> str:
    """First paragraph of a module's docstring."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return " ".join(text.partition("\n\n")[0].split())


def rooms() -> list[Room]:
    """All folders with modules, packages first."""
    found = []
    for package in PACKAGES:
        for start in sorted(package.rglob("__init__.py")):
            folder = start.parent
            name = ".".join(folder.relative_to(package.parent).parts)
            modules = [f"{name}.{path.stem}" for path in sorted(folder.glob("*.py")) if path != start]
            found.append(Room(name, docstring(start), [m for m in modules if not m.endswith("__main__")]))
    return found


def start_page() -> str:
    """Overview with the folders."""
    lines = ["| folder | contents |", "|---|---|"]
    lines += [f"| [{room.name}]({Path(room.page).name}) | {room.summary} |" for room in rooms()]
    return "\n".join([START.read_text(encoding="utf-8"), *lines]) + "\n"


def room_page(room: Room) -> str:
    """The directives of mkdocstrings for the modules of a folder."""
    return "\n".join([f"# {room.name}\n\n{room.summary}\n", *(f"::: {module}\n" for module in room.modules)])
