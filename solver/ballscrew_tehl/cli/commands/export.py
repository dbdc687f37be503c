"""The command export: friction of a map as a table for a controller or a simulation tool."""

from __future__ import annotations

import re
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...parameters.units import CELSIUS
from ...runtime.packed import MECHANISTIC
from ...whole_file import whole_file
from ..shared.chosen import Chosen, chosen_of
from ..shared.files import check_output, written
from ..shared.progress import QUIET, progress_bar
from ..shared.quantities import CURRENT_UNIT, PRELOAD, RATIO, TEMPERATURE, TORQUE_CONSTANT, whole_number
from ..shared.results import print_results, say

if TYPE_CHECKING:
    from ...exchange.tables import FrictionTable

#: file names by format; speeds of a table, points of a compensation list and the speeds that it is fitted to
KINDS = {"twincat": "a file *.lis, *.txt", "csv": "a file *.csv", "modelica": "a file *.txt", "matlab": "a file *.m",
         "json": "a file *.json"}  # fmt: skip
#: of the table of lists
COLUMNS = ("file", "preload_n", "temperature_c", "entries", "largest_error_nm", "error_bound_nm")
SPEEDS, MOST_POINTS, CURVE = 40, 20, 400


def run_export(args: Namespace) -> int:
    """One file, or one for each preload and temperature of a compensation list."""
    from ...exchange.tables import curve_speeds, friction_table, speeds_of
    from ...nut_map.file import load_contact_map

    output = check_output(
        "--output", args.output, KINDS[args.format], inputs=(args.screw, args.map, args.friction)
    )
    constant = args.torque_constant_nm_a
    if (constant is None) == (args.format == "twincat"):
        needed = "needed with" if constant is None else "allowed only with"
        raise ValueError(f"--torque-constant-nm-a; {needed} --format twincat, whose list is a motor current")
    if args.format == "matlab" and not re.fullmatch(r"[A-Za-z]\w{0,62}", output.stem):
        raise ValueError(
            f"--output = {output}; allowed: the name of a MATLAB function, letters, digits and _ only"
        )
    whole_number("--points", args.points)
    most = args.points or (MOST_POINTS if args.format == "twincat" else SPEEDS)
    if most < 3:
        raise ValueError(f"--points = {most}; allowed: a whole number >= 3")
    chosen = chosen_of(args)
    nut_map = chosen.nut_map(args)
    preload, temperature = _grid(args, chosen)
    contact_map = load_contact_map(args.map, chosen.parameters) if nut_map.law == MECHANISTIC else None
    speed = curve_speeds(nut_map, CURVE) if args.format == "twincat" else speeds_of(nut_map, most)
    with progress_bar(QUIET) as progress:
        table = friction_table(
            nut_map, chosen.parameters, chosen.friction_set, None if args.format == "twincat" else contact_map, speed,
            preload, temperature, progress,
        )  # fmt: skip
    files, answer = _files(args, output, table, most)
    for path, text in files.items():
        with written("--output", path), whole_file(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
        say(f"written: {path}")
    print_results(answer, args.json, args.format == "twincat", columns=COLUMNS)
    return 0


def _grid(args: Namespace, chosen: Chosen) -> tuple[np.ndarray, np.ndarray]:
    """Preloads [N] and temperatures [K] in rising order; default: as catalogues take them."""
    from ...mechanics import CATALOGUE_SHARE
    from ...physics.rating import dynamic_rating

    usual = float(f"{CATALOGUE_SHARE * dynamic_rating(chosen.parameters.screw):.2g}")
    preloads = [
        PRELOAD._replace(not_zero=True).checked("--preload-n", value) for value in args.preload_n or [usual]
    ]
    reference = chosen.parameters.lubricant.reference_temperature - CELSIUS
    celsius = [TEMPERATURE.checked("--temperature-c", value) for value in args.temperature_c or [reference]]
    return np.unique(np.array(preloads)), np.unique(np.array(celsius)) + CELSIUS


def _files(
    args: Namespace, output: Path, table: FrictionTable, most: int
) -> tuple[dict[Path, str], list[dict]]:
    """Texts by path, and what is said of them."""
    from ...exchange import formats
    from ...exchange.piecewise import few_points

    head = {"format": args.format, "screw": table.about["screw"], "friction_set": table.about["friction set"]}
    if args.format != "twincat":
        text = {
            "csv": formats.csv_text, "json": formats.json_text, "modelica": formats.modelica_text,
            "matlab": lambda one: formats.matlab_text(one, output.stem),
        }[args.format](table)  # fmt: skip
        answer = {
            "file": str(output),
            "speeds": len(table.speed),
            "preload_n": table.preload.tolist(),
            "temperature_c": (table.temperature - CELSIUS).tolist(),
        }
        return {output: text}, [head | answer]
    constant = TORQUE_CONSTANT.checked("--torque-constant-nm-a", args.torque_constant_nm_a)
    ratio = 1.0 if args.ratio is None else RATIO.checked("--ratio", args.ratio)
    unit = (
        1e-3 if args.current_unit_a is None else CURRENT_UNIT.checked("--current-unit-a", args.current_unit_a)
    )
    files, answers = {}, []
    for j, preload in enumerate(table.preload):
        for k, kelvin in enumerate(table.temperature):
            # the entry at rest is one of them
            points = few_points(table.speed, table.torque[:, j, k], most - 1)
            where = f"preload {preload:.6g} N, oil {kelvin - CELSIUS:.6g} degC"
            many = len(table.preload) * len(table.temperature) > 1
            name = (
                f"{output.stem}_{preload:.6g}N_{kelvin - CELSIUS:.6g}C{output.suffix}"
                if many
                else output.name
            )
            path = output.with_name(name)
            files[path] = formats.twincat_text(table, points, 1.0 / (constant * ratio), unit, where)
            answers.append(head | {
                "file": str(path), "preload_n": float(preload), "temperature_c": float(kelvin - CELSIUS),
                "entries": len(points.x) + 1, "largest_error_nm": points.error, "error_bound_nm": points.bound,
                "largest_error_share": points.error / float(table.torque[:, j, k].mean()),
            })  # fmt: skip
    return files, answers
