"""One HTML file that computes in a browser, offline: core and friction of the native FMU as WebAssembly, map, plots.

The interval of a torque needs the balls, so that the page has a table of it (nut_map.interval.interval_table): ends
mostly within some tenths of a percent of the torque without axial load, within some percent with one, with oversize
balls 16 %. Plots by uPlot, which is in the folder uplot with its licence.
"""

import base64
import importlib.resources
import math
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ballscrew_fmu.native_fmu.compile import WASM
from ballscrew_fmu.native_fmu.libraries import contents, page_library
from ballscrew_fmu.native_fmu.resource_files import map_bytes
from ballscrew_fmu.variables.friction import law_name, start_preload
from ballscrew_tehl import __version__
from ballscrew_tehl.calibration.measured_screw import ASSUMED_TEMPERATURE, packaged_measurements
from ballscrew_tehl.cli.shared.quantities import TORQUE_POINT
from ballscrew_tehl.friction.interval import MEANING
from ballscrew_tehl.nut_map import trend
from ballscrew_tehl.nut_map.interval import TABLE_NODES
from ballscrew_tehl.parameters.file import FOUR_POINT, Parameters, load_screw
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.film import MIN_FILM, THICKEST_FILM
from ballscrew_tehl.report.data import PRELOAD_WORDS, OperatingPoint
from ballscrew_tehl.report.page import Html, environment
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import MECHANISTIC, SURFACES, map_hash
from ballscrew_tehl.tables.headings import MEASURED, MEASURED_EXAMPLE

_ROOT = importlib.resources.files("ballscrew_fmu")
_TRENDS = ["", *(trend.Trend(*at).text for at in ((True, False), (False, True), (True, True)))]
_START_SPEED, _START_TEMPERATURE = 1000.0, 303.15  # [r/min], [K]


def _source(name: str) -> Html:
    """A file of this room as it is."""
    folder = "uplot" if name.startswith(("uPlot", "LICENSE")) else "templates"
    return Html((_ROOT / "live_page" / folder / name).read_text(encoding="utf-8"))


_TEMPLATES = environment("ballscrew_fmu.live_page")
_TEMPLATES.globals["source"] = _source
_TEMPLATES.policies["json.dumps_kwargs"] = {"sort_keys": False}  # the order of the inputs


def live_page(
    parameters: Parameters,
    nut_map: NutMap,
    ends: NDArray[np.float64] | None,
    start: OperatingPoint | None = None,
) -> str:
    """The page of a screw.

    Parameters   ends : interval_table of its law with TABLE_NODES nodes; None: without interval
                 start : operating point shown first; None: that of the FMU
    Returns      HTML, the same for the same input and compiler
    Raises       BuildError: not in the package, and no ziglang, or it fails;  SourceError: a file is missing
    """
    header = nut_map.header
    law = header["law"]
    friction = header.get("friction") or {"set": "", "provenance": "", "carried_over": "", "errors": {}}
    kind = parameters.screw.preload_kind
    published, words = _published(parameters), PRELOAD_WORDS[kind]
    packed = {"wasm": _packed(contents(page_library(header))[WASM]), "map": packed_map(nut_map)}
    if ends is not None:
        packed["ends"] = _packed(_by_byte(np.asarray(ends, dtype="<f8").tobytes()))
    about = {
        "law": tuple(SURFACES).index(law),
        "lead": header.get("screw", {}).get("lead", 0.0),
        "seal": nut_map.seal_torque,
        "inputs": _inputs(header),
        "start": _start(header, start),
        "parts": [
            ("viscous_torque", "rolling" if law == MECHANISTIC else "viscous"),
            ("hysteresis_torque", "hysteresis"),
            ("sliding_torque", "sliding"),
            *([("seal_torque", "seal")] if nut_map.seal_torque else []),
        ],
        "side": words.side,
        "loaded": "nut loaded as by preload alone",
        "cautions": _cautions(parameters),
        "trend": (trend.THICK, trend.STEP_K, trend.STEP_LN, trend.MIN_CHANGE, _TRENDS),
        "slip": trend.MIN_FORCE_RATIO if law == MECHANISTIC and kind == FOUR_POINT else 0.0,
        "nodes": None if ends is None else TABLE_NODES,
        "meaning": MEANING if ends is not None else _no_interval(friction["errors"].get("mean")),
        "units": {name: {"names": q.names, "units": q.units} for name, q in MEASURED.items()},
        "published": published,
    }
    return _TEMPLATES.get_template("page.html").render(
        name=parameters.name,
        words=words,
        oil=parameters.lubricant.name,
        law=law_name(header),
        friction=friction,
        roughness=f"{1e9 * header['defaults']['roughness_height']:.3g} nm",
        inputs=[(name, entry["label"], entry["unit"]) for name, entry in about["inputs"].items()],
        published=bool(published),
        example=MEASURED_EXAMPLE,
        map_hash=map_hash(header),
        version=__version__,
        about=about,
        contents=packed,
    )


