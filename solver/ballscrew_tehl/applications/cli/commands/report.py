"""The command `report`: one HTML page on a screw."""

import importlib
from argparse import Namespace
from collections.abc import Callable
from typing import Any

from ballscrew_tehl._version import __version__
from ballscrew_tehl.parameters.units import SHOWN

from ...quantities import REPORT_POINT
from ..shared.inputs import chosen_of, map_of
from ..shared.output import Answer, check_output, progress_bar, write_file


def run_report(args: Namespace, live: Callable[..., Any] = lambda chosen, nut_map, point: None) -> Answer:
    """Evaluate, draw, write; the file is complete or does not exist.

    live: HTML fragment that computes in the browser, of screw, map and start, or None
    """
    path = check_output("--output", args.output, "a file *.html, *.htm")
    chosen = chosen_of(args)
    values = {quantity.axis: getattr(args, quantity.name) for quantity in REPORT_POINT}
    user = {axis: SHOWN[axis].si(value) for axis, value in values.items() if value is not None}
    # a missing one is noticed before a map is made
    importlib.import_module("matplotlib")
    from ballscrew_tehl.applications.report.data import report_data
    from ballscrew_tehl.applications.report.page import report_page

    nut_map = map_of(chosen)
    data = report_data(chosen.parameters, chosen.friction_set, nut_map, user)
    with progress_bar() as progress:
        what = "report: live page, intervals"
        progress(0, 2, what)
        fragment = live(chosen, nut_map, data.point)
        progress(1, 2, what)
        text = report_page(data, fragment)
        progress(2, 2, what)
    write_file("--output", path, text)
    result = {"file": str(path), "figures": text.count("<img "), **chosen.described}
    return Answer([result | {"map_hash": nut_map.header["file_hash"], "version": __version__}])
