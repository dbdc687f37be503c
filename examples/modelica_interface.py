#!/usr/bin/env python3
"""Text of a Modelica block with the interface of an FMU, as a Modelica tool shows it after an import.

    python examples/modelica_interface.py [--model transmission] [--screw my.toml] [--output BallScrewTransmission.mo]

Inputs, outputs and parameters with units, start values and bounds of the screw. The block is partial, without
equations: these are in the FMU (BallScrewTransmission_fmi2.fmu), which the tool imports in its place. Use it to draw a
system before the FMU is there, or to compare what a tool imported.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from ballscrew_fmu.models import MODELS, FmuModel
from ballscrew_fmu.variables.friction import Variable
from ballscrew_tehl import load_map, load_screw
from ballscrew_tehl.runtime.evaluate import NutMap

BY_LAYER = {model.layer: model for model in MODELS}
KINDS = {"input": "input ", "output": "output ", "parameter": "parameter "}


def text_of(value: float | str | bool) -> str:
    """A Modelica literal."""
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"'.replace("\\", "\\\\") if isinstance(value, str) else repr(value)


def declaration(variable: Variable) -> str:
    """Declaration of an input, output or parameter."""
    boolean, parameter = variable.unit is None, variable.causality == "parameter"
    attributes = {} if boolean else {
        "unit": variable.unit, "displayUnit": variable.display_unit, "min": variable.minimum,
        "max": variable.maximum, "nominal": variable.nominal, "start": None if parameter else variable.start,
    }  # fmt: skip
    inside = ", ".join(
        f"{name} = {text_of(value)}" for name, value in attributes.items() if value is not None
    )
    start = "" if not parameter or variable.start is None else f" = {text_of(variable.start)}"
    kind = KINDS[variable.causality] + ("Boolean" if boolean else "Real")
    quoted = variable.description.replace('"', '\\"')
    return f'  {kind} {variable.name}{f"({inside})" * bool(inside)}{start}\n    "{quoted}";'


def main(nut_map: NutMap | None = None, model: FmuModel = BY_LAYER["transmission"]) -> str:
    """Text of the block for a map, None: of the packaged screw."""
    table = model.variables((nut_map or load_map()).header)
    lines = [declaration(variable) for variable in table if variable.causality in KINDS]
    head = f'partial block {model.native_name}\n  "{model.summary}"'
    return "\n".join([head, *lines, f"end {model.native_name};", ""])


def command(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--model", choices=BY_LAYER, default="transmission")
    parser.add_argument("--screw", type=Path, help="screw file; default: the packaged GD4008-3")
    parser.add_argument("--output", type=Path, help="file; default: standard output")
    args = parser.parse_args(arguments)
    parameters = load_screw(args.screw)
    text = main(load_map(None, parameters), BY_LAYER[args.model])
    if args.output is None:
        print(text, end="")
    else:
        args.output.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    command()
