"""What the page of the app asks: each answer follows from the content of its request alone.

A request holds the screw: numbers of a catalogue (as the options of `init`) or the text of a file, and the entries that
were changed on the page; and the operating point. The text of the screw file is composed anew each time.
"""

import base64
import contextlib
import math
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ballscrew_fmu import build
from ballscrew_tehl._version import __version__
from ballscrew_tehl.applications.axis.budget import PART_NAMES, axis_budget, budget_rows
from ballscrew_tehl.applications.calibration.measured import calibrate
from ballscrew_tehl.applications.calibration.result import calibration_data
from ballscrew_tehl.applications.calibration.written_sets import friction_sets_text
from ballscrew_tehl.applications.catalogue import CatalogueSizes, catalogue_parameters, rating_ratios
from ballscrew_tehl.applications.cli.parser import COMMANDS
from ballscrew_tehl.applications.cli.shared.output import to_builtin
from ballscrew_tehl.applications.export.files import SUFFIXES, TableOptions, friction_files
from ballscrew_tehl.applications.identification.axis_log import StatedAxis, identify_log
from ballscrew_tehl.applications.quantities import DIFFERENCE, MAX_FORCE, TORQUE_POINT, Quantity
from ballscrew_tehl.applications.report.data import OperatingPoint, default_point
from ballscrew_tehl.applications.screw_model import ScrewModel, model_of
from ballscrew_tehl.applications.torque_curve import torque_over_speed
from ballscrew_tehl.applications.torque_point import torque_at_point
from ballscrew_tehl.applications.trend import too_thick
from ballscrew_tehl.friction.drag_torque import implied_preload
from ballscrew_tehl.friction.sets import FrictionSet, carried_over, friction_set_of_file
from ballscrew_tehl.parameters.entries import ScrewEntry, changed_text, screw_entries
from ballscrew_tehl.parameters.file import Parameters, screw_of
from ballscrew_tehl.parameters.template import example_parameters, screw_template
from ballscrew_tehl.parameters.toml import ParameterError, Problem, entry_text
from ballscrew_tehl.parameters.units import CELSIUS, RPM, SHOWN
from ballscrew_tehl.runtime.evaluate import NutMap

Content = Mapping[str, Any]
Report = Callable[[int, int, str], None]
#: options of init that are numbers of a catalogue, in the order of the form
SIZES = (
    "diameter_mm", "lead_mm", "ball_mm", "root_mm", "circle_mm", "turns", "starts", "nut_kind", "hand", "rating_n",
    "static_rating_n", "lubricant", "oil_grade",
)  # fmt: skip
#: labels that are not the first words of the option's help
LABELS = {
    "diameter_mm": "nominal diameter",
    "turns": "loaded turns",
    "nut_kind": "kind of nut",
    "lubricant": "lubricant",
}
ENTRIES = {(entry.table, entry.key): entry for entry in screw_entries()}
POINT = (*TORQUE_POINT, DIFFERENCE)
#: most characters of a field; least preload [N] and speed [r/min]
MOST_TEXT, LEAST = 200, 1e-3
#: of the curve
POINTS, SLOWEST = 25, 1.0
#: options of identify that a log may need, and their labels
QUESTIONS = {
    "torque_constant_nm_a": "torque constant of the motor", "gain_n_v": "gain of a voltage",
    "ratio": "turns of the motor for one of the screw", "temperature_c": "oil temperature",
    "inertia_kgm2": "known inertia at the screw", "mass_kg": "known moved mass",
    "guide_force_n": "friction of the guide", "seal_torque_nm": "friction of seals and bearings",
}  # fmt: skip
#: oil of a screw without one
ASSUMED_OIL = {"lubricant": "oil", "oil_grade": "100"}
#: labels of entries that are not their names
ENTRY_LABELS = {
    "iso_vg": "ISO VG", "nlgi": "NLGI grade", "density_15c": "density at 15 C", "z_roelands": "exponent z of Roelands",
    "youngs_modulus": "Young's modulus", "ball_youngs_modulus": "Young's modulus of the balls",
    "nominal_radius": "radius of the ball centres", "preload_basis": "preload means",
}  # fmt: skip
#: units as they are written, of those in keys and help
UNITS = {
    "C": "\u00b0C", "degC": "\u00b0C", "deg": "\u00b0", "per/K": "1/K", "per/GPa": "1/GPa", "rpm": "r/min",
    "mm2": "mm\u00b2", "um": "\u00b5m", "Nm": "N m", "Pas": "Pa s", "kgm2": "kg m\u00b2", "Ns/m": "N s/m",
    "kg/m3": "kg/m\u00b3", "J/kgK": "J/(kg K)", "W/mK": "W/(m K)", "mm2/s": "mm\u00b2/s", "N/um": "N/\u00b5m",
}  # fmt: skip
#: unit at the end of the name of an option
UNIT_OF_OPTION = re.compile(r"-(?:nm-a|n-v|kgm2|percent|deg|nm|mm|rpm|um|n|c|k)$")


