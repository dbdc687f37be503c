"""The command `report`: one HTML page on a screw."""

from __future__ import annotations

import importlib
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from ..._version import __version__
from ...parameters.units import SHOWN
from ...whole_file import whole_file
from ..shared.chosen import Chosen, chosen_of
from ..shared.files import check_output, written
from ..shared.quantities import REPORT_POINT
from ..shared.results import print_results

if TYPE_CHECKING:
    from ...report.data import OperatingPoint, UserPoint
    from ...report.page import Html
    from ...runtime.evaluate import NutMap

    Live = Callable[[Chosen, NutMap, OperatingPoint], Html | None]


def run_report(args: Namespace, live: Live = lambda chosen, nut_map, point: None) -> int:
    """Evaluate, draw, write; the file is complete or does not exist.

    Parameters   live : the fragment that computes in the browser, of screw, map and start; this package has none
    """
    path = Path(args.output)
    check_output("--output", path, "a file *.html, *.htm")
    selected = chosen_of(args)
    user = user_point(args)
    # a missing one is noticed before a map is made
    importlib.import_module("matplotlib")
    from ...report.data import report_data
    from ...report.report import report_page

    nut_map = selected.nut_map(args)
    data = report_data(selected.parameters, selected.friction_set, nut_map, user)
    text = report_page(data, live(selected, nut_map, data.point))
    with written("--output", path), whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    result = {
        "file": str(path),
        "figures": text.count("<img "),
        **selected.described,
        "map_hash": nut_map.header["file_hash"],
        "version": __version__,
    }
    print_results([result], args.json, False)
    return 0


def user_point(args: Namespace) -> UserPoint:
    """Operating point of the options.

    Raises       ValueError: a number out of range
    """
    from ...report.data import OperatingPoint, UserPoint

    values: list[float | None] = []
    for quantity, axis in zip(REPORT_POINT, OperatingPoint._fields, strict=True):
        value = getattr(args, quantity.name)
        values.append(None if value is None else SHOWN[axis].si(quantity.checked(quantity.option, value)))
    return UserPoint(*values)
