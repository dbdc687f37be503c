"""The contact of one ball at an operating point of the screw: conditions from load, speed and temperature."""

import math

from ..parameters.file import LubricantParameters, Parameters, SolidParameters
from ..physics.ball_law import contact_angle_at_ball_load
from ..physics.hertz import E_prime, reduced_radii
from ..physics.kinematics import surface_speeds
from .conditions import DEFAULT_OPTIONS, ContactConditions, SolverOptions, number, scales_of
from .problem import Solids
from .result import ContactResult
from .solver import solve

#: nodes along rolling of a direct solve; the film is extrapolated from these and half of them
MAP_NODES = 97
#: Moes M and least L where a rigid contact becomes a flattened one, which takes the default of SolverOptions: on 97
#: nodes the pressure spike, a few spacings wide there, moved films by 1.5 % and one rolling loss by 7 % in nine
#: contacts, on 129 by 0.5 %
SPIKE_M, SPIKE_L = (15.0, 80.0), 15.0


class UnconvergedContactError(ArithmeticError):
    """A contact that did not converge; the message names it and the reason."""


def ball_conditions(
    parameters: Parameters, raceway: str, load: float, speed: float, temperature: float
) -> ContactConditions:
    """Conditions of a ball with its own loaded contact angle.

    Parameters   load [N] > 0; speed of the screw [rad/s] > 0; temperature of oil and bodies [K]
    Raises       ValueError: out of range
    """
    screw = parameters.screw
    load, speed = number("load", load, "N"), number("speed", speed, "rad/s")
    temperature = number("temperature", temperature, "K")
    if not (0.0 < speed < math.inf):
        raise ValueError(f"speed = {speed} rad/s; needs finite, > 0: the other way round is the mirror image")
    angle = float(contact_angle_at_ball_load(screw, load))
    R_x, R_y = (float(r) for r in reduced_radii(screw, angle, raceway))
    speeds = surface_speeds(parameters, raceway, speed)
    u_1, u_2 = float(speeds.u_1), float(speeds.u_2)
    return ContactConditions(load, R_x, R_y, u_1, u_2, temperature, E_prime(screw))


def map_nodes(conditions: ContactConditions, oil: LubricantParameters) -> int:
    """Nodes along rolling that a direct solve takes."""
    scales = scales_of(conditions, oil)
    sharp = SPIKE_M[0] <= scales.M <= SPIKE_M[1] and scales.L >= SPIKE_L
    return DEFAULT_OPTIONS.n_x if sharp else MAP_NODES


def solve_for_map(
    conditions: ContactConditions, oil: LubricantParameters, solid: SolidParameters | Solids, thermal: bool
) -> ContactResult:
    """The last solve of a contact of a ball: on the default nodes or twice MAP_NODES where fewer do not converge."""
    for n_x in sorted({map_nodes(conditions, oil), DEFAULT_OPTIONS.n_x, 2 * MAP_NODES - 1}):
        result = solve(conditions, oil, solid, SolverOptions(thermal=thermal, n_x=n_x), warn=False)
        if result.converged:
            break
    return result


def solve_ball(
    parameters: Parameters, raceway: str, load: float, speed: float, temperature: float, thermal: bool
) -> ContactResult:
    """Solve the contact of one ball, with a further attempt on another grid.

    Raises       UnconvergedContactError: names the contact and the reason
    """
    conditions = ball_conditions(parameters, raceway, load, speed, temperature)
    result = solve_for_map(conditions, parameters.lubricant, parameters.solids, thermal)
    if result.converged:
        return result
    raise UnconvergedContactError(
        f"contact not solved: {raceway}, load {load:.6g} N, speed {speed:.6g} rad/s, {temperature:.6g} K "
        f"({'thermal' if thermal else 'isothermal'}): {result.reason}"
    )
