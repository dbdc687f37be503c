#!/usr/bin/env python3
"""Statements in the text of Zhao et al. (2023) compared with this model, each with a verdict by a stated rule.

    python examples/paper/claims.py

A statement is reproduced if every number is within 5 % of the print, near within 20 %; the rule of a statement without
a number is in its row of zhao2023_claims.csv. Nothing was tuned towards these statements.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from measured_torques import Law, packaged_laws
from pipe_table import data_file, table

from ballscrew_tehl.applications.calibration.measured_screw import ASSUMED_TEMPERATURE, packaged_measurements
from ballscrew_tehl.parameters.file import Parameters, ScrewParameters
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.film import central_film_estimate, film_groups
from ballscrew_tehl.physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ballscrew_tehl.physics.kinematics import surface_speeds
from ballscrew_tehl.physics.lubricant import pressure_viscosity, section_2_3

#: largest relative difference from the print that counts as reproduced, as near
REPRODUCED_WITHIN, NEAR_WITHIN = 0.05, 0.20
#: largest fraction of the torque that counts as small, as its rule in the file says
SMALL_FRACTION = 0.05
VERDICTS = ("reproduced", "near", "not reproduced")
#: preloads [N] and speeds [rad/s] of the statements
PRELOADS = np.arange(1000.0, 6001.0, 1000.0)
SLOW, FAST = 100.0 * RPM, 2500.0 * RPM
SPEEDS = np.array([100.0, 500.0, 1000.0, 1500.0, 2000.0, 2500.0]) * RPM
#: operating point of sections 5.2 and 5.3: preload as printed, speed and step of temperature chosen here
POINT = (1800.0, 1000.0 * RPM)
WARMER = 10.0
#: steps of section 5.3: ambient viscosity [Pa s], sliding coefficient [1]
MORE_VISCOSITY, MORE_SLIDING = 0.025, 0.001


class Result(NamedTuple):
    """Result of a model or of the measurement: numbers to compare with the printed ones, and text."""

    values: tuple[float, ...]
    text: str


class Claim(NamedTuple):
    """One line of the file; results, verdicts: in the order of the laws; measured: by the measured torques, or None."""

    id: str
    results: tuple[Result, ...]
    verdicts: tuple[str, ...]
    measured: Result | None


def numbers(text: str) -> tuple[float, ...]:
    """Printed numbers of a field; a range 0.0065..0.0056 has two."""
    return tuple(float(part) for part in text.split("..")) if text else ()


def verdict_on(printed: Sequence[float], computed: Sequence[float]) -> str:
    """Verdict on numbers: by the largest relative difference; NaN is not reproduced."""
    # np.max: NaN stays NaN
    worst = np.max([abs(ours / theirs - 1.0) for ours, theirs in zip(computed, printed, strict=True)])
    if worst <= REPRODUCED_WITHIN:
        return VERDICTS[0]
    return VERDICTS[1] if worst <= NEAR_WITHIN else VERDICTS[2]


def friction_coefficient(screw: ScrewParameters, torque: Any, preload: Any) -> Any:
    """T sin(beta)/(2 F (r_m + r_b cos(beta))), beta without load: the friction coefficient of the paper."""
    beta = screw.contact_angle
    radius = screw.nominal_radius + 0.5 * screw.ball_diameter * math.cos(beta)
    return torque * math.sin(beta) / (2.0 * radius * preload)


def _ends(values: Any) -> Result:
    first, last = float(values[0]), float(values[-1])
    return Result((first, last), f"{first:.4f} to {last:.4f}")


def _mean(values: Any) -> Result:
    mean, low, high = (float(f(values)) for f in (np.mean, np.min, np.max))
    return Result((mean,), f"{mean:.2f} ({low:.2f} to {high:.2f})")


def _coefficient(law: Law, speed: float) -> Result:
    torque = law.torque(PRELOADS[[0, -1]], speed, ASSUMED_TEMPERATURE)
    return _ends(friction_coefficient(law.parameters.screw, torque, PRELOADS[[0, -1]]))


def crossover_speed(law: Law, preload: float) -> float:
    """Speed [rad/s] at which viscous and sliding torque are equal; NaN if they are not equal within the map."""
    speed = np.geomspace(*law.nut_map.header["axes"]["speed"][:2], 2001)
    viscous, _, sliding = law.parts(preload, speed, ASSUMED_TEMPERATURE)
    above = viscous >= sliding
    if above.all() or not above.any():
        return math.nan
    return float(np.exp(np.interp(0.0, np.log(viscous / sliding), np.log(speed))))


def _crossover(law: Law) -> Result:
    rpm = crossover_speed(law, POINT[0]) / RPM
    return Result((rpm,), f"{rpm:.0f}" if math.isfinite(rpm) else "none")


def film_factor(parameters: Parameters, viscosity_factor: float) -> float:
    """Factor of the film for a factor of the viscosity: closed formula, mean of both raceways, at POINT."""
    screw, oil = parameters.screw, parameters.lubricant
    load = POINT[0] / (screw.ball_count * math.sin(screw.contact_angle) * math.cos(screw.lead_angle))
    temperature, E = oil.reference_temperature, E_prime(screw)
    alpha = float(pressure_viscosity(oil, temperature))
    growth = []
    for raceway in RACEWAYS:
        R_x, R_y = reduced_radii(screw, screw.contact_angle, raceway)
        p_max = ellipse(load, R_x, R_y, E).p_max
        u_e = surface_speeds(parameters, raceway, POINT[1]).u_e
        thin, thick = (
            central_film_estimate(
                oil, film_groups(load, u_e, R_x, E, eta, alpha), R_x, R_y, p_max, temperature
            )
            for eta in (oil.viscosity, viscosity_factor * oil.viscosity)
        )
        growth.append(float(thick / thin))
    return sum(growth) / len(growth)


def _more_viscosity(law: Law) -> Result:
    viscous, total = law.parts(*POINT, ASSUMED_TEMPERATURE)[0], law.torque(*POINT, ASSUMED_TEMPERATURE)
    factor = 1.0 + MORE_VISCOSITY / float(section_2_3(ASSUMED_TEMPERATURE))
    shear = float(100.0 * viscous * (factor - 1.0) / total)
    both = 100.0 * viscous * (factor / film_factor(law.parameters, factor) - 1.0) / total
    return Result((shear,), f"{shear:.1f} (film grows too: {both:.1f})")


def _more_sliding(law: Law) -> Result:
    sliding, total = law.parts(*POINT, ASSUMED_TEMPERATURE)[2], law.torque(*POINT, ASSUMED_TEMPERATURE)
    value = float(100.0 * MORE_SLIDING * sliding / law.entry.net_sliding_coefficient / total)
    return Result((value,), f"{value:.1f}")


def _warmer(law: Law) -> Result:
    cold, hot = (law.torque(*POINT, ASSUMED_TEMPERATURE + step) for step in (0.0, WARMER))
    value = 100.0 * float(hot / cold - 1.0)
    return Result((value,), f"{value:+.1f} % for {WARMER:+.0f} K")


def _over_speed(law: Law) -> Result:
    slow, fast = (law.torque(PRELOADS, speed, ASSUMED_TEMPERATURE) for speed in (SLOW, FAST))
    return _mean((fast - slow) / ((FAST - SLOW) / (1000.0 * RPM)))


def _over_preload(law: Law) -> Result:
    low, high = (law.torque(preload, SPEEDS, ASSUMED_TEMPERATURE) for preload in PRELOADS[[0, -1]])
    return _mean((high - low) / ((PRELOADS[-1] - PRELOADS[0]) / 1000.0))


def _hysteresis(law: Law) -> Result:
    parts = law.parts(PRELOADS[:, None], SPEEDS, ASSUMED_TEMPERATURE)
    fraction = 100.0 * parts[1] / sum(parts)
    low, high = float(fraction.min()), float(fraction.max())
    return Result((low, high), f"{low:.1f} to {high:.1f} % of the torque")


class Rule(NamedTuple):
    """How a line of the file is computed; agrees: None = numbers by `verdict_on`, else whether the result agrees."""

    compute: Callable[[Law], Result]
    agrees: Callable[[Result], bool] | None = None


RULES = {
    "friction_coefficient_low_speed": Rule(lambda law: _coefficient(law, SLOW)),
    "friction_coefficient_high_speed": Rule(lambda law: _coefficient(law, FAST)),
    "crossover_speed": Rule(_crossover),
    "sensitivity_viscosity": Rule(_more_viscosity),
    "sensitivity_sliding": Rule(_more_sliding),
    "temperature_trend": Rule(_warmer, lambda result: result.values[0] > 0.0),
    "slope_speed": Rule(_over_speed),
    "slope_preload": Rule(_over_preload),
    "hysteresis_small": Rule(_hysteresis, lambda result: result.values[-1] <= 100.0 * SMALL_FRACTION),
}


def measured_results(screw: ScrewParameters) -> dict[str, Result]:
    """Results of the measured torques alone; Table 2 at 100 r/min, Table 4 at 1000 N."""
    points = packaged_measurements()
    by_preload, by_speed = ([m for m in points if name in m.tables] for name in ("table2", "table4"))
    low = [friction_coefficient(screw, m.torque, m.preload) for m in by_preload]
    fast = by_speed[-1]
    high = float(friction_coefficient(screw, fast.torque, fast.preload))
    slopes = {
        "slope_speed": (fast.torque - by_speed[0].torque)
        / ((fast.speed - by_speed[0].speed) / (1000.0 * RPM)),
        "slope_preload": (by_preload[-1].torque - by_preload[0].torque)
        / ((by_preload[-1].preload - by_preload[0].preload) / 1000.0),
    }
    return {
        "friction_coefficient_low_speed": _ends(low),
        "friction_coefficient_high_speed": Result((high,), f"{high:.4f} at 1 kN"),
        **{name: Result((value,), f"{value:.2f}") for name, value in slopes.items()},
    }


def printed_claims() -> list[dict[str, str]]:
    """Lines of the file: id, where, statement, value, unit, rule, remark."""
    return data_file("zhao2023_claims.csv", text=True).to_dict("records")


def claims(laws: Sequence[Law]) -> list[Claim]:
    """Every line of the file, in its order; one verdict a law."""
    measured, found = measured_results(laws[0].parameters.screw), []
    for row in printed_claims():
        rule = RULES[row["id"]]
        results = tuple(rule.compute(law) for law in laws)
        if rule.agrees is None:
            verdicts = tuple(verdict_on(numbers(row["value"]), result.values) for result in results)
        else:
            verdicts = tuple(VERDICTS[0 if rule.agrees(result) else 2] for result in results)
        found.append(Claim(row["id"], results, verdicts, measured.get(row["id"])))
    return found


def main() -> str:
    """The table as text, for both sets of the law of the paper."""
    laws = packaged_laws()[:1]
    rows = []
    for row, claim in zip(printed_claims(), claims(laws), strict=True):
        ours = [f"{result.text}: {name}" for result, name in zip(claim.results, claim.verdicts, strict=True)]
        unit = row["unit"].replace("1", "") if row["value"] else ""
        rows.append([
            f"{row['statement']} ({row['where']})", f"{row['value'].replace('..', ' to ')} {unit}".strip() or "-",
            *ours, claim.measured.text if claim.measured else "-", f"{row['remark']} Rule: {row['rule']}.",
        ])  # fmt: skip
    names = [law.entry.name for law in laws]
    head = ["statement", "printed", *names, "measured torques alone", "computation"]
    return table("Statements in the text of the paper", head, rows, "---")


if __name__ == "__main__":
    print(main())
