"""documentation/index.html of the FMUs BallScrewPreloadMonitor: for Python hosts and native."""

from ballscrew_fmu.pages.page import HEAD, VARIABLES

PAGE = (
    HEAD
    + """\
<p>Preload of a double-nut ball screw from its measured friction torque, speed and temperature: the preload at which
a map of thermal elastohydrodynamic contact solutions shows that torque. {host}</p>
<h2>Map</h2>
<p>{provenance}</p>
<h2>Friction parameters</h2>
{friction}
<h2>What to believe</h2>
<ul>
<li>The inverse of BallScrewFriction with the same parameters and without presliding. It knows no error of the model:
calibrate the friction parameters to your screw first.</li>
<li>torque must be that of friction alone: take the torque of inertia, of the motor and of the axial load (lead over
2 pi times load) off before.</li>
<li>preload_half_width is torque_uncertainty over torque_sensitivity, for small intervals. Noise of speed and
temperature, and what calibration leaves, come on top. The start value of torque_uncertainty is an example.</li>
</ul>
<h2>Behaviour</h2>
<ul>
<li>in_range is true while the torque tells the preload: speed at or above speed_min, speed, temperature and axial
load within the map, and a preload within the map that gives the torque.</li>
<li>Below speed_min, and at speed 0, preload keeps the last value that was in range, or initial_preload before there
was one; half-width and sensitivity are those of that preload at speed_min. The start value of speed_min, 1 rad/s,
is ten times that of regularization_speed: what is measured below is breakaway and stick-slip.</li>
<li>While the screw turns, preload follows the torque beyond the range as well, with in_range false: a torque against
the motion gives 0, one above all that the map gives the highest preload of the map; below {lowest:g} N the power
laws of the map go on. Speed and temperature are clamped to the map.</li>
<li>Torque rises with preload all over the packaged maps as long as both nuts are loaded. Where an axial load parts
them, the torque is that of one nut: preload is then the one at which they part, the most it can be, and in_range is
false. Likewise in_range is false where 1 % of preload is less than 0.01 % of torque, or where the torque of a map
falls with preload.</li>
<li>Inputs that are clamped are logged once each; {refusal}</li>
<li>{step}</li>
<li>The state can be saved, restored and serialized. One of another version or map is refused.</li>
</ul>
{more}"""
    + VARIABLES
)
PYTHON = {
    "host": "FMI 2.0 co-simulation for hosts that run Python (see externalDependencies.txt).",
    "refusal": "NaN, infinity, a number of {limit:g} or more, a negative parameter or step size: doStep returns "
    "Discard, nothing changes, the log names the variable. A later usable value works again.",
    "step": "Outputs belong to the last step: inputs that are set afterwards act in the next step. While "
    "initializing, outputs follow the inputs. A step of size 0 gives the outputs, and is not remembered.",
    "more": "",
}
NATIVE = {
    "host": "FMI {fmi}, co-simulation and model exchange, in C99 without any dependency; {platforms}.",
    "refusal": "NaN, infinity, a number of {limit:g} or more or a negative parameter is refused when it is set, with "
    "a message that names the variable: Error in co-simulation; in model exchange Discard, and the value before "
    "stays.",
    "step": "Co-simulation: outputs belong to the last step: inputs that are set afterwards act in the next step. "
    "While initializing, outputs follow the inputs. {zero_step} A step takes a bounded number of evaluations of the "
    "map, mostly four to seven, and allocates nothing.",
    "more": """\
<p><img src="../terminalsAndIcons/icon.png" alt="ball screw with nut" width="128"></p>
<h2>Model exchange</h2>
<p>No continuous state. Rest and in_range change at events only, with hysteresis: motion_indicator passes 0 where the
speed reaches speed_min, in_range_indicator where the preload or an input leaves the map. At the event that ends
motion or range the preload is remembered. No directional derivatives.</p>
<h2>Validation</h2>
{validation}
<h2>Reference results and sources</h2>
<p>extra/org.fmi-standard.fmi-ls-ref holds an input sequence and the outputs that the map gives for it. sources holds
all C code; compile it with the FMI headers of your version, C99 and the mathematics library.</p>
""",
}
#: FMI 2 tolerates a step of size 0, FMI 3 does not
ZERO_STEP = {
    2: "A step of size 0 gives the outputs, and is not remembered.",
    3: "A step of size 0 is an Error.",
}


def monitor_page(texts: dict[str, str], **values: object) -> str:
    """The page: PYTHON or NATIVE with their values, and those of PAGE."""
    filled = {key: text.format(**values) for key, text in texts.items()}
    return PAGE.format(**{**values, **filled})
