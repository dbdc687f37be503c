"""C sources of the native FMUs: the hand-written runtime, the table of variables as C, the FMI headers of fmpy.

The runtime is in folders (native/core, models, runtime, fmi). In an FMU its files are in sources/ without folders, as
importers compile them without include paths. Two files are compiled: all.c, which includes the others, so that their
names are internal (INTERNAL in constants.h), and that with the laws in dual numbers. The sources are the same for all
screws. The FMI headers are needed to compile but, as the standard requires, are not in the FMU (is_fmi_header). For
editors, `python -m ballscrew_fmu.native_fmu.sources FOLDER` writes all of it with a compile_commands.json.

External names are those of the FMI functions, which begin with FMI2_FUNCTION_PREFIX or FMI3_FUNCTION_PREFIX, if it is
defined, and of the functions in dual numbers, which begin with that too, else with the name of the model: several FMUs
can be linked into one program.
"""

import hashlib
import importlib.resources
import json
import sys
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import fmpy

from ballscrew_fmu.archive import BuildError
from ballscrew_fmu.models import FRICTION, MODELS, FmuModel
from ballscrew_fmu.native_fmu.resource_files import (
    MAP_FILE,
    MAP_MAGIC,
    ORIGIN_SIZE,
    SCREW_FILE,
    SCREW_MAGIC,
    checksum,
    map_numbers,
)
from ballscrew_fmu.variables.friction import FIRST_REFERENCE, Variable
from ballscrew_tehl.runtime import constants
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import (
    AXES,
    DEFAULTS,
    FORCE_CURVES,
    SURFACES,
    TORQUE_SURFACES,
    Law,
    map_hash,
)

FMI_HEADERS = {
    2: ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
    3: ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"),
}
_HERE = importlib.resources.files("ballscrew_fmu") / "native"
ALL = "all.c"
_SHARED = ("core", "models", "runtime", "fmi")  # folders; in addition one folder of models

_TABLE = """\
/* GENERATED from the table of variables: do not edit. */
#ifndef BALLSCREW_VARIABLES_H
#define BALLSCREW_VARIABLES_H

#include <stdbool.h>

#include "constants.h"

#define TABLE_HASH "{table_hash}" /* of this file and constants.h: that of a screw must be the same */

#define FIRST_REFERENCE {first_reference}U /* value reference of variable 0 of the table below */

enum Variables {{
{references},
    VARIABLE_COUNT
}};

/* start values in the file of a screw: of the variables, then numbers of the model */
#define START_COUNT (VARIABLE_COUNT + {numbers})

#define TIME_REFERENCE (FIRST_REFERENCE + VARIABLE_COUNT) /* FMI 3 only: the independent variable */
#define INPUT_FIRST {first}
#define INPUT_COUNT {inputs}

enum Causality {{
    CAUSALITY_INPUT,
    CAUSALITY_OUTPUT,
    CAUSALITY_PARAMETER,
    CAUSALITY_STATE,
    CAUSALITY_RATE,
    CAUSALITY_INDICATOR
}};

typedef struct {{
    const char *name;
    enum Causality causality;
    bool films;     /* an output for which the map of the films is evaluated */
    bool boolean;
    bool fixed;     /* a parameter that cannot be set after the initialization */
    bool shown;     /* a state that is an output, too */
    double lowest;  /* lower bound of inputs, parameters and the state */
    double nominal; /* 1 for booleans */
}} Variable;

static const Variable model_variables[VARIABLE_COUNT] = {{
{rows}
}};

#endif
"""
_CONSTANTS = """\
/* GENERATED from ballscrew_tehl/runtime/constants.py, packed.py and native_fmu/resource_files.py: do not edit. */
#ifndef BALLSCREW_CONSTANTS_H
#define BALLSCREW_CONSTANTS_H

#define MODEL_NAME "{name}"

/* of functions that only all.c has and uses; extern where a file is compiled alone, and in tests */
#ifndef INTERNAL
#define INTERNAL static inline
#endif
/* External names begin with this prefix, other in each FMU of a program. */
#if defined(FMI2_FUNCTION_PREFIX)
#define BALLSCREW_PREFIX FMI2_FUNCTION_PREFIX
#elif defined(FMI3_FUNCTION_PREFIX)
#define BALLSCREW_PREFIX FMI3_FUNCTION_PREFIX
#else
#define BALLSCREW_PREFIX {name}_
#endif
#define BALLSCREW_JOINED(prefix, name) prefix##name
#define BALLSCREW_NAMED(prefix, name) BALLSCREW_JOINED(prefix, name)

{constants}

#define MAP_FILE "{map_file}"
#define MAP_MAGIC "{map_magic}"
#define MAP_AXES {axes}
#define SCREW_FILE "{screw_file}"
#define SCREW_MAGIC "{screw_magic}"
#define ORIGIN_SIZE {origin_size}
enum {{ {laws}, LAWS }};
#define LAW_NAMES {{{law_names}}}

/* columns of the surfaces: those needed for a torque by each law, then the others; raceway of the screw before that of
   the nut */
{torque}
#define TORQUE_COLUMNS {torques}
enum {{ {films}, FILM_COLUMNS }};
enum {{ {curves}, CURVE_COLUMNS }};

enum {{ {defaults}, MAP_DEFAULTS }};

#endif
"""
_EMBEDDED = """\
/* GENERATED from the map and the screw: do not edit. */
#define EMBEDDED_RESOURCES
#include "map.h"

static const MapIdentity map_identity = {{{size}U, UINT64_C({checksum}), "{content_hash}"}};

static const double map_numbers[] = {{
{numbers}
}};

static const unsigned char screw_file[] = {{
{screw}
}};
"""
_ALL = """\
/* GENERATED: all of the FMU in one unit, except the laws in dual numbers. */
#include "system.h"
{includes}
"""
_ENTRY_TABLE = """\
/* GENERATED from the table of variables: do not edit. */
#define FIRST_REFERENCE {first}U
#define TOO_LARGE {too_large!r}

static const Variable variables[] = {{
{rows}
}};
"""


