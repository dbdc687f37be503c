"""Docstrings of this project as Markdown: sections become definition lists, examples and aligned tables stay.

A griffe extension, called by mkdocstrings. A section begins with its name in the first column, followed by two blanks:

    Parameters   load : float [N], >= 0;  radius : float [m]
    Returns      contact pressure [Pa]
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from typing import Any

import griffe

SECTIONS = ("Parameters", "Attributes", "Returns", "Raises", "Validity", "Source", "Example", "Examples")
HEAD = re.compile(rf"({'|'.join(SECTIONS)})(?::?$|\s{{2,}})(.*)")
#: a name with its text in the list of parameters; several names by commas
ITEM = re.compile(r"(\*{0,2}\w[\w.]*(?:, \*{0,2}\w[\w.]*)*) ?: (.*)", re.DOTALL)
#: first line of a list of fields in the text of a class
FIELD = re.compile(r"\w+(?:, \w+)* : ")
PROMPT = ">>>"
#: columns aligned by blanks
ALIGNED = re.compile(r"\S {3,}\S")
BULLET = re.compile(r"[-*] |\d+\. ")


def escaped(text: str) -> str:
    r"""Text without Markdown, except for code in backticks.

    >>> print(escaped("a*b [m], `c*d`, (_x), u_1 < $2"))
    a\*b \[m\], `c*d`, (\_x), u_1 &lt; \$2
    """
    parts = re.split(r"(`[^`\n]+`)", text)
    for k in range(0, len(parts), 2):
        plain = parts[k].replace("&", "&amp;")
        plain = re.sub(r"[\\*>\[\]$#]|(?<!\w)_|_(?!\w)", lambda found: "\\" + found[0], plain)
        parts[k] = plain.replace("<", "&lt;")
    return "".join(parts)


def fenced(lines: list[str], language: str) -> list[str]:
    """A block of code."""
    return ["", f"```{language}", *inspect.cleandoc("\n" + "\n".join(lines)).splitlines(), "```", ""]


def blocks(lines: list[str]) -> Iterator[list[str]]:
    """Runs of lines between blank ones."""
    block: list[str] = []
    for line in [*lines, ""]:
        if line.strip():
            block.append(line)
        elif block:
            yield block
            block = []


def prose(lines: list[str]) -> list[str]:
    """Paragraphs, lists, examples and aligned tables of a docstring without sections."""
    made: list[str] = []
    for block in blocks(lines):
        first = next((k for k, line in enumerate(block) if line.lstrip().startswith(PROMPT)), None)
        if first is not None:
            made += [*prose(block[:first]), *fenced(block[first:], "pycon")]
        elif any(ALIGNED.search(line) for line in block) or all(line.startswith("    ") for line in block):
            made += fenced(block, "text")
        elif FIELD.match(block[0]):
            made += ["", *listed(block)]
        else:
            made.append("")
            for line in block:
                bullet = BULLET.match(line)
                if bullet and made[-1] and not BULLET.match(made[-1]) and not made[-1].startswith("    "):
                    made.append("")
                indented = line.startswith(" ") and any(map(BULLET.match, made))
                text = escaped(line[bullet.end() :] if bullet else line.strip())
                made.append(f"{bullet[0] if bullet else '    ' if indented else ''}{text}")
    return made


def items(text: str) -> list[tuple[str, str]]:
    """Names and texts of a list of parameters; ("", text) for a part without a name.

    >>> items("load : float [N];  a, b : axes [m]\\n  n : count")
    [('load', 'float [N]'), ('a, b', 'axes [m]'), ('n', 'count')]
    """
    found: list[tuple[str, str]] = []
    for part in re.split(r";\s{2,}|;\n\s*|\n\s*(?=\w[\w.]*(?:, \w[\w.]*)* : )", text):
        match = ITEM.fullmatch(part.strip())
        words = " ".join((match[2] if match else part).split())
        if match or not found:
            found.append((match[1] if match else "", words))
        else:
            found[-1] = (found[-1][0], f"{found[-1][1]}; {words}")
    return found


def listed(lines: list[str]) -> list[str]:
    """Names and texts as a list."""
    return [
        f"- `{key}`: {escaped(text)}" if key else f"- {escaped(text)}"
        for key, text in items("\n".join(lines))
    ]


def section(name: str, lines: list[str]) -> list[str]:
    """One section as a definition, examples as code."""
    if name.startswith("Example"):
        code = inspect.cleandoc("\n" + "\n".join(lines)).splitlines()
        prompts = any(line.startswith(PROMPT) for line in code)
        return ["", f"**{name}**", *(prose(code) if prompts else fenced(code, "python"))]
    if name in ("Parameters", "Attributes"):
        return ["", name, "", ":   " + "\n    ".join(listed(lines)), ""]
    return ["", name, "", f":   {escaped(' '.join(' '.join(lines).split()))}", ""]


def markdown(text: str) -> str:
    """The docstring as Markdown.

    >>> markdown("Sum.\\n\\nParameters   a : float [N];  b : text\\nReturns      a").splitlines()[2:]
    ['Parameters', '', ':   - `a`: float \\\\[N\\\\]', '    - `b`: text', '', 'Returns', '', ':   a']
    """
    made: list[str] = []
    current: tuple[str, list[str]] = ("", [])

    def close() -> None:
        name, lines = current
        made.extend(section(name, lines) if name else prose(lines))

    for line in inspect.cleandoc(text).splitlines():
        if head := HEAD.match(line):
            close()
            current = (head[1], [head[2]])
        elif current[0] and line and not line.startswith(" "):
            close()  # prose after a section
            current = ("", [line])
        else:
            current[1].append(line)
    close()
    return re.sub(r"\n{3,}", "\n\n", "\n".join(made)).strip()


class Sections(griffe.Extension):
    """Rewrites the docstring of every object."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Called once for each module, class, function and attribute."""
        if obj.docstring is not None:
            obj.docstring.value = markdown(obj.docstring.value)
