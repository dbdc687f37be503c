"""Docstrings of public names are numpydoc: of what pages, notebooks, examples and the reference name."""

import inspect
import json
import re
from pkgutil import resolve_name

from numpydoc.docscrape import NumpyDocString
from numpydoc.validate import validate
from paths import ROOT
from pydantic import BaseModel

#: not required: extended summary, See Also, descriptions that are sentences, results without names
IGNORED = {"ES01", "GL01", "SA01", "PR08", "PR09", "RT02", "RT04", "RT05"}
#: modules that are not converted yet
PENDING = {
    "ballscrew_tehl.applications.preload", "ballscrew_tehl.atlas.ball_contacts", "ballscrew_tehl.friction.interval",
    "ballscrew_tehl.friction.sets", "ballscrew_tehl.nut_map.build", "ballscrew_tehl.nut_map.file",
    "ballscrew_tehl.nut_map.grid", "ballscrew_tehl.nut_map.interval", "ballscrew_tehl.parameters.friction",
}  # fmt: skip
NAMED = re.compile(
    r"^\s*from (ballscrew_[\w.]+) import (\([^)]*\)|[^\n(]*)|^::: ([\w.]+)\.(\w+)$", re.MULTILINE
)


def public_objects():
    """Functions and classes by module.name."""
    docs = ROOT / "docs"
    pages = [ROOT / "README.md", *docs.glob("*.md"), *ROOT.glob("examples/**/*.py"), docs / "site" / "reference.md"]
    cells = [cell for path in docs.glob("notebooks/*.ipynb") for cell in json.loads(path.read_text())["cells"]]
    texts = [path.read_text() for path in pages] + ["".join(cell["source"]) for cell in cells]
    for module, names, other, name in (match for text in texts for match in NAMED.findall(text)):
        for word in set(re.findall(r"\w+", names or name)) - {"main"}:
            item = getattr(resolve_name(module or other), word, None)
            if (inspect.isfunction(item) or inspect.isclass(item)) and item.__module__.startswith("ballscrew_"):
                yield f"{item.__module__}.{item.__qualname__}", item


def problems(path, item):
    """Codes and messages; examples of methods are those of the class, fields of a screw file are described in it."""
    found = [error for error in validate(path)["errors"] if error[0] not in IGNORED]
    if inspect.isclass(item):
        doc, fields = NumpyDocString(inspect.getdoc(item)), inspect.signature(item).parameters
        listed = {name for each in ("Parameters", "Attributes") for names, *_ in doc[each] for name in names.split(", ")}
        missing = [] if issubclass(item, BaseModel) else [("PR01", name) for name in fields if name not in listed]
        found = [error for error in found if error[0] not in {"PR01", "PR03"}] + missing
        for name, member in vars(item).items():
            if name[0] != "_" and isinstance(member, property | classmethod | type(problems)):
                yield from (each for each in problems(f"{path}.{name}", member) if each[1] != "EX01")
    yield from ((path, *error) for error in found)


def test_public_names_have_complete_docstrings():
    objects = dict(public_objects())
    assert len(objects) > 80
    converted = {path: item for path, item in objects.items() if path.rpartition(".")[0] not in PENDING}
    assert [" ".join(problem) for path, item in converted.items() for problem in problems(path, item)] == []
