"""The film of a rolling circle by a published multigrid solution and by this solver."""

import math
import time

from ..contact import ContactConditions, SolverOptions, reference_oil, solve
from ..parameters.file import load_screw
from ..parameters.oil import ROELANDS_LN

# case ti_006 of https://github.com/vachekivan495-design/PINN-EHL-Reproducibility (data: CC BY 4.0): steel on glass,
# isothermal, Roelands, Dowson-Higginson 0.59 GPa; [N], [m], [m/s], [Pa s], [1/Pa], [Pa]
LOAD, RADIUS, SPEED = 28.63282784819603, 0.01268, 1.5495457435026765
ETA0, ALPHA, P_ROELANDS = 0.06853415663987397, 2.3665293604135514e-8, 1.96e8
E_PRIME = 2.0 / ((1.0 - 0.3**2) / 210e9 + (1.0 - 0.208**2) / 81e9)
#: domain in Hertz radii, nodes, films [m], elapsed time [s] of the multigrid
NAMES = ("x_in", "x_out", "y_max", "n_x", "n_y", "central_film", "minimum_film", "time")
MULTIGRID = dict(zip(NAMES, (-4.0, 2.0, 3.0, 769, 769, 609.842e-9, 380.173e-9, 2885.94), strict=True))


def circle_rows() -> list[dict[str, float]]:
    """The published row, then this solver on the same domain and on its default one; CPU times, converged or not."""
    z = ALPHA * P_ROELANDS / (math.log(ETA0) + ROELANDS_LN)
    given = {"viscosity": ETA0, "pressure_viscosity": ALPHA, "roelands_pressure": P_ROELANDS, "z_roelands": z}
    oil, solid = reference_oil("roelands").model_copy(update=given), load_screw().solid
    at = ContactConditions(LOAD, RADIUS, RADIUS, SPEED, SPEED, oil.reference_temperature, E_PRIME)
    rows: list[dict[str, float]] = [MULTIGRID]
    same = SolverOptions(thermal=False, x_in=-4.0, x_out=2.0, y_max=3.0)
    for options in (same, SolverOptions(thermal=False)):
        begun = time.process_time()
        s = solve(at, oil, solid, options)
        used, ends = time.process_time() - begun, map(float, (s.x[0], s.x[-1], s.y[-1]))
        found = (*ends, s.x.size, 2 * s.y.size - 1, s.h_c, s.h_m, used)
        rows.append(dict(zip(NAMES, found, strict=True)) | {"converged": s.converged})
    return rows
