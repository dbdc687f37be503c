"""Tables of the page on the screw itself: sizes, oil, what the command `screw` states, films, ball loads, contacts."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from ..friction.baselines import nsk_torque
from ..friction.mechanistic import roughness_of
from ..mechanics import CATALOGUE_SHARE, LoadedScrew
from ..parameters.file import FOUR_POINT
from ..parameters.units import CELSIUS, RPM
from ..physics import lubricant
from ..physics.hertz import RACEWAYS
from ..runtime.packed import MECHANISTIC
from .material import BallLoads, Material
from .page import Html, table
from .screw_numbers import efficiency_at
from .tables import words

if TYPE_CHECKING:
    from ..contact import ContactResult

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
        "temperature [C]", "viscosity [mPa s]", "[mm2/s]", "density [kg/m3]", "pressure coefficient [1/GPa]",
    ]  # fmt: skip
    return table("oil", f"The oil: {of.name}", head, rows)


def mechanics(material: Material) -> Html:
    """Loads, pressure, stiffness, lost motion and life."""
    rows = [
        [f"{preload:.0f}", f"{axial_load:.0f}", *(value(case) for value in COLUMNS.values())]
        for preload, axial_load, case in material.screw.table
    ]
    caption = "The nut under preload alone, half the load that releases the preload, and that load"
    return table("mechanics", caption, ["preload [N]", "axial load [N]", *COLUMNS], rows)


def efficiencies(material: Material) -> Html:
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


def usual_preload(material: Material) -> str:
    """The preload that catalogues state torques for, and whether the map has it."""
    wanted = CATALOGUE_SHARE * material.screw.constants.dynamic_rating
    low, high = material.picture.nut_map.header["axes"]["preload"][:2]
    beyond = "" if low <= wanted <= high else ", beyond the map, whose end is taken instead"
    return (
        f"{100.0 * CATALOGUE_SHARE:g} % of the dynamic rating, for which catalogues state torques, is "
        f"{wanted:.0f} N{beyond}."
    )


def key_tiles(material: Material) -> list[tuple[str, str]]:
    """The numbers that are asked for first."""
    numbers, point = material.screw, material.screw.point
    case = numbers.lines[int(abs(numbers.preloads - point.preload).argmin())][0]
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
    ]


def roughness_height(material: Material) -> float:
    """Height [m] that lambda is over."""
    nut_map = material.chosen.nut_map
    if nut_map.law == MECHANISTIC:
        return roughness_of(material.parameters.friction)
    return float(nut_map.header["defaults"]["roughness_height"])


def films(material: Material) -> Html:
    """Films and lambda over speed."""
    lines, rows = material.lines.films, []
    for temperature in map(float, lines.temperatures):
        for speed in map(float, material.lines.over_preload.rows):
            state = material.chosen.nut_map.evaluate(lines.preload, speed, temperature)
            thickness = (
                state.film_thickness_central_screw,
                state.film_thickness_central_nut,
                state.film_thickness_min,
            )
            cells = [f"{1e9 * float(film):.1f}" for film in thickness]
            cells += [f"{float(state.lambda_ratio):.2f}", f"{float(state.film_temperature_rise):.2f}"]
            rows.append([f"{temperature - CELSIUS:.1f}", f"{speed / RPM:.0f}", *cells])
    caption = f"Films [nm], lambda and temperature rise, preload {lines.preload:.0f} N"
    head = ["oil [C]", "r/min", "central, screw", "central, nut", "minimum", "lambda", "rise [K]"]
    return table("films", caption, head, rows)


def ball_loads(balls: BallLoads) -> Html:
    """Forces of the nuts and loads of their lightest and heaviest ball."""
    rows = []
    for case in balls.cases:
        q_a, q_b = case.loads.Q_a, case.loads.Q_b
        forces = (case.axial_load, case.loads.force_a, case.loads.force_b)
        loads = (q_a.min(), q_a.max(), q_b.min(), q_b.max())
        rows.append([*(f"{force:.0f}" for force in forces), *(f"{load:.1f}" for load in loads)])
    side = balls.words.side
    head = ["axial load", f"relieved {side}", f"loaded {side}"]
    head += ["relieved: lightest ball", "heaviest", "loaded: lightest ball", "heaviest"]
    return table("ball_loads", f"Forces and ball loads [N] at a preload of {balls.preload:.0f} N", head, rows)


def spin_is_left_out(material: Material) -> bool:
    """Whether torques are those of a fitted set, which has no spin of oversize balls."""
    return material.parameters.screw.preload_kind == FOUR_POINT and material.chosen.nut_map.law != MECHANISTIC


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


def solved_contacts(material: Material) -> Html:
    """Solved contacts of one ball."""
    rows = []
    for kinematics, raceway, s in material.contacts:
        values = [value(s) for value in CONTACT_COLUMNS.values()]
        if not s.converged:
            values = ["not converged: " + s.reason, *[""] * (len(values) - 1)]
        rows.append([words(kinematics), raceway, *values])
    return table("solved_contacts", "Solved contacts", ["kinematics", "raceway", *CONTACT_COLUMNS], rows)


def converged_contacts(material: Material) -> list[tuple[str, list[ContactResult | None]]]:
    """Solutions of screw and nut by kinematics, where one of both converged."""
    names = dict.fromkeys(found.kinematics for found in material.contacts)
    pairs = [(name, [material.contact(name, raceway) for raceway in RACEWAYS]) for name in names]
    return [(name, solutions) for name, solutions in pairs if any(solutions)]
