"""The parts of the page."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import __version__
from ..friction.baselines import nsk_torque
from ..friction.mechanistic import supply_factor
from ..friction.origin import carried_over
from ..friction.sets import FITTED, SETS
from ..nut_map.trend import THICK, unphysical_trend
from ..parameters.file import FOUR_POINT, Parameters
from ..parameters.units import CELSIUS, RPM
from ..physics.hertz import RACEWAYS
from ..runtime.packed import MECHANISTIC
from . import figures
from .claims import VERDICTS, Claim
from .errata import Erratum
from .figures import FIELDS
from .material import Friction, Material
from .page import Html, element, figure, page, paragraph, section, table, tiles
from .page import figures as side_by_side
from .paper import UNMEASURED, paper
from .tables import certificate_table, percent_of, validation_table, words

if TYPE_CHECKING:
    from ..contact.solve import ContactSolution

PAPER = "https://doi.org/10.1007/s00170-022-09524-2"
NAMES = {
    "apparent_viscosity_ratio": "apparent viscosity ratio",
    "net_sliding_coefficient": "net sliding coefficient",
    "roughness_height": "roughness height [nm]",
}


def intro(material: Material, claimed: Sequence[Claim]) -> list[Html]:
    """Summary with the most important numbers."""
    parameters, header = material.parameters, material.picture.nut_map.header
    content = [
        paragraph(
            f"Friction torque of a preloaded {material.balls.words.screw}, computed from its contacts: the load of "
            "every ball, the oil film in every contact by thermal elastohydrodynamic lubrication, then "
            "viscous, hysteresis and sliding friction.",
            class_="lead",
        )
    ]
    if material.measured:
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
        shown.append(
            (f"{reproduced} of {len(claimed)}", "statements in the paper's text reproduced (part 6)")
        )
        content.append(tiles(shown))
    else:
        content.append(paragraph(UNMEASURED, class_="note"))
    if other := carried_over(material.chosen.entry, parameters):
        force = float(material.over_speed.rows[0])
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


def _sets(frictions: Sequence[Friction]) -> Html:
    """Calibrated numbers with intervals and errors."""
    rows: list[list[str]] = []

    def add(what: str, value: Any) -> None:
        rows.append([what, *(value(friction.entry) for friction in frictions)])

    def fitted(key: str) -> Any:
        def text(entry: Any) -> str:
            if key not in SETS.get(entry.name, FITTED):
                return "-"
            scale = 1e9 if key == "roughness_height" else 1.0
            half = entry.intervals.get(key)
            known = "" if half is None else f" +- {scale * half:.2g}"
            return f"{scale * getattr(entry, key):.4g}{known}"

        return text

    def error(key: str) -> Any:
        return lambda entry: percent_of(entry.errors[key]) if key in entry.errors else "-"

    for key in FITTED:
        add(f"{NAMES[key]}, calibrated", fitted(key))
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
        "Calibrated numbers (+-: half width of the 95 % interval), deviations of points in and out of the fit"
    )
    return table("calibration", caption, head, rows)


def validation(material: Material) -> Html:
    """Part 1."""
    calibrated = paragraph(
        "Calibrated, not predicted, are the apparent viscosity ratio, the net sliding coefficient and, in "
        "the set with three, a roughness height: fitted to the eleven distinct measured torques of Tables "
        "2 and 4. Only the total torque is identified by these data, not its split into viscous and "
        "sliding part. The oil temperature of the tables is not printed; 303 K is assumed."
    )
    if not material.measured:
        return section(
            "validation",
            "1 Validation",
            paragraph(UNMEASURED, class_="note"),
            paragraph(
                "The friction parameters below are calibrated on the screw of the paper, GD4008-3. For "
                "this screw they are an assumption until its torque is measured (command calibrate)."
            ),
            _sets(material.frictions),
        )
    chosen = material.chosen.entry.name
    others = {name: {t.name: t for t in found} for name, found in material.tables.items() if name != chosen}
    tables = [
        validation_table(one, chosen, {name: found[one.name] for name, found in others.items()})
        for one in material.tables[chosen]
    ]
    return section(
        "validation",
        "1 Validation against measured torques",
        paragraph(
            "Measured torques and the columns Zhao, Zhou and NSK are those printed in the ",
            element("a", "paper of Zhao et al. (2023)", href=PAPER),
            "; the mean deviation is that of the magnitudes.",
        ),
        calibrated,
        side_by_side(
            figure(
                figures.measured_against_computed(material),
                f"Computed against measured torque, Tables 2 and 4, set {words(chosen)}. Grey band: 5 %.",
            ),
            figure(
                figures.deviations(material),
                "Deviation of each computed torque from the measured one; left of the dotted line Table 2, "
                "right Table 4.",
            ),
        ),
        *tables,
        _sets(material.frictions),
    )


def torque(material: Material) -> Html:
    """Part 2."""
    circles = " Circles: measured." if material.measured else ""
    speed = material.over_preload.rows
    temperature = material.over_speed.fixed
    rows = [
        [
            f"{preload:.0f}",
            *(f"{material.chosen.torque(float(preload), float(w), temperature):.3f}" for w in speed),
        ]
        for preload in material.over_speed.rows
    ]
    return section(
        "torque",
        "2 Torque over speed, preload and temperature",
        side_by_side(
            figure(figures.torque_over_speed(material), f"Friction torque over screw speed.{circles}"),
            figure(
                figures.torque_over_preload(material),
                f"Friction torque over preload; the formulas of Zhou and NSK have no speed.{circles}",
            ),
            figure(
                figures.torque_over_temperature(material),
                f"Friction torque over oil temperature. {_trend_note(material)}".rstrip(),
            ),
            figure(
                figures.parts_over_speed(material),
                f"Parts of the torque over speed at {figures.middle(material.over_speed.rows):.0f} N, stacked.",
            ),
            figure(
                figures.parts_over_preload(material),
                "Parts of the torque over preload at "
                f"{figures.middle(material.over_preload.rows) / RPM:.0f} r/min, stacked.",
            ),
            table(
                "torques",
                f"Friction torque [N m], oil at {temperature - CELSIUS:.1f} C",
                ["preload [N]", *(f"{w / RPM:.0f} r/min" for w in speed)],
                rows,
            ),
        ),
    )


def _trend_note(material: Material) -> str:
    """Where the fitted torque has a trend that thick films do not have; "" if nowhere on the lines."""
    nut_map, by_temperature, by_speed = (
        material.chosen.nut_map,
        material.over_temperature,
        material.over_speed,
    )
    supply = None
    if nut_map.law == MECHANISTIC:
        supply = partial(supply_factor, material.parameters)
    over = {
        "temperature": unphysical_trend(
            nut_map, by_temperature.fixed, by_temperature.rows[:, None], by_temperature.x, 0.0, supply
        ).rises_with_temperature,
        "speed": unphysical_trend(
            nut_map, by_speed.rows[:, None], by_speed.x, by_speed.fixed, 0.0, supply
        ).falls_with_speed,
    }
    if not any(np.any(found) for found in over.values()):
        return ""
    shares = {name: f"{100.0 * float(np.mean(found)):.0f} %" for name, found in over.items()}
    places = (
        f"on {shares['temperature']} of the lines over temperature",
        f"on {shares['speed']} of those over speed",
    )
    end = "The command torque reports such points as out of range; an FMU does not."
    if supply is None:
        return (
            f"Not physical: in thick films (lambda above {THICK:g}) the torque of this fitted set rises with "
            f"temperature {places[0]} and falls with speed {places[1]}. {end}"
        )
    return (
        f"Supply of oil: in thick films (lambda above {THICK:g}) the replenishment factor makes the torque rise with "
        f"temperature {places[0]} and fall with speed {places[1]}. It is that of bearings, for moderate speeds. {end}"
    )


def balls(material: Material) -> Html:
    """Part 3."""
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
    words = found.words
    return section(
        "balls",
        f"3 Ball loads of the {words.nut}",
        paragraph(
            words.loads.format(count=material.parameters.screw.loaded_ball_count)
            + _spin_note(material)
            + f" An axial load adds to one {words.side} and relieves the "
            f"other, which is unloaded at {found.separation:.0f} N, {found.separation / found.preload:.2f} "
            f"times the preload (rigid bodies: {2.0**1.5:.2f} times)."
        ),
        side_by_side(
            figure(
                figures.load_distribution(found),
                f"Load of every ball: relieved {words.side} left, loaded {words.side} right.",
            ),
            figure(figures.nut_forces(found), f"Axial force of each {words.side} over the axial load."),
        ),
        table(
            "ball_loads",
            f"Forces and ball loads [N] at a preload of {found.preload:.0f} N",
            [
                "axial load",
                f"relieved {words.side}",
                f"loaded {words.side}",
                "relieved: lightest ball",
                "heaviest",
                "loaded: lightest ball",
                "heaviest",
            ],
            rows,
        ),
    )


def _spin_note(material: Material) -> str:
    if material.parameters.screw.preload_kind != FOUR_POINT or material.chosen.nut_map.law == MECHANISTIC:
        return ""
    return (
        " Torques here do not include the spin of such a ball on its flanks: the command torque gives an upper bound "
        "of it."
    )


#: column of the table of solved contacts -> its value
CONTACT_COLUMNS: dict[str, Callable[[ContactSolution], str]] = {
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


def contacts(material: Material) -> Html:
    """Part 4."""
    load, speed, temperature = material.contact_point
    rows = []
    for kinematics, raceway, s in material.contacts:
        values = [value(s) for value in CONTACT_COLUMNS.values()]
        if not s.converged:
            values = ["not converged: " + s.reason, *[""] * (len(values) - 1)]
        rows.append([words(kinematics), raceway, *values])
    where = "the contact of section 5.1 of the paper" if material.measured else "the heaviest ball"
    text = (
        f"One ball, {where}: {load:.1f} N, {speed / RPM:.0f} r/min, oil and bodies at {temperature:g} K. Pressure, "
        "film and temperature are solved together when this report is made, for Newtonian oil and smooth surfaces. "
        "The kinematics published has the surface speeds of the paper, in the fixed frame. The frame of rolling "
        "frame moves with the ball: there is no mean sliding. Use its film and temperatures. Its largest rise is due "
        "to compression in the narrow pressure spike and depends on the grid."
    )
    return section(
        "contacts",
        "4 Film, pressure and temperature of one contact",
        paragraph(text),
        table("solved_contacts", "Solved contacts", ["kinematics", "raceway", *CONTACT_COLUMNS], rows),
        *_contact_figures(material),
    )


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
                figures.contact_field(solutions, field),
                f"{title}, kinematics {name}. Dashed: Hertz ellipse. The oil enters from below. The scale along "
                "rolling is stretched.",
            )
            for field, (title, *_) in FIELDS.items()
        ]
        lines = figures.central_lines(solutions)
        drawn.append(figure(lines, f"Pressure and film along the middle, kinematics {name}."))
        parts += [element("h3", f"Kinematics {name}"), side_by_side(*drawn)]
    return parts


def nut_map(material: Material) -> Html:
    """Part 5."""
    header = material.picture.nut_map.header
    axes = header["axes"]
    scales = {
        "force": (1.0, 0.0, "N"),
        "preload": (1.0, 0.0, "N"),
        "speed": (1.0 / RPM, 0.0, "r/min"),
        "temperature": (1.0, CELSIUS, "C"),
    }
    span = [
        [
            name,
            *(f"{round(scale * end - shift, 3):.6g} {unit}" for end in axes[name][:2]),
            f"{axes[name][2]:.0f}",
        ]
        for name, (scale, shift, unit) in scales.items()
    ]
    return section(
        "map",
        "5 The map and its certificate",
        paragraph(
            "The contacts were solved once for many loads, speeds and temperatures. Torques, films and "
            "temperatures are interpolated in this map. Films and temperatures of part 5 are extremes over all balls."
        ),
        figure(
            figures.map_picture_address(material),
            "The map: its results, its samples, and the points of its certificate, where it was compared with "
            "direct solves.",
            wide=True,
        ),
        certificate_table(header["certificate"]),
        table("axes", "Range of the map", ["axis (force: of one nut)", "from", "to", "nodes"], span),
    )


def whole_page(material: Material, claimed: Sequence[Claim], found: Sequence[Erratum]) -> str:
    """The page with all its parts."""
    parts = [
        ("validation", "Validation", validation(material)),
        ("torque", "Torque", torque(material)),
        ("balls", "Ball loads", balls(material)),
        ("contacts", "Contact", contacts(material)),
        ("map", "Map", nut_map(material)),
        ("paper", "The paper", paper(material, claimed, found)),
    ]
    return page(title(material.parameters), intro(material, claimed), parts, _footer(material))


def title(parameters: Parameters) -> str:
    """Title of the page."""
    return f"Ball-screw friction: {parameters.name}"


def _footer(material: Material) -> Html:
    file_hash = str(material.picture.nut_map.header["file_hash"])
    return Html(
        element(
            "span",
            f"ballscrew_tehl {__version__}, map {file_hash[:12]}. Measurements, printed values and "
            "statements: ",
            element("a", "Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231", href=PAPER),
            ".",
        )
    )
