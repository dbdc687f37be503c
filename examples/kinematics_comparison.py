"""One ball contact by the surface speeds of both laws: film, temperature, traction and heat of sliding over speed.

The paper measures the surface speeds in the fixed frame: ball and raceway slide over each other at 0.6 (screw) and 1.9
(nut) of the entrainment speed. The frame of `mechanistic` moves with the ball: pure rolling, without traction. The
sliding that remains in a groove, spin and differential slip, is a matter of the friction law, not of the film. Ball
load and inlet temperature are fixed, surfaces smooth; the oil is Newtonian, as that of the paper. The rise of pure
rolling is due to compression, largest in the narrow pressure spike: at high speed it depends on the grid.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from fmu_command import run_and_plot

from ballscrew_tehl.parameters.file import Law, changed, load_screw
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.hertz import RACEWAYS

try:
    from ballscrew_tehl.contact import UnconvergedContactError, ball_conditions, solve
except ModuleNotFoundError as error:  # numba
    print(f"{Path(__file__).name}: {error}", file=sys.stderr)
    raise SystemExit(2) from None

LOAD, TEMPERATURE = 40.0, 303.0  # N, K
SPEEDS = (50.0, 200.0, 500.0, 1000.0, 2000.0, 3000.0)  # r/min
#: label -> law, which has its own surface speeds
CASES = {"published": Law.THREE_PARAMETER, "rolling": Law.MECHANISTIC}
#: key -> title of the panel
PANELS = {
    "film": "Central film [nm]",
    "rise": "Largest temperature rise [K]",
    "traction": "Traction force [N]",
    "heat": "Heat of sliding [W]",
}


def main(speeds: Sequence[float] = SPEEDS) -> dict[str, np.ndarray]:
    """Solve both contacts of a ball for every case.

    speeds: of the screw [r/min]. Returns rpm (speed,); (case, raceway, speed): film [m], rise [K], traction [N] on the
    ball, > 0 where it drags the ball along, heat [W]; cases in the order of CASES, raceways screw, nut. Raises
    UnconvergedContactError.
    """
    parameters = load_screw()
    rows = []
    for law in CASES.values():
        variant = changed(parameters, friction={"law": law})
        for raceway in RACEWAYS:
            for rpm in speeds:
                conditions = ball_conditions(variant, raceway, LOAD, rpm * RPM, TEMPERATURE)
                s = solve(conditions, variant.lubricant, variant.solid)
                if not s.converged:
                    raise UnconvergedContactError(f"{law}, {raceway}, {rpm:g} r/min: {s.reason}")
                rows.append((s.h_c, s.temperature_rise, s.traction_force, s.sliding_heat))
    values = np.array(rows).reshape(len(CASES), len(RACEWAYS), len(speeds), len(PANELS))
    return {"rpm": np.array(speeds)} | {key: values[..., n] for n, key in enumerate(PANELS)}


def report(result: dict[str, np.ndarray]) -> str:
    """Table of all values."""
    lines = ["case           raceway  r/min  film nm   rise K  traction N    heat W"]
    for i, case in enumerate(CASES):
        for j, raceway in enumerate(RACEWAYS):
            for k, rpm in enumerate(result["rpm"]):
                film, rise, traction, heat = (result[key][i, j, k] for key in PANELS)
                # + 0: no sign on zeros
                lines.append(
                    f"{case:14} {raceway:7} {rpm:6.0f} {1e9 * film:8.1f} {rise:8.3f} {round(traction, 3) + 0.0:11.3f} "
                    f"{heat:9.5f}"
                )
    return "\n".join(lines)


def plot(result: dict[str, np.ndarray], path: Path) -> None:
    """Four panels over speed; colour: kinematics, dashes: nut side."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(2, 2, figsize=(10.5, 6.8), layout="constrained", sharex=True)
    rpm = result["rpm"]
    for axes, (key, title) in zip(panels.flat, PANELS.items(), strict=True):
        values = np.abs(result[key]) * (1e9 if key == "film" else 1.0)
        for i, (case, marker) in enumerate(zip(CASES, "os", strict=True)):
            if case == "rolling" and key in ("traction", "heat"):
                axes.text(0.04, 0.45, "pure rolling: none", color="C1", transform=axes.transAxes)
                continue
            for j, raceway in enumerate(RACEWAYS):
                axes.plot(
                    rpm, values[i, j], marker + ("-", "--")[j], color=f"C{i}", label=f"{case}: {raceway}",
                    markerfacecolor=(f"C{i}", "white")[j], markersize=4.5, linewidth=1.4,
                )  # fmt: skip
        axes.set(title=title, xscale="log", yscale="log")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.grid(alpha=0.3, which="both")
        axes.set_xticks(rpm, labels=[f"{value:g}" for value in rpm])
        axes.tick_params(axis="x", which="minor", bottom=False)
    panels[0, 0].set_yticks([10, 20, 50, 100, 200, 400], labels=["10", "20", "50", "100", "200", "400"])
    for axes in panels[1]:
        axes.set_xlabel("screw speed [r/min]")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    figure.suptitle(f"Contact of one ball of a GD4008-3 by kinematics, {LOAD:g} N, oil at 30 C")
    figure.savefig(path, dpi=150)
    plt.close(figure)


if __name__ == "__main__":
    run_and_plot(__file__, __doc__, main, report, plot)
