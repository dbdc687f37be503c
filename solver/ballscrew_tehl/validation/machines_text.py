"""Tables of the comparisons of validation.machines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .bearings import BEARINGS, CONFORMITY_NU_N, CONFORMITY_SHARE, NU_N, SHARES, BearingPoint
from .machines import Machines, Spread, exponents, rig_torques, spread

Torque = Callable[[BearingPoint], float]

#: nu n [mm2/s r/min] up to which bearings of this size are run, and up to which the exponents are fitted
USUAL_NU_N, EXPONENT_NU_N = 5e5, 1e5
#: nu n from which on the film carries
FILM_NU_N = 1e4
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
#: sets of points by name
POINTS: dict[str, Callable[[BearingPoint], bool]] = {
    f"data, nu n <= {USUAL_NU_N:g}": lambda p: p.in_data and p.nu_n <= USUAL_NU_N,
    "data, all": lambda p: p.in_data,
    "five other bearings": lambda p: not p.in_data,
}


def rolling_spreads(found: Machines) -> dict[str, dict[str, Spread]]:
    """Rolling part over that of SKF: by law, by set of points."""
    return {
        name: {
            of: spread([torque(p) / p.skf_rolling for p in found.bearings if chosen(p)])
            for of, chosen in POINTS.items()
        }
        for name, torque in ROLLING.items()
    }


def sliding_spreads(found: Machines) -> dict[str, Spread]:
    """Sliding part of the law over that of SKF, by nu n; all bearings."""
    return {
        f"{nu_n:g}": spread([p.law.sliding / p.skf_sliding for p in found.bearings if p.nu_n == nu_n])
        for nu_n in NU_N
    }


def total_spreads(found: Machines) -> dict[str, dict[str, Spread]]:
    """Total over that of SKF: by law, by set of points and regime."""
    below, above = f"nu n < {FILM_NU_N:g}", f"{FILM_NU_N:g} to {USUAL_NU_N:g}"
    regimes: dict[str, Callable[[BearingPoint], bool]] = {
        below: lambda p: p.nu_n < FILM_NU_N,
        above: lambda p: FILM_NU_N <= p.nu_n <= USUAL_NU_N,
        "above": lambda p: p.nu_n > USUAL_NU_N,
    }
    return {
        name: {
            f"{of}, {regime}": spread([torque(p) / p.skf for p in found.bearings if chosen(p) and within(p)])
            for of, chosen in (("data", POINTS["data, all"]), ("others", POINTS["five other bearings"]))
            for regime, within in regimes.items()
        }
        for name, torque in TOTALS.items()
    }


def total_by_load(found: Machines) -> dict[str, dict[str, tuple[float, float]]]:
    """Least and largest total of the law over that of SKF, by nu n and load over rating; all bearings."""
    return {
        f"{nu_n:g}": {
            f"{share:g} C": (min(ratios), max(ratios))
            for share in SHARES
            if (ratios := [p.law.total / p.skf for p in found.bearings if (p.nu_n, p.share) == (nu_n, share)])
        }
        for nu_n in NU_N
    }


def inside_interval(found: Machines) -> dict[str, tuple[int, int]]:
    """Points whose torque by SKF is inside the interval of the law, and all, by set of points."""
    return {
        of: (
            sum(p.law.low <= p.skf <= p.law.high for p in found.bearings if chosen(p)),
            sum(map(chosen, found.bearings)),
        )
        for of, chosen in POINTS.items()
    }


def rolling_exponents(found: Machines) -> dict[str, tuple[float, float]]:
    """Exponents of load and nu n of the rolling part, data up to EXPONENT_NU_N."""
    points = [p for p in found.bearings if p.in_data and p.nu_n <= EXPONENT_NU_N]
    laws: dict[str, Torque] = {"SKF": lambda p: p.skf_rolling, **ROLLING}
    return {name: exponents(points, torque) for name, torque in laws.items()}


def screw_summary(found: Machines) -> dict[str, Any]:
    """Torques of all plausible screws; medians of the ends of their intervals; how many of these hold a torque."""
    torques = np.array([p.torque for p in found.screws])
    relative = np.array([(p.low / p.torque, p.high / p.torque) for p in found.screws])
    return {
        "count": torques.size, "low": float(torques.min()), "median": float(np.median(torques)),
        "high": float(torques.max()), "interval": np.median(relative, axis=0).tolist(),
        "inside": {
            name: sum(p.low <= measured <= p.high for p in found.screws)
            for name, measured in rig_torques().items()
        },
    }  # fmt: skip


def groove_spreads(found: Machines) -> dict[str, Spread]:
    """Flooded rolling torque over the measured one, by ball diameter."""
    balls = sorted({p.ball_diameter for p in found.grooves})
    return {
        f"{d:g} mm": spread([p.flooded / p.measured for p in found.grooves if p.ball_diameter == d])
        for d in balls
    }


def machines_json(found: Machines) -> dict[str, Any]:
    """Points and tables."""

    def plain(table: Any) -> Any:
        if isinstance(table, Spread):
            return table._asdict()
        return {name: plain(entry) for name, entry in table.items()} if isinstance(table, dict) else table

    tables = {
        "rolling_over_skf": rolling_spreads(found), "rolling_exponents": rolling_exponents(found),
        "sliding_over_skf": sliding_spreads(found), "total_over_skf": total_spreads(found),
        "total_by_load": total_by_load(found), "inside_interval": inside_interval(found),
        "conformities": found.conformities, "open_grooves": groove_spreads(found),
        "rig_screws": screw_summary(found) | {"measured": rig_torques()},
    }  # fmt: skip
    return {name: plain(table) for name, table in tables.items()} | {
        "bearings": [p._asdict() | {"law": p.law._asdict()} for p in found.bearings],
        "grooves": [p._asdict() for p in found.grooves],
        "screws": [p._asdict() for p in found.screws],
    }


def _line(name: str, spreads: list[Spread]) -> str:
    return f"  {name:34}" + "".join(
        f"{s.mean:8.2f}{s.scatter:6.2f}{s.low:7.2f} to {s.high:5.2f}" for s in spreads
    )


def machines_text(found: Machines) -> str:
    """All tables."""
    rolling, total, width = rolling_spreads(found), total_spreads(found), 28
    heads = f"{'':36}" + "".join(f"{'mean':>8}{'scat.':>6}{'range':>14}" for _ in range(3))
    inside = inside_interval(found)
    lines = [
        "Bearings under an axial load, ISO VG 68 at 40 C, over SKF's friction model. Nothing is fitted to them.",
        "mean: geometric; scat.: exp(standard deviation of ln). Others: " + ", ".join(
            name for name, of in BEARINGS.items() if not of.in_data) + ", ratings",
        "and limiting speeds from memory; balls of all bearings from their ratings.",
        "",
        "Rolling part over SKF's",
        f"{'':36}" + "".join(f"{of:>{width}}" for of in POINTS),
        heads,
        *(_line(name, list(by.values())) for name, by in rolling.items()),
        "",
        f"Exponents of the rolling part, data with nu n <= {EXPONENT_NU_N:g}: load, nu n",
        *(f"  {name:34}{load:8.2f}{speed:6.2f}" for name, (load, speed) in rolling_exponents(found).items()),
        "",
        "Sliding part of the law over SKF's, all bearings",
        f"  {'nu n':34}{'mean':>8}{'scat.':>6}{'range':>14}",
        *(_line(nu_n, [s]) for nu_n, s in sliding_spreads(found).items()),
        "",
        "Total over SKF's, without drag",
    ]  # fmt: skip
    for of in ("data", "others"):
        columns = [key for key in next(iter(total.values())) if key.startswith(of + ",")]
        lines += [f"{'':36}" + "".join(f"{key:>{width}}" for key in columns), heads]
        lines += [_line(name, [by[key] for key in columns]) for name, by in total.items()]
    by_load = total_by_load(found)
    lines += [
        "",
        "Total of the law over SKF's by nu n and load over dynamic rating, all bearings",
        f"  {'nu n':8}" + "".join(f"{of:>16}" for of in by_load[f"{NU_N[0]:g}"]),
        *(
            f"  {nu_n:8}" + "".join(f"{low:8.2f} to {high:4.2f}" for low, high in by.values())
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
        f"  {'ball':34}{'mean':>8}{'scat.':>6}{'range':>14}",
        *(_line(ball, [s]) for ball, s in groove_spreads(found).items()),
        "",
    ]
    screws, measured = screw_summary(found), rig_torques()
    low, high = screws["interval"]
    lines += [
        "New ball screws of a degradation rig: lead 8 mm, preload 1500 N, 100 r/min; else unknown",
        "  measured " + " and ".join(f"{torque:.4f}" for torque in measured.values()) + " N.m",
        f"  law of {screws['count']} double nuts that they could be: {screws['low']:.3f} to {screws['high']:.3f}, "
        f"median {screws['median']:.3f} N.m; interval {low:.2f} to {high:.2f} times the torque",
        *(f"  {measured[name]:.4f} N.m is inside the interval of {hits} of {screws['count']}"
          for name, hits in screws["inside"].items()),
    ]  # fmt: skip
    return "\n".join(lines)
