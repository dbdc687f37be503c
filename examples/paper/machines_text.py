"""Tables of the comparisons of validation.machines."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .bearings import BEARINGS, CONFORMITY_NU_N, CONFORMITY_SHARE, NU_N, SHARES, BearingPoint
from .machines import Machines, rig_torques

Torque = Callable[[BearingPoint], float]
#: whether a point belongs to a set, by the name of the set
Sets = Mapping[str, Callable[[Any], bool]]

#: nu n [mm2/s r/min] up to which bearings of this size are run, up to which the exponents are fitted, and from which on
#: the film carries
USUAL_NU_N, EXPONENT_NU_N, FILM_NU_N = 5e5, 1e5, 1e4
#: rolling parts [N.m] by name
ROLLING: dict[str, Torque] = {
    "law, film": lambda p: p.law.rolling,
    "law, film and hysteresis": lambda p: p.law.rolling + p.law.hysteresis,
    "law, flooded film": lambda p: p.rolling["flooded"],
    "law, film, SKF's replenishment": lambda p: p.rolling["replenished"],
    "Houpert, inlet heating of Aihara": lambda p: p.rolling["houpert"],
}
#: totals [N.m] by name
TOTALS: dict[str, Torque] = {
    "law": lambda p: p.law.total,
    "law, flooded": lambda p: p.total["flooded"],
    "law, SKF's replenishment": lambda p: p.total["replenished"],
    "Palmgren, oil mist": lambda p: p.total["palmgren_mist"],
    "Palmgren, oil bath": lambda p: p.total["palmgren_bath"],
}
POINTS: Sets = {
    f"data, nu n <= {USUAL_NU_N:g}": lambda p: p.in_data and p.nu_n <= USUAL_NU_N,
    "data, all": lambda p: p.in_data,
    "five other bearings": lambda p: not p.in_data,
}
REGIMES: Sets = {
    f"nu n < {FILM_NU_N:g}": lambda p: p.nu_n < FILM_NU_N,
    f"{FILM_NU_N:g} to {USUAL_NU_N:g}": lambda p: FILM_NU_N <= p.nu_n <= USUAL_NU_N,
    "above": lambda p: p.nu_n > USUAL_NU_N,
}


class Spread(NamedTuple):
    """Of ratios: number, geometric mean, scatter factor exp(std ln), least and largest."""

    points: int
    mean: float
    scatter: float
    low: float
    high: float


def spread(ratios: Any) -> Spread:
    """Spread of ratios (n,) > 0."""
    ratios = np.asarray(ratios, dtype=float)
    logs = np.log(ratios)
    return Spread(
        ratios.size, math.exp(logs.mean()), math.exp(logs.std()), float(ratios.min()), float(ratios.max())
    )


def spreads(points: Sequence[Any], ratio: Callable[[Any], float], sets: Sets) -> dict[str, Spread]:
    """Spread of a ratio over the points of each set."""
    return {name: spread([ratio(p) for p in points if chosen(p)]) for name, chosen in sets.items()}


def _over(top: Torque, bottom: Torque) -> Torque:
    return lambda p: top(p) / bottom(p)


def _equal(name: str, value: float) -> Callable[[Any], bool]:
    return lambda p: getattr(p, name) == value


def exponents(points: Sequence[BearingPoint], torque: Torque) -> tuple[float, float]:
    """Exponents of axial load and of nu n of a torque over points, with one level for each bearing."""
    names = sorted({p.bearing for p in points})
    columns = [
        [math.log(p.axial_load), math.log(p.nu_n), *(p.bearing == name for name in names)] for p in points
    ]
    found = np.linalg.lstsq(np.array(columns, float), np.log([torque(p) for p in points]), rcond=None)[0]
    return float(found[0]), float(found[1])


def tables(found: Machines) -> dict[str, Any]:
    """All tables by name: bearings over SKF's friction model, grooves over the measurement, screws of the rig.

    Ratios of rolling and total part as Spread by law and set of points, exponents (load, nu n) by law, totals by nu n
    and load over rating as (least, largest), points whose total by SKF is inside the interval of the law as (hits, all)
    """
    bearings, torques = found.bearings, np.array([p.torque for p in found.screws])
    at_nu_n = {f"{nu_n:g}": _equal("nu_n", nu_n) for nu_n in NU_N}
    slow = [p for p in bearings if p.in_data and p.nu_n <= EXPONENT_NU_N]
    by_load = {
        nu_n: {f"{share:g} C": [p for p in bearings if at(p) and p.share == share] for share in SHARES}
        for nu_n, at in at_nu_n.items()
    }
    balls = sorted({p.ball_diameter for p in found.grooves})
    relative = np.median([(p.low / p.torque, p.high / p.torque) for p in found.screws], axis=0)
    measured = rig_torques()
    return {
        "rolling_over_skf": {
            name: spreads(bearings, _over(torque, lambda p: p.skf_rolling), POINTS)
            for name, torque in ROLLING.items()
        },
        "rolling_exponents": {
            name: exponents(slow, torque)
            for name, torque in ({"SKF": lambda p: p.skf_rolling} | ROLLING).items()
        },
        "sliding_over_skf": spreads(bearings, lambda p: p.law.sliding / p.skf_sliding, at_nu_n),
        "total_over_skf": {
            name: {
                f"{of}, {regime}": ratios
                for of, in_data in (("data", True), ("others", False))
                for regime, ratios in spreads(
                    [p for p in bearings if p.in_data is in_data], _over(torque, lambda p: p.skf), REGIMES
                ).items()
            }
            for name, torque in TOTALS.items()
        },
        "total_by_load": {
            nu_n: {
                share: (min(ratios), max(ratios))
                for share, points in by_share.items()
                if (ratios := [p.law.total / p.skf for p in points])
            }
            for nu_n, by_share in by_load.items()
        },
        "inside_interval": {
            of: (sum(p.law.low <= p.skf <= p.law.high for p in bearings if chosen(p)), sum(map(chosen, bearings)))
            for of, chosen in POINTS.items()
        },
        "conformities": found.conformities,
        "open_grooves": spreads(
            found.grooves, lambda p: p.flooded / p.measured,
            {f"{d:g} mm": _equal("ball_diameter", d) for d in balls},
        ),
        "rig_screws": {
            "count": torques.size, "low": float(torques.min()), "median": float(np.median(torques)),
            "high": float(torques.max()), "interval": relative.tolist(),
            "inside": {name: sum(p.low <= T <= p.high for p in found.screws) for name, T in measured.items()},
            "measured": measured,
        },
    }  # fmt: skip


def machines_json(found: Machines) -> dict[str, Any]:
    """Points and tables."""

    def plain(table: Any) -> Any:
        if isinstance(table, Spread):
            return table._asdict()
        return {name: plain(entry) for name, entry in table.items()} if isinstance(table, dict) else table

    return plain(tables(found)) | {
        "bearings": [p._asdict() | {"law": p.law._asdict()} for p in found.bearings],
        "grooves": [p._asdict() for p in found.grooves],
        "screws": [p._asdict() for p in found.screws],
    }


#: headings of a Spread
MEANS = f"{'mean':>8}{'scat.':>6}{'range':>14}"


def _line(name: str, *each: Spread) -> str:
    return f"  {name:34}" + "".join(
        f"{s.mean:8.2f}{s.scatter:6.2f}{s.low:7.2f} to {s.high:5.2f}" for s in each
    )


def _by_set(table: Mapping[str, Mapping[str, Spread]], beginning: str = "") -> list[str]:
    """Lines of a table of spreads by law and set, of the sets whose names begin so."""
    names = [of for of in next(iter(table.values())) if of.startswith(beginning)]
    return [
        f"{'':36}" + "".join(f"{of:>28}" for of in names),
        f"{'':36}" + MEANS * len(names),
        *(_line(law, *(by[of] for of in names)) for law, by in table.items()),
    ]


def machines_text(found: Machines) -> str:
    """All tables."""
    all_, others = tables(found), ", ".join(name for name, of in BEARINGS.items() if not of.in_data)
    by_load, inside, screws = (all_[name] for name in ("total_by_load", "inside_interval", "rig_screws"))
    low, high = screws["interval"]
    lines = [
        "Bearings under an axial load, ISO VG 68 at 40 C, over SKF's friction model. Nothing is fitted to them.",
        f"mean: geometric; scat.: exp(standard deviation of ln). Others: {others}, ratings",
        "and limiting speeds from memory; balls of all bearings from their ratings.",
        "",
        "Rolling part over SKF's",
        *_by_set(all_["rolling_over_skf"]),
        "",
        f"Exponents of the rolling part, data with nu n <= {EXPONENT_NU_N:g}: load, nu n",
        *(f"  {law:34}{load:8.2f}{speed:6.2f}" for law, (load, speed) in all_["rolling_exponents"].items()),
        "",
        "Sliding part of the law over SKF's, all bearings",
        f"  {'nu n':34}{MEANS}",
        *(_line(*of) for of in all_["sliding_over_skf"].items()),
        "",
        "Total over SKF's, without drag",
        *_by_set(all_["total_over_skf"], "data,"),
        *_by_set(all_["total_over_skf"], "others,"),
        "",
        "Total of the law over SKF's by nu n and load over dynamic rating, all bearings",
        f"  {'nu n':8}" + "".join(f"{of:>16}" for of in by_load[f"{NU_N[0]:g}"]),
        *(
            f"  {nu_n:8}" + "".join(f"{least:8.2f} to {most:4.2f}" for least, most in by.values())
            for nu_n, by in by_load.items()
        ),
        "  SKF's total inside the interval of the law: "
        + ", ".join(f"{of} {hits} of {count}" for of, (hits, count) in inside.items()),
        "",
        f"Groove radius over ball diameter is no catalogue number: total over SKF's at {CONFORMITY_SHARE:g} C by nu n",
        f"  {'':14}" + "".join(f"{nu_n:>8g}" for nu_n in CONFORMITY_NU_N),
        *(
            f"  {name:8}{conformity:6}" + "".join(f"{ratio:8.2f}" for ratio in ratios)
            for name, by in found.conformities.items()
            for conformity, ratios in by.items()
        ),
        "",
        "Three balls between open grooves (Balan et al. 2015): rolling torque, flooded, over the measured one",
        f"  {'ball':34}{MEANS}",
        *(_line(*of) for of in all_["open_grooves"].items()),
        "",
        "New ball screws of a degradation rig: lead 8 mm, preload 1500 N, 100 r/min; else unknown",
        "  measured " + " and ".join(f"{torque:.4f}" for torque in screws["measured"].values()) + " N.m",
        f"  law of {screws['count']} double nuts that they could be: {screws['low']:.3f} to {screws['high']:.3f}, "
        f"median {screws['median']:.3f} N.m; interval {low:.2f} to {high:.2f} times the torque",
        *(
            f"  {screws['measured'][name]:.4f} N.m is inside the interval of {hits} of {screws['count']}"
            for name, hits in screws["inside"].items()
        ),
    ]
    return "\n".join(lines)
