"""The contact of one ball at an operating point of the screw: conditions from load, speed and temperature."""

from __future__ import annotations

from ..contact.solve import ContactConditions, ContactSolution, SolverOptions, solve_contact
from ..hertz import E_prime, ellipse, reduced_radii
from ..kinematics import SlipField, centre_speeds, slip_field, surface_speeds
from ..load import contact_angle_at_ball_load
from ..parameters import Parameters

#: nodes along rolling of the contacts of a map; half of them serve to extrapolate the film
MAP_NODES = 97
#: thermal iterations after which another grid is tried
MOST_ITERATIONS = 150


class UnconvergedContactError(ArithmeticError):
    """A contact that the solver could not finish; the message names it and says why."""


def ball_contact(
    parameters: Parameters, raceway: str, load: float, speed: float, temperature: float, slip: bool = False
) -> ContactConditions:
    """Conditions of a ball with its own loaded contact angle.

    Parameters   load [N] > 0; speed of the screw [rad/s] > 0; temperature of oil and bodies [K]; slip: with the
                 differential slip and the spin of the kinematics (none in `published`), which take the whole plane
    Raises       ValueError: out of range
    """
    screw = parameters.screw
    angle = float(contact_angle_at_ball_load(screw, load))
    R_x, R_y = (float(r) for r in reduced_radii(screw, angle, raceway))
    speeds = surface_speeds(parameters, raceway, speed)
    u_1, u_2, field = float(speeds.u_1), float(speeds.u_2), SlipField()
    if slip:
        field = slip_field(parameters, raceway, speed, angle)
        semi_axis = float(ellipse(load, R_x, R_y, E_prime(screw)).a)
        u_1, u_2 = (float(u) for u in centre_speeds(speeds, field, semi_axis))
    return ContactConditions(
        float(load), R_x, R_y, u_1, u_2, float(temperature), E_prime(screw), *(float(v) for v in field)
    )


def solve_ball(
    parameters: Parameters, raceway: str, load: float, speed: float, temperature: float, thermal: bool
) -> ContactSolution:
    """Solve it.

    Raises       UnconvergedContactError: names the contact and the reason
    """
    conditions = ball_contact(parameters, raceway, load, speed, temperature)
    # a pressure spike that wanders between two nodes comes to rest on other nodes
    for n_x in (MAP_NODES, 129, 161, 193):
        options = SolverOptions(thermal=thermal, n_x=n_x, max_thermal=MOST_ITERATIONS)
        solution = solve_contact(conditions, parameters.lubricant, parameters.solid, options)
        if solution.converged:
            return solution
    raise UnconvergedContactError(
        f"contact not solved: {raceway}, load {load:.6g} N, speed {speed:.6g} rad/s, {temperature:.6g} K "
        f"({'thermal' if thermal else 'isothermal'}): {solution.reason}"
    )
