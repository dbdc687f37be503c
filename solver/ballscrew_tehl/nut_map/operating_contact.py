"""The contact of one ball at an operating point of the screw: conditions from load, speed and temperature."""

from __future__ import annotations

from ..contact.solve import ContactConditions, ContactSolution, SolverOptions, solve_contact
from ..hertz import E_prime, reduced_radii
from ..kinematics import surface_speeds
from ..load import contact_angle_at_ball_load
from ..parameters import Parameters


class UnconvergedContactError(ArithmeticError):
    """A contact that the solver could not finish; the message names it and says why."""


def ball_contact(
    parameters: Parameters, raceway: str, load: float, speed: float, temperature: float
) -> ContactConditions:
    """Conditions of a ball with its own loaded contact angle.

    Parameters   load [N] > 0; speed of the screw [rad/s] > 0; temperature of oil and bodies [K]
    Raises       ValueError: out of range
    """
    screw = parameters.screw
    R_x, R_y = reduced_radii(screw, float(contact_angle_at_ball_load(screw, load)), raceway)
    speeds = surface_speeds(parameters, raceway, speed)
    return ContactConditions(
        float(load),
        float(R_x),
        float(R_y),
        float(speeds.u_1),
        float(speeds.u_2),
        float(temperature),
        E_prime(screw),
    )


def solve_ball(
    parameters: Parameters, raceway: str, load: float, speed: float, temperature: float, thermal: bool
) -> ContactSolution:
    """Solve it.

    Raises       UnconvergedContactError: names the contact and the reason
    """
    conditions = ball_contact(parameters, raceway, load, speed, temperature)
    # a pressure spike that wanders between two nodes comes to rest on other nodes
    for n_x in (SolverOptions.n_x, 161, 193):
        options = SolverOptions(thermal=thermal, n_x=n_x)
        solution = solve_contact(conditions, parameters.lubricant, parameters.solid, options)
        if solution.converged:
            break
    else:
        raise UnconvergedContactError(
            f"contact not solved: {raceway}, load {load:.6g} N, speed {speed:.6g} rad/s, {temperature:.6g} K "
            f"({'thermal' if thermal else 'isothermal'}): {solution.reason}"
        )
    return solution
