"""Torque of the example screws by the mechanistic law, zero fitted, with its interval, against the catalogue torque.

Conditions of the catalogues: 100 r/min, oil ISO VG 68 (JIS K 2001), no seals; 30 C taken for its temperature. Preload:
5 % of the dynamic axial load rating of one set of balls, by the formula of ISO 3408-5 as recalled. Contacts are solved
for the mean ball, no map. The catalogue torque is a convention, proportional to the preload: the measured torque of the
GD4008-3 is 1.5 to 1.6 times it at 100 r/min.

    python tests/benchmarks/catalogue_torque.py [--share 0.05] [--csv FILE]
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path
from typing import NamedTuple

from ballscrew_tehl.friction.baselines import nsk_torque
from ballscrew_tehl.friction.interval import torque_interval, zero_fitted
from ballscrew_tehl.friction.torque import nut_forces
from ballscrew_tehl.mechanics import CATALOGUE_SHARE
from ballscrew_tehl.parameters.file import Parameters, graded_oil, load_parameters
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.rating import dynamic_rating
from ballscrew_tehl.refinement.direct import DirectContacts

SCREWS = Path(__file__).parents[1] / "data" / "screws"
#: speed [r/min], ISO VG and viscosity index, temperature [C], preload over the dynamic rating
SPEED, OIL, TEMPERATURE, SHARE = 100.0, (68, 95.0), 30.0, CATALOGUE_SHARE


class Row(NamedTuple):
    """One screw: preload [N], torques [N.m], largest share of the variance, ball-ball part is in it."""

    screw: str
    kind: str
    preload: float
    torque: float
    low: float
    high: float
    catalogue: float
    most: str

    @property
    def inside(self) -> bool:
        """Whether the catalogue torque lies in the interval."""
        return self.low <= self.catalogue <= self.high


def catalogue_row(parameters: Parameters, share: float = SHARE) -> Row:
    """One screw with the oil of the catalogues."""
    oiled = parameters.model_copy(update={"lubricant": graded_oil(*OIL)})
    screw = oiled.screw
    preload = share * dynamic_rating(screw)
    found = torque_interval(
        oiled,
        nut_forces(oiled, preload, 0.0),
        DirectContacts(oiled),
        SPEED * RPM,
        TEMPERATURE + CELSIUS,
        zero_fitted(oiled),
    )
    most = ", ".join(f"{name} {100.0 * part:.0f} %" for name, part in list(found.shares.items())[:2])
    catalogue = float(nsk_torque(screw, preload))
    return Row(
        parameters.name, screw.preload_kind, preload, found.torque, found.low, found.high, catalogue, most
    )


def main(arguments: list[str] | None = None) -> list[Row]:
    """Print the table; rows of all screws."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--share", type=float, default=SHARE, help="preload over the dynamic rating")
    parser.add_argument("--csv", type=Path, help="write the table")
    args = parser.parse_args(arguments)
    head = ("screw", "kind", "preload N", "torque N m", "low", "high", "JIS N m", "torque/JIS", "JIS inside")
    print("{:<14}{:<26}{:>10}{:>12}{:>8}{:>8}{:>9}{:>12}{:>12}".format(*head))
    rows = []
    for path in sorted(SCREWS.glob("*.toml")):
        row = catalogue_row(load_parameters(path), args.share)
        rows.append(row)
        print(
            f"{row.screw:<14}{row.kind:<26}{row.preload:10.0f}{row.torque:12.3f}{row.low:8.3f}{row.high:8.3f}"
            f"{row.catalogue:9.3f}{row.torque / row.catalogue:12.2f}{'yes' if row.inside else 'no':>12}",
            flush=True,
        )
    inside = sum(row.inside for row in rows)
    print(f"catalogue torque in the interval: {inside} of {len(rows)}", file=sys.stderr)
    if args.csv:
        with args.csv.open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow((*Row._fields, "inside"))
            writer.writerows((*row, row.inside) for row in rows)
    return rows


if __name__ == "__main__":
    main()
