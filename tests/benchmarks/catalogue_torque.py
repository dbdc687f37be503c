"""Torque of the example screws by the mechanistic law, zero fitted, with its interval, against the catalogue torque.

Conditions of the catalogues: 100 r/min, oil ISO VG 68 (JIS K 2001), no seals; 30 C taken for its temperature. Preload:
5 % of the dynamic axial load rating of one set of balls, by the formula of ISO 3408-5 as recalled. Contacts are solved
for the mean ball, no map. The catalogue torque is a convention, proportional to the preload: the measured torque of the
GD4008-3 is 1.5 to 1.6 times it at 100 r/min.

    python tests/benchmarks/catalogue_torque.py [--share 0.05] [--csv FILE]
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import pandas as pd

from ballscrew_tehl.friction.baselines import nsk_torque
from ballscrew_tehl.friction.interval import torque_interval
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.friction.torque import nut_forces
from ballscrew_tehl.mechanics import CATALOGUE_SHARE
from ballscrew_tehl.parameters.file import Parameters, changed, graded_oil, load_parameters
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.rating import dynamic_rating
from ballscrew_tehl.refinement.direct import DirectContacts

SCREWS = Path(__file__).parents[1] / "data" / "screws"
#: speed [r/min], ISO VG and viscosity index, temperature [C]
SPEED, OIL, TEMPERATURE = 100.0, (68, 95.0), 30.0


def catalogue_row(parameters: Parameters, share: float) -> tuple[Any, ...]:
    """One screw with the oil of the catalogues: name, kind, preload [N], torque, its ends, catalogue torque [N.m]."""
    oiled = parameters.model_copy(update={"lubricant": graded_oil(*OIL)})
    preload = share * dynamic_rating(oiled.screw)
    at = nut_forces(oiled, preload, 0.0), DirectContacts(oiled), SPEED * RPM, TEMPERATURE + CELSIUS
    found = torque_interval(oiled, *at, default_friction_set(changed(oiled, friction={"ball_thrust": 1.0})))
    kind, catalogue = oiled.screw.preload_kind, float(nsk_torque(oiled.screw, preload))
    return parameters.name, kind, preload, found.torque, found.low, found.high, catalogue


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument(
        "--share", type=float, default=CATALOGUE_SHARE, help="preload over the dynamic rating"
    )
    parser.add_argument("--csv", type=Path, help="write the table")
    args = parser.parse_args()
    rows = [catalogue_row(load_parameters(path), args.share) for path in sorted(SCREWS.glob("*.toml"))]
    table = pd.DataFrame(rows, columns=["screw", "kind", "preload", "torque", "low", "high", "catalogue"])
    table["ratio"] = table.torque / table.catalogue
    table["inside"] = (table.low <= table.catalogue) & (table.catalogue <= table.high)
    print(table.to_string(index=False, float_format="{:.3f}".format))
    print(f"catalogue torque in the interval: {table.inside.sum()} of {len(table)}")
    if args.csv:
        table.to_csv(args.csv, index=False)


if __name__ == "__main__":
    main()
