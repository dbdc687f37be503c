"""Rolling loss of the solved contact over the load, compared with closed formulas.

`python tests/benchmarks/plot_rolling_loss.py [--output FILE.png] [--csv FILE.csv]` solves isothermal contacts in pure
rolling for Moes M 10 to 1e5 at one L, a long ellipse and a circle, and prints their loss u_e * integral of h dp/dx dA
with its deviation from Biboulet & Houpert 2010 and from Houpert 1987 (physics/rolling_resistance.py), then mean and
largest deviation per decade of M on the resolved branch. The solved loss is that of oil up to -R_x, of which `beyond`
is the share outside the grid; the formulas hold for oil up to -R_x (rigid) or -10 b (elastic). Refined: change of the
loss by --refine (nodes, lines and domain, SolverOptions.refined), which bounds what the deviations mean. --output
draws the figure, with open symbols where the change exceeds 5 % or the branch is asymptotic.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from contact_sample import compile_kernels
from result_file import ResultFile

from ballscrew_tehl.contact import (
    ContactConditions,
    SolverOptions,
    moes_conditions,
    reference_oil,
    solve_moes,
)
from ballscrew_tehl.physics.rolling_resistance import biboulet_houpert_point, houpert_point, rolling_power

#: radius ratio R_x/R_y of the contacts: a ball on the screw of GD4008-3, and a ball on a plane
SHAPES = {"long ellipse": 0.0353, "circle": 1.0}
RANGE = (10.0, 1e5)
#: load parameter of their own, (beta)^(1/4) kappa W (2U)^(-3/4), up to which Biboulet & Houpert fitted
FITTED_UP_TO = 800.0
BIBOULET, HOUPERT = "Biboulet & Houpert 2010", "Houpert 1987"
#: relative change by refinement above which a symbol is open
RESOLVED_WITHIN = 0.05
#: colour-blind safe (Okabe & Ito)
COLOURS = {BIBOULET: "#D55E00", HOUPERT: "#0072B2"}


class Loss(NamedTuple):
    """One contact: losses [W], M_transition: the load parameter of the formulas; grid: relative change by refinement.

    beyond: share of the loss outside the grid;
    nodes: wanted along rolling;  used: by the solver, which doubles them for narrow inlets;  grid: NaN without one
    """

    shape: str
    radius_ratio: float
    M: float
    L: float
    nodes: int
    refine: float
    used: int
    M_transition: float
    branch: str
    converged: bool
    load: float
    u_e: float
    loss: float
    beyond: float
    biboulet_houpert: float
    houpert: float
    grid: float

    @property
    def deviations(self) -> tuple[float, float]:
        """Solved over closed loss - 1: Biboulet & Houpert, Houpert."""
        return self.loss / self.biboulet_houpert - 1.0, self.loss / self.houpert - 1.0

    @property
    def resolved(self) -> bool:
        return self.converged and self.branch == "resolved"

    @property
    def certain(self) -> bool:
        """Whether refinement changes it little, or has not been tried."""
        return self.resolved and not abs(self.grid) > RESOLVED_WITHIN

    def __str__(self) -> str:
        biboulet, houpert = self.deviations
        state = self.branch if self.converged else "not converged"
        grid = "" if math.isnan(self.grid) else f", refined {100.0 * self.grid:+.2f} %"
        return (
            f"{self.shape:12s} M {self.M:9.4g} (formulas {self.M_transition:8.4g}) loss {1e3 * self.loss:9.4g} mW, "
            f"{100.0 * self.beyond:+.0f} % of it beyond the grid, "
            f"{100.0 * biboulet:+6.1f} % of {BIBOULET}, {100.0 * houpert:+6.1f} % of {HOUPERT}, "
            f"{self.used} nodes{grid}, {state}"
        )


def closed_losses(c: ContactConditions, load):
    """Loss [W] by formula at loads [N] of a contact of solve_moes, and the forces of Biboulet & Houpert."""
    oil = reference_oil("barus")
    where = load, c.u_e, c.R_x, c.R_y, c.E_prime, oil.viscosity
    biboulet, houpert = biboulet_houpert_point(*where), houpert_point(*where, oil.pressure_viscosity)
    losses = [rolling_power(found.force, c.u_e) for found in (biboulet, houpert)]
    return dict(zip(COLOURS, losses, strict=True)), biboulet


def solved_loss(shape: str, M: float, L: float, nodes: int, refine: float) -> Loss:
    """Solve one contact, and once more with everything refined from the nodes that the first solve has used."""
    ratio = SHAPES[shape]
    options = SolverOptions(thermal=False, n_x=nodes)
    solution = solve_moes(M, L, ratio, "barus", options).result
    grid = math.nan
    if refine > 1.0:
        used = replace(options, n_x=solution.x.size)
        refined = solve_moes(M, L, ratio, "barus", used.refined(refine)).result
        if refined.converged:
            grid = refined.rolling_loss / solution.rolling_loss - 1.0
    c, loss = solution.conditions, solution.rolling_loss
    beyond = solution.resistance_beyond / solution.rolling_resistance
    powers, biboulet = closed_losses(c, c.load)
    return Loss(
        shape, ratio, M, L, nodes, refine, solution.x.size, float(biboulet.M), solution.branch, solution.converged,
        c.load, c.u_e, loss, beyond, *(float(v) for v in powers.values()), grid,
    )  # fmt: skip


def deviations_by_decade(
    rows: list[Loss],
) -> dict[tuple[str, float], tuple[int, float, float, float, float, float]]:
    """By shape and start of the decade: contacts, mean and largest deviation from each formula, largest change refined.

    With their sign; the last is NaN without refined solutions.
    """
    found = {}
    for shape in SHAPES:
        for low in 10.0 ** np.arange(np.log10(RANGE[0]), np.log10(RANGE[1])):
            # the top of the range belongs to the last decade
            of_decade = [
                (*row.deviations, row.grid)
                for row in rows
                if row.shape == shape
                and row.resolved
                and (low <= row.M < 10.0 * low or row.M == RANGE[1] == 10.0 * low)
            ]
            if of_decade:
                columns = np.array(of_decade).T
                means = columns.mean(axis=1)
                largest = [column[np.argmax(np.abs(column))] for column in columns]  # NaN first
                found[shape, float(low)] = (
                    len(of_decade),
                    *(float(v) for v in (means[0], largest[0], means[1], largest[1], largest[2])),
                )
    return found


def figure_of(rows: list[Loss]):
    """Above: loss over M, solved and by both formulas; below: deviation of the solved loss from them."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import PercentFormatter

    figure = Figure(figsize=(9.0, 6.0), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=(3, 2))
    for column, (shape, ratio) in enumerate(SHAPES.items()):
        above, below = panels[:, column]
        mine = [row for row in rows if row.shape == shape and row.converged]
        if not mine:
            continue
        M = np.array([row.M for row in mine])
        resolved = np.array([row.certain for row in mine], dtype=bool)
        loss = 1e3 * np.array([row.loss for row in mine])
        # the formulas at fixed L depend on load alone, which is proportional to M
        shown = RANGE[0] / 1.25, 1.25 * RANGE[1]
        fine = np.geomspace(*shown, 200)
        closed, forces = closed_losses(
            moes_conditions(mine[0].M, mine[0].L, ratio), mine[0].load / mine[0].M * fine
        )
        for style, (name, values) in zip(("-", "--"), closed.items(), strict=True):
            above.plot(fine, 1e3 * values, style, color=COLOURS[name], linewidth=1.8, label=name)
        symbol = {"color": "black", "markersize": 5, "zorder": 3}
        above.plot(M[resolved], loss[resolved], "o", label="solved", **symbol)
        open_symbol = symbol | {"markerfacecolor": "white"}
        label = "solved, changes by > 5 % if refined"
        above.plot(M[~resolved], loss[~resolved], "o", label=label, **open_symbol)
        for marker, number, name in (("o-", 0, BIBOULET), ("s--", 1, HOUPERT)):
            deviation = np.array([row.deviations[number] for row in mine])
            style = {"color": COLOURS[name], "linewidth": 1.2, "markersize": 4, "zorder": 3}
            below.plot(M[resolved], deviation[resolved], marker, **style)
            below.plot(M[~resolved], deviation[~resolved], marker[0], markerfacecolor="white", **style)
        fitted = fine[forces.M <= FITTED_UP_TO].max(initial=shown[0])
        for axes in (above, below):
            axes.set(xscale="log", xlim=shown)
            axes.grid(alpha=0.3)
            axes.axvspan(fitted, shown[1], color="0.93", zorder=0, linewidth=0)
        above.set_title(f"{shape}, $R_x/R_y$ = {ratio:g}")
        above.set_yscale("log")
        below.axhline(0.0, color="black", linewidth=0.8)
        below.set_xlabel("Moes load parameter $M$ [-]")
        below.yaxis.set_major_formatter(PercentFormatter(1.0))
    panels[0, 0].set_ylabel("rolling loss [mW]")
    panels[1, 0].set_ylabel("solved over formula $-$ 1")
    handles, labels = panels[0, -1].get_legend_handles_labels()
    if all(row.certain for row in rows):
        handles, labels = handles[:-1], labels[:-1]
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    L = rows[0].L
    figure.suptitle(
        f"Isothermal pure rolling, $L$ = {L:g}, Barus oil; shaded: loads beyond the fit of Biboulet & Houpert",
        fontsize="medium",
    )
    return figure


