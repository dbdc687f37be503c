"""C sources of the native FMUs: the hand-written runtime, the table of variables as C, the FMI headers of fmpy.

The runtime is in folders (native/core, models, runtime, fmi). In an FMU its files are in sources/ without folders, as
importers compile them without include paths. constants.h is generated from the constants of the Python law. The FMI
headers are needed to compile but, as the standard requires, are not in the FMU (is_fmi_header).

All external names of the runtime begin with the model and the token of the FMU (macros in constants.h), so that several
FMUs can be linked into one program; the names of the FMI functions begin with FMI2_FUNCTION_PREFIX or
FMI3_FUNCTION_PREFIX, if it is defined.
"""

import hashlib
import importlib.resources
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import fmpy

from ballscrew_fmu.models import FRICTION, FmuModel
from ballscrew_fmu.native_fmu.map_file import MAGIC, MAP_FILE, checksum, map_numbers
from ballscrew_fmu.variables.friction import FIRST_REFERENCE, Variable, origin_text
from ballscrew_tehl.runtime import constants
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import (
    AXES,
    DEFAULTS,
    FILM_SHEAR,
    FORCE_CURVES,
    SURFACES,
    TORQUE_SURFACES,
    map_hash,
)

NATIVE_NAME = FRICTION.native_name
FMI_HEADERS = {
    2: ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
    3: ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"),
}
_HERE = importlib.resources.files("ballscrew_fmu") / "native"
_SHARED = ("core", "models", "runtime", "fmi")  # folders; in addition one folder of models

_HEADER = """\
/* GENERATED from the table of variables: do not edit. */
#ifndef BALLSCREW_VARIABLES_H
#define BALLSCREW_VARIABLES_H

#include <stdbool.h>

#include "constants.h"

#define MODEL_NAME "{name}"
#define MODEL_STATE "{layer}_state.h" /* the struct Model */
#define MODEL_TOKEN "{token}" /* guid of FMI 2, instantiationToken of FMI 3 */
#define MODEL_MAP "{content_hash}" /* hash of the map that the table of variables is from */
#define MODEL_LAW {law}_LAW /* of its friction: required of a map in the resources */
#define MODEL_ORIGIN "{origin}" /* of friction numbers that were measured on another screw; logged at instantiation */

#define FIRST_REFERENCE {first_reference}U /* value reference of variable 0 of the table below */

enum Variables {{
{references},
    VARIABLE_COUNT
}};

#define TIME_REFERENCE (FIRST_REFERENCE + VARIABLE_COUNT) /* FMI 3 only: the independent variable */
#define INPUT_FIRST {first}
#define INPUT_COUNT {inputs}
#define MODEL_PARTS {parts} /* 1: event mode and intermediate updates of FMI 3 co-simulation */

enum Causality {{
    CAUSALITY_INPUT,
    CAUSALITY_OUTPUT,
    CAUSALITY_PARAMETER,
    CAUSALITY_STATE,
    CAUSALITY_RATE,
    CAUSALITY_INDICATOR
}};

/* evaluation of the map for an output */
enum Needs {{ NEEDS_TORQUE, NEEDS_FILMS }};

typedef struct {{
    const char *name;
    enum Causality causality;
    enum Needs needs;
    bool boolean;
    bool fixed;     /* a parameter that cannot be set after the initialization */
    bool shown;     /* a state that is an output, too */
    double start;   /* of inputs, parameters and the state, else 0 */
    double lowest;  /* lower bound of inputs, parameters and the state */
    double nominal; /* 1 for booleans */
}} Variable;

extern const Variable model_variables[VARIABLE_COUNT];

#endif
"""
_TABLE = """\
/* GENERATED from the table of variables: do not edit. */
#include "variables.h"

const Variable model_variables[VARIABLE_COUNT] = {{
{rows}
}};
"""
_CONSTANTS = """\
/* GENERATED from ballscrew_tehl/runtime/constants.py, packed.py and native_fmu/map_file.py: do not edit. */
#ifndef BALLSCREW_CONSTANTS_H
#define BALLSCREW_CONSTANTS_H

/* External names begin with this prefix, other in each FMU. */
#ifndef BALLSCREW_PREFIX
#define BALLSCREW_PREFIX {prefix}
#endif
#define BALLSCREW_JOINED(prefix, name) prefix##name
#define BALLSCREW_NAMED(prefix, name) BALLSCREW_JOINED(prefix, name)
{names}

{constants}

#define MAP_FILE "{map_file}"
#define MAP_MAGIC "{magic}"
#define MAP_AXES {axes}
#define MAP_COMPILED {compiled} /* 1: the map is in nut_map.c and no file is opened */
{number_count}
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
_MAP = """\
/* GENERATED from the map: do not edit. */
#include "map.h"

