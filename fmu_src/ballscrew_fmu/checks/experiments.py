"""Runs the reference experiments of an FMU from their manifest alone, in fmpy."""

import csv
import hashlib
import io
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import fmpy
import numpy as np

from ballscrew_fmu.checks.check import AGREEMENT
from ballscrew_fmu.checks.reference import CheckError
from ballscrew_fmu.checks.replay import largest_difference
from ballscrew_fmu.native_fmu.experiments import EXPERIMENT_TYPE, FOLDER, MANIFEST, SSV_NAMESPACE


class Comparison(NamedTuple):
    """Outputs of one experiment against their references."""

    steps: int
    difference: float  # relative, the largest
    place: str  # of the largest difference: variable, time and both values


def check_experiments(fmu: Path | str) -> dict[str, Comparison]:
    """run_experiments, none of whose outputs differs by more than AGREEMENT.

    Raises       CheckError: as run_experiments; the output with the largest difference
    """
    experiments = run_experiments(fmu)
    for name, found in experiments.items():
        if not found.difference <= AGREEMENT:
            raise CheckError(f"{name}: {found.place}; allowed difference {AGREEMENT:g}")
    return experiments


def run_experiments(fmu: Path | str) -> dict[str, Comparison]:
    """Outputs of an FMU, packed or in a folder, against their references, by experiment.

    Raises       CheckError: there is no manifest, a file is missing or has another checksum, or fmpy cannot run it
    """
    if Path(fmu).is_dir():
        return _run_all(Path(fmu))
    folder = tempfile.mkdtemp(prefix="ballscrew_experiments_")
    try:
        fmpy.extract(str(fmu), unzipdir=folder)
        return _run_all(Path(folder))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def has_experiments(folder: Path) -> bool:
    return (folder / FOLDER).is_dir()


def _run_all(folder: Path) -> dict[str, Comparison]:
    place = folder / FOLDER
    listed = {node.get("source", ""): node for node in _parsed(place / MANIFEST).iter("Related")}
    for source, related in listed.items():
        if hashlib.sha3_256(_content(place / source)).hexdigest() != related.get("checksum"):
            raise CheckError(f"{source}: not the file of the manifest, its checksum differs")
    experiments = [
        experiment
        for source, related in listed.items()
        if related.get("type") == EXPERIMENT_TYPE
        for experiment in _parsed(place / source).iter("Experiment")
    ]
    return {experiment.get("name", ""): _run(folder, place, experiment) for experiment in experiments}


def _run(folder: Path, place: Path, experiment: ElementTree.Element) -> Comparison:
    sources = {node.tag: place / node.get("source", "") for node in experiment if node.get("source")}
    settings = experiment.find("TransientSimulation")
    if settings is None:
        raise CheckError(f"{experiment.get('name')}: no transient simulation")
    times = {name: float(value) for name, value in settings.items()}
    wanted = _columns(sources["References"])
    try:
        found = fmpy.simulate_fmu(
            str(folder),
            fmi_type="CoSimulation",
            start_time=times["startTime"],
            stop_time=times["stopTime"],
            output_interval=times["stepSize"],
            start_values=_parameters(sources["Parameters"]) if "Parameters" in sources else {},
            input=_signals(sources["Stimuli"]),
            output=[name for name in wanted if name != "time"],
        )
    except Exception as error:  # fmpy raises Exception itself
        raise CheckError(f"{experiment.get('name')}: {error}") from error
    # the first row of fmpy is that after initialization; references begin with the end of the first step
    if len(found) != 1 + len(wanted["time"]):
        file = sources["References"].name
        raise CheckError(
            f"{file}: {len(wanted['time'])} rows; {len(found) - 1} steps in {experiment.get('name')}"
        )
    if not np.allclose(found["time"][1:], wanted["time"], rtol=0.0, atol=1e-6 * times["stepSize"]):
        raise CheckError(f"{experiment.get('name')}: steps end at other times than the references")
    ends = wanted.pop("time")
    worst, n, name, value, reference = largest_difference(
        [{name: float(row[name]) for name in wanted} for row in found[1:]],
        [dict(zip(wanted, row, strict=True)) for row in np.transpose([*wanted.values()]).tolist()],
    )
    where = f"{name} at {ends[n]:g} s = {value!r}; the reference in the FMU is {reference!r}"
    return Comparison(len(ends), worst, where)


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise CheckError(f"{path.name}: {error.strerror}") from error


def _parsed(path: Path) -> ElementTree.Element:
    try:
        return ElementTree.fromstring(_content(path))
    except ElementTree.ParseError as error:
        raise CheckError(f"{path.name}: not XML: {error}") from error


def _columns(path: Path) -> dict[str, Any]:
    try:
        head, *rows = csv.reader(io.StringIO(_content(path).decode()))
        return dict(zip(head, np.array(rows, dtype=float).T, strict=True))
    except ValueError as error:
        raise CheckError(f"{path.name}: not a table of numbers: {error}") from error


def _signals(path: Path) -> Any:
    columns = _columns(path)
    return np.array(list(zip(*columns.values(), strict=True)), dtype=[(name, float) for name in columns])


def _parameters(path: Path) -> Mapping[str, float | bool]:
    values: dict[str, float | bool] = {}
    for node in _parsed(path).iter(f"{{{SSV_NAMESPACE}}}Parameter"):
        kind, text = node[0].tag.rpartition("}")[2], node[0].get("value", "")
        values[node.get("name", "")] = text == "true" if kind == "Boolean" else float(text)
    return values
