"""Tables of the page on what is reproduced of the paper, what is not, and its errata."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from ..parameters.packaged_data import PACKAGED_DATA
from ..physics.hertz import RACEWAYS
from ..tables.csv_file import read_rows
from ..validation.section5 import printed_values
from .claims import VERDICTS, Claim, verdict_on
from .material import Material, torque_of_contacts
from .page import Html, element, table
from .tables import percent_of, words

#: where, what is printed, what is used instead, the effect with the packaged screw
PACKAGED_ERRATA = PACKAGED_DATA / "zhao2023_errata.csv"
#: name of a verdict -> its mark
Verdict = Callable[[str], Html]


def paper_tiles(material: Material, claimed: Sequence[Claim]) -> list[tuple[str, str]]:
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


def section5(material: Material, verdict: Verdict) -> Html:
    """Printed and solved values of section 5.1: quantity, raceway, print, ours, verdict."""
    rows: list[list[Any]] = []
    solved: dict[str, Any] = {
        "entrainment_speed": (lambda s: 1e3 * s.conditions.u_e, ".2f"),
        "slide_roll_ratio": (lambda s: abs(s.conditions.u_1 - s.conditions.u_2) / s.conditions.u_e, ".5f"),
        "minimum_film": (lambda s: 1e6 * s.h_m, ".3f"),
        "film_temperature_rise_max": (lambda s: s.temperature_rise, ".1f"),
    }
    for printed in printed_values():
        value, digits = solved[printed["quantity"]]
        for raceway in RACEWAYS:
            s = material.contact("published", raceway)
            text = printed[raceway]
            if s is None:
                reached, shown = VERDICTS[2], "not converged"
            else:
                ours = float(value(s))
                bound = float(text.lstrip(">~"))
                shown = f"{ours:{digits}}"
                if text.startswith(">"):
                    reached = VERDICTS[0] if ours > bound else VERDICTS[2]
                else:
                    reached = verdict_on((bound,), (ours,))
            unit = "" if printed["unit"] == "1" else f" [{printed['unit']}]"
            rows.append([words(printed["quantity"]) + unit, raceway, text, shown, verdict(reached)])
    head = ["quantity", "raceway", "printed", "this model", "verdict"]
    return table("section5", "Section 5.1: one ball, kinematics published", head, rows, text=True)


def order_of_raceways(material: Material) -> str:
    """Screw and nut contact of section 5.1 compared, here and in print."""
    screw, nut = (material.contact("published", raceway) for raceway in RACEWAYS)
    if screw is None or nut is None:
        return "A contact did not converge."
    more = screw.temperature_rise - nut.temperature_rise
    return (
        f"The screw contact is {abs(more):.1f} K {'hotter' if more > 0.0 else 'cooler'} than the nut "
        f"contact (printed: about 10 K hotter) and its minimum film {screw.h_m / nut.h_m:.1f} times that of "
        "the nut (printed: more than twice). The sizes of both are not those of the paper."
    )


def fits(material: Material, verdict: Verdict) -> Html:
    """Mean deviations of the paper's own model and of this one."""
    rows = []
    tables = {t.name: t for t in material.tables[material.chosen.entry.name]}
    for shown in (tables[name] for name in ("table2", "table4", "table3")):
        ours, paper = shown.deviations[:2]
        mark = verdict(VERDICTS[0] if ours <= paper else VERDICTS[2])
        rows.append([shown.title, percent_of(paper), percent_of(ours), mark])
    caption = "Agreement with the measurement (reproduced: at least as good as the paper's own model)"
    return table("fits", caption, ["table", "paper", "this model", "verdict"], rows, text=True)


def statements(material: Material, claimed: Sequence[Claim], verdict: Verdict) -> Html:
    """Statements of the text with the results of each friction set."""
    rows = []
    for claim in claimed:
        unit = claim.unit.replace("1", "") if claim.printed else ""
        results = zip(claim.found, claim.verdicts, strict=True)
        rows.append([
            f"{claim.statement} ({claim.where})",
            f"{claim.printed} {unit}".strip() or "no number",
            *(element("span", one.text) + Html("<br>") + verdict(name) for one, name in results),
            claim.measured.text if claim.measured else "-",
            f"{claim.remark} Rule: {claim.rule}.",
        ])  # fmt: skip
    models = (f"this model, {words(friction.entry.name)}" for friction in material.frictions)
    head = ["statement", "printed", *models, "measured torques alone", "computation"]
    return table("claims", "Statements in the text", head, rows, text=True)


def traction_times(material: Material) -> str:
    """Torque that the contacts of section 5.1 would give over that of the friction model."""
    _, speed, temperature = material.contact_point
    traction = torque_of_contacts(material, "published")
    friction = float(material.chosen.torque(material.balls.preload, speed, temperature))
    return f"{traction / friction:.1f} times" if math.isfinite(traction) else "(not converged, no number)"


def errata_table() -> Html:
    """The errata with their effects, in the order of the paper's equations, as the documentation has them."""
    rows = [list(row.values()) for row in read_rows(PACKAGED_ERRATA)]
    caption = "Misprints and gaps of the paper, with their effect (set three parameter)"
    return table("errata", caption, ["where", "printed", "used here", "effect"], rows, text=True)
