"""The command validate: the model compared with measured torques, published models and a published contact."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from .. import __version__
from ..friction.sets import FrictionSet, default_friction_set
from ..parameters.file import changed
from .common import map_of, screw_of
from .points import print_results

if TYPE_CHECKING:
    from ..runtime.evaluate import NutMap


def run_validate(args: Namespace) -> int:
    """Compare the model with measurements and published models, for all fitted sets."""
    from ..friction.sets import friction_set_text, load_friction_sets
    from ..validation.tables import table_text, validation_tables

    parameters = screw_of(args)
    if args.contacts:
        from ..validation.section5 import section5_contacts, section5_text

        contacts = section5_contacts(parameters)
        if args.json:
            print_results([row._asdict() for row in contacts], True, True)
        else:
            print(section5_text(contacts))
        return 0
    chosen = default_friction_set(parameters)
    packaged = [s for s in load_friction_sets().values() if s.kinematics == parameters.friction.kinematics]
    sets = [chosen] + [s for s in packaged if s.name != chosen.name]
    found = {}
    for entry in sets:
        # every set needs the film that it was fitted with
        own = map_of(args, changed(parameters, friction={"set": entry.name}))

        def evaluate(
            preload: float, speed: float, temperature: float, own: NutMap = own, entry: FrictionSet = entry
        ) -> float:
            state = own.evaluate(preload, speed, temperature, 0.0, *entry.values)
            return float(state.friction_torque)

        found[entry.name] = validation_tables(evaluate)
    if args.json:
        result = {
            "kinematics": parameters.friction.kinematics,
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
