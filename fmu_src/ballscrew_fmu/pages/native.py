"""Documentation inside the native FMUs: index.html with validation, licences of what is embedded."""

from collections.abc import Mapping
from html import escape
from importlib.metadata import distribution
from typing import Any, NamedTuple

from ballscrew_fmu.models import FRICTION, FmuModel
from ballscrew_fmu.pages.friction import _row, friction_provenance, map_provenance, split_statement
from ballscrew_fmu.pages.monitor import NATIVE, ZERO_STEP, monitor_page
from ballscrew_fmu.pages.page import HEAD, VARIABLES
from ballscrew_fmu.variables.friction import TIME
from ballscrew_tehl.runtime.constants import TOO_LARGE


class Validation(NamedTuple):
    """What the builder found: tables as HTML, plots as PNG by file name."""

    tables: str = ""
    plots: Mapping[str, bytes] = {}


NOT_VALIDATED = Validation("<p>Not recorded in this build.</p>")

LICENSE = """\
This FMU, its sources and its map
---------------------------------
{project}
Parts that are linked into the libraries
----------------------------------------
Windows: start-up code and C library stubs of mingw-w64, public domain or Zope Public License 2.1,
https://www.mingw-w64.org. All: compiler-rt of LLVM or of Zig, MIT licence or Apache 2.0 with LLVM exceptions.

FMI headers the sources are compiled with
-----------------------------------------
Copyright MODELISAR consortium and Modelica Association Project "FMI", 2-clause BSD licence,
https://fmi-standard.org.
"""

PAGE = (
    HEAD
    + """\
<p><img src="../terminalsAndIcons/icon.png" alt="ball screw with nut" width="128"></p>
<p>Friction torque of a preloaded double-nut ball screw, looked up in a map of thermal elastohydrodynamic
contact solutions. FMI {fmi}, co-simulation and model exchange, in C99 without any dependency; {platforms}.</p>
<h2>Which FMU is for whom</h2>
<table>
<tr><th>host</th><th>FMU</th></tr>
<tr><td>Modelica tools, Simulink, real-time targets, any importer without Python</td>
<td>{name}_fmi2.fmu (FMI 2.0) or {name}_fmi3.fmu (FMI 3.0)</td></tr>
<tr><td>a Python host that wants contacts solved at run time (refine)</td>
<td>BallScrewFriction.fmu (FMI 2.0 co-simulation)</td></tr>
</table>
<p>Inputs, outputs and parameters that they share have the same names, value references and results.</p>
<h2>Map</h2>
<p>{provenance}</p>
<h2>Friction parameters</h2>
{friction}
<h2>What to believe</h2>
<ul>
<li>{split}</li>
<li>With the published kinematics the torque reproduces the publication; film thickness and temperature rise
follow its speeds in a fixed frame. With rolling_frame kinematics film and temperature are to be trusted.</li>
<li>Films are those of smooth surfaces fully supplied with oil.</li>
</ul>
<h2>Validation</h2>
{validation}
<h2>Behaviour</h2>
<ul>
<li>friction_torque opposes motion: J dw/dt = motor torque - friction_torque. It is the sum of its parts.</li>
<li>Inputs beyond the map are clamped, in_range is false, one warning per input is logged. Preload 0 without
axial load gives torque 0. All parameters may change between steps.</li>
<li>NaN, infinity, a number of {limit:g} or more or a negative parameter is refused when it is set, with a
message that names the variable: Error in co-simulation; in model exchange Discard, and the value before
stays.</li>
<li>Below {slowest:.3g} rad/s the viscous torque goes smoothly and linearly to 0 at rest, the film follows
speed^0.67.</li>
<li>The state can be saved, restored and serialized, bristle included. A serialized state of another version or
map is refused.</li>
<li>Nothing is allocated in a step; the map is read once, from the resources, when an instance is made.</li>
</ul>
<h2>Co-simulation</h2>
<p>Outputs belong to the last step: inputs that are set afterwards act in the next step. While initializing,
outputs follow the inputs. {zero_step} Directional derivatives are those of the last step at its end.</p>
<h2>Standstill</h2>
<p>With presliding_stiffness = 0 the Coulomb parts follow tanh(speed/regularization_speed). They cannot hold an
axis at rest, and in explicit coupling with an inertia J they ripple unless the step is shorter than
2 J regularization_speed/torque.</p>
<p>presliding_stiffness &gt; 0 replaces the tanh by an elasto-plastic bristle: elastic up to 0.7 of the Coulomb
torque over the stiffness, then it yields, and slips at the Coulomb torque. The axis holds, stores energy and
springs back, so friction_torque may point along the motion and power_loss differs from torque times speed. With
stiffness s0, damping s1 (presliding_damping), step h and inertia J, explicit coupling is stable for</p>
<table>
<tr><th>both models step with old values</th><td>s0 &lt; (s1/h) (1 - h s1/J)</td>
<td>best s1 = 0.5 J/h, then s0 up to 0.25 J/h^2</td></tr>
<tr><th>friction first, then the inertia</th><td>s0 &lt; (4 - 2 h s1/J) J/h^2</td><td>for h s1/J up to 1</td></tr>
</table>
<p>Example: J = 0.01 kg m2 and h = 1 ms allow 2500 N.m/rad with s1 = 5 N.m.s/rad. Without damping no explicit
coupling with old values is stable. The damping adds its own torque while the bristle yields: keep s1 times speed
well below the Coulomb torque.</p>
<h2>Model exchange</h2>
<p>One continuous state, presliding_deflection, also where the bristle is switched off (its rate is 0 then). Two
modes that change at events only: the bristle follows the motion, or it slips and the torque is the Coulomb torque
at constant deflection. slip_indicator passes 0 where the bristle reaches 0.999 of its sliding deflection, and
where the speed reverses while it slips; in_range_indicator where an input leaves the map or comes back. Both have
hysteresis, so that no event repeats at once. The tanh law needs no event.</p>
<h2>Terminal</h2>
<p>shaft: speed (in) and friction_torque (out, against the speed). It has no angle, so it is no flange of
Modelica: put the torque on a flange with a torque source of opposite sign.</p>
<h2>Reference results and sources</h2>
<p>extra/org.fmi-standard.fmi-ls-ref holds an input sequence and the outputs that the map gives for it. sources
holds all C code; compile it with the FMI headers of your version, C99 and the mathematics library. Without
-ffp-contract=off results may differ in the last digits.</p>
"""
    + VARIABLES
)
_ZERO_STEP = {
    2: "A step of size 0 does nothing but take the inputs.",
    3: "A step of size 0 is an Error.",
}


