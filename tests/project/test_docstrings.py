"""Docstrings of public names are numpydoc: of what pages, notebooks, examples and the reference name.

Not what examples/paper imports alone, which fits the packaged numbers again.
"""

import inspect
import json
import re
from dataclasses import is_dataclass
from enum import Enum
from pkgutil import resolve_name

from numpydoc.docscrape import NumpyDocString
from numpydoc.validate import validate
from paths import ROOT
from pydantic import BaseModel

#: not required: extended summary, See Also, verbs and sentences, names of results; fields of classes: see below
IGNORED = {"ES01", "GL01", "SA01", "SS05", "PR08", "PR09", "RT02", "RT04", "RT05"}
#: not required of methods, for which a sentence with units may do
OF_METHODS = {"EX01", "PR01", "RT01"}
PAGES = "*.md", "docs/*.md", "docs/site/*.md", "examples/*.py"
NAMED = re.compile(r"^\s*from (ballscrew_[\w.]+) import (\([^)]*\)|[^\n(]*)|^::: ([\w.]+)\.(\w+)$", re.M)


def public_objects():
    """Functions and classes by module.name."""
    texts = [path.read_text("utf-8") for pattern in PAGES for path in ROOT.glob(pattern)]
    books = [json.loads(path.read_bytes()) for path in ROOT.glob("docs/notebooks/*.ipynb")]
    texts += ["".join(cell["source"]) for book in books for cell in book["cells"]]
    for module, names, other, name in (each for text in texts for each in NAMED.findall(text)):
        for word in set(re.findall(r"\w+", names or name)) - {"main"}:
            item = getattr(resolve_name(module or other), word, None)
            if inspect.isfunction(item) or (inspect.isclass(item) and not issubclass(item, Enum)):
                yield f"{item.__module__}.{item.__qualname__}", item


def problems(path, item):
    """Codes and messages. Records need no examples, nor texts what a screw file describes."""
    ignored = set(IGNORED)
    if inspect.isclass(item):
        ignored |= {"PR01", "PR03"} | ({"EX01"} if issubclass(item, tuple) or is_dataclass(item) else set())
        doc = NumpyDocString(inspect.getdoc(item))
        entries = ", ".join(each.name for each in doc["Parameters"] + doc["Attributes"])
        fields = {} if issubclass(item, BaseModel | Exception) else inspect.signature(item).parameters
        yield from ((path, "PR01", name) for name in fields if not re.search(rf"\b{name}\b", entries))
        for name, member in vars(item).items():
            if name[0] != "_" and isinstance(member, property | classmethod | type(problems)):
                yield from (each for each in problems(f"{path}.{name}", member) if each[1] not in OF_METHODS)
    yield from ((path, *error) for error in validate(path)["errors"] if error[0] not in ignored)


def test_public_names_have_complete_docstrings():
    objects = dict(public_objects())
    assert len(objects) > 60
    assert [" ".join(problem) for path, item in objects.items() for problem in problems(path, item)] == []
