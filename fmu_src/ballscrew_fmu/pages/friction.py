"""Documentation inside the FMU: index.html, external dependencies, licence of what is embedded."""

import json
from collections.abc import Mapping
from html import escape
from importlib.metadata import distribution
from typing import Any

from ballscrew_fmu.models import FRICTION, FmuModel
from ballscrew_fmu.pages.monitor import PYTHON, monitor_page
from ballscrew_fmu.variables.friction import Variable
from ballscrew_tehl.runtime.constants import TOO_LARGE
from ballscrew_tehl.runtime.packed import certificate_totals

EXTERNAL_DEPENDENCIES = """\
The binaries of this FMU (pythonfmu) run Python code inside the importing process. They need:
- a host that runs Python 3.11 or later itself, for instance fmpy, OMSimulator's Python interface or libcosim
  from Python. In a host without Python the library does not load. Platforms: x86_64 Linux and x86_64 Windows.
- numpy in that Python.
{refine}Unpack the FMU to a folder whose path holds no special characters other than blanks.
"""
REFINE = """\
- with refine = true also numba, scipy and pydantic. Without them the results are those of the map, and an error
  is logged. The contact solver is compiled once per machine (about 20 s) and kept in the user's cache folder
  (XDG_CACHE_HOME or ~/.cache, LOCALAPPDATA, ~/Library/Caches), below ballscrew_tehl.
"""

PAGE = """\
<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>BallScrewFriction</title></head>
<body>
<h1>BallScrewFriction</h1>
<p>Friction torque of a preloaded double-nut ball screw, looked up in a map of thermal elastohydrodynamic
contact solutions. FMI 2.0 co-simulation for hosts that run Python (see externalDependencies.txt).</p>
<h2>Map</h2>
<p>{provenance}</p>
<h2>Friction parameters</h2>
{friction}
<h2>What to believe</h2>
<ul>
<li>{split}</li> <li>With the published kinematics the torque reproduces the publication; film thickness and
temperature rise follow its speeds in a fixed frame. With rolling_frame kinematics film and temperature are to
be trusted.</li> <li>Films are those of smooth surfaces fully supplied with oil.</li>
</ul>
<h2>Behaviour</h2>
<ul>
<li>friction_torque opposes motion: J dw/dt = motor torque - friction_torque. It is the sum of its parts.</li>
<li>Outputs belong to the last step: inputs that are set afterwards act in the next step. While initializing,
outputs follow the inputs.</li>
<li>Inputs beyond the map are clamped, in_range is false, one warning per input is logged. Preload 0 without
axial load gives torque 0. All parameters may change between steps.</li>
<li>NaN, infinity, a number of {limit:g} or more, a negative parameter or step size: doStep returns Discard,
nothing changes, the log names the variable (if it is on: in fmpy instantiate(loggingOn=True)). A later usable
value works again.</li>
<li>Below {slowest:.3g} rad/s the viscous torque goes smoothly and linearly to 0 at rest, the film follows
speed^0.67.</li>
<li>Standstill: the Coulomb parts follow tanh(speed/regularization_speed). They cannot hold an axis at rest,
and in explicit coupling with an inertia J they ripple unless the step is shorter than
2 J regularization_speed/torque.</li>
<li>presliding_stiffness &gt; 0 replaces the tanh by an elasto-plastic bristle: the axis holds, stores energy
and springs back, so friction_torque may point along the motion and power_loss differs from torque times
speed. Explicit coupling with step h needs damping:
presliding_stiffness &lt; (presliding_damping/h)(1 - h presliding_damping/J). The damping adds its own torque
while the bristle yields: keep presliding_damping times speed well below the Coulomb torque.</li>
<li>refine: contacts are solved at the operating point, and the map is corrected by what they say, so that
friction_torque follows direct per-ball solves within refine_tolerance (relative). Corrections are remembered and
interpolated, the last {capacity} contacts used being kept; a step that needs new contacts takes 0.1 to 0.6 s, the
others 0.1 ms more. Hysteresis and sliding torque, pressure and ball load stay those of the map, and beyond the map
nothing is solved. The log says what is solved and why, and what cannot be solved; the map goes on there.</li>
<li>The state of the FMU can be saved, restored and serialized, bristle and solved contacts included. A state of
another version or map is refused: an error is logged and steps are discarded until a state of this FMU is
restored.</li>
</ul>
<h2>Variables</h2>
<table border="1">
<tr><th>name</th><th>kind</th><th>unit</th><th>start</th><th>min</th><th>max</th><th>meaning</th></tr>
{rows}
</table>
</body>
</html>
"""


