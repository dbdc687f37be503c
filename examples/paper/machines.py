#!/usr/bin/env python3
"""The mechanistic law on machines that it was not made for and whose numbers it was not fitted to.

    python examples/paper/machines.py    (about a minute)

Bearings   caged ball bearings under an axial load against SKF's friction model, which condenses many measurements
Grooves    three balls between two open grooves, the torque of a spin-down: Balan, Houpert, Tufescu & Olaru, Lubricants
           3 (2015) 222
Screws     two new ball screws of a degradation rig (Xi'an Jiaotong University), of which lead, preload and perhaps the
           speed are known, against all double nuts that these could be
"""

import itertools
import math
from collections.abc import Callable, Iterable

import numpy as np
import pandas as pd
from bearings import (
    BEARINGS,
    CONFORMITY_LOAD,
    CONFORMITY_NU_N,
    NU_N,
    bearing_points,
    conformity_ratios,
    operating_points,
)
from pipe_table import data_file, table
from rig import RIG_LEAD_MM, RIG_PRELOAD, RIG_SPEED, rig_screw, rig_torques
from scipy.optimize import brentq

from ballscrew_tehl import bearing
from ballscrew_tehl.atlas.ball_contacts import BallContacts
from ballscrew_tehl.friction.interval import OperatingPoint, torque_interval
from ballscrew_tehl.friction.mechanistic import nuts_powers
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.parameters.file import graded_oil
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.film import FLOODED
from ballscrew_tehl.physics.lubricant import eta0

GROOVE_TORQUE = "balan_rolling_torque.csv"
#: radius of the grooves across rolling, pitch diameter of the balls [m], viscosity of the oil [Pa s]
GROOVE_RADIUS, GROOVE_PITCH, GROOVE_VISCOSITY = 4.16e-3, 36e-3, 0.05
#: what the screws of the rig could be: diameters of screw and balls [mm], ISO VG, temperatures [degC]
RIG_DIAMETERS, RIG_BALLS, RIG_OILS = (32.0, 36.0, 40.0), (4.763, 5.556, 6.35), (32, 68, 100, 150, 220)
RIG_TEMPERATURES = (20.0, 30.0)
#: nu n [mm2/s r/min] up to which bearings of this size are run, up to which the exponents are fitted, and from which on
#: the film carries
USUAL_NU_N, EXPONENT_NU_N, FILM_NU_N = 5e5, 1e5, 1e4
#: rolling parts and totals: name -> column of bearing_points
ROLLING = {
    "law, film": "rolling",
    "law, film and hysteresis": "film_and_hysteresis",
    "law, flooded film": "rolling_flooded",
    "Houpert, inlet heating of Aihara": "rolling_houpert",
}
TOTALS = {
    "law": "total",
    "law, flooded": "total_flooded",
    "Palmgren, oil mist": "total_palmgren_mist",
    "Palmgren, oil bath": "total_palmgren_bath",
}
#: replenished totals of the law over those of SKF
REPLENISHED = {"law and SKF's, both with SKF's replenishment": "total_replenished"}
#: sets of the bearing points, and ranges of nu n
POINTS: dict[str, Callable[[pd.DataFrame], pd.Series]] = {
    f"data, nu n <= {USUAL_NU_N:g}": lambda p: p.in_data & (p.nu_n <= USUAL_NU_N),
    "data, all": lambda p: p.in_data,
    "five other bearings": lambda p: ~p.in_data,
}
REGIMES: dict[str, Callable[[pd.DataFrame], pd.Series]] = {
    f"nu n < {FILM_NU_N:g}": lambda p: p.nu_n < FILM_NU_N,
    f"{FILM_NU_N:g} to {USUAL_NU_N:g}": lambda p: p.nu_n.between(FILM_NU_N, USUAL_NU_N),
    "above": lambda p: p.nu_n > USUAL_NU_N,
}


