"""A C program around the external functions of the Modelica package, made from their declarations in package.mo.

It replaces a Modelica tool: it maps the types by section 12.9 of the Modelica specification, declares the functions
in addition to their header, so that the compiler compares both, and calls them.
"""

import re
import subprocess
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from native_model import compiler

from ballscrew_fmu.native_fmu.compile import WARNINGS

TYPES = {
    "String": "const char *",
    "Boolean": "int ",
    "Integer": "int ",
    "FrictionMap": "void *",
}  # else double


class External(NamedTuple):
    """A function of package.mo."""

    name: str
    inputs: tuple[tuple[str, str], ...]  # Modelica type and name
    outputs: tuple[tuple[str, str], ...]
    symbol: str
    returned: str | None  # output that the C function returns
    arguments: tuple[str, ...]

    def prototype(self) -> str:
        types = {name: TYPES.get(type_, "double ") for type_, name in (*self.inputs, *self.outputs)}
        outputs = {name for _, name in self.outputs}
        listed = [f"{types[name]}{'*' if name in outputs else ''}{name}" for name in self.arguments]
        result = types[self.returned] if self.returned else "void "
        return f"{result}{self.symbol}({', '.join(listed)});"


def externals(text: str) -> list[External]:
    """All external functions of a Modelica source."""
    found = []
    for name, body in re.findall(r"function (\w+)(.*?)end \1;", text, re.DOTALL):
        inputs, outputs = (
            tuple(re.findall(rf"^\s*{kind} (?:\w+\.)*(\w+) (\w+)", body, re.MULTILINE))
            for kind in ("input", "output")
        )
        call = re.search(r'external "C" (?:(\w+) = )?(\w+)\(([^)]*)\)', body)
        assert call, f"{name} is not external"
        arguments = tuple(argument.strip() for argument in call[3].split(","))
        found.append(External(name, inputs, outputs, call[2], call[1], arguments))
    return found


def source(functions: Iterable[External]) -> str:
    """The program: opens the map argv[1]; reads lines of a function and its numbers, prints its results."""
    functions = list(functions)
    lines = ['#include "BallScrewFriction.h"', "#include <stdarg.h>", "#include <stdio.h>", "#include <stdlib.h>",
             "#include <string.h>", "void ModelicaFormatError(const char *format, ...);"]  # fmt: skip
    lines += [f.prototype() for f in functions]
    lines += [
        "void ModelicaFormatError(const char *format, ...) { va_list a; va_start(a, format);",
        "  (void)vfprintf(stderr, format, a); va_end(a); exit(3); }",
        "int main(int argc, char **argv) { char name[64]; double in[16]; void *map;",
        "  if (argc != 2) return 1;",
        "  map = ballScrewMap_open(argv[1]);",
        '  while (scanf("%63s", name) == 1) {',
    ]
    for f in functions:
        if f.name not in ("constructor", "destructor"):
            lines.append(_case(f))
    lines += ['    { fprintf(stderr, "%s?", name); return 1; } }', "  ballScrewMap_close(map); return 0; }"]
    return "\n".join([*lines, ""])


def _case(f: External) -> str:
    numbers = [name for type_, name in f.inputs if type_ != "FrictionMap"]
    outputs = {name for _, name in f.outputs}
    places = {f.inputs[0][1]: "map", **{name: f"in[{n}]" for n, name in enumerate(numbers)}}
    places |= {name: f"&out_{name}" for name in outputs}
    passed = [places[name] for name in f.arguments]
    call = f"{f.symbol}({', '.join(passed)})"
    declared = "".join(f"double out_{name} = 0.0; " for name in sorted(outputs))
    assign = f"out_{f.returned} = {call};" if f.returned else f"{call};"
    printed = "".join(f'printf("%.17g ", out_{name}); ' for _, name in f.outputs)
    scan = f'for (int i = 0; i < {len(numbers)}; ++i) if (scanf("%lf", &in[i]) != 1) return 1; '
    return (
        f'    if (strcmp(name, "{f.name}") == 0) {{ {declared}{scan}{assign} {printed}printf("\\n"); }} else'
    )


def build(folder: Path, package: Path) -> Path:
    """The program, with the library of the package.

    Raises       subprocess.CalledProcessError: header and package.mo do not agree, or it does not link
    """
    folder.mkdir(exist_ok=True)
    (folder / "host.c").write_text(source(externals((package / "package.mo").read_text())))
    resources = package / "Resources"
    library = resources / "Library" / "linux64" / "libBallScrewFriction.a"
    subprocess.run(
        [*compiler(), "-std=c99", *WARNINGS, "-O2", "-I", str(resources / "Include"), "-o", "host", "host.c",
         str(library), "-lm"],
        cwd=folder, check=True, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    return folder / "host"


def call(program: Path, map_file: Path, rows: Sequence[tuple]) -> list[tuple[float, ...]]:
    """Results of calls, each a function and its numbers.

    Raises       RuntimeError: message of ModelicaFormatError
    """
    text = "\n".join(" ".join([row[0], *(repr(float(x)) for x in row[1:])]) for row in rows)
    run = subprocess.run(
        [str(program), str(map_file)], input=text, capture_output=True, text=True, timeout=120
    )
    if run.returncode:
        raise RuntimeError(f"exit {run.returncode}: {run.stderr.strip()}")
    return [tuple(map(float, line.split())) for line in run.stdout.splitlines()]
