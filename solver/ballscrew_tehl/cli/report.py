"""The command `report`: one HTML page on a screw, its map and the paper."""

from __future__ import annotations

import os
from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import __version__
from .common import chosen_of, say
from .points import print_results

SUFFIXES = (".html", ".htm")


def run_report(args: Namespace) -> int:
    """Gather, draw, write; the file is complete or does not exist."""
    path = Path(args.output)
    if path.suffix.lower() not in SUFFIXES or path.is_dir() or not path.parent.is_dir():
        raise ValueError(f"--output = {path}; allowed: a file *.html in a folder that exists")
    selected = chosen_of(args)
    parameters = selected.parameters
    from ..report.claims import claims
    from ..report.errata import errata
    from ..report.material import gather
    from ..report.sections import whole_page

    material = gather(parameters, args.map, say, selected.of_file)
    chosen = material.chosen.entry
    claimed = (
        claims(parameters, material.frictions, material.tables[chosen.name]) if material.measured else []
    )
    say("figures")
    text = whole_page(material, claimed, errata(material) if material.measured else [])
    temporary = path.with_name(path.name + ".part")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    tables = material.tables.items()
    result: dict[str, Any] = {
        "file": str(path),
        "figures": text.count("<img "),
        "measured": material.measured,
        "deviations": {name: {table.name: table.deviations[0] for table in found} for name, found in tables},
        "claims": {claim.id: claim.verdicts[0] for claim in claimed},
        "contacts_converged": all(found.solution.converged for found in material.contacts),
        **selected.described,
        "map_hash": material.picture.nut_map.header["file_hash"],
        "version": __version__,
    }
    print_results([result if args.json else flat(result)], args.json, False)
    return 0


def flat(nested: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """One row per number: deviations.three_parameter.table2.

    Example
        >>> flat({"a": {"b": {"c": 1}}, "d": 2})
        {'a.b.c': 1, 'd': 2}
    """
    rows: dict[str, Any] = {}
    for key, value in nested.items():
        rows |= flat(value, f"{before}{key}.") if isinstance(value, Mapping) else {f"{before}{key}": value}
    return rows