def groove_points(rows: pd.DataFrame | None = None) -> pd.DataFrame:
    """The law, flooded, where the spin-downs begin: K omega^n; adds measured, law: rolling torque [N.m] of three balls.

    The oil is one of this viscosity, ISO VG 68 at 43 C: at these loads its pressure coefficient does not matter. The
    contacts are outside the atlas and solved, a second each.
    """
    oil, rows = graded_oil(68, 95.0), data_file(GROOVE_TORQUE) if rows is None else rows
    warm, law = float(brentq(lambda T: float(eta0(oil, T)) - GROOVE_VISCOSITY, 290.0, 350.0)), []
    for row in rows.itertuples():
        conformity = 1e3 * GROOVE_RADIUS / row.ball_diameter_mm
        balls = bearing(
            GROOVE_PITCH, 1e-3 * row.ball_diameter_mm, 3, 0.5 * math.pi, conformity, conformity, oil=oil,
            friction={"supply_length": FLOODED},
        )  # fmt: skip
        speed = row.start_speed_rpm * RPM
        ((_, nut),) = nuts_powers(balls.parameters, [3.0 * row.load_N], balls.contacts, speed, warm)
        law.append(nut.viscous_screw + nut.viscous_nut)
    measured = 1e-5 * rows["K_1e-5"] * (rows.start_speed_rpm * RPM) ** rows.exponent
    return rows.assign(law=law, measured=measured)


def screw_points(oils: Iterable[int] = RIG_OILS) -> pd.DataFrame:
    """Torque with interval [N.m] of the screws that those of the rig could be; the number of the law carried over."""
    result = []
    for diameter, ball, iso_vg in itertools.product(RIG_DIAMETERS, RIG_BALLS, oils):
        parameters = rig_screw(diameter, ball, iso_vg)
        contacts, entry = BallContacts(parameters), default_friction_set(parameters)
        for celsius in RIG_TEMPERATURES:
            point = OperatingPoint(RIG_PRELOAD, RIG_SPEED * RPM, celsius + CELSIUS)
            torque = torque_interval(parameters, point, contacts, entry)
            result.append((diameter, ball, iso_vg, celsius, torque.torque, torque.low, torque.high))
    return pd.DataFrame(
        result, columns=["diameter_mm", "ball_mm", "iso_vg", "celsius", "torque", "low", "high"]
    )


def spread(ratios: pd.Series) -> pd.Series:
    """Number of ratios > 0, geometric mean, scatter factor exp(std ln), least and largest."""
    logs = np.log(ratios.to_numpy())
    values = len(logs), math.exp(logs.mean()), math.exp(logs.std()), ratios.min(), ratios.max()
    return pd.Series(dict(zip(("points", "mean", "scatter", "low", "high"), values, strict=True)))


def spreads(points: pd.DataFrame, columns: dict[str, str], over: str, sets: dict) -> pd.DataFrame:
    """Spread of torques over another one: rows (law, set)."""
    return pd.DataFrame({
        (law, name): spread((points[column] / points[over])[selection(points)])
        for law, column in columns.items() for name, selection in sets.items()
    }).T  # fmt: skip


def exponents(points: pd.DataFrame, column: str) -> tuple[float, float]:
    """Exponents of axial load and of nu n of a torque over points, with one level for each bearing."""
    levels = pd.get_dummies(points.bearing).to_numpy(float)
    logs = np.log(points[["axial_load", "nu_n"]].to_numpy())
    result = np.linalg.lstsq(np.hstack([logs, levels]), np.log(points[column].to_numpy()), rcond=None)[0]
    return float(result[0]), float(result[1])


def slow_points(points: pd.DataFrame) -> pd.DataFrame:
    """The points that exponents are fitted to."""
    return points[points.in_data & (points.nu_n <= EXPONENT_NU_N)]


def _text(s: pd.Series) -> str:
    return f"{s['mean']:.2f} ({s.scatter:.2f}) {s.low:.2f} to {s.high:.2f}"


def _spread_table(title: str, found: pd.DataFrame) -> str:
    """Rows by law, a column for each set."""
    cells = found.apply(_text, axis=1).unstack(sort=False)
    return table(
        title, ["", *cells.columns], ([law, *row] for law, row in zip(cells.index, cells.values, strict=True))
    )


