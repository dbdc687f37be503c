"""Documentation inside the FMUs, from the templates of this room: index.html, licences, requirements, icon."""

import importlib.resources
import json
from collections.abc import Callable, Mapping
from importlib.metadata import distribution
from typing import Any

from jinja2 import ChoiceLoader, PackageLoader

from ballscrew_fmu.description.model_description import licence_text
from ballscrew_fmu.models import FmuModel
from ballscrew_fmu.variables.friction import TIME, Variable, band_text, fmu_variables, law_name, origin_text
from ballscrew_tehl.applications.report.data import PRELOAD_WORDS
from ballscrew_tehl.applications.report.page import TEMPLATES as ELEMENTS
from ballscrew_tehl.applications.report.page import Html, certificate_table, page, section
from ballscrew_tehl.runtime import constants
from ballscrew_tehl.runtime.packed import map_hash

TEMPLATES = ELEMENTS.overlay(
    loader=ChoiceLoader(
        [PackageLoader("ballscrew_fmu.pages"), PackageLoader("ballscrew_tehl.applications.report")]
    )
)
TEMPLATES.globals = ELEMENTS.globals | {
    "band_text": band_text, "certificate_table": certificate_table, "law_name": law_name, "map_hash": map_hash,
    "origin_text": origin_text,
    **{name: value for name, value in vars(constants).items() if name.isupper()},
}  # fmt: skip


#: file of the live page beside index.html; what index.html shows of it
LIVE = "live.html"
LIVE_BLOCK = Html(
    '<p><a href="{0}"><b>Open the live page</b></a> ({0}, beside this page): sliders for preload, speed, temperature '
    "and axial load, your measured points over the curve. It computes offline with the C code and the map of this "
    'FMU.</p>\n<iframe class="live" title="Live page" loading="lazy" src="{0}"></iframe>'
).format(LIVE)


def icon(kind: str) -> bytes:
    """A ball screw with its double nut in section; kind: svg or png."""
    return (importlib.resources.files(__package__) / "templates" / f"icon.{kind}").read_bytes()


def documentation_files(
    header: Mapping[str, Any], model: FmuModel, live_page: str = "", native: tuple[int, str] | None = None
) -> dict[str, bytes]:
    """Files of the documentation folder of an FMU, by path.

    live_page: a separate file, as tools that show index.html need not read the map; "": none; native: version of FMI
    and platforms of a native FMU, as text; None: for Python hosts.
    """
    licence = TEMPLATES.get_template("license.txt").render(project=licence_text(), native=bool(native))
    files = {"index.html": _page(model, header, live_page, native), "licenses/license.txt": licence}
    if not native:
        theirs = distribution("pythonfmu").read_text("licenses/LICENSE")
        files["licenses/pythonfmu.txt"] = theirs or "MIT licence; https://github.com/NTNU-IHB/PythonFMU\n"
        needs = TEMPLATES.get_template("external_dependencies.txt").render()
        files["externalDependencies.txt"] = needs
    if live_page:
        files[LIVE] = live_page
    return {name: text.encode() for name, text in files.items()}


def _page(model: FmuModel, header: Mapping[str, Any], live_page: str, native: tuple[int, str] | None) -> str:
    """The page of an FMU. Calls of part in the template make the sections, text outside of them the introduction."""
    sections: list[tuple[str, str, Html]] = []

    def part(title: str, caller: Callable[[], Html]) -> str:
        key = title.lower().replace(" ", "_")
        sections.append((key, title, section(key, title, caller())))
        return ""

    name, variables, (fmi_version, platforms) = model.name, fmu_variables(header), native or (2, "")
    if native:
        name, variables = model.native_name, model.variables(header)
        variables += (TIME,) if fmi_version == 3 else ()
    kind = json.loads(header["parameters_json"]).get("screw", {}).get("preload_kind", "double_nut")
    outside = ("input", "output")
    intro = TEMPLATES.get_template("model.html").render(
        part=part, words=PRELOAD_WORDS[kind], model=model, header=header, native=native,
        fmi_version=fmi_version, platforms=platforms,
        connections=[_row(v) for v in variables if v.causality in outside],
        others=[_row(v) for v in variables if v.causality not in outside],
    )  # fmt: skip
    if live_page:  # after what to connect
        sections.insert(1, ("live", "Live", section("live", "Torque of this screw, live", LIVE_BLOCK)))
    return page(name, [Html(intro.strip() + "\n")], sections, Html(f"<span>map {map_hash(header)}</span>"))


def _row(v: Variable) -> tuple[str, ...]:
    unit = "Boolean" if v.unit is None else f"{v.unit} ({v.display_unit})" if v.display_unit else v.unit
    bounds = (v.start, v.minimum, v.maximum)
    numbers = ("" if x is None else str(x).lower() if isinstance(x, bool) else f"{x:g}" for x in bounds)
    return (v.name, v.causality, unit, *numbers, v.description)
