"""Text of the pages of BallScrewFriction; documentation of the FMUs for Python hosts."""

from collections.abc import Mapping
from importlib.metadata import distribution
from typing import Any

from ballscrew_fmu.models import FRICTION, FmuModel
from ballscrew_fmu.pages import monitor
from ballscrew_fmu.pages.page import Part, documentation_page, part
from ballscrew_fmu.variables.friction import band_text, law_name
from ballscrew_tehl.report.page import bullets, paragraph
from ballscrew_tehl.runtime.constants import DAMPING_TIME, ELASTIC_SHARE, TOO_LARGE
from ballscrew_tehl.runtime.packed import FILM_SHEAR, MECHANISTIC

EXTERNAL_DEPENDENCIES = """\
The binaries of this FMU (pythonfmu) run Python code inside the importing process. Requirements:
- a host that runs Python 3.11 or later, for instance fmpy, OMSimulator's Python interface or libcosim
  from Python. In a host without Python the library does not load. Platforms: x86_64 Linux and x86_64 Windows.
- numpy in that Python.
{refine}The path of the unpacked FMU may have blanks and any other characters, except for the text %20 and, on
Windows, characters for which the system has no short name. There is then no instance, and the reason is logged.
"""
REFINE = """\
- with refine = true also numba, scipy, pydantic and threadpoolctl. Without them the results are those of the map,
  and an error is logged. The contact solver is compiled once per machine (about 40 s) and kept in the user's cache
  folder (XDG_CACHE_HOME or ~/.cache, LOCALAPPDATA, ~/Library/Caches), below ballscrew_tehl.
"""
LEAD = (
    "Friction torque of a preloaded double-nut ball screw, from a map of thermal elastohydrodynamic contact "
    "solutions. "
)
DISCARDED = (
    "returns Discard, the outputs are those of the last good step, no state changes, and the variable is logged (if "
    "logging is on: in fmpy instantiate(loggingOn=True)). The step can be repeated with a valid value."
)
HOST = "FMI 2.0 co-simulation for hosts that run Python (see externalDependencies.txt)."
INVALID = (
    f"With NaN, infinity, a magnitude of {TOO_LARGE:g} or more, a negative parameter or a negative step size, doStep "
    f"{DISCARDED}"
)
STEP = (
    "Outputs are those of the last step. Inputs that are set afterwards act in the next step. In initialization mode "
    "the outputs are those of the current inputs."
)
TANH = (
    "are multiplied by tanh(speed/regularization_speed). They cannot hold an axis at rest. In explicit coupling with "
    "an inertia J they oscillate unless the step is shorter than 2 J regularization_speed/torque."
)


#: by friction law: its parts, as text
LAWS = {
    FILM_SHEAR: (
        "shear of the films (viscous_torque), hysteresis of the balls (hysteresis_torque) and a Coulomb part "
        "(sliding_torque), with parameters fitted to measured torques."
    ),
    MECHANISTIC: (
        "hydrodynamic rolling loss of the films (viscous_torque), hysteresis of the balls (hysteresis_torque), slip "
        "in contacts (spin, differential slip, helix) and friction of balls on each other (sliding_torque). One "
        "parameter is fitted, net_sliding_coefficient. apparent_viscosity_ratio is 1 for the viscosity of the oil, and "
        "roughness_height has no effect on torques."
    ),
}
BREAKAWAY = (
    "breakaway_factor: below the lowest speed of the map the sliding torque rises to this multiple of its value in a "
    "full film at standstill. Values that do not exceed what the map has at its lowest speed have no effect."
)


BAND = (
    "Interval that follows from the constants of the law, each known within bounds: {}. It does not contain the "
    "viscosity and supply of the oil, nor seals. Speed and load change it: the command torque gives it for every point."
)


def standstill(header: Mapping[str, Any]) -> tuple[str, ...]:
    """The law of friction at standstill, for the screw of a map."""
    preload = 2000.0
    angle = 1e3 * header["presliding_angle"] * preload ** (1.0 / 3.0)
    return (
        "Standstill: the Coulomb parts pass through an elasto-plastic bristle (presliding, start value true): "
        f"elastic up to {ELASTIC_SHARE:g} of the deflection at which it slides, then yielding. It holds the axis, "
        "stores energy and springs back. So friction_torque may act along the motion, and power_loss differs from "
        "torque times speed. The Coulomb parts never exceed their value in motion.",
        f"It slides at a deflection of {angle:.2g} mrad at {preload:.0f} N, from the width of the contacts: in slow "
        "motion from rest the torque reaches 99 % after 1.7 times this angle, when a ball has travelled three half "
        "widths of its contact. The angle grows with the cube root of the preload. In fast motion the damping reaches "
        "the torque first. At the beginning of a simulation the bristle slides in the "
        "direction of the speed, or has the deflection of presliding_side.",
        "presliding_stiffness = 0 and presliding_damping = 0: from the screw. That stiffness follows preload and axial "
        f"load, and the stored energy stays the same; the damping is {1e3 * DAMPING_TIME:g} ms times the stiffness. A "
        f"step of {1e3 * DAMPING_TIME:g} ms or more (damping over stiffness) is reported once if the bristle needs it.",
        f"presliding = false: the Coulomb parts {TANH}",
    )


