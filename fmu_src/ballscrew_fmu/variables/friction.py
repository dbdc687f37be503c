"""Table of the variables of BallScrewFriction: names, units, bounds, start values, dependencies; the types of a table.

Model description, slave, documentation and C sources are generated from this table. Value references follow its order,
from FIRST_REFERENCE. What depends on the map comes from its header (of_map): bounds, start values, descriptions
and dependencies of its friction law. The table of BallScrewPreloadMonitor is in monitor.py.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from ballscrew_tehl.runtime.constants import DAMPING_TIME, ELEMENTS
from ballscrew_tehl.runtime.packed import FILM_SHEAR, MECHANISTIC

FIRST_REFERENCE = 1  # OMSimulator 3 takes the value references of FMI 3 dependencies for indices from 1
Header = Mapping[str, Any]  # of a map
OfMap = Callable[[Header], Any]
Names = tuple[str, ...]  # of variables


class Unit(NamedTuple):
    """SI unit: exponents of its base units, display units (name, factor, offset), quantity of all variables with it."""

    base: Mapping[str, int]
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
    "m": Unit({"m": 1}, (("um", 1e6, 0.0), ("nm", 1e9, 0.0)), "Length"),
    "N/m": Unit({"kg": 1, "s": -2}, (("N/um", 1e-6, 0.0),), "TranslationalSpringConstant"),
    "N.s/m": Unit({"kg": 1, "s": -1}),
    "J": Unit({"kg": 1, "m": 2, "s": -2}, (), "Energy"),
    "Pa": Unit({"kg": 1, "m": -1, "s": -2}, (("GPa", 1e-9, 0.0),), "Pressure"),
    "N.m/N": Unit({"m": 1}),
    "N.m/rad": Unit({"kg": 1, "m": 2, "s": -2, "rad": -1}),
    "N.m.s/rad": Unit({"kg": 1, "m": 2, "s": -1, "rad": -1}),
    "rad": Unit({"rad": 1}, (("deg", 57.29577951308232, 0.0),), "Angle"),
    "s": Unit({"s": 1}, (), "Time"),
    "1": Unit({}),
}


class Variable(NamedTuple):
    """One FMU variable."""

    name: str
    causality: str  # input, output, parameter; native FMUs also local and independent
    description: str
    unit: str | None = None  # None: Boolean
    start: float | bool | None = None  # inputs and parameters only
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    display_unit: str | None = None
    relative: bool = False  # a difference: the offset of the display unit does not apply
    depends_on: Names = ()  # inputs that an output depends on
    initially_depends_on: Names = ()  # parameters that it depends on too in initialization mode
    from_zero: bool = False  # 0 at the start, so that it depends on nothing in initialization mode
    fixed: bool = False  # a parameter that is used at initialization only
    derivative_of: str | None = None  # the continuous state of which this is the time derivative
    indicates: bool = False  # its change of sign is an event
    python_only: bool = False  # not in the native FMUs
    needs: str = "torque"  # evaluation of the map for an output: torque or films
    of_map: Mapping[str, OfMap] = {}  # fields above whose values come from the header of the map

    @property
    def variability(self) -> str:
        if self.causality == "parameter":
            return "fixed" if self.fixed else "tunable"
        return "discrete" if self.unit is None else "continuous"

    @property
    def quantity(self) -> str | None:
        if self.unit is None or self.indicates:
            return None
        return "TemperatureDifference" if self.relative else UNITS[self.unit].quantity

    @property
    def initial_dependencies(self) -> tuple[str, ...]:
        """What it depends on in initialization mode."""
        return () if self.from_zero else (*self.depends_on, *self.initially_depends_on)


_ALL = ("preload", "speed", "temperature", "axial_load")
_FILM_SHEAR_COULOMB = ("preload", "speed", "axial_load")
_FORCES = ("preload", "axial_load")
_SIGN = ("regularization_speed", "presliding", "presliding_side")
_REFINED = ("refine", "refine_tolerance")
_COEFFICIENTS = ("net_sliding_coefficient", "breakaway_factor")
_SLIDING = (*_COEFFICIENTS, *_SIGN)
_LAW_NAMES = {FILM_SHEAR: "film shear", MECHANISTIC: "mechanistic"}


def lowest(axis: str) -> OfMap:
    """Low end of an axis of the map."""
    return lambda header: float(header["axes"][axis][0])


def highest(axis: str) -> OfMap:
    """High end of an axis of the map."""
    return lambda header: float(header["axes"][axis][1])


def _minus(value: OfMap) -> OfMap:
    return lambda header: -value(header)


def _nearest(value: float, low: OfMap, high: OfMap) -> OfMap:
    return lambda header: min(max(value, low(header)), high(header))


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


def seal_torque(header: Header) -> float:
    """Drag of the seals [N.m]; 0 if the screw file does not state it."""
    return float(header.get("screw", {}).get("seal_torque", 0.0))


def lead_text(header: Header) -> str:
    """Lead of the screw, as text; "" if the map does not state it."""
    screw = header.get("screw", {})
    return f"lead {1e3 * screw['lead']:.6g} mm" if screw else ""


def band_half_width(header: Header) -> float:
    """Half-width of the same interval over the torque [1]; 0 without one."""
    band = header.get("mechanistic_interval")
    return 0.0 if band is None else 0.5 * float(band["high"] - band["low"])


def origin_text(header: Header) -> str:
    """What an instance says once: that its friction numbers are those of another screw; "" if they are not."""
    found = header.get("friction", {})
    if not found.get("carried_over"):
        return ""
    catalogue = found["catalogue"]
    at = f"catalogue torque {catalogue['torque']:.3g} N.m at {catalogue['preload']:.0f} N"
    return "; ".join(text for text in (found["carried_over"], at, band_text(header)) if text)


def start_preload(header: Header) -> float:
    """5 % of the dynamic rating in two digits, within the map; 2000 N where the map states no screw."""
    wanted = float(header.get("screw", {}).get("stiffness_preload", 2000.0))
    return _nearest(wanted, lowest("preload"), highest("force"))(header)


def _by_law(film_shear: Any, mechanistic: Any) -> OfMap:
    return lambda header: {FILM_SHEAR: film_shear, MECHANISTIC: mechanistic}[header["law"]]


def _default(name: str) -> OfMap:
    return lambda header: float(header["defaults"][name])


def of_map(rows: Sequence[Variable], header: Header) -> tuple[Variable, ...]:
    """The rows with the values of the map with this header."""
    table = []
    for v in rows:
        values: dict[str, Any] = {field: value(header) for field, value in v.of_map.items()}
        table.append(v._replace(of_map={}, **values))
    return tuple(table)


def _coulomb(*others: str) -> OfMap:
    """Inputs that hysteresis and sliding torque depend on near standstill, where both follow one sign; then others."""
    return _by_law((*_FILM_SHEAR_COULOMB, *others), (*_ALL, *others))


def _of_viscous(*others: str) -> OfMap:
    """Parameters of the viscous or rolling torque, then others."""
    ratio = "apparent_viscosity_ratio"
    return _by_law((ratio, "roughness_height", *_REFINED, *others), (ratio, *_REFINED, *others))


_FILM: Mapping[str, Any] = {
    "unit": "m", "minimum": 0.0, "nominal": 1e-7, "display_unit": "um",
    "depends_on": _ALL, "initially_depends_on": _REFINED, "needs": "films",
}  # fmt: skip

INPUTS = (
    Variable(
        "preload", "input", "Preload of the screw", "N", minimum=0.0, nominal=1000.0,
        of_map={"start": start_preload, "maximum": highest("force")},
    ),
    Variable(
        "speed", "input", "Speed of the screw relative to the nut", "rad/s", 0.0, nominal=100.0,
        display_unit="rev/min", of_map={"minimum": _minus(highest("speed")), "maximum": highest("speed")},
    ),
    Variable(
        "temperature", "input", "Oil temperature at the contact inlet", "K", nominal=300.0, display_unit="degC",
        of_map={
            "start": _nearest(303.15, lowest("temperature"), highest("temperature")),
            "minimum": lowest("temperature"), "maximum": highest("temperature"),
        },
    ),
    Variable(
        "axial_load", "input", "Axial load on the nut body, positive if it loads the nut at whose flange it acts",
        "N", 0.0, nominal=1000.0, of_map={"minimum": _minus(highest("force")), "maximum": highest("force")},
    ),
)  # fmt: skip
OUTPUTS = (
    Variable(
        "friction_torque", "output",
        "Friction torque, opposes the motion: J dw/dt = motor torque - friction_torque",
        "N.m", nominal=1.0, depends_on=_ALL, of_map={"initially_depends_on": _of_viscous(*_SLIDING, "seal_torque")},
    ),
    Variable(
        "viscous_torque", "output", "", "N.m", nominal=1.0, depends_on=_ALL,
        of_map={
            "description": _by_law("Viscous part of friction_torque", "Hydrodynamic rolling part of friction_torque"),
            "initially_depends_on": _of_viscous(),
        },
    ),
    Variable(
        "hysteresis_torque", "output", "Hysteresis part of friction_torque", "N.m", nominal=0.01,
        initially_depends_on=_SIGN, of_map={"depends_on": _coulomb()},
    ),
    Variable(
        "sliding_torque", "output", "", "N.m", nominal=1.0,
        of_map={
            "description": _by_law(
                "Sliding part of friction_torque", "Sliding part of friction_torque: slip in contacts and between balls"
            ),
            "depends_on": _coulomb(),
            "initially_depends_on": _by_law(_SLIDING, (*_SLIDING, *_REFINED)),
        },
    ),
    Variable(
        "power_loss", "output",
        "Dissipated power, less than torque times speed while elements store energy",
        "W", minimum=0.0, nominal=100.0, depends_on=_ALL,
        of_map={"initially_depends_on": _of_viscous(*_SLIDING, "seal_torque")},
    ),
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
    Variable(
        "in_range", "output", "False while an input is outside the map and clamped", depends_on=_ALL
    ),
    Variable(
        "range_margin", "output",
        "Least distance of preload, speed, temperature and force of the loaded nut from the limits of the map, as a "
        "share of the length of the axis. Negative outside",
        "1", nominal=0.1, depends_on=_ALL,
    ),
    Variable(
        "heat", "output",
        "Heat of all steps of co-simulation since the start. Model exchange: of events only, at which power_loss has "
        "no time; add the integral of power_loss",
        "J", nominal=100.0, depends_on=_ALL, from_zero=True,
    ),
    Variable(
        "friction_torque_nut_a", "output",
        "Part of friction_torque of the nut that a positive axial_load loads, half of the seals included",
        "N.m", nominal=1.0, depends_on=_ALL, of_map={"initially_depends_on": _of_viscous(*_SLIDING, "seal_torque")},
    ),
    Variable(
        "friction_torque_nut_b", "output", "Part of friction_torque of the other nut", "N.m", nominal=1.0,
        depends_on=_ALL, of_map={"initially_depends_on": _of_viscous(*_SLIDING, "seal_torque")},
    ),
)  # fmt: skip
PARAMETERS = (
    Variable(
        "apparent_viscosity_ratio", "parameter", "", "1", minimum=0.0, nominal=10.0,
        of_map={
            "start": _default("apparent_viscosity_ratio"),
            "description": _by_law(
                "Apparent shear viscosity divided by film viscosity (fitted)",
                "Factor of the rolling part (1 = the oil's viscosity)",
            ),
        },
    ),
    Variable(
        "net_sliding_coefficient", "parameter", "", "1", minimum=0.0, nominal=0.01,
        of_map={
            "start": _default("net_sliding_coefficient"),
            "description": _by_law(
                "Net Coulomb coefficient of the sliding part (fitted)",
                "Ball-on-ball friction coefficient times thrust over ball load, doubled (fitted)",
            ),
        },
    ),
    Variable(
        "roughness_height", "parameter", "", "m", minimum=0.0, nominal=1e-8, display_unit="nm",
        of_map={
            "start": _default("roughness_height"),
            "description": _by_law(
                "Film thickness at which the viscous part is halved (fitted). 0: no reduction",
                "Roughness height that lambda_ratio refers to, without effect on torques",
            ),
        },
    ),
    Variable(
        "breakaway_factor", "parameter", "Torque of the Coulomb part at standstill over that in a full film; 1 = off",
        "1", minimum=0.0, nominal=1.0, of_map={"start": _default("breakaway_factor")},
    ),
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
    Variable(
        "seal_torque", "parameter", "Drag of the seals: a constant part of friction_torque, takes part in presliding",
        "N.m", minimum=0.0, nominal=0.1, of_map={"start": seal_torque},
    ),
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


def row_with(row: Variable, depends_on: Names, initially: Names, **changes: Any) -> Variable:
    """A row for the table of another model, with its own dependencies."""
    fields = {field: value for field, value in row.of_map.items() if not field.endswith("depends_on")}
    return row._replace(of_map=fields, depends_on=depends_on, initially_depends_on=initially)._replace(
        **changes
    )


def film_rows(loads: Names, loads_and_motion: Names, initially: Names) -> list[Variable]:
    """The outputs of films and contacts for the table of another model, which depend on these."""
    return [
        row_with(
            row,
            loads if row.depends_on == _FORCES else loads_and_motion,
            (*initially, *(("roughness_height",) if row.name == "lambda_ratio" else ())),
        )
        for row in OUTPUTS
        if row.needs == "films"
    ]


def fmu_variables(header: Header) -> tuple[Variable, ...]:
    """The table for the map with this header: inputs, then outputs, then parameters."""
    return of_map((*INPUTS, *OUTPUTS, *PARAMETERS), header)


ELEMENT_STATES = tuple(f"presliding_element_{i}" for i in range(1, ELEMENTS + 1))
_SLIPPING = (*_COEFFICIENTS, "seal_torque", "presliding", "presliding_stiffness", "presliding_side")


def other_elements(name: str) -> tuple[str, ...]:
    """The other states: one of them that is set is why presliding_side is not used."""
    return tuple(other for other in ELEMENT_STATES if other != name)


STATES = (  # native FMUs only
    *(
        Variable(
            name, "local",
            f"Deflection of elasto-slip element {i} times the root of its stiffness, a continuous state; half its "
            "square is its energy in J",
            "rad", 0.0, nominal=1e-2,
        )
        for i, name in enumerate(ELEMENT_STATES, 1)
    ),
    *(
        Variable(
            f"{name}_rate", "local", f"Time derivative of {name}", "rad/s", nominal=1.0,
            initially_depends_on=(*_SLIPPING, *other_elements(name)), derivative_of=name,
            of_map={"depends_on": _coulomb(name)},
        )
        for name in ELEMENT_STATES
    ),
    Variable(
        "in_range_indicator", "local", "Event indicator of in_range", "1", nominal=1.0, depends_on=_ALL,
        indicates=True,
    ),
    Variable(
        "stiffness_indicator", "local", "Event indicator of the stiffness of the elements: far from that of the loads",
        "1", nominal=1.0, depends_on=_FORCES, initially_depends_on=_SLIPPING[:-1],
        indicates=True,
    ),
    *(
        Variable(
            f"slip_indicator_{i}", "local", f"Event indicator of elasto-slip element {i}: it begins or ends to slide",
            "1", nominal=1.0, initially_depends_on=(*_SLIPPING, *other_elements(name)), indicates=True,
            of_map={"depends_on": _coulomb(name)},
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
            initially = tuple(
                dict.fromkeys(
                    (*initially, *_COEFFICIENTS, "presliding_stiffness", "presliding_damping", "seal_torque")
                )
            )
        table.append(v._replace(initially_depends_on=initially))
    return (*table, *of_map(STATES, header))


TIME = Variable("time", "independent", "Time", "s")  # FMI 3 only, after the table


def places(variables: tuple[Variable, ...], causality: str) -> tuple[int, ...]:
    """Value references of the variables with this causality."""
    return tuple(n for n, v in enumerate(variables, FIRST_REFERENCE) if v.causality == causality)
