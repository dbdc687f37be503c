"""Reference experiments in an FMU, which a tool can run again from the manifest alone.

Files of the layered standard FMI-LS-REF 1.0.0-beta.1 (github.com/modelica/fmi-ls-ref): a manifest that lists all
related files with role and checksum (SHA3-256). Experiments are in the Experiments Format that it refers to, in its
current draft (github.com/modelica/ma-hs-experiments): settings, parameters (SSV of SSP), inputs and results.
"""

import csv
import hashlib
import io
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ballscrew_fmu.description.native import serialized
from ballscrew_fmu.models import FRICTION, FmuModel

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
MANIFEST = "fmi-ls-manifest.xml"
LS_VERSION = "1.0.0-beta.1"
LS_NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
SSV_NAMESPACE = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
EXPERIMENT_TYPE = "application/x-ma-hs-experiments"
SMOKE_STEPS = 10  # steps of the smoke test


class Reference(NamedTuple):
    """Inputs, held over equal steps from time 0, and outputs at the end of each step."""

    step: float  # [s]
    inputs: Sequence[Mapping[str, Any]]
    outputs: Sequence[Mapping[str, Any]]
    parameters: Mapping[str, float] = {}  # set before initialization


def reference_files(reference: Reference, model: FmuModel = FRICTION) -> dict[str, bytes]:
    """Files by name: manifest, two experiments with their parameters, inputs and outputs. Numbers with all digits."""
    name = model.native_name
    related: dict[str, tuple[str, str, str, bytes]] = {}  # type, role, description, content
    if reference.parameters:
        related[f"{name}.ssv"] = (
            "application/x-ssp-parameter-set", "parameter", "Parameters of the experiments",
            _parameter_set(name, reference.parameters),
        )  # fmt: skip
    for kind, role, count, text in (
        ("smoke_test", "smoke-test", SMOKE_STEPS, "First steps of the validation"),
        ("validation", "validation", len(reference.inputs), "Outputs computed from the map in Python"),
    ):
        rows = reference.inputs[:count], reference.outputs[:count]
        files = {"in": _table(rows[0], reference.step, 0), "out": _table(rows[1], reference.step, 1)}
        held = "Inputs, each held from its time to the next"
        about = f"{text}, co-simulation with steps of {reference.step:g} s"
        experiment = _experiment(name, kind, about, reference, len(rows[0]))
        related[f"{name}_{kind}.exp"] = (EXPERIMENT_TYPE, f"experiment/{role}", about, experiment)
        related[f"{name}_{kind}_in.csv"] = ("text/csv", "other", f"{held}; {kind}", files["in"])
        related[f"{name}_{kind}_out.csv"] = (
            "text/csv",
            "result",
            f"Outputs after the steps; {kind}",
            files["out"],
        )
    return {MANIFEST: _manifest(related)} | {file: content for file, (*_, content) in related.items()}


def _manifest(related: Mapping[str, tuple[str, str, str, bytes]]) -> bytes:
    ElementTree.register_namespace("fmi-ls", LS_NAMESPACE)
    root = Element(
        "fmiReferences",
        {
            f"{{{LS_NAMESPACE}}}fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
            f"{{{LS_NAMESPACE}}}fmi-ls-version": LS_VERSION,
            f"{{{LS_NAMESPACE}}}fmi-ls-description": (
                "Layered Standard providing information on related files included in an FMU."
            ),
        },
    )
    for file, (kind, role, description, content) in related.items():
        SubElement(
            root, "Related", type=kind, source=file, role=role, description=description,
            checksum=hashlib.sha3_256(content).hexdigest(), checksumType="SHA3-256",
        )  # fmt: skip
    return serialized(root)


def _experiment(model: str, kind: str, description: str, reference: Reference, steps: int) -> bytes:
    name = f"{model}_{kind}"
    root = Element("Experiments", name=name, description=description)
    experiment = SubElement(root, "Experiment", name=name, description=description)
    SubElement(
        experiment, "TransientSimulation", startTime="0.0", stopTime=repr(round(steps * reference.step, 12)),
        stepSize=repr(reference.step),
    )  # fmt: skip
    if reference.parameters:
        SubElement(experiment, "Parameters", source=f"{model}.ssv")
    SubElement(experiment, "Stimuli", type="text/csv", source=f"{name}_in.csv")
    SubElement(experiment, "References", type="text/csv", source=f"{name}_out.csv")
    return serialized(root)


def _parameter_set(name: str, parameters: Mapping[str, float]) -> bytes:
    ElementTree.register_namespace("ssv", SSV_NAMESPACE)
    root = Element(f"{{{SSV_NAMESPACE}}}ParameterSet", version="1.0", name=name)
    listed = SubElement(root, f"{{{SSV_NAMESPACE}}}Parameters")
    for parameter, value in parameters.items():
        node = SubElement(listed, f"{{{SSV_NAMESPACE}}}Parameter", name=parameter)
        if isinstance(value, bool):
            SubElement(node, f"{{{SSV_NAMESPACE}}}Boolean", value=str(value).lower())
        else:
            SubElement(node, f"{{{SSV_NAMESPACE}}}Real", value=repr(float(value)))
    return serialized(root)


def _table(rows: Sequence[Mapping[str, Any]], step: float, shift: int) -> bytes:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["time", *rows[0]])
    for n, row in enumerate(rows):
        time = round((n + shift) * step, 12)
        writer.writerow(
            [repr(time)] + [str(int(v)) if isinstance(v, bool) else repr(float(v)) for v in row.values()]
        )
    return out.getvalue().encode()
