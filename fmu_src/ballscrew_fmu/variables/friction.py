"""Table of the variables of BallScrewFriction: names, units, bounds, start values, dependencies; the types of a table.

Model description, slave, documentation and C sources are generated from this table. Value references follow its order,
from FIRST_REFERENCE. The header of the map gives bounds, start values, and what depends on its friction law.
"""

import math
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from ballscrew_tehl.runtime.constants import DAMPING_TIME, ELEMENTS, MOST_DIFFERENCE
from ballscrew_tehl.runtime.packed import DEFAULTS, Law

FIRST_REFERENCE = 1  # OMSimulator 3 takes the value references of FMI 3 dependencies for indices from 1
Header = Mapping[str, Any]  # of a map
Names = tuple[str, ...]  # of variables


class Unit(NamedTuple):
    """SI unit: exponents of its base units, display units (name, factor, offset), quantity of all variables with it."""

    base: Mapping[str, int]  # empty: 1, or no product of whole powers
    displays: tuple[tuple[str, float, float], ...] = ()
    quantity: str | None = None


# display value = factor * SI value + offset; digits as in the FMI standard and in Modelica
UNITS: Mapping[str, Unit] = {
    "N": Unit({"kg": 1, "m": 1, "s": -2}, (), "Force"),
    "rad/s": Unit({"rad": 1, "s": -1}, (("rev/min", 9.549296585513721, 0.0),), "AngularVelocity"),
    "rad/s2": Unit({"rad": 1, "s": -2}, (), "AngularAcceleration"),
    "m/s": Unit({"m": 1, "s": -1}, (("m/min", 60.0, 0.0),), "Velocity"),
    "m/s2": Unit({"m": 1, "s": -2}, (), "Acceleration"),
    "kg": Unit({"kg": 1}, (), "Mass"),
    "kg.m2": Unit({"kg": 1, "m": 2}, (), "MomentOfInertia"),
    "K": Unit({"K": 1}, (("degC", 1.0, -273.15),), "ThermodynamicTemperature"),
    "N.m": Unit({"kg": 1, "m": 2, "s": -2}, (), "Torque"),
    "W": Unit({"kg": 1, "m": 2, "s": -3}, (), "Power"),
    "m": Unit({"m": 1}, (("mm", 1e3, 0.0), ("um", 1e6, 0.0), ("nm", 1e9, 0.0)), "Length"),
    "N/m": Unit({"kg": 1, "s": -2}, (("N/um", 1e-6, 0.0),), "TranslationalSpringConstant"),
    "N.s/m": Unit({"kg": 1, "s": -1}),
    "J": Unit({"kg": 1, "m": 2, "s": -2}, (), "Energy"),
    "sqrt(J)": Unit({}),
    "sqrt(J)/s": Unit({}),
    "Pa": Unit({"kg": 1, "m": -1, "s": -2}, (("GPa", 1e-9, 0.0),), "Pressure"),
    "N.m/N": Unit({"m": 1}),
    "N.m/rad": Unit({"kg": 1, "m": 2, "s": -2, "rad": -1}),
    "N.m.s/rad": Unit({"kg": 1, "m": 2, "s": -1, "rad": -1}),
    "rad": Unit({"rad": 1}, (("deg", 57.29577951308232, 0.0),), "Angle"),
    "s": Unit({"s": 1}, (), "Time"),
    "1": Unit({}),
}


class Variable(NamedTuple):
    """One FMU variable.

    Attributes
    ----------
    name : str
        Name.
    causality : str
        input, output, parameter; native FMUs also local and independent.
    description : str
        Text of the model description.
    unit : str or None
        Unit of UNITS; None: Boolean.
    start : float, bool or None
        Start value, of inputs and parameters only.
    minimum, maximum, nominal : float or None
        Bounds and nominal value.
    display_unit : str or None
        Display unit.
    relative : bool
        A difference: the offset of the display unit does not apply.
    depends_on : tuple of str
        Inputs that an output depends on.
    initially_depends_on : tuple of str
        Parameters that it depends on too in initialization mode.
    from_zero : bool
        0 at the start, so that it depends on nothing in initialization mode.
    fixed : bool
        A parameter that is geometry, or used at initialization only.
    derivative_of : str or None
        The continuous state of which this is the time derivative.
    indicates : bool
        Its change of sign is an event.
    python_only : bool
        Not in the native FMUs.
    needs : {"torque", "films"}
        Evaluation of the map for an output.
    """

    name: str
    causality: str
    description: str
    unit: str | None = None
    start: float | bool | None = None
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    display_unit: str | None = None
    relative: bool = False
    depends_on: Names = ()
    initially_depends_on: Names = ()
    from_zero: bool = False
    fixed: bool = False
    derivative_of: str | None = None
    indicates: bool = False
    python_only: bool = False
    needs: str = "torque"

    @property
    def variability(self) -> str:
        """Variability of FMI."""
        if self.causality == "parameter":
            return "fixed" if self.fixed else "tunable"
        return "discrete" if self.unit is None else "continuous"

    @property
    def quantity(self) -> str | None:
        """Quantity of the unit; None: none."""
        if self.unit is None or self.indicates:
            return None
        return "TemperatureDifference" if self.relative else UNITS[self.unit].quantity

    @property
    def initial_dependencies(self) -> tuple[str, ...]:
        """Names that it depends on in initialization mode."""
        return () if self.from_zero else (*self.depends_on, *self.initially_depends_on)


