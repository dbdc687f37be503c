"""The parts of the page, of the paper's screw and of any other one."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .. import __version__
from ..friction.baselines import nsk_torque
from ..friction.origin import carried_over
from ..friction.sets import FITTED, NO_SPLIT, SETS
from ..nut_map.trend import THICK
from ..parameters.file import FOUR_POINT, Parameters
from ..parameters.units import CELSIUS, RPM
from ..physics.hertz import RACEWAYS
from ..runtime.packed import MECHANISTIC
from . import contact_figures, figures
from .claims import VERDICTS, Claim
from .contact_figures import FIELDS
from .errata import Erratum
from .figures import CATALOGUE_RPM
from .lines import Friction, Lines, Progress
from .map_section import nut_map
from .material import Material
from .page import Html, element, figure, page, paragraph, section, table, tiles
from .page import figures as side_by_side
from .paper import TITLE as PAPER_TITLE
from .paper import paper
from .screw_section import films, key_tiles, mechanics, oil, point_note, sizes
from .tables import percent_of, validation_table, words

if TYPE_CHECKING:
    from ..contact import ContactResult

PAPER = "https://doi.org/10.1007/s00170-022-09524-2"
NAMES = {
    "apparent_viscosity_ratio": "apparent viscosity ratio",
    "net_sliding_coefficient": "net sliding coefficient",
    "roughness_height": "roughness height [nm]",
}


#: cell of a number that a set does not have
UNKNOWN = "-"
#: least share of the variance of an interval that is shown
LEAST_SHARE = 1e-3
#: a step of the progress
PAGE_STEP = "parts of the page"


class Part(NamedTuple):
    """A numbered part of the page: anchor, name in the list of links, title, what writes its content."""

    name: str
    link: str
    title: str
    content: Callable[[], Sequence[Html]]


def intro(material: Material, claimed: Sequence[Claim]) -> list[Html]:
    """Summary with the most important numbers."""
    parameters, header = material.parameters, material.picture.nut_map.header
    content = [
        paragraph(
            f"Friction torque of a preloaded {material.balls.words.screw}, computed from its contacts: the load of "
            "every ball, the oil film in every contact by thermal elastohydrodynamic lubrication, then "
            "viscous, hysteresis and sliding friction.",
            class_="lead",
        ),
        tiles(_paper_tiles(material, claimed) if material.measured else key_tiles(material)),
    ]
    if not material.measured:
        content.append(point_note(material))
    if other := carried_over(material.chosen.entry, parameters):
        force = material.screw.point.preload
        catalogue = float(nsk_torque(parameters.screw, force))
        content.append(
            paragraph(
                f"{other[0].upper()}{other[1:]}. At {force:.0f} N it is {catalogue:.3f} N m.", class_="note"
            )
        )
    contents = [
        ("screw", parameters.name),
        ("oil", parameters.lubricant.name),
        ("kinematics", words(parameters.friction.kinematics)),
        (
            "friction set",
            f"{words(material.chosen.entry.name)}, film: {words(material.chosen.entry.film_model)}",
        ),
        ("program", f"ballscrew_tehl {__version__}; the map was built by {header['version']}"),
        ("map", element("code", str(header["file_hash"]))),
    ]
    return [*content, table("identity", "What this report is about", ("", ""), contents, text=True)]


def _paper_tiles(material: Material, claimed: Sequence[Claim]) -> list[tuple[str, str]]:
    """Deviations from the measurement, statements reproduced."""
    tables = {t.name: t for t in material.tables[material.chosen.entry.name]}
    shown = [
        (percent_of(tables[name].deviations[0]), what)
        for name, what in (
            ("table2", "mean deviation over preload (Table 2)"),
            ("table4", "mean deviation over speed (Table 4)"),
            ("table3", "mean deviation of the preload found from the torque (Table 3)"),
        )
    ]
    errors = material.chosen.entry.errors
    if "leave_one_out_mean" in errors:
        shown.append(
            (percent_of(errors["leave_one_out_mean"]), "mean deviation of a point left out of the fit")
        )
    reproduced = sum(claim.verdicts[0] == VERDICTS[0] for claim in claimed)
    shown.append((f"{reproduced} of {len(claimed)}", "statements in the paper's text reproduced (last part)"))
    return shown


def _sets(frictions: Sequence[Friction]) -> Html:
    """Calibrated numbers with intervals and errors."""
    rows: list[list[str]] = []

    def add(what: str, value: Any) -> None:
        cells = [value(friction.entry) for friction in frictions]
        if any(cell != UNKNOWN for cell in cells):
            rows.append([what, *cells])

    def fitted(key: str) -> Any:
        def text(entry: Any) -> str:
            if key not in SETS.get(entry.name, FITTED):
                return UNKNOWN
            scale = 1e9 if key == "roughness_height" else 1.0
            half = entry.intervals.get(key)
            known = "" if half is None else f" +- {scale * half:.2g}"
            return f"{scale * getattr(entry, key):.4g}{known}"

        return text

    def error(key: str) -> Any:
        return lambda entry: percent_of(entry.errors[key]) if key in entry.errors else UNKNOWN

    for key in FITTED:
        add(f"{NAMES[key]}, fitted", fitted(key))
    for key, what in (
        ("mean", "mean deviation of the points of the fit"),
        ("leave_one_out_mean", "mean deviation of points left out of the fit one at a time"),
        ("leave_one_out_max", "largest deviation of points left out of the fit one at a time"),
    ):
        add(what, error(key))
    for name in dict.fromkeys(name for f in frictions for name in f.entry.leave_one_table_out):
        add(
            f"{name.replace('table', 'Table ')} left out of the fit: mean and largest deviation",
            lambda entry, name=name: ", ".join(
                percent_of(entry.leave_one_table_out.get(name, {}).get(key, math.nan))
                for key in ("mean", "max")
            ),
        )
    head = ["", *(f"{words(f.entry.name)} (film: {words(f.entry.film_model)})" for f in frictions)]
    caption = (
        "Fitted numbers (+-: half width of the 95 % interval), deviations of points in and out of the fit"
    )
    return table("calibration", caption, head, rows)


def validation(material: Material) -> list[Html]:
    """Measured torques of the paper against the model."""
    chosen = material.chosen.entry.name
    others = {name: {t.name: t for t in found} for name, found in material.tables.items() if name != chosen}
    tables = [
        validation_table(one, chosen, {name: found[one.name] for name, found in others.items()})
        for one in material.tables[chosen]
    ]
    return [
        paragraph(
            "Measured torques and the columns Zhao, Zhou and NSK are those printed in the ",
            element("a", "paper of Zhao et al. (2023)", href=PAPER),
            "; the mean deviation is that of the magnitudes.",
        ),
        paragraph(
            "Calibrated, not predicted, are the apparent viscosity ratio, the net sliding coefficient and, in "
            "the set with three, a roughness height: fitted to the eleven distinct measured torques of Tables "
            f"2 and 4. {NO_SPLIT} The oil temperature of the tables is not printed; 303 K is assumed."
        ),
        side_by_side(
            figure(
                figures.measured_against_computed(material),
                f"Computed against measured torque, Tables 2 and 4, set {words(chosen)}. Grey band: 5 %.",
            ),
            figure(
                figures.deviations(material),
                "Deviation of each computed torque from the measured one; above the dotted line Table 2, "
                "below it Table 4.",
            ),
        ),
        *tables,
        _sets(material.frictions),
    ]


def friction_numbers(material: Material) -> list[Html]:
    """Numbers of the friction set, what its interval consists of, and where it is compared with measurements."""
    entry = material.chosen.entry
    return [
        paragraph(
            "How the friction laws compare with the torques measured on the one screw with published numbers, "
            "GD4008-3: the command ",
            element("code", "report"),
            " without ",
            element("code", "--screw"),
            ", or ",
            element("code", "validate"),
            ".",
        ),
        *(
            [paragraph(f"Provenance of the set {words(entry.name)}: {entry.provenance}.")]
            if entry.provenance
            else []
        ),
        _sets(material.frictions),
        *_shares(material),
    ]


def _shares(material: Material) -> list[Html]:
    """What contributes to the interval at the operating point."""
    found, point = material.lines.interval, material.screw.point
    if found is None or not found.shares:
        return []
    caption = f"Interval of the torque at {point.text}, {found.low:.3f} to {found.high:.3f} N m: what contributes to it"
    rows = [
        (words(name), f"{100.0 * share:.1f}") for name, share in found.shares.items() if share > LEAST_SHARE
    ]
    return [table("shares", caption, ["constant, or error of the fit", "share of the variance [%]"], rows)]


def torque(material: Material) -> list[Html]:
    """Torque over speed, preload and temperature, with its interval."""
    lines = material.lines
    circles = " Circles: measured." if material.measured else ""
    preload = figures.middle(lines.over_speed.rows)
    speed = figures.middle(lines.over_preload.rows)
    formulas = (
        f"the formulas of Zhou and NSK have no speed.{circles}"
        if material.measured
        else f"the catalogue torque (JIS B 1192) is proportional to it and holds at {CATALOGUE_RPM:.0f} r/min."
    )
    diamonds = "" if material.measured else f" Diamonds: catalogue torque at {CATALOGUE_RPM:.0f} r/min."
    shown = [
        figure(
            figures.torque_over_speed(material),
            f"Friction torque over screw speed. {_interval_note(material)}{circles}{diamonds}",
        ),
        figure(
            figures.torque_by_temperature(material),
            f"Friction torque over screw speed by oil temperature, preload {lines.by_temperature.fixed:.0f} N."
            + (" The measured points have one temperature: no interval." if material.measured else ""),
        ),
        figure(figures.torque_over_preload(material), f"Friction torque over preload; {formulas}"),
        figure(figures.torque_over_temperature(material), "Friction torque over oil temperature."),
        figure(
            figures.parts_over_speed(material), f"Parts of the torque over speed at {preload:.0f} N, stacked."
        ),
        figure(
            figures.parts_over_preload(material),
            f"Parts of the torque over preload at {speed / RPM:.0f} r/min, stacked.",
        ),
    ]
    notes = [paragraph(note, class_="note") for note in (_trend_note(material),) if note]
    return [*notes, side_by_side(*shown), _torques(material), *_intervals(lines.over_speed)]


def _torques(material: Material) -> Html:
    """Torques at the preloads and speeds of the lines, and the catalogue torque."""
    preloads, speeds = material.lines.over_speed.rows, material.lines.over_preload.rows
    temperature = material.lines.over_speed.fixed
    rows = []
    for preload in map(float, preloads):
        torques = (float(material.chosen.torque(preload, float(w), temperature)) for w in speeds)
        catalogue = float(nsk_torque(material.parameters.screw, preload))
        rows.append([f"{preload:.0f}", *(f"{value:.3f}" for value in (*torques, catalogue))])
    return table(
        "torques",
        f"Friction torque [N m], oil at {temperature - CELSIUS:.1f} C; out of range where its line is dashed",
        ["preload [N]", *(f"{w / RPM:.0f} r/min" for w in speeds), "catalogue"],
        rows,
    )


def _intervals(lines: Lines) -> list[Html]:
    """Ends of the drawn intervals at some of their speeds."""
    if lines.band is None:
        return []
    chosen = np.unique(np.linspace(0, lines.band.x.size - 1, 5).astype(int))
    rows = [
        [f"{preload:.0f}", *(f"{low[k]:.3f} to {high[k]:.3f}" for k in chosen)]
        for preload, low, high in zip(lines.rows, lines.band.low, lines.band.high, strict=True)
    ]
    return [
        table(
            "intervals",
            f"Interval of the torque [N m] ({lines.band.meaning}), oil at {lines.fixed - CELSIUS:.1f} C",
            ["preload [N]", *(f"{lines.band.x[k] / RPM:.4g} r/min" for k in chosen)],
            rows,
        )
    ]


def _interval_note(material: Material) -> str:
    """What the shaded intervals are."""
    band = material.lines.over_speed.band
    if band is None:
        return "No interval: this friction set was fitted to another screw or oil, its errors are not those here."
    return f"Shaded: interval of the torque, {band.meaning}."


def _trend_note(material: Material) -> str:
    """Where the torque has a trend that thick flooded films do not have; "" if nowhere on the lines."""
    over = {
        "temperature": material.lines.over_temperature.marked.rises_with_temperature,
        "speed": material.lines.over_speed.marked.falls_with_speed,
    }
    if not any(np.any(found) for found in over.values()):
        return ""
    shares = {name: f"{100.0 * float(np.mean(found)):.0f} %" for name, found in over.items()}
    places = (
        f"on {shares['temperature']} of the lines over temperature",
        f"on {shares['speed']} of those over speed",
    )
    end = "Such parts of the lines are dashed. The command torque reports such points as out of range; an FMU does not."
    if material.chosen.nut_map.law != MECHANISTIC:
        return (
            f"Not physical: in thick films (lambda above {THICK:g}) the torque of this fitted set rises with "
            f"temperature {places[0]} and falls with speed {places[1]}. {end}"
        )
    return (
        f"Supply of oil: in thick films (lambda above {THICK:g}) the replenishment factor makes the torque rise with "
        f"temperature {places[0]} and fall with speed {places[1]}. It is that of bearings, for moderate speeds. {end}"
    )


def balls(material: Material) -> list[Html]:
    """Loads of all balls."""
    found = material.balls
    rows = []
    for case in found.cases:
        q_a, q_b = case.loads.Q_a, case.loads.Q_b
        rows.append(
            [
                f"{case.axial_load:.0f}",
                f"{case.loads.force_a:.0f}",
                f"{case.loads.force_b:.0f}",
                *(f"{value:.1f}" for value in (q_a.min(), q_a.max(), q_b.min(), q_b.max())),
            ]
        )
    names = found.words
    return [
        paragraph(
            names.loads.format(count=material.parameters.screw.loaded_ball_count)
            + _spin_note(material)
            + f" An axial load adds to one {names.side} and relieves the "
            f"other, which is unloaded at {found.separation:.0f} N, {found.separation / found.preload:.2f} "
            f"times the preload (rigid bodies: {2.0**1.5:.2f} times)."
        ),
        side_by_side(
            figure(
                figures.load_distribution(found),
                f"Load of every ball: relieved {names.side} left, loaded {names.side} right.",
            ),
            figure(figures.nut_forces(found), f"Axial force of each {names.side} over the axial load."),
        ),
        table(
            "ball_loads",
            f"Forces and ball loads [N] at a preload of {found.preload:.0f} N",
            [
                "axial load",
                f"relieved {names.side}",
                f"loaded {names.side}",
                "relieved: lightest ball",
                "heaviest",
                "loaded: lightest ball",
                "heaviest",
            ],
            rows,
        ),
    ]


def _spin_note(material: Material) -> str:
    if material.parameters.screw.preload_kind != FOUR_POINT or material.chosen.nut_map.law == MECHANISTIC:
        return ""
    return (
        " Torques here do not include the spin of such a ball on its flanks: the command torque gives an upper bound "
        "of it."
    )


#: column of the table of solved contacts -> its value
CONTACT_COLUMNS: dict[str, Callable[[ContactResult], str]] = {
    "entrainment [m/s]": lambda s: f"{s.conditions.u_e:.3f}",
    # + 0: no sign on zeros
    "slide-to-roll ratio": lambda s: (
        f"{round((s.conditions.u_1 - s.conditions.u_2) / s.conditions.u_e, 4) + 0.0:.4f}"
    ),
    "central film [nm]": lambda s: f"{1e9 * s.h_c:.1f}",
    "minimum film [nm]": lambda s: f"{1e9 * s.h_m:.1f}",
    "Hertz pressure [GPa]": lambda s: f"{1e-9 * s.hertz.p_max:.3f}",
    "largest pressure [GPa]": lambda s: f"{1e-9 * s.p_max:.3f}",
    "largest rise [K]": lambda s: f"{s.temperature_rise:.1f}",
    "traction [N]": lambda s: f"{round(s.traction_force, 3) + 0.0:.3f}",
}


def contacts(material: Material) -> list[Html]:
    """Solved contacts of one ball."""
    load, speed, temperature = material.contact_point
    rows = []
    for kinematics, raceway, s in material.contacts:
        values = [value(s) for value in CONTACT_COLUMNS.values()]
        if not s.converged:
            values = ["not converged: " + s.reason, *[""] * (len(values) - 1)]
        rows.append([words(kinematics), raceway, *values])
    where = "the contact of section 5.1 of the paper"
    if not material.measured:
        where = f"the heaviest one at a preload of {material.balls.preload:.0f} N without axial load"
    text = (
        f"One ball, {where}: {load:.1f} N, {speed / RPM:.0f} r/min, oil and bodies at "
        f"{temperature - CELSIUS:.2f} C ({temperature:g} K). Pressure, "
        "film and temperature are solved together when this report is made, for Newtonian oil and smooth surfaces. "
    )
    if any(found.kinematics == "published" for found in material.contacts):
        text += "The kinematics published has the surface speeds of the paper, in the fixed frame. "
    text += (
        "The frame of rolling frame moves with the ball: there is no mean sliding. Use its film and temperatures. "
        "Its largest rise is due to compression in the narrow pressure spike and depends on the grid."
    )
    return [
        paragraph(text),
        table("solved_contacts", "Solved contacts", ["kinematics", "raceway", *CONTACT_COLUMNS], rows),
        *_contact_figures(material),
    ]


def _contact_figures(material: Material) -> list[Html]:
    """Fields and central lines of each kinematics with a converged contact."""
    parts = []
    for kinematics in dict.fromkeys(found.kinematics for found in material.contacts):
        solutions = [material.contact(kinematics, raceway) for raceway in RACEWAYS]
        if not any(solutions):
            continue
        name = words(kinematics)
        drawn = [
            figure(
                contact_figures.contact_field(solutions, field),
                f"{title}, kinematics {name}. Dashed: Hertz ellipse, whose values make the scale. The oil enters from "
                "below. Lengths along rolling are stretched.",
            )
            for field, (title, *_) in FIELDS.items()
        ]
        lines = contact_figures.central_lines(solutions)
        drawn.append(figure(lines, f"Pressure and film along the middle, kinematics {name}."))
        parts += [element("h3", f"Kinematics {name}"), side_by_side(*drawn)]
    return parts


def parts_of_page(material: Material, claimed: Sequence[Claim], found: Sequence[Erratum]) -> list[Part]:
    """The parts in their order: of the paper's screw, or of another one."""
    m = material
    torques = Part("torque", "Torque", "Torque over speed, preload and temperature", lambda: torque(m))
    others = [
        Part("balls", "Ball loads", f"Ball loads of the {m.balls.words.nut}", lambda: balls(m)),
        Part("contacts", "Contact", "Film, pressure and temperature of one contact", lambda: contacts(m)),
        Part("map", "Map", "The map, its certificate and its limits", lambda: nut_map(m)),
    ]
    if not m.measured:
        return [
            Part("screw", "Screw", "The screw and its oil", lambda: [sizes(m), oil(m), *mechanics(m)]),
            torques,
            Part("film", "Film", "Film thickness and lambda", lambda: films(m)),
            *others,
            Part("friction", "Friction numbers", "The friction numbers", lambda: friction_numbers(m)),
        ]
    return [
        Part("validation", "Validation", "Validation against measured torques", lambda: validation(m)),
        torques,
        Part("screw", "Screw", "The screw", lambda: [sizes(m), *mechanics(m)]),
        *others,
        Part("paper", "The paper", PAPER_TITLE, lambda: paper(m, claimed, found)),
    ]


def whole_page(
    material: Material, claimed: Sequence[Claim], found: Sequence[Erratum], progress: Progress
) -> str:
    """The page with all its parts; progress : called before and after each of them."""
    parts = parts_of_page(material, claimed, found)
    written = []
    with figures.style():
        for number, part in enumerate(parts, start=1):
            progress(number - 1, len(parts), PAGE_STEP)
            content = section(part.name, f"{number} {part.title}", *part.content())
            written.append((part.name, part.link, content))
    progress(len(parts), len(parts), PAGE_STEP)
    return page(title(material.parameters), intro(material, claimed), written, _footer(material))


def title(parameters: Parameters) -> str:
    """Title of the page."""
    return f"Ball-screw friction: {parameters.name}"


def _footer(material: Material) -> Html:
    file_hash = str(material.picture.nut_map.header["file_hash"])
    made = f"ballscrew_tehl {__version__}, map {file_hash[:12]}."
    if not material.measured:
        return element("span", made)
    return element(
        "span",
        f"{made} Measurements, printed values and statements: ",
        element("a", "Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231", href=PAPER),
        ".",
    )
