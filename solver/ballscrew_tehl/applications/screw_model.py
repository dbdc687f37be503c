"""A screw with its oil and the numbers of its friction law, and its map: what every answer is computed with."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from ballscrew_tehl.friction import sets
from ballscrew_tehl.friction.drag_torque import drag_torque_set, implied_preload
from ballscrew_tehl.friction.sets import FrictionSet
from ballscrew_tehl.nut_map.grid import Progress
from ballscrew_tehl.parameters.file import PACKAGED_VG100, Parameters, changed, load_screw
from ballscrew_tehl.parameters.friction import PRELOAD_FORCE, Law
from ballscrew_tehl.physics.rating import nsk_torque
from ballscrew_tehl.refinement.contacts import contacts_of
from ballscrew_tehl.runtime.evaluate import NutMap

from .published_formulas import REXROTH, rexroth_torque

FITTED_BY = "give a file that ballscrew calibrate --output has written"


class ScrewModel(NamedTuple):
    """Screw and oil with the numbers of their friction law; no map is read or made yet."""

    parameters: Parameters
    friction_set: FrictionSet
    fitted: FrictionSet | None = None  # the same, of measured torques or a drag torque; None: packaged
    map_file: Path | str | None = None  # None: a packaged or kept map, or one made when it is needed
    notes: Sequence[str] = ()  # what to check in the screw file

    def nut_map(self, progress: Progress | None = None) -> NutMap:
        """Its map, with these numbers; made in some seconds where there is none."""
        from ballscrew_tehl.nut_map.load import load_map

        return load_map(self.map_file, self.parameters, self.fitted, progress)

    @property
    def described(self) -> dict[str, str]:
        """Names of screw, oil, friction set and of the screw of its fit."""
        parameters, friction = self.parameters, self.friction_set
        return {
            "screw": parameters.name, "oil": parameters.lubricant.name, "friction_set": friction.name,
            "friction_screw": friction.screw,
        }  # fmt: skip

    def catalogue_note(self, axial_load: float) -> dict[str, str]:
        """Why a torque differs from that of the catalogue, under its key."""
        notes = ["of the preload alone, without the axial load"] if axial_load else []
        if self.friction_set.law is Law.MECHANISTIC:
            notes.append(sets.catalogue_differs(self.parameters.screw))
        return {"catalogue_note": "; ".join(notes)} if notes else {}

    def printed(self, preload: float) -> dict[str, float]:
        """What catalogues print for a preload [N], and the true one that a drag torque implies."""
        screw = self.parameters.screw
        formulas = {"catalogue_torque_nm": float(nsk_torque(screw, preload))}
        if screw.preload_kind in REXROTH:
            formulas["rexroth_torque_nm"] = rexroth_torque(screw, preload)
        return formulas | implied_preload(self.friction_set, preload)


def read_screw(
    screw: Path | str | None, map_file: Path | str | None = None, default: Path | None = None
) -> Parameters:
    """Parameters of a screw file, else those in a map file, else of a default or the packaged screw file."""
    if screw is None and map_file is not None:
        from ballscrew_tehl.nut_map.load import screw_of_map

        return screw_of_map(map_file)
    return load_screw(default if screw is None else screw)


def model_of(
    parameters: Parameters, fitted: FrictionSet | None = None, map_file: Path | str | None = None
) -> ScrewModel:
    """A screw with fitted numbers, else with those of the drag torque of its file, else with packaged ones.

    ValueError: fitted to another screw
    """
    if fitted is not None:
        sets.refuse_other_fit(fitted, parameters)
        own = sets.with_supply(sets.without_overrides(parameters, fitted.name), fitted)
        return ScrewModel(own, fitted, fitted, map_file)
    delivered, notes = drag_torque_set(parameters, contacts_of), list[str]()
    if delivered and not PRELOAD_FORCE.low <= delivered.preload_factor <= PRELOAD_FORCE.high:
        notes.append(
            f"drag_torque_Nm of the screw file: the true preload is {delivered.preload_factor:.2g} times the "
            f"nominal one, usual are {PRELOAD_FORCE.low:g} to {PRELOAD_FORCE.high:g}: check unit, preload and test"
        )
    numbers = delivered or sets.default_friction_set(parameters)
    return ScrewModel(parameters, numbers, delivered, map_file, notes)


def screw_model(
    screw: Path | str | None = None, map_file: Path | str | None = None, friction: str | None = None,
    tolerance: float | None = None,
) -> ScrewModel:  # fmt: skip
    """A screw by files, and by the name of a packaged friction set or a file of `calibrate`, as commands take them.

    tolerance: for the interval, the oil may be so much warmer or colder [K]; None: as the screw file

    >>> screw_model("example_25x10.toml").described["friction_set"]
    'mechanistic'
    """
    packaged = sets.load_friction_sets()
    file = None if friction is None or friction in packaged else friction
    only_law = friction == Law.MECHANISTIC
    if file is not None:
        if not Path(file).is_file():
            raise ValueError(f"--friction = {file}; allowed: {', '.join(packaged)}, or a file of calibrate")
        only_law = set(sets.load_friction_sets(file, FITTED_BY)) == {Law.MECHANISTIC}
    parameters = read_screw(screw, map_file, PACKAGED_VG100 if only_law else None)
    if tolerance is not None:
        parameters = changed(parameters, lubricant={"temperature_tolerance": tolerance})
    if file is None:
        own = parameters if friction is None else sets.with_law(parameters, friction)
        return model_of(own, map_file=map_file)
    model = model_of(parameters, sets.friction_set_of_file(file, parameters), map_file)
    note = f"drag_torque_Nm of the screw file: not used, for {file} has measured torques"
    return model._replace(notes=[note] if parameters.screw.drag_torque is not None else [])
