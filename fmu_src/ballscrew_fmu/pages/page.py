"""Documentation inside the FMUs, from the templates of this room: index.html, licences, requirements, icon."""

import importlib.resources
from collections.abc import Callable, Mapping
from importlib.metadata import distribution
from typing import Any

from jinja2 import ChoiceLoader, PackageLoader

from ballscrew_fmu.description.about import licence_text
from ballscrew_fmu.models import FRICTION, FmuModel
from ballscrew_fmu.variables.friction import TIME, Variable, band_text, law_name
from ballscrew_tehl.report.page import TEMPLATES as ELEMENTS
from ballscrew_tehl.report.page import Html, page, section
from ballscrew_tehl.report.tables import certificate_table
from ballscrew_tehl.runtime import constants
from ballscrew_tehl.runtime.packed import map_hash

TEMPLATES = ELEMENTS.overlay(
    loader=ChoiceLoader([PackageLoader("ballscrew_fmu.pages"), PackageLoader("ballscrew_tehl.report")])
)
TEMPLATES.globals = ELEMENTS.globals | {
    "band_text": band_text, "certificate_table": certificate_table, "law_name": law_name, "map_hash": map_hash,
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
    header: Mapping[str, Any], model: FmuModel = FRICTION, live_page: str = ""
) -> dict[str, bytes]:
    """Files of the documentation folder of an FMU for Python hosts, by path; live_page: "": none."""
    needs = TEMPLATES.get_template("external_dependencies.txt").render(refines=model.refines)
    licence = distribution("pythonfmu").read_text("licenses/LICENSE")
    texts = {
        "index.html": _page(model.name, model, header, model.variables(header), live_page),
        "externalDependencies.txt": needs,
        "licenses/license.txt": _licences(native=False),
        "licenses/pythonfmu.txt": licence or "MIT licence; https://github.com/NTNU-IHB/PythonFMU\n",
    }
    return _with_live_page(texts, live_page)


def native_documentation(
    header: Mapping[str, Any],
    fmi_version: int,
    platforms: str,
    model: FmuModel = FRICTION,
    embed_map: bool = False,
    live_page: str = "",
) -> dict[str, bytes]:
    """Files of the documentation folder of a native FMU, by path.

    Parameters   platforms : platforms of the binaries, as text;  embed_map : the map is compiled in
                 live_page : "": none
    """
    variables = (*model.native_variables(header), *((TIME,) if fmi_version == 3 else ()))
    texts = {
        "index.html": _page(
            model.native_name, model, header, variables, live_page, native=True, fmi_version=fmi_version,
            platforms=platforms, embed_map=embed_map,
        ),
        "licenses/license.txt": _licences(native=True),
    }  # fmt: skip
    return _with_live_page(texts, live_page)


def _with_live_page(texts: Mapping[str, str], live_page: str) -> dict[str, bytes]:
    """In a file of its own: tools that show index.html need not read the map."""
    whole = {**texts, LIVE: live_page} if live_page else texts
    return {name: text.encode() for name, text in whole.items()}


def _licences(native: bool) -> str:
    return TEMPLATES.get_template("license.txt").render(project=licence_text(), native=native)


def _page(
    name: str,
    model: FmuModel,
    header: Mapping[str, Any],
    variables: tuple[Variable, ...],
    live_page: str,
    **about: Any,
) -> str:
    """The page of an FMU. Calls of part in the template make the sections, text outside of them the introduction."""
    sections: list[tuple[str, str, Html]] = []

    def part(title: str, caller: Callable[[], Html]) -> str:
        key = title.lower().replace(" ", "_")
        sections.append((key, title, section(key, title, caller())))
        return ""

    connected = [v.causality in ("input", "output") for v in variables]
    intro = TEMPLATES.get_template("model.html").render(
        part=part, name=name, model=model, header=header,
        connections=[_row(v) for v, here in zip(variables, connected, strict=True) if here],
        others=[_row(v) for v, here in zip(variables, connected, strict=True) if not here],
        **{"native": False, "fmi_version": 2, **about},
    )  # fmt: skip
    if live_page:  # after what to connect
        sections.insert(1, ("live", "Live", section("live", "Torque of this screw, live", LIVE_BLOCK)))
    return page(name, [Html(intro.strip() + "\n")], sections, Html(f"<span>map {map_hash(header)}</span>"))


def _row(v: Variable) -> tuple[str, ...]:
    unit = "Boolean" if v.unit is None else f"{v.unit} ({v.display_unit})" if v.display_unit else v.unit
    bounds = (v.start, v.minimum, v.maximum)
    numbers = ("" if x is None else str(x).lower() if isinstance(x, bool) else f"{x:g}" for x in bounds)
    return (v.name, v.causality, unit, *numbers, v.description)