class Embedded(NamedTuple):
    """What is compiled into an FMU that opens no file."""

    nut_map: NutMap
    screw: bytes  # file of the screw


def native_sources(
    header: Mapping[str, Any],
    fmi_versions: Sequence[int] = (2, 3),
    model: FmuModel = FRICTION,
    embedded: Embedded | None = None,
) -> dict[str, bytes]:
    """All C sources and headers of a model by file name: shared files and those of the model.

    header: of any map: the sources are the same for all; embedded: what is compiled in, None: it is read from the
    resources; BuildError: a file of fmpy or of this package is missing.
    """
    others = tuple(f"fmi{version}." for version in (2, 3) if version not in fmi_versions)
    folders = [_HERE / name for name in _SHARED] + [_HERE / "models" / model.layer]
    files = {
        entry.name: entry.read_bytes()
        for folder in folders
        for entry in sorted(folder.iterdir(), key=lambda entry: entry.name)
        if entry.name.endswith((".c", ".h")) and not entry.name.startswith(others)
    }
    for name in model.borrowed:
        files[Path(name).name] = (_HERE / "models" / name).read_bytes()
    if missing := [f"fmi{version}.c" for version in fmi_versions if f"fmi{version}.c" not in files]:
        raise BuildError(f"{missing[0]} not found in {_HERE}; install the project again")
    parts = sorted(name for name in files if name.endswith(".c") and name != model.dual)
    if embedded is not None:
        files["embedded.h"] = _embedded_source(embedded).encode()
        parts.insert(0, "embedded.h")
    includes = "\n".join(f'#include "{name}"' for name in parts)
    for version in fmi_versions:
        files |= fmi_headers(version)
    generated = {
        "variables.h": _variables(header, model, table_hash(header, model)),
        "constants.h": _constants(model),
        ALL: _ALL.format(includes=includes),
    }
    return files | {name: text.encode() for name, text in generated.items()}


def units_of(model: FmuModel) -> tuple[str, str]:
    """The sources of a model that are compiled."""
    return ALL, model.dual


def page_sources(header: Mapping[str, Any]) -> dict[str, bytes]:
    """Sources of the live page: page.c, and those of the friction, of which it includes some."""
    return {**native_sources(header, ()), "page.c": (_HERE / "page" / "page.c").read_bytes()}


def entry_sources(variables: Sequence[Variable]) -> dict[str, bytes]:
    """Sources of the entry library of an FMU for Python hosts, with types of all references, and when they are set."""

    def row(v: Variable) -> str:
        settable = "NEVER" if v.causality == "output" else "INITIALLY" if v.fixed else "ALWAYS"
        return f'    {{"{v.name}", {str(v.unit is None).lower()}, {settable}}},'

    table = _ENTRY_TABLE.format(
        first=FIRST_REFERENCE, too_large=constants.TOO_LARGE, rows="\n".join(map(row, variables))
    )
    return {
        "entry_table.h": table.encode(),
        **{name: (_HERE / "python_host" / name).read_bytes() for name in ("entry.c", "platform.h")},
        "text.h": (_HERE / "runtime" / "text.h").read_bytes(),
        **fmi_headers(2),
    }


