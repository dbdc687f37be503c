"""Checks of an FMU that fmpy and the schemas do not make: its members against each other, units, machines."""

import ctypes
import io
import re
import struct
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
from lxml import etree

SCHEMAS = Path(fmpy.__file__).parent / "schema"

# exponents of kg, m, s, K, rad and display factors, offsets; written down independently of the table
DIMENSIONS = {
    "N": (1, 1, -2, 0, 0), "rad/s": (0, 0, -1, 0, 1), "K": (0, 0, 0, 1, 0), "N.m": (1, 2, -2, 0, 0),
    "W": (1, 2, -3, 0, 0), "J": (1, 2, -2, 0, 0), "m": (0, 1, 0, 0, 0), "Pa": (1, -1, -2, 0, 0), "1": (0, 0, 0, 0, 0),
    "N.m/rad": (1, 2, -2, 0, -1), "N.m.s/rad": (1, 2, -1, 0, -1), "rad": (0, 0, 0, 0, 1), "s": (0, 0, 1, 0, 0),
    "N.m/N": (0, 1, 0, 0, 0), "m/s": (0, 1, -1, 0, 0), "N/m": (1, 0, -2, 0, 0),
    "rad/s2": (0, 0, -2, 0, 1), "m/s2": (0, 1, -2, 0, 0), "kg": (1, 0, 0, 0, 0), "kg.m2": (1, 2, 0, 0, 0),
    "N.s/m": (1, 0, -1, 0, 0), "sqrt(J)": None, "sqrt(J)/s": None,
}  # fmt: skip
DISPLAYS = {
    ("rad/s", "rev/min"): (9.549296585513721, 0.0), ("K", "degC"): (1.0, -273.15), ("m", "um"): (1e6, 0.0),
    ("m", "nm"): (1e9, 0.0), ("Pa", "GPa"): (1e-9, 0.0), ("rad", "deg"): (57.29577951308232, 0.0),
    ("m/s", "m/min"): (60.0, 0.0), ("m", "mm"): (1e3, 0.0), ("N/m", "N/um"): (1e-6, 0.0),
}  # fmt: skip
# format and processors of the library in each folder
MACHINES = {
    "linux64": ("elf", 62), "x86_64-linux": ("elf", 62), "aarch64-linux": ("elf", 183), "win64": ("pe", 0x8664),
    "x86_64-windows": ("pe", 0x8664), "darwin64": ("mach", 0x01000007, 0x0100000C),
    "x86_64-darwin": ("mach", 0x01000007), "aarch64-darwin": ("mach", 0x0100000C),
}  # fmt: skip
SUFFIXES = {"elf": "so", "pe": "dll", "mach": "dylib"}


def members(fmu):
    """Contents of an FMU file by path."""
    with zipfile.ZipFile(fmu) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def variables_of(root):
    """(name, value reference, node with the numbers) in order, for both versions."""
    nodes = list(root.find("ModelVariables"))
    return [
        (n.get("name"), int(n.get("valueReference")), n[0] if n.tag == "ScalarVariable" else n) for n in nodes
    ]


def findings(files):
    """Errors in these members of a native FMU; empty if there are none."""
    root = ElementTree.parse(io.BytesIO(files["modelDescription.xml"])).getroot()
    version = int(root.get("fmiVersion")[0])
    return [
        *_schemas(files, version), *unit_findings(root), *_libraries(root, files, version), *_sources(root, files),
    ]  # fmt: skip


def _schemas(files, version):
    """Errors of what fmpy does not validate; terminals in FMI 2.0, which FMILibrary refuses."""
    names = ("sources/buildDescription", "terminalsAndIcons/terminalsAndIcons")
    found = [] if (f"{names[1]}.xml" in files) == (version == 3) else ["terminals are those of FMI 3.0"]
    for name in names[: version - 1]:
        kind = name.partition("/")[2]
        schema = etree.XMLSchema(file=str(SCHEMAS / f"fmi3/fmi3{kind[0].upper()}{kind[1:]}.xsd"))
        if not schema.validate(etree.fromstring(files[f"{name}.xml"])):
            found += map(str, schema.error_log)
    return found