_ALL = ("preload", "speed", "temperature", "axial_load", "temperature_difference")
_FORCES = ("preload", "axial_load", "temperature_difference")
_SIGN = ("regularization_speed", "presliding", "presliding_side")
_REFINED = ("refine", "refine_tolerance")
_COEFFICIENTS = ("net_sliding_coefficient", "breakaway_factor")
_SLIDING = (*_COEFFICIENTS, *_SIGN)
_LAW_NAMES = {Law.THREE_PARAMETER: "film shear", Law.MECHANISTIC: "mechanistic"}
#: parameters of all friction FMUs, in their order
FRICTION_PARAMETERS = (
    *DEFAULTS, "regularization_speed", "presliding", "presliding_stiffness", "presliding_damping", "presliding_side",
    "seal_torque",
)  # fmt: skip


def law_name(header: Header) -> str:
    """Friction law of a map, as text."""
    return _LAW_NAMES[header["law"]]


def band_text(header: Header) -> str:
    """Interval of the torque at one point of the map, as text; "" without one."""
    band = header.get("mechanistic_interval")
    if band is None:
        return ""
    kind = "fitted to this screw" if band["fitted"] else "not fitted to this screw"
    rpm, degrees = band["speed"] * 30.0 / math.pi, band["temperature"] - 273.15
    return (
        f"torque {band['low']:.2f} to {band['high']:.2f} times the computed one (about 80 %) at "
        f"{band['preload']:.0f} N, {rpm:.0f} r/min, {degrees:.0f} degC, {kind}"
    )


def lead_text(header: Header) -> str:
    """Lead of the screw, as text; "" if the map does not state it."""
    screw = header.get("screw", {})
    return f"lead {1e3 * screw['lead']:.6g} mm" if screw else ""


def band_half_width(header: Header) -> float:
    """Half-width of the interval over the torque where the preload is a force [1]; 0 without one."""
    band = header.get("mechanistic_interval")
    return 0.0 if band is None else 0.5 * float(band["force_high"] - band["force_low"])


def origin_text(header: Header, band: str | None = None) -> str:
    """What is said once: that the friction numbers are those of another screw; "" if they are not; band: interval."""
    result = header.get("friction", {})
    if not result.get("carried_over"):
        return ""
    catalogue = result["catalogue"]
    at = f"catalogue torque {catalogue['torque']:.3g} N.m at {catalogue['preload']:.0f} N"
    band = band_text(header) if band is None else band
    return "; ".join(text for text in (result["carried_over"], at, band) if text)


def start_preload(header: Header) -> float:
    """The catalogue preload of the screw in two digits, within the map; 2000 N where the map states no screw."""
    target = float(header.get("screw", {}).get("stiffness_preload", 2000.0))
    return min(max(target, float(header["axes"]["preload"][0])), largest_force(header))


def largest_force(header: Header) -> float:
    """End of the map [N]."""
    return float(header["axes"]["force"][1])


def _coulomb(header: Header) -> Names:
    """Inputs that hysteresis and sliding torque depend on near standstill, where both follow one sign."""
    return ("speed", *_FORCES) if header["law"] == Law.THREE_PARAMETER else _ALL


def input_text(header: Header, name: str, meaning: str) -> str:
    """Description of an input with the range of the map. Not min and max: a value beyond is clamped, not illegal."""
    low, high = map(float, header["axes"][name][:2])
    if name == "speed":
        low = -high
    unit = {"preload": "N", "speed": "rad/s", "temperature": "K"}[name]
    high = largest_force(header) if name == "preload" else high
    return f"{meaning}. Map: {low:.5g} to {high:.5g} {unit}, clamped beyond"