def _embedded_source(embedded: Embedded) -> str:
    """embedded.h: the numbers of the map in hexadecimal, so that none is rounded, and the file of the screw."""
    numbers = map_numbers(embedded.nut_map)
    rows = (", ".join(float.hex(x) for x in numbers[n : n + 4].tolist()) for n in range(0, numbers.size, 4))
    screw = (", ".join(map(str, embedded.screw[n : n + 24])) for n in range(0, len(embedded.screw), 24))
    return _EMBEDDED.format(
        size=numbers.nbytes,
        checksum=f"0x{checksum(numbers.astype('<f8').tobytes()):016x}",
        content_hash=map_hash(embedded.nut_map.header),
        numbers=",\n".join(f"    {row}" for row in rows),
        screw=",\n".join(f"    {row}" for row in screw),
    )


def fmi_headers(fmi_version: int) -> dict[str, bytes]:
    """The FMI headers of fmpy by name.

    BuildError: one is missing.
    """
    headers = Path(fmpy.__file__).parent / "c-code"
    try:
        return {name: (headers / name).read_bytes() for name in FMI_HEADERS[fmi_version]}
    except OSError as error:
        raise BuildError(f"{error.filename} not found; install fmpy >= 0.3.32") from error


def is_fmi_header(name: str) -> bool:
    """Whether a source is an FMI header. Importers that compile sources use their own."""
    return any(name in names for names in FMI_HEADERS.values())


def table_hash(header: Mapping[str, Any], model: FmuModel = FRICTION) -> str:
    """Hash of the table of variables and of the constants, in a library and in the files of the screws for it."""
    return hashlib.sha256((_variables(header, model, "") + _constants(model)).encode()).hexdigest()


def _variables(header: Mapping[str, Any], model: FmuModel, hash_of_table: str) -> str:
    table = model.variables(header)
    inputs = [v for v in table if v.causality == "input"]
    states = {v.derivative_of for v in table if v.derivative_of}
    return _TABLE.format(
        table_hash=hash_of_table,
        first_reference=FIRST_REFERENCE,
        references=",\n".join(f"    {v.name.upper()}" for v in table),
        numbers=model.number_count,
        first=inputs[0].name.upper(),
        inputs=len(inputs),
        rows="\n".join(_row(v, states) for v in table),
    )


def _constants(model: FmuModel) -> str:
    named = {name: value for name, value in vars(constants).items() if name.isupper()}
    films = SURFACES[Law.THREE_PARAMETER][TORQUE_SURFACES:]  # the same in each law
    return _CONSTANTS.format(
        name=model.native_name,
        law_names=", ".join(f'"{law}"' for law in SURFACES),
        constants="\n".join(f"#define {name} {value!r}" for name, value in named.items()),
        map_file=MAP_FILE,
        map_magic=MAP_MAGIC.decode(),
        screw_file=SCREW_FILE,
        screw_magic=SCREW_MAGIC.decode(),
        origin_size=ORIGIN_SIZE,
        axes=len(AXES),
        defaults=", ".join(f"{name.upper()}_DEFAULT" for name in DEFAULTS),
        laws=", ".join(f"{law.upper()}_LAW" for law in SURFACES),
        torque="\n".join(
            f"enum {{ {', '.join(names[:TORQUE_SURFACES]).upper()} }};" for names in SURFACES.values()
        ),
        torques=TORQUE_SURFACES,
        films=", ".join(films).upper(),
        curves=", ".join(f"{name.upper()}_CURVE" for name in FORCE_CURVES),
    )


def _row(v: Variable, states: Collection[str]) -> str:
    if v.causality == "local" or v.name in states:
        kind = "RATE" if v.derivative_of else "INDICATOR" if v.indicates else "STATE"
    else:
        kind = v.causality.upper()
    lowest = (v.minimum or 0.0) if v.causality == "parameter" else -constants.TOO_LARGE
    numbers = f"{float(lowest)!r}, {float(v.nominal or 1.0)!r}"
    flags = ", ".join(
        str(flag).lower()
        for flag in (v.needs == "films", v.unit is None, v.fixed, kind == "STATE" and v.causality == "output")
    )
    return f'    {{"{v.name}", CAUSALITY_{kind}, {flags}, {numbers}}},'


def write_sources(folder: Path) -> None:
    """All sources of each model in a folder of its own, and how each C file compiles alone."""
    from ballscrew_fmu.native_fmu.compile import WARNINGS  # which imports this module
    from ballscrew_tehl.nut_map.load import load_map

    options = ("cc", "-std=c99", *WARNINGS, "-DINTERNAL=extern", "-isystem", "fmi", "-c")
    commands, header = [], load_map(None).header
    for model in MODELS:
        place = folder.absolute() / model.layer
        (place / "fmi").mkdir(parents=True, exist_ok=True)
        for name, content in native_sources(header, model=model).items():
            (place / ("fmi" if is_fmi_header(name) else ".") / name).write_bytes(content)
            if name.endswith(".c"):
                commands.append({"directory": str(place), "file": name, "arguments": [*options, name]})
    (folder / "compile_commands.json").write_text(json.dumps(commands, indent=1))


if __name__ == "__main__":
    write_sources(Path(sys.argv[1]))
