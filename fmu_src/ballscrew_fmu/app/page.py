"""The app: its files, its answers, its server."""

import importlib.resources
from collections.abc import Callable, Mapping
from pkgutil import resolve_name
from typing import Any

from .server import App, Report

ANSWERS = f"{__package__}.answers"
#: what the page asks, and the function that answers; its modules are imported with the first question, not before the
#: address
ASKED = {
    "form": "form", "torque": "torque", "page": "page", "fmus": "fmus", "report": "report_page", "table": "table",
    "calibrate": "calibration", "questions": "questions", "identify": "identification",
}  # fmt: skip
#: files of the page: folder of this package, content type
FILES = {
    "app.js": ("app/templates", "text/javascript"), "app.css": ("app/templates", "text/css"),
    "page.css": ("live_page/templates", "text/css"), "uPlot.iife.min.js": ("live_page/uplot", "text/javascript"),
    "uPlot.min.css": ("live_page/uplot", "text/css"),
}  # fmt: skip


def app_of(text: str = "", port: int = 0) -> App:
    """Server of the app, bound to a port (0: a free one); text: of a screw file to begin with.

    OSError: the port is taken
    """
    package = importlib.resources.files("ballscrew_fmu")
    files = {
        name: (package.joinpath(folder, name).read_bytes(), f"{kind}; charset=utf-8")
        for name, (folder, kind) in FILES.items()
    }
    page = package.joinpath("app/templates", "app.html").read_bytes()
    files[""] = page, "text/html; charset=utf-8"
    runs = {name: _asked(name) for name in ASKED}
    own = runs["form"]
    runs["form"] = lambda content, report: own(content, report) | {"text": text}
    return App(files, runs, (ValueError, ArithmeticError, OSError, RuntimeError), port)


def _asked(name: str) -> Callable[[Mapping[str, Any], Report], dict[str, Any]]:
    def run(content: Mapping[str, Any], report: Report) -> dict[str, Any]:
        result: dict[str, Any] = resolve_name(f"{ANSWERS}:{ASKED[name]}")(content, report)
        return result

    return run
