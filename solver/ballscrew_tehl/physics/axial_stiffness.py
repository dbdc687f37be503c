"""Axial stiffness of the preloaded nut from the Hertz law of its contacts, bodies rigid.

Nut A and nut B are as in `load`: an axial load > 0 on the nut relieves A and loads B, and both share one rigid body.
With approach d of screw and nut at the balls of a nut, F = k d^(3/2) (nut_stiffness_constant). Preload P gives both the
approach d_0 = (P/k)^(2/3). A displacement x of the nut against the screw adds to one and takes from the other:

    F_A = k max(d_0 - x, 0)^(3/2),  F_B = k max(d_0 + x, 0)^(3/2),  load = F_B - F_A.

All kinds of preload have this law: with oversize balls A and B are the two pairs of flanks, each with all balls, and
d_0 is the oversize over sin(beta) cos(lambda). Assumed: rigid bodies, equal loads of the balls, constant contact angle;
the chain of `load` assumes none of these. Bodies of the default sections make GD4008-3 at 2 kN up to 18 % softer.
"""

import math
from typing import Any

import numpy as np

from ..parameters.file import ScrewParameters
from .ball_law import check_force, contact_compliance


def nut_stiffness_constant(screw: ScrewParameters, contact_angle: float | None = None) -> float:
    """k of the axial force k d^(3/2) of one nut over its approach d [N/m^1.5].

    Parameters   contact_angle : [rad]; None = that without load
    Validity     constant contact angle. At the angle under its preload the stiffness of GD4008-3 at 2 kN is 1.2 % below
                 that with an angle that follows the load, at the angle without load 3.7 %
    Source       Hertz, both contacts of a ball in series: Q = (sb d/C)^(3/2), F = n sb Q, sb = sin(beta) cos(lambda)
    Example
        >>> from ballscrew_tehl.parameters.file import load_screw
        >>> round(nut_stiffness_constant(load_screw().screw) / 1e11, 2)
        2.14
    """
    beta = screw.contact_angle if contact_angle is None else contact_angle
    sb = math.sin(beta) * math.cos(screw.lead_angle)
    compliance = contact_compliance(screw, beta)
    return screw.loaded_ball_count * sb * (sb / compliance) ** 1.5


def preload_approach(stiffness: float, preload: Any) -> Any:
    """Approach d_0 of each nut under preload alone [m], also the displacement at which the relieved nut comes free.

    Parameters   stiffness : k [N/m^1.5], > 0;  preload : float or array [N], >= 0
    Raises       ValueError: not finite or negative
    """
    check_force("preload", preload)
    return np.cbrt(np.asarray(preload, dtype=float) / stiffness)[()] ** 2


def forces_of_displacement(stiffness: float, preload: Any, deflection: Any) -> tuple[Any, Any]:
    """Forces of nut A and nut B [N] at a displacement x of the nut against the screw.

    Parameters   stiffness, preload : as preload_approach;  deflection : x, float or array [m], > 0 loads B
    """
    d_0 = preload_approach(stiffness, preload)
    x = np.asarray(deflection, dtype=float)
    a, b = np.maximum(d_0 - x, 0.0), np.maximum(d_0 + x, 0.0)
    return (stiffness * a * np.sqrt(a))[()], (stiffness * b * np.sqrt(b))[()]


def axial_stiffness(stiffness: float, preload: Any, deflection: Any = 0.0) -> Any:
    """d load/d x of the nut [N/m]; without load 3 k^(2/3) preload^(1/3), with the cube root of the preload.

    Parameters   as forces_of_displacement
    """
    force_a, force_b = forces_of_displacement(stiffness, preload, deflection)
    return 1.5 * np.cbrt(stiffness) ** 2 * (np.cbrt(force_a) + np.cbrt(force_b))


def axial_deflection(stiffness: float, preload: Any, axial_load: Any) -> Any:
    """Displacement x of the nut against the screw under an axial load, inverse of forces_of_displacement.

    Parameters   stiffness, preload : as preload_approach;  axial_load : float or array [N], > 0 loads B
    Returns      x [m], sign of the load
    Raises       ValueError: not finite, or a negative preload
    Source       beyond separation d_0 + x = (load/k)^(2/3); before it by Newton's method, which converges from there:
                 the load is concave up to x = d_0
    """
    check_force("axial_load", axial_load, allow_negative=True)
    d_0, load = np.broadcast_arrays(preload_approach(stiffness, preload), np.abs(axial_load))
    d_0, load = d_0.astype(float), load.astype(float)
    free = np.cbrt(load / stiffness) ** 2 - d_0  # of the loaded nut alone
    x = np.where(free >= d_0, free, 0.0)
    inside = (free < d_0) & (load > 0.0)
    for _ in range(100):
        a, b = d_0[inside] - x[inside], d_0[inside] + x[inside]
        step = (load[inside] / stiffness - (b * np.sqrt(b) - a * np.sqrt(a))) / (
            1.5 * (np.sqrt(a) + np.sqrt(b))
        )
        x[inside] = np.minimum(x[inside] + step, d_0[inside])
        if np.all(np.abs(step) <= 1e-15 * d_0[inside]):
            break
    else:
        raise ArithmeticError(f"axial deflection not converged, last step {np.max(np.abs(step)):.1e} m")
    return (x * np.sign(axial_load))[()]


def lost_motion(stiffness: float, preload: Any, axial_load: Any) -> Any:
    """Way of the nut when the axial load changes its sign [m]: elastic displacements to both sides."""
    return 2.0 * np.abs(axial_deflection(stiffness, preload, axial_load))
