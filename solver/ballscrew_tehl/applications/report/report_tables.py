"""Tables and notes of the report on one screw."""

import math

import numpy as np

from ballscrew_tehl.friction.drag_torque import implied_preload
from ballscrew_tehl.friction.sets import FITTED, SETS, carried_over, catalogue_differs
from ballscrew_tehl.parameters.file import FOUR_POINT
from ballscrew_tehl.parameters.units import CELSIUS, RPM, SHOWN
from ballscrew_tehl.physics.film import MIN_FILM, THICKEST_FILM
from ballscrew_tehl.physics.lubricant import ambient_density, eta0
from ballscrew_tehl.physics.rating import dynamic_rating, nsk_torque, static_rating
from ballscrew_tehl.runtime.constants import HELD

from ..axis.budget import PART_NAMES
from .data import CATALOGUE_SPEED, OperatingPoint, ReportData
from .page import Html, table

#: how certain the torque of balls with four contacts is, by whether the law is the mechanistic one
OVERSIZE_BALLS = {
    False: "the spin of the balls on their flanks is not included; the command torque gives an upper bound of it",
    True: "torque and efficiency are up to 40 % off and out of the range of the map where the smaller force of both "
    f"sets of flanks is below {HELD:g} of the larger; the command torque states the value from the motion of the ball",
}


def words(name: str) -> str:
    """A name of the program in words."""
    return name.replace("_", " ")


def key_numbers(data: ReportData) -> list[tuple[str, str]]:
    """The numbers that are asked for first, each with what it is."""
    point, interval, case = data.point, data.interval, data.cases[0].screw
    state = data.nut_map.evaluate(*point)
    slow = data.nut_map.evaluate(*point._replace(speed=CATALOGUE_SPEED))
    computed = f"{float(slow.friction_torque):#.3g} N m" if slow.in_range else "outside the map"
    shown = []
    if implied := implied_preload(data.friction_set, point.preload):
        text = "true preload that the drag torque of the screw file implies, {:.0f} to {:.0f} N"
        true, *ends = implied.values()
        shown = [(f"{true:.0f} N", text.format(*ends))]
    torque, seals, low_high = float(state.friction_torque), data.nut_map.seal_torque, ""
    if interval is not None:
        low_high = ", interval {:#.3g} to {:#.3g}".format(
            *(seals + end * (torque - seals) for end in interval.relative)
        )
    return [
        (f"{torque:#.3g} N m", f"friction torque at {point.text}{low_high}"),
        (f"{float(nsk_torque(data.parameters.screw, point.preload)):#.3g} N m",
         f"catalogue torque at {point.preload:.0f} N (JIS B 1192: 100 r/min, oil ISO VG 68, no seals); "
         f"computed at 100 r/min and {point.temperature - CELSIUS:.1f} C: {computed}"),
        *shown,
        (f"{float(state.lambda_ratio):.2f}", "lambda, least film over roughness, at the same point"),
        (f"{1e-6 * case.axial_stiffness:.0f} N/um", "axial stiffness of the contacts, bodies rigid, at this preload"),
        (f"{case.separation_load:.0f} N", f"axial load that unloads one {data.words.side} (elastic bodies)"),
    ]  # fmt: skip


def sizes(data: ReportData) -> Html:
    """Sizes of the screw, ratings, oil and friction law."""
    screw, entry = data.parameters.screw, data.friction_set
    ball = screw.ball_diameter
    rows = [
        ("kind", data.words.screw),
        ("pitch circle diameter, lead", f"{2e3 * screw.nominal_radius:.5g} mm, {1e3 * screw.lead:.5g} mm"),
        ("ball diameter, contact angle without load",
         f"{1e3 * ball:.5g} mm, {math.degrees(screw.contact_angle):.4g} degrees"),
        ("groove radius over ball diameter, screw and nut",
         f"{screw.screw_raceway_radius / ball:.4f}, {screw.nut_raceway_radius / ball:.4f}"),
        ("turns, starts; balls of a nut, load-carrying",
         f"{screw.turns:g}, {screw.starts}; {screw.ball_count}, {screw.loaded_ball_count}"),
        ("dynamic and static load rating",
         f"{dynamic_rating(screw):.0f} N, {static_rating(screw):.0f} N"),
        ("oil", data.parameters.lubricant.name),
        ("friction law", f"{words(entry.name)}; {fitted_numbers(data)}"),
    ]  # fmt: skip
    return table("screw_sizes", "The screw", ("", ""), rows, text=True)


