"""The parts of the page on the screw itself: its sizes and oil, what the command `screw` states, its films."""

from __future__ import annotations

import math
from collections.abc import Callable

from ..friction.baselines import nsk_torque
from ..friction.mechanistic import roughness_of
from ..mechanics import CATALOGUE_SHARE, LoadedScrew
from ..nut_map.trend import THICK
from ..parameters.units import CELSIUS, RPM
from ..physics import lubricant
from ..physics.rating import STATIC_PRESSURE
from ..runtime.packed import MECHANISTIC
from . import figures, screw_figures
from .material import Material
from .page import Html, element, figure, paragraph, table
from .page import figures as side_by_side
from .screw_numbers import efficiency_at
from .tables import words

#: heading of a column -> cell of a case
COLUMNS: dict[str, Callable[[LoadedScrew], str]] = {
    "heaviest ball [N]": lambda case: f"{case.ball_load_max:.1f}",
    "pressure [GPa]": lambda case: f"{1e-9 * case.contact_pressure_max:.3f}",
    "pressure over static": lambda case: f"{case.pressure_over_static:.3f}",
    "static safety": lambda case: f"{case.static_safety:.2f}",
    "L10 [1e6 turns]": lambda case: f"{float(f'{1e-6 * case.life_turns:.4g}'):.10g}",
    "stiffness [N/um]": lambda case: f"{1e-6 * case.axial_stiffness:.1f}",
    "deflection [um]": lambda case: f"{1e6 * case.axial_deflection:.3f}",
    "lost motion [um]": lambda case: f"{1e6 * case.lost_motion:.3f}",
}


def sizes(material: Material) -> Html:
    """Sizes of the screw and its ratings."""
    screw, numbers = material.parameters.screw, material.screw
    ball = screw.ball_diameter
    rows = [
        ("preload", material.balls.words.nut + ("" if screw.preload_kind == "double_nut" else
         f", {words(screw.preload_kind.removeprefix('single_nut_'))}")),
        ("pitch circle diameter, lead", f"{2e3 * screw.nominal_radius:.5g} mm, {1e3 * screw.lead:.5g} mm"),
        ("ball diameter, contact angle without load",
         f"{1e3 * ball:.5g} mm, {math.degrees(screw.contact_angle):.4g} degrees"),
        ("groove radius over ball diameter, screw and nut",
         f"{screw.screw_raceway_radius / ball:.4f}, {screw.nut_raceway_radius / ball:.4f}"),
        ("turns; balls of a nut, load-carrying",
         f"{screw.turns:g}; {screw.ball_count}, {screw.loaded_ball_count}"),
        ("dynamic load rating", f"{numbers.constants.dynamic_rating:.0f} N"),
        ("static load rating", f"{numbers.constants.static_rating:.0f} N"),
        ("preload released at an axial load of", "; ".join(
            f"{case[0].separation_load:.0f} N at {preload:.0f} N"
            for preload, case in zip(numbers.preloads, numbers.lines, strict=True))),
    ]  # fmt: skip
    return table("screw_sizes", "The screw", ("", ""), rows, text=True)


def oil(material: Material) -> Html:
    """Viscosity, density and pressure coefficient at the temperatures of the films."""
    of = material.parameters.lubricant
    rows = []
    for T in map(float, material.lines.films.temperatures):
        eta, rho = float(lubricant.eta0(of, T)), float(lubricant.ambient_density(of, T))
        alpha = 1e9 * float(lubricant.pressure_viscosity(of, T))
        cells = (1e3 * eta, 1e6 * eta / rho, rho, alpha)
        rows.append([f"{T - CELSIUS:.1f}", *(f"{value:.4g}" for value in cells)])
    head = [
        "temperature [C]",
        "viscosity [mPa s]",
        "[mm2/s]",
        "density [kg/m3]",
        "pressure coefficient [1/GPa]",
    ]
    return table("oil", f"The oil: {of.name}", head, rows)


def mechanics(material: Material) -> list[Html]:
    """Loads, pressure, stiffness, lost motion, life and efficiency."""
    numbers = material.screw
    rows = []
    for preload, axial_load, case in numbers.table:
        rows.append([f"{preload:.0f}", f"{axial_load:.0f}", *(value(case) for value in COLUMNS.values())])
    side = material.balls.words.side
    shown = [
        figure(screw_figures.over_axial_load(numbers, name), caption)
        for name, caption in (
            ("ball_load_max", "Load of the heaviest ball."),
            ("contact_pressure_max",
             f"Largest Hertz pressure; static rating: {1e-9 * STATIC_PRESSURE:g} GPa."),
            ("axial_stiffness",
             f"Axial stiffness of the nut; it falls where the relieved {side} carries nothing any more, with rigid "
             f"bodies at {2.0**1.5:.2f} times the preload."),
            ("lost_motion", "Lost motion when the axial load changes its sign, twice the deflection; rigid bodies."),
            ("life_turns", "Nominal life L10 under a constant axial load."),
        )
    ]  # fmt: skip
    shown.insert(
        2, figure(screw_figures.stiffness_over_preload(numbers), "Axial stiffness over the preload.")
    )
    shown.append(
        figure(
            screw_figures.efficiency_over_axial_load(numbers),
            "Efficiency with the friction torque of the map; lines end where the map does. 0: self-locking.",
        )
    )
    return [
        paragraph(
            "As ball-screw programs and catalogues state it, and as the command screw prints it. Ratings and life "
            "follow ISO 3408-5 without factors for hardness, accuracy and steel; catalogues differ from them by "
            "some tens of percent. The stiffness is that of the contacts, bodies rigid: screw shaft, bearings and "
            "nut body make the axis softer. Ball loads are those of elastic nut and screw."
        ),
        side_by_side(*shown),
        table(
            "mechanics",
            "The nut under preload alone, half the load that releases the preload, and that load",
            ["preload [N]", "axial load [N]", *COLUMNS],
            rows,
        ),
        _efficiencies(material),
    ]


