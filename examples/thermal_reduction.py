"""Thermal reduction of the film: thermal solve of one contact over sliding, compared with the formula of Wilson & Sheu.

The contact is the screw side of the packaged screw under one ball load, at the entrainment speeds that two screw speeds
have with the law `three_parameter`; the surface speeds lie symmetrically about them. Films are divided by the
isothermal film of the same solver, so that only the thermal reduction is compared.

Two effects reduce the film. Heating of the inlet reduces the flow of oil into the contact, as in the formula. Inside
the contact the slower surface is hotter. The hot oil there shears, the rest moves with the faster surface: the same
flow passes faster through a thinner film. This part is the distance between film and oil flow. Near the ratio 2 it
grows steeply: one surface comes to rest and no longer transports its heat away.
The oil is Newtonian, as that of the paper: its traction at little sliding is higher than that of any real oil. The
largest rise of pure rolling is that of the narrow pressure spike and depends on the grid.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from fmu_command import run_and_plot

from ballscrew_tehl import load_screw
from ballscrew_tehl.parameters.oil import LubricantParameters
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.film import thermal_load_parameter, wilson_sheu
from ballscrew_tehl.physics.lubricant import viscosity

try:
    from ballscrew_tehl.contact import (
        ContactConditions,
        ContactResult,
        SolverOptions,
        UnconvergedContactError,
        ball_conditions,
        solve,
    )
except ModuleNotFoundError as error:  # numba
    print(f"{Path(__file__).name}: {error}", file=sys.stderr)
    raise SystemExit(2) from None

LOAD, TEMPERATURE = 40.0, 303.0  # N, K
SPEEDS = (1000.0, 3000.0)  # r/min of the screw
RATIOS = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 1.9, 2.0)


def main(speeds: Sequence[float] = SPEEDS, ratios: Sequence[float] = RATIOS) -> dict[str, np.ndarray]:
    """Solve the contact over slide-to-roll ratio.

    speeds: of the screw [r/min], they set the entrainment; ratios: slide-to-roll. Returns rpm, u_e [m/s], N: (speed,);
    srr: (ratio,); (speed, ratio): film: central film over the isothermal one, flow: oil flow at the centre over the
    isothermal flow, formula: Wilson & Sheu, traction: force over load, rise: largest temperature rise [K], deviation:
    formula/film - 1; mean_deviation, largest_deviation: (speed,), of its magnitude. Raises UnconvergedContactError.
    """
    parameters = load_screw()
    oil = parameters.lubricant
    rows = []
    for rpm in speeds:
        c = ball_conditions(parameters, "screw", LOAD, rpm * RPM, TEMPERATURE)
        cold = _solved(replace(c, u_1=c.u_e, u_2=c.u_e), thermal=False).h_c
        N = float(thermal_load_parameter(oil, c.u_e, TEMPERATURE))
        for srr in ratios:
            hot = _solved(replace(c, u_1=c.u_e * (1.0 + 0.5 * srr), u_2=c.u_e * (1.0 - 0.5 * srr)))
            film = hot.h_c / cold
            rows.append(
                {
                    "u_e": c.u_e, "N": N, "film": film, "flow": film * _mean_speed(hot, oil) / c.u_e,
                    "formula": float(wilson_sheu(N, srr)), "traction": hot.traction_force / LOAD,
                    "rise": hot.temperature_rise,
                }
            )  # fmt: skip
    shape = len(speeds), len(ratios)
    result = {key: np.array([row[key] for row in rows]).reshape(shape) for key in rows[0]}
    result |= {key: result[key][:, 0] for key in ("u_e", "N")}
    deviation = result["formula"] / result["film"] - 1.0
    return result | {
        "rpm": np.array(speeds),
        "srr": np.array(ratios),
        "deviation": deviation,
        "mean_deviation": np.mean(np.abs(deviation), axis=1),
        "largest_deviation": np.max(np.abs(deviation), axis=1),
    }


def _solved(conditions: ContactConditions, thermal: bool = True) -> ContactResult:
    parameters = load_screw()
    options = SolverOptions(thermal=thermal)
    solution = solve(conditions, parameters.lubricant, parameters.solid, options)
    if not solution.converged:
        raise UnconvergedContactError(f"{conditions}: {solution.reason}")
    return solution


def _mean_speed(solution: ContactResult, oil: LubricantParameters) -> float:
    """Mean speed of the oil in the middle of the contact [m/s]: sheared layers of equal stress, du/dz ~ 1/eta."""
    assert solution.temperature is not None
    k = int(np.argmin(np.abs(solution.x)))
    T = solution.temperature[0, k]
    z = np.linspace(0.0, 1.0, 201)
    fluidity = 1.0 / viscosity(oil, solution.pressure[0, k], np.interp(z, np.linspace(0.0, 1.0, T.size), T))
    below = np.concatenate(([0.0], np.cumsum(0.5 * (fluidity[1:] + fluidity[:-1]))))
    c = solution.conditions
    return float(np.trapezoid(c.u_1 + (c.u_2 - c.u_1) * below / below[-1], z))


def report(result: dict[str, np.ndarray]) -> str:
    """Deviation of the formula from the solve, one line per speed."""
    lines = ["Wilson & Sheu against the solved film: deviation of the thermal reduction"]
    for i, rpm in enumerate(result["rpm"]):
        worst = int(np.argmax(np.abs(result["deviation"][i])))
        lines.append(
            f"{rpm:5.0f} r/min, u_e {result['u_e'][i]:.2f} m/s, N {result['N'][i]:.3f}: "
            f"mean {100.0 * result['mean_deviation'][i]:.1f} %, "
            f"largest {100.0 * result['deviation'][i, worst]:+.1f} % at srr {result['srr'][worst]:g}, "
            f"pure rolling {100.0 * result['deviation'][i, 0]:+.1f} %"
        )
    return "\n".join(lines)


def plot(result: dict[str, np.ndarray], path: Path) -> None:
    """Film, traction and rise over slide-to-roll ratio; one colour per speed."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (film, traction, rise) = plt.subplots(1, 3, figsize=(11.0, 3.9), layout="constrained")
    srr = result["srr"]
    for i, u_e in enumerate(result["u_e"]):
        colour = f"C{i}"
        film.plot(srr, result["film"][i], "o-", color=colour, markersize=4)
        film.plot(srr, result["flow"][i], ":", color=colour, linewidth=2.0)
        film.plot(srr, result["formula"][i], "--", color=colour)
        label = f"{u_e:.2f} m/s"
        traction.plot(srr, result["traction"][i], "o-", color=colour, markersize=4, label=label)
        rise.plot(srr, result["rise"][i], "o-", color=colour, markersize=4)
    for style, name in (("o-", "film, solve"), (":", "oil flow, solve"), ("--", "Wilson & Sheu")):
        film.plot([], [], style, color="0.3", markersize=4, label=name)
    film.set(title="Central film over isothermal film", ylim=(0.0, 1.05))
    film.legend(loc="lower left")
    traction.set(title="Traction over load")
    traction.set_ylim(bottom=0.0)
    traction.legend(title="entrainment speed")
    rise.set(title="Largest temperature rise [K]")
    rise.set_ylim(bottom=0.0)
    for axes in (film, traction, rise):
        axes.set(xlabel="slide-to-roll ratio", xlim=(-0.04, 2.04))
        axes.grid(alpha=0.3)
    figure.suptitle(f"Screw-side contact of a GD4008-3, {LOAD:g} N, oil at 30 C")
    figure.savefig(path, dpi=150)
    plt.close(figure)


if __name__ == "__main__":
    run_and_plot(__file__, __doc__, main, report, plot)
