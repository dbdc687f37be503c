"""The contact of one ball at an operating point of the screw: conditions from load, speed and temperature."""

from __future__ import annotations

from ..parameters.file import Parameters
from ..physics.asperity import Roughness
from ..physics.hertz import E_prime, ellipse, reduced_radii
from ..physics.kinematics import SlipField, centre_speeds, slip_field, surface_speeds
from ..physics.load import contact_angle_at_ball_load
from .solve import ContactConditions, ContactSolution, SolverOptions, solve_contact

#: nodes along rolling of the contacts of a map; the film is extrapolated from these and half of them
MAP_NODES = 97
#: nodes along rolling and thermal iterations of the attempts in turn: a pressure spike that oscillates between two
#: nodes converges on other nodes or after more iterations
ATTEMPTS = ((MAP_NODES, 150), (129, 150), (MAP_NODES, 600), (161, 600))
#: Moes load above which a thermal solve that fails is continued from lower loads, and how often the load is halved
CONTINUED_ABOVE, MOST_HALVINGS = 3e4, 5


class UnconvergedContactError(ArithmeticError):
    """A contact that did not converge; the message names it and the reason."""


def ball_contact(
    parameters: Parameters,
    raceway: str,
    load: float,
    speed: float,
    temperature: float,
    slip: bool = False,
    roughness: Roughness | None = None,
) -> ContactConditions:
    """Conditions of a ball with its own loaded contact angle.

    Parameters   load [N] > 0; speed of the screw [rad/s] > 0; temperature of oil and bodies [K]; slip: with the
                 differential slip and the spin of the kinematics (none in `published`), which take the whole plane;
                 roughness: of both surfaces together, None = smooth, as in a map; not from the screw file
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
    differential_1, differential_2, spin_1, spin_2 = (float(v) for v in field)
    return ContactConditions(
        float(load), R_x, R_y, u_1, u_2, float(temperature), E_prime(screw), differential_1, differential_2,
        spin_1, spin_2, roughness,
    )  # fmt: skip


def solve_ball(
    parameters: Parameters, raceway: str, load: float, speed: float, temperature: float, thermal: bool
) -> ContactSolution:
    """Solve the contact of one ball, with further attempts on other grids.

    Above M = 3e4 heat may leave a film of a nanometre, where the bodies touch on the grid or the iteration oscillates:
    the thermal reduction is then extrapolated from lower loads, and the branch is "asymptotic".

    Raises       UnconvergedContactError: names the contact and the reason
    """
    conditions = ball_contact(parameters, raceway, load, speed, temperature)
    for n_x, most_iterations in ATTEMPTS:
        solution = _attempt(parameters, conditions, thermal, n_x, most_iterations)
        if solution.converged:
            return solution
        if thermal and solution.M > CONTINUED_ABOVE:
            continued = _continued(parameters, raceway, load, speed, temperature)
            if continued is not None:
                return continued
    raise UnconvergedContactError(
        f"contact not solved: {raceway}, load {load:.6g} N, speed {speed:.6g} rad/s, {temperature:.6g} K "
        f"({'thermal' if thermal else 'isothermal'}): {solution.reason}"
    )


def _attempt(
    parameters: Parameters, conditions: ContactConditions, thermal: bool, n_x: int, most_iterations: int
) -> ContactSolution:
    options = SolverOptions(thermal=thermal, n_x=n_x, max_thermal=most_iterations)
    return solve_contact(conditions, parameters.lubricant, parameters.solid, options)


def _continued(
    parameters: Parameters, raceway: str, load: float, speed: float, temperature: float
) -> ContactSolution | None:
    """The thermal solution beyond the loads that converge; None: even the lower ones do not.

    Film over isothermal film, minimum over central film, temperature rise and traction over load are extrapolated
    linearly in logarithms from the highest halved load that converges and half of it: 10 % too much film and 12 % too
    much rise over one halving, where both are known (M = 2e4). The fields are those of the load that converges.
    """

    def solved(at: float, thermal: bool) -> ContactSolution:
        conditions = ball_contact(parameters, raceway, at, speed, temperature)
        return _attempt(parameters, conditions, thermal, *ATTEMPTS[0])

    cold = solved(load, False)
    pairs: list[tuple[ContactSolution, ContactSolution]] = []
    for halvings in range(1, MOST_HALVINGS + 1):
        at = load * 0.5**halvings
        pair = solved(at, False), solved(at, True)
        pairs = [*pairs, pair] if all(s.converged for s in pair) else []
        if len(pairs) == 2:
            break
    else:
        return None
    (isothermal, hot), (lower_isothermal, farther) = pairs
    steps = halvings - 1

    def extrapolated(near: float, far: float) -> float:
        return near * (near / far) ** steps if near * far > 0.0 else near

    h_c = cold.h_c * min(extrapolated(hot.h_c / isothermal.h_c, farther.h_c / lower_isothermal.h_c), 1.0)
    h_m = h_c * min(extrapolated(hot.h_m / hot.h_c, farther.h_m / farther.h_c), 1.0)
    share = extrapolated(
        hot.traction_force / hot.conditions.load, farther.traction_force / farther.conditions.load
    )
    return hot.moved_to(
        cold,
        p_max=cold.p_max,
        h_c=h_c,
        h_m=h_m,
        temperature_rise=extrapolated(hot.temperature_rise, farther.temperature_rise),
        traction_force=share * load,
        reason=f"thermal reduction continued from {hot.conditions.load:.6g} N",
    )
