"""Statements in the text of the paper compared with this model, each with a verdict by a stated rule."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..parameters.file import Parameters, ScrewParameters
from ..parameters.packaged_data import PACKAGED_DATA
from ..parameters.units import RPM
from ..physics.film import central_film_estimate, film_groups
from ..physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ..physics.kinematics import surface_speeds
from ..physics.lubricant import pressure_viscosity, section_2_3
from ..tables.csv_file import read_rows
from ..validation.tables import ASSUMED_TEMPERATURE, ValidationTable
from .lines import Friction

PACKAGED_CLAIMS = PACKAGED_DATA / "zhao2023_claims.csv"

#: largest relative difference from the print that counts as reproduced, as near
REPRODUCED_WITHIN, NEAR_WITHIN = 0.05, 0.20
#: largest share of the torque that counts as small, as its rule in the file says
SMALL_SHARE = 0.05
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


class Found(NamedTuple):
    """Result of a model or of the measurement: numbers to compare with the printed ones, and text."""

    values: tuple[float, ...]
    text: str


class Claim(NamedTuple):
    """One line of the file with the results of this model; found, verdicts: in the order of the friction sets.

    measured: the same from the measured torques alone, None where they do not give it
    """

    id: str
    where: str
    statement: str
    printed: str
    unit: str
    found: tuple[Found, ...]
    measured: Found | None
    verdicts: tuple[str, ...]
    rule: str
    remark: str


def numbers(text: str) -> tuple[float, ...]:
    """Printed numbers of a field; a range has two.

    Example
        >>> numbers("0.0065..0.0056"), numbers("")
        ((0.0065, 0.0056), ())
    """
    return tuple(float(part) for part in text.split("..")) if text else ()


def verdict_on(printed: Sequence[float], found: Sequence[float]) -> str:
    """Verdict on numbers: by the largest relative difference; NaN is not reproduced.

    Example
        >>> verdict_on((186.0,), (190.0,)), verdict_on((186.0,), (202.0,)), verdict_on((186.0,), (math.nan,))
        ('reproduced', 'near', 'not reproduced')
    """
    # np.max: NaN stays NaN
    worst = np.max([abs(ours / theirs - 1.0) for ours, theirs in zip(found, printed, strict=True)])
    if worst <= REPRODUCED_WITHIN:
        return VERDICTS[0]
    return VERDICTS[1] if worst <= NEAR_WITHIN else VERDICTS[2]


def friction_coefficient(screw: ScrewParameters, torque: Any, preload: Any) -> Any:
    """T sin(beta)/(2 F (r_m + r_b cos(beta))), beta without load: the friction coefficient of the paper."""
    beta = screw.contact_angle
    radius = screw.nominal_radius + 0.5 * screw.ball_diameter * math.cos(beta)
    return torque * math.sin(beta) / (2.0 * radius * preload)


def _ends(values: Any) -> Found:
    first, last = float(values[0]), float(values[-1])
    return Found((first, last), f"{first:.4f} to {last:.4f}")


def _mean(values: Any) -> Found:
    mean, low, high = (float(f(values)) for f in (np.mean, np.min, np.max))
    return Found((mean,), f"{mean:.2f} ({low:.2f} to {high:.2f})")


def _coefficient(speed: float) -> Callable[[Friction, Parameters], Found]:
    def found(friction: Friction, parameters: Parameters) -> Found:
        torque = friction.torque(PRELOADS[[0, -1]], speed, ASSUMED_TEMPERATURE)
        return _ends(friction_coefficient(parameters.screw, torque, PRELOADS[[0, -1]]))

    return found


def crossover_speed(friction: Friction, preload: float) -> float:
    """Speed [rad/s] at which viscous and sliding torque are equal; NaN if they are not equal within the map."""
    slowest, fastest = friction.nut_map.header["axes"]["speed"][:2]
    speed = np.geomspace(slowest, fastest, 2001)
    viscous, _, sliding = friction.parts(preload, speed, ASSUMED_TEMPERATURE)
    above = viscous >= sliding
    if above.all() or not above.any():
        return math.nan
    return float(np.exp(np.interp(0.0, np.log(viscous / sliding), np.log(speed))))


def _crossover(friction: Friction, parameters: Parameters) -> Found:
    rpm = crossover_speed(friction, POINT[0]) / RPM
    return Found((rpm,), f"{rpm:.0f}" if math.isfinite(rpm) else "none")


def film_factor(parameters: Parameters, viscosity_factor: float) -> float:
    """Factor of the film for a factor of the viscosity: closed formula, mean of both raceways, at POINT."""
    screw, oil = parameters.screw, parameters.lubricant
    load = POINT[0] / (screw.ball_count * math.sin(screw.contact_angle) * math.cos(screw.lead_angle))
    temperature = oil.reference_temperature
    alpha = float(pressure_viscosity(oil, temperature))
    growth = []
    for raceway in RACEWAYS:
        R_x, R_y = reduced_radii(screw, screw.contact_angle, raceway)
        p_max = ellipse(load, R_x, R_y, E_prime(screw)).p_max
        u_e = surface_speeds(parameters, raceway, POINT[1]).u_e
        films = [
            central_film_estimate(
                oil, film_groups(load, u_e, R_x, E_prime(screw), eta, alpha), R_x, R_y, p_max, temperature
            )
            for eta in (oil.viscosity, viscosity_factor * oil.viscosity)
        ]
        growth.append(float(films[1] / films[0]))
    return sum(growth) / len(growth)


def _more_viscosity(friction: Friction, parameters: Parameters) -> Found:
    viscous, hysteresis, sliding = friction.parts(*POINT, ASSUMED_TEMPERATURE)
    factor = 1.0 + MORE_VISCOSITY / float(section_2_3(ASSUMED_TEMPERATURE))
    total = viscous + hysteresis + sliding
    shear = 100.0 * viscous * (factor - 1.0) / total
    both = 100.0 * viscous * (factor / film_factor(parameters, factor) - 1.0) / total
    return Found((shear,), f"{shear:.1f} (film grows too: {both:.1f})")


def _more_sliding(friction: Friction, parameters: Parameters) -> Found:
    _, _, sliding = friction.parts(*POINT, ASSUMED_TEMPERATURE)
    share = 100.0 * MORE_SLIDING * sliding / friction.entry.net_sliding_coefficient
    value = float(share / friction.torque(*POINT, ASSUMED_TEMPERATURE))
    return Found((value,), f"{value:.1f}")


def _warmer(friction: Friction, parameters: Parameters) -> Found:
    cold, hot = (friction.torque(*POINT, ASSUMED_TEMPERATURE + step) for step in (0.0, WARMER))
    value = 100.0 * float(hot / cold - 1.0)
    return Found((value,), f"{value:+.1f} % for {WARMER:+.0f} K")


def _over_speed(friction: Friction, parameters: Parameters) -> Found:
    slow, fast = (friction.torque(PRELOADS, speed, ASSUMED_TEMPERATURE) for speed in (SLOW, FAST))
    return _mean((fast - slow) / ((FAST - SLOW) / (1000.0 * RPM)))


def _over_preload(friction: Friction, parameters: Parameters) -> Found:
    low, high = (friction.torque(preload, SPEEDS, ASSUMED_TEMPERATURE) for preload in PRELOADS[[0, -1]])
    return _mean((high - low) / ((PRELOADS[-1] - PRELOADS[0]) / 1000.0))


def _hysteresis(friction: Friction, parameters: Parameters) -> Found:
    parts = friction.parts(PRELOADS[:, None], SPEEDS, ASSUMED_TEMPERATURE)
    share = 100.0 * parts[1] / sum(parts)
    low, high = float(share.min()), float(share.max())
    return Found((low, high), f"{low:.1f} to {high:.1f} % of the torque")


class Rule(NamedTuple):
    """How a line of the file is computed; agrees: None = numbers by `verdict_on`, else whether the result agrees."""

    compute: Callable[[Friction, Parameters], Found]
    agrees: Callable[[Found], bool] | None = None


RULES = {
    "friction_coefficient_low_speed": Rule(_coefficient(SLOW)),
    "friction_coefficient_high_speed": Rule(_coefficient(FAST)),
    "crossover_speed": Rule(_crossover),
    "sensitivity_viscosity": Rule(_more_viscosity),
    "sensitivity_sliding": Rule(_more_sliding),
    "temperature_trend": Rule(_warmer, lambda found: found.values[0] > 0.0),
    "slope_speed": Rule(_over_speed),
    "slope_preload": Rule(_over_preload),
    "hysteresis_small": Rule(_hysteresis, lambda found: found.values[-1] <= 100.0 * SMALL_SHARE),
}


def _measured(screw: ScrewParameters, tables: Sequence[ValidationTable]) -> dict[str, Found]:
    """Results of the measured torques alone; Table 2 at 100 r/min, Table 4 at 1000 N."""
    by_name = {table.name: table.rows for table in tables}
    by_preload, by_speed = by_name["table2"], by_name["table4"]
    low = [friction_coefficient(screw, row.measured, row.preload) for row in by_preload]
    high = float(friction_coefficient(screw, by_speed[-1].measured, by_speed[-1].preload))

    def slope(first: float, last: float, span: float) -> Found:
        value = (last - first) / span
        return Found((value,), f"{value:.2f}")

    return {
        "friction_coefficient_low_speed": _ends(low),
        "friction_coefficient_high_speed": Found((high,), f"{high:.4f} at 1 kN"),
        "slope_speed": slope(by_speed[0].measured, by_speed[-1].measured,
                             (by_speed[-1].speed - by_speed[0].speed) / (1000.0 * RPM)),
        "slope_preload": slope(by_preload[0].measured, by_preload[-1].measured,
                               (by_preload[-1].preload - by_preload[0].preload) / 1000.0),
    }  # fmt: skip


def claims(
    parameters: Parameters, frictions: Sequence[Friction], tables: Sequence[ValidationTable]
) -> list[Claim]:
    """Every line of the file, in its order.

    Parameters   frictions: one verdict each;  tables: of validation_tables, for the measured torques
    """
    measured = _measured(parameters.screw, tables)
    result = []
    for row in read_rows(PACKAGED_CLAIMS):
        rule = RULES[row["id"]]
        found = tuple(rule.compute(friction, parameters) for friction in frictions)
        if rule.agrees is None:
            verdicts = tuple(verdict_on(numbers(row["value"]), one.values) for one in found)
        else:
            verdicts = tuple(VERDICTS[0 if rule.agrees(one) else 2] for one in found)
        result.append(
            Claim(row["id"], row["where"], row["statement"], row["value"].replace("..", " to "), row["unit"], found,
                  measured.get(row["id"]), verdicts, row["rule"], row["remark"])
        )  # fmt: skip
    return result