const MapIdentity map_identity = {{{size}U, UINT64_C({checksum}), "{content_hash}"}};

const double map_numbers[MAP_NUMBER_COUNT] = {{
{numbers}
}};
"""
# declarations of external functions and tables in the headers, which begin a line
_FUNCTION = re.compile(r"^(?!static|typedef|return|#)[A-Za-z_][\w \t]*[ *](\w+)\(", re.MULTILINE)
_TABLE_NAME = re.compile(r"^extern const [^;()]*?(\w+)(?:\[[^;]*\])?;", re.MULTILINE)


class SourceError(RuntimeError):
    """A source of the native FMU is missing."""


def native_sources(
    header: Mapping[str, Any],
    fmi_version: int,
    token: str,
    model: FmuModel = FRICTION,
    compiled_map: NutMap | None = None,
) -> dict[str, bytes]:
    """All C sources and headers of one native FMU by file name: shared files and those of the model.

    Parameters   header : of the map (start values, content hash);  fmi_version : 2 or 3
                 token : guid or instantiationToken that the binary expects
                 compiled_map : the map, to be compiled in; None: it is read from the resources
    Raises       SourceError: a file of fmpy or of this package is missing
    """
    other = "fmi3" if fmi_version == 2 else "fmi2"
    folders = [_HERE / name for name in _SHARED] + [_HERE / "models" / model.layer]
    files = {
        entry.name: entry.read_bytes()
        for folder in folders
        for entry in sorted(folder.iterdir(), key=lambda entry: entry.name)
        if entry.name.endswith((".c", ".h")) and not entry.name.startswith(other)
    }
    for name in model.borrowed:
        files[Path(name).name] = (_HERE / "models" / name).read_bytes()
    if f"fmi{fmi_version}.c" not in files:
        raise SourceError(f"fmi{fmi_version}.c not found in {_HERE}; install the project again")
    files |= fmi_headers(fmi_version)
    generated = variable_sources(header, token, model)
    if compiled_map is not None:
        generated["nut_map.c"] = _map_source(compiled_map)
    count = 0 if compiled_map is None else map_numbers(compiled_map).size
    written = {name: text.decode() for name, text in files.items() if not is_fmi_header(name)} | generated
    generated["constants.h"] = _constants(prefix(token, model), external_names(written), count)
    return files | {name: text.encode() for name, text in generated.items()}


def external_names(sources: Mapping[str, str]) -> list[str]:
    """Names of all functions and tables that headers of the runtime declare: those with external linkage."""
    names = set()
    for name, text in sources.items():
        if name.endswith(".h"):
            plain = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
            names |= {*_FUNCTION.findall(plain), *_TABLE_NAME.findall(plain)}
    return sorted(names)


def prefix(token: str, model: FmuModel = FRICTION) -> str:
    """Prefix of all external names of an FMU: model and token."""
    return f"{model.native_name}_{hashlib.sha256(token.encode()).hexdigest()[:12]}_"


def _map_source(nut_map: NutMap) -> str:
    """nut_map.c: the numbers of the map file in hexadecimal, so that none is rounded."""
    numbers = map_numbers(nut_map)
    rows = (", ".join(float.hex(x) for x in numbers[n : n + 4].tolist()) for n in range(0, numbers.size, 4))
    return _MAP.format(
        size=numbers.nbytes,
        checksum=f"0x{checksum(numbers.astype('<f8').tobytes()):016x}",
        content_hash=map_hash(nut_map.header),
        numbers=",\n".join(f"    {row}" for row in rows),
    )


def fmi_headers(fmi_version: int) -> dict[str, bytes]:
    """The FMI headers of fmpy by name.

    Raises       SourceError: one is missing
    """
    headers = Path(fmpy.__file__).parent / "c-code"
    try:
        return {name: (headers / name).read_bytes() for name in FMI_HEADERS[fmi_version]}
    except OSError as error:
        raise SourceError(f"{error.filename} not found; install fmpy >= 0.3.32") from error


def is_fmi_header(name: str) -> bool:
    """Whether a source is an FMI header. Importers that compile sources use their own."""
    return any(name in names for names in FMI_HEADERS.values())


def variable_sources(header: Mapping[str, Any], token: str, model: FmuModel = FRICTION) -> dict[str, str]:
    """variables.h and variables.c: the table of variables as C.

    Raises       ValueError: the token has characters that are not allowed
    """
    if not re.fullmatch(r"[{}\w.-]*", token):
        raise ValueError(f"token = {token!r}; needs letters, digits, braces, dots and dashes only")
    table = model.native_variables(header)
    inputs = [v for v in table if v.causality == "input"]
    states = {v.derivative_of for v in table if v.derivative_of}
    return {
        "variables.h": _HEADER.format(
            name=model.native_name,
            layer=model.layer,
            token=token,
            content_hash=map_hash(header),
            law=str(header["law"]).upper(),
            first_reference=FIRST_REFERENCE,
            origin=_c_text(origin_text(header)),
            references=",\n".join(f"    {v.name.upper()}" for v in table),
            first=inputs[0].name.upper(),
            inputs=len(inputs),
            parts=int(model.parts),
        ),
        "variables.c": _TABLE.format(rows="\n".join(_row(v, states) for v in table)),
    }


def _c_text(text: str) -> str:
    """Content of a C string literal in UTF-8: quotes, backslashes and what is not ASCII as octal numbers."""
    plain = (
        chr(byte) if 32 <= byte < 127 and chr(byte) not in '"\\?' else f"\\{byte:03o}"
        for byte in text.encode()
    )
    return "".join(plain)


def _constants(prefix: str, names: Sequence[str], numbers: int) -> str:
    """constants.h. numbers : of the map that is compiled in, 0: none"""
    named = {name: value for name, value in vars(constants).items() if name.isupper()}
    films = SURFACES[FILM_SHEAR][TORQUE_SURFACES:]  # the same in each law
    return _CONSTANTS.format(
        prefix=prefix,
        names="\n".join(f"#define {name} BALLSCREW_NAMED(BALLSCREW_PREFIX, {name})" for name in names),
        compiled=int(numbers > 0),
        number_count=f"#define MAP_NUMBER_COUNT {numbers}\n" if numbers else "",
        law_names=", ".join(f'"{law}"' for law in SURFACES),
        constants="\n".join(f"#define {name} {value!r}" for name, value in named.items()),
        map_file=MAP_FILE,
        magic=MAGIC.decode(),
        axes=len(AXES),
        defaults=", ".join(f"{name.upper()}_DEFAULT" for name in DEFAULTS),
        laws=", ".join(f"{law.upper()}_LAW" for law in SURFACES),
        torque="\n".join(_enumeration(names[:TORQUE_SURFACES]) for names in SURFACES.values()),
        torques=TORQUE_SURFACES,
        films=", ".join(name.upper() for name in films),
        curves=", ".join(f"{name.upper()}_CURVE" for name in FORCE_CURVES),
    )


def _enumeration(names: Sequence[str]) -> str:
    return f"enum {{ {', '.join(name.upper() for name in names)} }};"


def _row(v: Variable, states: Collection[str]) -> str:
    if v.causality == "local" or v.name in states:
        kind = "RATE" if v.derivative_of else "INDICATOR" if v.indicates else "STATE"
    else:
        kind = v.causality.upper()
    lowest = (v.minimum or 0.0) if v.causality == "parameter" else -constants.TOO_LARGE
    numbers = ", ".join(repr(float(x)) for x in (v.start or 0.0, lowest, v.nominal or 1.0))
    flags = ", ".join(
        str(flag).lower() for flag in (v.unit is None, v.fixed, kind == "STATE" and v.causality == "output")
    )
    return f'    {{"{v.name}", CAUSALITY_{kind}, NEEDS_{v.needs.upper()}, {flags}, {numbers}}},'
