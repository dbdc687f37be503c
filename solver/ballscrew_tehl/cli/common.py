"""Shared by several commands: screw and map of their options, films by name, keys of the results."""

from __future__ import annotations

import sys
from argparse import Namespace
from typing import TYPE_CHECKING

from ..friction.sets import FrictionSet
from ..parameters.file import Parameters, changed, load_parameters
from .main import FILMS

if TYPE_CHECKING:
    from ..friction.film_model import FilmModel
    from ..runtime.evaluate import NutMap


def say(text: str) -> None:
    print(text, file=sys.stderr)


def screw_of(args: Namespace) -> Parameters:
    """The parameters selected by --screw and --kinematics.

    Raises       ParameterError (a ValueError)
    """
    parameters = load_parameters(args.screw)
    if args.kinematics in (None, parameters.friction.kinematics):
        return parameters
    return changed(parameters, friction={"kinematics": args.kinematics})


def map_of(args: Namespace, parameters: Parameters) -> NutMap:
    from ..nut_map.file import load_map

    return load_map(args.map, parameters)


def warn_of_film(friction_set: FrictionSet, film_model: str) -> None:
    if friction_set.film_model != film_model:
        say(
            f"friction set is fitted with the film model {friction_set.film_model}, the film here is {film_model}"
        )


def film_model_of(name: str, parameters: Parameters) -> FilmModel:
    """Film model by its name: solved, solved_thermal (each contact by the solver) or hamrock_dowson.

    Raises       ValueError: unknown name
    """
    if name == "hamrock_dowson":
        from ..friction.film_model import HamrockDowsonFilm

        return HamrockDowsonFilm(parameters)
    if name not in FILMS:
        raise ValueError(f"film = {name!r}; allowed: {', '.join(FILMS)}")
    from ..refinement.direct import DirectFilm

    return DirectFilm(parameters, thermal=name == "solved_thermal")


#: output of the map -> key of the command line
EXTREMES = {
    "film_thickness_min": "film_thickness_min_m",
    "film_thickness_central_screw": "film_thickness_central_screw_m",
    "film_thickness_central_nut": "film_thickness_central_nut_m",
    "film_temperature_rise": "film_temperature_rise_k",
    "contact_pressure_max": "contact_pressure_max_pa",
    "ball_load_max": "ball_load_max_n",
    "lambda_ratio": "lambda_ratio",
}
