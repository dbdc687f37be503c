"""The command validate: the model compared with measured torques, published models and a published contact."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from .. import __version__
from ..friction.origin import other_sets, with_set
from .common import chosen_of, screw_of
from .points import print_results

if TYPE_CHECKING:
    from ..runtime.evaluate import NutMap


def run_validate(args: Namespace) -> int:
    """Compare the model with measurements and published models, for all fitted sets."""
    from ..friction.sets import friction_set_text
    from ..nut_map.file import load_map
    from ..validation.tables import table_text, validation_tables

    if args.contacts:
        from ..validation.section5 import section5_contacts, section5_text

        contacts = section5_contacts(screw_of(args))
        if args.json:
            print_results([row._asdict() for row in contacts], True, True)
        else:
            print(section5_text(contacts))
        return 0
    chosen = chosen_of(args)
    parameters = chosen.parameters
    found = {}
    sets = [chosen.friction_set, *other_sets(chosen.friction_set, parameters)]
    for entry in sets:
        # every set needs the film that it was fitted with
        own = (
            chosen.nut_map(args) if entry is sets[0] else load_map(args.map, with_set(parameters, entry.name))
        )

        def evaluate(preload: float, speed: float, temperature: float, own: NutMap = own) -> float:
            return float(own.evaluate(preload, speed, temperature).friction_torque)

        found[entry.name] = validation_tables(evaluate)
    if args.json:
        result = {
            **chosen.described,
            "map_hash": own.header["file_hash"],
            "version": __version__,
            "tables": {name: [t._asdict() | {"rows": [r._asdict() for r in t.rows]} for t in tables]
                       for name, tables in found.items()},
            "friction_sets": [vars(entry) for entry in sets],
        }  # fmt: skip
        print_results([result], True, False)
        return 0
    for name, tables in found.items():
        print(f"== {parameters.name}, kinematics {parameters.friction.kinematics}, friction set {name}\n")
        for one in tables:
            print(table_text(one) + "\n")
    print(friction_set_text(sets))
    return 0
