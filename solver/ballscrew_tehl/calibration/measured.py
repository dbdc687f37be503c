"""Calibration from a file of measured torques, each point by the solver or from a map."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING

from ..friction.torque import nut_forces
from ..parameters.file import Parameters
from ..parameters.units import RPM
from .measurements import Measurement

if TYPE_CHECKING:
    from ..friction.mechanistic import ContactValues
    from ..friction.torque import FilmModel
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
                 map_file : map of this screw, which gives the films; None = every point is solved, seconds each
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
    from ..nut_map.contact_map import MapContacts, SolvedFilm
    from ..nut_map.file import load_contact_map, load_map

    contact_map = load_contact_map(map_file, parameters)
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
        if name == MapContacts.name:
            return MapContacts(contact_map)
        return SolvedFilm(contact_map, name == "solved_thermal")

    return films, outside


def solved_film(name: str, parameters: Parameters) -> FilmModel | ContactValues:
    """Film model by its name, or the contacts of the mechanistic law, by the solver."""
    from ..refinement.direct import DirectContacts, DirectFilm

    if name == DirectContacts.name:
        return DirectContacts(parameters)
    return DirectFilm(parameters, name == "solved_thermal")
