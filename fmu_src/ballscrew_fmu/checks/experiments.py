"""Reads the reference experiments of an FMU from their manifest alone."""

import csv
import hashlib
import io
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ballscrew_fmu.checks.replay import CheckError
from ballscrew_fmu.native_fmu.experiments import EXPERIMENT_TYPE, FOLDER, MANIFEST, SSV_NAMESPACE, Reference


def experiments_in(folder: Path) -> dict[str, Reference]:
    """The experiments of an unpacked FMU by name; none without a folder of them.

    Raises       CheckError: a file is missing, has another checksum or does not fit the others
    """
    place = folder / FOLDER
    if not place.is_dir():
        return {}
    listed = {node.get("source", ""): node for node in _parsed(place / MANIFEST).iter("Related")}
    for source, related in listed.items():
        if hashlib.sha3_256(_content(place / source)).hexdigest() != related.get("checksum"):
            raise CheckError(f"{source}: not the file of the manifest, its checksum differs")
    return {
        experiment.get("name", ""): _reference(place, experiment)
        for source, related in listed.items()
        if related.get("type") == EXPERIMENT_TYPE
        for experiment in _parsed(place / source).iter("Experiment")
    }


def _reference(place: Path, experiment: ElementTree.Element) -> Reference:
    sources = {node.tag: place / node.get("source", "") for node in experiment if node.get("source")}
    settings = experiment.find("TransientSimulation")
    if settings is None or not {"Stimuli", "References"} <= sources.keys():
        raise CheckError(f"{experiment.get('name')}: no transient simulation with inputs and results")
    try:
        step = float(settings.get("stepSize", ""))
        count = round(float(settings.get("stopTime", "")) / step)
    except (ArithmeticError, ValueError) as error:  # round: of infinity, of NaN
        raise CheckError(
            f"{experiment.get('name')}: stepSize and stopTime need numbers > 0: {error}"
        ) from error
    inputs = _rows(sources["Stimuli"], count, 0.0, step)
    outputs = _rows(sources["References"], count, step, step)
    return Reference(
        step, inputs, outputs, _parameters(sources["Parameters"]) if "Parameters" in sources else {}
    )


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


def _rows(path: Path, count: int, first: float, step: float) -> list[dict[str, float]]:
    """Rows of a table without their times, which begin at `first`."""
    try:
        head, *lines = csv.reader(io.StringIO(_content(path).decode()))
        rows = [dict(zip(head, map(float, line), strict=True)) for line in lines]
    except ValueError as error:
        raise CheckError(f"{path.name}: not a table of numbers: {error}") from error
    if len(rows) != count:
        raise CheckError(f"{path.name}: {len(rows)} rows; {count} steps in the experiment")
    times = [row.pop("time") for row in rows]
    if not np.allclose(times, first + step * np.arange(count), rtol=0.0, atol=1e-6 * step):
        raise CheckError(f"{path.name}: other times than those of the steps")
    return rows


def _parameters(path: Path) -> Mapping[str, float | bool]:
    values: dict[str, float | bool] = {}
    for node in _parsed(path).iter(f"{{{SSV_NAMESPACE}}}Parameter"):
        try:
            kind, text = node[0].tag.rpartition("}")[2], node[0].get("value", "")
            values[node.get("name", "")] = text == "true" if kind == "Boolean" else float(text)
        except (IndexError, ValueError) as error:
            raise CheckError(f"{path.name}: parameter {node.get('name')} without a value: {error}") from error
    return values
