"""The last part of the page on the paper's screw: what is reproduced, what is not, and why."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ..parameters.units import RPM
from ..physics.hertz import RACEWAYS
from ..validation.section5 import printed_values
from .claims import NEAR_WITHIN, REPRODUCED_WITHIN, VERDICTS, Claim, verdict_on
from .errata import Erratum
from .material import Material, torque_of_contacts
from .page import Html, element, paragraph, table
from .tables import percent_of, words

TITLE = "What of the paper is reproduced"


def verdict_mark(verdict: str) -> Html:
    """A verdict with its colour."""
    return element("span", verdict, class_=f"verdict {verdict.replace(' ', '-')}")


def contact_claims(material: Material) -> list[list[Any]]:
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
                verdict, shown = VERDICTS[2], "not converged"
            else:
                ours = float(value(s))
                bound = float(text.lstrip(">~"))
                shown = f"{ours:{digits}}"
                if text.startswith(">"):
                    verdict = VERDICTS[0] if ours > bound else VERDICTS[2]
                else:
                    verdict = verdict_on((bound,), (ours,))
            unit = "" if printed["unit"] == "1" else f" [{printed['unit']}]"
            rows.append([words(printed["quantity"]) + unit, raceway, text, shown, verdict_mark(verdict)])
    return rows


def _order_of_raceways(material: Material) -> str:
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


def _fits(material: Material) -> Html:
    """Mean deviations of the paper's own model and of this one."""
    rows = []
    tables = {t.name: t for t in material.tables[material.chosen.entry.name]}
    for shown in (tables[name] for name in ("table2", "table4", "table3")):
        ours, paper = shown.deviations[:2]
        verdict = verdict_mark(VERDICTS[0] if ours <= paper else VERDICTS[2])
        rows.append([shown.title, percent_of(paper), percent_of(ours), verdict])
    caption = "Agreement with the measurement (reproduced: at least as good as the paper's own model)"
    return table("fits", caption, ["table", "paper", "this model", "verdict"], rows, text=True)


def _statements(material: Material, claimed: Sequence[Claim]) -> Html:
    rows = []
    for claim in claimed:
        unit = claim.unit.replace("1", "") if claim.printed else ""
        results = zip(claim.found, claim.verdicts, strict=True)
        rows.append([
            f"{claim.statement} ({claim.where})",
            f"{claim.printed} {unit}".strip() or "no number",
            *(Html(element("span", one.text) + "<br>" + verdict_mark(verdict)) for one, verdict in results),
            claim.measured.text if claim.measured else "-",
            f"{claim.remark} Rule: {claim.rule}.",
        ])  # fmt: skip
    models = (f"this model, {words(friction.entry.name)}" for friction in material.frictions)
    head = ["statement", "printed", *models, "measured torques alone", "computation"]
    return table("claims", "Statements in the text", head, rows, text=True)


def _traction_text(material: Material) -> str:
    """Why the sizes of section 5.1 differ, and the torque that its contacts would give."""
    _, speed, temperature = material.contact_point
    traction = torque_of_contacts(material, "published")
    friction = float(material.chosen.torque(material.balls.preload, speed, temperature))
    times = f"{traction / friction:.1f} times" if math.isfinite(traction) else "(not converged, no number)"
    return (
        f"{_order_of_raceways(material)} The print does not explain why the sizes differ: it does not state which of "
        "the two ambient viscosities entered the contact, and Eq. 6 omits the deflection. The values here change "
        "little with the grid (command validate --contacts shows three grids). The traction of these contacts, "
        f"summed over the load-carrying balls, would be {times} the torque of the friction model at "
        f"{material.balls.preload:.0f} N, {speed / RPM:.0f} r/min: the published friction is not the shear stress of "
        "the published contact."
    )


def paper(material: Material, claimed: Sequence[Claim], found: Sequence[Erratum]) -> list[Html]:
    """Statements, section 5.1 and misprints of the paper compared with this model."""
    head = ["quantity", "raceway", "printed", "this model", "verdict"]
    return [
        paragraph(
            "Every statement that can be computed is compared with this model by one rule: ",
            verdict_mark(VERDICTS[0]),
            f" if every number is within {100.0 * REPRODUCED_WITHIN:g} % of the print, ",
            verdict_mark(VERDICTS[1]),
            f" within {100.0 * NEAR_WITHIN:g} %, else ",
            verdict_mark(VERDICTS[2]),
            ". The rule of a statement without a number is in its row. Both friction sets have a verdict. The first "
            "one is used in all other results. Nothing was tuned towards these statements.",
        ),
        _fits(material),
        _statements(material, claimed),
        table(
            "section5",
            "Section 5.1: one ball, kinematics published",
            head,
            contact_claims(material),
            text=True,
        ),
        paragraph(_traction_text(material)),
        table(
            "errata",
            "Misprints and gaps of the paper, with their effect in numbers",
            ["where", "printed", "used here", "effect"],
            [list(one) for one in found],
            text=True,
        ),
        paragraph(
            "Calibrated: apparent viscosity ratio, net sliding coefficient, roughness height (first part). "
            f"Chosen, not printed: {material.parameters.screw.loaded_ball_count} load-carrying balls, "
            "section areas of screw, nut and spacer, oil at 303 K in the tables, and for rolling frame the "
            f"reference slip {material.parameters.friction.reference_slip:g}."
        ),
    ]