def native_documentation(
    header: Mapping[str, Any],
    fmi_version: int,
    platforms: str,
    validation: Validation = NOT_VALIDATED,
    model: FmuModel = FRICTION,
) -> dict[str, bytes]:
    """Files of the documentation folder by path.

    Parameters   platforms : for which binaries are included, in words
    """
    table = model.native_variables(header)
    table = table if fmi_version == 2 else (*table, TIME)
    shown = "\n".join(
        f'<p><img src="{escape(name)}" alt="{escape(name.rpartition(".")[0].replace("_", " "))}"></p>'
        for name in sorted(validation.plots)
    )
    values = {
        "name": model.native_name,
        "fmi": f"{fmi_version}.0",
        "platforms": escape(platforms),
        "provenance": escape(map_provenance(header)),
        "friction": friction_provenance(header),
        "validation": f"{validation.tables}\n{shown}",
        "limit": TOO_LARGE,
        "rows": "\n".join(_row(v) for v in table),
    }
    if model is FRICTION:
        page = PAGE.format(
            slowest=header["axes"]["speed"][0],
            zero_step=_ZERO_STEP[fmi_version],
            split=split_statement(header),
            **values,
        )
    else:
        zero_step = ZERO_STEP[fmi_version]
        page = monitor_page(NATIVE, lowest=header["axes"]["preload"][0], zero_step=zero_step, **values)
    texts = {"index.html": page, "licenses/license.txt": LICENSE.format(project=_project_license())}
    return {name: text.encode() for name, text in texts.items()} | dict(validation.plots)


def _project_license() -> str:
    for file in distribution("ballscrew-tehl").files or ():
        if file.name == "LICENSE":
            return str(file.read_text())
    return "MIT licence\n"
