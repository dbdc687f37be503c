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
from scipy.interpolate import CubicSpline

from ballscrew_fmu.native_fmu.compile import WASM
from ballscrew_fmu.native_fmu.libraries import contents, page_library
from ballscrew_fmu.native_fmu.resource_files import map_bytes
from ballscrew_fmu.variables.friction import law_name, origin_text, start_preload
from ballscrew_tehl import __version__
from ballscrew_tehl.applications import trend
from ballscrew_tehl.applications.axis.bearing_pair import pair_of
from ballscrew_tehl.applications.axis.budget import PART_NAMES
from ballscrew_tehl.applications.axis.parts import other_parts, weight_along_axis
from ballscrew_tehl.applications.calibration.measured_screw import ASSUMED_TEMPERATURE, packaged_measurements
from ballscrew_tehl.applications.quantities import TORQUE_POINT
from ballscrew_tehl.applications.report.data import PRELOAD_WORDS, OperatingPoint
from ballscrew_tehl.applications.report.page import Html, environment
from ballscrew_tehl.applications.tables.headings import MEASURED, MEASURED_EXAMPLE
from ballscrew_tehl.friction.interval import meaning
from ballscrew_tehl.nut_map.interval import TABLE_NODES
from ballscrew_tehl.parameters.file import FOUR_POINT, Parameters, load_screw
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.film import MIN_FILM, THICKEST_FILM
from ballscrew_tehl.runtime.constants import HELD
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import SURFACES, Law, map_hash

_TRENDS = ["", *(trend.Trend(*at).text for at in ((True, False), (False, True), (True, True)))]
#: speeds and temperatures at which the page has the friction of bearings and other parts of an axis
AXIS_NODES = 24, 13
_START_SPEED, _START_TEMPERATURE = 1000.0, 303.15  # [r/min], [K]


def _source(name: str) -> Html:
    """A file of this room as it is."""
    folder = "uplot" if name.startswith(("uPlot", "LICENSE")) else "templates"
    place = importlib.resources.files("ballscrew_fmu") / "live_page" / folder / name
    return Html(place.read_text(encoding="utf-8"))


_TEMPLATES = environment("ballscrew_fmu.live_page")
_TEMPLATES.globals["source"] = _source
_TEMPLATES.policies["json.dumps_kwargs"] = {"sort_keys": False}  # the order of the inputs


def live_page(
    parameters: Parameters,
    nut_map: NutMap,
    ends: NDArray[np.float64] | None,
    start: OperatingPoint | None = None,
) -> str:
    """The page of a screw in HTML, the same for the same input and compiler; BuildError: not compiled.

    ends: interval_table of its law with TABLE_NODES nodes; None: without interval
    start: operating point shown first, of the report that has the page in it; None: that of the FMU
    """
    header, law = nut_map.header, nut_map.law
    band = header.get("mechanistic_interval", {})
    friction = header.get("friction") or {"set": "", "provenance": "", "carried_over": "", "errors": {}}
    kind = parameters.screw.preload_kind
    published, words, mean = _published(parameters), PRELOAD_WORDS[kind], friction["errors"].get("mean")
    caution = "" if start else origin_text(header, "")
    fitted = "" if mean is None else f"; mean deviation from the torques of its fit {100.0 * mean:.1f} %"
    packed = {"wasm": _packed(contents(page_library(header))[WASM]), "map": packed_map(nut_map)}
    if ends is not None:
        packed["ends"] = _packed_numbers(np.asarray(ends, dtype="<f8").tobytes())
    about = {
        "law": tuple(SURFACES).index(law),
        "lead": header.get("screw", {}).get("lead", 0.0),
        "seal": nut_map.seal_torque,
        "inputs": _inputs(header),
        "start": _start(header, start) | {"axial_load": round(weight_along_axis(parameters), 3)},
        "parts": [
            ("viscous_torque", "rolling" if law == Law.MECHANISTIC else "viscous"),
            ("hysteresis_torque", "hysteresis"),
            ("sliding_torque", "sliding"),
            *([("seal_torque", "seal")] if nut_map.seal_torque else []),
        ],
        "side": words.side,
        "loaded": "nut loaded as by preload alone",
        "cautions": _cautions(parameters),
        "trend": (trend.THICK, trend.STEP_K, trend.STEP_LN, trend.MIN_CHANGE, _TRENDS),
        "slip": HELD if law == Law.MECHANISTIC and kind == FOUR_POINT else 0.0,
        "nodes": None if ends is None else TABLE_NODES,
        "meaning": meaning(band["fitted"], band["nominal"])
        if ends is not None
        else f"no interval for this friction set{fitted}",
        "units": {name: {"names": q.names, "units": q.units} for name, q in MEASURED.items()},
        "published": published,
        "axis": _around(parameters, header["axes"]),
    }
    return _TEMPLATES.get_template("page.html").render(
        name=parameters.name,
        words=words,
        oil=parameters.lubricant.name,
        law=law_name(header),
        friction=friction,
        caution=caution,
        roughness=f"{1e9 * header['defaults']['roughness_height']:.3g} nm",
        inputs=[(name, entry["label"], entry["unit"]) for name, entry in about["inputs"].items()],
        published=bool(published),
        axis=about["axis"] is not None,
        example=MEASURED_EXAMPLE,
        map_hash=map_hash(header),
        version=__version__,
        about=about,
        contents=packed,
    )


