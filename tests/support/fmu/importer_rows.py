"""Rows of a replay: inputs of one step each, and the outputs after it; names of the outputs of an FMU."""

import functools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import fmpy

STEP = 2.0**-9  # [s]: all communication points are exact, in seconds and in the nanoseconds of libcosim
Row = dict[str, Any]
Rows = Sequence[Mapping[str, float]]


@functools.cache
def outputs_of(fmu: Path) -> tuple[list[str], list[str]]:
    """Names of the Real and of the Boolean outputs."""
    variables = [v for v in fmpy.read_model_description(str(fmu)).modelVariables if v.causality == "output"]
    flags = [v.name for v in variables if v.type == "Boolean"]
    return [v.name for v in variables if v.name not in flags], flags


def references_of(fmu: Path) -> dict[str, int]:
    return {v.name: v.valueReference for v in fmpy.read_model_description(str(fmu)).modelVariables}


def as_row(fmu: Path, values: Mapping[str, Any]) -> Row:
    """Outputs of a tool that reads all of them as numbers; a Boolean that is not 0 or 1 remains a number."""
    reals, flags = outputs_of(fmu)
    row = {name: float(values[name]) for name in reals}
    return row | {name: bool(values[name]) if values[name] in (0.0, 1.0) else values[name] for name in flags}