def bearing_text(points: pd.DataFrame) -> list[str]:
    """Tables of the bearings; cells: geometric mean (scatter factor) range."""
    points = points.assign(film_and_hysteresis=points["rolling"] + points.hysteresis)
    slow, others = slow_points(points), points[~points.in_data]
    powers = {"SKF": "skf_rolling"} | ROLLING
    at_nu_n = {f"{nu_n:g}": lambda p, nu_n=nu_n: p.nu_n == nu_n for nu_n in NU_N}
    ratio = (points.total / points.skf).groupby([points.nu_n, points.load_ratio])
    by_load = ratio.agg(lambda r: f"{r.min():.2f} to {r.max():.2f}").unstack().fillna("-")
    inside = (points.low <= points.skf) & (points.skf <= points.high)
    held = [[name, f"{inside[of(points)].sum()} of {of(points).sum()}"] for name, of in POINTS.items()]
    names = ", ".join(name for name, of in BEARINGS.items() if not of.in_data)
    return [
        "Bearings under an axial load, ISO VG 68 at 40 C, over SKF's friction model. Nothing is fitted to them.\n"
        f"Geometric mean (scatter factor exp(standard deviation of ln)) range. Others: {names},\n"
        "ratings and limiting speeds from memory; balls of all bearings from their ratings.\n",
        _spread_table("Rolling part over SKF's", spreads(points, ROLLING, "skf_rolling", POINTS)),
        table(
            f"Exponents of the rolling part, data with nu n <= {EXPONENT_NU_N:g}", ["", "load", "nu n"],
            [[law, *(f"{x:.2f}" for x in exponents(slow, column))] for law, column in powers.items()],
        ),
        _spread_table(
            "Sliding part over SKF's, all bearings, by nu n",
            spreads(points, {"law": "sliding"}, "skf_sliding", at_nu_n),
        ),
        _spread_table(
            "Total over SKF's, without drag: data", spreads(points[points.in_data], TOTALS, "skf", REGIMES)
        ),
        _spread_table("Total over SKF's: others", spreads(others, TOTALS, "skf", REGIMES)),
        table(
            "Total of the law over SKF's by nu n and load over dynamic rating, all bearings",
            ["nu n", *(f"{load:g} C" for load in by_load.columns)],
            ([f"{nu_n:g}", *row] for nu_n, row in zip(by_load.index, by_load.values, strict=True)),
        ),
        _spread_table("Both replenished", spreads(points, REPLENISHED, "skf_replenished", POINTS)),
        table("SKF's total inside the interval of the law", ["points", "inside"], held),
    ]  # fmt: skip


def conformity_text() -> str:
    """Groove radius over ball diameter is no catalogue number."""
    return table(
        f"Total over SKF's at {CONFORMITY_LOAD:g} C by groove radius over ball diameter and nu n",
        ["bearing, groove", *(f"{nu_n:g}" for nu_n in CONFORMITY_NU_N)],
        ([f"{name}, {conformity:g}", *(f"{ratio:.2f}" for ratio in ratios)]
         for name, conformity, ratios in conformity_ratios()),
    )  # fmt: skip


def groove_text(points: pd.DataFrame) -> str:
    """Three balls between open grooves."""
    rows = [
        [f"{d:g} mm", _text(spread(of.law / of.measured))] for d, of in points.groupby("ball_diameter_mm")
    ]
    return table(
        "Three balls between open grooves: rolling torque, flooded, over the measured one", ["ball", ""], rows
    )


def screw_text(points: pd.DataFrame) -> str:
    """The two screws of the rig."""
    low, high = (points.low / points.torque).median(), (points.high / points.torque).median()
    measured = []
    for name, torque in rig_torques().items():
        inside = points.low.le(torque).mul(points.high.ge(torque)).sum()
        measured.append([f"{name}: {torque:.4f} N.m", f"{inside} of {len(points)}"])
    return table(
        f"New screws of a rig, lead {RIG_LEAD_MM:g} mm, {RIG_PRELOAD:g} N, {RIG_SPEED:g} r/min: law of {len(points)} "
        f"double nuts that they could be {points.torque.min():.3f} to {points.torque.max():.3f}, median "
        f"{points.torque.median():.3f} N.m; interval {low:.2f} to {high:.2f} times the torque",
        ["measured", "inside the interval of"], measured,
    )  # fmt: skip


def main() -> str:
    """All tables as text."""
    parts = [*bearing_text(bearing_points(operating_points())), conformity_text()]
    parts += [groove_text(groove_points()), screw_text(screw_points())]
    return "\n".join(parts)


if __name__ == "__main__":
    print(main())
