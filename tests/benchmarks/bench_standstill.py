"""Standstill of the native model with the start values of its parameters: reversals, a held rotor, breaking away.

`python tests/benchmarks/bench_standstill.py` prints the figures for both friction laws of the GD4008-3.
"""

import sys
import tempfile
from itertools import product
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))  # run as a script
sys.path.insert(0, str(Path(__file__).parents[1] / "support" / "fmu"))
from native_model import NativeModel, compiled_model
from standstill_runs import (
    ACCELERATIONS,
    INERTIAS,
    LOAD,
    STEPS,
    coulomb_level,
    reversal_peak,
    rotor,
)

from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.parameters.packaged_data import PACKAGED_DATA

SCREWS = ("gd4008.toml", "gd4008_vg100.toml")


def figures(screw: str) -> dict[str, float]:
    """Peak of the Coulomb part over its level; a rotor under half of that in motion and under 1.1 times that at rest.

    Half of the level at rest would be too much where it falls to less in motion: the rotor swings beyond its rest.
    """
    nut_map = load_map(None, load_parameters(PACKAGED_DATA / screw))
    with tempfile.TemporaryDirectory() as folder:
        model = NativeModel(compiled_model(Path(folder) / "model", nut_map), nut_map)
        peaks = {
            exchange: max(
                reversal_peak(model, nut_map, acceleration, step, exchange)
                for acceleration, step in product(ACCELERATIONS, STEPS)
            )
            for exchange in (False, True)
        }
        level, sliding, defaults = coulomb_level(nut_map, 0.0), coulomb_level(nut_map, 10.0), nut_map.defaults
        runs = list(product(INERTIAS, (1e-4, 1e-3), (False, True)))
        held = [rotor(model, 0.5 * sliding, *run, settle=15.0, hold=10.0).drift for run in runs]
        moved = [rotor(model, 1.1 * level, *run, settle=1.0, hold=0.0).speed * run[0] for run in runs]
    stiffness = nut_map.presliding_stiffness(
        LOAD["preload"], 0.0, defaults.net_sliding_coefficient, defaults.breakaway_factor
    )
    return {
        "stiffness [N.m/rad]": stiffness,
        "sliding deflection at standstill [mrad]": 1e3 * level / stiffness,
        "peak, co-simulation": peaks[False],
        "peak, model exchange": peaks[True],
        "drift in 10 s, largest [rad]": max(held),
        "momentum after 1 s at 1.1, least [N.m.s]": min(moved),
        "0.1 of the Coulomb torque times 1 s [N.m.s]": 0.1 * level,
    }


if __name__ == "__main__":
    for screw in SCREWS:
        print(screw)
        for name, value in figures(screw).items():
            print(f"  {name:45s} {value:.4g}")