def run(loads: list[float], L: float, nodes: int, refine: float, csv: Path | None) -> list[Loss]:
    """Losses of both shapes; contacts that the CSV file holds are not solved again."""
    file = ResultFile(csv, Loss, ("shape", "M", "L", "nodes", "refine"))
    wanted = [(shape, M, L, nodes, refine) for shape in SHAPES for M in loads]
    done = file.cases()
    if set(wanted) - done:
        compile_kernels()
    try:
        for case in wanted:
            if case not in done:
                file.append(solved_loss(*case))
                print(file.rows[-1], flush=True)
    except KeyboardInterrupt:
        print("interrupted")
    return [row for row in file.rows if file.case(row) in wanted]


def main(arguments: list[str] | None = None) -> list[Loss]:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--points", type=int, default=17, help="loads per shape (default 17, four per decade)"
    )
    parser.add_argument("--loads", type=float, nargs="+", help="these Moes M instead, 10 to 1e5")
    parser.add_argument("--lubricant", type=float, default=10.0, help="Moes L (default 10)")
    parser.add_argument("--nodes", type=int, default=129, help="nodes along rolling (default 129)")
    parser.add_argument("--refine", type=float, default=2.0, help="factor of the check, 1 = none (default 2)")
    parser.add_argument("--output", type=Path, help="PNG file of the figure")
    parser.add_argument("--csv", type=Path, help="CSV file that the rows are added to")
    args = parser.parse_args(arguments)
    loads = args.loads or np.geomspace(*RANGE, args.points).tolist()
    rows = run(loads, args.lubricant, args.nodes, args.refine, args.csv)
    print(f"{'deviation of the solved loss [%]':38s}{'':10s}{BIBOULET:>24s}{HOUPERT:>24s}")
    print(
        f"{'shape':16s}{'decade of M':22s}{'contacts':10s}"
        + 2 * f"{'mean':>12s}{'largest':>12s}"
        + f"{'refined':>12s}"
    )
    for (shape, low), (count, *shares) in deviations_by_decade(rows).items():
        figures = "".join(f"{100.0 * share:+12.1f}" for share in shares)
        print(f"{shape:16s}{f'{low:.0e} to {10.0 * low:.0e}':22s}{count:<10d}{figures}")
    if rows and args.output is not None:
        figure_of(rows).savefig(args.output, dpi=200)
        print(args.output)
    return rows


if __name__ == "__main__":
    main()
