"""Reference experiments in an FMU, which a tool can run again from the manifest alone.

Files of the layered standard FMI-LS-REF 1.0.0-beta.1 (github.com/modelica/fmi-ls-ref): a manifest that lists all
related files with role and checksum (SHA3-256). Experiments are in the Experiments Format that it refers to, in its
current draft (github.com/modelica/ma-hs-experiments): settings, inputs and results.
"""

import csv
import hashlib
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ballscrew_fmu.description.model_description import serialized
from ballscrew_fmu.models import FRICTION, FmuModel

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
MANIFEST = "fmi-ls-manifest.xml"
LS_VERSION = "1.0.0-beta.1"
LS_NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
EXPERIMENT_TYPE = "application/x-ma-hs-experiments"
SMOKE_STEPS = 10  # steps of the smoke test


class Reference(NamedTuple):
    """Inputs, held over equal steps from time 0, and outputs at the end of each step."""

    step: float  # [s]
    inputs: Sequence[Mapping[str, Any]]
    outputs: Sequence[Mapping[str, Any]]


class _Related(NamedTuple):
    """A file of the manifest."""

    type: str
    role: str
    description: str
    content: bytes


def reference_files(reference: Reference, model: FmuModel = FRICTION) -> dict[str, bytes]:
    """Files by name: manifest, two experiments with their inputs and outputs. Numbers with all digits."""
    related: dict[str, _Related] = {}
    for kind, role, count, text in (
        ("smoke_test", "smoke-test", SMOKE_STEPS, "First steps of the validation"),
        ("validation", "validation", len(reference.inputs), "Outputs computed from the map in Python"),
    ):
        name, step = f"{model.native_name}_{kind}", reference.step
        inputs, outputs = reference.inputs[:count], reference.outputs[:count]
        about = f"{text}, co-simulation with steps of {step:g} s"
        experiment = _experiment(name, about, step, len(inputs))
        held = f"Inputs, each held from its time to the next; {kind}"
        related[f"{name}.exp"] = _Related(EXPERIMENT_TYPE, f"experiment/{role}", about, experiment)
        related[f"{name}_in.csv"] = _Related("text/csv", "other", held, _table(inputs, step, 0))
        results = f"Outputs after the steps; {kind}"
        related[f"{name}_out.csv"] = _Related("text/csv", "result", results, _table(outputs, step, 1))
    return {MANIFEST: _manifest(related)} | {name: file.content for name, file in related.items()}


def validation_in(folder: Path) -> Reference | None:
    """The experiment `validation` of an unpacked FMU; None: it has no experiments.

    Raises       ValueError: a file is missing, differs from its checksum, or is no table of numbers
    """
    place = folder / FOLDER
    if not place.is_dir():
        return None
    tables = {}
    try:
        for related in ElementTree.parse(place / MANIFEST).iter("Related"):
            name = related.get("source", "")
            content = (place / name).read_bytes()
            if hashlib.sha3_256(content).hexdigest() != related.get("checksum"):
                raise ValueError(f"{name}: not the file of the manifest, its checksum differs")
            if name.endswith(("_validation_in.csv", "_validation_out.csv")):
                tables[related.get("role")] = _rows(name, content)
    except ElementTree.ParseError as error:
        raise ValueError(f"{MANIFEST}: not XML: {error}") from error
    except OSError as error:
        raise ValueError(f"{Path(error.filename).name}: {error.strerror}") from error
    if len(tables) != 2:
        raise ValueError(f"{MANIFEST}: no inputs and results of a validation")
    (inputs, _), (outputs, times) = tables["other"], tables["result"]
    return Reference(times[0], inputs, outputs)


def _rows(name: str, content: bytes) -> tuple[list[dict[str, float]], list[float]]:
    """Rows of a table, and their times."""
    head, *lines = csv.reader(io.StringIO(content.decode()))
    try:
        rows = [dict(zip(head, map(float, line), strict=True)) for line in lines]
        return rows, [row.pop("time") for row in rows]
    except (KeyError, ValueError) as error:
        raise ValueError(f"{name}: not a table of numbers: {error}") from error


def _manifest(related: Mapping[str, _Related]) -> bytes:
    ElementTree.register_namespace("fmi-ls", LS_NAMESPACE)
    standard = {
        "name": "org.fmi-standard.fmi-ls-ref",
        "version": LS_VERSION,
        "description": "Layered Standard providing information on related files included in an FMU.",
    }
    root = Element("fmiReferences", {f"{{{LS_NAMESPACE}}}fmi-ls-{key}": v for key, v in standard.items()})
    for name, file in related.items():
        SubElement(
            root, "Related", type=file.type, source=name, role=file.role, description=file.description,
            checksum=hashlib.sha3_256(file.content).hexdigest(), checksumType="SHA3-256",
        )  # fmt: skip
    return serialized(root)


def _experiment(name: str, description: str, step: float, count: int) -> bytes:
    root = Element("Experiments", name=name, description=description)
    experiment = SubElement(root, "Experiment", name=name, description=description)
    stop = repr(round(count * step, 12))
    SubElement(experiment, "TransientSimulation", startTime="0.0", stopTime=stop, stepSize=repr(step))
    SubElement(experiment, "Stimuli", type="text/csv", source=f"{name}_in.csv")
    SubElement(experiment, "References", type="text/csv", source=f"{name}_out.csv")
    return serialized(root)


def _table(rows: Sequence[Mapping[str, Any]], step: float, shift: int) -> bytes:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["time", *rows[0]])
    for n, row in enumerate(rows):
        values = (str(int(v)) if isinstance(v, bool) else repr(float(v)) for v in row.values())
        writer.writerow([repr(round((n + shift) * step, 12)), *values])
    return out.getvalue().encode()
