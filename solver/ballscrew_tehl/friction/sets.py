"""Fitted numbers of the friction laws: values, provenance and uncertainty.

The packaged sets live in data/friction_sets.toml, written by examples/paper/packaged_fit.py.
The numbers of a law belong to its film: with a film that is 5 to 10 % thinner the ratio moves as much.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..parameters.file import PACKAGED_DATA, Law, Parameters, changed
from ..parameters.friction import ball_ball_coefficient
from ..parameters.identity import parameters_hash
from ..parameters.screw import ScrewParameters
from ..parameters.toml import read_toml
from ..runtime.packed import MapError

#: fitted parameters in their fixed order
FITTED = ("apparent_viscosity_ratio", "net_sliding_coefficient", "roughness_height")
#: which of them a set fits; the others are zero, with the mechanistic law the ratio is 1
SETS: dict[str, tuple[str, ...]] = {
    Law.THREE_PARAMETER: FITTED,
    Law.MECHANISTIC: FITTED[1:2],
}
#: length of the oil supply; true force of a nominal preload
SUPPLY, PRELOAD = "supply_length", "preload_force"
#: FrictionSet.loss of a set that has the drag torque of the screw file
DRAG_TORQUE = "drag torque"
#: names of the keys of the file that carry a unit
KEYS = {"roughness_height": "roughness_height_m"}
PACKAGED_SETS = PACKAGED_DATA / "friction_sets.toml"

#: name of the catalogue formula, baselines.nsk_torque
CATALOGUE = "JIS B 1192, ISO VG 68"
#: why it differs from the mechanistic law, and where measured screws lie; measured torques of other leads: none known
CATALOGUE_DIFFERS = (
    "a catalogue torque goes as lead/sqrt(tan(lead angle)), friction between balls does not depend on the lead; "
    "measured on three new screws of lead 8 mm, all above theirs: 0.41 N.m (catalogue 0.25) at 1000 N, 0.40 and 0.52 "
    "N.m (0.34 to 0.38) at 1500 N"
)
#: the same with spacer balls
SPACED = (
    "with spacer balls nothing slides between balls here, so that the torque is far below that of a catalogue, which "
    "does not tell such nuts apart: no nut with spacer balls was measured, take it as a lower bound"
)


def catalogue_differs(screw: ScrewParameters) -> str:
    """Why the mechanistic law gives another torque than the catalogue."""
    return SPACED if screw.spacer_balls else CATALOGUE_DIFFERS


@dataclass(frozen=True)
class FrictionSet:
    """Fitted numbers of a friction law (SI) with their provenance.

    Attributes
    ----------
    law : Law
        Friction law.
    apparent_viscosity_ratio : float
        Apparent shear viscosity over film viscosity [1]; mechanistic: factor of the rolling part.
    net_sliding_coefficient : float
        mu_s (1 - 3c + c^3) as one number [1]; mechanistic: 2 mu_b Lambda kappa of ball on ball.
    roughness_height : float
        h_r of the fraction 1/(1 + (h_r/h)^2) of the viscous part [m]; mechanistic: not used.
    loss, provenance : str
        What was minimised, over which data.
    intervals : mapping
        Half-width of the 95 % interval (Student t) by fitted parameter.
    errors : mapping
        Absolute relative errors: mean, max, per table, leave_one_out_mean, leave_one_out_max.
    leave_one_table_out : mapping
        Table left out -> mean and max error on its points that the fit did not see.
    limits : mapping
        Fitted parameter -> {"low", "high"}, 95 % limits; of the packaged sets by profile.
    not_identified : mapping or None
        What the data do not identify -> why; None: not examined.
    screw, parameters_hash : str
        Screw of the fit; hash of all that the films of the fit depend on, "": not known.
    screw_hash, nlgi : str
        Mechanistic: hash of the screw without its oil, "": not known; grade of the grease of the fit, "": oil.
    supply_length : float or None
        Mechanistic: fitted length of the oil supply [b], in place of that of the screw file; None: not fitted.
    learned : mapping
        Mechanistic: what the torques say of the bounded constants, of friction.interval.learned.
    preload_factor : float
        True force of a preload over the nominal preload, by the drag torque of the screw file [1].
    """

    law: Law
    apparent_viscosity_ratio: float
    net_sliding_coefficient: float
    roughness_height: float = 0.0
    loss: str = ""
    provenance: str = ""
    intervals: Mapping[str, float] = field(default_factory=dict)
    errors: Mapping[str, float] = field(default_factory=dict)
    leave_one_table_out: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    limits: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    not_identified: Mapping[str, str] | None = None
    screw: str = ""
    parameters_hash: str = ""
    screw_hash: str = ""
    nlgi: str = ""
    supply_length: float | None = None
    learned: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    preload_factor: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "law", Law(self.law))
        checks: list[tuple[bool, str, Any, str]] = []
        for key, value in zip(FITTED, self.values, strict=True):
            checks.append((0.0 <= value < math.inf, key, value, "finite and >= 0"))
        for key, ends in self.limits.items():
            good = 0.0 <= ends.get("low", math.nan) <= ends.get("high", math.nan) and ends["low"] < math.inf
            checks.append((good, f"limits of {key}", dict(ends), "0 <= low <= high, low finite"))
        if self.learned:
            means, rows = (self.learned.get(name, {}) for name in ("mean", "covariance"))
            size, good = len(means), "constants" in self.learned
            good &= list(means) == list(rows) and all(len(row) == size for row in rows.values())
            good &= all(math.isfinite(x) for row in (means.values(), *rows.values()) for x in row)
            checks.append(
                (good, "learned", list(self.learned), "constants, with mean and covariance of the same ones")
            )
        length = self.supply_length
        checks.append((length is None or length >= 2.0, SUPPLY, length, ">= 2"))
        factor = self.preload_factor
        checks.append((0.0 < factor < math.inf, "preload_factor", factor, "finite and > 0"))
        for good, what, value, allowed in checks:
            if not good:
                raise ValueError(f"friction set {self.name}: {what} = {value}; allowed: {allowed}")

    @property
    def values(self) -> tuple[float, float, float]:
        """Ratio [1], net sliding coefficient [1], roughness height [m]."""
        return self.apparent_viscosity_ratio, self.net_sliding_coefficient, self.roughness_height

    @property
    def name(self) -> str:
        """Name of the law."""
        return self.law.value

    @property
    def nominal(self) -> bool:
        """Whether a drag torque fixes friction and the force of a nominal preload together."""
        return PRELOAD in self.learned.get("mean", {})

    @property
    def entries(self) -> dict[str, Any]:
        """Its content by the names of files and answers."""
        return {"name": self.name} | {name: value for name, value in vars(self).items() if name != "law"}


def renamed(content: Any, names: Mapping[str, str]) -> Any:
    """Content of a file with other names of keys, in all of its tables but the dimensionless `learned`."""
    if not isinstance(content, Mapping) or "covariance" in content:
        return content
    return {names.get(key, key): renamed(value, names) for key, value in content.items()}


def load_friction_sets(path: Path | str | None = None, remedy: str = "restore it") -> dict[Law, FrictionSet]:
    """Fitted numbers by law of a file of write_friction_sets, None: the packaged ones; remedy: end of an error."""
    file = PACKAGED_SETS if path is None else Path(path)
    content = read_toml(file, remedy)
    if "screw" in content:
        raise ValueError(f"{file}: a screw file, no friction sets; {remedy}")
    sets = {}
    try:
        for name, table in renamed(content, {key: name for name, key in KEYS.items()}).items():
            if name not in set(Law):
                raise ValueError(
                    f"{file}: [{name}] is no friction law; allowed: {', '.join(Law)}; fitted by an earlier version? "
                    "calibrate again"
                )
            sets[Law(name)] = FrictionSet(Law(name), **table)
    except TypeError as err:
        raise ValueError(f"{file}: no friction sets, or other keys ({err}); {remedy}") from err
    return sets


def friction_set_of_file(path: Path | str, parameters: Parameters) -> FrictionSet:
    """Numbers of a file for the law of a screw.

    Parameters
    ----------
    path : path or str
        File of write_friction_sets.
    parameters : Parameters
        Screw and oil.

    Returns
    -------
    FrictionSet
        The numbers.

    Raises
    ------
    ValueError
        File missing or of another form, without this law, a value out of range.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> friction_set_of_file(PACKAGED_SETS, load_screw("gd4008_vg100.toml")).name
    'mechanistic'
    """
    sets = load_friction_sets(path, "give a file that ballscrew calibrate --output has written")
    law = parameters.friction.law
    if (entry := sets.get(law)) is None:
        raise ValueError(
            f"{path}: law = {' and '.join(sets) or 'nothing'}; allowed: {law}, as in the screw file: "
            "calibrate with it, or change the law there"
        )
    check_usable(entry, parameters, f"{path}", "calibrate again")
    return entry


def overridable(law: Law) -> tuple[str, ...]:
    """Fitted numbers that a screw file may state: the height of the mechanistic law is that of its surfaces."""
    return FITTED[:2] if law is Law.MECHANISTIC else FITTED


def check_usable(entry: FrictionSet, parameters: Parameters, where: str, remedy: str) -> None:
    """Refuse numbers that a screw file may not have: ValueError."""
    try:
        numbers = {name: getattr(entry, name) for name in overridable(entry.law)}
        changed(with_supply(parameters, entry), friction=numbers)
    except ValidationError as err:
        first = err.errors()[0]
        allowed = first["msg"].replace("Input should be", "allowed:")
        raise ValueError(f"{where}: {first['loc'][-1]} = {first['input']}; {allowed}: {remedy}") from err


def default_friction_set(parameters: Parameters) -> FrictionSet:
    """Packaged numbers of the law of a screw, with the overrides of the screw file.

    Parameters
    ----------
    parameters : Parameters
        Screw and oil.

    Returns
    -------
    FrictionSet
        The numbers. That of the mechanistic law belongs to no screw: without an override it is carried over from that
        of the fit, and the provenance says so.

    Raises
    ------
    ValueError
        Two entries for one number.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> default_friction_set(load_screw("example_25x10.toml")).net_sliding_coefficient
    0.0107738
    """
    friction = parameters.friction
    entry = load_friction_sets()[friction.law]
    overrides = {name: getattr(friction, name) for name in overridable(friction.law)}
    overrides = {name: value for name, value in overrides.items() if value is not None}
    given = list(overrides)
    if friction.law is Law.MECHANISTIC and friction.ball_thrust is not None:
        if "net_sliding_coefficient" in overrides:
            raise ValueError(
                f"friction.ball_thrust = {friction.ball_thrust:g}; allowed: no entry with net_sliding_coefficient"
            )
        overrides["net_sliding_coefficient"] = ball_ball_coefficient(friction, friction.ball_thrust)
        given.append("ball_thrust")
    if parameters.screw.spacer_balls and friction.law is Law.MECHANISTIC:
        overrides["net_sliding_coefficient"], provenance = 0.0, "spacer balls: between them nothing slides"
    elif overrides:
        provenance = f"{entry.name}, overridden in the screw file: {', '.join(given)}"
    elif friction.law is Law.MECHANISTIC and entry.parameters_hash != parameters_hash(parameters):
        provenance = f"carried over from {entry.screw}: {entry.provenance}"
    else:
        return entry
    # without what was found out about its fit, which is not true of this screw
    numbers = {name: getattr(entry, name) for name in (*FITTED, "screw", "parameters_hash")}
    return FrictionSet(entry.law, **(numbers | overrides), provenance=provenance)


def carried_over(friction_set: FrictionSet, parameters: Parameters) -> str:
    """One sentence if the numbers are of another screw or oil and not all stated in the screw file; else ""."""
    friction = parameters.friction
    stated = {name for name in FITTED if getattr(friction, name) is not None}
    if friction.ball_thrust is not None:
        stated.add("net_sliding_coefficient")
    if parameters.screw.spacer_balls and friction_set.name == Law.MECHANISTIC:
        return ""  # its number, of balls that rub, is 0
    if friction_set.loss == DRAG_TORQUE:
        return ""  # of this screw, in the oil of its test
    other = of_other_oil(friction_set, parameters)
    ours = friction_set.parameters_hash in ("", parameters_hash(parameters)) and not other
    if ours or stated >= set(SETS[friction_set.name]):
        return ""
    if other:
        return (
            f"the numbers of friction set {friction_set.name} were measured on {friction_set.screw} in another oil "
            "or grease than that of the screw file: the friction between balls is taken over, nothing that is of an "
            "oil; torques measured in this oil narrow the interval"
        )
    churning = (
        "" if parameters.lubricant.nlgi is None else "; churning of the grease is in no interval: run it in"
    )
    return (
        f"the numbers of friction set {friction_set.name} were measured on {friction_set.screw or 'another screw'}, "
        f"not on {parameters.name} with this oil: compare the catalogue torque ({CATALOGUE}, 100 r/min), or calibrate "
        f"with measured torques{churning}"
    )


def with_law(parameters: Parameters, law: str) -> Parameters:
    """Parameters with a law, without the fitted numbers that the screw file states for another one.

    Parameters
    ----------
    parameters : Parameters
        Screw and oil.
    law : str
        Friction law.

    Returns
    -------
    Parameters
        Copy; the same object if it has the law.

    Raises
    ------
    ValueError
        The law of the paper without published surface speeds.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> with_law(load_screw(), "mechanistic").friction.law.value
    'mechanistic'
    """
    if law == parameters.friction.law:
        return parameters
    if law == Law.THREE_PARAMETER and parameters.published_speeds is None:
        raise ValueError(f"law = {law}; allowed: {Law.MECHANISTIC}: the screw has no table published_speeds")
    # a fitted height is no roughness of surfaces, nor the other way round: all three numbers go
    return changed(without_overrides(parameters, Law.THREE_PARAMETER), friction={"law": Law(law)})


def without_overrides(parameters: Parameters, name: str) -> Parameters:
    """Parameters without the fitted numbers of a law that the screw file states."""
    stated = set(overridable(Law(name))) & parameters.friction.model_fields_set
    return changed(parameters, friction=dict.fromkeys(stated)) if stated else parameters


def with_supply(parameters: Parameters, entry: FrictionSet | None) -> Parameters:
    """Parameters with the length of the oil supply that a set was fitted with, if it was fitted."""
    length = None if entry is None else entry.supply_length
    return parameters if length is None else changed(parameters, friction={SUPPLY: length})


def of_other_oil(friction: FrictionSet, parameters: Parameters) -> bool:
    """Whether a set is fitted to this screw with another oil, or with a grease for an oil."""
    own = friction.screw_hash == parameters_hash(parameters, oil=False)
    thickened = friction.nlgi != (parameters.lubricant.nlgi or "")
    return own and (thickened or friction.parameters_hash != parameters_hash(parameters))


def refuse_other_fit(friction: FrictionSet, parameters: Parameters) -> None:
    """Refuse a set of another law, and one fitted to another screw: MapError (a ValueError).

    The numbers of the mechanistic law serve other oils of the same screw, those of the others belong to their oil.
    """
    ours = parameters_hash(parameters)
    if friction.law != parameters.friction.law:
        raise MapError(f"friction set of the law {friction.law}; expected {parameters.friction.law}")
    if friction.parameters_hash not in ("", ours) and not of_other_oil(friction, parameters):
        other = "other sizes or bodies than" if friction.screw_hash else "sizes, bodies or an oil other than"
        raise MapError(
            f"friction set {friction.name} is fitted for the screw {friction.screw} ({friction.parameters_hash}); "
            f"expected {parameters.name} ({ours}): it has {other} this screw file; calibrate with torques of this screw"
        )