class Screw(NamedTuple):
    """Screw of a request: text of its file, what is assumed of it, the screw with the numbers of its friction law."""

    text: str
    assumed: dict[str, str]
    model: ScrewModel

    @property
    def parameters(self) -> Parameters:
        """Screw and oil."""
        return self.model.parameters

    def inputs(self, report: Report) -> build.Inputs:
        """With its map, kept or made now."""
        return build.Inputs(self.parameters, self.model.nut_map(report), self.model.friction_set)


def refused(entry: str, value: Any, allowed: str, remedy: str) -> ParameterError:
    """A problem of one field."""
    problem = Problem(entry, value, allowed, remedy)
    return ParameterError(str(problem), [problem])


def decimal(text: str, where: str, allowed: str, unit: str = "") -> float:
    """A number as people write it, also with its unit; one that two readings have is refused."""
    if len(text) > MOST_TEXT:
        raise refused(where, f"{len(text)} characters", allowed, "check it")
    text = text.strip().replace("\u2212", "-")
    text = text.removesuffix(written(unit) if text.endswith(written(unit)) else unit).rstrip()
    if re.fullmatch(r"[+-]?[1-9]\d{0,2}[,.]\d{3}", text) and "," in text:
        both = f"{text.replace(',', '')} or {text.replace(',', '.')}"
        raise refused(where, text, allowed, f"write {both}")
    try:
        number = float(text.replace(",", ".", 1))
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise refused(where, text, allowed, "needs a number")
    return number


def entry_value(entry: ScrewEntry, text: str) -> Any:
    """Value of an entry from the text of its field; None of an empty one."""
    where, allowed, unit = f"{entry.table}.{entry.key}", allowed_text(entry), unit_of(entry)
    if len(text) > MOST_TEXT:
        raise refused(where, f"{len(text)} characters", f"up to {MOST_TEXT}", "check it")
    if not (text := " ".join(text.split())):
        return None
    if entry.kind in ("choice", "text"):
        return text
    if entry.kind == "switch":
        if (word := text.lower()) not in ("true", "false"):
            raise refused(where, text, "true, false", "choose one")
        return word == "true"
    if entry.key == "turns" and re.search("[xX*\u00d7]", text):
        return text
    if entry.kind == "range":
        parts = [part for part in re.split(r"\s*(?:;|\bto\b|\.\.\.|, )\s*", text.strip("[]")) if part]
        if not 1 <= len(parts) <= 2:
            raise refused(where, text, "a number, or two as 8 to 12", "check it")
        numbers = [decimal(part, where, "a number, or two as 8 to 12", unit) for part in parts]
        return numbers if len(numbers) == 2 else numbers[0]
    if text.lower() in ("inf", "flooded"):
        return math.inf
    number = decimal(text, where, allowed, unit)
    return int(number) if entry.kind == "whole" and number == int(number) else number


def written(unit: str) -> str:
    """A unit of a key or of help as it is written."""
    return UNITS.get(unit, unit)


def unit_of(entry: ScrewEntry) -> str:
    """Unit of an entry, "": none."""
    return entry.unit.replace("_", "/")


def unit_in(meaning: str) -> str:
    """Unit in the brackets of the help of an option, "": none."""
    return meaning.rpartition("[")[2].partition("]")[0] if "[" in meaning else ""


def allowed_text(entry: ScrewEntry) -> str:
    """What an entry may be, in words."""
    unit = unit_of(entry)
    if entry.choices:
        return ", ".join(entry.choices)
    low, high = entry.minimum, entry.maximum
    parts = [] if low is None else [f"{'more than' if entry.exclusive else 'at least'} {low:g}"]
    parts += [] if high is None else [f"up to {high:g}"]
    return ", ".join(parts) + (f" {unit}" if unit and parts else "")


