"""Pages of the Python reference: one for each folder of the two packages, with all its modules."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = (ROOT / "solver" / "ballscrew_tehl", ROOT / "fmu_src" / "ballscrew_fmu")

START = """# Python reference

Every public function, class and constant of both packages, from their docstrings. A name that is not listed here, or
begins with an underscore, is internal. SI units inside; other units are named at the border. Where to begin:

| to | use |
|---|---|
| read a screw file, or the packaged screw | [`load_parameters`][ballscrew_tehl.parameters.file.load_parameters] |
| load a map and check that it belongs to the screw | [`load_map`][ballscrew_tehl.nut_map.file.load_map] |
| torque, films, pressure at an operating point or at arrays of them | [`NutMap.evaluate`][ballscrew_tehl.runtime.evaluate.NutMap.evaluate] |
| the same with slopes, preload from torque | [`NutMap`][ballscrew_tehl.runtime.evaluate.NutMap] |
| build a map | [`build_map`][ballscrew_tehl.nut_map.build.build_map], [`save_map`][ballscrew_tehl.nut_map.file.save_map] |
| solve one contact | [`solve_contact`][ballscrew_tehl.contact.solve.solve_contact], [`solve_ball`][ballscrew_tehl.contact.ball_contact.solve_ball] |
| loads of all balls | [`double_nut_loads`][ballscrew_tehl.physics.load.double_nut_loads] |
| Hertz contact, film formulas | [`ellipse`][ballscrew_tehl.physics.hertz.ellipse], [`ballscrew_tehl.physics.film`][] |
| build an FMU | [`build_native_fmu`][ballscrew_fmu.native_fmu.package.build_native_fmu], [`build_fmu`][ballscrew_fmu.python_fmu.package.build_fmu] |
| step an FMU by the names of its variables | [`FmuInstance`][ballscrew_fmu.checks.replay.FmuInstance] |

"""


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
    return START + "\n".join(lines) + "\n"


def room_page(room: Room) -> str:
    """The directives of mkdocstrings for the modules of a folder."""
    return "\n".join([f"# {room.name}\n\n{room.summary}\n", *(f"::: {module}\n" for module in room.modules)])
