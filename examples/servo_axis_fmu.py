"""Packs servo_axis_slave.py as ServoAxis.fmu: FMI 2.0 co-simulation for Python hosts, same input, same bytes.

pythonfmu builds it; units, dependencies and initial unknowns, which pythonfmu 0.7 omits, are added. All
modules of the project get names with the hash of their content, since the pythonfmu FMUs of a process share
one interpreter.
"""

import hashlib
import json
import subprocess
import sys
import tempfile
import uuid
import zipfile
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import servo_axis_slave as slave
import servo_drive
from servo_drive import Axis

from ballscrew_fmu.archive import NAMESPACE, write_fmu
from ballscrew_fmu.python_fmu import process_end
from ballscrew_fmu.variables.friction import UNITS

NAME = "ServoAxis"  # of the class in the module of the slave


def build_axis_fmu(
    path: Path, axis: Axis, radius: float, feed: float, cutting_force: float, module: ModuleType = slave
) -> Path:
    """The FMU of an axis on a circle; the values of the circle [m, m/s, N] are start values of its parameters.

    module: of the slave, with its tables INPUTS, OUTPUTS, PARAMETERS and communication_step(axis).
    subprocess.CalledProcessError: pythonfmu does not build it; OSError: cannot be written.
    """
    circle = {"radius": radius, "feed": feed, "cutting_force": cutting_force}
    values = json.dumps({**asdict(axis), **circle}, indent=1)
    files = _renamed({**_sources(module), module.AXIS_FILE: values})
    with tempfile.TemporaryDirectory(prefix="servo_axis_") as scratch:
        folder = Path(scratch)
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")
        script = next(name for name in files if name.startswith(NAME))
        command = [sys.executable, "-m", "pythonfmu", "build", "-f", script, "-d", f"{NAME}.fmu"]
        command += ["--no-external-tool", "--no-variable-step", *(name for name in files if name != script)]
        subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True, timeout=300)
        with zipfile.ZipFile(folder / f"{NAME}.fmu") as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
    content = hashlib.sha256("".join(files[name] for name in sorted(files)).encode()).hexdigest()
    description = _completed(
        members["modelDescription.xml"], str(uuid.uuid5(NAMESPACE, content)), axis, module
    )
    write_fmu(path, {**members, "modelDescription.xml": description})
    return path


def _sources(module: ModuleType) -> dict[str, str]:
    modules = {"servo_drive": servo_drive, "process_end": process_end, NAME: module}
    return {name: Path(str(one.__file__)).read_text(encoding="utf-8") for name, one in modules.items()}


def _renamed(sources: Mapping[str, str]) -> dict[str, str]:
    """Files of the FMU by name: modules and their imports of each other with the hash of the content in their names."""
    mark = hashlib.sha256("".join(sources.values()).encode()).hexdigest()[:12]
    imports = {
        "servo_drive": f"_servo_drive_{mark}",
        "ballscrew_fmu.python_fmu.process_end": f"_process_end_{mark}",
    }
    files = {slave.AXIS_FILE: sources[slave.AXIS_FILE]}
    script = sources[NAME]
    for module, name in imports.items():
        files[f"{name}.py"] = sources[module.rpartition(".")[2]]
        script = script.replace(f"from {module} import", f"from {name} import")
    return {**files, f"{NAME}_{mark}.py": script}


def _completed(xml: bytes, guid: str, axis: Axis, module: ModuleType) -> bytes:
    """modelDescription.xml with units, descriptions, dependencies and a guid computed from the content.

    At the start the axis is at rest: no output depends on anything. The outputs of a step belong to its end
    and depend on the torque that was held over it, not on that of the same instant.
    """
    table = {**module.INPUTS, **module.OUTPUTS, **module.PARAMETERS}  # unit and description by name
    root = ElementTree.fromstring(xml)
    root.set("guid", guid)
    del root.attrib["generationDateAndTime"]
    root.set("variableNamingConvention", "flat")
    units = Element("UnitDefinitions")
    for name in sorted({unit for unit, _ in table.values()}):
        base = {key: str(exponent) for key, exponent in UNITS[name].base.items()}
        SubElement(SubElement(units, "Unit", name=name), "BaseUnit", base)
    variables, structure = root.find("ModelVariables"), root.find("ModelStructure")
    root.insert(list(root).index(root.find("CoSimulation")) + 1, units)
    experiment = Element("DefaultExperiment", startTime="0.0", stepSize=repr(module.communication_step(axis)))
    root.insert(list(root).index(variables), experiment)
    outputs = []
    for index, variable in enumerate(variables, start=1):
        unit, text = table[variable.get("name")]
        variable.set("description", text)
        variable.find("Real").set("unit", unit)
        if variable.get("causality") == "output":
            outputs.append({"index": str(index), "dependencies": ""})
    structure[:] = [Element("Outputs"), Element("InitialUnknowns")]
    for group in structure:
        for attributes in outputs:
            SubElement(group, "Unknown", attributes)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"
