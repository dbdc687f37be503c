"""The command validate: the model compared with measured torques, published models and a published contact."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ... import __version__
from ...friction.origin import other_sets, with_set
from ...friction.sets import MECHANISTIC, FrictionSet, default_friction_set
from ...parameters.file import Parameters, load_screw
from ...parameters.packaged_data import PACKAGED_VG100
from ..shared.chosen import Chosen, chosen_of, screw_of
from ..shared.files import check_output, written
from ..shared.progress import QUIET, progress_bar
from ..shared.results import print_results, say

if TYPE_CHECKING:
    from ...runtime.evaluate import NutMap


#: what takes its time
MAPS = "maps read"


class _Law(NamedTuple):
    """A friction set with the parameters and the map that it is evaluated with."""

    entry: FrictionSet
    parameters: Parameters
    nut_map: NutMap

    def torque(self, preload: float, speed: float, temperature: float) -> float:
        """With the numbers of the set [N.m]."""
        return float(self.nut_map.evaluate(preload, speed, temperature).friction_torque)

    @property
    def mechanistic(self) -> bool:
        """Whether it is the mechanistic law."""
        return self.entry.name == MECHANISTIC


def _laws(args: Namespace, chosen: Chosen) -> list[_Law]:
    """The chosen set, the other packaged ones measured on this screw, for the packaged screw also the mechanistic one.

    The mechanistic set comes with another oil, and so with its own screw file and map.
    """
    from ...nut_map.file import load_map

    # every set needs the film that it was fitted with
    wanted = [
        (entry, with_set(chosen.parameters, entry.name), args.map)
        for entry in other_sets(chosen.friction_set, chosen.parameters)
    ]
    if not (args.screw or args.map) and chosen.friction_set.name != MECHANISTIC:
        own = load_screw(PACKAGED_VG100)
        wanted.append((default_friction_set(own), own, None))
    with progress_bar(QUIET) as progress:
        # the film of another set is summed over the balls when its map is read
        progress(0, 1 + len(wanted), MAPS)
        found = [_Law(chosen.friction_set, chosen.parameters, chosen.nut_map(args))]
        for entry, own, file in wanted:
            progress(len(found), 1 + len(wanted), MAPS)
            found.append(_Law(entry, own, load_map(file, own)))
        progress(len(found), len(found), MAPS)
    return found


def run_validate(args: Namespace) -> int:
    """Compare the model with measurements and published models, for all fitted sets."""
    from ...friction.sets import friction_set_text
    from ...validation.tables import missing_range, table_text, validation_tables

    if args.plot:
        check_output("--plot", args.plot, "a file *.png")
    if args.machines:
        return _machines(args)
    if args.contacts:
        from ...validation.circle import circle_rows
        from ...validation.section5 import section5_contacts, section5_text

        with progress_bar(QUIET) as progress:
            contacts = section5_contacts(screw_of(args), progress)
        circle = circle_rows()
        if args.json:
            print_results([{"section5": [row._asdict() for row in contacts], "circle": circle}], True, False)
        else:
            print(section5_text(contacts) + "\n\nRolling circle: published multigrid, this solver [m, s]")
            print_results(circle, False, True)
        return 0
    from ...validation.laws import baseline_rows, laws_text, set_row, unfitted_row

    chosen = chosen_of(args)
    laws = _laws(args, chosen)
    if missing := missing_range(laws[0].nut_map.header["axes"]):
        raise ValueError(f"--map {args.map}: {missing}; remedy: a map with this range")
    found = {law.entry.name: validation_tables(law.torque) for law in laws}
    compared = [set_row(law.entry, law.torque) for law in laws]
    compared += [unfitted_row(law.parameters, law.nut_map) for law in laws if law.mechanistic]
    # the closed formulas with the oil of the mechanistic set
    compared += baseline_rows(laws[-1].parameters)
    if args.plot:
        _plot(args, laws)
    if args.json:
        result = {
            **chosen.described,
            "map_hash": laws[0].nut_map.header["file_hash"],
            "version": __version__,
            "tables": {name: [t._asdict() | {"rows": [r._asdict() for r in t.rows]} for t in tables]
                       for name, tables in found.items()},
            "laws": [row._asdict() | {"twelfth": row.twelfth} for row in compared],
            "friction_sets": [vars(law.entry) for law in laws],
        }  # fmt: skip
        print_results([result], True, False)
        return 0
    for law in laws:
        name, kinematics = law.entry.name, law.parameters.friction.kinematics
        print(f"== {law.parameters.name}, kinematics {kinematics}, friction set {name}\n")
        for one in found[name]:
            print(table_text(one) + "\n")
    print(laws_text(compared) + "\n")
    print(friction_set_text([law.entry for law in laws]))
    return 0


def _machines(args: Namespace) -> int:
    """Compare the mechanistic law with bearings, open grooves and foreign screws."""
    from ...validation.machines import machines
    from ...validation.machines_text import machines_json, machines_text

    with progress_bar(QUIET) as progress:
        found = machines(progress)
    if args.plot:
        from ...calibration.plot import save_figure
        from ...validation.machines_figure import machines_figure

        with written("--plot", args.plot):
            save_figure(machines_figure(found), Path(args.plot))
        say(f"written: {args.plot}")
    if args.json:
        print_results([machines_json(found) | {"version": __version__}], True, False)
    else:
        print(machines_text(found))
    return 0


def _plot(args: Namespace, laws: list[_Law]) -> None:
    from ...calibration.plot import save_figure
    from ...validation.shares import Law, shares_figure, shares_text
    from ...validation.tables import ASSUMED_TEMPERATURE

    law = next((law for law in laws if law.mechanistic), None)
    if law is None:
        raise ValueError("--plot: no mechanistic law; allowed: a screw with kinematics rolling_frame")
    shown = Law(law.parameters, law.entry, law.nut_map, ASSUMED_TEMPERATURE)
    figure = shares_figure(shown)
    with written("--plot", args.plot):
        save_figure(figure, Path(args.plot))
    say(f"written: {args.plot}")
    say(shares_text(shown))