def friction_law(header: Mapping[str, Any]) -> str:
    """The friction law of a map, for the beginning of a page."""
    return f"Friction law: {law_name(header)}, that is {LAWS[header['law']]} "


def validity(header: Mapping[str, Any]) -> Part:
    """Which results are reliable. A calibration with own measurements has its own list of unidentified parameters."""
    split = "Fitted parameters: measured torques identify their sum, not the split into viscous and sliding torque."
    if header["law"] == MECHANISTIC:
        split = "Torque of another screw: net_sliding_coefficient has to be fitted to a measured torque of that screw."
    if (header.get("friction") or {}).get("not_identified") is not None:
        split = "Friction parameters: the part above lists those that the calibration does not identify."
    band = band_text(header)
    content = bullets(
        split,
        *((BAND.format(band),) if band else ()),
        "With the published kinematics the torque reproduces the publication, but film thickness and temperature rise "
        "are computed with its surface speeds in a fixed frame. Use rolling_frame kinematics for film and temperature.",
        "Films are those of smooth surfaces fully supplied with oil.",
    )
    return part("Validity", content)


def behaviour(header: Mapping[str, Any], *more: str) -> Part:
    """Behaviour in all hosts, then more."""
    content = bullets(
        "friction_torque opposes motion: J dw/dt = motor torque - friction_torque. It is the sum of its parts.",
        "Inputs outside the map are clamped: in_range is false and one warning per input is logged. Preload 0 without "
        "axial load gives torque 0. All parameters may change between steps.",
        f"Below {header['axes']['speed'][0]:.3g} rad/s the viscous torque falls linearly to 0 at rest, and "
        "the film is proportional to speed^0.67.",
        BREAKAWAY,
        *more,
    )
    return part("Behaviour", content)


def _python_behaviour(header: Mapping[str, Any]) -> Part:
    from ballscrew_tehl.refinement.refine import CAPACITY  # slow to import

    return behaviour(
        header,
        STEP,
        INVALID,
        *standstill(header),
        "Explicit coupling with step h needs damping, with presliding_stiffness < (presliding_damping/h)"
        "(1 - h presliding_damping/J).",
        "refine: contacts are solved at the operating point to correct the map, so that friction_torque agrees with "
        "direct per-ball solutions within refine_tolerance (relative). Corrections are stored and interpolated. The "
        f"last {CAPACITY} contacts used are kept. A step with new contacts takes 0.1 to 0.6 s, other steps 0.1 ms "
        "more. Hysteresis and sliding torque, pressure and ball load are those of the map. Outside the map no contact "
        "is solved. The log lists solved contacts with the reason, and contacts without a solution, where the results "
        "are those of the map.",
        "The state of the FMU can be saved, restored and serialized, bristle and solved contacts included. A state of "
        "another version or map is rejected: an error is logged and doStep returns Discard until a state of this FMU "
        "is restored.",
    )


def documentation_files(header: Mapping[str, Any], model: FmuModel = FRICTION) -> dict[str, str]:
    """Files of the documentation folder by path."""
    if model is FRICTION:
        lead, parts = (
            paragraph(LEAD, friction_law(header), HOST),
            [validity(header), _python_behaviour(header)],
        )
    else:
        lead = paragraph(monitor.LEAD, friction_law(header), HOST)
        parts = monitor.monitor_parts(header, INVALID, f"{STEP} {monitor.ZERO_STEP[2]}")
    licence = distribution("pythonfmu").read_text("licenses/LICENSE")
    return {
        "index.html": documentation_page(model.name, [lead], header, parts, model.variables(header)),
        "externalDependencies.txt": EXTERNAL_DEPENDENCIES.format(refine=REFINE if model.refines else ""),
        "licenses/pythonfmu.txt": licence or "MIT licence; https://github.com/NTNU-IHB/PythonFMU\n",
    }