def live_frame(page: str) -> Html:
    """The page as a fragment of another one, as high as its content; not fetched, for it is in the attribute."""
    return Html(
        '<iframe class="live" title="Live page" loading="lazy" srcdoc="{}" onload="{}"></iframe>'
    ).format(page, _AS_HIGH_AS_ITS_CONTENT)


_AS_HIGH_AS_ITS_CONTENT = (
    "const main = this.contentDocument.querySelector('main'); new ResizeObserver(() => {"
    "this.style.height = Math.ceil(main.getBoundingClientRect().height) + 40 + 'px'}).observe(main)"
)


def packed_map(nut_map: NutMap) -> str:
    """Text of the map in the page, which the FMU for Python hosts reads, too (python_fmu.shared_map)."""
    return _packed(_by_byte(map_bytes(nut_map)))


def _packed(content: bytes) -> str:
    return base64.b64encode(zlib.compress(content, 9)).decode()


def _by_byte(numbers: bytes) -> bytes:
    """First bytes of all doubles, then their second ones: a fifth smaller when packed."""
    return np.frombuffer(numbers, np.uint8).reshape(-1, 8).T.tobytes()


def _inputs(header: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Fields in their order: label, unit, range of the map in this unit, kind of slider; least and most allowed."""
    axes = header["axes"]
    force = axes["force"][1]
    slow, fast = (speed / RPM for speed in axes["speed"][:2])
    cold, hot = (kelvin - CELSIUS for kelvin in axes["temperature"][:2])
    rows = {
        "preload": ("Preload", "N", axes["preload"][0], force, True),
        "speed": ("Speed", "r/min", slow, fast, True),
        "temperature": ("Oil temperature", "degC", cold, hot, False),
        "axial_load": ("Axial load", "N", -force, force, False),
    }
    names = ("label", "unit", "min", "max", "log", "least", "most")
    bounds = [[x if math.isfinite(x) else None for x in (q.min_, q.max_)] for q in TORQUE_POINT]
    fields = [(*row, *allowed) for row, allowed in zip(rows.values(), bounds, strict=True)]
    return {name: dict(zip(names, field, strict=True)) for name, field in zip(rows, fields, strict=True)}


def _cautions(parameters: Parameters) -> list[tuple[str, str, float, float | None, str]]:
    """Results with a caution: name, label, least and largest value without it, words of the command torque."""
    thickest = THICKEST_FILM * 0.5 * parameters.screw.ball_diameter
    thin = trend.too_thin(0.5 * MIN_FILM)
    thick = trend.too_thick(2.0 * thickest, 0.5 * parameters.screw.ball_diameter)
    thin, thick = (text.split(", ", 1)[1] for text in (thin, thick))
    return [
        ("film_thickness_min", "least film", MIN_FILM, None, thin),
        ("film_thickness_central_screw", "central film, screw", 0.0, thickest, thick),
        ("film_thickness_central_nut", "central film, nut", 0.0, thickest, thick),
    ]


def _start(header: Mapping[str, Any], point: OperatingPoint | None) -> dict[str, float]:
    axes = header["axes"]
    if point is None:
        speed = RPM * round(min(_START_SPEED, axes["speed"][1] / RPM))
        temperature = min(max(_START_TEMPERATURE, axes["temperature"][0]), axes["temperature"][1])
        point = OperatingPoint(start_preload(header), speed, temperature)
    speed, temperature = round(point.speed / RPM, 6), round(point.temperature - CELSIUS, 6)
    return {"preload": point.preload, "speed": speed, "temperature": temperature, "axial_load": 0.0}


def _no_interval(mean: float | None) -> str:
    fitted = "" if mean is None else f"; mean deviation from the torques of its fit {100.0 * mean:.1f} %"
    return f"no interval for this friction set{fitted}"


def _published(parameters: Parameters) -> list[dict[str, float]]:
    """Measured points that are packaged, in the units of the fields; none of another screw."""
    if parameters.screw != load_screw().screw:
        return []
    return [
        {
            "preload": m.preload,
            "speed": round(m.speed / RPM, 6),
            "temperature": round(m.temperature - CELSIUS, 2),
            "axial_load": m.axial_load,
            "torque": m.torque,
        }
        for m in packaged_measurements(ASSUMED_TEMPERATURE)
    ]
