"""Friction of a whole axis from what identify wrote, in the formats of tables; each direction by itself.

A compensation list has one column for both directions: it gets their mean.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..identification.directions import BothWays, Friction, both_ways
from ..parameters.units import RPM
from .formats import comment, matlab_row


class AxisFriction(NamedTuple):
    """Bins of a log over the signed speed: rad/s and N.m at the screw, or m/s and N of a linear axis.

    lead [m], torque_constant [N.m/A], ratio : of the drive, None = not known
    """

    rotary: bool
    friction: Friction
    lead: float | None
    torque_constant: float | None
    ratio: float
    about: dict[str, str]

    @property
    def head(self) -> tuple[str, str]:
        """What the file is of, signs."""
        return (
            "friction of a whole axis: screw, guides, seals and bearings together, without the offset (gravity, tilt)",
            "friction has the sign of the speed: the drive needs it in addition",
        )

    @property
    def names(self) -> tuple[str, str]:
        """Speed and effort with SI units."""
        return ("speed [rad/s]", "torque [N.m]") if self.rotary else ("velocity [m/s]", "force [N]")

    @property
    def turn(self) -> float:
        """Speed of the screw [rad/s] for one of the axis; ValueError: no lead."""
        if self.rotary:
            return 1.0
        if self.lead is None:
            raise ValueError("--lead-mm (missing); needed of a linear axis for torque and speed of the screw")
        return 2.0 * math.pi / self.lead

    def between(self, low: float, high: float) -> AxisFriction:
        """The bins between two speeds of the screw [rad/s].

        Raises       ValueError: fewer than three in a direction
        """
        speed = self.friction.speed * self.turn
        inside = (np.abs(speed) >= low) & (np.abs(speed) <= high)
        if not min((inside & (speed > 0.0)).sum(), (inside & (speed < 0.0)).sum()) >= 3:
            least, most = np.abs(speed).min() / RPM, np.abs(speed).max() / RPM
            raise ValueError(
                f"--speed-rpm = {low / RPM:.6g} {high / RPM:.6g}; allowed: a range with 3 speeds of the log in each "
                f"direction, which has {least:.4g} to {most:.4g} r/min"
            )
        return self._replace(friction=Friction(*(values[inside] for values in self.friction)))

    @property
    def mean(self) -> BothWays:
        """Mean of both directions [rad/s], [N.m]; ValueError: fewer than three common speeds, no lead."""
        both, turn = both_ways(self.friction), self.turn
        if len(both.speed) < 3:
            raise ValueError(
                f"speeds that both directions have in common = {len(both.speed)}; allowed: at least 3 for a list"
            )
        return BothWays(
            both.speed * turn, both.mean / turn, both.difference / turn, both.error / turn, both.samples
        )


def read_identified(path: Path | str) -> AxisFriction:
    """What identify --output or --json has written.

    Raises       ValueError: cannot be read, is something else
    """
    try:
        data: dict[str, Any] = json.loads(Path(path).read_text(encoding="utf-8-sig"))
        rotary, rows = data["kind"] == "rotary", data["friction"]
        speed, effort = ("speed_rpm", "torque_{}nm") if rotary else ("velocity_m_s", "force_{}n")
        keys = speed, *(effort.format(name) for name in ("", "error_", "low_", "high_")), "samples"
        values = [np.array([row[key] for row in rows], dtype=np.float64) for key in keys]
        values[0] = values[0] * (RPM if rotary else 1.0)
        found = Friction(*values)
        stated = [data.get(key) for key in ("lead_mm", "torque_constant_nm_a", "ratio")]
        lead, constant, ratio = (None if one is None else float(one) for one in stated)
        if not (
            all(one is None or 0.0 < one < math.inf for one in (lead, constant, ratio))
            and np.isfinite(values).all()
            and bool(np.all(np.diff(found.speed) > 0.0))
            and found.speed[0] < 0.0 < found.speed[-1]
        ):
            raise ValueError("friction in both directions at rising speeds, positive numbers of the drive")
        about = {"log": str(data.get("log"))}
        for key in ("temperature_c", "preload_n", "offset_nm" if rotary else "offset_n"):
            if data.get(key) is not None:
                about[key] = f"{data[key]:.6g}"
    except OSError as error:
        raise ValueError(f"--identified = {path}: cannot be read ({error.strerror})") from error
    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        raise ValueError(
            f"--identified = {path}; allowed: a file that identify --output has written"
        ) from error
    return AxisFriction(rotary, found, lead and 1e-3 * lead, constant, ratio or 1.0, about)


def _rows(axis: AxisFriction, one: float = 1.0) -> list[str]:
    """Speed, effort, low, high of each bin."""
    friction = axis.friction
    columns = friction.speed / one, friction.value, friction.low, friction.high
    return [" ".join(f"{value:.10g}" for value in row) for row in zip(*columns, strict=True)]


def csv_text(axis: AxisFriction) -> str:
    """One row for each bin."""
    speed, effort = axis.names
    name, unit = effort.split()
    heading = f"{'speed [r/min]' if axis.rotary else speed},{effort},{name} low {unit},{name} high {unit}"
    rows = [row.replace(" ", ",") for row in _rows(axis, RPM if axis.rotary else 1.0)]
    return "\n".join([*comment(axis, "#"), heading, *rows]) + "\n"


def json_text(axis: AxisFriction) -> str:
    """Arrays over the signed speed, units in the keys."""
    friction = axis.friction
    speed, one, effort = (
        ("speed_rpm", RPM, "torque_{}nm") if axis.rotary else ("velocity_m_s", 1.0, "force_{}n")
    )
    arrays = {speed: friction.speed / one, effort.format(""): friction.value}
    arrays |= {effort.format("low_"): friction.low, effort.format("high_"): friction.high}
    about = {**axis.about, "content": axis.head[0], "sign": axis.head[1]}
    return (
        json.dumps({"about": about} | {key: array.tolist() for key, array in arrays.items()}, indent=1) + "\n"
    )


def modelica_text(axis: AxisFriction) -> str:
    """One table: columns speed, friction, low, high; 0 at rest."""
    rows = _rows(axis)
    rest = int(np.searchsorted(axis.friction.speed, 0.0))
    rows.insert(rest, "0 0 0 0")
    columns = f"# columns: {', '.join(axis.names)}, low, high. At rest 0; between the lowest speeds straight through 0"
    return "\n".join(["#1", *comment(axis, "#"), columns, f"double friction_1({len(rows)},4)", *rows]) + "\n"


def matlab_text(axis: AxisFriction, name: str) -> str:
    """A function of the name of the file: friction by interp1 over its breakpoints, or the breakpoints themselves."""
    (speed, effort), friction = axis.names, axis.friction
    lines = [
        f"function [{effort.split()[0]}, t] = {name}(speed)",
        *comment(axis, "%"),
        f"% {effort} = {name}({speed}); [~, t] = {name}() gives the breakpoints, for a Simulink 1-D Lookup Table",
        *(
            matlab_row(key, np.insert(values, np.searchsorted(friction.speed, 0.0), 0.0))
            for key, values in (
                ("speed", friction.speed), ("value", friction.value), ("low", friction.low), ("high", friction.high)
            )
        ),
        f"if nargin == 0, {effort.split()[0]} = []; return, end",
        f"{effort.split()[0]} = interp1(t.speed, t.value, max(min(speed, t.speed(end)), t.speed(1)));",
        "end",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"