def live_frame(page: str) -> Html:
    """The page as a fragment of another one, as high as its content; not fetched, for it is in the attribute."""
    high = (
        "const main = this.contentDocument.querySelector('main'); new ResizeObserver(() => {"
        "this.style.height = Math.ceil(main.getBoundingClientRect().height) + 40 + 'px'}).observe(main)"
    )
    frame = '<iframe class="live" title="Live page" loading="lazy" srcdoc="{}" onload="{}"></iframe>'
    return Html(frame).format(page, high)


def packed_map(nut_map: NutMap) -> str:
    """Text of the map in the page, which the FMU for Python hosts reads, too (python_fmu.shared_map)."""
    return _packed_numbers(map_bytes(nut_map))


def _packed_numbers(numbers: bytes) -> str:
    """Text of doubles: first bytes of all, then their second ones: a fifth smaller."""
    return _packed(np.frombuffer(numbers, np.uint8).reshape(-1, 8).T.tobytes())


def _packed(content: bytes) -> str:
    return base64.b64encode(zlib.compress(content, 9)).decode()


def _inputs(header: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Fields in their order: label, unit, range of the map in this unit, kind of slider; least and most allowed."""
    axes = header["axes"]
    force = axes["force"][1]
    slow, fast = (speed / RPM for speed in axes["speed"][:2])
    cold, hot = (kelvin - CELSIUS for kelvin in axes["temperature"][:2])
    rows = (
        ("preload", "Preload", "N", axes["preload"][0], force, True),
        ("speed", "Speed", "r/min", slow, fast, True),
        ("temperature", "Oil temperature", "degC", cold, hot, False),
        ("axial_load", "Axial load", "N", -force, force, False),
    )
    names = ("label", "unit", "min", "max", "log", "least", "most")
    inputs = {}
    for (name, *row), q in zip(rows, TORQUE_POINT, strict=True):
        allowed = [x if math.isfinite(x) else None for x in (q.min_, q.max_)]
        inputs[name] = dict(zip(names, (*row, *allowed), strict=True))
    return inputs


def _around(parameters: Parameters, axes: Mapping[str, Any]) -> dict[str, Any] | None:
    """Friction at the screw of what stands around the nut: label, [temperature][speed] of value, low, high [N.m].

    Without force of the process. None: the screw file has no such table.
    """
    (slow, fast), (cold, hot) = (axes[name][:2] for name in ("speed", "temperature"))
    speeds, temperatures = np.geomspace(slow, fast, AXIS_NODES[0]), np.linspace(cold, hot, AXIS_NODES[1])
    coarse = [
        other_parts(parameters, speeds, float(kelvin)) for kelvin in temperatures[:: AXIS_NODES[1] // 2]
    ]
    values = {name: np.array([part] * len(temperatures)).swapaxes(0, 1) for name, part in coarse[0].items()}
    if not values:
        return None
    if "support_bearings" in values:
        # intervals take most of the time, and have fewer temperatures: the high end, flooded, falls evenly with it,
        # while the rest may starve
        rows = pair_of(parameters).table(speeds, temperatures, weight_along_axis(parameters)).T
        torque, low, high = np.log([at["support_bearings"] for at in coarse]).swapaxes(0, 1)
        nodes = temperatures[:: AXIS_NODES[1] // 2]
        below, above = (
            CubicSpline(nodes, of, bc_type="natural")(temperatures) for of in (low - torque, high)
        )
        values["support_bearings"] = np.array([rows, rows * np.exp(below), np.maximum(rows, np.exp(above))])
    parts = [(PART_NAMES[name], table.round(6).tolist()) for name, table in values.items()]
    return {
        "speeds": (speeds / RPM).tolist(),
        "temperatures": (temperatures - CELSIUS).tolist(),
        "parts": parts,
    }


def _cautions(parameters: Parameters) -> list[tuple[str, str, float, float | None, str]]:
    """Results with a caution: name, label, least and largest value without it, words of the command torque."""
    radius = 0.5 * parameters.screw.ball_diameter
    thickest = THICKEST_FILM * radius
    texts = trend.too_thin(0.5 * MIN_FILM), trend.too_thick(2.0 * thickest, radius)
    thin, thick = (text.split(", ", 1)[1] for text in texts)
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


def _published(parameters: Parameters) -> list[dict[str, float]]:
    """Measured points that are packaged, in the units of the fields; none of another screw."""
    if parameters.screw != load_screw().screw:
        return []
    keys = ("preload", "speed", "temperature", "axial_load", "torque")
    points = (
        (m.preload, round(m.speed / RPM, 6), round(m.temperature - CELSIUS, 2), m.axial_load, m.torque)
        for m in packaged_measurements(ASSUMED_TEMPERATURE)
    )
    return [dict(zip(keys, point, strict=True)) for point in points]