def unit_findings(root):
    """Units that are not defined or not used, wrong exponents, factors and offsets, offsets of differences."""
    found, nodes = [], [node for _, _, node in variables_of(root)]
    used, units = {node.get("unit") for node in nodes} - {None}, root.find("UnitDefinitions")
    if {unit.get("name") for unit in units} != used:
        found.append(f"units defined are not those used, {sorted(used)}")
    for unit in units:
        name, base = unit.get("name"), unit.find("BaseUnit")
        keys, powers = ("kg", "m", "s", "K", "rad"), {} if base is None else base.attrib
        exponents = None if base is None else tuple(int(powers.get(key, "0")) for key in keys)
        if exponents != DIMENSIONS.get(name, ()) or set(powers) - set(keys):
            found.append(f"unit {name} has exponents {exponents} of kg, m, s, K, rad")
        for display in unit.findall("DisplayUnit"):
            numbers = (float(display.get("factor", "1")), float(display.get("offset", "0")))
            if numbers != DISPLAYS.get((name, display.get("name"))):
                found.append(f"display unit {display.get('name')} of {name}: factor, offset {numbers}")
    return found + [
        f"{node.get('unit')}: a difference would be shown with an offset"
        for node in nodes
        if node.get("relativeQuantity") == "true" and node.get("displayUnit") == "degC"
    ]


def _libraries(root, files, version):
    """Token and hash of the variables in the resources, hash, name, machine and no path of here in each library."""
    token, screw = root.get("guid" if version == 2 else "instantiationToken"), files["resources/screw.bin"]
    table = re.search(rb'TABLE_HASH "(\w{64})"', files["sources/variables.h"])[1]
    found = [] if token and token.encode() in screw and table in screw else ["resources of another FMU"]
    (name,) = {node.get("modelIdentifier") for node in root if node.tag in ("CoSimulation", "ModelExchange")}
    for path, content in files.items():
        if path.startswith("binaries/"):
            _, folder, file = path.split("/")
            kind, *processors = MACHINES[folder]
            good = file == f"{name}.{SUFFIXES[kind]}" and machine_of(content) == (kind, *processors)
            here = [text for text in (b"/tmp/", b"/home/", b"/root/", b"/Users/", b".pdb") if text in content]
            if not good or here or table not in content or token.encode() in content:
                found.append(f"{path}: made for {machine_of(content)}, holds {here}")
    return found


def machine_of(content):
    """Format and processors of a library."""
    if content[:4] == b"\x7fELF":
        return "elf", *struct.unpack_from("<H", content, 18)
    if content[:2] == b"MZ":
        (start,) = struct.unpack_from("<I", content, 0x3C)
        return "pe", *struct.unpack_from("<H", content, start + 4)
    if content[:4] == b"\xca\xfe\xba\xbe":
        (count,) = struct.unpack_from(">I", content, 4)
        return "mach", *(struct.unpack_from(">I", content, 8 + 20 * n)[0] for n in range(count))
    return "mach" if content[:4] == b"\xcf\xfa\xed\xfe" else "unknown", *struct.unpack_from("<I", content, 4)


def _sources(root, files):
    """The log categories are those of text.h; each C file is listed, or included by one that is."""
    text = {n.partition("/")[2]: c.decode() for n, c in files.items() if n.startswith("sources/")}
    named = {n.get("name") for n in root.find("LogCategories")}
    found = [] if named == set(re.findall(r'"(log[A-Z]\w+)"', text["text.h"])) else ["log categories"]
    sources = [[f.get("name") for f in group] for group in root.iter("SourceFiles")]
    listed = ElementTree.fromstring(text["buildDescription.xml"]).iter("SourceFile")
    sources.append([node.get("name") for node in listed])
    units = sorted(name for name in text if name.endswith(".c"))
    for names in sources:
        included = [n for one in names for n in re.findall(r'^#include "(.*\.c)"$', text[one], re.MULTILINE)]
        if sorted([*names, *included]) != units:
            found.append(f"source files {names} with {included}; there are {units}")
    return found


def exports(library, names):
    """Functions of these names that a library for this machine does not export."""
    loaded = ctypes.CDLL(str(library))
    return [name for name in names if not hasattr(loaded, name)]


def fmi_functions(version):
    """All functions of an FMI version, from its header."""
    header = (Path(fmpy.__file__).parent / "c-code" / f"fmi{version}Functions.h").read_text()
    names = re.findall(rf"^#define (fmi{version}\w+)\s+fmi{version}FullName\(", header, re.MULTILINE)
    return sorted({*names})