def page_words(text: str) -> str:
    """A message of a command in words of the page: names of fields for options."""
    text = re.sub(r"; all: --json, --output|; to leave it out: --drop \S+| \(preload_basis\)", "", text)
    text = re.sub(r"--without-nut LOG\.csv", "a log without the nut", text)
    return re.sub(
        r"--([a-z][a-z0-9-]+)", lambda found: UNIT_OF_OPTION.sub("", found[1]).replace("-", " "), text
    )


def form(content: Content, report: Report) -> dict[str, Any]:
    """Fields of the page: numbers of a catalogue, operating point, entries of the file by group."""
    options = {flag.removeprefix("--").replace("-", "_"): one for flag, one in COMMANDS["init"].options}
    sizes = []
    for name in SIZES:
        settings, kind = options[name], options[name].get("type")
        unit, words = size_unit(name), list(settings.get("choices") or ())
        allowed = kind.allowed if isinstance(kind, Quantity) else ", ".join(words)
        label = LABELS.get(name) or re.split(r"[;\[,]", settings["help"])[0].strip()
        sizes.append({"name": name, "label": label, "unit": unit, "meaning": settings["help"], "allowed": allowed,
                      "choices": words, "default": ASSUMED_OIL.get(name)})  # fmt: skip
    groups: dict[str, dict[str, Any]] = {}
    for entry in ENTRIES.values():
        group = groups.setdefault(entry.table, {"title": entry.group, "table": entry.table, "entries": []})
        label = ENTRY_LABELS.get(entry.field, entry.field.replace("_", " "))
        group["entries"].append(
            {"name": f"{entry.table}.{entry.key}", "label": label, "unit": written(unit_of(entry)),
             "kind": entry.kind, "choices": list(entry.choices), "meaning": entry.meaning,
             "allowed": allowed_text(entry), "default": entry.default}
        )  # fmt: skip
    point = [
        {"name": one.name, "label": one.axis.replace("_", " "), "unit": written(unit_in(one.help)),
         "meaning": one.help, "allowed": one.allowed}
        for one in POINT
    ]  # fmt: skip
    return {"sizes": sizes, "groups": list(groups.values()), "point": point, "version": __version__}


def screw(content: Content) -> Screw:
    """The screw of a request."""
    text, assumed = str(content.get("text") or ""), dict[str, str]()
    if not text:
        text, assumed = catalogue_text(dict(content.get("sizes") or {}))
    problems: list[Problem] = []
    for name, value in dict(content.get("changes") or {}).items():
        table, _, key = name.partition(".")
        if (table, key) not in ENTRIES and name != "name":
            raise refused(name, value, "an entry of a screw file", "reload the page")
        try:
            new = entry_value(ENTRIES[table, key], str(value)) if key else str(value)
            text = changed_text(text, table if key else "", key or "name", new)
            assumed.pop(ENTRIES[table, key].field if key else "", None)
        except ParameterError as error:
            problems += error.problems or [Problem(name, value, "a change of the text", str(error))]
    if problems:
        raise ParameterError(str(problems[0]), problems)
    parameters = screw_of(text)
    return Screw(text, assumed, model_of(parameters, fitted_set(content, parameters)))


def catalogue_text(stated: dict[str, Any]) -> tuple[str, dict[str, str]]:
    """Screw file by numbers of a catalogue; fields that are assumed, with what they follow from."""
    values: dict[str, Any] = {}
    problems: list[Problem] = []
    for flag, settings in COMMANDS["init"].options:
        name, kind = flag.removeprefix("--").replace("-", "_"), settings.get("type")
        text = str(stated.pop(name, None) or "").strip()
        if not text or name not in SIZES:
            continue
        try:
            values[name] = kind(_plain(text, name, kind)) if kind else text
            if (words := settings.get("choices")) and text not in words:
                raise refused(name, text, ", ".join(words), "choose one")
        except ParameterError as error:
            problems += error.problems
        except ValueError as error:
            problems.append(
                Problem(name, text, str(error).partition("allowed: ")[2] or str(error), "check it")
            )
    problems += [
        Problem(name, value, "a number of a catalogue", "reload the page") for name, value in stated.items()
    ]
    for name in ("diameter_mm", "lead_mm"):
        if name not in values and not any(problem.entry == name for problem in problems):
            problems.append(Problem(name, None, "a number", "a screw needs its diameter and lead"))
    if problems:
        raise ParameterError(str(problems[0]), problems)
    like = example_parameters("viscosities", values.pop("lubricant", "oil"), int(values.pop("oil_grade", 0)))
    parameters, assumed = catalogue_parameters(CatalogueSizes(**values), like)
    return screw_template(parameters, assumed, axis=True), assumed


