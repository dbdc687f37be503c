"""The external functions of the Modelica package by ctypes, as package.mo declares them.

This replaces a Modelica tool: types are mapped by section 12.9 of the Modelica specification, and the functions are
declared in addition to their header, so that the compiler compares both.
"""

import ctypes
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from native_model import compiler

from ballscrew_fmu.native_fmu.compile import WARNINGS

TYPES = {"String": ("const char *", ctypes.c_char_p), "FrictionMap": ("void *", ctypes.c_void_p)}
NUMBER = ("double ", ctypes.c_double)
HOST = """#include "BallScrewFriction.h"
#include <stdarg.h>
#include <stdio.h>
extern char message[1000];
char message[1000];
void ModelicaFormatError(const char *format, ...);
void ModelicaFormatError(const char *format, ...)
{ va_list a; va_start(a, format); (void)vsnprintf(message, sizeof message, format, a); va_end(a); }
"""


class External(NamedTuple):
    """A function of package.mo."""

    inputs: dict[str, str]  # Modelica types by name
    outputs: dict[str, str]
    returned: str  # output that the C function returns, or nothing
    symbol: str
    arguments: list[str]

    def type_of(self, name: str) -> tuple[str, type]:
        return TYPES.get((self.inputs | self.outputs)[name], NUMBER)

    def prototype(self) -> str:
        listed = [f"{self.type_of(n)[0]}{'*' if n in self.outputs else ''}{n}" for n in self.arguments]
        result = self.type_of(self.returned)[0] if self.returned else "void "
        return f"{result}{self.symbol}({', '.join(listed)});"


def externals(text: str) -> dict[str, External]:
    """All external functions of a Modelica source by name."""
    found = {}
    for name, body in re.findall(r"function (\w+)(.*?)end \1;", text, re.DOTALL):
        inputs, outputs = (
            {n: t for t, n in re.findall(rf"^\s*{kind} (?:\w+\.)*(\w+) (\w+)", body, re.MULTILINE)}
            for kind in ("input", "output")
        )
        returned, symbol, given = re.search(r'external "C" (?:(\w+) = )?(\w+)\(([^)]*)\)', body).groups("")
        found[name] = External(inputs, outputs, returned, symbol, re.findall(r"\w+", given))
    return found


def host(folder: Path, package: Path) -> Callable[..., tuple]:
    """Function (name, *inputs) -> outputs, with the library of the package.

    Raises       subprocess.CalledProcessError: header and package.mo do not agree, or it does not link;
                 RuntimeError (function): message of ModelicaFormatError
    """
    functions = externals((package / "package.mo").read_text())
    (folder / "host.c").write_text(HOST + "\n".join(f.prototype() for f in functions.values()) + "\n")
    resources = package / "Resources"
    archive = resources / "Library" / "linux64" / "libBallScrewFriction.a"
    subprocess.run(
        [*compiler(), "-std=c99", *WARNINGS, "-shared", "-fPIC", "-I", str(resources / "Include"), "-o", "host.so",
         "host.c", "-Wl,--whole-archive", str(archive), "-Wl,--no-whole-archive", "-lm"],
        cwd=folder, check=True, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    library = ctypes.CDLL(str(folder / "host.so"))
    message = (ctypes.c_char * 1000).in_dll(library, "message")

    def call(name, *inputs):
        external, message.value = functions[name], b""
        values = dict(zip(external.inputs, inputs, strict=True))
        outputs = {n: ctypes.c_double() for n in external.outputs if n != external.returned}
        function = library[external.symbol]
        function.restype = external.type_of(external.returned)[1] if external.returned else None
        result = function(
            *(
                ctypes.byref(outputs[n]) if n in outputs else external.type_of(n)[1](values[n])
                for n in external.arguments
            )
        )
        if message.value:
            raise RuntimeError(message.value.decode())
        return (result,) if external.returned else tuple(output.value for output in outputs.values())

    return call
