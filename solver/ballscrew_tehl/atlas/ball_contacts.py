"""Contacts of the balls of one screw, read from the atlas: what the friction law and a map take."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..parameters.file import Parameters
from ..physics.ball_law import Array
from ..physics.hertz import RACEWAYS
from ..physics.load import load_nodes
from ..physics.lubricant import eta0
from ..runtime.packed import MECHANISTIC
from .contact_atlas import ContactAtlas, load_atlas, refuse_groups, refuse_laws
from .groups import (
    QUANTITIES,
    RollingContacts,
    closed_forms,
    rolling_contacts,
    stretched,
    transition,
    unmodelled,
)

if TYPE_CHECKING:
    from scipy.interpolate import NdBSpline

#: nodes over load (speed eta0)^-SLOPE, on which the transition of contacts depends, and over ln(speed eta0); nodes over
#: temperature for each e-fold of the viscosity, for N changes by as much. Between them the atlas is read by cubic
#: splines for one screw: five screws, 6,000 points, 99 % within 0.3 % of film and rolling loss and 0.5 % of the core.
#: With seven temperatures a screw down to -10 C missed hot losses by up to 5 %
TABLE_NODES, SLOPE, OF_VISCOSITY = (49, 33), 0.75 - 0.45 * 0.25, 2.0
#: fewest temperatures: cubic splines need four
MIN_TEMPERATURES = 4
#: ln of loads beyond their range at the corners of the table, which no ball has
BEYOND = 0.7


class BallRange(NamedTuple):
    """Lowest and highest ball load [N], speed [rad/s] and temperature [K]."""

    load: tuple[float, float]
    speed: tuple[float, float]
    temperature: tuple[float, float]


class BallContacts:
    """Contacts of the balls of a screw in pure rolling (friction.mechanistic.ContactValues).

    Parameters   table : range over which values are read between nodes, for many points; None = every point by itself
                 atlas : None = the packaged one
    Raises       OutsideAtlasError: oil, geometry or bodies that the atlas does not hold
    """

    name = MECHANISTIC

    def __init__(
        self, parameters: Parameters, table: BallRange | None = None, atlas: ContactAtlas | None = None
    ) -> None:
        refuse_laws(parameters)
        self.parameters, self.table, self.atlas = parameters, table, atlas or load_atlas()
        self._splines: dict[str, NdBSpline] = {}
        for raceway in RACEWAYS:
            at = self.contacts(
                raceway, *np.array([[1.0], [1.0], [parameters.lubricant.reference_temperature]])
            )
            refuse_groups(self.atlas, closed_forms(at).groups)

    def contacts(self, raceway: str, load: Any, speed: Any, temperature: Any) -> RollingContacts:
        """Contacts at ball loads [N], screw speeds [rad/s] and temperatures [K], which broadcast."""
        return rolling_contacts(self.parameters, raceway, load, speed, temperature)

    def at(self, raceway: str, load: Any, speed: Any, temperature: Any) -> dict[str, Array]:
        """Quantities (SI) at operating points, which broadcast, from the table if there is one."""
        forms = closed_forms(self.contacts(raceway, load, speed, temperature))
        if self.table is None:
            return unmodelled(self.atlas.interpolated(forms), forms.values)
        thick = np.log(speed * eta0(self.parameters.lubricant, temperature))
        x = np.stack(np.broadcast_arrays(np.log(load) - SLOPE * thick, thick, temperature), axis=-1)
        read = np.moveaxis(self._spline(raceway)(x), -1, 0)
        return unmodelled(dict(zip(QUANTITIES, read, strict=True)), forms.values)

    def _spline(self, raceway: str) -> NdBSpline:
        if raceway not in self._splines:
            # takes as long to import as a map to be read, which needs no table
            from scipy.interpolate import NdBSpline, make_interp_spline

            assert self.table is not None
            oil, (loads, speeds, temperatures) = self.parameters.lubricant, self.table
            light, heavy = np.log(loads)
            thinning = math.log(eta0(oil, temperatures[0]) / eta0(oil, temperatures[1]))
            warm = np.linspace(*temperatures, max(math.ceil(OF_VISCOSITY * thinning), MIN_TEMPERATURES))
            thick = np.linspace(
                math.log(speeds[0] * eta0(oil, warm[-1])),
                math.log(speeds[1] * eta0(oil, warm[0])),
                TABLE_NODES[1],
            )
            fine = np.linspace(light - SLOPE * thick[-1], heavy - SLOPE * thick[0], 2001)
            centre = 0.5 * (light + heavy), thick.mean(), warm.mean()
            at = np.exp(centre[0]), np.exp(centre[1]) / eta0(oil, centre[2]), centre[2]
            turn = transition(closed_forms(self.contacts(raceway, *at)).groups)
            even = stretched(fine - (centre[0] - SLOPE * centre[1]) + turn)
            place = np.interp(np.linspace(even[0], even[-1], TABLE_NODES[0]), even, fine)
            nodes = place, thick, warm
            place, thick, warm = np.meshgrid(*nodes, indexing="ij", sparse=True)
            load = np.exp(np.clip(place + SLOPE * thick, light - BEYOND, heavy + BEYOND))
            speed = np.exp(thick) / eta0(oil, warm)
            found = self.atlas.interpolated(closed_forms(self.contacts(raceway, load, speed, warm)))
            table = np.stack(list(found.values()), axis=-1)
            knots = []
            for axis, own in enumerate(nodes):
                spline = make_interp_spline(own, table, axis=axis)
                knots.append(spline.t)
                table = np.moveaxis(spline.c, 0, axis)
            self._splines[raceway] = NdBSpline(tuple(knots), table, 3)
        return self._splines[raceway]

    def inside(self, raceway: str, load: Any, speed: Any, temperature: Any) -> NDArray[np.bool_]:
        """Which operating points lie within the range of every group of the atlas."""
        return self.atlas.inside(closed_forms(self.contacts(raceway, load, speed, temperature)).groups)

    def values(self, raceway: str, load: Array, speed: Array, temperature: Array) -> dict[str, Array]:
        """Quantities (n, s, t) at the ball loads of a nut (n,), speeds (s, 1) and temperatures (t,).

        The loads of one nut lie close together: over them by the polynomial through Chebyshev nodes.
        """
        nodes, weights = load_nodes(load)
        found = self.at(raceway, nodes[:, None, None], speed.reshape(-1, 1), temperature)
        shape = len(load), speed.size, len(temperature)
        return {
            # a mean rise may be none or negative
            name: (weights @ of if name == "mean_rise" else np.exp(weights @ np.log(of))).reshape(shape)
            for name, values in found.items()
            for of in (np.broadcast_to(values, (nodes.size, *shape[1:])).reshape(nodes.size, -1),)
        }
