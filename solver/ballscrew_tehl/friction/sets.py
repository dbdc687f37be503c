"""Fitted friction parameters: the numbers, their provenance and uncertainty.

The packaged sets live in data/friction_sets.toml, written by examples/paper/packaged_fit.py.
A set belongs to one kinematics and to one film model: with a film that is 5 to 10 % thinner the ratio moves
as much.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import ValidationError

from ..parameters.file import Parameters, changed
from ..parameters.identity import parameters_hash
from ..parameters.packaged_data import PACKAGED_DATA
from ..parameters.screw import LAW_SETS
from ..parameters.toml import read_toml
from ..runtime.packed import MECHANISTIC
from ..whole_file import whole_file

#: fitted parameters in their fixed order
FITTED = ("apparent_viscosity_ratio", "net_sliding_coefficient", "roughness_height")
#: which of them a set fits; the others are zero, with the mechanistic law the ratio is 1
SETS: dict[str, tuple[str, ...]] = {
    "two_parameter": FITTED[:2],
    "three_parameter": FITTED,
    MECHANISTIC: FITTED[1:2],
}
#: operating point of a calibration on one torque: preload [N], screw speed [rad/s], oil temperature [K]
CALIBRATED_AT = ("preload", "speed", "temperature")
#: unit that the keys of the file carry
_SUFFIX = {
    "roughness_height": "roughness_height_m",
    **dict(zip(CALIBRATED_AT, ("preload_N", "speed_rad_s", "temperature_K"), strict=True)),
}

#: tables of earlier files, which are ignored
EARLIER = ("correlations", "other_losses")
PACKAGED_SETS = PACKAGED_DATA / "friction_sets.toml"


@dataclass(frozen=True)
class FrictionSet:
    """One set of friction parameters with its provenance.

    apparent_viscosity_ratio  apparent shear viscosity over film viscosity [1]; mechanistic: factor of the rolling part
    net_sliding_coefficient   mu_s (1 - 3c + c^3) as one number [1]; mechanistic: 2 mu_b Lambda kappa of ball on ball
    roughness_height          h_r of the share 1/(1 + (h_r/h)^2) of the viscous part [m]; mechanistic: 0, not used
    loss, provenance          what was minimised, over which data
    intervals                 half-width of the 95 % Student-t interval per fitted parameter (SI)
    errors                    absolute relative errors: mean, max, per table, leave_one_out_mean,
                              leave_one_out_max
    leave_one_table_out       table left out -> mean and max error on its points that the fit did not see
    limits                    fitted parameter -> {"low", "high"}, 95 % limits (SI); of the packaged sets by profile
    not_identified            what the data do not identify -> why; None: not examined
    screw, parameters_hash    screw of the fit, its name and the hash of all that the films depend on; "" if not known
    calibrated_at             of a calibration on one torque: its point, names CALIBRATED_AT; the set gives that torque
    """

    name: str
    kinematics: str
    film_model: str
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
    calibrated_at: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for key in FITTED:
            value = getattr(self, key)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"friction set {self.name}: {key} = {value}; allowed: finite and >= 0")
        for key, ends in self.limits.items():
            low, high = (float(ends.get(end, math.nan)) for end in ("low", "high"))
            if not (0.0 <= low < math.inf and low <= high):
                raise ValueError(
                    f"friction set {self.name}: limits of {key} = {low} to {high}; allowed: 0 <= low <= high, "
                    "low finite"
                )
        at = self.calibrated_at
        if at and not (
            set(at) == set(CALIBRATED_AT) and all(0.0 < value < math.inf for value in at.values())
        ):
            raise ValueError(
                f"friction set {self.name}: calibrated_at = {dict(at)}; allowed: {', '.join(CALIBRATED_AT)}, each > 0"
            )

    @property
    def values(self) -> tuple[float, float, float]:
        """Ratio [1], net sliding coefficient [1], roughness height [m]."""
        return self.apparent_viscosity_ratio, self.net_sliding_coefficient, self.roughness_height


def load_friction_sets(
    path: Path | str | None = None, remedy: str = "restore it"
) -> dict[tuple[str, str], FrictionSet]:
    """Friction sets of a file by (kinematics, name).

    Parameters   path : TOML file as write_friction_sets writes it; None = the packaged sets
                 remedy : end of an error message
    Raises       ValueError: file missing or not of this form, with the place
    """
    fields = {_SUFFIX[key]: key for key in _SUFFIX}
    file = PACKAGED_SETS if path is None else Path(path)
    content = read_toml(file, remedy)
    if "screw" in content:
        raise ValueError(f"{file}: a screw file, no friction sets; {remedy}")
    sets = {}
    try:
        for kinematics, named in content.items():
            for name, table in named.items():
                for key in EARLIER:
                    table.pop(key, None)
                values = {key: table.pop(_SUFFIX.get(key, key)) for key in FITTED}
                table["intervals"] = {
                    key: value
                    for key in FITTED
                    if (value := table.get("intervals", {}).get(_SUFFIX.get(key, key))) is not None
                }
                limits = table.get("limits", {}).items()
                table["limits"] = {fields.get(key, key): dict(ends) for key, ends in limits}
                at = table.get("calibrated_at", {}).items()
                table["calibrated_at"] = {fields.get(key, key): float(value) for key, value in at}
                sets[kinematics, name] = FrictionSet(name=name, kinematics=kinematics, **values, **table)
    except (AttributeError, KeyError, TypeError) as err:
        raise ValueError(f"{file}: no friction sets, or other keys ({err}); {remedy}") from err
    return sets


def friction_set_of_file(path: Path | str, parameters: Parameters) -> FrictionSet:
    """The set of a file that suits the parameters: their kinematics; if it holds several, their friction.set.

    Raises       ValueError: file missing or of another form, no set of the kinematics, a value out of range
    """
    sets = load_friction_sets(path, "give a file that ballscrew calibrate --output has written")
    chosen = parameters.friction
    fitting = {
        name: sets[key] for name in LAW_SETS[chosen.kinematics] if (key := (chosen.kinematics, name)) in sets
    }
    if not fitting:
        found = ", ".join(f"{kinematics} with set {name}" for kinematics, name in sorted(sets)) or "nothing"
        raise ValueError(
            f"{path}: kinematics = {found}; allowed: {chosen.kinematics}, as in the screw file, with set "
            f"{' or '.join(LAW_SETS[chosen.kinematics])}: calibrate with it, or choose the other kinematics"
        )
    entry = fitting[chosen.set] if chosen.set in fitting else next(iter(fitting.values()))
    check_usable(entry, parameters, f"{path}", "calibrate again")
    return entry


def check_usable(entry: FrictionSet, parameters: Parameters, where: str, remedy: str) -> None:
    """Refuse numbers that a screw file may not have.

    Raises       ValueError
    """
    # with the mechanistic law the height of the screw file is that of its surfaces
    own = FITTED[:2] if entry.name == MECHANISTIC else FITTED
    try:
        changed(parameters, friction={name: getattr(entry, name) for name in own})
    except ValidationError as err:
        first = err.errors()[0]
        allowed = first["msg"].replace("Input should be", "allowed:")
        raise ValueError(f"{where}: {first['loc'][-1]} = {first['input']}; {allowed}: {remedy}") from err


def default_friction_set(parameters: Parameters) -> FrictionSet:
    """The set that the parameters select (friction.kinematics, friction.set), with their overrides.

    The number of the mechanistic set belongs to no screw: without an override it is carried over from that of the fit,
    and the provenance says so.

    Raises       ValueError: two overrides of one number
    """
    chosen = parameters.friction
    entry = load_friction_sets()[chosen.kinematics, chosen.set]
    # with the mechanistic law the height of the screw file is that of its surfaces
    own = FITTED[:2] if chosen.set == MECHANISTIC else FITTED
    overrides = {name: value for name in own if (value := getattr(chosen, name)) is not None}
    given = list(overrides)
    if chosen.set == MECHANISTIC:
        if chosen.ball_thrust is not None:
            from .mechanistic import ball_ball_coefficient

            if "net_sliding_coefficient" in overrides:
                raise ValueError(
                    f"friction.ball_thrust = {chosen.ball_thrust:g}; allowed: no entry with net_sliding_coefficient"
                )
            overrides["net_sliding_coefficient"] = ball_ball_coefficient(chosen, chosen.ball_thrust)
            given.append("ball_thrust")
        if not overrides and entry.parameters_hash != parameters_hash(parameters):
            return _without_fit(entry, f"carried over from {entry.screw}: {entry.provenance}")
    if not overrides:
        return entry
    text = f"{entry.name}, overridden in the screw file: {', '.join(given)}"
    return dataclasses.replace(_without_fit(entry, text), **overrides)


def _without_fit(entry: FrictionSet, provenance: str) -> FrictionSet:
    """The numbers of a set without what was found out about its fit, which is not true of this screw."""
    return FrictionSet(
        entry.name, entry.kinematics, entry.film_model, *entry.values, provenance=provenance, screw=entry.screw,
        parameters_hash=entry.parameters_hash,
    )  # fmt: skip


def _table(prefix: str, entries: Mapping[str, float]) -> list[str]:
    lines = [f"[{prefix}]"]
    for key, value in entries.items():
        name = _SUFFIX.get(key, key)
        shown = f"{float(value):.6g}"
        if math.isfinite(value) and not set(shown) & set(".e"):
            shown += ".0"
        lines.append(f"{name} = {shown}" if name.replace("_", "").isalnum() else f'"{name}" = {shown}')
    return lines


def _quoted(text: str) -> str:
    """A TOML string; its escapes are those of JSON."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def write_friction_sets(
    path: Path | str, sets: Mapping[tuple[str, str], FrictionSet], header: str = ""
) -> None:
    """Write sets as TOML to a temporary name and rename it; the same sets give the same bytes.

    Parameters   header : lines of comment for the top of the file
    """
    lines = [f"# {line}".rstrip() for line in header.splitlines()]
    for (kinematics, name), entry in sorted(sets.items()):
        prefix = f"{kinematics}.{name}"
        lines += ["", f"[{prefix}]"]
        lines += [f"{key} = {_quoted(getattr(entry, key))}" for key in ("film_model", "loss", "provenance")]
        lines += [
            f"{key} = {_quoted(text)}"
            for key in ("screw", "parameters_hash")
            if (text := getattr(entry, key))
        ]
        lines += _table("", dict(zip(FITTED, entry.values, strict=True)))[1:]
        for part in ("intervals", "errors"):
            lines += _table(f"{prefix}.{part}", getattr(entry, part))
        for key, entries in entry.leave_one_table_out.items():
            lines += _table(f"{prefix}.leave_one_table_out.{key}", entries)
        for key, entries in entry.limits.items():
            lines += _table(f"{prefix}.limits.{_SUFFIX.get(key, key)}", entries)
        if entry.calibrated_at:
            lines += _table(f"{prefix}.calibrated_at", entry.calibrated_at)
        if entry.not_identified is not None:
            lines.append(f"[{prefix}.not_identified]")
            lines += [f"{_quoted(key)} = {_quoted(text)}" for key, text in entry.not_identified.items()]
    with whole_file(Path(path)) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def friction_set_lines(entry: FrictionSet) -> list[str]:
    """One set as text."""
    lines = [f"{entry.kinematics}, {entry.name} (film: {entry.film_model}, loss: {entry.loss or 'none'})"]
    for key in SETS.get(entry.name, FITTED):
        value, half = getattr(entry, key), entry.intervals.get(key)
        scale, unit = (1e9, " nm") if key == "roughness_height" else (1.0, "")
        known = "" if half is None else f" +- {scale * half:.2g}{unit}"
        lines.append(f"    {key:<26}{scale * value:.4g}{unit}{known}")
    if entry.errors:
        wanted = ("table2", "table4", "mean", "leave_one_out_mean", "leave_one_out_max")
        parts = [f"{key} {100.0 * entry.errors[key]:.2f} %" for key in wanted if key in entry.errors]
        lines.append("    deviations: " + ", ".join(parts))
    for name, left_out in entry.leave_one_table_out.items():
        lines.append(f"    fitted without {name}: missed by {100.0 * left_out['mean']:.1f} % on average, "
                     f"{100.0 * left_out['max']:.1f} % at most")  # fmt: skip
    return lines
