"""Calibration from a file of measured torques, each point by the solver or from a map."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..atlas.ball_contacts import BallContacts
from ..atlas.contact_atlas import OutsideAtlasError
from ..friction.mechanistic import mean_load
from ..friction.origin import with_set
from ..friction.torque import nut_forces
from ..parameters.file import Parameters
from ..parameters.units import RPM
from ..physics.ball_law import Array
from ..physics.hertz import RACEWAYS
from ..physics.load import nut_loads
from ..runtime.packed import MECHANISTIC
from .measurements import Measurement
from .packaged import FILM_OF_SET

if TYPE_CHECKING:
    from ..friction.mechanistic import ContactValues
    from ..friction.torque import FilmModel
    from ..runtime.evaluate import NutMap
    from .packaged import Progress
    from .user import Calibration

    #: name -> film model, or contacts of the mechanistic law
    Films = Callable[[str], FilmModel | ContactValues]


def calibrate(
    measurements: Path | str,
    parameters: Parameters | None = None,
    map_file: Path | str | None = None,
    *,
    name: str | None = None,
    temperature: float | None = None,
    loss: str = "least_squares",
    drop: Collection[str] = (),
    progress: Progress = lambda finished, total, what: None,
) -> Calibration:
    """Fit the friction numbers of a screw to measured torques.

    Parameters   measurements : CSV file, headings with units: preload [N], speed [r/min], torque [N.m], ...
                 parameters : screw and oil (load_screw); None = those of the map file, or the packaged GD4008-3
                 map_file : map of this screw, None = of the atlas; what that does not hold is solved, seconds a point
                 name : friction set to fit; None = that of the screw
                 temperature : of rows without one [K]; None = reference temperature of the oil
                 loss, drop : see calibrate_file;  progress : called during the solves and fits
    Returns      Calibration; load_map(map_file, parameters, calibration.friction_set) takes its numbers
    Raises       ValueError: names file and row; as calibrate_file
    """
    from ..nut_map.file import parameters_for
    from .measurement_file import read_measurement_file
    from .user import calibrate_file

    parameters = parameters_for(map_file, parameters)
    if temperature is None:
        temperature = parameters.lubricant.reference_temperature
    file = read_measurement_file(measurements, temperature)
    films, outside = films_of(parameters, map_file)
    return calibrate_file(
        file, parameters, films, name or parameters.friction.set, loss, drop, outside, progress
    )


def films_of(
    parameters: Parameters, map_file: Path | str | None
) -> tuple[Films, Callable[[Measurement], str]]:
    """Film models by name or contacts of the mechanistic law, and why a point is outside the map, "" if it is not."""
    if map_file is None:
        return lambda film: solved_film(film, parameters), lambda m: ""
    from ..nut_map.file import load_map

    axes = load_map(map_file, parameters).header["axes"]

    def outside(m: Measurement) -> str:
        forces = [force for force in nut_forces(parameters, m.preload, m.axial_load) if force > 0.0]
        checks = (
            ("force of a nut", "N", "force", 1.0, forces),
            ("speed", "r/min", "speed", RPM, [m.speed]),
            ("temperature", "K", "temperature", 1.0, [m.temperature]),
        )
        found = []
        for what, unit, axis, factor, values in checks:
            low, high = axes[axis][:2]
            # a value on the edge of the map may be off by rounding
            if not all(low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9) for value in values):
                shown = ", ".join(f"{value / factor:.6g}" for value in dict.fromkeys(values))
                found.append(
                    f"{what} = {shown} {unit}; allowed: {low / factor:.6g} to {high / factor:.6g} {unit}"
                )
        return "; ".join(found)

    def films(name: str) -> FilmModel | ContactValues:
        if name == BallContacts.name:
            return BallContacts(parameters)
        own = next(key for key, film in FILM_OF_SET.items() if film == name)
        return MapFilm(load_map(map_file, with_set(parameters, own)), parameters)

    return films, outside


class MapFilm:
    """Films of balls by the law of the paper, from the effective films of a nut in its map (friction.torque.FilmModel).

    The effective film of a nut is that of its mean ball but for the square of the spread of the loads.
    """

    def __init__(self, nut_map: NutMap, parameters: Parameters) -> None:
        self.nut_map, self.name, screw = nut_map, str(nut_map.header["film_model"]), parameters.screw
        self._force = np.geomspace(*nut_map.header["axes"]["force"])
        self._load = np.array([mean_load(nut_loads(screw, float(f), screw.ball_count)) for f in self._force])

    def central_film(self, raceway: str, load: Array, speed: float, temperature: float) -> Array:
        """Central film [m] of balls with load (n,) [N] at speed [rad/s] and temperature [K]."""
        force = np.exp(np.interp(np.log(load), np.log(self._load), np.log(self._force)))
        film = 2 + RACEWAYS.index(raceway)
        return np.exp(self.nut_map.surfaces(force, speed, temperature)[film])


def solved_film(name: str, parameters: Parameters) -> FilmModel | ContactValues:
    """Film model by its name, by the solver, or the contacts of the mechanistic law, of the atlas if it holds them."""
    from ..refinement.direct import DirectContacts, DirectFilm

    if name == MECHANISTIC:
        try:
            return BallContacts(parameters)
        except OutsideAtlasError:
            return DirectContacts(parameters)
    return DirectFilm(parameters, name == "solved_thermal")
