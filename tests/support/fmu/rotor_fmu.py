"""A rotor as a small C FMU (native/rotor.c), to couple the friction FMUs with in real importers."""

import platform
import re
import subprocess
import sys
import tempfile
import uuid
import zipfile
from pathlib import Path
from typing import NamedTuple

import fmpy
from native_model import compiler

SOURCE = Path(__file__).parent / "native" / "rotor.c"
HEADERS = Path(fmpy.__file__).parent / "c-code"
NAME = "Rotor"
RUNS_HERE = sys.platform == "linux" and platform.machine() == "x86_64"


class Entry(NamedTuple):
    causality: str
    unit: str
    start: float | None
    depends_on: tuple[int, ...] = ()


VARIABLES = {  # by name, in the order of the value references in rotor.c
    "motor_torque": Entry("input", "N.m", 0.0),
    "friction_torque": Entry("input", "N.m", 0.0),
    "speed": Entry("output", "rad/s", None),
    "angle": Entry("output", "rad", None),
    "inertia": Entry("parameter", "kg.m2", 0.01),
    "start_speed": Entry("parameter", "rad/s", 0.0),
}
REFERENCES = {name: place for place, name in enumerate(VARIABLES)}
UNITS = {
    "N.m": 'kg="1" m="2" s="-2"',
    "rad/s": 'rad="1" s="-1"',
    "rad": 'rad="1"',
    "kg.m2": 'kg="1" m="2"',
}
OUTPUTS = tuple(REFERENCES[name] for name, v in VARIABLES.items() if v.causality == "output")


def _units() -> str:
    return "".join(f'<Unit name="{name}"><BaseUnit {base}/></Unit>' for name, base in UNITS.items())


def _attributes(name: str, v: Entry) -> str:
    variability = "fixed" if v.causality == "parameter" else "continuous"
    return f'name="{name}" valueReference="{REFERENCES[name]}" causality="{v.causality}" variability="{variability}"'


def _start(v: Entry) -> str:
    return "" if v.start is None else f' start="{v.start!r}"'


def description(fmi_version: int) -> str:
    """modelDescription.xml; the speed at the start depends on start_speed, the angle on nothing."""
    token = uuid.uuid5(uuid.NAMESPACE_URL, f"rotor {fmi_version}")
    initial = {REFERENCES["speed"]: str(REFERENCES["start_speed"]), REFERENCES["angle"]: ""}
    if fmi_version == 2:
        variables = "".join(
            f'<ScalarVariable {_attributes(name, v)}><Real unit="{v.unit}"{_start(v)}/></ScalarVariable>'
            for name, v in VARIABLES.items()
        )
        outputs = "".join(f'<Unknown index="{r + 1}" dependencies=""/>' for r in OUTPUTS)
        at_start = "".join(
            f'<Unknown index="{r + 1}" dependencies="{int(known) + 1 if known else ""}"/>'
            for r, known in initial.items()
        )
        return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="{NAME}" guid="{{{token}}}">
<CoSimulation modelIdentifier="{NAME}" canHandleVariableCommunicationStepSize="true"/>
<UnitDefinitions>{_units()}</UnitDefinitions>
<ModelVariables>{variables}</ModelVariables>
<ModelStructure><Outputs>{outputs}</Outputs><InitialUnknowns>{at_start}</InitialUnknowns></ModelStructure>
</fmiModelDescription>
"""
    variables = "".join(
        f'<Float64 {_attributes(name, v)} unit="{v.unit}"{_start(v)}/>' for name, v in VARIABLES.items()
    )
    variables += f'<Float64 name="time" valueReference="{len(VARIABLES)}" causality="independent"/>'
    outputs = "".join(f'<Output valueReference="{r}" dependencies=""/>' for r in OUTPUTS)
    at_start = "".join(
        f'<InitialUnknown valueReference="{r}" dependencies="{known}"/>' for r, known in initial.items()
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="{NAME}" instantiationToken="{{{token}}}">
<CoSimulation modelIdentifier="{NAME}" canHandleVariableCommunicationStepSize="true"/>
<UnitDefinitions>{_units()}</UnitDefinitions>
<ModelVariables>{variables}</ModelVariables>
<ModelStructure>{outputs}{at_start}</ModelStructure>
</fmiModelDescription>
"""


def stubs(fmi_version: int) -> str:
    """C source of the functions of the standard that rotor.c does not have: each returns an error."""
    header = (HEADERS / f"fmi{fmi_version}Functions.h").read_text()
    names = re.findall(rf"^\s*FMI{fmi_version}_Export\s+\w+TYPE\s+(\w+);", header, re.MULTILINE)
    code = SOURCE.read_text()
    missing = [name for name in names if not re.search(rf"\b{name}\(|\({name},", code)]
    lines = [f'__attribute__((visibility("default"))) int {name}(void) {{ return 3; }}' for name in missing]
    return "\n".join([*lines, ""])


def build_rotor(folder: Path, fmi_version: int = 2) -> Path:
    """Rotor_fmi2.fmu or Rotor_fmi3.fmu for this machine, x86_64 Linux.

    Raises       subprocess.CalledProcessError: it does not compile
    """
    fmu = folder / f"{NAME}_fmi{fmi_version}.fmu"
    binaries = {2: "linux64", 3: "x86_64-linux"}[fmi_version]
    with tempfile.TemporaryDirectory() as scratch:
        library = Path(scratch) / f"{NAME}.so"
        others = Path(scratch) / "stubs.c"
        others.write_text(stubs(fmi_version))
        subprocess.run(
            [*compiler(), "-std=c99", "-O2", "-Wall", "-Wextra", "-Wno-unused-parameter", "-Werror",
             "-ffp-contract=off", "-shared", "-fPIC", "-fvisibility=hidden", f"-DFMI_VERSION={fmi_version}",
             "-isystem", str(HEADERS), str(SOURCE), str(others), "-o", str(library)],
            check=True, capture_output=True, timeout=300,
        )  # fmt: skip
        with zipfile.ZipFile(fmu, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("modelDescription.xml", description(fmi_version))
            archive.write(library, f"binaries/{binaries}/{library.name}")
    return fmu