def fitted_numbers(data: ReportData) -> str:
    """Numbers of the friction set, and the error of its fit."""
    entry, parts = data.friction_set, []
    for key in SETS.get(entry.name, FITTED):
        scale, unit = (1e9, " nm") if key == "roughness_height" else (1.0, "")
        parts.append(f"{words(key)} {scale * getattr(entry, key):.4g}{unit}")
    if (error := entry.errors.get("leave_one_out_mean")) is not None:
        parts.append(f"mean error of a torque left out of the fit {100.0 * error:.2f} %")
    return ", ".join(parts)


def loads(data: ReportData) -> Html:
    """Loads, pressure, life, stiffness and efficiency under axial load at the preload of the operating point."""
    head = [
        "axial load [N]", "heaviest ball [N]", "Hertz pressure [GPa]", "static safety", "life L10 [1e6 turns]",
        "axial stiffness, bodies rigid [N/um]", "efficiency, screw drives [%]", "nut drives [%]",
    ]  # fmt: skip
    caption = (
        f"The nut without axial load, at half the load that unloads one {data.words.side}, and at that load"
    )
    rows = []
    for load, screw, both in data.cases:
        unknown = "-" if load == 0.0 else "outside the map"
        rows.append([
            f"{load:.0f}", f"{screw.ball_load_max:.1f}", f"{1e-9 * screw.contact_pressure_max:.3f}",
            f"{screw.static_safety:.2f}", f"{float(f'{1e-6 * screw.life_turns:.4g}'):.10g}",
            f"{1e-6 * screw.axial_stiffness:.1f}",
            *([unknown] * 2 if both is None else (f"{100.0 * value:.1f}" for value in both)),
        ])  # fmt: skip
    return table("loads", caption, head, rows)


def torques(data: ReportData) -> Html:
    """Torque with its interval at the preloads and speeds of the lines, and the catalogue torque."""
    catalogue, rows = nsk_torque(data.parameters.screw, data.preloads), []
    shown = data.at_temperature[:, np.isin(data.interval_speeds, data.speeds)]
    text = "{:#.3g} ({:#.3g} to {:#.3g})" if data.mechanistic else "{:#.3g}"
    for preload, other, by_speed in zip(data.preloads, catalogue, shown, strict=True):
        rows.append([f"{preload:.0f}", f"{other:#.3g}", *(text.format(*values) for values in by_speed)])
    what = "Friction torque (interval) [N m]" if data.mechanistic else "Friction torque [N m]"
    return table(
        "torques",
        f"{what}, oil at {data.point.temperature - CELSIUS:.1f} C, and catalogue torque at 100 r/min",
        ["preload [N]", "catalogue", *(f"{speed / RPM:.0f} r/min" for speed in data.speeds)],
        rows,
    )


def axis(data: ReportData) -> Html:
    """Friction of the axis by part, with its interval, at the speeds of the tables."""
    budget = data.budget
    assert budget is not None
    shown = np.isin(data.interval_speeds, data.speeds)
    parts = {PART_NAMES[name]: part[:3] for name, part in budget.parts.items()}
    parts["sum"] = budget.torque, budget.low, budget.high
    rows = [
        [name, *("{:#.3g} ({:#.3g} to {:#.3g})".format(*values) for values in np.transpose(ends)[shown])]
        for name, ends in parts.items()
    ]
    head = ["", *(f"{speed / RPM:.0f} r/min" for speed in data.speeds)]
    return table("axis_parts", "Friction torque at the screw (interval) [N m], by part", head, rows)


