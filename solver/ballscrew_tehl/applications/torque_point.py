"""Friction torque of a screw at an operating point with its interval and films, by the map or by direct solves."""

import math
from collections.abc import Callable
from typing import NamedTuple

from ..friction.drag_torque import preload_left
from ..friction.film_shear import double_nut_torque
from ..friction.interval import OperatingPoint, TorqueInterval, torque_interval
from ..friction.mechanistic import double_nut_parts, roughness_of
from ..nut_map.interval import map_interval
from ..nut_map.load import refuse_other_map
from ..runtime.constants import LAMBDA_RATIO_MAX, SMOOTH
from ..runtime.evaluate import NutMap
from ..runtime.nut_law import DoubleNutState
from ..runtime.packed import Law
from .screw_model import ScrewModel
from .trend import unlike_flanks, unphysical_trend


class TorquePoint(NamedTuple):
    """Torque and films of a screw at an operating point; torques are magnitudes."""

    state: DoubleNutState
    interval: TorqueInterval | None  # without seals; None: the law has none, or nothing is loaded
    trend: str = ""  # why the torque goes the wrong way
    unlike: str = ""  # why flanks of oversize balls slip

    def ends(self, seals: float) -> tuple[float, float]:
        """Ends of the interval of the whole torque, with that of the seals [N.m]; NaN: none."""
        if self.interval is None:
            return math.nan, math.nan
        parts = self.state.viscous_torque, self.state.hysteresis_torque, self.state.sliding_torque
        low, high = (float(sum(parts)) * end + seals for end in self.interval.relative)
        return low, high


def torque_at_point(
    screw: ScrewModel, nut_map: NutMap, preload: float, speed: float, temperature: float,
    axial_load: float = 0.0, difference: float = 0.0,
) -> TorquePoint:  # fmt: skip
    """By the map, at a preload [N], speed [rad/s], temperature [K], axial load [N]; difference: screw minus nut [K].

    MapError: a map of another screw

    >>> from ballscrew_tehl.applications.screw_model import screw_model
    >>> screw = screw_model("gd4008_vg100.toml")
    >>> point = torque_at_point(screw, screw.nut_map(), 2000.0, 104.7, 303.15)
    >>> low, high = point.ends(screw.parameters.screw.seal_torque)
    >>> f"{point.state.friction_torque:.2f}, {low:.2f} to {high:.2f} N.m"
    '1.09, 1.04 to 1.22 N.m'
    """
    refuse_other_map(nut_map, screw.parameters)
    at, interval, unlike = (speed, temperature, axial_load), None, ""
    preload = preload_left(screw.parameters, screw.friction_set, preload, difference)
    if (preload > 0.0 or (preload == 0.0 and axial_load)) and nut_map.law == Law.MECHANISTIC:
        interval = map_interval(screw.parameters, nut_map.header["axes"], screw.friction_set, preload, *at)
    state = nut_map.evaluate(preload, *at)
    if interval is not None:
        by_map, true = (
            float(state.friction_torque) - nut_map.seal_torque,
            screw.friction_set.preload_factor * preload,
        )
        unlike = unlike_flanks(screw.parameters, true, axial_load, interval.torque, by_map)
    return TorquePoint(state, interval, unphysical_trend(nut_map, preload, *at).text, unlike)


def solved_torque(screw: ScrewModel) -> tuple[Callable[..., TorquePoint], dict[str, float]]:
    """Torque at points by solves of the contacts: function of preload [N], speed [rad/s], temperature [K] and axial
    load [N]; errors of the grid of these solves against a finer one, by key.
    """
    from ..atlas.contact_atlas import load_atlas
    from ..refinement.contacts import contacts_of
    from ..refinement.direct import DirectContacts, DirectFilm, direct_extremes, rolling_parameters

    parameters, friction_set = screw.parameters, screw.friction_set
    mechanistic = friction_set.law is Law.MECHANISTIC
    height = roughness_of(parameters.friction) if mechanistic else friction_set.roughness_height
    # surface speeds of the paper are not physical: their films are not shown, as by the map
    rolling = rolling_parameters(parameters)
    contacts = DirectContacts(parameters)
    film_model = DirectFilm(parameters)
    factor = friction_set.preload_factor
    errors: dict[str, float] = {}
    if mechanistic:
        around = contacts_of(parameters)
        of_grid = load_atlas().header["certificate"]["of_direct_solves"]
        errors = {f"direct_torque_error_{key}": of_grid[f"torque_error_{key}"] for key in ("mean", "99")}

    def at(preload: float, speed: float, temperature: float, axial_load: float) -> TorquePoint:
        if mechanistic:
            point = OperatingPoint(preload, abs(speed), temperature, axial_load)
            place = parameters, point.forces(parameters, factor), contacts, abs(speed), temperature
            parts = double_nut_parts(*place, *friction_set.values[:2])
            interval = torque_interval(parameters, point, around, friction_set)
        else:
            place_of_paper = preload, speed, temperature, axial_load
            parts, interval = double_nut_torque(parameters, friction_set, film_model, *place_of_paper), None
        extremes = direct_extremes(rolling, factor * preload, axial_load, abs(speed), temperature)
        ratio = min(extremes["film_thickness_min"] / max(height, SMOOTH), LAMBDA_RATIO_MAX)
        # the shares of the relieved nut are not known
        state = DoubleNutState(*parts, **extremes, lambda_ratio=ratio, relieved_viscous_torque=math.nan,
                               relieved_coulomb_torque=math.nan, in_range=True, clamped=())  # fmt: skip
        return TorquePoint(state, interval)

    return at, errors
