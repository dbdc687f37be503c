"""Part 6 of the page: what of the paper is reproduced, what is not, and why."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ..parameters.units import RPM
from ..physics.hertz import RACEWAYS
from ..validation.section5 import printed_values
from .claims import NEAR_WITHIN, REPRODUCED_WITHIN, VERDICTS, Claim, judged
from .errata import Erratum
from .material import Material, torque_of_contacts
from .page import Html, element, paragraph, section, table
from .tables import percent_of, words

UNMEASURED = (
    "This screw or its oil is not that of the paper: there are no measured torques for it. The comparison "
    "with the measurement and with the statements of the paper is left out."
)


def verdict_mark(verdict: str) -> Html:
    """A verdict with its colour."""
    return element("span", verdict, class_=f"verdict {verdict.replace(' ', '-')}")


def contact_claims(material: Material) -> list[list[Any]]:
    """Printed values of section 5.1 beside the solved ones: quantity, raceway, print, ours, verdict."""
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
                above = VERDICTS[0] if ours > bound else VERDICTS[2]
                verdict, shown = (
                    above if text.startswith(">") else judged((bound,), (ours,)),
                    f"{ours:{digits}}",
                )
            unit = "" if printed["unit"] == "1" else f" [{printed['unit']}]"
            rows.append([words(printed["quantity"]) + unit, raceway, text, shown, verdict_mark(verdict)])
    return rows


def _order_of_raceways(material: Material) -> str:
    """How screw and nut of section 5.1 compare, here and in print."""
    screw, nut = (material.contact("published", raceway) for raceway in RACEWAYS)
    if screw is None or nut is None:
        return "A contact did not converge."
    more = screw.temperature_rise - nut.temperature_rise
    return (
        f"The screw contact is {abs(more):.1f} K {'hotter' if more > 0.0 else 'cooler'} than the nut "
        f"contact (printed: about 10 K hotter) and its minimum film {screw.h_m / nut.h_m:.1f} times that of "
        "the nut (printed: more than twice); the sizes of both are not those of the paper."
    )


def paper(material: Material, claimed: Sequence[Claim], found: Sequence[Erratum]) -> Html:
    """Part 6."""
    title = "6 What of the paper is reproduced"
    if not material.measured:
        return section("paper", title, paragraph(UNMEASURED, class_="note"))
    sets = [f.entry.name for f in material.frictions]
    tables = {t.name: t for t in material.tables[sets[0]]}
    rows = [
        [
            f"{claim.statement} ({claim.where})",
            " ".join((claim.printed, claim.unit.replace("1", "") if claim.printed else "")).strip()
            or "no number",
            *(
                Html(element("span", one.text) + "<br>" + verdict_mark(verdict))
                for one, verdict in zip(claim.found, claim.verdicts, strict=True)
            ),
            claim.measured.text if claim.measured else "-",
            f"{claim.remark} Rule: {claim.rule}.",
        ]
        for claim in claimed
    ]
    fits = [
        [
            tables[name].title,
            percent_of(tables[name].deviations[1]),
            percent_of(tables[name].deviations[0]),
            verdict_mark(
                VERDICTS[0] if tables[name].deviations[0] <= tables[name].deviations[1] else VERDICTS[2]
            ),
        ]
        for name in ("table2", "table4", "table3")
    ]
    _, speed, temperature = material.contact_point
    traction = torque_of_contacts(material, "published")
    friction = float(material.chosen.torque(material.balls.preload, speed, temperature))
    times = (
        f"{traction / friction:.1f} times"
        if math.isfinite(traction)
        else "not computed as often (not converged)"
    )
    return section(
        "paper",
        title,
        paragraph(
            "Every statement that can be computed is held against this model, by one rule: ",
            verdict_mark(VERDICTS[0]),
            f" if every number is within {100.0 * REPRODUCED_WITHIN:g} % of the print, ",
            verdict_mark(VERDICTS[1]),
            f" within {100.0 * NEAR_WITHIN:g} %, else ",
            verdict_mark(VERDICTS[2]),
            ". A statement without a number has its own rule beside it. Both friction sets are judged; the "
            "first one is that of all other results. Nothing was tuned towards these statements.",
        ),
        table(
            "fits",
            "Agreement with the measurement (reproduced: at least as good as the paper's own model)",
            ["table", "paper", "this model", "verdict"],
            fits,
            text=True,
        ),
        table(
            "claims",
            "Statements in the text",
            [
                "statement",
                "printed",
                *(f"this model, {words(name)}" for name in sets),
                "measured torques alone",
                "how it is computed",
            ],
            rows,
            text=True,
        ),
        table(
            "section5",
            "Section 5.1: one ball, kinematics published",
            ["quantity", "raceway", "printed", "this model", "verdict"],
            contact_claims(material),
            text=True,
        ),
        paragraph(
            f"{_order_of_raceways(material)} Why the sizes differ cannot be settled from the print: it "
            "leaves open which of the two ambient viscosities entered the contact, and Eq. 6 omits the "
            "deflection. The values here hold their grid (command validate --contacts shows three). "
            f"The traction of these contacts, summed over the load-carrying balls, would be {times} "
            f"the torque of the friction model at {material.balls.preload:.0f} N, {speed / RPM:.0f} r/min: "
            "the published friction is not the shear stress of the published contact."
        ),
        table(
            "errata",
            "Misprints and gaps of the paper, and what they make in numbers",
            ["where", "printed", "used here", "effect"],
            [list(one) for one in found],
            text=True,
        ),
        paragraph(
            "Calibrated: apparent viscosity ratio, net sliding coefficient, roughness height (part 1). "
            f"Chosen, not printed: {material.parameters.screw.loaded_ball_count} load-carrying balls, "
            "section areas of screw, nut and spacer, oil at 303 K in the tables, and for rolling frame the "
            f"reference slip {material.parameters.friction.reference_slip:g}."
        ),
    )
