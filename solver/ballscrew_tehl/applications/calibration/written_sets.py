"""Friction sets as files and as text."""

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ballscrew_tehl.friction.sets import FITTED, KEYS, SETS, SUPPLY, FrictionSet, renamed
from ballscrew_tehl.whole_file import whole_file


def _toml_lines(content: Mapping[str, Any], prefix: str) -> list[str]:
    """Entries and then sub-tables of a TOML table; escapes of TOML strings are those of JSON."""
    entries, tables = [], []
    for key, value in content.items():
        if isinstance(value, Mapping):
            tables += [f"[{prefix}.{key}]", *_toml_lines(value, f"{prefix}.{key}")]
        else:
            rounded = isinstance(value, float) and repr(float(f"{value:.6g}"))
            name = key if key.replace("_", "").isalnum() else json.dumps(key, ensure_ascii=False)
            text = f"{name} = {rounded or json.dumps(value, ensure_ascii=False)}"
            entries.append(text.replace("\x7f", "\\u007f"))
    return entries + tables


def friction_sets_text(sets: Iterable[FrictionSet], header: str = "") -> str:
    """Numbers of laws as TOML, as write_friction_sets writes them."""
    lines = [f"# {line}".rstrip() for line in header.splitlines()]
    for entry in sorted(sets, key=lambda entry: entry.name):
        stated = {key: value for key, value in entry.entries.items() if value or value == 0.0}
        del stated["name"]
        if entry.not_identified is not None:
            # an empty table says that all is
            stated["not_identified"] = entry.not_identified
        lines += ["", f"[{entry.name}]", *_toml_lines(renamed(stated, KEYS), entry.name)]
    return "\n".join(lines) + "\n"


def write_friction_sets(path: Path | str, sets: Iterable[FrictionSet], header: str = "") -> None:
    """Write numbers of laws as TOML; the same numbers give the same bytes.

    Parameters
    ----------
    path : path or str
        File, written completely or not at all.
    sets : iterable of FrictionSet
        The numbers, one set a law.
    header : str, optional
        Comment at the top.

    Examples
    --------
    >>> import tempfile
    >>> from ballscrew_tehl.friction.sets import load_friction_sets
    >>> from ballscrew_tehl.runtime.packed import Law
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_friction_sets(f"{folder}/sets.toml", [FrictionSet(Law.MECHANISTIC, 1.0, 0.01)])
    ...     load_friction_sets(f"{folder}/sets.toml")[Law.MECHANISTIC].net_sliding_coefficient
    0.01
    """
    with whole_file(Path(path)) as temporary:
        temporary.write_text(friction_sets_text(sets, header), encoding="utf-8")


def friction_set_lines(entry: FrictionSet) -> list[str]:
    """One set as text."""
    lines = [f"{entry.name} (loss: {entry.loss or 'none'})"]
    for key in SETS.get(entry.name, FITTED):
        value, half = getattr(entry, key), entry.intervals.get(key)
        scale, unit = (1e9, " nm") if key == "roughness_height" else (1.0, "")
        known = "" if half is None else f" +- {scale * half:.2g}{unit}"
        lines.append(f"    {key:<26}{scale * value:.4g}{unit}{known}")
    if (length := entry.supply_length) is not None:
        low, high = entry.limits[SUPPLY].values() if SUPPLY in entry.limits else (math.nan, math.nan)
        lines.append(f"    {SUPPLY:<26}{length:.3g} half-widths, 95 % interval {low:.3g} to {high:.3g}")
    if entry.errors:
        target = ("table2", "table4", "mean", "leave_one_out_mean", "leave_one_out_max")
        parts = [f"{key} {100.0 * entry.errors[key]:.2f} %" for key in target if key in entry.errors]
        lines.append("    deviations: " + ", ".join(parts))
    for name, left_out in entry.leave_one_table_out.items():
        mean, most = 100.0 * left_out["mean"], 100.0 * left_out["max"]
        lines.append(f"    fitted without {name}: missed by {mean:.1f} % on average, {most:.1f} % at most")
    return lines