def documentation_files(header: Mapping[str, Any], model: FmuModel = FRICTION) -> dict[str, str]:
    """Files of the FMU's documentation folder by path."""
    axes, provenance = header["axes"], escape(map_provenance(header))
    rows = "\n".join(_row(v) for v in model.variables(header))
    if model is FRICTION:
        from ballscrew_tehl.refinement.refine import CAPACITY  # slow to import

        page = PAGE.format(
            provenance=provenance,
            friction=friction_provenance(header),
            split=split_statement(header),
            limit=TOO_LARGE,
            slowest=axes["speed"][0],
            capacity=CAPACITY,
            rows=rows,
        )
    else:
        page = monitor_page(
            PYTHON,
            name=model.name,
            provenance=provenance,
            friction=friction_provenance(header),
            limit=TOO_LARGE,
            lowest=axes["preload"][0],
            rows=rows,
        )
    licence = distribution("pythonfmu").read_text("licenses/LICENSE")
    return {
        "index.html": page,
        "externalDependencies.txt": EXTERNAL_DEPENDENCIES.format(refine=REFINE if model.refines else ""),
        "licenses/pythonfmu.txt": licence or "MIT licence; https://github.com/NTNU-IHB/PythonFMU\n",
    }


def map_provenance(header: Mapping[str, Any]) -> str:
    """What the map was made from, its range and its certificate, in one paragraph."""
    axes = header["axes"]
    return (
        f"{header['kinematics']} kinematics, film model {header['film_model']}, map {header['content_hash']} "
        f"of version {header['version']}, parameters {header['parameters_hash']}. "
        f"Range: force of a nut up to {axes['force'][1]:g} N, speed up to {axes['speed'][1]:g} rad/s, "
        f"{axes['temperature'][0]:g} to {axes['temperature'][1]:g} K. "
        f"Certificate: {json.dumps(certificate_totals(header['certificate']), sort_keys=True)}"
    )


def split_statement(header: Mapping[str, Any]) -> str:
    """What holds of the parts of the torque; a calibration on own measurements has looked into it."""
    if header.get("friction", {}).get("not_identified") is not None:
        return "What the measured torques of the calibration do not identify stands with the friction parameters."
    return "Fitted parameters: measured torques identify their sum, not the split into viscous and sliding torque."


def friction_provenance(header: Mapping[str, Any]) -> str:
    """Start values of the friction parameters, where they come from, how well they are known; HTML."""
    told, values = header.get("friction"), header["defaults"]
    if not told:
        return "<p>" + escape(", ".join(f"{name} = {value:.6g}" for name, value in values.items())) + "</p>"
    lines = [
        f"<p>{escape(told['set'])}, {escape(told['loss'] or 'not fitted')}: {escape(told['provenance'])}"
    ]
    if told["errors"]:
        errors = (f"{name} {100.0 * value:.2f} %" for name, value in told["errors"].items())
        lines.append(f"<br>Relative deviations from the measured torque: {escape(', '.join(errors))}")
    lines.append("</p>\n<ul>")
    for name, value in values.items():
        unit = " m" if name == "roughness_height" else ""
        text = f"{name} = {value:.6g}{unit}"
        if name in told["limits"]:
            low, high = told["limits"][name]
            text += f", 95 % limits {low:.4g} to {'no bound' if high is None else f'{high:.4g}{unit}'}"
        lines.append(f"<li>{escape(text)}</li>")
    lines.append("</ul>")
    if told["not_identified"]:
        lines.append("<p>Not identified by the measured torques:</p>\n<ul>")
        lines += [f"<li>{escape(name)}: {escape(why)}</li>" for name, why in told["not_identified"].items()]
        lines.append("</ul>")
    elif told["not_identified"] is not None:
        lines.append("<p>The measured torques identify all of them.</p>")
    return "\n".join(lines)


def _row(v: Variable) -> str:
    unit = "Boolean" if v.unit is None else v.unit
    if v.display_unit:
        unit += f" ({v.display_unit})"
    values = (v.start, v.minimum, v.maximum)
    numbers = ("" if x is None else str(x).lower() if isinstance(x, bool) else f"{x:g}" for x in values)
    cells = (v.name, v.causality, unit, *numbers, v.description)
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
