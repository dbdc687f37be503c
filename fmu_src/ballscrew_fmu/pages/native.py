"""Documentation in the native FMUs: index.html with validation, licences of linked parts."""

from collections.abc import Mapping
from importlib.metadata import distribution
from typing import Any, NamedTuple

from ballscrew_fmu.models import FRICTION, TRANSMISSION, FmuModel
from ballscrew_fmu.pages import friction, monitor, transmission
from ballscrew_fmu.pages.page import Part, documentation_page, part
from ballscrew_fmu.variables.friction import TIME
from ballscrew_tehl.report.page import Html, figure, paragraph, table
from ballscrew_tehl.runtime.constants import TOO_LARGE


class Validation(NamedTuple):
    """Results of the validation: tables as HTML, plots as PNG by file name."""

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

FMI headers that the sources are compiled with
----------------------------------------------
Copyright MODELISAR consortium and Modelica Association Project "FMI", 2-clause BSD licence,
https://fmi-standard.org.
"""
ICON = Html('<p><img src="../terminalsAndIcons/icon.png" alt="ball screw with nut" style="width: 8rem"></p>')
INVALID = (
    f"Co-simulation: with NaN, infinity, a magnitude of {TOO_LARGE:g} or more or a negative parameter, doStep "
    f"{friction.DISCARDED} Model exchange: such a value is discarded when it is set, and the previous one is kept."
)
ZERO_STEP = {
    2: "A step of size 0 computes the outputs of the current inputs.",
    3: "A step of size 0 is an Error.",
}
DERIVATIVES = "Directional derivatives are those at the end of the last step."
SOURCES = part(
    "Reference results and sources",
    "extra/org.fmi-standard.fmi-ls-ref contains a smoke test and a validation: parameters, inputs, and the outputs of "
    "the map for them. They can be run again from the manifest, which has the checksum of each file. sources contains "
    "all C code. Compile it as C99 with the FMI headers of your version and link the mathematics library. Without "
    "-ffp-contract=off results may differ in the last digits.",
    "To link several FMUs into one program, define FMI2_FUNCTION_PREFIX or FMI3_FUNCTION_PREFIX when you compile each "
    "of them, e.g. as AxisX_. All other external names already differ. Systems without POSIX or Windows threads: see "
    "lock.h.",
)
MAP_IN_MEMORY = {
    False: "resources/nut_map.bin is read and checked when an instance is made; all instances of a process share one "
    "copy in memory. It may be replaced by the map of another screw with the same friction law (written by "
    "python -m ballscrew_fmu map). The log names the map at instantiation. Start values, limits and dependencies of "
    "the model description remain those of the map on this page: set the friction parameters of the other screw. A "
    "damaged map, another format and another friction law are refused.",
    True: "The map is compiled in. The FMU opens no file and ignores the location of its resources. All instances of a "
    "process share the map, which cannot be replaced.",
}
HOSTS = part(
    "Hosts",
    table(
        "hosts",
        "FMU for each host",
        ("host", "FMU"),
        (
            (
                "Modelica tools, Simulink, real-time targets, any importer without Python",
                f"{FRICTION.native_name}_fmi2.fmu (FMI 2.0) or {FRICTION.native_name}_fmi3.fmu (FMI 3.0)",
            ),
            (
                "a Python host, with contacts solved at run time (refine)",
                f"{FRICTION.name}.fmu (FMI 2.0 co-simulation)",
            ),
        ),
        text=True,
    ),
    "Common inputs, outputs and parameters have the same names, value references and results.",
)


def standstill_part(header: Mapping[str, Any]) -> Part:
    """The law at standstill and its explicit coupling."""
    return part(
        "Standstill",
        *friction.standstill(header),
        "The Coulomb torque is the sum of hysteresis and sliding torque at the current inputs. With breakaway_factor > "
        "1, or where friction in the map falls with speed, it is larger at rest than in motion: an axis driven slowly "
        "through a spring then sticks and slips.",
        table(
            "coupling",
            "Stable explicit coupling: stiffness s0, damping s1, step h, inertia J",
            ("order of the models", "stable for", ""),
            (
                (
                    "both with the values of the last step",
                    "s0 < (s1/h) (1 - h s1/J)",
                    "that is h < s1/s0 and J > h s1/(1 - h s0/s1); best s1 = 0.5 J/h",
                ),
                ("friction first, then the inertia", "s0 < (4 - 2 h s1/J) J/h^2", "for h s1/J up to 1"),
            ),
            text=True,
        ),
        "Example: s0 = 100 N.m/rad with the damping of 4 ms times that, h = 1 ms: J > 5.3e-4 kg m2. J = 0.01 kg m2 and "
        "h = 1 ms allow 2500 N.m/rad with s1 = 5 N.m.s/rad. Without damping no explicit coupling with the values of "
        "the last step is stable.",
    )


MODEL_EXCHANGE = part(
    "Model exchange",
    "One continuous state, presliding_deflection, also without a bristle (its rate is then 0). Two modes, which change "
    "at events only: the bristle follows the motion, or it slips and the torque is the Coulomb torque at constant "
    "deflection. slip_indicator crosses 0 where the bristle reaches 0.999 of its sliding deflection, where the speed "
    "reverses while it slips, and where the stiffness from the screw has doubled or halved while it follows. "
    "presliding_deflection belongs to the stiffness at the last event: rate and torque are those of the present "
    "stiffness at the same stored energy, and the event refers the state to that. Where the Coulomb torque has risen "
    "while the bristle slipped, it sticks with the deflection that it began to slip with; where slip begins because "
    "the Coulomb torque has decreased, the deflection falls to the sliding deflection. in_range_indicator crosses 0 "
    "where an input leaves the map or returns. Both have hysteresis, so that an event does not repeat at once. The "
    "tanh law needs no event.",
    "heat has what the bristle loses at events. The heat since the start is heat plus the integral of power_loss, "
    "which the importer forms: a continuous state for it would cost each solver, and nothing depends on it.",
)
EVENT_MODE = part(
    "Co-simulation with event mode",
    "With eventModeUsed the modes change at events only, as in model exchange. If early return is allowed, a step "
    "ends at the event with eventHandlingNeeded. The start of slip is located by its closed form at constant "
    "inputs. The other events are those of new inputs: the next step returns at its start unless event mode was "
    "entered for them. An event that is not handled by the importer is handled by the next step; without early "
    "return it is handled within the step. Unlike model exchange, a step adapts the bristle to the stiffness of the "
    "screw at its loads, without an event, and energy that the bristle loses at an event is part of power_loss of "
    "the next step. A value that is not valid stays set through event mode and steps are discarded for it.",
    "With an intermediate update callback each step has eight equal parts. After a part, outputs may be read, "
    "inputs of the next part may be set, and an early return may be requested. An input that is not valid discards "
    "the whole step. power_loss is then the mean of the "
    "whole step.",
)
TERMINALS = part(
    "Terminals",
    "shaft: speed (w) and friction_torque (tau, an inflow: the torque that the shaft gives to friction). It has "
    "no angle, so it is not a Modelica flange: apply the torque to a flange with a torque source of opposite "
    "sign. heat: temperature (T) and power_loss (Q_flow, an outflow).",
)


def native_documentation(
    header: Mapping[str, Any],
    fmi_version: int,
    platforms: str,
    validation: Validation = NOT_VALIDATED,
    model: FmuModel = FRICTION,
    embed_map: bool = False,
) -> dict[str, bytes]:
    """Files of the documentation folder by path.

    Parameters   platforms : platforms of the binaries, as text;  embed_map : the map is compiled in
    """
    variables = model.native_variables(header)
    variables = variables if fmi_version == 2 else (*variables, TIME)
    plots = (
        figure(name, name.rpartition(".")[0].replace("_", " ").capitalize(), wide=True)
        for name in sorted(validation.plots)
    )
    validated = part("Validation", Html(validation.tables), *plots)
    host = f"FMI {fmi_version}.0, co-simulation and model exchange, in C99 without dependencies; {platforms}."
    if model is FRICTION:
        lead = [ICON, paragraph(friction.LEAD, friction.friction_law(header), host)]
        state = "The state can be saved, restored and serialized, bristle included. "
        behaviour = friction.behaviour(
            header,
            INVALID,
            f"{state}A serialized state of another version or map is rejected.",
            "A step allocates no memory.",
        )
        parts = [
            HOSTS,
            friction.validity(header),
            validated,
            behaviour,
            part("Co-simulation", f"{friction.STEP} {ZERO_STEP[fmi_version]} {DERIVATIVES}"),
            standstill_part(header),
            MODEL_EXCHANGE,
            *([EVENT_MODE] if fmi_version == 3 else []),
            TERMINALS,
        ]
    elif model is TRANSMISSION:
        lead = [ICON, paragraph(transmission.LEAD, friction.friction_law(header), host)]
        step = f"{friction.STEP} {ZERO_STEP[fmi_version]} {DERIVATIVES}"
        shown = transmission.transmission_parts(header, INVALID, step)
        parts = [friction.validity(header), *shown, standstill_part(header), MODEL_EXCHANGE]
    else:
        lead = [ICON, paragraph(monitor.LEAD, friction.friction_law(header), host)]
        step = f"Co-simulation: {friction.STEP} {monitor.ZERO_STEP[fmi_version]} {monitor.NATIVE_STEP}"
        parts = [*monitor.monitor_parts(header, INVALID, step), monitor.MODEL_EXCHANGE, validated]
    parts += [part("Map in memory", MAP_IN_MEMORY[embed_map]), SOURCES]
    page = documentation_page(model.native_name, lead, header, parts, variables)
    texts = {"index.html": page, "licenses/license.txt": LICENSE.format(project=_project_license())}
    return {name: text.encode() for name, text in texts.items()} | dict(validation.plots)


def _project_license() -> str:
    for file in distribution("ballscrew-tehl").files or ():
        if file.name == "LICENSE":
            return str(file.read_text())
    return "MIT licence\n"