def inputs(header: Header) -> tuple[Variable, ...]:
    """Rows of the inputs."""
    cold, hot = map(float, header["axes"]["temperature"][:2])
    return (
        Variable(
            "preload", "input", input_text(header, "preload", "Preload of the screw"), "N", start_preload(header), 0.0,
            nominal=1000.0,
        ),
        Variable(
            "speed", "input", input_text(header, "speed", "Speed of the screw relative to the nut"), "rad/s", 0.0,
            nominal=100.0, display_unit="rev/min",
        ),
        Variable(
            "temperature", "input", input_text(header, "temperature", "Oil temperature at the contact inlet"), "K",
            min(max(303.15, cold), hot), nominal=300.0, display_unit="degC",
        ),
        Variable(
            "axial_load", "input", "Axial load on the nut body, positive if it loads the nut at whose flange it acts",
            "N", 0.0, nominal=1000.0,
        ),
        Variable(
            "temperature_difference", "input",
            "Temperature of the screw minus that of the nut, which changes the preload. At most "
            f"{MOST_DIFFERENCE:g} K either way, clamped beyond",
            "K", 0.0, nominal=1.0, relative=True,
        ),
    )  # fmt: skip


def _torques(header: Header) -> tuple[Variable, ...]:
    """Rows of the torques, of both nuts together and of each."""
    film_shear, coulomb = header["law"] == Law.THREE_PARAMETER, _coulomb(header)
    viscous = ("apparent_viscosity_ratio", *(("roughness_height",) if film_shear else ()), *_REFINED)
    kind, slip = (
        ("Viscous", "") if film_shear else ("Hydrodynamic rolling", ": slip in contacts and between balls")
    )
    whole = Variable(
        "friction_torque", "output",
        "Friction torque, opposes the motion: J dw/dt = motor torque - friction_torque",
        "N.m", nominal=1.0, depends_on=_ALL, initially_depends_on=(*viscous, *_SLIDING, "seal_torque"),
    )  # fmt: skip
    return (
        whole,
        Variable(
            "viscous_torque", "output", f"{kind} part of friction_torque", "N.m", nominal=1.0, depends_on=_ALL,
            initially_depends_on=viscous,
        ),
        Variable(
            "hysteresis_torque", "output", "Hysteresis part of friction_torque", "N.m", nominal=0.01,
            depends_on=coulomb, initially_depends_on=_SIGN,
        ),
        Variable(
            "sliding_torque", "output", f"Sliding part of friction_torque{slip}", "N.m", nominal=1.0,
            depends_on=coulomb, initially_depends_on=(*_SLIDING, *(() if film_shear else _REFINED)),
        ),
        whole._replace(
            name="power_loss", description="Dissipated power, less than torque times speed while elements store energy",
            unit="W", minimum=0.0, nominal=100.0,
        ),
        whole._replace(
            name="friction_torque_nut_a",
            description="Part of friction_torque of the nut that a positive axial_load loads, half of the seals "
            "included",
        ),
        whole._replace(name="friction_torque_nut_b", description="Part of friction_torque of the other nut"),
    )  # fmt: skip


_FILM: Mapping[str, Any] = {
    "unit": "m", "minimum": 0.0, "nominal": 1e-7, "display_unit": "um",
    "depends_on": _ALL, "initially_depends_on": _REFINED, "needs": "films",
}  # fmt: skip
_FILMS = (
    Variable("film_thickness_min", "output", "Minimum film thickness of all contacts", **_FILM),
    Variable(
        "film_thickness_central_screw", "output", "Least central film thickness on the screw raceway", **_FILM
    ),
    Variable(
        "film_thickness_central_nut", "output", "Least central film thickness on the nut raceway", **_FILM
    ),
    Variable(
        "film_temperature_rise", "output", "Temperature rise of a film, mean over the contact, highest of all contacts",
        "K", minimum=0.0, nominal=10.0, relative=True, depends_on=_ALL, initially_depends_on=_REFINED, needs="films",
    ),
    Variable(
        "contact_pressure_max", "output", "Maximum Hertz pressure of the most loaded ball", "Pa", minimum=0.0,
        nominal=1e9, display_unit="GPa", depends_on=_FORCES, needs="films",
    ),
    Variable(
        "ball_load_max", "output", "Load of the most loaded ball", "N", minimum=0.0, nominal=10.0,
        depends_on=_FORCES, needs="films",
    ),
    Variable(
        "lambda_ratio", "output", "Minimum film thickness divided by roughness_height, at most 1000", "1",
        minimum=0.0, maximum=1000.0, nominal=1.0, depends_on=_ALL,
        initially_depends_on=("roughness_height", *_REFINED), needs="films",
    ),
)  # fmt: skip
_OTHERS = (
    Variable("in_range", "output", "False while an input is outside the map and clamped", depends_on=_ALL),
    Variable(
        "range_margin",
        "output",
        "Least distance of preload, speed, temperature and force of the loaded nut from the limits of the map, as a "
        "share of the length of the axis. Negative outside",
        "1",
        nominal=0.1,
        depends_on=_ALL,
    ),
    Variable(
        "heat",
        "output",
        "Heat of all steps since the start. Model exchange does not compute it: integrate power_loss and add this, the "
        "heat of events alone",
        "J",
        nominal=100.0,
        depends_on=_ALL,
        from_zero=True,
    ),
)
_ACTUAL = Variable(
    "preload_actual", "output", "Preload at the temperature difference of screw and nut, 0: lost", "N", minimum=0.0,
    nominal=1000.0, depends_on=("preload", "temperature_difference"),
)  # fmt: skip