def size_unit(name: str) -> str:
    """Unit of a number of a catalogue, "": none."""
    return {"mm": "mm", "n": "N"}.get(name.rpartition("_")[2], "")


def _plain(text: str, name: str, kind: Any) -> str:
    """Text of a number with a decimal point; turns may be a product."""
    if not isinstance(kind, Quantity):
        return text
    number = decimal(text, name, kind.allowed, size_unit(name))
    return str(int(number)) if number == int(number) else repr(number)


def fitted_set(content: Content, parameters: Parameters) -> FrictionSet | None:
    """Friction set that a calibration on the page has written."""
    if not (text := content.get("fitted")):
        return None
    with temporary_folder() as folder:
        path = Path(folder, "fitted.toml")
        path.write_text(str(text), encoding="utf-8")
        return friction_set_of_file(str(path), parameters)


def point_of(content: Content, parameters: Parameters) -> dict[str, float]:
    """Operating point by name, in the units of the options; an empty field has its default."""
    usual = default_point(parameters)
    defaults = {
        "preload_n": usual.preload, "speed_rpm": usual.speed / RPM, "temperature_c": usual.temperature - CELSIUS,
        "axial_load_n": 0.0, "temperature_difference_k": 0.0,
    }  # fmt: skip
    stated, point = dict(content.get("point") or {}), {}
    for one in POINT:
        text = str(stated.get(one.name, "")).strip()
        number = (
            decimal(text, one.name, one.allowed, unit_in(one.help))
            if text
            else float(f"{defaults[one.name]:.4g}")
        )
        # a preload of 0 is a nut with clearance; one of next to nothing has no solution in numbers
        small = abs(number) < LEAST and (
            one.name == "speed_rpm" or (one.name == "preload_n" and number != 0.0)
        )
        if small or not (one.min_ <= number <= one.max_ and abs(number) <= MAX_FORCE):
            allowed = f"{LEAST:g} to {MAX_FORCE:g}" if one.name in ("preload_n", "speed_rpm") else one.allowed
            raise refused(one.name, text, allowed, "check number and unit")
        point[one.name] = number
    return point


def torque(content: Content, report: Report) -> dict[str, Any]:
    """Values of all fields, torque over speed with its interval, without a map."""
    one = screw(content)
    point = point_of(content, one.parameters)
    highest = max(abs(point["speed_rpm"]), 3000.0)
    speeds = np.unique([*np.geomspace(SLOWEST, highest, POINTS), abs(point["speed_rpm"])])
    at = point["preload_n"], speeds * RPM, point["temperature_c"] + CELSIUS
    loads = point["axial_load_n"], point["temperature_difference_k"]
    curve = torque_over_speed(one.parameters, *at, *loads, one.model.friction_set)
    k = int(np.searchsorted(speeds, abs(point["speed_rpm"])))
    return to_builtin({
        "text": one.text, "name": one.parameters.name, "oil": one.parameters.lubricant.name, "point": point,
        "values": shown_values(one), "speed_rpm": speeds, "torque": curve.torque, "low": curve.low, "high": curve.high,
        "at": [curve.torque[k], curve.low[k], curve.high[k]], "meaning": page_words(curve.meaning),
        "ratings": rating_ratios(one.parameters.screw),
        "implied": implied_preload(one.model.friction_set, point["preload_n"]), "notes": notes_of(one, point),
    })  # fmt: skip


def notes_of(one: Screw, point: Mapping[str, float]) -> list[str]:
    """What to know of the torque of a screw: numbers of another screw, what catalogues print, its grease."""
    law, oil, found = one.model.friction_set, one.parameters.lubricant, list(one.model.notes)
    if other := carried_over(law, one.parameters):
        printed = one.model.printed(point["preload_n"])["catalogue_torque_nm"]
        found.append(other.replace("100 r/min)", f"100 r/min: {printed:.3g} N m)"))
    if oil.nlgi is not None and "grease" not in "".join(found):
        found.append("a grease counts with its base oil; its churning is in no number: run it in")
    return found


def shown_values(one: Screw) -> dict[str, dict[str, Any]]:
    """Text of the value of each entry, whether the file states it, and what an assumed one follows from."""
    values = {}
    for (table, key), entry in ENTRIES.items():
        of_table, field = getattr(one.parameters, table), entry.field
        if of_table is None:
            continue
        line = entry_text(type(of_table).entries()[field], getattr(of_table, field), "", 8)
        text = line.partition(" = ")[2]
        values[f"{table}.{key}"] = {
            "value": text.strip('"'), "stated": field in of_table.model_fields_set,
            "assumed": one.assumed.get(field, "") if table == "screw" else "",
        }  # fmt: skip
    return values