def notes(data: ReportData) -> dict[str, str]:
    """What the intervals are, why the catalogue torque differs, and that numbers are of another screw; "": not so."""
    texts = {
        "interval": "no interval: it is known for the mechanistic friction law only",
        "catalogue": catalogue_differs(data.parameters.screw) if data.mechanistic else "",
        "carried_over": carried_over(data.friction_set, data.parameters),
    }
    if data.interval is not None:
        texts["interval"] = f"interval: {words(data.interval.meaning)}"
    return {name: text[:1].upper() + text[1:] for name, text in texts.items()}


def films(data: ReportData) -> Html:
    """Viscosity of the oil, films, lambda and temperature rise at the operating point, by oil temperature."""
    oil, point, rows = data.parameters.lubricant, data.point, []
    for temperature in map(float, data.temperatures):
        state = data.nut_map.evaluate(point.preload, point.speed, temperature)
        viscosity = 1e6 * float(eta0(oil, temperature)) / float(ambient_density(oil, temperature))
        thickness = (
            state.film_thickness_central_screw, state.film_thickness_central_nut, state.film_thickness_min
        )  # fmt: skip
        rows.append(
            [f"{temperature - CELSIUS:.1f}", f"{viscosity:.4g}", *(f"{1e9 * float(h):.1f}" for h in thickness),
             f"{float(state.lambda_ratio):.2f}", f"{float(state.film_temperature_rise):.2f}"]
        )  # fmt: skip
    head = [
        "oil [C]", "viscosity [mm2/s]", "central film, screw [nm]", "central film, nut [nm]", "minimum film [nm]",
        "lambda", "temperature rise [K]",
    ]  # fmt: skip
    caption = f"Least films over all balls at preload {point.preload:.0f} N, {point.speed / RPM:.0f} r/min"
    return table("films", caption, head, rows)


def limits(data: ReportData) -> Html:
    """What is not included, extrapolated or uncertain on this page."""
    state, screw, header = data.films, data.parameters.screw, data.nut_map.header
    central = np.maximum(state.film_thickness_central_screw, state.film_thickness_central_nut)
    partial = {
        "torque rises with temperature or falls with speed in a thick film: not physical, dashed": np.concatenate(
            [lines.unphysical.ravel() for lines in (data.by_preload, data.by_temperature)]
        ),
        "minimum film below a nanometre, where oil is no continuum": state.film_thickness_min < MIN_FILM,
        "central film above a tenth of the ball radius, rolling loss by a closed form":
            central > THICKEST_FILM * 0.5 * screw.ball_diameter,
    }  # fmt: skip
    ranges = []
    for name in OperatingPoint._fields:
        unit, (low, high, *_) = SHOWN[name], header["axes"][name]
        ranges.append(f"{name} {unit.of(low):.6g} to {unit.of(high):.6g} {unit.unit}")
    seals = "" if data.nut_map.seal_torque or data.parameters.wipers else "seals and wipers, "
    bearings = "" if data.budget is not None else ", support bearings, guide, motor"
    rows = [
        ("not included", seals + "churning of grease, returns, misalignment, running-in" + bearings),
        ("range of the map", ", ".join(ranges)),
        ("outside the range", "values at the edge of the map, marked as out of range (in_range false)"),
        *((name, f"{100.0 * float(np.mean(where)):.0f} % of the lines") for name, where in partial.items()
          if np.any(where)),
    ]  # fmt: skip
    if (outside := 1.0 - header["atlas_fraction"]) > 0.0:
        rows.append(("contacts outside the atlas", f"{100.0 * outside:.2g} %, by ratio to closed forms"))
    if screw.preload_kind == FOUR_POINT:
        rows.append(("oversize balls under axial load", OVERSIZE_BALLS[data.mechanistic]))
    return table("not_certain", "Range, and what is not included or less certain", ("", ""), rows, text=True)