def outputs(header: Header) -> tuple[Variable, ...]:
    """Rows of the outputs."""
    *torques, nut_a, nut_b = _torques(header)
    return (*torques, *_FILMS, *_OTHERS, nut_a, nut_b, _ACTUAL)


def parameters(header: Header) -> tuple[Variable, ...]:
    """Rows of the parameters of the friction law, then of the law at standstill."""
    starts, film_shear = header["defaults"], header["law"] == Law.THREE_PARAMETER

    def fitted(name: str, unit: str, nominal: float, of_film_shear: str, mechanistic: str) -> Variable:
        description = of_film_shear if film_shear else mechanistic
        return Variable(name, "parameter", description, unit, float(starts[name]), 0.0, nominal=nominal)

    return (
        fitted(
            "apparent_viscosity_ratio", "1", 10.0, "Apparent shear viscosity divided by film viscosity (fitted)",
            "Factor of the rolling part (1 = the oil's viscosity)",
        ),
        fitted(
            "net_sliding_coefficient", "1", 0.01, "Net Coulomb coefficient of the sliding part (fitted)",
            "Ball-on-ball friction coefficient times thrust over ball load, doubled (fitted)",
        ),
        fitted(
            "roughness_height", "m", 1e-8,
            "Film thickness at which the viscous part is halved (fitted). 0: no reduction",
            "Roughness height that lambda_ratio refers to, without effect on torques",
        )._replace(display_unit="nm"),
        Variable(
            "breakaway_factor", "parameter",
            "Torque of the Coulomb part at standstill over that in a full film; 1 = off", "1",
            float(starts["breakaway_factor"]), 0.0, nominal=1.0,
        ),
        *_STANDSTILL,
        Variable(
            "seal_torque", "parameter",
            "Drag of the seals: a constant part of friction_torque, takes part in presliding",
            "N.m", float(header.get("screw", {}).get("seal_torque", 0.0)), 0.0, nominal=0.1,
        ),
    )  # fmt: skip


_STANDSTILL = (
    Variable(
        "regularization_speed", "parameter",
        "Without presliding, Coulomb parts are multiplied by tanh(speed/regularization_speed). 0: by sign(speed)",
        "rad/s", 0.1, 0.0, nominal=0.1, display_unit="rev/min",
    ),
    Variable(
        "presliding", "parameter",
        "Coulomb parts through elasto-slip elements, which hold the axis at standstill. false: through the tanh",
        start=True,
    ),
    Variable(
        "presliding_stiffness", "parameter",
        "Stiffness of the elasto-slip elements at rest. 0: from contact width, preload and Coulomb torque",
        "N.m/rad", 0.0, 0.0, nominal=100.0,
    ),
    Variable(
        "presliding_damping", "parameter",
        "Damping of the elasto-slip elements, needed in explicit coupling with an inertia. "
        f"0: stiffness times {1e3 * DAMPING_TIME:g} ms",
        "N.m.s/rad", 0.0, 0.0, nominal=1.0,
    ),
    Variable(
        "presliding_side", "parameter",
        "Travel from rest at the start over that at which all elements slide. 0: sign of the speed",
        "1", 0.0, -1.0, 1.0, nominal=1.0, fixed=True,
    ),
)  # fmt: skip
_REFINE = (
    Variable(
        "refine", "parameter",
        "Solve contacts at the operating point and correct the map. Needs numba, scipy, pydantic, threadpoolctl",
        start=False, python_only=True,
    ),
    Variable(
        "refine_tolerance", "parameter", "Allowed relative error of friction_torque with refine, > 0", "1",
        1e-3, 0.0, nominal=1e-3, python_only=True,
    ),
)  # fmt: skip


