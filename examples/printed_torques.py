"""Drag torques that makers print and rigs measure, compared with the law and its interval: level, trend, share inside.

    python examples/printed_torques.py

Every preload is taken as nominal and nothing as measured, as for a screw from a catalogue: 100 r/min, mineral oil ISO
VG 100 at 20 C (ISO 3408-3). Rows: printed torques of Rexroth and inspection bands of THK (printed_torques.csv, with the
sources); the formula of JIS B 1192 on 20 double nuts from 12x5 to 63x20 at 5 % of their dynamic rating; the eleven
torques of the GD4008-3 (Zhao 2023), whose coefficient of ball on ball is set aside; the two rigs of XJTU, diameter and
balls not published, as nine screws. THK prints no preload: 5 % of the rating.

printed/law: geometric mean; scatter: its standard deviation as a factor; trend: exponents of diameter and lead of
printed/law. inside: torques in the interval of the law; of bands, those that overlap it.
"""

import csv
import math
import sys
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ballscrew_tehl import load_screw
from ballscrew_tehl.applications.calibration.measured_screw import packaged_measurements
from ballscrew_tehl.applications.catalogue import CatalogueSizes, catalogue_parameters
from ballscrew_tehl.atlas.ball_contacts import BallContacts
from ballscrew_tehl.friction.interval import OperatingPoint, torque_interval
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.parameters.file import PACKAGED_VG100, Parameters, changed
from ballscrew_tehl.parameters.friction import BOUNDED
from ballscrew_tehl.parameters.template import example_parameters
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.rating import catalogue_preload, nsk_torque

sys.path.append(str(Path(__file__).resolve().parent / "paper"))
from rig import RIG_PRELOAD, rig_screw, rig_torques

TABLE = Path(__file__).with_suffix(".csv")
SPEED, TEMPERATURE, GRADE, THK_SHARE = 100.0 * RPM, 20.0 + CELSIUS, 100, 0.05
#: diameter and lead [mm] of the screws of JIS B 1192
SIZES = ((12, 5), (16, 5), (16, 10), *product((20, 25, 32, 40, 50), (5, 10, 20)), (63, 10), (63, 20))
#: diameters of screws and balls [mm] of the rigs
RIGS = tuple(product((32.0, 36.0, 40.0), (4.763, 5.556, 6.35)))


class Row(NamedTuple):
    """A printed or measured torque [N.m], of a band its ends, and the law there."""

    group: str
    screw: Parameters
    point: OperatingPoint
    ends: tuple[float, float]


class Compared(NamedTuple):
    """Rows of one maker and kind: number, inside, printed/law, scatter, exponents (NaN: of one screw), widest."""

    count: int
    inside: int
    level: float
    scatter: float
    of_diameter: float
    of_lead: float
    width: float


def rows() -> Iterator[Row]:
    """All of them."""
    like = example_parameters("iso_vg", iso_vg=GRADE)
    lines = [line for line in TABLE.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    for row in csv.DictReader(lines):
        stated = set(CatalogueSizes._fields) - {"starts", "nut_kind"}
        numbers = {name: float(row[name]) for name in stated if row.get(name)}
        sizes = CatalogueSizes(**numbers | {"starts": int(row["starts"]), "nut_kind": row["nut_kind"]})
        screw = catalogue_parameters(sizes, like)[0]
        if int(row["spacers"]):
            screw = changed(screw, screw={"spacer_balls": True})
        preload = float(row["preload_n"] or THK_SHARE * sizes.rating_n)
        printed = [float(row[name]) for name in ("low_nm", "torque_nm", "high_nm")]
        kind = "double nut" if row["nut_kind"] == "double_nut" else "single nut"
        ends = (printed[0], printed[2]) if row["maker"] == "THK" else (printed[1], printed[1])
        group = f"{row['maker']}, {kind}" + ", spacer balls" * int(row["spacers"])
        yield Row(group, screw, OperatingPoint(preload, SPEED, TEMPERATURE), ends)
    for diameter, lead in SIZES:
        screw = catalogue_parameters(CatalogueSizes(diameter, lead), like)[0]
        point = OperatingPoint(catalogue_preload(screw.screw), SPEED, TEMPERATURE)
        torque = float(nsk_torque(screw.screw, point.preload))
        yield Row("JIS B 1192, double nut", screw, point, (torque, torque))
    measured = {"preload_basis": "nominal"}, {"ball_thrust": BOUNDED["ball_thrust"].value}
    screw = changed(load_screw(PACKAGED_VG100), screw=measured[0], friction=measured[1])
    for m in packaged_measurements(TEMPERATURE):
        yield Row(
            "GD4008-3, measured", screw, OperatingPoint(m.preload, m.speed, TEMPERATURE), (m.torque,) * 2
        )
    for (diameter, ball), torque in product(RIGS, rig_torques().values()):
        screw = changed(rig_screw(diameter, ball, GRADE), screw=measured[0])
        yield Row("XJTU, measured", screw, OperatingPoint(RIG_PRELOAD, SPEED, TEMPERATURE), (torque, torque))


def compared(group: list[Row]) -> Compared:
    """Level, trend and share inside of the rows of a group."""
    ratios, widths, inside = [], [], 0
    for row in group:
        contacts, entry = BallContacts(row.screw), default_friction_set(row.screw)
        law = torque_interval(row.screw, row.point, contacts, entry)
        inside += law.low <= row.ends[1] and row.ends[0] <= law.high
        ratios.append(0.5 * math.log(row.ends[0] * row.ends[1] / law.torque**2))
        widths.append(law.high / law.low)
    sizes = np.log([[row.screw.screw.nominal_radius, row.screw.screw.lead] for row in group])
    trend = [math.nan, math.nan]
    if not group[0].group.endswith("measured"):
        centred = sizes - sizes.mean(axis=0)
        trend = np.linalg.lstsq(centred, np.array(ratios) - np.mean(ratios))[0].tolist()
    level, scatter = math.exp(np.mean(ratios)), math.exp(np.std(ratios))
    return Compared(len(group), inside, level, scatter, *trend, max(widths))


def main() -> dict[str, Compared]:
    """What is compared, by maker and kind."""
    groups: dict[str, list[Row]] = {}
    for row in rows():
        groups.setdefault(row.group, []).append(row)
    return {name: compared(group) for name, group in groups.items()}


if __name__ == "__main__":
    print(f"{'maker, kind':<32}inside  printed/law  scatter  d^    lead^  widest")
    for name, found in main().items():
        shown = "{:>3} of {:<3}{:>8.2f}{:>11.2f}{:>8.2f}{:>7.2f}{:>7.1f}".format(
            found.inside, found.count, *found[2:]
        )
        print(f"{name:<32}{shown}")
