"""Reference experiments of the native FMUs: manifest, experiment files, run again from the manifest alone."""

import csv
import hashlib
import io
import re
import sys
import zipfile
from xml.etree import ElementTree

import pytest

from ballscrew_fmu.archive import write_fmu
from ballscrew_fmu.checks.experiments import check_experiments, run_experiments
from ballscrew_fmu.checks.reference import STEP, CheckError, expected_outputs, reference_results
from ballscrew_fmu.models import FRICTION, MONITOR, TRANSMISSION
from ballscrew_fmu.native_fmu.experiments import FOLDER, MANIFEST, Reference, reference_files
from ballscrew_fmu.native_fmu.package import build_native_fmu

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="libraries are built for this machine")

NAME = FRICTION.native_name
# roles of the draft, from its schema
ROLES = re.compile(
    "document|requirement|specification|model|parameter|system|testcase|experiment(/(smoke-test|validation|"
    "uncertainty-analysis))?|result|method|rationale|report|request|delivery|configuration|signature|"
    "serialized-state(/.*)?|meta-data|other"
)


@pytest.fixture(
    scope="module",
    params=[(2, FRICTION), (3, FRICTION), (3, MONITOR), (3, TRANSMISSION)],
    ids=["fmi2", "fmi3", "monitor", "transmission"],
)
def fmu(request, tmp_path_factory, synthetic_nut_map):
    version, model = request.param
    reference = Reference(STEP, *reference_results(synthetic_nut_map, model))
    if version == 2:  # with a parameter
        outputs, heat = [], 0.0
        for row in reference.inputs:
            outputs.append(expected_outputs(synthetic_nut_map, 0.1, row, heat))
            heat = outputs[-1]["heat"]
        parameters = {"presliding": False, "regularization_speed": 0.1}
        reference = reference._replace(outputs=outputs, parameters=parameters)
    path = tmp_path_factory.mktemp("experiments") / f"{model.native_name}.fmu"
    return build_native_fmu(
        synthetic_nut_map, version, path, reference, platforms=("x86_64-linux",), model=model
    ).path


def members(path):
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.mark.slow
def test_experiments_run_from_the_manifest_alone(fmu):
    found = run_experiments(fmu)
    name = fmu.stem
    assert set(found) == {f"{name}_smoke_test", f"{name}_validation"}
    assert all(one.difference <= 1e-9 for one in found.values())  # as the replay of the build


@pytest.mark.slow
def test_changed_results_and_files_are_found(fmu, tmp_path):
    files, place = members(fmu), f"{FOLDER}/{fmu.stem}_validation_out.csv"
    *rows, last = files[place].decode().splitlines()
    time, value, rest = last.split(",", 2)
    changed = "\n".join([*rows, f"{time},{1.01 * float(value)!r},{rest}"]).encode() + b"\n"
    other = tmp_path / "changed.fmu"
    write_fmu(other, files | {place: changed})
    with pytest.raises(CheckError, match="checksum differs"):
        run_experiments(other)
    manifest = files[f"{FOLDER}/{MANIFEST}"]
    before, after = (hashlib.sha3_256(content).hexdigest().encode() for content in (files[place], changed))
    write_fmu(other, files | {place: changed, f"{FOLDER}/{MANIFEST}": manifest.replace(before, after)})
    assert run_experiments(other)[f"{fmu.stem}_validation"].difference == pytest.approx(0.01 / 1.01)
    with pytest.raises(CheckError, match=r"_validation: .* at .* s = .*; the reference in the FMU is"):
        check_experiments(other)
    write_fmu(other, {name: content for name, content in files.items() if name != place})
    with pytest.raises(CheckError, match="No such file"):
        run_experiments(other)


REFERENCE = Reference(
    0.1,
    [{"speed": 1.0 / 3.0}, {"speed": 2.0}],
    [{"torque": 0.1, "in_range": True}, {"torque": 1e-300, "in_range": False}],
    {"presliding_stiffness": 0.0, "switch": False},
)


def test_manifest_lists_all_files_with_role_and_checksum():
    files = reference_files(REFERENCE)
    root = ElementTree.fromstring(files[MANIFEST])
    space = "{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-"
    assert root.attrib == {
        f"{space}name": "org.fmi-standard.fmi-ls-ref",
        f"{space}version": "1.0.0-beta.1",
        f"{space}description": "Layered Standard providing information on related files included in an FMU.",
    }
    listed = {node.get("source"): node for node in root}
    assert set(listed) == set(files) - {MANIFEST}
    for name, node in listed.items():
        assert set(node.attrib) == {"type", "source", "role", "description", "checksum", "checksumType"}
        assert ROLES.fullmatch(node.get("role"))
        assert node.get("checksumType") == "SHA3-256"
        assert node.get("checksum") == hashlib.sha3_256(files[name]).hexdigest()
    assert listed[f"{NAME}_smoke_test.exp"].get("role") == "experiment/smoke-test"
    assert listed[f"{NAME}_validation.exp"].get("role") == "experiment/validation"
    assert listed[f"{NAME}_validation.exp"].get("type") == "application/x-ma-hs-experiments"
    assert set(reference_files(REFERENCE._replace(parameters={}))) == set(files) - {f"{NAME}.ssv"}


def test_experiment_and_tables():
    files = {name: text.decode() for name, text in reference_files(REFERENCE).items()}
    (experiment,) = ElementTree.fromstring(files[f"{NAME}_validation.exp"])
    assert [(node.tag, node.attrib) for node in experiment] == [
        ("TransientSimulation", {"startTime": "0.0", "stopTime": "0.2", "stepSize": "0.1"}),
        ("Parameters", {"source": f"{NAME}.ssv"}),
        ("Stimuli", {"type": "text/csv", "source": f"{NAME}_validation_in.csv"}),
        ("References", {"type": "text/csv", "source": f"{NAME}_validation_out.csv"}),
    ]
    parameters = ElementTree.fromstring(files[f"{NAME}.ssv"])[0]
    values = [(node.get("name"), node[0].tag.rpartition("}")[2], node[0].get("value")) for node in parameters]
    assert values == [("presliding_stiffness", "Real", "0.0"), ("switch", "Boolean", "false")]
    inputs, outputs = (
        list(csv.reader(io.StringIO(files[f"{NAME}_validation_{end}.csv"]))) for end in ("in", "out")
    )
    assert inputs == [["time", "speed"], ["0.0", repr(1.0 / 3.0)], ["0.1", "2.0"]]
    assert outputs == [["time", "torque", "in_range"], ["0.1", "0.1", "1"], ["0.2", "1e-300", "0"]]


def test_smoke_test_is_the_begin_of_the_validation():
    rows = Reference(0.1, [{"speed": float(n)} for n in range(40)], [{"torque": float(n)} for n in range(40)])
    files = reference_files(rows)
    for end in ("in", "out"):
        short, whole = (files[f"{NAME}_{kind}_{end}.csv"] for kind in ("smoke_test", "validation"))
        assert whole.startswith(short)
        assert short.count(b"\n") == 11