class Shared(NamedTuple):
    """A row of another table with other fields."""

    row: str
    changes: Mapping[str, Any] = {}


def table_of(
    rows: Iterable[Variable | Shared], others: Iterable[Variable], of_header: Mapping[str, Mapping[str, Any]]
) -> tuple[Variable, ...]:
    """The rows, those that are shared from other tables; of_header: fields from the header of the map, by name."""
    named = {v.name: v for v in others}
    own = (v if isinstance(v, Variable) else named[v.row]._replace(**v.changes) for v in rows)
    return tuple(v._replace(**of_header.get(v.name, {})) for v in own)


def film_rows(loads: Names, loads_and_motion: Names, initially: Names) -> list[Variable]:
    """The outputs of films and contacts for the table of another model, which depend on these."""
    return [
        row._replace(
            depends_on=loads if row.depends_on == _FORCES else loads_and_motion,
            initially_depends_on=(*initially, *(("roughness_height",) if row.name == "lambda_ratio" else ())),
        )
        for row in _FILMS
    ]


def fmu_variables(header: Header) -> tuple[Variable, ...]:
    """The table for the map with this header: inputs, then outputs, then parameters."""
    return (*inputs(header), *outputs(header), *parameters(header), *_REFINE)


ELEMENT_STATES = tuple(f"presliding_element_{i}" for i in range(1, ELEMENTS + 1))
_HOLDING = (*_COEFFICIENTS, "presliding_stiffness", "presliding_damping", "seal_torque")
_SLIPPING = (*_COEFFICIENTS, "seal_torque", "presliding", "presliding_stiffness", "presliding_side")


def states(header: Header) -> tuple[Variable, ...]:
    """Rows of the elasto-slip elements, their rates and the event indicators; native FMUs only."""
    coulomb = _coulomb(header)
    return (
        *(
            Variable(
                name, "local",
                f"Deflection of elasto-slip element {i} times the root of its stiffness, a continuous state; half its "
                "square is its energy in J. 0 at the start: by presliding_side",
                "sqrt(J)", 0.0, nominal=1e-2, initially_depends_on=(*coulomb, *_SLIPPING),
            )
            for i, name in enumerate(ELEMENT_STATES, 1)
        ),
        *(
            Variable(
                f"{name}_rate", "local", f"Time derivative of {name}", "sqrt(J)/s", nominal=1.0,
                initially_depends_on=_SLIPPING, derivative_of=name,
                depends_on=(*coulomb, name),
            )
            for name in ELEMENT_STATES
        ),
        Variable(
            "in_range_indicator", "local", "Event indicator of in_range", "1", nominal=1.0, depends_on=_ALL,
            indicates=True,
        ),
        Variable(
            "stiffness_indicator", "local",
            "Event indicator of the stiffness of the elements: far from that of the loads",
            "1", nominal=1.0, depends_on=_FORCES, initially_depends_on=_SLIPPING[:-1],
            indicates=True,
        ),
        *(
            Variable(
                f"slip_indicator_{i}", "local",
                f"Event indicator of elasto-slip element {i}: it begins or ends to slide",
                "1", nominal=1.0, initially_depends_on=_SLIPPING, indicates=True,
                depends_on=(*coulomb, name),
            )
            for i, name in enumerate(ELEMENT_STATES, 1)
        ),
    )  # fmt: skip


def native_variables(header: Header) -> tuple[Variable, ...]:
    """The table of the native FMUs: inputs, outputs and parameters as above, then the elasto-slip elements as states.

    In model exchange the importer integrates the elements, and outputs depend on them. In co-simulation their values
    are those at the end of the step. Of an event indicator only the sign has a meaning.
    """
    shared = [v for v in fmu_variables(header) if not v.python_only]
    names = {v.name for v in shared}
    table = []
    for v in shared:
        initially = tuple(name for name in v.initially_depends_on if name in names)
        if "presliding" in initially or v.from_zero:
            v = v._replace(depends_on=(*v.depends_on, *ELEMENT_STATES))
            initially = tuple(dict.fromkeys((*initially, *_HOLDING)))
        table.append(v._replace(initially_depends_on=initially))
    return (*table, *states(header))


TIME = Variable("time", "independent", "Time", "s")  # FMI 3 only, after the table
