"""The command `report`: one HTML page on a screw and its map; without --screw on the measured screw of the paper."""

from __future__ import annotations

import importlib
from argparse import Namespace
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ... import __version__
from ...parameters.units import SHOWN
from ...whole_file import whole_file
from ..shared.chosen import Chosen, chosen_of
from ..shared.files import check_output, written
from ..shared.progress import progress_bar
from ..shared.quantities import REPORT_POINT
from ..shared.results import print_results

if TYPE_CHECKING:
    from ...report.lines import GivenPoint
    from ...report.page import Html
    from ...runtime.evaluate import NutMap

    Live = Callable[[Chosen, NutMap], Html | None]


def run_report(args: Namespace, live: Live = lambda chosen, nut_map: None) -> int:
    """Gather, draw, write; the file is complete or does not exist.

    Parameters   live : the fragment that computes in the browser, of screw and map; this package cannot
    """
    path = Path(args.output)
    check_output("--output", path, "a file *.html, *.htm")
    selected = chosen_of(args)
    measured = _is_paper(args, selected)
    given = _given(args, measured)
    from ...report.material import gather
    from ...report.sections import whole_page

    # a missing one is found before the contacts are solved
    importlib.import_module("matplotlib")
    with progress_bar() as progress:
        material = gather(selected.parameters, args.map, progress, selected.of_file, measured, given)
        text = whole_page(material, progress, live(selected, material.chosen.nut_map))
    with written("--output", path), whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    tables = material.tables.items()
    result: dict[str, Any] = {
        "file": str(path),
        "figures": text.count("<img "),
        "measured": material.measured,
        "deviations": {name: {table.name: table.deviations[0] for table in found} for name, found in tables},
        "contacts_converged": all(found.solution.converged for found in material.contacts),
        **selected.described,
        "map_hash": material.picture.nut_map.header["file_hash"],
        "version": __version__,
    }
    print_results([result if args.json else flat(result)], args.json, False)
    return 0


def _given(args: Namespace, measured: bool) -> GivenPoint:
    """Operating point of the options.

    Raises       ValueError: a number out of range, or any in the report on the paper
    """
    from ...report.lines import POINT_AXES, GivenPoint

    found: list[float | None] = []
    for quantity, axis in zip(REPORT_POINT, POINT_AXES, strict=True):
        value = getattr(args, quantity.name)
        if value is not None and measured:
            raise ValueError(
                f"{quantity.option} = {value}; allowed: with --screw or --map, the paper has its own point"
            )
        found.append(None if value is None else SHOWN[axis].si(quantity.checked(quantity.option, value)))
    return GivenPoint(*found)


def _is_paper(args: Namespace, selected: Chosen) -> bool:
    """Whether the page is about the measured screw of the paper and the paper."""
    from ...report.material import is_measured_screw

    return args.screw is None and args.map is None and is_measured_screw(selected.parameters)


def flat(nested: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """One row per number: deviations.three_parameter.table2.

    Example
        >>> flat({"a": {"b": {"c": 1}}, "d": 2})
        {'a.b.c': 1, 'd': 2}
    """
    rows: dict[str, Any] = {}
    for key, value in nested.items():
        rows |= flat(value, f"{before}{key}.") if isinstance(value, Mapping) else {f"{before}{key}": value}
    return rows