def _efficiencies(material: Material) -> Html:
    """Efficiency at half the separation load of the operating point."""
    numbers = material.screw
    half = 0.5 * material.balls.separation
    rows = []
    for speed in map(float, numbers.speeds):
        both = efficiency_at(material.parameters, material.chosen.nut_map, numbers.point, half, speed)
        cells = ("beyond the map" if math.isnan(value) else f"{100.0 * value:.2f}" for value in both)
        rows.append([f"{speed / RPM:.0f}", *cells])
    return table(
        "efficiency",
        f"Efficiency [%] at an axial load of {half:.0f} N, preload {numbers.point.preload:.0f} N",
        ["speed [r/min]", "screw drives", "nut drives"],
        rows,
    )


def point_note(material: Material) -> Html:
    """The operating point of the page and how it was chosen."""
    point, axes = material.screw.point, material.picture.nut_map.header["axes"]
    text: list[str] = [f"Unless stated otherwise: {point.text}."]
    if material.given.preload is None:
        wanted = CATALOGUE_SHARE * material.screw.constants.dynamic_rating
        low, high = axes["preload"][:2]
        beyond = "" if low <= wanted <= high else ", beyond the map, whose end is taken instead"
        text.append(
            f" {100.0 * CATALOGUE_SHARE:g} % of the dynamic rating, for which catalogues state torques, is "
            f"{wanted:.0f} N{beyond}."
        )
    if any(value is None for value in material.given):
        options = (element("code", option) for option in ("--preload-n", "--speed-rpm", "--temperature-c"))
        first, second, third = options
        text += [" The options ", first, ", ", second, " and ", third, " choose another point."]
    return paragraph(*text)


def key_tiles(material: Material) -> list[tuple[str, str]]:
    """The numbers that are asked for first."""
    numbers, point = material.screw, material.screw.point
    case = numbers.lines[_row(material)][0]
    torque = float(material.chosen.torque(*point))
    found = material.lines.interval
    interval = "" if found is None else f" (interval {found.low:.3f} to {found.high:.3f})"
    state = material.chosen.nut_map.evaluate(*point)
    at = f"{point.preload:.0f} N, {point.speed / RPM:.0f} r/min, {point.temperature - CELSIUS:.0f} C"
    catalogue = float(nsk_torque(material.parameters.screw, point.preload))
    return [
        (f"{torque:.3f} N m", f"friction torque at {at}{interval}"),
        (f"{catalogue:.3f} N m", f"catalogue torque (JIS B 1192, 100 r/min) at {point.preload:.0f} N"),
        (f"{float(state.lambda_ratio):.2f}", "lambda, least film over roughness, there"),
        (f"{1e-6 * case.axial_stiffness:.0f} N/um", f"axial stiffness at {point.preload:.0f} N"),
        (f"{case.separation_load:.0f} N", "axial load that releases this preload"),
    ]  # fmt: skip


def _row(material: Material) -> int:
    """Line of the preload of the operating point."""
    return int(abs(material.screw.preloads - material.screw.point.preload).argmin())


def films(material: Material) -> list[Html]:
    """Films and lambda over speed."""
    lines, nut_map = material.lines.films, material.chosen.nut_map
    height = nut_map.header["defaults"]["roughness_height"]
    if nut_map.law == MECHANISTIC:
        height = roughness_of(material.parameters.friction).sigma
    rows = []
    speeds = material.lines.over_preload.rows
    for temperature in map(float, lines.temperatures):
        for speed in map(float, speeds):
            state = nut_map.evaluate(lines.preload, speed, temperature)
            cells = (
                f"{1e9 * float(state.film_thickness_central_screw):.1f}",
                f"{1e9 * float(state.film_thickness_central_nut):.1f}",
                f"{1e9 * float(state.film_thickness_min):.1f}",
                f"{float(state.lambda_ratio):.2f}",
                f"{float(state.film_temperature_rise):.2f}",
            )
            rows.append([f"{temperature - CELSIUS:.1f}", f"{speed / RPM:.0f}", *cells])
    return [
        paragraph(
            f"Least films over all balls at a preload of {lines.preload:.0f} N, of the kinematics "
            f"{words(nut_map.header['film_kinematics'])}. Lambda is the minimum film over the roughness height "
            f"{1e9 * height:.0f} nm: below 1 asperities carry much of the load, above {THICK:g} the surfaces are "
            "apart."
        ),
        side_by_side(
            figure(figures.film_over_speed(lines), "Films over speed; colours: oil temperature."),
            figure(figures.lambda_over_speed(lines), "Lambda over speed; grey: mixed lubrication."),
        ),
        table(
            "films",
            f"Films [nm], lambda and temperature rise, preload {lines.preload:.0f} N",
            ["oil [C]", "r/min", "central, screw", "central, nut", "minimum", "lambda", "rise [K]"],
            rows,
        ),
    ]
