"""Interval of the mechanistic torque at the measured points of the GD4008-3, zero fitted and fitted.

Direct solves of the mean ball, oil ISO VG 100, 303 K. With --sample N the
share of N points of a Latin hypercube of the constants that the zero fitted interval holds, at two points.

    python tests/benchmarks/check_interval.py [--sample 600]
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.stats import qmc

from ballscrew_tehl.calibration.measurements import merged, packaged_measurements
from ballscrew_tehl.friction.interval import torque_interval, torque_of_constants, zero_fitted
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.parameters.friction_constants import BOUNDED
from ballscrew_tehl.parameters.packaged_data import PACKAGED_DATA
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.refinement.direct import DirectContacts

#: oil temperature [K]; preload [N] and speed [r/min] of the samples
TEMPERATURE, SAMPLED = 303.0, ((1000.0, 100.0), (6000.0, 2500.0))


def main(arguments: list[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--sample", type=int, metavar="N", help="points of the Latin hypercube")
    args = parser.parse_args(arguments)
    parameters = load_parameters(PACKAGED_DATA / "gd4008_vg100.toml")
    contacts, sets = DirectContacts(parameters), (zero_fitted(parameters), default_friction_set(parameters))
    inside = [0, 0]
    for m in merged(packaged_measurements(TEMPERATURE)):
        line = f"{m.preload:6.0f} N {m.speed / RPM:6.0f} r/min measured {m.torque:.3f}"
        for i, entry in enumerate(sets):
            at = parameters, [m.preload] * 2, contacts, m.speed, m.temperature, entry
            found = torque_interval(*at)
            held = found.low <= m.torque <= found.high
            inside[i] += held
            line += (
                f" | {found.torque:.3f} ({found.low:.3f} to {found.high:.3f}, x {found.high / found.low:.2f})"
            )
            line += " in " if held else " out"
        print(line, flush=True)
    print(f"inside: zero fitted {inside[0]}, fitted {inside[1]}")
    if args.sample:
        names = list(BOUNDED)
        low, high = (np.array([getattr(BOUNDED[name], end) for name in names]) for end in ("low", "high"))
        points = low + (high - low) * qmc.LatinHypercube(len(names), seed=1).random(args.sample)
        for preload, rpm in SAMPLED:
            at = parameters, [preload] * 2, contacts, rpm * RPM, TEMPERATURE, sets[0]
            found, torque = torque_interval(*at), torque_of_constants(*at)
            torques = np.array([torque(dict(zip(names, row, strict=True))) for row in points])
            held = np.mean((torques >= found.low) & (torques <= found.high))
            ends = ", ".join(f"{x:.3f}" for x in np.quantile(torques, (0.1, 0.5, 0.9)))
            print(f"{preload:.0f} N, {rpm:.0f} r/min: {found.low:.3f} to {found.high:.3f} holds {100 * held:.1f} % "
                  f"of {args.sample}; their 10, 50, 90 %: {ends}; {found.shares}")  # fmt: skip


if __name__ == "__main__":
    main()