def page(content: Content, report: Report) -> dict[str, Any]:
    """The live page, and the numbers of the command torque at the point, by the map."""
    one = screw(content)
    point = point_of(content, one.parameters)
    inputs = one.inputs(report)
    text = inputs.live_page(OperatingPoint(*si_of(point)), partial(report, 1, 3, "intervals"))
    report(2, 3, "budget")
    nut_map = inputs.nut_map
    at, notes = at_point(one, nut_map, point)
    answer = {"html": text, "at": at, "notes": notes, "budget": budget(one, nut_map, point)}
    report(3, 3, "live page")
    return to_builtin(answer)


def si_of(point: Mapping[str, float]) -> tuple[float, float, float]:
    """Preload [N], magnitude of the speed [rad/s], temperature [K]."""
    return point["preload_n"], abs(point["speed_rpm"]) * RPM, point["temperature_c"] + CELSIUS


def at_point(one: Screw, nut_map: NutMap, point: Mapping[str, float]) -> tuple[list[float], list[str]]:
    """Torque and ends of its interval, as the command torque prints them; why they do not hold."""
    loads, axes, notes = (
        (point["axial_load_n"], point["temperature_difference_k"]),
        nut_map.header["axes"],
        [],
    )
    found = torque_at_point(one.model, nut_map, *si_of(point), *loads)
    state = found.state
    if state.clamped:
        names = {name: name.replace("_", " ") for name in state.clamped}
        for name in names.keys() & axes.keys() & SHOWN.keys():
            low, high = (f"{SHOWN[name].of(end):.4g}" for end in axes[name][:2])
            names[name] += f" (its range {low} to {high} {SHOWN[name].unit})"
        where = ", ".join(names.values())
        notes.append(
            f"outside the map of this screw: {where}; the numbers are those of its edge, or extrapolated"
        )
    thickest = max(state.film_thickness_central_screw, state.film_thickness_central_nut)
    notes += [too_thick(thickest, 0.5 * one.parameters.screw.ball_diameter), found.trend, found.unlike]
    return [float(state.friction_torque), *found.ends(nut_map.seal_torque)], list(filter(None, notes))


def budget(one: Screw, nut_map: NutMap, point: Mapping[str, float]) -> dict[str, Any] | None:
    """Budget of the axis at the point, where the file has a table of one."""
    if not one.parameters.has_axis:
        return None
    loads = point["axial_load_n"], point["temperature_difference_k"]
    found = axis_budget(one.parameters, nut_map, one.model.friction_set, *si_of(point), *loads)
    return budget_rows(found, one.parameters.screw)[0] | {"names": PART_NAMES, "notes": found.notes}


def fmus(content: Content, report: Report) -> dict[str, Any]:
    """All FMUs, checked, in an archive."""
    one = screw(content)
    files = {"screw.toml": one.text} | (
        {"friction.toml": str(content["fitted"])} if content.get("fitted") else {}
    )
    packed, lines = build.fmu_archive(one.inputs(report), files, report)
    return file_answer(one, "fmus.zip", packed) | {"lines": lines}


def report_page(content: Content, report: Report) -> dict[str, Any]:
    """The report, to be shown, printed or kept."""
    one = screw(content)
    inputs, point = one.inputs(report), si_of(point_of(content, one.parameters))
    report(0, 1, "report")
    text = inputs.report(OperatingPoint(*point)._asdict())
    return file_answer(one, "report.html", text.encode()) | {"html": text}


def file_answer(one: Screw, name: str, content: bytes) -> dict[str, Any]:
    """A file to take away, named by the screw."""
    stem = re.sub(r"[^\w.-]+", "_", one.parameters.name, flags=re.ASCII).strip("._") or "screw"
    return {"file": f"{stem}_{name}", "base64": base64.b64encode(content).decode()}


