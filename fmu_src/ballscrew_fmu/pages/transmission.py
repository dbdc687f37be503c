"""Text of the pages of BallScrewTransmission."""

from collections.abc import Mapping
from typing import Any

from ballscrew_fmu.pages.page import Part, part
from ballscrew_tehl.report.page import bullets, table

LEAD = (
    "A preloaded double-nut ball screw between a shaft and an axis: torque of the screw, force on the nut, axial "
    "stiffness of the preloaded nut, friction of each nut from a map of thermal elastohydrodynamic contact solutions. "
)
CONTACTS = part(
    "Contacts",
    "The screw leads the nut by axial_deflection x = lead angle/(2 pi) - position. Each nut has the force "
    "k d^(3/2) of its Hertz contacts over the approach d, 0 where it is free: d_0 + x for nut A, d_0 - x for nut B, "
    "d_0 = (preload/k)^(2/3). nut_force = force_nut_a - force_nut_b + damping_force, positive along the position. A "
    "positive nut_force loads nut A, the one whose outer face points against the position.",
    bullets(
        "Without load the stiffness is 3 k^(2/3) preload^(1/3): nut_stiffness at stiffness_preload, and with the cube "
        "root of the preload at others. At x = d_0, under a nut_force of 2^(3/2) preload, one nut comes free and half "
        "of the stiffness is lost.",
        "The start value of nut_stiffness is that of the contacts between rigid bodies. Bodies of screw and nut make "
        "it softer, up to 18 % for the GD4008-3 at 2 kN. Enter the value of the catalogue if you have it. Shaft, "
        "bearings and housing are not included: add their springs in your model.",
        "Lost motion at a reversal of the load is the way between the deflections at both loads, with axial_play in "
        "addition while preload is 0. axial_play has no effect on a preloaded nut.",
        "damping_force is contact_damping_time times stiffness times the rate of x. Its start value, 10 us, is "
        "an assumption for rolling contacts (Kraemer 1993: 2.5 to 25 us). It ends with the contact and "
        "never supplies energy.",
    ),
)
POWER = part(
    "Torque, power, efficiency",
    "screw_torque = lead/(2 pi) nut_force + friction_torque. Each nut has the friction of the map at its own force, so "
    "the friction torque rises with the load. A load drives the screw back where lead/(2 pi) times its force exceeds "
    "the friction torque.",
    bullets(
        "shaft_power - nut_power - power_loss is the rate of stored_energy. In co-simulation the three are means of "
        "the step, and the balance is exact if angle and position start each step where the last one has ended. A "
        "change of preload is work of the preload, which no power includes. In model exchange the bristle may lose "
        "energy in an event, where it sticks again at a lower load: heat is their sum. "
        "In co-simulation heat is the sum of power_loss times step.",
        "efficiency is the share of the power that arrives in steady motion at this load, speed and temperature: screw "
        "driving nut, or nut driving screw (0 where friction holds). Without nut_force it is 0.",
    ),
)
COUPLING = part(
    "Co-simulation",
    "Angle and position are those at the start of the step and move on with speed and velocity: the outputs at its end "
    "belong to angle + h speed and position + h velocity. Step this FMU first and then the axis, or both with the "
    "values of the last communication point.",
    "The stiffness is high, so explicit coupling needs small steps: with the mass m at the nut (or the inertia J at "
    "the shaft, m = J (2 pi/lead)^2), stiffness k and damping c = contact_damping_time k,",
    table(
        "coupling",
        "Stable explicit coupling of a mass, a = h^2 k/m, b = h c/m = a contact_damping_time/h",
        ("order of the models", "stable for"),
        (
            ("this FMU first, then the mass", "a + b < 2, also without damping"),
            ("both with the values of the last step", "0.65 a < b < 0.8 with a up to 0.1"),
        ),
        text=True,
    ),
    "In model exchange the solver of the importer chooses the step, and there is no such limit.",
    "FMI 3: no event mode and no intermediate updates in co-simulation, as angle and position belong to the start of a "
    "whole step. Model exchange has events.",
)
TERMINALS = part(
    "Terminals",
    "shaft: angle (phi), speed (w) and screw_torque (tau, an inflow: the torque that the shaft gives to the screw). "
    "nut: position (s), velocity (v) and nut_force (f, an outflow: the force that the nut gives to the axis). heat: "
    "temperature (T) and power_loss (Q_flow, an outflow). Shaft and nut need the speed too, so they are no Modelica "
    "flanges.",
)


def transmission_parts(header: Mapping[str, Any], invalid: str, step: str) -> list[Part]:
    """Contacts, power, coupling and behaviour.

    Parameters   invalid : effect of an invalid number;  step : when inputs act and outputs change
    """
    behaviour = bullets(
        "Friction, films and standstill are those of BallScrewFriction with the same parameters; the nuts share the "
        "load as rigid bodies do, there as elastic ones.",
        "Inputs outside the map are clamped for the friction, and in_range is false. Forces and deflection are not "
        "clamped. A force of a nut beyond the map is reported as position.",
        step,
        invalid,
        "The state can be saved, restored and serialized, bristle included. A serialized state of another version or "
        "map is rejected. A step allocates no memory.",
    )
    return [CONTACTS, POWER, COUPLING, TERMINALS, part("Behaviour", behaviour)]