@contextlib.contextmanager
def temporary_folder() -> Iterator[str]:
    """A folder that goes with the answer, and is in no message."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            yield folder
        except ValueError as error:
            text = re.sub(re.escape(folder) + r"[/\\]\S+?(?=[:,; ]|$)", "the file", str(error))
            raise ParameterError(page_words(text), getattr(error, "problems", ())) from error


def uploaded(content: Content, folder: str) -> Path:
    """The dropped file, in a folder that goes with the answer; its own name becomes no path."""
    try:
        data = base64.b64decode(str(content.get("data") or ""), validate=True)
    except ValueError:
        raise refused("file", "", "its content", "drop the file again") from None
    path = Path(folder, "dropped.csv")
    path.write_bytes(data)
    return path


def table(content: Content, report: Report) -> dict[str, Any]:
    """Friction of the screw over speed for a controller or a tool, as the command export writes it."""
    one = screw(content)
    name = str(content.get("format"))
    if name not in SUFFIXES:
        raise refused("format", name, ", ".join(SUFFIXES), "choose one")
    point = point_of(content, one.parameters)
    options = TableOptions([point["preload_n"]], [point["temperature_c"]])
    if name == "twincat":
        motor = "torque_constant_nm_a"
        if not (constant := str(content.get(motor) or "").strip()):
            raise refused(motor, None, "N.m/A", "the list is a motor current: enter it above")
        number = option_value("export", motor, repr(decimal(constant, motor, "N.m/A, more than 0")))
        options = options._replace(torque_constant_nm_a=number)
    (file,) = friction_files(f"friction{SUFFIXES[name][0]}", name, one.model, options, report)
    return file_answer(one, file.path.name, file.text.encode())


def option_value(command: str, name: str, text: str) -> Any:
    """Value of an option of a command from its text; its allowed range is that of the command."""
    flag = f"--{name.replace('_', '-')}"
    try:
        return dict(COMMANDS[command].options)[flag]["type"](text)
    except ValueError as error:
        raise ValueError(f"{flag}{error}" if str(error).startswith(" = ") else f"{flag}: {error}") from error


def with_points(text: str, name: str) -> str:
    """Text with decimal points for commas; a number that two readings have is refused."""
    return re.sub(r"[+-]?\d+,\d+", lambda found: repr(decimal(found[0], name, "a number")), text)


def questions(content: Content, report: Report) -> dict[str, Any]:
    """What a log may need, as fields."""
    known = dict(COMMANDS["identify"].options)
    found = []
    for name in QUESTIONS:
        kind = known[f"--{name.replace('_', '-')}"]
        found.append(
            {
                "name": name,
                "label": QUESTIONS[name],
                "meaning": kind["help"],
                "unit": written(unit_in(kind["help"])),
            }
        )
    return {"questions": found}


def identification(content: Content, report: Report) -> dict[str, Any]:
    """What a log of the drive says: as the command identify, with its picture."""
    from ballscrew_tehl.applications.calibration.plot import png_of

    one, stated = screw(content), {}
    for name, text in dict(content.get("answers") or {}).items():
        if name not in QUESTIONS:
            raise refused(name, text, ", ".join(QUESTIONS), "reload the page")
        if str(text).strip():
            stated[name] = option_value("identify", name, with_points(str(text).strip(), name))
    report(0, 1, "fit of the log")
    lead_alone = not content.get("fitted")
    with temporary_folder() as folder:
        law = StatedAxis(**stated), one.model
        found = identify_log(uploaded(content, folder), *law, lead_alone=lead_alone, progress=report)
    picture = base64.b64encode(png_of(found.figure())).decode()
    return to_builtin({"text": page_words(found.text), "picture": picture, "answer": found.data})


def calibration(content: Content, report: Report) -> dict[str, Any]:
    """Fit to measured torques: points, curve before and after, friction set as a file."""
    from ballscrew_tehl.applications.calibration.plot import calibration_figure, png_of

    one = screw({**content, "fitted": ""})
    percent = str(content.get("torque_tolerance_percent") or "")
    tolerance = 0.01 * decimal(percent, "torque_tolerance_percent", "0 to 95 %") if percent else 0.0
    with temporary_folder() as folder:
        path = uploaded(content, folder)
        result = calibrate(path, one.parameters, torque_tolerance=tolerance, progress=report)
    text = friction_sets_text([result.friction_set], "Fitted by ballscrew app")
    data = calibration_data(result)
    shown = "preload_n", "speed_rpm", "measured_nm", "computed_nm", "deviation", "outlier"
    answer = {
        "fitted": text, "points": [{name: row[name] for name in shown} for row in data["points"]],
        "notes": list(map(page_words, data["notes"])),
        "picture": base64.b64encode(png_of(calibration_figure(result))).decode(),
    }  # fmt: skip
    return to_builtin(answer | file_answer(one, "friction.toml", text.encode()))
